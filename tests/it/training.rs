//! Examples, batches, the training loop, and that something is learned.

use std::cell::Cell;
use std::path::Path;

use ntp::dataset::{DatasetTrials, TrialData, TrialSpool};
use ntp::model::{CONFIG_FILE, Decoder, ModelConfig, ScopingKind, SpecificationRows, Variant, WEIGHTS_FILE};
use ntp::program::Program;
use ntp::rollout::{Limits, Start, load_policy, run};
use ntp::scene::SlotIndex;
use ntp::seed::Seed;
use ntp::task::{Family, Split, Task, sample};
use ntp::trace::{Actor, Episode, ObservationNoise, Provenance, Span, SpecificationForm, Vocabulary, instructions};
use ntp::training::{
    Curriculum, Example, Examples, Grain, Hooks, METRICS, METRICS_FILE, Metric, Pairing, Place, Source, TrainConfig,
    TrainError, TrainSummary, Training, TrialStream, draw, train, train_at,
};

use crate::kinematic::{KinematicWorld, demonstration, sorting, tower, trial};

pub(crate) fn trial_data(episode: &Episode) -> TrialData {
    let frames = episode.boundary_frames().map(|(_, frame)| frame.observation().to_flat());
    TrialData {
        task_id: episode.provenance.task_id.clone(),
        family: episode.provenance.family,
        split: episode.provenance.split,
        trial: episode.provenance.trial,
        episode: 0,
        n_frames: episode.frames.len(),
        rows: (0..episode.frames.len() as u32).collect(),
        observations: frames.flatten().collect(),
        grippers: episode.boundary_frames().map(|(_, frame)| frame.gripper()).collect(),
        calls: episode.calls.clone(),
        instructions: instructions(&episode.calls, &episode.scene.slots),
    }
}

fn demonstrations(tasks: &[Task], n_trials: u32) -> DatasetTrials {
    let of_task = |task: &Task| -> Vec<TrialData> {
        (0..n_trials).map(|idx| trial_data(&demonstration(task, &trial(task, idx, 1), 0))).collect()
    };
    DatasetTrials { n_slots: 8, trials: tasks.iter().flat_map(of_task).collect() }
}

fn towers() -> DatasetTrials {
    demonstrations(&[tower("a", &[0, 1, 2], Split::Seen), tower("b", &[5, 3], Split::Seen)], 3)
}

fn ntp(config: TrainConfig) -> Training {
    Training { variant: Variant::NTP, specification: SpecificationForm::default(), seed: 0, config }
}

fn resolved(config: TrainConfig) -> TrainConfig {
    ntp(config).resolved().config
}

fn span(begin: u32, end: u32) -> Span {
    Span { begin, end }
}

/// The calls of trial 0 by caller's program, in order.
fn decisions(data: &DatasetTrials, trial: usize, program: Program) -> Vec<usize> {
    let calls = &data.trials[trial].calls;
    let decided_by =
        |call: &usize| calls[*call].caller.is_some_and(|caller| calls[caller.0 as usize].program == program);
    (0..calls.len()).filter(decided_by).collect()
}

#[test]
fn labels_of_stacking_are_the_demonstrations_spans() {
    let data = towers();
    let examples = Examples::new(&data).unwrap();
    let labels = |program: Program| -> Vec<Example> {
        decisions(&data, 0, program).into_iter().map(|call| examples.example(0, call, 1).unwrap()).collect()
    };
    let root = labels(Program::BlockStacking);
    assert_eq!(
        root.iter().map(|example| example.scope).collect::<Vec<_>>(),
        [Some(span(0, 5)), Some(span(4, 9)), None]
    );
    assert_eq!(root.iter().map(|example| example.frame).collect::<Vec<_>>(), [0, 4, 8]);
    assert_eq!((root[2].callee, root[2].end_of_program, root[2].last_decision), (Program::None, true, true));
    let second = &labels(Program::PickAndPlace)[2..];
    assert_eq!((second[0].window, second[0].scope, second[0].end_of_program), (span(4, 9), Some(span(0, 3)), false));
    assert_eq!((second[1].callee, second[1].scope, second[1].end_of_program), (Program::Place, Some(span(2, 5)), true));
    let picks = labels(Program::Pick);
    assert_eq!(
        (picks[0].arguments.as_slice(), picks[0].window, picks[0].scope),
        ([SlotIndex(1)].as_slice(), span(0, 3), None)
    );
    assert_eq!((picks[1].callee, picks[1].arguments.len(), picks[1].next_move), (Program::Grip, 0, None));
    assert_eq!(picks[2].next_move, Some(SlotIndex(2)));
}

