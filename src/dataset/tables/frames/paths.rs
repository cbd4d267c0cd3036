//! Stacks of running programs as texts, each kept once: `block_stacking/pick_and_place/pick`.

use crate::program::Program;
use crate::table::TextTable;
use crate::trace::ProgramCall;

/// The paths of an episode's calls, by their numbers among all paths so far.
#[derive(Default)]
pub(crate) struct ProgramPaths {
    texts: TextTable,
    /// By the key of the caller's path, the keys of the paths of what it calls.
    callees: Vec<[Option<u32>; Program::ALL.len()]>,
    of_call: Vec<u32>,
}

impl ProgramPaths {
    /// Takes the calls of the next episode, callers before callees. A call whose caller is not before it is taken for a
    /// root.
    pub(crate) fn note(&mut self, calls: &[ProgramCall]) {
        self.of_call.clear();
        for call in calls {
            let caller = call.caller.and_then(|caller| self.of_call.get(caller.0 as usize).copied());
            let path = match caller {
                None => self.texts.key(call.program.name()),
                Some(caller) => self.callee(caller, call.program),
            };
            self.of_call.push(path);
        }
    }

    /// The number of a call's path, by the call's position.
    pub(crate) fn key(&self, position: usize) -> u32 {
        self.of_call.get(position).copied().unwrap_or(0)
    }

    /// The path of a call, by the call's position.
    pub(crate) fn text(&self, position: usize) -> &str {
        let key = self.of_call.get(position).copied();
        key.and_then(|key| self.texts().get(key as usize)).map_or("", String::as_str)
    }

    /// All paths so far, in order of their numbers.
    pub(crate) fn texts(&self) -> &[String] {
        self.texts.texts()
    }

    fn callee(&mut self, caller: u32, program: Program) -> u32 {
        let caller = caller as usize;
        if self.callees.len() <= caller {
            self.callees.resize(caller + 1, [None; Program::ALL.len()]);
        }
        let known = &mut self.callees[caller][program.index()];
        *known.get_or_insert_with(|| {
            let path = format!("{}/{program}", self.texts.texts()[caller]);
            self.texts.key(&path)
        })
    }
}
