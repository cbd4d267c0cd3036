//! Mini-batches: drawn examples, augmented, as the numbers that networks read and losses compare with.
//!
//! # Shapes
//!
//! Targets are dense: one-hot labels, already divided by how many labels the whole mini-batch has, so that a loss is
//! a plain sum and the parts of a split mini-batch add up.

use rand::Rng;

use crate::model::{CalledWith, Pictures, States, Windows};
use crate::program::Program;
use crate::seed::Seed;
use crate::trace::{ScopingLabel, Span};
use crate::training::TrainError;
use crate::training::augment::Views;
use crate::training::config::TrainConfig;
use crate::training::examples::{Example, Examples};
use crate::training::recovery::{self, Moment};

/// Frames in a mini-batch from which on it is split in two parts of about the same length of windows: less padding,
/// and a part for each of two cores. A fixed number, since the sum of gradients must not depend on the machine.
const SPLIT_FRAMES: usize = 192;

/// Parts that are learned from together, with the pictures that they look at.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Group {
    /// Each once; none where observations are read.
    pub pictures: Pictures,
    /// Their decisions.
    pub parts: Vec<Part>,
}

impl From<Part> for Group {
    fn from(part: Part) -> Self {
        Self { parts: vec![part], ..Self::default() }
    }
}

/// A part of a mini-batch, all of one running program.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Which of the step's mini-batches it is part of.
    pub batch_idx: usize,
    /// Which of [`Examples::levels`].
    pub level_idx: usize,
    /// The running program.
    pub program: Program,
    /// How its decisions follow one another: see [`crate::model::Network`].
    pub steps: Vec<usize>,
    /// What it sees of the demonstrations.
    pub windows: Windows,
    /// What is seen now, one each.
    pub states: States,
    /// `[B, programs]`
    pub programs: Vec<f32>,
    /// One where the program ends, `[B]`.
    pub ends: Vec<f32>,
    /// Weight of each example for program and end: one over the mini-batch's size.
    pub weight: f32,
    /// `[B, T, 4]`; nothing without labels.
    pub scopes: Option<Vec<f32>>,
    /// `[B * arguments, N]`, see [`crate::model::ScopingKind::n_arguments`]; nothing without labels.
    pub arguments: Option<Vec<f32>>,
    /// What each running program was called with.
    pub called_with: Vec<CalledWith>,
}

/// Decisions of one call that are learned together, all with the same window.
pub(super) struct Run {
    pub(super) decisions: Vec<Views>,
}

impl Run {
    fn window_len(&self) -> usize {
        self.decisions.first().map_or(0, |prepared| prepared.example.window.len())
    }

    fn n_frames(&self) -> usize {
        self.window_len() * self.decisions.len()
    }
}

/// Draws a mini-batch of a level, of `size` decisions or, where they come in calls, a few more. It depends on nothing
/// but its arguments.
///
/// # Errors
///
/// [`TrainError::Read`] when the decisions do not go together: a bug.
pub fn draw(
    examples: &Examples<'_>,
    config: &TrainConfig,
    level_idx: usize,
    size: usize,
    seed: Seed,
) -> Result<Vec<Part>, TrainError> {
    let mut rng = seed.rng();
    let is_root = examples.levels().nth(level_idx).is_some_and(|(_, is_root)| is_root);
    let mut runs: Vec<Run> = Vec::new();
    let mut n_drawn = 0;
    while n_drawn < size {
        let run = examples.draw(level_idx, config.pairing, &mut rng);
        n_drawn += run.len();
        runs.push(prepare_run(examples, config, is_root, run, &mut rng));
    }
    runs.sort_by_key(Run::window_len);
    let n_frames: usize = runs.iter().map(Run::n_frames).sum();
    let middle = if n_frames > SPLIT_FRAMES { balanced(&runs, n_frames) } else { runs.len() };
    let counts = Counts::of(runs.iter().flat_map(|run| &run.decisions));
    let long = runs.split_off(middle);
    let parts = [long, runs].into_iter().filter(|part| !part.is_empty());
    parts.map(|part| assemble(examples, level_idx, part, counts)).collect()
}

/// Where to split runs that are sorted by the length of their windows so that both parts have about as many frames.
fn balanced(runs: &[Run], n_frames: usize) -> usize {
    let mut before = 0;
    let frames = runs.iter().map(Run::n_frames);
    let short = frames.take_while(|frames| {
        before += frames;
        2 * before <= n_frames
    });
    short.count()
}

/// Step by step: the first decision of every run, then the second of those that have one, and so on, with the longest
/// runs first; and how many there are of each.
fn packed(mut runs: Vec<Run>) -> (Vec<Views>, Vec<usize>) {
    runs.sort_by_key(|run| std::cmp::Reverse(run.decisions.len()));
    let mut rest: Vec<_> = runs.into_iter().map(|run| run.decisions.into_iter()).collect();
    let (mut decisions, mut steps) = (Vec::new(), Vec::new());
    loop {
        let step: Vec<Views> = rest.iter_mut().filter_map(Iterator::next).collect();
        if step.is_empty() {
            return (decisions, steps);
        }
        steps.push(step.len());
        decisions.extend(step);
    }
}