#[test]
fn a_flat_model_learns_the_primitives_from_the_whole_demonstration() {
    let data = towers();
    let examples = Examples::of(&data, SpecificationForm::default(), ScopingKind::Primitives, Grain::Call).unwrap();
    assert_eq!(examples.levels().collect::<Vec<_>>(), [(Program::BlockStacking, true)]);
    let mut rng = Seed(1).rng();
    let mut run = examples.draw(0, Pairing::Cross, &mut rng);
    while data.trials[run[0].trial].task_id != "b" {
        run = examples.draw(0, Pairing::Cross, &mut rng);
    }
    let seen: Vec<_> = run
        .iter()
        .map(|step| (step.callee, step.arguments.first().copied(), step.frame, step.end_of_program))
        .collect();
    let slot = |slot| Some(SlotIndex(slot));
    assert_eq!(
        seen,
        [
            (Program::MoveTo, slot(3), 0, false),
            (Program::Grip, None, 1, false),
            (Program::MoveTo, slot(5), 2, false),
            (Program::Release, None, 3, false),
            (Program::None, None, 4, true),
        ]
    );
    assert!(run.iter().all(|step| step.window == span(0, 5) && step.scope.is_none()));
}

#[test]
fn without_scopes_every_program_learns_from_the_whole_demonstration() {
    let data = towers();
    let examples = Examples::of(&data, SpecificationForm::default(), ScopingKind::Unscoped, Grain::Decision).unwrap();
    assert_eq!(examples.levels().count(), 4);
    let mut rng = Seed(1).rng();
    for level in 0..4 {
        for example in (0..20).flat_map(|_| examples.draw(level, Pairing::Cross, &mut rng)) {
            let n_frames = data.trials[example.demonstration].n_frames as u32;
            assert_eq!((example.window, example.scope), (span(0, n_frames), None));
        }
    }
}

#[test]
fn npi_learns_what_programs_are_called_with() {
    let data = towers();
    let examples = Examples::of(&data, SpecificationForm::default(), ScopingKind::Arguments, Grain::Call).unwrap();
    assert_eq!(examples.task_ids(), ["a", "b"]);
    let of = |program: Program| -> Example {
        let trial = data.trials.iter().position(|trial| trial.task_id == "b").unwrap();
        examples.example(trial, decisions(&data, trial, program)[0], trial).unwrap()
    };
    let slots = |slots: [u16; 2]| slots.map(SlotIndex);
    let root = of(Program::BlockStacking);
    assert_eq!((root.called_with.task, root.called_with.arguments), (Some(1), [None, None]));
    assert_eq!(root.arguments, slots([3, 5]));
    let below = of(Program::PickAndPlace);
    assert_eq!((below.called_with.task, below.called_with.arguments), (None, slots([3, 5]).map(Some)));
    assert_eq!((below.callee, below.arguments.as_slice()), (Program::Pick, &slots([3, 5])[..1]));
    let lowest = of(Program::Place);
    assert_eq!(lowest.called_with.arguments, [Some(SlotIndex(5)), None]);
    assert_eq!((lowest.callee, lowest.arguments.as_slice()), (Program::MoveTo, &slots([5, 3])[..1]));
}

#[test]
fn the_steps_of_a_call_are_packed_step_by_step() {
    let data = towers();
    let examples = Examples::of(&data, SpecificationForm::default(), ScopingKind::Scoped, Grain::Call).unwrap();
    let config = resolved(TrainConfig { relabel_slots: Some(1.0), ..TrainConfig::default() });
    for level in 0..4 {
        for part in draw(&examples, &config, level, 24, Seed(2)).unwrap() {
            assert_eq!(part.steps.iter().sum::<usize>(), part.ends.len());
            assert!(part.steps.is_sorted_by(|a, b| a >= b), "{:?}", part.steps);
            // The last of a call's steps ends its program, and no other does.
            let mut begin = 0;
            for (step, &n_calls) in part.steps.iter().enumerate() {
                let after = part.steps.get(step + 1).copied().unwrap_or(0);
                let expected: Vec<f32> = (0..n_calls).map(|call| f32::from(u8::from(call >= after))).collect();
                assert_eq!(part.ends[begin..begin + n_calls], expected);
                begin += n_calls;
            }
        }
    }
}

#[test]
fn sub_tasks_are_matched_by_what_they_do_when_counts_differ() {
    let task = sorting("m", [0, 2, 2, 1], Split::Seen);
    let episodes = [1, 2].map(|count| trial_data(&demonstration(&task, &trial(&task, count.into(), count), 0)));
    let data = DatasetTrials { n_slots: 8, trials: episodes.to_vec() };
    let examples = Examples::new(&data).unwrap();
    // The second trial brings two of each category; its 4th and 5th sub-task are of the 2nd and 3rd category.
    let root = decisions(&data, 1, Program::ObjectSorting);
    let scope =
        |sub_task: usize, demonstration: usize| examples.example(1, root[sub_task], demonstration).unwrap().scope;
    assert_eq!([scope(3, 0), scope(4, 0)], [Some(span(4, 9)), Some(span(8, 13))]);
    assert_eq!([scope(2, 1), scope(3, 1)], [Some(span(8, 13)); 2], "of several alike the first is meant");
    let call = decisions(&data, 1, Program::Drop)[2 * 3];
    let drop = examples.example(1, call, 0).unwrap();
    assert_eq!((drop.window, drop.arguments), (span(6, 9), vec![SlotIndex(6)]));
}

