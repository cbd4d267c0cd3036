//! The scoping labels of an episode against the spans of its calls.

use crate::dataset::DatasetError;
use crate::dataset::cursor::{Batch, Cursor};
use crate::dataset::episode_rows::EpisodeRow;
use crate::dataset::finding::Validation;
use crate::table::{Columns, TableError};
use crate::trace::ProgramCall;

/// Every column of `ntp/scopes/`.
pub(super) struct ScopeBatch {
    episode_index: Vec<i64>,
    call_id: Vec<i64>,
    specification_frame: Vec<i64>,
    label: Vec<i64>,
    is_start: Vec<bool>,
    is_end: Vec<bool>,
}

impl Batch for ScopeBatch {
    const COLUMNS: &'static [&'static str] =
        &["episode_index", "call_id", "specification_frame", "label", "is_start", "is_end"];

    fn take(columns: &mut Columns) -> Result<Self, TableError> {
        Ok(Self {
            episode_index: columns.int64("episode_index")?,
            call_id: columns.int64("call_id")?,
            specification_frame: columns.int64("specification_frame")?,
            label: columns.int64("label")?,
            is_start: columns.boolean("is_start")?,
            is_end: columns.boolean("is_end")?,
        })
    }
}

/// Checks the labels of an episode.
pub(super) fn check(
    cursor: &mut Cursor<ScopeBatch>,
    row: &EpisodeRow,
    calls: &[ProgramCall],
    validation: &mut Validation,
) -> Result<(), DatasetError> {
    let mut n_scopes = 0;
    for (call, output) in calls.iter().filter_map(|call| Some((call, call.output?))) {
        for frame in call.input.begin..call.input.end {
            let (batch, at) = cursor.next(row.scopes)?;
            let ids = (batch.episode_index[at], batch.call_id[at], batch.specification_frame[at]);
            let expected = (row.episode_index, i64::from(call.id.0), i64::from(frame));
            if ids != expected {
                let names = "(episode_index, call_id, specification_frame)";
                return Err(cursor.problem(format!("{names} are {ids:?}, but should be {expected:?}")));
            }
            let found = (batch.label[at], batch.is_start[at], batch.is_end[at]);
            let expected = (output.label(frame) as i64, frame == output.begin, frame == output.last());
            if found != expected {
                let message = format!("(label, is_start, is_end) are {found:?}, but the span makes them {expected:?}");
                let place = format!("episode {}, call {}, frame {frame}", row.episode_index, call.id.0);
                validation.error("scopes.label", &cursor.path(), place, message);
            }
            n_scopes += 1;
        }
    }
    validation.scopes += n_scopes as u64;
    if row.n_scopes != n_scopes {
        let problem =
            format!("n_scopes of episode {} is {}, but its calls make it {n_scopes}", row.episode_index, row.n_scopes);
        return Err(cursor.problem(problem));
    }
    Ok(())
}
