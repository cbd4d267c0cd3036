//! Detectors: what they are told, how they are trained apart from what is behind them, and how their errors are measured.

use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU32, Ordering};

use burn::module::Module as _;
use burn::tensor::Device;
use ntp::dataset::{DatasetTrials, Wanted};
use ntp::geometry::{Vec3, upright};
use ntp::model::{
    CalledWith, ColourSlotsConfig, Decoder, Detector, ModelConfig, Network, NetworkUse, PictureIndex, Pictures,
    PointDetector, PointDetectorConfig, ReadError, SpecificationRows, States, Variant, VggDetector, VggDetectorConfig,
    WEIGHTS_FILE, Windows, detected_rows, detector_of, with_network,
};
use ntp::program::Program;
use ntp::render::{Camera, Visibility};
use ntp::rollout::{Acted, DETECTIONS, Detected, DetectionRows, load_policy};
use ntp::scene::{BodyIndex, Scene, SceneState};
use ntp::seed::Seed;
use ntp::table::read;
use ntp::task::{Family, Split, initial_state, scene};
use ntp::trace::{Episode, GripperState, ObservationRows, SpecificationForm};
use ntp::training::{
    DETECTOR_METRICS, DETECTOR_METRICS_FILE, DetectorTraining, Gallery, Hooks, Progress, TrainConfig, TrainError,
    TrainSummary, Training, train_on_pictures,
};

use crate::kinematic::{demonstration, tower, trial};
use crate::painter::{Painter, Paintings};
use crate::training::trial_data;

fn shown(n_trials: u32) -> (DatasetTrials, Paintings) {
    let tasks = [tower("a", &[0, 1, 2], Split::Seen), tower("b", &[5, 3, 7], Split::Seen)];
    let of_task = |task| (0..n_trials).map(|idx| demonstration(task, &trial(task, idx, 1), 0)).collect::<Vec<_>>();
    let episodes: Vec<Episode> = tasks.iter().flat_map(of_task).collect();
    (DatasetTrials { n_slots: 8, trials: episodes.iter().map(trial_data).collect() }, Paintings(episodes))
}

fn training(variant: Variant, steps: u32, detector: DetectorTraining) -> Training {
    let config =
        TrainConfig { steps: Some(steps), batch: 8, warmup_steps: 5, metrics_every: 1, detector, ..Default::default() };
    Training { variant, specification: SpecificationForm::Video, seed: 0, config }
}

/// Trains, and stops after some steps of detector and network together.
fn learn(
    training: &Training,
    (data, paintings): &(DatasetTrials, Paintings),
    folder: &Path,
    stop_after: Option<u32>,
) -> Result<TrainSummary, TrainError> {
    let done = AtomicU32::new(0);
    let mut on_progress = |progress: Progress| done.store(progress.step, Ordering::Relaxed);
    let should_stop = || stop_after.is_some_and(|after| done.load(Ordering::Relaxed) >= after);
    train_on_pictures(
        training,
        data,
        Some(paintings),
        folder,
        &mut Hooks { on_progress: &mut on_progress, should_stop: &should_stop },
    )
}

/// Mean distances in metres, step by step.
fn curve(folder: &Path) -> Vec<f32> {
    let mut table = read(&folder.join(DETECTOR_METRICS_FILE), &DETECTOR_METRICS).unwrap();
    table.optional_float32("distance_m").unwrap().into_iter().map(Option::unwrap).collect()
}

