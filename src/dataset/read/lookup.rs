//! One episode of a dataset, and one of its frames: where it lies, what runs there, where it comes from.

use std::path::Path;

use serde::Serialize;

use crate::artifact::read_json;
use crate::dataset::DatasetError;
use crate::dataset::files::cursor::Cursor;
use crate::dataset::files::info::NtpInfo;
use crate::dataset::files::layout::{self, EPISODES, FilePlace};
use crate::dataset::plain::has_programs;
use crate::dataset::tables::calls::facts::{CallFacts, CallFactsBatch, read_call_facts};
use crate::dataset::tables::episodes::read::{EpisodeRow, EpisodeRows};
use crate::dataset::tables::frames;
use crate::table::{Batch, batch};

/// An episode as `ntp/episodes.parquet` and `ntp/calls/` have it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EpisodeFacts {
    /// Its number in the dataset.
    pub episode_index: i64,
    /// Its task.
    pub task_id: String,
    /// The task in words.
    pub task_text: String,
    /// The task's family.
    pub family: String,
    /// The task's split.
    pub split: String,
    /// Which trial of the task.
    pub trial: i64,
    /// Who acted.
    pub actor: String,
    /// How it ended.
    pub outcome: String,
    /// How many frames.
    pub n_frames: i64,
    /// The file of its frames, relative to the dataset.
    pub data_file: String,
    /// `index` of its first frame.
    pub first_index: i64,
    /// The recording's name.
    pub recording: String,
    /// The recording's SHA-256.
    pub recording_sha256: String,
    /// Its number in its recordings.
    pub recording_index: i64,
    /// Every call, callers before callees.
    pub calls: Vec<CallFacts>,
}

/// One frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FrameFacts {
    /// Its number in the episode.
    pub frame_index: i64,
    /// Its number in the dataset.
    pub index: i64,
    /// Its number among the recorded frames of the episode.
    pub recording_frame: i64,
    /// Simulated time; of imported datasets the time that they give.
    pub time_secs: f64,
    /// Whether a primitive has just ended, or the episode begins. Where spans share no frame, as in imported datasets:
    /// whether a call begins or has just ended.
    pub is_boundary: bool,
    /// The path of running programs, as the frame's label has it.
    pub program: String,
    /// The calls that go on from it, the root first.
    pub stack: Vec<CallFacts>,
}

batch! {
    /// What is known of frames of our own.
    struct FrameBatch of frames {
        index,
        recording_frame,
        time_secs,
        boundary,
        call_id,
        program,
    }
}

batch! {
    /// Frames that were annotated elsewhere.
    struct AnnotatedBatch of frames {
        index,
        timestamp,
        call_id,
        program,
    }
}

/// Looks up an episode, and one of its frames when it is asked for. Programs are taken as texts, so that datasets that
/// were annotated elsewhere can be asked too.
///
/// # Errors
///
/// When there is no such episode or frame, with how many there are; or a table cannot be read.
pub fn look_up(
    root: &Path,
    episode: u64,
    frame: Option<u64>,
) -> Result<(EpisodeFacts, Option<FrameFacts>), DatasetError> {
    check_has_programs(root)?;
    let found = find(root, episode)?;
    let calls = read_calls(root, &found)?;
    let frame = frame.map(|frame| find_frame(root, &found, &calls, frame)).transpose()?;
    Ok((episode_facts(found.row, calls), frame))
}

/// Refuses a dataset in which nothing tells of calls.
pub(crate) fn check_has_programs(root: &Path) -> Result<(), DatasetError> {
    if has_programs(root) {
        return Ok(());
    }
    let problem =
        "it has no program tables, so that nothing tells of its calls; `ntp dataset import` makes them of labels";
    Err(DatasetError::Count { path: root.join(layout::INFO), problem: problem.to_owned() })
}

/// The calls of an episode that was found.
pub(crate) fn read_calls(root: &Path, found: &Found) -> Result<Vec<CallFacts>, DatasetError> {
    let mut cursor = Cursor::<CallFactsBatch>::new(root, layout::CALLS);
    let mut n_before = usize::try_from(found.calls_before).unwrap_or(0);
    while n_before > 0 {
        n_before -= cursor.next_rows(found.row.calls, n_before)?.range.len();
    }
    read_call_facts(&mut cursor, &found.row)
}

/// An episode, and how many rows lie before its own in the files of calls and frames.
pub(crate) struct Found {
    pub(crate) row: EpisodeRow,
    calls_before: i64,
    pub(crate) frames_before: i64,
}

