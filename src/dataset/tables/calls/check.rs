//! Calls against the rules of the program tree, and their names and sentences against what they do.

use crate::dataset::DatasetError;
use crate::dataset::files::cursor::Cursor;
use crate::dataset::files::finding::Validation;
use crate::dataset::tables::calls;
use crate::dataset::tables::episodes::read::EpisodeRow;
use crate::table::batch;
use crate::trace::{Cause, Outcome, ProgramCall, check_calls, is_sentence, sentence};
use crate::words::or_nothing;

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

batch! {
    /// Names and sentences.
    pub(crate) struct ArgumentBatch of calls {
        argument,
        instruction,
    }
}

/// Holds the names against the episode's slots, and the sentences against the calls.
pub(crate) fn check_arguments(
    cursor: &mut Cursor<ArgumentBatch>,
    row: &EpisodeRow,
    calls: &[ProgramCall],
    validation: &mut Validation,
) -> Result<(), DatasetError> {
    let name = |slot: usize| row.slots.get(slot).map_or("", String::as_str);
    let mut first = 0;
    while first < calls.len() {
        let rows = cursor.next_rows(row.calls, calls.len() - first)?;
        for (at, position) in rows.range.clone().zip(first..) {
            let call = &calls[position];
            let place = || format!("episode {}, call {}", row.episode_index, call.id.0);
            let (found, said) = (rows.batch.argument.get(at), rows.batch.instruction.get(at));
            if !is_sentence(said, calls, position, name) {
                let message = format!(
                    "instruction is {}, but the call is {}",
                    or_nothing(said),
                    or_nothing(sentence(calls, position, name))
                );
                validation.error("calls.instruction", &rows.path(), place(), message);
            }
            let expected = call.argument.and_then(|slot| row.slots.get(usize::from(slot.0))).map(String::as_str);
            if found != expected {
                let message =
                    format!("argument is {}, but its slot is named {}", or_nothing(found), or_nothing(expected));
                validation.error("calls.argument", &rows.path(), place(), message);
            }
        }
        first += rows.range.len();
    }
    Ok(())
}
