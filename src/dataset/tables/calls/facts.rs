//! Program calls with their programs and arguments as texts, whatever vocabulary they are of.

use arrow::buffer::ScalarBuffer;
use serde::Serialize;

use crate::dataset::DatasetError;
use crate::dataset::files::cursor::{Batch, Cursor};
use crate::dataset::tables::episodes::read::EpisodeRow;
use crate::table::{Columns, Form, TableError, TextRows};

/// One program call.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CallFacts {
    /// Its number in the episode.
    pub call_id: u32,
    /// Who called it.
    pub caller_id: Option<u32>,
    /// 0 for the root.
    pub depth: u8,
    /// What was called.
    pub program: String,
    /// The slot that it was called with.
    pub argument: Option<String>,
    /// The frames of the specification that its caller saw, half-open.
    pub input: [u32; 2],
    /// Those that it may see itself.
    pub output: Option<[u32; 2]>,
    /// The episode's frames from call to return.
    pub frames: [u32; 2],
}

/// Columns of `ntp/calls/`.
pub(crate) struct CallFactsBatch {
    /// `episode_index`, `call_id`, `depth`.
    numbers: [ScalarBuffer<i64>; 3],
    caller_id: Vec<Option<i64>>,
    program: TextRows,
    argument: TextRows,
    input: [ScalarBuffer<i64>; 2],
    output: [Vec<Option<i64>>; 2],
    frames: [ScalarBuffer<i64>; 2],
}

impl Batch for CallFactsBatch {
    const COLUMNS: &'static [&'static str] = &[
        "episode_index",
        "call_id",
        "caller_id",
        "depth",
        "program",
        "argument",
        "input_begin",
        "input_end",
        "output_begin",
        "output_end",
        "frame_begin",
        "frame_end",
    ];

    fn take(columns: &mut Columns) -> Result<Self, TableError> {
        Ok(Self {
            numbers: [columns.numbers("episode_index")?, columns.numbers("call_id")?, columns.numbers("depth")?],
            caller_id: columns.optional_int64("caller_id")?,
            program: columns.text_rows("program", Form::Required)?,
            argument: columns.text_rows("argument", Form::Optional)?,
            input: [columns.numbers("input_begin")?, columns.numbers("input_end")?],
            output: [columns.optional_int64("output_begin")?, columns.optional_int64("output_end")?],
            frames: [columns.numbers("frame_begin")?, columns.numbers("frame_end")?],
        })
    }
}

impl CallFactsBatch {
    /// The call of a row, which should be the call `id` of an episode; else what is wrong with it.
    fn facts(&self, at: usize, episode_index: i64, id: i64) -> Result<CallFacts, String> {
        let [episode, call_id, depth] = self.numbers.each_ref().map(|column| column[at]);
        if (episode, call_id) != (episode_index, id) {
            let (found, expected) = ((episode, call_id), (episode_index, id));
            return Err(format!("(episode_index, call_id) are {found:?}, but should be {expected:?}"));
        }
        let small = |number: i64| u32::try_from(number).map_err(|_range| format!("call {id} counts {number}"));
        let span = |begin: i64, end: i64| Ok::<_, String>([small(begin)?, small(end)?]);
        Ok(CallFacts {
            call_id: small(call_id)?,
            caller_id: self.caller_id[at].map(small).transpose()?,
            depth: u8::try_from(depth).map_err(|_range| format!("depth is {depth}"))?,
            program: self.program.row(at).to_owned(),
            argument: self.argument.get(at).map(ToOwned::to_owned),
            input: span(self.input[0][at], self.input[1][at])?,
            output: self.output[0][at].zip(self.output[1][at]).map(|(begin, end)| span(begin, end)).transpose()?,
            frames: span(self.frames[0][at], self.frames[1][at])?,
        })
    }
}

/// Reads the calls of the next episode.
pub(crate) fn read_call_facts(
    cursor: &mut Cursor<CallFactsBatch>,
    row: &EpisodeRow,
) -> Result<Vec<CallFacts>, DatasetError> {
    let call = |id: i64| {
        let (batch, at) = cursor.next(row.calls)?;
        let facts = batch.facts(at, row.episode_index, id);
        facts.map_err(|problem| cursor.problem(problem))
    };
    (0..row.n_calls).map(call).collect()
}
