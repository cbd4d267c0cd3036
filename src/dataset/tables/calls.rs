//! The rows of `ntp/calls/`: the program tree. A column is declared and filled here, and nowhere else.

pub(crate) mod check;
pub(crate) mod facts;
pub(crate) mod read;

use crate::dataset::tables::annotated::{AnnotatedCall, ROOT};
use crate::dataset::tables::view::{CallSpans, EpisodeView};
use crate::table::{TableRows as _, table};
use crate::trace::{ProgramCall, sentence};

table! {
    /// `ntp/calls/chunk-*/file-*.parquet`: a row a program call, in the order of calling, a caller before its callees. One step of Algorithm 1 of the paper.
    ///
    /// > Why three spans? What the caller saw (`input`), what it handed on (`output`) and when it happened (`frame`) are the same in an expert's episode and differ in a policy's: there `input` and `output` count the demonstration that the policy was given.
    calls sorted_by("episode_index", "call_id") {
        /// which episode
        episode_index: Int64 delta,
        /// position in its episode; 0 is the root
        call_id: Int64 delta,
        /// who called; null for the root
        caller_id: OptionalInt64 delta,
        /// 0 for the root, else one more than the caller's
        depth: Int64 delta,
        /// how many calls its caller had made before
        step: Int64 delta,
        /// what was called; `none` only ends its caller
        program: Word,
        /// the slot it was called with; for `move_to` alone
        argument_slot: OptionalInt64 delta,
        /// that slot's name
        argument: OptionalWord,
        /// first frame of the specification that the caller could see when it chose this call
        input_begin: Int64 delta,
        /// one past the last
        input_end: Int64 delta,
        /// first frame that the callee may see, its scope; null for `none`
        output_begin: OptionalInt64 delta,
        /// one past the last
        output_end: OptionalInt64 delta,
        /// the episode's own frame at the call
        frame_begin: Int64 delta,
        /// one past the frame at its return
        frame_end: Int64 delta,
        /// whether the caller ended with this step
        end_of_program: Boolean,
        /// the call in words, for a call that calls primitives: `pick block_D`, `drop into bin_2`
        instruction: OptionalWord,
    }
}

impl Rows {
    /// Adds an episode's calls.
    pub(crate) fn append_episode(&mut self, view: &EpisodeView<'_>, episode_index: i64) {
        let scene = &view.episode.scene;
        self.append_tree(&view.episode.calls, view.spans, |slot| scene.slots[slot].name.as_str(), episode_index);
    }

    /// Adds a tree of calls, their spans counted in rows; `name` names the slots.
    pub(crate) fn append_tree<'n>(
        &mut self,
        calls: &[ProgramCall],
        spans: &[CallSpans],
        name: impl Fn(usize) -> &'n str,
        episode_index: i64,
    ) {
        for (position, (call, spans)) in calls.iter().zip(spans).enumerate() {
            self.push(Row {
                episode_index,
                call_id: i64::from(call.id.0),
                caller_id: call.caller.map(|caller| i64::from(caller.0)),
                depth: i64::from(call.depth),
                step: i64::from(call.step),
                program: call.program.name().into(),
                argument_slot: call.argument.map(|slot| i64::from(slot.0)),
                argument: call.argument.map(|slot| name(usize::from(slot.0)).into()),
                input_begin: i64::from(spans.input.begin),
                input_end: i64::from(spans.input.end),
                output_begin: spans.output.map(|span| i64::from(span.begin)),
                output_end: spans.output.map(|span| i64::from(span.end)),
                frame_begin: i64::from(spans.frames.begin),
                frame_end: i64::from(spans.frames.end),
                end_of_program: call.end_of_program,
                instruction: sentence(calls, position, &name).map(Into::into),
            });
        }
    }

    /// Adds the calls of an episode that was annotated elsewhere, callers before callees; `texts` are those of programs.
    pub(crate) fn append_annotated(
        &mut self,
        calls: &[AnnotatedCall],
        texts: &[String],
        episode_index: i64,
        n_frames: i64,
    ) {
        // How many callees each call has had so far, and which was the last of each.
        let mut steps = vec![0; calls.len()];
        let mut last = vec![None; calls.len()];
        for (position, call) in calls.iter().enumerate() {
            if let Some(last) = call.caller.and_then(|caller| last.get_mut(caller as usize)) {
                *last = Some(position);
            }
        }
        for (position, call) in calls.iter().enumerate() {
            let (begin, end) = (i64::from(call.frames.begin), i64::from(call.frames.end));
            let caller = call.caller.map(|caller| caller as usize);
            let step = caller.map_or(0, |caller| steps[caller]);
            if let Some(caller) = caller {
                steps[caller] += 1;
            }
            let text = call.text.and_then(|text| texts.get(text as usize));
            self.push(Row {
                episode_index,
                call_id: position as i64,
                caller_id: caller.map(|caller| caller as i64),
                depth: i64::from(call.depth),
                step,
                program: text.map_or(ROOT, String::as_str).into(),
                argument_slot: None,
                argument: None,
                input_begin: 0,
                input_end: n_frames,
                output_begin: Some(begin),
                output_end: Some(end),
                frame_begin: begin,
                frame_end: end,
                end_of_program: caller.is_some_and(|caller| last[caller] == Some(position)),
                instruction: None,
            });
        }
    }
}