#[test]
fn cross_pairing_takes_another_trial_and_own_pairing_the_same() {
    let data = towers();
    let examples = Examples::new(&data).unwrap();
    let mut rng = Seed(1).rng();
    for level in 0..examples.levels().count() {
        for _ in 0..50 {
            let cross = examples.draw(level, Pairing::Cross, &mut rng).remove(0);
            assert_ne!(cross.demonstration, cross.trial);
            assert_eq!(data.trials[cross.demonstration].task_id, data.trials[cross.trial].task_id);
            let own = examples.draw(level, Pairing::Own, &mut rng).remove(0);
            assert_eq!(own.demonstration, own.trial);
        }
    }
}

#[test]
fn unseen_tasks_are_never_learned_from() {
    let mut data = towers();
    data.trials.extend(demonstrations(&[tower("c", &[6, 7], Split::Unseen)], 2).trials);
    let examples = Examples::new(&data).unwrap();
    let mut rng = Seed(1).rng();
    let drawn = (0..100).flat_map(|_| examples.draw(0, Pairing::Cross, &mut rng));
    assert!(drawn.collect::<Vec<_>>().into_iter().all(|example| data.trials[example.trial].split == Split::Seen));
}

#[test]
fn a_mini_batchs_targets_sum_to_one_over_its_parts() {
    let data = towers();
    let examples = Examples::new(&data).unwrap();
    let config = resolved(TrainConfig::default());
    for level in 0..examples.levels().count() {
        let parts = draw(&examples, &config, level, 48, Seed(4)).unwrap();
        let sum = |values: &dyn Fn(&ntp::training::Part) -> f32| parts.iter().map(values).sum::<f32>();
        assert!((sum(&|part| part.programs.iter().sum()) - 1.0).abs() < 1e-4);
        let scopes = sum(&|part| part.scopes.iter().flatten().sum());
        let arguments = sum(&|part| part.arguments.iter().flatten().sum());
        let is_leaf = matches!(parts[0].program, Program::Pick | Program::Place);
        let (expected_scopes, expected_arguments) = if is_leaf { (0.0, 1.0) } else { (1.0, 0.0) };
        assert!((scopes - expected_scopes).abs() < 1e-4 && (arguments - expected_arguments).abs() < 1e-4);
    }
}

#[test]
fn a_gripper_is_jittered_only_where_the_decision_stays_right() {
    let data = towers();
    let examples = Examples::new(&data).unwrap();
    let always = resolved(TrainConfig { gripper_jitter: Some(1.0), ..TrainConfig::default() });
    let never = TrainConfig { gripper_jitter: Some(0.0), ..always.clone() };
    let states = |config: &TrainConfig, level: usize| -> Vec<Vec<f32>> {
        let parts = draw(&examples, config, level, 32, Seed(4)).unwrap();
        let rows = |part: &ntp::training::Part| part.states.observations().unwrap().values().to_vec();
        parts.iter().flat_map(|part| rows(part).chunks(26).map(<[f32]>::to_vec).collect::<Vec<_>>()).collect()
    };
    let place = examples.levels().position(|(program, _)| program == Program::Place).unwrap();
    assert_eq!(states(&always, place), states(&never, place), "a gripper that holds something stays");
    let root = states(&always, 0).iter().zip(states(&never, 0)).filter(|(a, b)| *a != b).count();
    assert!(root > 16, "{root} of 32 moved");
}

/// Trains into a folder, stopping after some steps when asked to.
fn train_until(
    training: &Training,
    data: &DatasetTrials,
    folder: &Path,
    stop: Option<u32>,
) -> Result<TrainSummary, TrainError> {
    let done = Cell::new(0);
    let mut on_progress = |progress: ntp::training::Progress| done.set(progress.step);
    let should_stop = || stop.is_some_and(|stop| done.get() >= stop);
    train(training, data, folder, &mut Hooks { on_progress: &mut on_progress, should_stop: &should_stop })
}

fn weights(training: &Training, data: &DatasetTrials) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    train_until(training, data, folder.path(), None).unwrap();
    std::fs::read(folder.path().join(WEIGHTS_FILE)).unwrap()
}

fn train_from(start: &Path, training: &Training, data: &DatasetTrials, folder: &Path) -> Result<(), TrainError> {
    let mut hooks = Hooks { on_progress: &mut |_| {}, should_stop: &|| false };
    let place = Place { start: Some(start), ..Place::new(folder) };
    train_at(place, training, Source::Here(data, None), &mut hooks).map(|_| ())
}

