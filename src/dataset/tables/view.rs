//! One episode as the tables need it: its rows, and its spans counted in rows.

use crate::dataset::ConvertError;
use crate::dataset::config::FrameChoice;
use crate::dataset::files::layout::FilePlace;
use crate::dataset::tables::map::FrameMap;
use crate::trace::{Actor, Boundaries, Episode, Frame, Span};

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
    pub(crate) spans: &'e [CallSpans],
    /// How many frames were recorded.
    pub(crate) n_recorded: u32,
    /// Time of the last one recorded.
    pub(crate) end_nanos: u64,
    /// The position in the recording of each row's frame.
    recorded: &'e [u32],
    /// Whether the episode has the frames of rows alone.
    is_excerpt: bool,
}

/// Where the rows of an episode are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EpisodePlaces {
    pub(crate) episode_index: i64,
    pub(crate) data: FilePlace,
    pub(crate) first_index: i64,
    pub(crate) calls: FilePlace,
    pub(crate) first_call: i64,
    pub(crate) scopes: FilePlace,
    pub(crate) first_scope: i64,
    pub(crate) n_scopes: i64,
}

/// The recording that an episode comes from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Source<'s> {
    pub(crate) file: &'s str,
    pub(crate) sha256: &'s str,
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
        let end_nanos = episode.frames.last().map_or(0, |frame| frame.time_nanos);
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
        let (recorded, n_recorded) = (self.map.recorded(), episode.frames.len() as u32);
        Ok(EpisodeView { episode, spans: &self.spans, n_recorded, end_nanos, recorded, is_excerpt: false })
    }

    /// Maps an episode of which only the boundary frames were read: these are the rows.
    pub(crate) fn view_boundaries<'e>(&'e mut self, boundaries: &'e Boundaries) -> EpisodeView<'e> {
        let (episode, recorded) = (boundaries.episode(), boundaries.recorded());
        self.spans.clear();
        let spans = episode.calls.iter();
        self.spans.extend(spans.map(|call| CallSpans { input: call.input, output: call.output, frames: call.frames }));
        EpisodeView {
            episode,
            spans: &self.spans,
            n_recorded: recorded.count,
            end_nanos: recorded.end_nanos,
            recorded: &recorded.positions,
            is_excerpt: true,
        }
    }
}

/// Whether the specification of an episode is the episode itself.
pub(crate) fn is_own_specification(episode: &Episode) -> bool {
    episode.provenance.actor == Actor::Expert
}

impl<'e> EpisodeView<'e> {
    /// How many rows it has.
    pub(crate) fn n_rows(&self) -> usize {
        self.recorded.len()
    }

    /// The frames that are rows, with their positions in the recording.
    pub(crate) fn frames(self) -> impl Iterator<Item = (u32, &'e Frame)> {
        let frames = &self.episode.frames;
        let frame = move |(row, &recorded): (usize, &u32)| {
            let frame = if self.is_excerpt { row } else { recorded as usize };
            (recorded, &frames[frame])
        };
        self.recorded.iter().enumerate().map(frame)
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
