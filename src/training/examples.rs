//! Decisions to learn from: a state of one trial, with the window of another trial's demonstration beside it.
//!
//! # Input and output
//!
//! [`DatasetTrials`] → [`Example`]: inputs are the running program, its window of demonstration A and an observation
//! of trial B; labels are what B's expert called there, with spans in A.
//!
//! # Invariants
//!
//! Training tasks alone. A level is a program in a family: each has examples of its own, so that a family of four tasks
//! is learned from as often as one of a thousand beside it. Sub-tasks of A and B are matched by what they do (the
//! arguments of the moves below them) and not by their number, since A and B may differ in how many objects there are.
//! Of several alike in A the first is meant: which of them is a function of the state, the k-th is not. Below a
//! sub-task, calls are matched by step.

use std::collections::BTreeMap;

use rand::Rng;

use crate::dataset::{DatasetTrials, TrialData};
use crate::model::{CalledWith, PictureIndex, ScopingKind, SpecificationRows};
use crate::program::{KnownPrograms, Program};
use crate::scene::SlotIndex;
use crate::task::{Family, Split};
use crate::trace::{Observation, ObservationRows, ProgramCall, Span, SpecificationForm, instruction_spans};
use crate::training::call_tree::{CallTree, moves_below};
use crate::training::sub_task::SubTask;
use crate::training::{Pairing, TrainError};

/// One decision of an expert.
#[derive(Clone, Debug, PartialEq)]
pub struct Example {
    /// Position of A among the dataset's trials.
    pub demonstration: usize,
    /// What the running program sees of A.
    pub window: Span,
    /// Position of B among the dataset's trials.
    pub trial: usize,
    /// The frame of B at which the decision was made.
    pub frame: usize,
    /// What was called.
    pub callee: Program,
    /// Whether the running program ended with it.
    pub end_of_program: bool,
    /// The callee's part, counted from the window's first frame; `None` for what is not learned (primitives, `none`).
    pub scope: Option<Span>,
    /// The slots that the callee was called with, as far as the model decides them.
    pub arguments: Vec<SlotIndex>,
    /// What the running program was called with, where there is no specification.
    pub called_with: CalledWith,
    /// What the next primitive is called with; `None` where it is not a `move_to`.
    pub next_move: Option<SlotIndex>,
    /// Arguments of every move below the running program.
    pub involved: Vec<SlotIndex>,
    /// Whether no primitive comes any more, at this decision or later.
    pub last_decision: bool,
}

/// What is drawn at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grain {
    /// A decision, whichever.
    Decision,
    /// All decisions of a call, in order, for a network that remembers.
    Call,
}

/// The trials of a dataset, indexed for drawing.
#[derive(Debug)]
pub struct Examples<'d> {
    data: &'d DatasetTrials,
    specification: SpecificationForm,
    /// For each trial and call, the callee's part of the trial's specification.
    parts: Vec<Vec<Option<Span>>>,
    scoping: ScopingKind,
    grain: Grain,
    trees: Vec<CallTree>,
    /// Positions of the training trials, by task.
    tasks: Vec<Vec<usize>>,
    /// Which of `tasks` a trial is of.
    task_of_trial: Vec<Option<usize>>,
    levels: Vec<Level>,
}

/// The decisions of one running program in one family.
#[derive(Debug)]
struct Level {
    program: Program,
    family: Family,
    is_root: bool,
    /// Tasks in which it runs.
    tasks: Vec<usize>,
}

impl<'d> Examples<'d> {
    /// Indexes a dataset for single decisions of NTP.
    ///
    /// # Errors
    ///
    /// As [`Self::of`].
    pub fn new(data: &'d DatasetTrials) -> Result<Self, TrainError> {
        Self::of(data, SpecificationForm::Trajectories, ScopingKind::Scoped, Grain::Decision)
    }

