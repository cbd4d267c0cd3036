//! The labels of program trees, frame by frame, on three levels: what frames are told, and datasets compared by.

use std::path::Path;

use crate::dataset::DatasetError;
use crate::dataset::export::labels::Label;
use crate::dataset::files::cursor::Cursor;
use crate::dataset::files::layout;
use crate::dataset::tables::calls::read::{CallBatch, read_calls};
use crate::dataset::tables::episodes::read::{EpisodeRow, EpisodeRows};
use crate::dataset::tables::frames;
use crate::dataset::tables::texts::subtask::subtask_text;
use crate::table::batch;
use crate::trace::{ProgramCall, sentence};

/// Calls of our programs, with what is needed to put them in words.
#[derive(Clone, Copy)]
pub(crate) struct TreeLabels<'e> {
    pub(crate) calls: &'e [ProgramCall],
    /// Names of the slots.
    pub(crate) slots: &'e [String],
    /// Frames of the episode.
    pub(crate) n_frames: u32,
}

impl<'e> TreeLabels<'e> {
    /// The root's callees.
    pub(crate) fn subtasks(self) -> Vec<Label> {
        self.labels(|position, call| {
            (call.depth == 1).then(|| subtask_text(self.calls, position, |slot| self.slot(slot)))
        })
    }

    /// The calls that call primitives, in words.
    pub(crate) fn skills(self) -> Vec<Label> {
        self.labels(|position, _call| sentence(self.calls, position, |slot| self.slot(slot)))
    }

    /// The primitives with their arguments.
    pub(crate) fn primitives(self) -> Vec<Label> {
        self.labels(|_position, call| {
            let argument = call.argument.map(|slot| format!(" {}", self.slot(usize::from(slot.0))));
            let text = || format!("{}{}", call.program, argument.unwrap_or_default());
            call.program.is_primitive().then(text)
        })
    }

    pub(crate) fn slot(self, slot: usize) -> &'e str {
        self.slots.get(slot).map_or("", String::as_str)
    }

    /// Calls without a frame from which they go on have no label.
    fn labels(self, text: impl Fn(usize, &ProgramCall) -> Option<String>) -> Vec<Label> {
        let mut labels: Vec<Label> = Vec::new();
        for (position, call) in self.calls.iter().enumerate() {
            let (begin, end) = (call.frames.begin, call.frames.last());
            if let Some(text) = text(position, call).filter(|_text| begin < end) {
                labels.push(Label { call: position, text, begin, end });
            }
        }
        if let Some(last) = labels.last_mut().filter(|last| last.end + 1 == self.n_frames) {
            last.end = self.n_frames;
        }
        labels
    }
}

/// A label and the frames that have it, half-open.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameLabel {
    /// What it says.
    pub text: String,
    /// The first frame.
    pub begin: u32,
    /// One past the last.
    pub end: u32,
}

/// An episode with its calls.
pub struct LabelledEpisode {
    row: EpisodeRow,
    calls: Vec<ProgramCall>,
    times_secs: Vec<f64>,
}

batch! {
    struct TimeBatch of frames {
        time_secs,
    }
}

/// The episodes of a dataset whose calls are of our programs, in order.
pub struct LabelledEpisodes {
    rows: EpisodeRows,
    calls: Cursor<CallBatch>,
    times: Cursor<TimeBatch>,
}

impl LabelledEpisodes {
    /// Opens a dataset.
    ///
    /// # Errors
    ///
    /// When it has no such calls, or a table cannot be read.
    pub fn open(root: &Path) -> Result<Self, DatasetError> {
        let (_, rows) = EpisodeRows::open(root)?;
        Ok(Self { rows, calls: Cursor::new(root, layout::CALLS), times: Cursor::new(root, layout::DATA) })
    }

    fn read(&mut self, row: EpisodeRow) -> Result<LabelledEpisode, DatasetError> {
        let mut calls = Vec::new();
        read_calls(&mut self.calls, &row, &mut calls)?;
        let mut times_secs = Vec::new();
        for _ in 0..row.n_frames {
            let (batch, at) = self.times.next(row.data)?;
            times_secs.push(batch.time_secs[at]);
        }
        Ok(LabelledEpisode { row, calls, times_secs })
    }
}

impl Iterator for LabelledEpisodes {
    type Item = Result<LabelledEpisode, DatasetError>;

    fn next(&mut self) -> Option<Self::Item> {
        let row = self.rows.next()?;
        Some(row.and_then(|row| self.read(row)))
    }
}

impl LabelledEpisode {
    /// The recording of ours that it comes from, by hash, and its number there; nothing where it comes from elsewhere.
    pub fn recording(&self) -> Option<(&str, i64)> {
        let row = &self.row;
        let is_known = row.recording.ends_with(".mcap") && !row.recording_sha256.is_empty();
        is_known.then_some((row.recording_sha256.as_str(), row.recording_index))
    }

    /// How many frames it has.
    pub fn n_frames(&self) -> u32 {
        self.times_secs.len() as u32
    }

    /// The time of each frame.
    pub fn times_secs(&self) -> &[f64] {
        &self.times_secs
    }

    /// Every call.
    pub fn calls(&self) -> &[ProgramCall] {
        &self.calls
    }

    /// Its labels: the root's callees, the calls that call primitives, the primitives.
    pub fn levels(&self) -> [Vec<FrameLabel>; 3] {
        let labelled = TreeLabels { calls: &self.calls, slots: &self.row.slots, n_frames: self.n_frames() };
        [labelled.subtasks(), labelled.skills(), labelled.primitives()].map(|labels: Vec<Label>| {
            let frame_label = |Label { text, begin, end, .. }: Label| FrameLabel { text, begin, end };
            labels.into_iter().map(frame_label).collect()
        })
    }
}
