//! A recorded episode without the frames between its boundaries.

use crate::trace::{Actor, Episode, EpisodeParts, ProgramCall, PushProblem, Span, TraceError};

/// The boundary frames of a recorded episode, and where they stood in the recording.
///
/// Reading only these costs a fraction of reading all, and calls begin and return at boundaries.
#[derive(Clone, Debug, PartialEq)]
pub struct Boundaries {
    episode: Episode,
    recorded: RecordedFrames,
}

/// Where the frames of an excerpt stood among the recorded ones.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RecordedFrames {
    /// The number of each frame in the recording, in growing order.
    pub positions: Vec<u32>,
    /// How many frames were recorded.
    pub count: u32,
    /// Time of the last one recorded, since the episode began, in nanoseconds.
    pub end_nanos: u64,
}

impl Boundaries {
    /// Checks the parts, whose frames are the boundaries, but whose spans count all that were recorded. Where the
    /// episode is its own specification, windows are counted anew as well.
    ///
    /// # Errors
    ///
    /// When a span begins or ends between boundaries; else as [`Episode::new`], which the frames that were left out
    /// are not held to.
    pub fn new(mut parts: EpisodeParts, recorded: RecordedFrames) -> Result<Self, TraceError> {
        let is_own_specification = parts.provenance.actor == Actor::Expert;
        for call in &mut parts.calls {
            move_spans(call, &recorded, is_own_specification)?;
        }
        for (number, push) in parts.pushes.iter_mut().enumerate() {
            let off_boundary = PushProblem::OffBoundary { frame: push.frames.end.saturating_sub(1) };
            let moved = recorded.span_around(push.frames);
            push.frames = moved.ok_or(TraceError::Push { push: number, problem: off_boundary })?;
        }
        if is_own_specification && parts.specification_frames == recorded.count {
            parts.specification_frames = parts.frames.len() as u32;
        }
        Ok(Self { episode: Episode::new(parts)?, recorded })
    }

    /// The episode of boundary frames; its spans count these.
    pub fn episode(&self) -> &Episode {
        &self.episode
    }

    /// Where its frames stood in the recording.
    pub fn recorded(&self) -> &RecordedFrames {
        &self.recorded
    }
}

fn move_spans(call: &mut ProgramCall, recorded: &RecordedFrames, is_own_specification: bool) -> Result<(), TraceError> {
    let id = call.id.0;
    let moved = |span: Span| recorded.span(span).ok_or(TraceError::OffBoundary { call: id, span });
    call.frames = moved(call.frames)?;
    if is_own_specification {
        call.input = moved(call.input)?;
        call.output = call.output.map(moved).transpose()?;
    }
    Ok(())
}

impl RecordedFrames {
    /// A span of recorded frames counted in the excerpt's; `None` when its first or last frame is not among them.
    fn span(&self, recorded: Span) -> Option<Span> {
        let position = |frame: u32| self.positions.binary_search(&frame).ok();
        let (first, last) = (position(recorded.begin)?, position(recorded.end.checked_sub(1)?)?);
        Some(Span { begin: first as u32, end: last as u32 + 1 })
    }

    /// The same of a span that may begin between frames of the excerpt: from the one before on.
    fn span_around(&self, recorded: Span) -> Option<Span> {
        let first = self.positions.partition_point(|&position| position <= recorded.begin).checked_sub(1)?;
        let last = self.positions.binary_search(&recorded.end.checked_sub(1)?).ok()?;
        Span::new(first as u32, last as u32 + 1)
    }
}