#[test]
fn a_training_begins_with_the_weights_of_another_model_and_refuses_those_of_another_network() {
    let data = towers();
    let [first, further, other] = [(); 3].map(|()| tempfile::tempdir().unwrap());
    let learned = TrainConfig { steps: Some(60), batch: 8, ..TrainConfig::default() };
    train_until(&ntp(learned.clone()), &data, first.path(), None).unwrap();
    // One step of no length: what it ends with is what it began with.
    let still = TrainConfig { steps: Some(1), learning_rate: Some(1e-30), ..learned.clone() };
    train_from(first.path(), &ntp(still.clone()), &data, further.path()).unwrap();
    let read = |folder: &Path| std::fs::read(folder.join(WEIGHTS_FILE)).unwrap();
    assert!(read(further.path()) == read(first.path()), "it began with other weights");
    assert_ne!(weights(&ntp(still.clone()), &data), read(first.path()));

    let wider = ntp(TrainConfig { scope_kernel: Some(7), ..still.clone() });
    let error = train_from(first.path(), &wider, &data, other.path()).unwrap_err().to_string();
    assert!(error.contains("start_from is") && error.contains("whose network is"), "{error}");
    assert!(error.contains("\"scope_kernel\":5") && error.contains("\"scope_kernel\":7"), "{error}");
    let recurrent = Training { variant: Variant::NTP_GRU, ..ntp(still) };
    let error = train_from(first.path(), &recurrent, &data, other.path()).unwrap_err().to_string();
    assert!(error.contains("whose variant is ntp; allowed: ntp_gru"), "{error}");
    let error = train_from(other.path(), &ntp(learned), &data, other.path()).unwrap_err().to_string();
    assert!(error.contains("config.json"), "{error}");
}

#[test]
fn the_learning_rate_rises_stays_and_falls() {
    let config = TrainConfig {
        steps: Some(1000),
        learning_rate: Some(0.002),
        warmup_steps: 100,
        stable_steps: 400,
        final_learning_rate: 0.0,
        ..TrainConfig::default()
    };
    let at = |step: u32| (config.learning_rate_at(step) * 1e6).round();
    // Half of the rise; its end; the end of the plateau; half of the fall, where a cosine is at its middle.
    assert_eq!([at(49), at(99), at(500), at(750)], [1000.0, 2000.0, 2000.0, 1000.0]);
    assert!(at(999) < 1.0);
}

#[test]
fn a_loss_that_is_no_number_ends_the_training_with_step_and_level_and_keeps_the_checkpoint_before() {
    let data = towers();
    let folder = tempfile::tempdir().unwrap();
    let config = TrainConfig {
        steps: Some(40),
        batch: 8,
        learning_rate: Some(1e37),
        warmup_steps: 0,
        clip_norm: 1e30,
        checkpoint_every: 1,
        ..TrainConfig::default()
    };
    let error = train_until(&ntp(config), &data, folder.path(), None).unwrap_err();
    let TrainError::NotFinite { step, level, found } = error else { panic!("{error}") };
    assert!(step > 1 && !found.is_finite(), "step {step}: {found}");
    assert!(Program::ALL.iter().any(|program| program.name() == level), "{level}");
    let said = TrainError::NotFinite { step, level, found }.to_string();
    assert!(said.starts_with(&format!("the loss of {level} is {found} in step {step}; allowed: finite")), "{said}");
    assert!(!folder.path().join(CONFIG_FILE).exists() && !folder.path().join(WEIGHTS_FILE).exists());
    assert!(folder.path().join(format!("checkpoint/step-{:08}.safetensors", step - 1)).exists());
}

fn short() -> TrainConfig {
    TrainConfig { steps: Some(6), batch: 48, warmup_steps: 2, metrics_every: 1, ..TrainConfig::default() }
}

#[test]
fn the_same_seed_gives_the_same_weights_for_any_number_of_threads() {
    let data = towers();
    for variant in Variant::named().filter(|variant| !variant.sees()) {
        let pool = |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
        let training = Training { variant, ..ntp(short()) };
        let on = |n| pool(n).install(|| weights(&training, &data));
        let one = on(1);
        assert!(one == on(2) && one == on(3));
        assert!(one != weights(&Training { seed: 1, ..training }, &data));
    }
}

#[test]
fn forty_steps_are_twenty_and_twenty_more() {
    let data = towers();
    for curriculum in [Curriculum::Equal, Curriculum::Adaptive] {
        let config =
            ntp(TrainConfig { steps: Some(40), batch: 8, checkpoint_every: 7, curriculum, ..TrainConfig::default() });
        let (straight, resumed) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let whole = train_until(&config, &data, straight.path(), None).unwrap();
        let stopped = train_until(&config, &data, resumed.path(), Some(20)).unwrap_err();
        assert!(matches!(stopped, TrainError::Stopped { step: 20 }));
        assert!(!resumed.path().join(CONFIG_FILE).exists());
        let rest = train_until(&config, &data, resumed.path(), None).unwrap();
        assert_eq!((rest.resumed_at, rest.steps, rest.examples), (20, 40, whole.examples));
        for file in [WEIGHTS_FILE, CONFIG_FILE, METRICS_FILE] {
            let read = |folder: &tempfile::TempDir| std::fs::read(folder.path().join(file)).unwrap();
            assert!(read(&straight) == read(&resumed), "{file} differs");
        }
        assert!(!resumed.path().join("checkpoint").exists());
    }
}

/// Towers of two blocks, each a task of its own, with two trials: more shards than a buffer holds.
fn many_towers() -> DatasetTrials {
    let pairs =
        (0..8_u16).flat_map(|lower| (0..8).filter(move |upper| *upper != lower).map(move |upper| [lower, upper]));
    let tasks: Vec<Task> =
        pairs.step_by(3).enumerate().map(|(n, pair)| tower(&format!("t{n:02}"), &pair, Split::Seen)).collect();
    demonstrations(&tasks, 2)
}