/// Finds an episode by its number.
pub(crate) fn find(root: &Path, episode: u64) -> Result<Found, DatasetError> {
    let (info, rows) = EpisodeRows::open(root)?;
    let (mut calls, mut frames) = ((None, 0), (None, 0));
    for row in rows {
        let row = row?;
        // Where a file begins, rows are counted anew.
        let first = |known: (Option<FilePlace>, i64), place: FilePlace, first: i64| {
            if known.0 == Some(place) { known } else { (Some(place), first) }
        };
        calls = first(calls, row.calls, row.first_call);
        frames = first(frames, row.data, row.first_index);
        if row.episode_index.unsigned_abs() == episode {
            let (calls_before, frames_before) = (row.first_call - calls.1, row.first_index - frames.1);
            return Ok(Found { row, calls_before, frames_before });
        }
    }
    let problem = format!("there is no episode {episode}; there are {}, counted from 0", info.total_episodes);
    Err(DatasetError::Count { path: root.join(EPISODES), problem })
}

fn find_frame(root: &Path, found: &Found, calls: &[CallFacts], frame: u64) -> Result<FrameFacts, DatasetError> {
    let row = &found.row;
    if frame >= row.n_frames.unsigned_abs() {
        let problem = format!("there is no frame {frame}; it has {}, counted from 0", row.n_frames);
        return Err(DatasetError::Episode { path: root.join(EPISODES), episode: row.episode_index, problem });
    }
    let frame = frame as i64;
    let ntp: NtpInfo = read_json(&root.join(layout::NTP_INFO))?;
    if ntp.has_our_programs() {
        return read_frame(root, found, frame, |batch: &FrameBatch, at| FrameFacts {
            frame_index: frame,
            index: batch.index[at],
            recording_frame: batch.recording_frame[at],
            time_secs: batch.time_secs[at],
            is_boundary: batch.boundary.value(at),
            program: batch.program.row(at).to_owned(),
            stack: stack(calls, batch.call_id[at]),
        });
    }
    read_frame(root, found, frame, |batch: &AnnotatedBatch, at| FrameFacts {
        frame_index: frame,
        index: batch.index[at],
        // Its recording is the data that was imported: of that each frame is there.
        recording_frame: frame,
        // To the microsecond, which is more than its four bytes tell.
        time_secs: (f64::from(batch.timestamp[at]) * 1e6).round() / 1e6,
        is_boundary: calls.iter().any(|call| call.frames.map(i64::from).contains(&frame)),
        program: batch.program.row(at).to_owned(),
        stack: stack(calls, batch.call_id[at]),
    })
}

/// Reads the row of a frame.
fn read_frame<B: Batch>(
    root: &Path,
    found: &Found,
    frame: i64,
    facts: impl FnOnce(&B, usize) -> FrameFacts,
) -> Result<FrameFacts, DatasetError> {
    let mut cursor = Cursor::<B>::new(root, layout::DATA);
    let mut n_before = usize::try_from(found.frames_before + frame).unwrap_or(0);
    while n_before > 0 {
        n_before -= cursor.next_rows(found.row.data, n_before)?.range.len();
    }
    let (batch, at) = cursor.next(found.row.data)?;
    Ok(facts(batch, at))
}

/// A call with all its callers, the root first.
fn stack(calls: &[CallFacts], deepest: i64) -> Vec<CallFacts> {
    let of = |id: u32| calls.get(id as usize);
    let first = u32::try_from(deepest).ok().and_then(of);
    // A caller comes before what it calls: a broken tree ends the walk.
    let caller = |call: &&CallFacts| call.caller_id.filter(|&caller| caller < call.call_id).and_then(of);
    let mut stack: Vec<CallFacts> = std::iter::successors(first, caller).cloned().collect();
    stack.reverse();
    stack
}

pub(crate) fn episode_facts(row: EpisodeRow, calls: Vec<CallFacts>) -> EpisodeFacts {
    EpisodeFacts {
        episode_index: row.episode_index,
        task_id: row.task_id,
        task_text: row.task_text,
        family: row.family,
        split: row.split,
        trial: row.trial,
        actor: row.actor,
        outcome: row.outcome,
        n_frames: row.n_frames,
        data_file: row.data.relative(layout::DATA),
        first_index: row.first_index,
        recording: row.recording,
        recording_sha256: row.recording_sha256,
        recording_index: row.recording_index,
        calls,
    }
}
