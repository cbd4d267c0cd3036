//! One episode as the tables need it: its rows, and its spans counted in rows.

use crate::dataset::ConvertError;
use crate::dataset::config::FrameChoice;
use crate::dataset::frame_map::FrameMap;
use crate::trace::{Actor, Episode, Frame, Span};

/// The spans of one call, counted in rows.
///
/// An expert's specification is its own episode, so its input and output are mapped as its frames are. A rollout's is
/// the demonstration that it was given, of which it saw the boundary frames: those spans stay as they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct CallSpans {
    pub(crate) input: Span,
    pub(crate) output: Option<Span>,
    pub(crate) frames: Span,
}

/// An episode, its rows and spans.
#[derive(Clone, Copy)]
pub(crate) struct EpisodeView<'e> {
    pub(crate) episode: &'e Episode,
    pub(crate) map: &'e FrameMap,
    pub(crate) spans: &'e [CallSpans],
}

/// What is used again for each episode.
#[derive(Default)]
pub(crate) struct ViewBuffers {
    map: FrameMap,
    spans: Vec<CallSpans>,
}

impl ViewBuffers {
    /// Maps an episode.
    pub(crate) fn view<'e>(
        &'e mut self,
        episode: &'e Episode,
        choice: FrameChoice,
    ) -> Result<EpisodeView<'e>, ConvertError> {
        self.map.refill(episode.frames.iter().map(|frame| frame.boundary || choice == FrameChoice::All));
        self.spans.clear();
        let is_own = is_own_specification(episode);
        for call in &episode.calls {
            let row_span = |span: Span| {
                self.map.span(span).ok_or_else(|| ConvertError::SpanOffBoundary {
                    episode: episode.provenance.index,
                    call: call.id.0,
                    begin: span.begin,
                    end: span.end,
                })
            };
            let frames = row_span(call.frames)?;
            let (input, output) = if is_own {
                (row_span(call.input)?, call.output.map(row_span).transpose()?)
            } else {
                (call.input, call.output)
            };
            self.spans.push(CallSpans { input, output, frames });
        }
        Ok(EpisodeView { episode, map: &self.map, spans: &self.spans })
    }
}

/// Whether the specification of an episode is the episode itself.
pub(crate) fn is_own_specification(episode: &Episode) -> bool {
    episode.provenance.actor == Actor::Expert
}

impl<'e> EpisodeView<'e> {
    /// How many rows it has.
    pub(crate) fn n_rows(&self) -> usize {
        self.map.n_rows()
    }

    /// The frames that are rows, with their positions in the recording.
    pub(crate) fn frames(self) -> impl Iterator<Item = (u32, &'e Frame)> {
        self.map.recorded().iter().map(move |&frame| (frame, &self.episode.frames[frame as usize]))
    }

    /// Frames of the specification that the spans `input` and `output` count.
    pub(crate) fn specification_frames(&self) -> i64 {
        if is_own_specification(self.episode) {
            self.n_rows() as i64
        } else {
            i64::from(self.episode.specification_frames)
        }
    }
}