    /// Indexes a dataset for what a model decides.
    ///
    /// # Errors
    ///
    /// [`TrainError::NoTrials`] without a training trial; [`TrainError::Trial`] when one does not fit together.
    pub fn of(
        data: &'d DatasetTrials,
        specification: SpecificationForm,
        scoping: ScopingKind,
        grain: Grain,
    ) -> Result<Self, TrainError> {
        let mut by_task: BTreeMap<(Family, &str), Vec<usize>> = BTreeMap::new();
        let (mut trees, mut parts) = (Vec::new(), Vec::new());
        for (position, trial) in data.trials.iter().enumerate() {
            trees.push(CallTree::new(trial, scoping)?);
            parts.push(parts_of(trial, specification)?);
            if trial.split == Split::Seen {
                by_task.entry((trial.family, &trial.task_id)).or_default().push(position);
            }
        }
        let tasks: Vec<Vec<usize>> = by_task.into_values().collect();
        if tasks.is_empty() {
            return Err(TrainError::NoTrials { total: data.trials.len() });
        }
        let mut task_of_trial = vec![None; data.trials.len()];
        let of_tasks =
            tasks.iter().enumerate().flat_map(|(task, trials)| trials.iter().map(move |&trial| (task, trial)));
        of_tasks.for_each(|(task, trial)| task_of_trial[trial] = Some(task));
        let mut levels: BTreeMap<(Family, Program), Level> = BTreeMap::new();
        for (task, trials) in tasks.iter().enumerate() {
            for &trial in trials {
                let (root, family) = (data.trials[trial].calls[0].program, data.trials[trial].family);
                for &program in trees[trial].decisions.keys() {
                    let is_root = program == root;
                    let level = Level { program, family, is_root, tasks: Vec::new() };
                    let level = levels.entry((family, program)).or_insert(level);
                    if level.tasks.last() != Some(&task) {
                        level.tasks.push(task);
                    }
                }
            }
        }
        let levels = levels.into_values().collect();
        Ok(Self { data, specification, parts, scoping, grain, trees, tasks, task_of_trial, levels })
    }

    /// The same trials as a part of more of their one family: levels and tasks are numbered as those of all. A level that runs in none of
    /// these tasks cannot be drawn.
    pub(super) fn among(mut self, levels: &[(Program, bool)], task_ids: &[String]) -> Self {
        let number = |trials: &Vec<usize>| task_ids.binary_search(&self.data.trials[trials[0]].task_id).ok();
        let numbers: Vec<Option<usize>> = self.tasks.iter().map(number).collect();
        let renumbered = |task: Option<usize>| task.and_then(|task| numbers[task]);
        self.task_of_trial = self.task_of_trial.into_iter().map(renumbered).collect();
        let Some(family) = self.data.trials.first().map(|trial| trial.family) else { return self };
        let mut own: BTreeMap<Program, Level> = self.levels.into_iter().map(|level| (level.program, level)).collect();
        let level = |&(program, is_root): &(Program, bool)| {
            own.remove(&program).unwrap_or(Level { program, family, is_root, tasks: Vec::new() })
        };
        self.levels = levels.iter().map(level).collect();
        self
    }

    /// The programs that decide, family by family in the order of the program memory, and whether each is a root.
    pub fn levels(&self) -> impl Iterator<Item = (Program, bool)> {
        self.levels.iter().map(|level| (level.program, level.is_root))
    }

    /// Whether a level runs in any of the trials.
    pub(super) fn has_level(&self, level_idx: usize) -> bool {
        self.levels.get(level_idx).is_some_and(|level| !level.tasks.is_empty())
    }

    /// Slots of the scenes in which a level's program decides.
    pub(super) fn n_slots(&self, level_idx: usize) -> usize {
        self.levels[level_idx].family.n_slots()
    }

    /// Ids of the tasks that are learned from, in order.
    pub fn task_ids(&self) -> Vec<String> {
        self.tasks.iter().map(|trials| self.data.trials[trials[0]].task_id.clone()).collect()
    }

    /// What is learned.
    pub fn scoping(&self) -> ScopingKind {
        self.scoping
    }

    /// The form of the specifications.
    pub fn specification(&self) -> SpecificationForm {
        self.specification
    }

    /// A trial's specification within a span.
    pub fn specification_rows(&self, trial: usize, span: Span) -> SpecificationRows {
        match self.specification {
            SpecificationForm::Trajectories => SpecificationRows::Observations(self.observations(trial, span)),
            SpecificationForm::Instructions => {
                let said = &self.data.trials[trial].instructions[span.begin as usize..span.end as usize];
                SpecificationRows::Sentences(said.iter().map(|instruction| instruction.words).collect())
            }
            SpecificationForm::Video => SpecificationRows::Pictures((span.begin..span.end).map(PictureIndex).collect()),
        }
    }

