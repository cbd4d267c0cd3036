//! The labels of episodes, read one by one.

use std::path::Path;

use crate::dataset::DatasetError;
use crate::dataset::files::cursor::Cursor;
use crate::dataset::files::info::Info;
use crate::dataset::files::layout;
use crate::dataset::tables::calls::read::{CallBatch, read_calls};
use crate::dataset::tables::episodes::read::{EpisodeRow, EpisodeRows};
use crate::dataset::tables::frames;
use crate::dataset::tables::texts::subtask::subtask_text;
use crate::table::batch;
use crate::trace::{ProgramCall, sentence};

/// A label and the frames that have it, half-open.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Label {
    /// Which call.
    pub(crate) call: usize,
    pub(crate) text: String,
    pub(crate) begin: u32,
    pub(crate) end: u32,
}

/// An episode with its calls.
pub(super) struct LabelledEpisode {
    pub(super) row: EpisodeRow,
    pub(super) calls: Vec<ProgramCall>,
    /// Simulated time of each frame.
    pub(super) times_secs: Vec<f64>,
    pub(super) task_index: i64,
}

impl LabelledEpisode {
    /// The root's callees.
    pub(super) fn subtasks(&self) -> Vec<Label> {
        self.labels(|position, call| {
            (call.depth == 1).then(|| subtask_text(&self.calls, position, |slot| self.slot(slot)))
        })
    }

    /// The calls that call primitives, in words.
    pub(super) fn skills(&self) -> Vec<Label> {
        self.labels(|position, _call| sentence(&self.calls, position, |slot| self.slot(slot)))
    }

    /// The primitives.
    pub(super) fn primitives(&self) -> Vec<Label> {
        self.labels(|_position, call| call.program.is_primitive().then(|| call.program.name().to_owned()))
    }

    pub(super) fn slot(&self, slot: usize) -> &str {
        self.row.slots.get(slot).map_or("", String::as_str)
    }

    /// Calls without a frame from which they go on have no label.
    fn labels(&self, text: impl Fn(usize, &ProgramCall) -> Option<String>) -> Vec<Label> {
        let mut labels: Vec<Label> = Vec::new();
        for (position, call) in self.calls.iter().enumerate() {
            let (begin, end) = (call.frames.begin, call.frames.last());
            if let Some(text) = text(position, call).filter(|_text| begin < end) {
                labels.push(Label { call: position, text, begin, end });
            }
        }
        let n_frames = u32::try_from(self.row.n_frames).unwrap_or(u32::MAX);
        if let Some(last) = labels.last_mut().filter(|last| last.end + 1 == n_frames) {
            last.end = n_frames;
        }
        labels
    }
}

batch! {
    struct TimeBatch of frames {
        time_secs,
        task_index,
    }
}

/// Reads the episodes of a dataset in order.
pub(super) struct LabelReader {
    rows: EpisodeRows,
    calls: Cursor<CallBatch>,
    times: Cursor<TimeBatch>,
}

impl LabelReader {
    pub(super) fn open(root: &Path) -> Result<(Info, Self), DatasetError> {
        let (info, rows) = EpisodeRows::open(root)?;
        let (calls, times) = (Cursor::new(root, layout::CALLS), Cursor::new(root, layout::DATA));
        Ok((info, Self { rows, calls, times }))
    }

    fn read(&mut self, row: EpisodeRow) -> Result<LabelledEpisode, DatasetError> {
        let mut calls = Vec::new();
        read_calls(&mut self.calls, &row, &mut calls)?;
        let (mut times_secs, mut task_index) = (Vec::new(), 0);
        for _ in 0..row.n_frames {
            let (batch, at) = self.times.next(row.data)?;
            times_secs.push(batch.time_secs[at]);
            task_index = batch.task_index[at];
        }
        let fits = |call: &&ProgramCall| call.frames.end as usize > times_secs.len();
        if let Some(call) = calls.iter().find(fits) {
            let problem = format!("it ends at frame {}, but there are {}", call.frames.end, times_secs.len());
            let (path, episode, call) = (self.calls.path(), row.episode_index, call.id.0);
            return Err(DatasetError::Call { path, episode, call, problem });
        }
        Ok(LabelledEpisode { row, calls, times_secs, task_index })
    }
}

impl Iterator for LabelReader {
    type Item = Result<LabelledEpisode, DatasetError>;

    fn next(&mut self) -> Option<Self::Item> {
        let row = self.rows.next()?;
        Some(row.and_then(|row| self.read(row)))
    }
}