#[test]
fn trials_on_disk_are_read_back_as_they_were_written() {
    let (data, folder) = (many_towers(), tempfile::tempdir().unwrap());
    let spool = TrialSpool::of(folder.path(), data.n_slots, &data.trials).unwrap();
    assert!(std::fs::read_dir(folder.path()).unwrap().next().is_none(), "the file has no name");
    assert_eq!(spool.read(0..spool.len()).unwrap(), data.trials);
    assert_eq!(spool.read(7..9).unwrap(), data.trials[7..9]);
    assert_eq!(spool.read(3..3).unwrap(), []);
}

#[test]
fn a_training_streamed_from_disk_gives_the_same_bytes_when_it_is_resumed_and_not_those_of_memory() {
    let data = many_towers();
    for variant in [Variant::NTP, Variant::NPI] {
        let config = TrainConfig { steps: Some(210), batch: 4, ..TrainConfig::default() };
        let training = Training { variant, ..ntp(config) };
        let train_from_disk = |folder: &Path, stop: Option<u32>| {
            let spool = TrialSpool::of(folder, data.n_slots, &data.trials).unwrap();
            let stream = TrialStream::new(spool, 160).unwrap();
            let done = Cell::new(0);
            let mut on_progress = |progress: ntp::training::Progress| done.set(progress.step);
            let should_stop = || stop.is_some_and(|stop| done.get() >= stop);
            let mut hooks = Hooks { on_progress: &mut on_progress, should_stop: &should_stop };
            train_at(Place::new(folder), &training, Source::Streamed(&stream, None), &mut hooks)
        };
        let [straight, resumed] = [(); 2].map(|()| tempfile::tempdir().unwrap());
        let whole = train_from_disk(straight.path(), None).unwrap();
        // The buffer has been turned once.
        train_from_disk(resumed.path(), Some(204)).unwrap_err();
        assert_eq!(train_from_disk(resumed.path(), None).unwrap().resumed_at, 204);
        let read = |folder: &Path, file: &str| std::fs::read(folder.join(file)).unwrap();
        for file in [WEIGHTS_FILE, CONFIG_FILE, METRICS_FILE] {
            assert!(read(straight.path(), file) == read(resumed.path(), file), "{variant}: {file} differs");
        }
        assert_ne!(read(straight.path(), WEIGHTS_FILE), weights(&training, &data));
        let loss = |step: u32| -> f32 {
            whole.metrics.iter().filter(|metric| metric.step == step).map(|metric| metric.loss_total).sum()
        };
        assert!(loss(210) < 0.7 * loss(10), "{variant}: {} and {}", loss(10), loss(210));
        let config: ModelConfig = ntp::artifact::read_json(&straight.path().join(CONFIG_FILE)).unwrap();
        assert_eq!(config.tasks.len(), if variant == Variant::NPI { 19 } else { 0 });
    }
}

#[test]
fn a_checkpoint_of_another_training_is_not_taken_and_a_broken_one_is_named() {
    let data = towers();
    let folder = tempfile::tempdir().unwrap();
    let config = ntp(TrainConfig { batch: 8, ..short() });
    train_until(&config, &data, folder.path(), Some(3)).unwrap_err();
    let other = Training { seed: 9, ..config.clone() };
    let file = folder.path().join("checkpoint/step-00000003.moments.safetensors");
    let bytes = std::fs::read(&file).unwrap();
    std::fs::write(&file, &bytes[..bytes.len() - 1]).unwrap();
    let error = train_until(&config, &data, folder.path(), None).unwrap_err();
    assert!(matches!(&error, TrainError::Checkpoint { path, .. } if *path == file), "{error}");
    assert_eq!(train_until(&other, &data, folder.path(), None).unwrap().resumed_at, 0);
}

#[test]
fn a_models_folder_tells_how_it_was_made() {
    let data = towers();
    let folder = tempfile::tempdir().unwrap();
    let summary = train_until(&ntp(short()), &data, folder.path(), None).unwrap();
    let config: ModelConfig = ntp::artifact::read_json(&folder.path().join(CONFIG_FILE)).unwrap();
    assert_eq!((config.variant, config.family, config.n_slots), (Variant::NTP, Family::BlockStacking, 8));
    let training: Training = serde_json::from_value(config.training).unwrap();
    assert_eq!(training, ntp(short()).resolved());
    let mut table = ntp::table::read(&folder.path().join(METRICS_FILE), &METRICS).unwrap();
    let steps = table.int64("step").unwrap();
    assert_eq!(steps, summary.metrics.iter().map(|metric| i64::from(metric.step)).collect::<Vec<_>>());
    assert_eq!(steps.len(), 6 * 4);
}