#[test]
fn a_detector_learns_positions_before_the_network_behind_it_learns_anything() {
    let folder = tempfile::tempdir().unwrap();
    let detector = DetectorTraining { steps: Some(250), pictures: Some(48), ..Default::default() };
    let shown = shown(6);
    let training = training(Variant::NTP_VID_DETECTOR, 2, detector);
    assert_eq!(learn(&training, &shown, folder.path(), None).unwrap().steps, 2);
    let curve = curve(folder.path());
    assert_eq!(curve.len(), 250);
    let end = curve[240..].iter().sum::<f32>() / 10.0;
    assert!(end < 0.25 * curve[0], "from {} to {end} m", curve[0]);
    // The trained policy detects what it was trained to.
    let (_, policy) = load_policy(folder.path(), Decoder::Mss).unwrap();
    let mut pictures = Painter::nothing();
    shown.1.show(0, &[0, 1, 2], &mut pictures);
    let found = policy.detect(&pictures).unwrap().unwrap().into_values();
    let truth = &shown.0.trials[0].observations[..found.len()];
    let mean = found.iter().zip(truth).map(|(found, truth)| (found - truth).abs()).sum::<f32>() / found.len() as f32;
    assert!(mean < 0.05, "{mean} m");
}

/// Paintings that note what is fetched without being among the last two announcements, once there is one.
struct Watched<'p> {
    paintings: &'p Paintings,
    announced: Mutex<Vec<Vec<Wanted>>>,
    surprises: Mutex<Vec<Wanted>>,
}

impl Gallery for Watched<'_> {
    fn size(&self) -> (usize, usize) {
        self.paintings.size()
    }

    fn fetch(&self, wanted: &Wanted, into: &mut Pictures) -> Result<(), String> {
        let announced = self.announced.lock().unwrap();
        if !announced.is_empty() && !announced.iter().rev().take(2).flatten().any(|other| other == wanted) {
            self.surprises.lock().unwrap().push(wanted.clone());
        }
        self.paintings.fetch(wanted, into)
    }

    fn announce(&self, wanted: &[Wanted]) {
        self.announced.lock().unwrap().push(wanted.to_vec());
    }
}

#[test]
fn a_finished_detector_looks_at_all_trials_a_portion_at_a_time() {
    let (data, paintings) = shown(70);
    let watched = Watched { paintings: &paintings, announced: Mutex::default(), surprises: Mutex::default() };
    let detector = DetectorTraining { steps: Some(2), pictures: Some(8), ..Default::default() };
    let folder = tempfile::tempdir().unwrap();
    let mut hooks = Hooks { on_progress: &mut |_| (), should_stop: &|| false };
    train_on_pictures(
        &training(Variant::NTP_VID_DETECTOR, 1, detector),
        &data,
        Some(&watched),
        folder.path(),
        &mut hooks,
    )
    .unwrap();
    let announced = watched.announced.into_inner().unwrap();
    assert!(announced.iter().all(|trials| trials.len() < 70), "all at once");
    assert_eq!(announced.iter().flatten().filter(|wanted| wanted.position == 139).count(), 1);
    assert_eq!(watched.surprises.into_inner().unwrap(), []);
}

/// Pictures of a demonstration, and the same of a robot whose gripper is said to be elsewhere and the other way open.
fn with_gripper_moved(by: [f32; 3]) -> [Pictures; 2] {
    let mut pictures = Painter::nothing();
    shown(1).1.show(0, &[0, 1, 2], &mut pictures);
    let mut moved = pictures.clone();
    for GripperState { in_world_m, closed } in &mut moved.grippers {
        *in_world_m = [0, 1, 2].map(|axis| in_world_m[axis] + by[axis]);
        *closed = !*closed;
    }
    [pictures, moved]
}

fn assert_detections_move_with_the_gripper<D: Detector>(detector: &D) {
    let by = [0.25, -0.5, 0.125];
    let [still, moved] =
        with_gripper_moved(by).map(|pictures| detected_rows(detector, &pictures, 8).unwrap().into_values());
    assert_eq!(still.len(), 3 * 26);
    for (still, moved) in still.chunks(26).zip(moved.chunks(26)) {
        for (at, (still, moved)) in still.iter().zip(moved).take(24).enumerate() {
            assert!((still - by[at % 3] - moved).abs() < 1e-5, "{at}: from {still} to {moved}");
        }
        assert_eq!([moved[24], moved[25]], [still[25], still[24]]);
    }
}

