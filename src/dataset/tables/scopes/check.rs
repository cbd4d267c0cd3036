//! The scoping labels of an episode against the spans of its calls.
//!
//! Labels are many, so runs of them are held against what they should be by one comparison a column; single rows are
//! looked at where it fails.

use std::ops::Range;

use arrow::buffer::BooleanBuffer;

use crate::dataset::DatasetError;
use crate::dataset::files::cursor::{Cursor, Rows};
use crate::dataset::files::finding::Validation;
use crate::dataset::tables::episodes::read::EpisodeRow;
use crate::dataset::tables::scopes;
use crate::table::{batch, count_flags};
use crate::trace::Span;

batch! {
    /// Every column.
    pub(crate) struct ScopeBatch of scopes {
        episode_index,
        call_id,
        specification_frame,
        label,
        is_start,
        is_end,
    }
}

/// A call that has labels.
pub(crate) struct Labelled {
    pub(crate) call: u32,
    /// The frames that are labelled.
    pub(crate) input: Span,
    /// Those inside.
    pub(crate) output: Span,
}

/// Checks the labels of an episode.
pub(crate) fn check(
    cursor: &mut Cursor<ScopeBatch>,
    row: &EpisodeRow,
    calls: impl IntoIterator<Item = Labelled>,
    validation: &mut Validation,
) -> Result<(), DatasetError> {
    let mut n_scopes = 0;
    for Labelled { call, input, output } in calls {
        let mut begin = input.begin;
        while begin < input.end {
            let rows = cursor.next_rows(row.scopes, (input.end - begin) as usize)?;
            let end = begin + rows.range.len() as u32;
            let run = Run { episode: row.episode_index, call: i64::from(call), frames: begin..end, output };
            run.check(&rows, validation)?;
            begin = end;
        }
        n_scopes += input.len() as i64;
    }
    validation.scopes += n_scopes as u64;
    if row.n_scopes != n_scopes {
        let problem =
            format!("n_scopes of episode {} is {}, but its calls make it {n_scopes}", row.episode_index, row.n_scopes);
        return Err(cursor.problem(problem));
    }
    Ok(())
}

/// What some rows of one call should be: labels of frames, one after another.
struct Run {
    episode: i64,
    call: i64,
    frames: Range<u32>,
    output: Span,
}

impl Run {
    fn check(&self, rows: &Rows<'_, ScopeBatch>, validation: &mut Validation) -> Result<(), DatasetError> {
        if !self.has_ids(rows.batch, &rows.range) {
            self.find_ids(rows)?;
        }
        if !self.has_labels(rows.batch, &rows.range) {
            self.find_labels(rows, validation);
        }
        Ok(())
    }

    fn has_ids(&self, batch: &ScopeBatch, range: &Range<usize>) -> bool {
        let frames = i64::from(self.frames.start)..;
        let all = |column: &[i64], expected: i64| column.iter().fold(0, |found, id| found | (id ^ expected)) == 0;
        all(&batch.episode_index[range.clone()], self.episode)
            && all(&batch.call_id[range.clone()], self.call)
            && batch.specification_frame[range.clone()].iter().zip(frames).fold(0, |found, (a, b)| found | (a ^ b)) == 0
    }

    fn find_ids(&self, rows: &Rows<'_, ScopeBatch>) -> Result<(), DatasetError> {
        for (at, frame) in rows.range.clone().zip(self.frames.clone()) {
            let batch = rows.batch;
            let ids = (batch.episode_index[at], batch.call_id[at], batch.specification_frame[at]);
            let expected = (self.episode, self.call, i64::from(frame));
            if ids != expected {
                let names = "(episode_index, call_id, specification_frame)";
                return Err(rows.problem(at, format!("{names} are {ids:?}, but should be {expected:?}")));
            }
        }
        Ok(())
    }

    fn has_labels(&self, batch: &ScopeBatch, range: &Range<usize>) -> bool {
        let labels = self.frames.clone().map(|frame| self.output.label(frame) as i64);
        let differ = batch.label[range.clone()].iter().zip(labels).fold(0, |found, (a, b)| found | (a ^ b)) != 0;
        !differ
            && self.has_flag(&batch.is_start, range, self.output.begin)
            && self.has_flag(&batch.is_end, range, self.output.last())
    }

    /// Whether one frame is flagged, if it is among the rows, and no other.
    fn has_flag(&self, flags: &BooleanBuffer, range: &Range<usize>, frame: u32) -> bool {
        let n_flags = count_flags(flags, range);
        if !self.frames.contains(&frame) {
            return n_flags == 0;
        }
        n_flags == 1 && flags.value(range.start + (frame - self.frames.start) as usize)
    }

    fn find_labels(&self, rows: &Rows<'_, ScopeBatch>, validation: &mut Validation) {
        let Self { episode, call, output, .. } = self;
        for (at, frame) in rows.range.clone().zip(self.frames.clone()) {
            let batch = rows.batch;
            let found = (batch.label[at], batch.is_start.value(at), batch.is_end.value(at));
            let expected = (output.label(frame) as i64, frame == output.begin, frame == output.last());
            if found != expected {
                let message = format!("(label, is_start, is_end) are {found:?}, but the span makes them {expected:?}");
                let place = format!("episode {episode}, call {call}, frame {frame}");
                validation.error("scopes.label", &rows.path(), place, message);
            }
        }
    }
}
