//! Stacks of running programs by numbers of their texts: `block_stacking/pick_and_place/pick`.

use crate::program::Program;
use crate::table::TextTable;
use crate::trace::ProgramCall;

/// The paths of an episode's calls, by their numbers among all paths so far, whose texts are kept elsewhere.
#[derive(Default)]
pub(crate) struct ProgramPaths {
    /// By the key of the caller's path, the keys of the paths of what it calls.
    callees: Vec<[Option<u32>; Program::ALL.len()]>,
    of_call: Vec<u32>,
}

impl ProgramPaths {
    /// Takes the calls of the next episode, callers before callees. A call whose caller is not before it is taken for a
    /// root.
    pub(crate) fn note(&mut self, calls: &[ProgramCall], texts: &mut TextTable) {
        self.of_call.clear();
        for call in calls {
            let caller = call.caller.and_then(|caller| self.of_call.get(caller.0 as usize).copied());
            let path = match caller {
                None => texts.key(call.program.name()),
                Some(caller) => self.callee(caller, call.program, texts),
            };
            self.of_call.push(path);
        }
    }

    /// The number of a call's path, by the call's position.
    pub(crate) fn key(&self, position: usize) -> u32 {
        self.of_call.get(position).copied().unwrap_or(0)
    }

    fn callee(&mut self, caller: u32, program: Program, texts: &mut TextTable) -> u32 {
        let caller = caller as usize;
        if self.callees.len() <= caller {
            self.callees.resize(caller + 1, [None; Program::ALL.len()]);
        }
        let known = &mut self.callees[caller][program.index()];
        *known.get_or_insert_with(|| {
            let path = format!("{}/{program}", texts.texts()[caller]);
            texts.key(&path)
        })
    }
}
