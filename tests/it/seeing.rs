//! Programs from pictures: what colour slots find, what is learned, and acting on what is seen.

use std::path::Path;

use burn::module::Module as _;
use burn::tensor::{Device, Tensor};
use ntp::dataset::DatasetTrials;
use ntp::model::{
    ColourSlots, ColourSlotsConfig, Convolved, ConvolvedConfig, Decoder, FlatEncoder, Flattened, FlattenedConfig,
    Keypoints, KeypointsConfig, Network as _, Ntp, Perception as _, PictureSample, Pictures, Variant, WEIGHTS_FILE,
};
use ntp::rollout::{Limits, Start, load_policy, run};
use ntp::seed::Seed;
use ntp::task::{Family, Split, Task, sample};
use ntp::trace::{Actor, Episode, GripperState, Provenance, SpecificationForm};
use ntp::training::{Gallery, Hooks, TrainConfig, Training, train, train_on_pictures};

use crate::kinematic::{KinematicWorld, demonstration, tower, trial};
use crate::painter::{Painter, Paintings};
use crate::training::trial_data;

pub(crate) fn shown(tasks: &[Task], n_trials: u32) -> (DatasetTrials, Paintings) {
    let of_task =
        |task: &Task| (0..n_trials).map(|idx| demonstration(task, &trial(task, idx, 1), 0)).collect::<Vec<_>>();
    let episodes: Vec<Episode> = tasks.iter().flat_map(of_task).collect();
    (DatasetTrials { n_slots: 8, trials: episodes.iter().map(trial_data).collect() }, Paintings(episodes))
}

pub(crate) fn training(steps: u32) -> Training {
    let config = TrainConfig { steps: Some(steps), warmup_steps: 20, ..TrainConfig::default() };
    Training { variant: Variant::NTP_VID_E2E, specification: SpecificationForm::Video, seed: 0, config }
}

fn learn(training: &Training, (data, paintings): &(DatasetTrials, Paintings), folder: &Path) -> f32 {
    learn_from(training, data, paintings, folder)
}

pub(crate) fn learn_from(training: &Training, data: &DatasetTrials, gallery: &dyn Gallery, folder: &Path) -> f32 {
    let mut loss = f32::NAN;
    let mut on_progress = |progress: ntp::training::Progress| loss = progress.loss;
    let hooks = &mut Hooks { on_progress: &mut on_progress, should_stop: &|| false };
    train_on_pictures(training, data, Some(gallery), folder, hooks).unwrap();
    loss
}

fn values<const D: usize>(tensor: Tensor<D>) -> Vec<f32> {
    tensor.into_data().try_into_vec().unwrap()
}

#[test]
fn colour_slots_find_each_block_and_the_robot_first() {
    let task = tower("a", &[0, 1, 2, 3], Split::Seen);
    let (_, paintings) = shown(&[task], 12);
    let mut sample = PictureSample { pictures: Painter::nothing(), lengths: Vec::new() };
    for (idx, episode) in paintings.0.iter().enumerate() {
        let n_frames = episode.boundary_frames().count();
        paintings.show(idx, &(0..n_frames).collect::<Vec<_>>(), &mut sample.pictures);
        sample.lengths.push(n_frames);
    }
    let config = ColourSlotsConfig { pixels: 64, colours: 9 };
    let mut slots = ColourSlots::fresh(&config, Seed(1), &Device::flex());
    slots = slots.calibrated(&sample, Seed(2)).unwrap();
    let mut first = Painter::nothing();
    paintings.show(0, &[0], &mut first);
    let found = values(slots.look(&first).unwrap().0);
    let episode = &paintings.0[0];
    let seen: Vec<[f32; 2]> = found.as_chunks::<4>().0.iter().map(|percept| [percept[0], percept[1]]).collect();
    for body in episode.scene.body_indices() {
        let at = Painter::place(&episode.frames[0].state.body_in_world(body).translation.vector);
        let nearest = seen.iter().map(|xy| (xy[0] - at[0]).hypot(xy[1] - at[1])).fold(f32::MAX, f32::min);
        assert!(nearest < 0.05, "{body:?}: {nearest}");
    }
}

#[test]
fn the_paper_s_picture_network_has_seven_layers_and_a_vector_of_128() {
    let network = Ntp::<FlatEncoder<Convolved>>::new(&ConvolvedConfig::of_pixels(64), 8, Seed(1), &Device::flex());
    let weights = [3 * 16, 16 * 24, 24 * 32, 32 * 48, 48 * 64, 64 * 64].map(|pair| 9 * pair);
    let biases = 16 + 24 + 32 + 48 + 64 + 64;
    let pictures = weights.iter().sum::<usize>() + biases + 4 * 4 * 64 * 128 + 128;
    let flattened = Ntp::<Flattened>::new(&FlattenedConfig::default(), 8, Seed(1), &Device::flex()).num_params();
    // Three layers read 128 features where those of positions read 50.
    assert_eq!(network.num_params(), flattened + pictures + 3 * (128 - 50) * 96);
    let mut painted = Painter::nothing();
    let (_, paintings) = shown(&[tower("a", &[0, 1], Split::Seen)], 1);
    paintings.show(0, &[0, 1, 0], &mut painted);
    let features = values(network.perceive(&painted).unwrap());
    assert_eq!(features.len(), 3 * 128);
    assert_eq!(features[..128], features[256..]);
    assert_ne!(features[..128], features[128..256]);
}