#[test]
fn detected_positions_move_with_the_gripper_that_they_are_relative_to() {
    let perception = ColourSlotsConfig { pixels: 64, colours: 12 };
    let points: PointDetector = detector_of(&PointDetectorConfig::of(perception), 8, Seed(1), &Device::flex());
    assert_detections_move_with_the_gripper(&points);
    let config = VggDetectorConfig { pixels: 64, narrowed: 16, heat_maps: false };
    let vgg: VggDetector = detector_of(&config, 8, Seed(1), &Device::flex());
    assert_detections_move_with_the_gripper(&vgg);
}

#[test]
fn a_detector_is_told_of_the_gripper_what_a_frame_s_state_says() {
    let (data, paintings) = shown(1);
    let mut pictures = Painter::nothing();
    paintings.show(0, &[0, 2, 5], &mut pictures);
    let told: Vec<GripperState> = [0, 2, 5].map(|frame| data.trials[0].grippers[frame]).into();
    assert_eq!(pictures.grippers, told);
    let closed = |frame: usize| data.trials[0].observations[frame * 26 + 25] > 0.5;
    assert!(data.trials[0].grippers.iter().enumerate().all(|(frame, gripper)| gripper.closed == closed(frame)));
    assert!(data.trials[0].grippers.iter().any(|gripper| gripper.closed));
}

/// Logits of the next program, and of the argument, after a look at some pictures.
struct Decided<'p>(&'p Pictures);

impl NetworkUse for Decided<'_> {
    type Output = Vec<f32>;

    fn run<N: Network>(self, network: N) -> Vec<f32> {
        let percepts = network.perceive(self.0).unwrap();
        let shown = SpecificationRows::Pictures([0, 1].map(PictureIndex).to_vec());
        let demonstration = network.demonstration(&Windows::new(8, &[&shown]).unwrap(), &percepts).unwrap();
        let now = States::Pictures(vec![PictureIndex(2)]);
        let reading = network.read(&demonstration, &now, &percepts, &[CalledWith::default()]).unwrap();
        let beyond = network.read(&demonstration, &States::Pictures(vec![PictureIndex(3)]), &percepts, &[]);
        assert_eq!(beyond.err(), Some(ReadError::Picture { found: 3, n: 3 }));
        let (core, _) = network.core(&reading, Program::BlockStacking.into(), &[1], None);
        let argument = network.argument(&reading, Program::BlockStacking.into(), &core);
        let values =
            [core.programs, core.end, argument].map(|logits| logits.into_data().try_into_vec::<f32>().unwrap());
        values.concat()
    }
}

#[test]
fn no_network_but_one_behind_a_detector_reads_the_gripper_s_state() {
    let [still, moved] = with_gripper_moved([0.25, -0.5, 0.125]);
    let end_to_end = [Variant::NTP_VID_E2E, Variant::NTP_VID_E2E_PAPER, Variant::NTP_VID_E2E_GENERAL];
    for variant in end_to_end.into_iter().chain([Variant::NTP_VID_DETECTOR, Variant::NTP_VID_DETECTOR_PAPER]) {
        let mut config =
            ModelConfig::new(variant, SpecificationForm::Video, Family::BlockStacking, 8, serde_json::Value::Null);
        config.network = config.network.for_pictures(64, 1, 8).narrowed(32);
        let [a, b] = [&still, &moved]
            .map(|pictures| with_network(&config, Seed(1), &Device::flex(), Decided(pictures)).unwrap());
        assert_eq!(a == b, end_to_end.contains(&variant), "{variant}");
    }
}

