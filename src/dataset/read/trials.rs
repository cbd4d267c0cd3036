//! Reads what a learner needs, from the Parquet files alone.
//!
//! # Errors
//!
//! Rows that are missing, swapped or not as another file says, files that are missing or in another's place, columns
//! that are missing: each is a [`DatasetError`] with file and row. Nothing is skipped in silence.

use std::path::Path;

use crate::dataset::tables::calls::read::{read_calls, read_instructions};
use crate::dataset::files::cursor::Cursor;
use crate::dataset::tables::episodes::read::{EpisodeRow, EpisodeRows};
use crate::dataset::tables::map::FrameMap;
use crate::dataset::tables::frames::read::{EpisodeFrames, read_frames};
use crate::dataset::files::info::Info;
use crate::dataset::files::layout;
use crate::dataset::schema::{CALLS, FRAMES};
use crate::dataset::{DatasetError, DatasetTrials, TrialData};
use crate::trace::{Cause, Outcome, ProgramCall, Span, check_calls};

/// Reads the successful episodes of a dataset of demonstrations.
///
/// Where the dataset has all recorded frames, only the boundaries are taken, and the calls' spans count these.
///
/// # Errors
///
/// See the module. An episode that a policy acted is refused: the spans of its calls speak of a demonstration that is
/// not in the dataset.
pub fn read_trials(root: &Path) -> Result<DatasetTrials, DatasetError> {
    let (info, mut rows) = EpisodeRows::open(root)?;
    let n_slots = n_slots(root, &info)?;
    let width = crate::trace::Observation::width(n_slots);
    let mut frame_cursor = Cursor::new(root, layout::DATA, FRAMES);
    let mut call_cursor = Cursor::new(root, layout::CALLS, CALLS);
    let mut instruction_cursor = Cursor::new(root, layout::CALLS, CALLS);
    let mut trials = Vec::new();
    let mut calls = Vec::new();
    while let Some(row) = rows.next() {
        let row = row?;
        let frames = read_frames(&mut frame_cursor, &row, width)?;
        read_calls(&mut call_cursor, &row, &mut calls)?;
        let instructions = read_instructions(&mut instruction_cursor, &row)?;
        if row.is_success {
            let of_episode =
                |problem| DatasetError::Episode { path: rows.path().to_owned(), episode: row.episode_index, problem };
            check_is_demonstration(&row).map_err(of_episode)?;
            check_tree(&row, n_slots, &calls).map_err(|(call, problem)| DatasetError::Call {
                path: call_cursor.path(),
                episode: row.episode_index,
                call,
                problem,
            })?;
            let trial = trial(&row, frames, &calls, width).map_err(of_episode)?;
            trials.push(TrialData { instructions, ..trial });
        }
    }
    frame_cursor.finish()?;
    call_cursor.finish()?;
    instruction_cursor.finish()?;
    Ok(DatasetTrials { n_slots, trials })
}

/// Slots of every scene, from the declared width of `observation.state`.
pub(crate) fn n_slots(root: &Path, info: &Info) -> Result<usize, DatasetError> {
    let name = "observation.state";
    let declared = info.features.0.iter().find(|(feature, _)| feature == name).map(|(_, feature)| &feature.shape[..]);
    match declared {
        Some(&[width]) if width >= 2 && (width - 2) % 3 == 0 => Ok((width - 2) / 3),
        _ => Err(DatasetError::Count {
            path: root.join(layout::INFO),
            problem: format!("the shape of {name} is {declared:?}, but should be [3 * slots + 2]"),
        }),
    }
}

/// Holds the rules of the program tree.
pub(crate) fn check_tree(row: &EpisodeRow, n_slots: usize, calls: &[ProgramCall]) -> Result<(), (u32, String)> {
    let outcome = if row.is_success { Outcome::Success } else { Outcome::Failure(Cause::NeverEnded) };
    let frames = |n: i64| u32::try_from(n).unwrap_or(0);
    check_calls(n_slots, frames(row.n_frames), frames(row.specification_frames), calls, outcome).map_err(|error| {
        match error {
            crate::trace::TraceError::Call { call, problem } => (call, problem.to_string()),
            other => (0, other.to_string()),
        }
    })?;
    let is_own = row.specification == "episode";
    let astray = calls.iter().find(|call| is_own && call.output.is_some_and(|output| output != call.frames));
    astray.map_or(Ok(()), |call| {
        let problem = format!(
            "output is {:?}, but the episode is its own specification and the call ran {:?}",
            call.output, call.frames
        );
        Err((call.id.0, problem))
    })
}

fn check_is_demonstration(row: &EpisodeRow) -> Result<(), String> {
    if row.specification == "episode" {
        return Ok(());
    }
    Err(format!(
        "it was acted by {:?} on a demonstration that is not in the dataset; a learner needs demonstrations, whose \
         specification is the episode",
        row.actor
    ))
}

fn trial(row: &EpisodeRow, frames: EpisodeFrames, calls: &[ProgramCall], width: usize) -> Result<TrialData, String> {
    let map = FrameMap::new(frames.is_boundary);
    let span = |span: Span| map.span(span).ok_or_else(|| format!("{span:?} is not between boundary frames"));
    let on_boundaries = |call: &ProgramCall| {
        Ok::<_, String>(ProgramCall {
            input: span(call.input)?,
            output: call.output.map(span).transpose()?,
            frames: span(call.frames)?,
            ..call.clone()
        })
    };
    Ok(TrialData {
        task_id: row.task_id.clone(),
        family: row.family.parse().map_err(|error| format!("{error}"))?,
        split: row.split.parse().map_err(|error| format!("{error}"))?,
        trial: u32::try_from(row.trial).map_err(|_range| format!("trial is {}", row.trial))?,
        episode: usize::try_from(row.episode_index).unwrap_or(usize::MAX),
        n_frames: frames.observations.len() / width,
        rows: map.recorded().to_vec(),
        observations: frames.observations,
        grippers: frames.grippers,
        calls: calls.iter().map(on_boundaries).collect::<Result<_, _>>()?,
        instructions: Vec::new(),
    })
}
