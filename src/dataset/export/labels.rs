//! The labels of episodes, read one by one.

use std::path::{Path, PathBuf};

use crate::dataset::DatasetError;
use crate::dataset::files::cursor::Cursor;
use crate::dataset::files::info::Info;
use crate::dataset::files::layout;
use crate::dataset::plain::{ProgramTables, program_tables};
use crate::dataset::tables::calls::facts::{CallFacts, CallFactsBatch, read_call_facts};
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

/// The calls of an episode.
pub(super) enum LabelledCalls {
    /// Of programs of ours.
    Own(Vec<ProgramCall>),
    /// Annotated elsewhere: programs are texts.
    Annotated(Vec<CallFacts>),
}

/// An episode with its calls.
pub(super) struct LabelledEpisode {
    pub(super) row: EpisodeRow,
    pub(super) calls: LabelledCalls,
    /// Simulated time of each frame; of what was annotated elsewhere, `timestamp`.
    pub(super) times_secs: Vec<f64>,
    pub(super) task_index: i64,
}

impl LabelledEpisode {
    /// The root's callees.
    pub(super) fn subtasks(&self) -> Vec<Label> {
        match &self.calls {
            LabelledCalls::Own(calls) => self.own(calls, |position, call| {
                (call.depth == 1).then(|| subtask_text(calls, position, |slot| self.slot(slot)))
            }),
            LabelledCalls::Annotated(calls) => annotated(calls, 1),
        }
    }

    /// The calls that call primitives, in words; of annotated ones, the root's callees.
    pub(super) fn skills(&self) -> Vec<Label> {
        match &self.calls {
            LabelledCalls::Own(calls) => {
                self.own(calls, |position, _call| sentence(calls, position, |slot| self.slot(slot)))
            }
            LabelledCalls::Annotated(calls) => annotated(calls, 1),
        }
    }

    /// The primitives; of annotated ones, what the root's callees call.
    pub(super) fn primitives(&self) -> Vec<Label> {
        match &self.calls {
            LabelledCalls::Own(calls) => {
                self.own(calls, |_position, call| call.program.is_primitive().then(|| call.program.name().to_owned()))
            }
            LabelledCalls::Annotated(calls) => annotated(calls, 2),
        }
    }

    /// The finest labels that SARM takes: skills, or what annotated ones call.
    pub(super) fn dense(&self) -> Vec<Label> {
        match &self.calls {
            LabelledCalls::Own(_) => self.skills(),
            LabelledCalls::Annotated(calls) => {
                Some(annotated(calls, 2)).filter(|of| !of.is_empty()).unwrap_or_else(|| self.skills())
            }
        }
    }

    pub(super) fn slot(&self, slot: usize) -> &str {
        self.row.slots.get(slot).map_or("", String::as_str)
    }

    /// The argument of a call in words.
    pub(super) fn argument(&self, call: usize) -> Option<&str> {
        match &self.calls {
            LabelledCalls::Own(calls) => calls[call].argument.map(|slot| self.slot(usize::from(slot.0))),
            LabelledCalls::Annotated(calls) => calls[call].argument.as_deref(),
        }
    }

    /// The position of a call's caller.
    pub(super) fn caller(&self, call: usize) -> Option<usize> {
        match &self.calls {
            LabelledCalls::Own(calls) => calls[call].caller.map(|caller| caller.0 as usize),
            LabelledCalls::Annotated(calls) => calls[call].caller_id.map(|caller| caller as usize),
        }
    }

    /// Calls without a frame from which they go on have no label.
    fn own(&self, calls: &[ProgramCall], text: impl Fn(usize, &ProgramCall) -> Option<String>) -> Vec<Label> {
        let mut labels: Vec<Label> = Vec::new();
        for (position, call) in calls.iter().enumerate() {
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

/// Annotated calls of a depth: they have the frames that were annotated so.
fn annotated(calls: &[CallFacts], depth: u8) -> Vec<Label> {
    let of_depth = calls.iter().enumerate().filter(|(_, call)| call.depth == depth);
    let label = |(position, call): (usize, &CallFacts)| {
        let [begin, end] = call.frames;
        Label { call: position, text: call.program.clone(), begin, end }
    };
    of_depth.map(label).collect()
}

batch! {
    struct TimeBatch of frames {
        time_secs,
        task_index,
    }
}

batch! {
    /// The same of frames that were annotated elsewhere.
    struct AnnotatedTimeBatch of frames {
        timestamp,
        task_index,
    }
}

/// Reads the episodes of a dataset in order.
pub(super) struct LabelReader {
    rows: EpisodeRows,
    tables: LabelTables,
}

enum LabelTables {
    Own(Cursor<CallBatch>, Cursor<TimeBatch>),
    Annotated(Cursor<CallFactsBatch>, Cursor<AnnotatedTimeBatch>),
}

impl LabelReader {
    pub(super) fn open(root: &Path) -> Result<(Info, Self), DatasetError> {
        let (info, rows) = EpisodeRows::open(root)?;
        let tables = match program_tables(root) {
            ProgramTables::Annotated => {
                LabelTables::Annotated(Cursor::new(root, layout::CALLS), Cursor::new(root, layout::DATA))
            }
            _ => LabelTables::Own(Cursor::new(root, layout::CALLS), Cursor::new(root, layout::DATA)),
        };
        Ok((info, Self { rows, tables }))
    }

    fn read(&mut self, row: EpisodeRow) -> Result<LabelledEpisode, DatasetError> {
        let (mut times_secs, mut task_index) = (Vec::new(), 0);
        match &mut self.tables {
            LabelTables::Own(cursor, times) => {
                let mut calls = Vec::new();
                read_calls(cursor, &row, &mut calls)?;
                for _ in 0..row.n_frames {
                    let (batch, at) = times.next(row.data)?;
                    times_secs.push(batch.time_secs[at]);
                    task_index = batch.task_index[at];
                }
                let ends = calls.iter().map(|call| (call.id.0, call.frames.end));
                check_ends(cursor.path(), &row, ends, times_secs.len())?;
                Ok(LabelledEpisode { row, calls: LabelledCalls::Own(calls), times_secs, task_index })
            }
            LabelTables::Annotated(cursor, times) => {
                let calls = read_call_facts(cursor, &row)?;
                for _ in 0..row.n_frames {
                    let (batch, at) = times.next(row.data)?;
                    times_secs.push(f64::from(batch.timestamp[at]));
                    task_index = batch.task_index[at];
                }
                let ends = calls.iter().map(|call| (call.call_id, call.frames[1]));
                check_ends(cursor.path(), &row, ends, times_secs.len())?;
                let calls = LabelledCalls::Annotated(calls);
                Ok(LabelledEpisode { row, calls, times_secs, task_index })
            }
        }
    }
}

/// No call ends behind the last frame.
fn check_ends(
    path: PathBuf,
    row: &EpisodeRow,
    mut ends: impl Iterator<Item = (u32, u32)>,
    n_frames: usize,
) -> Result<(), DatasetError> {
    match ends.find(|(_, end)| *end as usize > n_frames) {
        Some((call, end)) => {
            let problem = format!("it ends at frame {end}, but there are {n_frames}");
            Err(DatasetError::Call { path, episode: row.episode_index, call, problem })
        }
        None => Ok(()),
    }
}

impl Iterator for LabelReader {
    type Item = Result<LabelledEpisode, DatasetError>;

    fn next(&mut self) -> Option<Self::Item> {
        let row = self.rows.next()?;
        Some(row.and_then(|row| self.read(row)))
    }
}