#[test]
fn a_detector_of_vgg16_s_shape_has_its_layers_and_learns() {
    // Configuration D at full width from 224 pixels has 138 million weights with a last layer of 1000.
    let config = VggDetectorConfig { pixels: 64, narrowed: 16, heat_maps: false };
    let network: VggDetector = detector_of(&config, 8, Seed(1), &Device::flex());
    let channels = [3, 4, 4, 8, 8, 16, 16, 16, 32, 32, 32, 32, 32, 32];
    let convolutions: usize = channels.windows(2).map(|pair| 9 * pair[0] * pair[1] + pair[1]).sum();
    let top = (2 * 2 * 32 * 256 + 256) + (256 * 256 + 256) + (256 * 24 + 24);
    let mean_and_deviation = 64 * 64 * 3 + 1;
    assert_eq!(network.num_params(), convolutions + top + mean_and_deviation);
    // Above heat maps there are a score for each slot, a plane, and a layer of 64 to x, y and z.
    let network: VggDetector =
        detector_of(&VggDetectorConfig { heat_maps: true, ..config }, 8, Seed(1), &Device::flex());
    let maps = (32 * 8 + 8) + (2 * 3 + 3) + (34 * 64 + 64) + (64 * 3 + 3);
    assert_eq!(network.num_params(), convolutions + maps + mean_and_deviation);
    for (heat_maps, share) in [(false, 0.75), (true, 0.75)] {
        let folder = tempfile::tempdir().unwrap();
        let detector = DetectorTraining {
            steps: Some(200),
            pictures: Some(16),
            learning_rate: Some(0.002),
            narrowed: Some(16),
            heat_maps,
        };
        learn(&training(Variant::NTP_VID_DETECTOR_PAPER, 1, detector), &shown(2), folder.path(), None).unwrap();
        let curve = curve(folder.path());
        let [begin, end] = [&curve[..5], &curve[195..]].map(|part| part.iter().sum::<f32>() / 5.0);
        assert!(end < share * begin, "heat maps {heat_maps}: from {begin} to {end} m");
    }
}

#[test]
fn a_training_that_was_stopped_in_either_part_comes_to_the_same_weights() {
    let shown = shown(3);
    let detector = DetectorTraining { steps: Some(4), pictures: Some(12), ..Default::default() };
    let training = training(Variant::NTP_VID_DETECTOR, 4, detector);
    let whole = tempfile::tempdir().unwrap();
    learn(&training, &shown, whole.path(), None).unwrap();
    for stop_after in [2, 6] {
        let stopped = tempfile::tempdir().unwrap();
        let error = learn(&training, &shown, stopped.path(), Some(stop_after)).unwrap_err();
        assert!(matches!(error, TrainError::Stopped { step } if step == stop_after), "{error}");
        assert!(!stopped.path().join(WEIGHTS_FILE).exists());
        learn(&training, &shown, stopped.path(), None).unwrap();
        for file in [WEIGHTS_FILE, DETECTOR_METRICS_FILE] {
            let [a, b] = [&whole, &stopped].map(|folder| std::fs::read(folder.path().join(file)).unwrap());
            assert!(a == b, "{file} differs when stopped after {stop_after}");
        }
        assert!(!stopped.path().join("checkpoint").exists());
    }
}

#[test]
fn a_detector_learns_the_same_for_any_number_of_threads() {
    let shown = shown(3);
    let weights = |threads| {
        let folder = tempfile::tempdir().unwrap();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let detector = DetectorTraining { steps: Some(3), pictures: Some(12), ..Default::default() };
        pool.install(|| learn(&training(Variant::NTP_VID_DETECTOR, 1, detector), &shown, folder.path(), None)).unwrap();
        std::fs::read(folder.path().join(WEIGHTS_FILE)).unwrap()
    };
    assert!(weights(1) == weights(2));
}