#[test]
fn data_and_settings_that_make_no_sense_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |config: &TrainConfig, data: &DatasetTrials| {
        let error = train_until(&ntp(config.clone()), data, folder.path(), None).unwrap_err();
        assert!(std::fs::read_dir(folder.path()).unwrap().next().is_none(), "something was written");
        error
    };
    let config = short();
    let unseen = demonstrations(&[tower("c", &[6, 7], Split::Unseen)], 2);
    assert!(matches!(refused(&config, &unseen), TrainError::NoTrials { total: 2 }));
    let mut broken = towers();
    broken.trials[4].observations.pop();
    assert!(matches!(refused(&config, &broken), TrainError::Trial { trial: 1, .. }));
    let mut broken = towers();
    broken.trials[0].calls[2].output = Some(span(0, 90));
    assert!(matches!(refused(&config, &broken), TrainError::Trial { trial: 0, .. }));
    let mut mixed = towers();
    mixed.trials.extend(demonstrations(&[sorting("m", [0, 1, 2, 3], Split::Seen)], 1).trials);
    let none = TrainConfig { steps: Some(0), ..config.clone() };
    assert!(matches!(refused(&none, &towers()), TrainError::Config { key: "steps", .. }));
    let much = TrainConfig { gripper_jitter: Some(1.5), ..config };
    let error = refused(&much, &towers()).to_string();
    assert_eq!(error, "gripper_jitter is 1.5; allowed: from 0 to 1");
}

/// Success of a model's policy on tasks it has not seen, one rollout each.
fn success_rate(folder: &Path, decoder: Decoder, tasks: &[Task]) -> f32 {
    let (_, mut policy) = load_policy(folder, decoder).unwrap();
    let start = |task| {
        let own = trial(task, 100, 1);
        Start {
            task,
            demonstration: demonstration(task, &trial(task, 101, 1), 0),
            world: Box::new(KinematicWorld::new(task.family, &own)),
            sight: None,
            provenance: Provenance::new(task, &own, Actor::Policy(String::new()), 0),
        }
    };
    let rollouts = run(policy.as_mut(), tasks.iter().map(start).collect(), Limits::default()).unwrap();
    let successes = rollouts.iter().filter(|rollout| rollout.episode.outcome.is_success()).count();
    successes as f32 / tasks.len() as f32
}

fn last(metrics: &[Metric], level: Program) -> Metric {
    metrics.iter().rfind(|metric| metric.level == level).unwrap().clone()
}

#[test]
fn a_short_training_follows_instructions_for_unseen_towers() {
    let set = sample(Family::BlockStacking, 40, 20, Seed(3)).unwrap();
    let (seen, unseen): (Vec<Task>, Vec<Task>) = set.tasks.into_iter().partition(|task| task.split == Split::Seen);
    let folder = tempfile::tempdir().unwrap();
    let config = TrainConfig { steps: Some(500), gripper_jitter: Some(0.0), ..TrainConfig::default() };
    let training = Training { specification: SpecificationForm::Instructions, ..ntp(config) };
    train_until(&training, &demonstrations(&seen, 5), folder.path(), None).unwrap();
    let rate = success_rate(folder.path(), Decoder::Mss, &unseen);
    assert!(rate >= 0.8, "{rate}");
}

#[test]
fn instructions_are_for_variant_ntp_without_other_names_for_slots() {
    let refused = |variant, config| {
        let training = Training { variant, specification: SpecificationForm::Instructions, seed: 0, config };
        training.check().unwrap_err().to_string()
    };
    let error = refused(Variant::FLAT, TrainConfig::default());
    assert_eq!(error, "specification is instructions with variant flat; allowed: instructions with variant ntp alone");
    let relabelled = TrainConfig { relabel_slots: Some(0.5), ..TrainConfig::default() };
    assert_eq!(
        refused(Variant::NTP, relabelled),
        "relabel_slots is 0.5; allowed: 0 with instructions, whose words name slots"
    );
}

#[test]
fn a_scope_kernel_is_the_network_s_and_one_that_is_even_or_too_long_is_refused() {
    let data = towers();
    let with = |kernel| TrainConfig { steps: Some(1), scope_kernel: Some(kernel), ..short() };
    let folder = tempfile::tempdir().unwrap();
    let refused = |training: &Training| train_until(training, &data, folder.path(), None).unwrap_err().to_string();
    assert_eq!(refused(&ntp(with(4))), "scope_kernel is 4; allowed: odd numbers");
    assert_eq!(
        refused(&ntp(with(11))),
        "scope_kernel is 11, and the longest demonstration has 9 frames; allowed: at most as many frames as a \
         demonstration has"
    );
    let npi = Training { variant: Variant::NPI, ..ntp(with(3)) };
    assert_eq!(refused(&npi), "scope_kernel is 3 for variant npi; allowed: variants that read a specification");
    train_until(&ntp(with(9)), &data, folder.path(), None).unwrap();
    let config = ntp::model::load_config(folder.path()).unwrap();
    let ntp::model::NetworkConfig::ObjectCentric(widths) = config.network else { panic!("{:?}", config.network) };
    assert_eq!(widths.scope_kernel, 9);
}