    /// The observations of some of a trial's frames.
    pub(super) fn observations(&self, trial: usize, frames: Span) -> ObservationRows {
        let TrialData { family, observations, .. } = &self.data.trials[trial];
        let width = Observation::width(family.n_slots());
        let rows = frames.begin as usize * width..frames.end as usize * width;
        ObservationRows::new(family.n_slots(), observations[rows].to_vec())
    }

    /// The dataset behind.
    pub fn data(&self) -> &'d DatasetTrials {
        self.data
    }

    /// The programs that a network must know to learn from them: those of the trials' families.
    pub fn known_programs(&self) -> KnownPrograms {
        self.levels.iter().map(|level| level.family.programs()).max().unwrap_or(KnownPrograms::FIRST)
    }

    /// Draws of a level: a task, a trial of it, a decision in it or all of a call, and the demonstration beside it.
    pub fn draw(&self, level_idx: usize, pairing: Pairing, rng: &mut impl Rng) -> Vec<Example> {
        let level = &self.levels[level_idx];
        loop {
            let trials = &self.tasks[level.tasks[rng.random_range(0..level.tasks.len())]];
            let own = rng.random_range(0..trials.len());
            let Some(decisions) = self.trees[trials[own]].decisions.get(&level.program) else { continue };
            let run = self.grain.draw(decisions, rng);
            let other = match pairing {
                Pairing::Cross if trials.len() > 1 => (own + rng.random_range(1..trials.len())) % trials.len(),
                Pairing::Cross | Pairing::Own => own,
            };
            // Without such a sub-task in the demonstration (a count of zero), the trial's own has it.
            let paired = |demonstration: usize| -> Option<Vec<Example>> {
                run.iter().map(|&call| self.example(trials[own], call, demonstration)).collect()
            };
            if let Some(examples) = paired(trials[other]).or_else(|| paired(trials[own])) {
                return examples;
            }
        }
    }

    /// Draws two trials of a task, or one twice where there is no other.
    pub(super) fn draw_pair(&self, rng: &mut impl Rng) -> [usize; 2] {
        let trials = &self.tasks[rng.random_range(0..self.tasks.len())];
        let own = rng.random_range(0..trials.len());
        let other = if trials.len() > 1 { (own + rng.random_range(1..trials.len())) % trials.len() } else { own };
        [trials[own], trials[other]]
    }

    /// Draws a decision of a level in one of two trials, with the other for a demonstration; nothing when the level's
    /// program does not run there.
    pub(super) fn draw_of_pair(
        &self,
        level_idx: usize,
        [own, other]: [usize; 2],
        pairing: Pairing,
        rng: &mut impl Rng,
    ) -> Option<Example> {
        let decisions = self.trees[own].decisions.get(&self.levels[level_idx].program)?;
        let call = *self.grain.draw(decisions, rng).first()?;
        let demonstration = match pairing {
            Pairing::Cross => other,
            Pairing::Own => own,
        };
        self.example(own, call, demonstration).or_else(|| self.example(own, call, own))
    }

    /// The decision behind a call of a trial, with another trial's demonstration; nothing when that one has no part
    /// like it.
    pub fn example(&self, trial: usize, call: usize, demonstration: usize) -> Option<Example> {
        let calls = &self.data.trials[trial].calls;
        let decided = calls.get(call)?;
        let own_caller = match self.scoping {
            ScopingKind::Primitives => 0,
            ScopingKind::Scoped | ScopingKind::Unscoped | ScopingKind::Arguments => decided.caller?.0 as usize,
        };
        let parts = &self.parts[demonstration];
        let window = match self.scoping {
            ScopingKind::Scoped => parts[self.matching(trial, own_caller, demonstration)?]?,
            ScopingKind::Unscoped | ScopingKind::Primitives | ScopingKind::Arguments => parts[0]?,
        };
        let scope = if self.scoping.has_scopes() && decided.program.is_composite() {
            let part = parts[self.matching(trial, call, demonstration)?]?;
            Some(Span { begin: part.begin - window.begin, end: part.end - window.begin })
        } else {
            None
        };
        let next = calls[call..].iter().find(|call| call.program.is_primitive());
        Some(Example {
            demonstration,
            window,
            trial,
            frame: decided.frames.begin as usize,
            callee: decided.program,
            end_of_program: match self.scoping {
                ScopingKind::Primitives => decided.program == Program::None,
                ScopingKind::Scoped | ScopingKind::Unscoped | ScopingKind::Arguments => decided.end_of_program,
            },
            scope,
            arguments: self.arguments(calls, call),
            called_with: self.called_with(trial, own_caller),
            next_move: next.filter(|call| call.program == Program::MoveTo).and_then(|call| call.argument),
            involved: moves_below(calls, own_caller),
            last_decision: next.is_none(),
        })
    }

    /// The callees of a trial's root that bring one slot to another, in order.
    pub(super) fn sub_tasks(&self, trial: usize) -> Vec<SubTask> {
        let calls = &self.data.trials[trial].calls;
        let sub_task = |(&call, moves): (&usize, &Vec<SlotIndex>)| {
            let (&[source, target], Some(shown)) = (moves.as_slice(), calls[call].output) else { return None };
            let part = self.parts[trial][call]?;
            let last = self.observations(trial, Span { begin: shown.last(), end: shown.end });
            let last = last.get(0)?;
            let (upper, lower) = (last.position(source), last.position(target));
            let offset_m = std::array::from_fn(|axis| upper[axis] - lower[axis]);
            Some(SubTask { program: calls[call].program, source, target, part, offset_m })
        };
        self.trees[trial].signatures.iter().filter_map(sub_task).collect()
    }

    /// What a call names, as far as the model decides it.
    fn arguments(&self, calls: &[ProgramCall], call: usize) -> Vec<SlotIndex> {
        let own = calls[call].argument;
        let slots = own.map_or_else(|| moves_below(calls, call), |slot| vec![slot]);
        let n_arguments = self.scoping.n_arguments_of(calls[call].program);
        slots.into_iter().take(n_arguments).collect()
    }

    /// What a running call was called with: the root with its task, any other with slots.
    fn called_with(&self, trial: usize, call: usize) -> CalledWith {
        let task = self.task_of_trial[trial].filter(|_| call == 0);
        let mut called_with = CalledWith { task, ..CalledWith::default() };
        let slots = self.arguments(&self.data.trials[trial].calls, call);
        called_with.arguments.iter_mut().zip(slots).for_each(|(argument, slot)| *argument = Some(slot));
        called_with
    }

    /// The call of `other` that does what a call of `trial` does.
    fn matching(&self, trial: usize, call: usize, other: usize) -> Option<usize> {
        let calls = &self.data.trials[trial].calls;
        let Some(caller) = calls[call].caller else { return Some(0) };
        let (tree, program) = (&self.trees[other], calls[call].program);
        let candidates = &self.data.trials[other].calls;
        if caller.0 == 0 {
            let signature = self.trees[trial].signatures.get(&call)?;
            let mut alike = tree.callees[0].iter().copied().filter(|&other| candidates[other].program == program);
            return alike.find(|other| tree.signatures.get(other) == Some(signature));
        }
        let caller = self.matching(trial, caller.0 as usize, other)?;
        let found = *tree.callees[caller].get(usize::from(calls[call].step))?;
        (candidates[found].program == program).then_some(found)
    }
}

