//! The rows of `ntp/calls/` and `ntp/scopes/`: the program tree and the scoping labels derived from it.

pub(crate) mod facts;
pub(crate) mod read;

use std::iter::repeat_n;

use crate::dataset::tables::view::{CallSpans, EpisodeView};
use crate::program::Program;
use crate::table::TextTable;
use crate::table::{Values, WriteOptions};
use crate::trace::{ProgramCall, ScopingLabel, sentence};

/// Calls that are not yet written.
#[derive(Default)]
pub(crate) struct CallRows {
    episode_index: Vec<i64>,
    call_id: Vec<i64>,
    caller_id: Vec<Option<i64>>,
    depth: Vec<i64>,
    step: Vec<i64>,
    program: Vec<u32>,
    argument_slot: Vec<Option<i64>>,
    argument: Vec<Option<u32>>,
    input_begin: Vec<i64>,
    input_end: Vec<i64>,
    output_begin: Vec<Option<i64>>,
    output_end: Vec<Option<i64>>,
    frame_begin: Vec<i64>,
    frame_end: Vec<i64>,
    end_of_program: Vec<bool>,
    instruction: Vec<Option<u32>>,
    programs: Vec<String>,
    slots: TextTable,
    sentences: TextTable,
}

impl CallRows {
    pub(crate) fn new() -> Self {
        Self { programs: Program::ALL.map(|program| program.name().to_owned()).into(), ..Self::default() }
    }

    pub(crate) fn n_rows(&self) -> usize {
        self.call_id.len()
    }

    /// What the schema text cannot say of this table.
    pub(crate) fn options() -> WriteOptions {
        WriteOptions {
            delta_encoded: vec![
                "episode_index",
                "call_id",
                "caller_id",
                "depth",
                "step",
                "argument_slot",
                "input_begin",
                "input_end",
                "output_begin",
                "output_end",
                "frame_begin",
                "frame_end",
            ],
            sorted_by: vec!["episode_index", "call_id"],
            ..WriteOptions::default()
        }
    }

    /// Adds an episode's calls.
    pub(crate) fn append(&mut self, view: &EpisodeView<'_>, episode_index: i64) {
        let (calls, scene) = (&view.episode.calls, &view.episode.scene);
        for (position, (call, spans)) in calls.iter().zip(view.spans).enumerate() {
            self.append_call(view, call, *spans);
            let sentence = sentence(calls, position, |slot| &scene.slots[slot].name);
            self.instruction.push(sentence.map(|sentence| self.sentences.key(&sentence)));
        }
        self.episode_index.resize(self.call_id.len(), episode_index);
    }

    fn append_call(&mut self, view: &EpisodeView<'_>, call: &ProgramCall, spans: CallSpans) {
        self.call_id.push(i64::from(call.id.0));
        self.caller_id.push(call.caller.map(|caller| i64::from(caller.0)));
        self.depth.push(i64::from(call.depth));
        self.step.push(i64::from(call.step));
        self.program.push(call.program.index() as u32);
        self.argument_slot.push(call.argument.map(|slot| i64::from(slot.0)));
        self.argument.push(call.argument.map(|slot| self.slots.key(&view.episode.scene.slot(slot).name)));
        self.input_begin.push(i64::from(spans.input.begin));
        self.input_end.push(i64::from(spans.input.end));
        self.output_begin.push(spans.output.map(|span| i64::from(span.begin)));
        self.output_end.push(spans.output.map(|span| i64::from(span.end)));
        self.frame_begin.push(i64::from(spans.frames.begin));
        self.frame_end.push(i64::from(spans.frames.end));
        self.end_of_program.push(call.end_of_program);
    }