/// How many labels a mini-batch has.
#[derive(Clone, Copy)]
pub(super) struct Counts {
    examples: usize,
    scoped_frames: usize,
    arguments: usize,
}

impl Counts {
    pub(super) fn of<'d>(drawn: impl Iterator<Item = &'d Views> + Clone) -> Self {
        let scoped = drawn.clone().filter(|prepared| prepared.example.scope.is_some());
        Self {
            examples: drawn.clone().count(),
            scoped_frames: scoped.map(|prepared| prepared.example.window.len()).sum(),
            arguments: drawn.map(|prepared| prepared.example.arguments.len()).sum(),
        }
    }
}

/// Augments the decisions of a run all in the same way: they are moments of one world.
fn prepare_run(
    examples: &Examples<'_>,
    config: &TrainConfig,
    is_root: bool,
    run: Vec<Example>,
    rng: &mut (impl Rng + Clone),
) -> Run {
    let Some(family) = run.first().map(|example| examples.data().trials[example.trial].family) else {
        return Run { decisions: Vec::new() };
    };
    let moment = |example: Example| {
        let now = Span { begin: example.frame as u32, end: example.frame as u32 + 1 };
        Moment { state: examples.observations(example.trial, now), example }
    };
    let mut moments: Vec<Moment> = run.into_iter().map(moment).collect();
    // One draw, whatever the settings: see `Views::augment`.
    let mut recovery = Seed(rng.random()).rng();
    let recovers = recovery.random::<f32>() < config.recovery_states.unwrap_or_default();
    if recovers && is_root && examples.scoping().has_scopes() && family.builds_towers() {
        let sub_tasks = examples.sub_tasks(moments[0].example.demonstration);
        moments = recovery::disturbed(&sub_tasks, moments, &mut recovery);
    }
    let at_first = rng.clone();
    let prepare = |Moment { example, state }| {
        *rng = at_first.clone();
        let mut views = Views {
            n_slots: family.n_slots(),
            window: examples.specification_rows(example.demonstration, example.window),
            state: States::Observations(state),
            example,
        };
        views.augment(family, config, rng);
        views
    };
    Run { decisions: moments.into_iter().map(prepare).collect() }
}

pub(super) fn assemble(
    examples: &Examples<'_>,
    level_idx: usize,
    runs: Vec<Run>,
    counts: Counts,
) -> Result<Part, TrainError> {
    let (part, steps) = packed(runs);
    let n_slots = examples.n_slots(level_idx);
    let n_programs = examples.known_programs().count();
    let windows = Windows::new(n_slots, &part.iter().map(|prepared| &prepared.window).collect::<Vec<_>>())?;
    let weight = 1.0 / counts.examples as f32;
    let one_hot = |width: usize, hot: Option<usize>, value: f32| {
        (0..width).map(move |column| if Some(column) == hot { value } else { 0.0 })
    };
    let programs =
        part.iter().flat_map(|prepared| one_hot(n_programs, Some(prepared.example.callee.index()), weight)).collect();
    let arguments = part.iter().any(|prepared| !prepared.example.arguments.is_empty()).then(|| {
        let value = 1.0 / counts.arguments as f32;
        let slots = |prepared: &Views| {
            let named = prepared.example.arguments.iter().map(|slot| Some(usize::from(slot.0)));
            named.chain(std::iter::repeat(None)).take(examples.scoping().n_arguments()).collect::<Vec<_>>()
        };
        part.iter().flat_map(slots).flat_map(|slot| one_hot(n_slots, slot, value)).collect()
    });
    let scoped = part.iter().any(|prepared| prepared.example.scope.is_some());
    let scopes = scoped.then(|| scope_targets(&part, windows.n_frames(), 1.0 / counts.scoped_frames as f32));
    Ok(Part {
        batch_idx: 0,
        level_idx,
        program: examples.levels().nth(level_idx).map_or(Program::None, |(program, _)| program),
        steps,
        windows,
        states: States::concat(part.iter().map(|prepared| &prepared.state))?,
        programs,
        ends: part.iter().map(|prepared| f32::from(u8::from(prepared.example.end_of_program))).collect(),
        weight,
        scopes,
        arguments,
        called_with: part.iter().map(|prepared| prepared.example.called_with).collect(),
    })
}

/// `[B, T, 4]`, zero where a frame has no label.
fn scope_targets(part: &[Views], n_frames: usize, value: f32) -> Vec<f32> {
    let n_labels = ScopingLabel::ALL.len();
    let mut targets = vec![0.0; part.len() * n_frames * n_labels];
    for (prepared, frames) in part.iter().zip(targets.chunks_exact_mut((n_frames * n_labels).max(1))) {
        let Some(scope) = prepared.example.scope else { continue };
        for (frame, labels) in frames.chunks_exact_mut(n_labels).take(prepared.example.window.len()).enumerate() {
            labels[scope.label(frame as u32) as usize] = value;
        }
    }
    targets
}
