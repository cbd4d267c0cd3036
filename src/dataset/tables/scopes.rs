//! The rows of `ntp/scopes/`: the scoping labels that derive from the spans of calls.

pub(crate) mod check;

use std::iter::repeat_n;

use crate::dataset::tables::view::{CallSpans, EpisodeView};
use crate::table::table;
use crate::trace::{ProgramCall, ScopingLabel, Span};

table! {
    /// `ntp/scopes/chunk-*/file-*.parquet`: a row for each call that has a scope and each frame of its caller's window: what a network learns to put out for each frame.
    ///
    /// > Why so long a table? A frame's label depends on the call: the same frame is Inside for one call and Outside for its sibling. Spans in `calls` are the truth; this table spares a learner the derivation.
    scopes sorted_by("episode_index", "call_id") {
        /// which episode
        episode_index: Int64 delta,
        /// which call
        call_id: Int64 delta,
        /// which frame of the specification
        specification_frame: Int64 delta,
        /// 0 start, 1 end, 2 inside, 3 outside; a span of one frame is start
        label: Int64 delta,
        /// whether the call's scope begins at the frame
        is_start: Boolean,
        /// whether it ends at the frame; true together with `is_start` for a span of one frame
        is_end: Boolean,
    }
}

impl Rows {
    /// Adds an episode's labels; returns how many.
    pub(crate) fn append_episode(&mut self, view: &EpisodeView<'_>, episode_index: i64) -> usize {
        self.append_tree(&view.episode.calls, view.spans, episode_index)
    }

    /// Adds the labels of a tree of calls, their spans counted in rows; returns how many.
    pub(crate) fn append_tree(&mut self, calls: &[ProgramCall], spans: &[CallSpans], episode_index: i64) -> usize {
        let before = self.call_id.len();
        for (call, spans) in calls.iter().zip(spans) {
            if let Some(output) = spans.output {
                self.append_call(i64::from(call.id.0), spans.input, output);
            }
        }
        let n_after = self.call_id.len();
        self.episode_index.resize(n_after, episode_index);
        n_after - before
    }

    /// Adds the labels of a call for the frames of its input, but for the number of its episode.
    fn append_call(&mut self, call_id: i64, input: Span, output: Span) {
        self.call_id.extend(repeat_n(call_id, input.len()));
        self.specification_frame.extend(i64::from(input.begin)..i64::from(input.end));
        let first = self.label.len();
        self.label.resize(first + input.len(), ScopingLabel::Outside as i64);
        self.is_start.resize(first + input.len(), false);
        self.is_end.resize(first + input.len(), false);
        let at = |frame: u32| first + (frame - input.begin) as usize;
        self.label[at(output.begin)..=at(output.last())].fill(ScopingLabel::Inside as i64);
        for frame in [output.last(), output.begin] {
            self.label[at(frame)] = output.label(frame) as i64;
        }
        self.is_start[at(output.begin)] = true;
        self.is_end[at(output.last())] = true;
    }
}
