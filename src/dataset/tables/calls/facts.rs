//! Program calls with their programs and arguments as texts, whatever vocabulary they are of.

use serde::Serialize;

use crate::dataset::DatasetError;
use crate::dataset::files::cursor::Cursor;
use crate::dataset::tables::calls;
use crate::dataset::tables::episodes::read::EpisodeRow;
use crate::table::batch;

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

batch! {
    /// What the facts are read from.
    pub(crate) struct CallFactsBatch of calls {
        episode_index,
        call_id,
        caller_id,
        depth,
        program,
        argument,
        input_begin,
        input_end,
        output_begin,
        output_end,
        frame_begin,
        frame_end,
    }
}

impl CallFactsBatch {
    /// The call of a row, which should be the call `id` of an episode; else what is wrong with it.
    fn facts(&self, at: usize, episode_index: i64, id: i64) -> Result<CallFacts, String> {
        let (episode, call_id, depth) = (self.episode_index[at], self.call_id[at], self.depth[at]);
        if (episode, call_id) != (episode_index, id) {
            let (found, expected) = ((episode, call_id), (episode_index, id));
            return Err(format!("(episode_index, call_id) are {found:?}, but should be {expected:?}"));
        }
        let small = |number: i64| u32::try_from(number).map_err(|_range| format!("call {id} counts {number}"));
        let span = |begin: i64, end: i64| Ok::<_, String>([small(begin)?, small(end)?]);
        let output = self.output_begin.get(at).zip(self.output_end.get(at));
        Ok(CallFacts {
            call_id: small(call_id)?,
            caller_id: self.caller_id.get(at).map(small).transpose()?,
            depth: u8::try_from(depth).map_err(|_range| format!("depth is {depth}"))?,
            program: self.program.row(at).to_owned(),
            argument: self.argument.get(at).map(ToOwned::to_owned),
            input: span(self.input_begin[at], self.input_end[at])?,
            output: output.map(|(begin, end)| span(begin, end)).transpose()?,
            frames: span(self.frame_begin[at], self.frame_end[at])?,
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
