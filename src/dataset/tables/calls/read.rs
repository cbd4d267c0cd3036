//! Reads the rows of `ntp/calls/` back into calls.

use crate::dataset::DatasetError;
use crate::dataset::files::cursor::Cursor;
use crate::dataset::tables::calls;
use crate::dataset::tables::episodes::read::EpisodeRow;
use crate::program::Program;
use crate::scene::SlotIndex;
use crate::table::batch;
use crate::trace::{CallId, Instruction, ProgramCall, Span, Vocabulary};

batch! {
    /// What a program tree is read from.
    pub(crate) struct CallBatch of calls {
        episode_index,
        call_id,
        caller_id,
        depth,
        step,
        program,
        argument_slot,
        input_begin,
        input_end,
        output_begin,
        output_end,
        frame_begin,
        frame_end,
        end_of_program,
    }
}

impl CallBatch {
    /// The call of a row of an episode, with what is wrong with it as a text.
    fn call(&self, at: usize, episode_index: i64) -> Result<ProgramCall, String> {
        if self.episode_index[at] != episode_index {
            return Err(format!("episode_index is {}, but {episode_index} comes next", self.episode_index[at]));
        }
        let small = |name: &str, value: i64| u32::try_from(value).map_err(|_range| format!("{name} is {value}"));
        let span = |name: &str, begin: i64, end: i64| {
            let ends = (small(name, begin)?, small(name, end)?);
            Span::new(ends.0, ends.1).ok_or_else(|| format!("{name} is the empty span {begin}..{end}"))
        };
        let output = match (self.output_begin.get(at), self.output_end.get(at)) {
            (Some(begin), Some(end)) => Some(span("output", begin, end)?),
            (None, None) => None,
            (begin, end) => return Err(format!("output begins at {begin:?} and ends at {end:?}")),
        };
        let argument = self.argument_slot.get(at).map(|slot| small("argument_slot", slot)).transpose()?;
        let program: Program = self.program.row(at).parse().map_err(|unknown| format!("{unknown}"))?;
        Ok(ProgramCall {
            id: CallId(small("call_id", self.call_id[at])?),
            caller: self.caller_id.get(at).map(|caller| small("caller_id", caller)).transpose()?.map(CallId),
            depth: u8::try_from(self.depth[at]).map_err(|_range| format!("depth is {}", self.depth[at]))?,
            step: u16::try_from(self.step[at]).map_err(|_range| format!("step is {}", self.step[at]))?,
            program,
            argument: argument.map(|slot| SlotIndex(u16::try_from(slot).unwrap_or(u16::MAX))),
            input: span("input", self.input_begin[at], self.input_end[at])?,
            output,
            frames: span("frames", self.frame_begin[at], self.frame_end[at])?,
            end_of_program: self.end_of_program.value(at),
            prediction: None,
        })
    }
}

/// Reads the calls of the next episode.
pub(crate) fn read_calls(
    cursor: &mut Cursor<CallBatch>,
    row: &EpisodeRow,
    calls: &mut Vec<ProgramCall>,
) -> Result<(), DatasetError> {
    calls.clear();
    let n_calls = usize::try_from(row.n_calls).unwrap_or(0);
    while calls.len() < n_calls {
        let rows = cursor.next_rows(row.calls, n_calls - calls.len())?;
        for at in rows.range.clone() {
            let call = rows.batch.call(at, row.episode_index).map_err(|problem| rows.problem(at, problem))?;
            calls.push(call);
        }
    }
    Ok(())
}

batch! {
    /// The instructions.
    pub(crate) struct InstructionBatch of calls {
        instruction,
    }
}

/// Reads the instructions of the next episode.
pub(crate) fn read_instructions(
    cursor: &mut Cursor<InstructionBatch>,
    row: &EpisodeRow,
) -> Result<Vec<Instruction>, DatasetError> {
    let vocabulary = Vocabulary::new(row.slots.iter().map(String::as_str));
    let mut instructions = Vec::new();
    for call in 0..row.n_calls {
        let (batch, at) = cursor.next(row.calls)?;
        let words = batch.instruction.get(at).map(|sentence| vocabulary.words(sentence)).transpose();
        match words {
            Ok(words) => instructions.extend(words.map(|words| Instruction { call: CallId(call as u32), words })),
            Err(unknown) => return Err(cursor.problem(unknown.to_string())),
        }
    }
    Ok(instructions)
}
