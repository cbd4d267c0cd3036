//! Reads what a learner needs, from the Parquet files alone.
//!
//! # Errors
//!
//! Rows that are missing, swapped or not as another file says, files that are missing or in another's place, columns
//! that are missing: each is a [`DatasetError`] with file and row. Nothing is skipped in silence.

use std::path::Path;

use crate::dataset::files::cursor::Cursor;
use crate::dataset::files::layout;
use crate::dataset::read::trial_spool::{SpoolWriter, TrialSpool};
use crate::dataset::tables::calls::check::check_tree;
use crate::dataset::tables::calls::read::{read_calls, read_instructions};
use crate::dataset::tables::episodes::read::{EpisodeRow, EpisodeRows};
use crate::dataset::tables::frames::feature::n_slots;
use crate::dataset::tables::frames::read::{EpisodeFrames, read_frames};
use crate::dataset::tables::map::FrameMap;
use crate::dataset::{DatasetError, DatasetTrials, TrialData};
use crate::trace::{ProgramCall, Span};

/// Reads the successful episodes of a dataset of demonstrations.
///
/// Where the dataset has all recorded frames, only the boundaries are taken, and the calls' spans count these.
///
/// # Errors
///
/// See the module. An episode that a policy acted is refused: the spans of its calls speak of a demonstration that is
/// not in the dataset.
pub fn read_trials(root: &Path) -> Result<DatasetTrials, DatasetError> {
    let mut trials = Vec::new();
    let n_slots = visit_trials(root, |trial| {
        trials.push(trial);
        Ok(())
    })?;
    Ok(DatasetTrials { n_slots, trials })
}

/// The trials that a learner takes: in memory, or on disk where there are too many.
#[derive(Debug)]
pub enum LearnedTrials {
    /// All of them.
    Here(DatasetTrials),
    /// In a file.
    OnDisk(TrialSpool),
}

/// Reads the episodes that a learner takes, as [`read_trials`] does. When they have more than `most_frames` boundary frames
/// they go into a file without a name in `folder`.
///
/// # Errors
///
/// As [`read_trials`], and when that file cannot be written.
pub fn read_learned_trials(
    root: &Path,
    is_taken: impl Fn(&TrialData) -> bool,
    most_frames: u64,
    folder: &Path,
) -> Result<LearnedTrials, DatasetError> {
    let mut here: Vec<TrialData> = Vec::new();
    let mut n_frames = 0;
    let mut spool: Option<SpoolWriter> = None;
    let n_slots = visit_trials(root, |trial| {
        if !is_taken(&trial) {
            return Ok(());
        }
        n_frames += trial.n_frames as u64;
        if spool.is_none() && n_frames > most_frames {
            let mut writer = SpoolWriter::new(folder)?;
            std::mem::take(&mut here).iter().try_for_each(|trial| writer.push(trial))?;
            spool = Some(writer);
        }
        match &mut spool {
            Some(spool) => spool.push(&trial)?,
            None => here.push(trial),
        }
        Ok(())
    })?;
    Ok(match spool {
        Some(spool) => LearnedTrials::OnDisk(spool.finish(n_slots)?),
        None => LearnedTrials::Here(DatasetTrials { n_slots, trials: here }),
    })
}

/// Reads the successful episodes one after another; tells how many slots each has.
fn visit_trials(
    root: &Path,
    mut visit: impl FnMut(TrialData) -> Result<(), DatasetError>,
) -> Result<usize, DatasetError> {
    let (info, mut rows) = EpisodeRows::open(root)?;
    let n_slots = n_slots(root, &info)?;
    let width = crate::trace::Observation::width(n_slots);
    let mut frame_cursor = Cursor::new(root, layout::DATA);
    let mut call_cursor = Cursor::new(root, layout::CALLS);
    let mut instruction_cursor = Cursor::new(root, layout::CALLS);
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
            visit(TrialData { instructions, ..trial })?;
        }
    }
    frame_cursor.finish()?;
    call_cursor.finish()?;
    instruction_cursor.finish()?;
    Ok(n_slots)
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
    let span = |span: Span| map.span(span).ok_or_else(|| format!("frames {span} are not between boundary frames"));
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