/// Each call's part of a trial's specification. Every decision is made on one, so a trial without any is refused.
fn parts_of(trial: &TrialData, specification: SpecificationForm) -> Result<Vec<Option<Span>>, TrainError> {
    let parts: Vec<Option<Span>> = match specification {
        SpecificationForm::Trajectories | SpecificationForm::Video => {
            trial.calls.iter().map(|call| call.output).collect()
        }
        SpecificationForm::Instructions => instruction_spans(&trial.calls, &trial.instructions),
    };
    match parts.first() {
        Some(Some(_)) => Ok(parts),
        _ => Err(TrainError::Trial {
            task: trial.task_id.clone(),
            trial: trial.trial,
            problem: format!("it has no {specification} to be specified by"),
        }),
    }
}

impl Grain {
    /// The calls that one draw takes of the calls that a program decided on.
    fn draw(self, decisions: &[Vec<usize>], rng: &mut impl Rng) -> Vec<usize> {
        match self {
            Self::Decision => {
                let n_decisions: usize = decisions.iter().map(Vec::len).sum();
                let nth = rng.random_range(0..n_decisions);
                decisions.iter().flatten().skip(nth).take(1).copied().collect()
            }
            Self::Call => decisions[rng.random_range(0..decisions.len())].clone(),
        }
    }
}