/// A picture of noise, and the same further right and down by some pixels.
fn noise(shift: usize) -> Pictures {
    let (size, mut pictures) = (64, Pictures::of_size(64, 64));
    let value = |x: usize, y: usize| ((x * 7919 + y * 104_729 + x * y * 31) % 251) as u8;
    let moved = |at: usize| (at + size - shift) % size;
    let pixels = (0..size * size).flat_map(|at| [0, 3, 5].map(|more| value(moved(at % size) + more, moved(at / size))));
    pictures.push(&pixels.collect::<Vec<u8>>(), GripperState::default());
    pictures
}

#[test]
fn keypoints_have_a_score_for_each_slot_in_each_cell_and_the_robot_first() {
    let config = KeypointsConfig::of(64, 4);
    let keypoints = Keypoints::fresh(&config, Seed(1), &Device::flex());
    let layers = [25 * 4 * 16 + 16, 9 * 16 * 32 + 32, 9 * 32 * 32 + 32, 32 * 5 + 5];
    assert_eq!(keypoints.num_params(), layers.iter().sum::<usize>());
    let (percepts, looks) = keypoints.look(&noise(0)).unwrap();
    assert_eq!((percepts.dims(), looks.scores().dims()), ([1, 5, 4], [1, 256, 4]));
    for percept in values(percepts).as_chunks::<4>().0 {
        assert!(percept[..2].iter().all(|place| (-1.0..=1.0).contains(place)), "{percept:?}");
        assert!((0.0..=1.0).contains(&percept[2]) && percept[3] > 0.0, "{percept:?}");
    }
}

#[test]
fn a_picture_moved_by_a_cell_has_its_scores_a_cell_further() {
    let keypoints = Keypoints::fresh(&KeypointsConfig::of(64, 4), Seed(1), &Device::flex());
    let [still, moved] = [0, 4].map(|shift| values(keypoints.look(&noise(shift)).unwrap().1.scores()));
    let score = |scores: &[f32], row: usize, column: usize| scores[(row * 16 + column) * 4];
    // Away from the border, where zeros are seen.
    for (row, column) in (4..12).flat_map(|row| (4..12).map(move |column| (row, column))) {
        let (before, after) = (score(&still, row, column), score(&moved, row + 1, column + 1));
        assert!((before - after).abs() < 1e-3, "{row}, {column}: {before} and {after}");
    }
}

#[test]
fn a_variant_that_sees_is_refused_without_pictures() {
    let (data, _) = shown(&[tower("a", &[0, 1], Split::Seen)], 2);
    let folder = tempfile::tempdir().unwrap();
    let hooks = &mut Hooks { on_progress: &mut |_| (), should_stop: &|| false };
    let error = train(&training(1), &data, folder.path(), hooks).unwrap_err().to_string();
    assert_eq!(error, "variant is ntp_vid_e2e; allowed: variants that see only with a dataset of pictures");
}

#[test]
fn the_same_pictures_give_the_same_weights_for_any_number_of_threads() {
    let shown = shown(&[tower("a", &[0, 1, 2], Split::Seen), tower("b", &[5, 3], Split::Seen)], 3);
    for variant in [Variant::NTP_VID_E2E, Variant::NTP_VID_E2E_PAPER, Variant::NTP_VID_E2E_GENERAL] {
        let weights = |threads| {
            let folder = tempfile::tempdir().unwrap();
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let config = TrainConfig { batch: 4, ..training(2).config };
            pool.install(|| learn(&Training { variant, config, ..training(2) }, &shown, folder.path()));
            std::fs::read(folder.path().join(WEIGHTS_FILE)).unwrap()
        };
        assert!(weights(1) == weights(2));
    }
}

#[test]
fn a_short_training_stacks_unseen_towers_from_pictures() {
    let set = sample(Family::BlockStacking, 40, 20, Seed(3)).unwrap();
    let (seen, unseen): (Vec<Task>, Vec<Task>) = set.tasks.into_iter().partition(|task| task.split == Split::Seen);
    let folder = tempfile::tempdir().unwrap();
    let loss = learn(&training(600), &shown(&seen, 5), folder.path());
    let rate = success_rate(folder.path(), &unseen);
    assert!(rate >= 0.2, "{rate} with a loss of {loss}");
}

fn success_rate(folder: &Path, tasks: &[Task]) -> f32 {
    let (_, mut policy) = load_policy(folder, Decoder::Mss).unwrap();
    let start = |task| {
        let own = trial(task, 100, 1);
        let demonstration = demonstration(task, &trial(task, 101, 1), 0);
        Start {
            task,
            sight: Some(Painter::sight(&demonstration)),
            demonstration,
            world: Box::new(KinematicWorld::new(task.family, &own)),
            provenance: Provenance::new(task, &own, Actor::Policy(String::new()), 0),
        }
    };
    let rollouts = run(policy.as_mut(), tasks.iter().map(start).collect(), Limits::default()).unwrap();
    rollouts.iter().filter(|rollout| rollout.episode.outcome.is_success()).count() as f32 / tasks.len() as f32
}