#[test]
fn wrong_settings_of_a_detector_are_named_with_what_is_allowed() {
    let check = |variant, detector, expected: &str| {
        assert_eq!(training(variant, 1, detector).check().unwrap_err().to_string(), expected);
    };
    let some = DetectorTraining { steps: Some(1), ..Default::default() };
    check(Variant::NTP_VID_E2E, some, "detector is set for variant ntp_vid_e2e; allowed: variants with a detector");
    let colours = |variant, colours| {
        let config = TrainConfig { colours: Some(colours), ..TrainConfig::default() };
        Training { config, ..training(variant, 1, DetectorTraining::default()) }.check().unwrap_err().to_string()
    };
    assert_eq!(colours(Variant::NTP_VID_E2E, 1), "colours is 1; allowed: 2 to 64");
    let paper = colours(Variant::NTP_VID_E2E_PAPER, 9);
    assert_eq!(paper, "colours is 9 for variant ntp_vid_e2e_paper; allowed: variants on colour slots");
    let none = DetectorTraining { pictures: Some(0), ..Default::default() };
    check(Variant::NTP_VID_DETECTOR, none, "detector.pictures is 0; allowed: at least 1");
    let narrow = DetectorTraining { narrowed: Some(65), ..Default::default() };
    check(Variant::NTP_VID_DETECTOR_PAPER, narrow, "detector.narrowed is 65; allowed: 1 (full width) to 64");
    let rate = DetectorTraining { learning_rate: Some(0.0), ..Default::default() };
    check(Variant::NTP_VID_DETECTOR, rate, "detector.learning_rate is 0; allowed: greater than 0");
}

/// Two blocks before the front camera, and the others far behind it.
fn two_blocks(places: [[f32; 3]; 2]) -> (Scene, SceneState) {
    let scene = scene(Family::BlockStacking, &[]);
    let mut state = initial_state(Family::BlockStacking, &scene, Seed(1));
    state.gripper_in_world = upright(Vec3::new(0.0, -9.0, 0.3), 0.0);
    state.bodies_in_world.iter_mut().for_each(|pose| *pose = upright(Vec3::new(0.0, -9.0, 0.025), 0.0));
    for (body, place) in places.into_iter().enumerate() {
        state.bodies_in_world[body] = upright(place.into(), 0.0);
    }
    (scene, state)
}

#[test]
fn what_hides_a_block_takes_from_its_visible_share() {
    let camera = Camera::front(Family::BlockStacking, [64, 64]);
    let shares = |places| {
        let (scene, state) = two_blocks(places);
        Visibility::default().shares(&scene, &state, &camera)
    };
    let apart = shares([[-0.1, 0.0, 0.025], [0.1, 0.0, 0.025]]);
    assert_eq!(apart[..2], [1.0, 1.0]);
    assert_eq!(apart[2..], [0.0; 6]);
    // The upper block hides the lower one's upper side, which is about half of its outline.
    let stacked = shares([[0.0, 0.0, 0.025], [0.0, 0.0, 0.075]]);
    assert!((0.35..0.65).contains(&stacked[0]), "{}", stacked[0]);
    assert_eq!(stacked[1], 1.0);
}

#[test]
fn errors_of_detections_are_told_of_what_moves_with_the_frames_that_they_are_of() {
    let episode =
        demonstration(&tower("a", &[0, 1], Split::Unseen), &trial(&tower("a", &[0, 1], Split::Unseen), 0, 1), 0);
    let mut rows: Vec<f32> = episode.boundary_frames().flat_map(|(_, frame)| frame.observation().to_flat()).collect();
    let n_frames = episode.boundary_frames().count();
    rows[3 * 2 + 1] += 0.25;
    let shares = vec![vec![0.5; 8]; n_frames];
    let mut table = DetectionRows::default();
    let rows = ObservationRows::new(8, rows);
    let detected = Detected { episode: 3, demonstration: &episode, rows: &rows, visible_shares: &shares };
    table.push("ntp_vid_detector", "stacking_unseen", &Acted { train_tasks: Some(7), ..Acted::default() }, &detected);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("detections.parquet");
    table.write(&path).unwrap();
    assert_eq!(DetectionRows::read(&path).unwrap(), table);
    let mut columns = read(&path, &DETECTIONS).unwrap();
    let errors = columns.float64("error_y_m").unwrap();
    assert_eq!(errors.len(), 8 * n_frames);
    let wrong: Vec<usize> = (0..errors.len()).filter(|&row| errors[row].abs() > 1e-6).collect();
    assert_eq!(wrong, [2]);
    assert!((errors[2] - 0.25).abs() < 1e-6);
    assert_eq!(columns.text("slot").unwrap()[2], episode.scene.body(BodyIndex(2)).name);
}