#[test]
fn a_width_is_the_network_s_hidden_layers_and_one_that_no_network_has_is_refused() {
    let data = towers();
    let with = |width| TrainConfig { steps: Some(1), width: Some(width), ..short() };
    let folder = tempfile::tempdir().unwrap();
    let refused = |width| train_until(&ntp(with(width)), &data, folder.path(), None).unwrap_err().to_string();
    assert_eq!(refused(0), "width is 0; allowed: 1 to 4096");
    assert_eq!(refused(4097), "width is 4097; allowed: 1 to 4096");
    let widths = |variant, width| {
        let folder = tempfile::tempdir().unwrap();
        train_until(&Training { variant, ..ntp(with(width)) }, &data, folder.path(), None).unwrap();
        match ntp::model::load_config(folder.path()).unwrap().network {
            ntp::model::NetworkConfig::ObjectCentric(widths) => widths.width,
            ntp::model::NetworkConfig::Flattened(widths) => widths.width,
            other => panic!("{other:?}"),
        }
    };
    let paper = "flat_gru_paper".parse().unwrap();
    for width in [1, 7, 40] {
        assert_eq!([widths(Variant::NTP, width), widths(paper, width)], [width as usize; 2]);
    }
}

#[test]
fn relations_are_read_by_flattened_networks_alone() {
    let data = towers();
    let related = TrainConfig { steps: Some(1), relations: true, ..short() };
    let folder = tempfile::tempdir().unwrap();
    let error = train_until(&ntp(related.clone()), &data, folder.path(), None).unwrap_err().to_string();
    assert_eq!(
        error,
        "relations is on for variant ntp; allowed: on with flattened encoders of positions beside a specification"
    );
    let parameters = |relations| {
        let config = TrainConfig { relations, ..related.clone() };
        let training = Training { variant: Variant::NTP_PAPER, ..ntp(config) };
        train_until(&training, &data, folder.path(), None).unwrap();
        ntp::model::inspect(folder.path()).unwrap().parameters
    };
    // Three layers read 28 displacements of 6 numbers more.
    assert_eq!(parameters(true), parameters(false) + 3 * 28 * 6 * 96);
}

/// Towers, and objects sorted, to be learned together.
fn towers_and_sorting() -> DatasetTrials {
    let sorting =
        demonstrations(&[sorting("a", [0, 1, 2, 3], Split::Seen), sorting("m", [1, 0, 3, 2], Split::Seen)], 2);
    DatasetTrials::together(vec![towers(), sorting])
}

#[test]
fn families_that_are_learned_together_have_levels_of_their_own() {
    let data = towers_and_sorting();
    let examples = Examples::new(&data).unwrap();
    let levels: Vec<Program> = examples.levels().map(|(program, _)| program).collect();
    let [stacking, sorting] = [Program::BlockStacking, Program::ObjectSorting];
    let of_towers = [stacking, Program::PickAndPlace, Program::Pick, Program::Place];
    assert_eq!(levels, [of_towers.as_slice(), &[sorting, Program::PickAndDrop, Program::Pick, Program::Drop]].concat());
    assert_eq!(examples.task_ids(), ["a", "b", "a", "m"], "tasks of different families may share a name");
    let mut rng = Seed(1).rng();
    for (level, family) in [(2, Family::BlockStacking), (6, Family::ObjectSorting)] {
        let drawn = (0..50).flat_map(|_| examples.draw(level, Pairing::Cross, &mut rng)).collect::<Vec<_>>();
        assert!(drawn.iter().all(|example| data.trials[example.trial].family == family));
    }
}

#[test]
fn one_network_learns_families_of_different_slots() {
    let kits = sample(Family::Kitting, 2, 0, Seed(4)).unwrap().tasks;
    let data = DatasetTrials { n_slots: 12, ..DatasetTrials::together(vec![towers(), demonstrations(&kits, 2)]) };
    let folder = tempfile::tempdir().unwrap();
    for variant in [Variant::NTP, Variant::NTP_PAPER, Variant::FLAT_GRU_PAPER] {
        train_until(&Training { variant, ..ntp(short()) }, &data, folder.path(), None).unwrap();
        let config = ntp::model::load_config(folder.path()).unwrap();
        assert_eq!(config.families().collect::<Vec<_>>(), [Family::BlockStacking, Family::Kitting]);
        assert!(config.acts(Family::Kitting) && !config.acts(Family::ObjectSorting));
        assert!(config.reads_slots(8) && config.reads_slots(12));
        let rate = success_rate(folder.path(), Decoder::Mss, &kits[..1]);
        assert!((0.0..=1.0).contains(&rate), "it acts kits as well as towers");
    }
    let npi = Training { variant: Variant::NPI, ..ntp(short()) };
    assert_eq!(
        train_until(&npi, &data, folder.path(), None).unwrap_err().to_string(),
        "variant npi with trajectories cannot learn more than one family: trial 0 of task kit_XXXXXX is of kitting, the \
         first of block_stacking; allowed: variants that read positions and a demonstration of them"
            .replace("kit_XXXXXX", &kits[0].id)
    );
}

#[test]
fn roots_that_are_one_program_act_families_that_were_not_trained_on() {
    let kits = sample(Family::Kitting, 2, 0, Seed(4)).unwrap().tasks;
    let shared = TrainConfig { shared_root: true, ..short() };
    let folder = tempfile::tempdir().unwrap();
    train_until(&ntp(shared.clone()), &towers(), folder.path(), None).unwrap();
    let config = ntp::model::load_config(folder.path()).unwrap();
    assert!(config.acts(Family::Kitting) && config.reads_slots(12));
    let rate = success_rate(folder.path(), Decoder::Mss, &kits);
    assert!((0.0..=1.0).contains(&rate), "it acts kits");
    let npi = Training { variant: Variant::NPI, ..ntp(shared) };
    assert_eq!(
        train_until(&npi, &towers(), folder.path(), None).unwrap_err().to_string(),
        "shared_root is on for variant npi; allowed: on with variants that read positions and a demonstration of them"
    );
}