    /// The columns of all rows.
    pub(crate) fn columns(&self) -> [(&'static str, Values<'_>); 16] {
        [
            ("episode_index", Values::Int64(&self.episode_index)),
            ("call_id", Values::Int64(&self.call_id)),
            ("caller_id", Values::OptionalInt64(&self.caller_id)),
            ("depth", Values::Int64(&self.depth)),
            ("step", Values::Int64(&self.step)),
            ("program", Values::Word(&self.program, &self.programs)),
            ("argument_slot", Values::OptionalInt64(&self.argument_slot)),
            ("argument", Values::OptionalWord(&self.argument, self.slots.texts())),
            ("input_begin", Values::Int64(&self.input_begin)),
            ("input_end", Values::Int64(&self.input_end)),
            ("output_begin", Values::OptionalInt64(&self.output_begin)),
            ("output_end", Values::OptionalInt64(&self.output_end)),
            ("frame_begin", Values::Int64(&self.frame_begin)),
            ("frame_end", Values::Int64(&self.frame_end)),
            ("end_of_program", Values::Boolean(&self.end_of_program)),
            ("instruction", Values::OptionalWord(&self.instruction, self.sentences.texts())),
        ]
    }

    /// Forgets all rows, but not the texts.
    pub(crate) fn clear(&mut self) {
        [&mut self.episode_index, &mut self.call_id, &mut self.depth, &mut self.step].into_iter().for_each(Vec::clear);
        [&mut self.input_begin, &mut self.input_end, &mut self.frame_begin, &mut self.frame_end]
            .into_iter()
            .for_each(Vec::clear);
        [&mut self.caller_id, &mut self.argument_slot, &mut self.output_begin, &mut self.output_end]
            .into_iter()
            .for_each(Vec::clear);
        self.program.clear();
        self.argument.clear();
        self.instruction.clear();
        self.end_of_program.clear();
    }
}

/// Scoping labels that are not yet written: for each call with an output, each frame of its input.
#[derive(Default)]
pub(crate) struct ScopeRows {
    episode_index: Vec<i64>,
    call_id: Vec<i64>,
    specification_frame: Vec<i64>,
    label: Vec<i64>,
    is_start: Vec<bool>,
    is_end: Vec<bool>,
}

impl ScopeRows {
    pub(crate) fn n_rows(&self) -> usize {
        self.call_id.len()
    }

    /// What the schema text cannot say of this table.
    pub(crate) fn options() -> WriteOptions {
        WriteOptions {
            delta_encoded: vec!["episode_index", "call_id", "specification_frame", "label"],
            sorted_by: vec!["episode_index", "call_id"],
            ..WriteOptions::default()
        }
    }

    /// Adds an episode's labels; returns how many.
    pub(crate) fn append(&mut self, view: &EpisodeView<'_>, episode_index: i64) -> usize {
        let before = self.n_rows();
        for (call, spans) in view.episode.calls.iter().zip(view.spans) {
            self.append_call(i64::from(call.id.0), *spans);
        }
        let n_after = self.n_rows();
        self.episode_index.resize(n_after, episode_index);
        n_after - before
    }

    fn append_call(&mut self, call_id: i64, spans: CallSpans) {
        let Some(output) = spans.output else { return };
        let input = spans.input;
        self.call_id.extend(repeat_n(call_id, input.len()));
        self.specification_frame.extend(i64::from(input.begin)..i64::from(input.end));
        let first = self.label.len();
        self.label.resize(first + input.len(), ScopingLabel::Outside as i64);
        self.is_start.resize(first + input.len(), false);
        self.is_end.resize(first + input.len(), false);
        let at = |frame: u32| first + (frame - input.begin) as usize;
        self.label[at(output.begin)..=at(output.last())].fill(ScopingLabel::Inside as i64);
        for frame in [output.last(), output.begin] {
            self.label[at(frame)] = output.label(frame) as i64;
        }
        self.is_start[at(output.begin)] = true;
        self.is_end[at(output.last())] = true;
    }

    /// The columns of all rows.
    pub(crate) fn columns(&self) -> [(&'static str, Values<'_>); 6] {
        [
            ("episode_index", Values::Int64(&self.episode_index)),
            ("call_id", Values::Int64(&self.call_id)),
            ("specification_frame", Values::Int64(&self.specification_frame)),
            ("label", Values::Int64(&self.label)),
            ("is_start", Values::Boolean(&self.is_start)),
            ("is_end", Values::Boolean(&self.is_end)),
        ]
    }

    /// Forgets all rows.
    pub(crate) fn clear(&mut self) {
        [&mut self.episode_index, &mut self.call_id, &mut self.specification_frame, &mut self.label]
            .into_iter()
            .for_each(Vec::clear);
        [&mut self.is_start, &mut self.is_end].into_iter().for_each(Vec::clear);
    }
}