#[test]
fn a_model_of_eight_blocks_builds_with_sixteen() {
    let seen = sample(Family::BlockStacking, 20, 0, Seed(3)).unwrap().tasks;
    let more = sample(Family::TowerBuilding, 0, 20, Seed(3)).unwrap().tasks;
    assert!(more.iter().any(|task| task.tallest() == 6) && more.iter().any(|task| task.goals.len() > 7));
    let folder = tempfile::tempdir().unwrap();
    let config = TrainConfig { steps: Some(500), gripper_jitter: Some(0.0), ..TrainConfig::default() };
    train_until(&ntp(config), &demonstrations(&seen, 10), folder.path(), None).unwrap();
    let rate = success_rate(folder.path(), Decoder::Mss, &more);
    assert!(rate >= 0.7, "{rate}");
}

#[test]
fn a_network_with_a_memory_learns_repairs_within_calls() {
    let data = towers();
    let grain = Grain::Call;
    let examples = Examples::of(&data, SpecificationForm::default(), ScopingKind::Scoped, grain).unwrap();
    let longest = |recovery_states| {
        let config = resolved(TrainConfig { recovery_states: Some(recovery_states), ..TrainConfig::default() });
        let parts = (0..20).flat_map(|seed| draw(&examples, &config, 0, 8, Seed(seed)).unwrap());
        parts.map(|part| part.steps.len()).max().unwrap()
    };
    // Two goals and the end, and both goals again.
    assert_eq!((longest(0.0), longest(1.0)), (3, 5));
}

#[test]
fn noise_puts_demonstration_and_state_off_and_nothing_else() {
    let data = towers();
    let examples = Examples::new(&data).unwrap();
    let noisy =
        |frame_m, offset_m| TrainConfig { noise: ObservationNoise { frame_m, offset_m }, ..TrainConfig::default() };
    let drawn = |config: &TrainConfig| draw(&examples, &resolved(config.clone()), 0, 8, Seed(3)).unwrap().remove(0);
    let (exact, off) = (drawn(&noisy(0.0, 0.0)), drawn(&noisy(0.01, 0.02)));
    assert_eq!((&exact.programs, &exact.scopes, &exact.ends), (&off.programs, &off.scopes, &off.ends));
    assert!(exact.windows != off.windows && exact.states != off.states);
    let folder = tempfile::tempdir().unwrap();
    for (config, told) in
        [(noisy(-0.01, 0.0), "noise.frame_m is -0.01"), (noisy(0.0, f32::NAN), "noise.offset_m is NaN")]
    {
        let error = train_until(&ntp(config), &data, folder.path(), None).unwrap_err().to_string();
        assert_eq!(error, format!("{told}; allowed: from 0 to 0.1"));
    }
}

#[test]
fn an_example_of_instructions_has_the_sentences_of_its_sub_task() {
    let data = towers();
    let form = SpecificationForm::Instructions;
    let examples = Examples::of(&data, form, ScopingKind::Scoped, Grain::Decision).unwrap();
    let call = decisions(&data, 0, Program::BlockStacking)[1];
    let example = examples.example(0, call, 1).unwrap();
    assert_eq!((example.window, example.scope), (span(0, 4), Some(span(2, 4))));
    let vocabulary = Vocabulary::new(["A", "B", "C", "D", "E", "F", "G", "H"]);
    let said = ["pick C", "place on B"].map(|sentence| vocabulary.words(sentence).unwrap());
    assert_eq!(examples.specification_rows(1, span(2, 4)), SpecificationRows::Sentences(said.to_vec()));
}

#[test]
fn a_short_training_stacks_unseen_towers() {
    let set = sample(Family::BlockStacking, 20, 20, Seed(3)).unwrap();
    let (seen, unseen): (Vec<Task>, Vec<Task>) = set.tasks.into_iter().partition(|task| task.split == Split::Seen);
    let folder = tempfile::tempdir().unwrap();
    let config = TrainConfig { steps: Some(500), gripper_jitter: Some(0.0), ..TrainConfig::default() };
    let summary = train_until(&ntp(config), &demonstrations(&seen, 10), folder.path(), None).unwrap();
    let (first, root) = (&summary.metrics[0], last(&summary.metrics, Program::BlockStacking));
    assert!(root.loss_total < 0.1 * first.loss_total, "{} of {}", root.loss_total, first.loss_total);
    for level in [Program::Pick, Program::Place] {
        let argument = last(&summary.metrics, level).loss_argument.unwrap();
        assert!(argument < 0.1, "{level}: {argument}, and guessing has {}", 8.0_f32.ln());
    }
    let rate = success_rate(folder.path(), Decoder::Argmax, &unseen);
    assert!(rate >= 0.8, "{rate}");
}
