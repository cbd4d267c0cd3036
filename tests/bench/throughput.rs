//! Throughput of every stage in CPU-seconds (user and system), one JSON line each:
//! `{"name": …, "value": …, "unit": …}`.
//!
//! `cargo bench --bench throughput` measures all; `cargo bench --bench throughput -- NAME …` those named.

#![expect(clippy::print_stdout, reason = "its result is what it prints")]

use std::path::{Path, PathBuf};
use std::process::Command;

use burn::tensor::Device;
use cpu_time::ProcessTime;
use ntp::arm::{Upright, Vector, solutions};
use ntp::dataset::{
    ConvertConfig, DatasetTrials, EpisodePictures, RecordingEpisodes, TrialData, TrialSpool, convert, read_trials,
};
use ntp::expert::demonstrate;
use ntp::model::{Convolved, ConvolvedConfig, Decoder, FlatEncoder, Network as _, Ntp, Pictures, Variant};
use ntp::recording::{RecordingError, ShardReader, ShardWriter};
use ntp::render::{Camera, CameraConfig, Look, PictureFormat, Renderer, Viewpoint};
use ntp::robot::{Action, RobotApi as _, RobotKind};
use ntp::rollout::{Limits, Start, load_policy, run};
use ntp::seed::Seed;
use ntp::sim::{Simulation, SimulationConfig};
use ntp::task::{Family, Split, Task, TaskSet, Trial, initial_state_on, sample, scene_on};
use ntp::trace::{Actor, Episode, Frame, GripperState, Provenance, SpecificationForm};
use ntp::training::{Hooks, Place, Source, TrainConfig, Training, TrialStream, train, train_at};

/// Decodes the pictures of a dataset, episodes in no order, as training does; how many.
fn load(dataset: &Path) -> usize {
    let mut pictures = EpisodePictures::open(dataset, "front").expect("the dataset can be read");
    let n_episodes = pictures.n_episodes();
    let read = |at: usize| pictures.read((at * 7919) % n_episodes).expect("the pictures can be read").len();
    (0..4 * n_episodes).map(read).sum()
}

/// Runs the convert stage alone, in a process of its own, and prints its peak memory.
const CONVERT_CHILD: &str = "--convert-child";
/// Trains from trials on disk, in a process of its own.
const STREAM_CHILD: &str = "--stream-child";
/// Frames of these: what is streamed from is never so small.
const STREAMED_FRAMES: usize = 10_000_000;
/// Steps of a training in which the buffer is turned four times.
const STREAMED_STEPS: u32 = 1000;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    if let [mode, recordings, out] = arguments.as_slice()
        && mode == CONVERT_CHILD
    {
        convert_all(Path::new(recordings), Path::new(out));
        println!("{}", peak_mb());
        return;
    }
    if let [mode, dataset] = arguments.as_slice()
        && mode == STREAM_CHILD
    {
        train_streamed(Path::new(dataset));
        return;
    }
    let wanted = |name: &str| arguments.is_empty() || arguments.iter().any(|argument| argument == name);
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let bench = Bench { folder: folder.path().to_owned() };
    if ["render_64", "render_224"].into_iter().any(wanted) {
        render();
    }
    if ["generate_stacking_video_64", "convert_images_64", "load_images_64", "load_video_64"].into_iter().any(wanted) {
        bench.videos();
    }
    if ["arm_inverse_us", "arm_plan_us", "generate_stacking_arm"].into_iter().any(wanted) {
        arm_inverse();
        arm();
    }
    if wanted("train_convolutions_64") {
        train_convolutions();
    }
    if wanted("generate_sorting_40") {
        bench.generate_sorting_40();
    }
    let of_policies = ["train_samples", "policy_step_us", "rollout_stacking"];
    let of_dataset =
        [&["convert_rows", "convert_peak_mb", "train_samples_paper", "train_streamed"][..], &of_policies].concat();
    let is_dataset_wanted = of_dataset.into_iter().any(wanted);
    if is_dataset_wanted || wanted("generate_stacking") {
        bench.generate_stacking();
    }
    if !is_dataset_wanted {
        return;
    }
    let trials = bench.convert_rows();
    if wanted("convert_peak_mb") {
        bench.convert_peak_mb();
    }
    if wanted("train_samples_paper") {
        bench.train_samples("train_samples_paper", Variant::NTP_PAPER, &trials);
    }
    if wanted("train_streamed") {
        let secs = train_steps(Source::Here(&trials, None), &bench.folder.join("here"));
        report("train_unstreamed", secs, "decisions per CPU-second");
        bench.train_streamed();
    }
    if of_policies.into_iter().any(wanted) {
        bench.train_samples("train_samples", Variant::NTP, &trials);
        bench.policies();
    }
}

fn report(name: &str, value: f64, unit: &str) {
    println!("{}", serde_json::json!({ "name": name, "value": value, "unit": unit }));
}

/// CPU-seconds of the whole process that `work` takes.
fn cpu_secs<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let start = ProcessTime::now();
    let value = work();
    (value, start.elapsed().as_secs_f64())
}

/// Copies the trials of a dataset under other tasks' names until there are enough, and learns from them on disk.
fn train_streamed(dataset: &Path) {
    let trials = read_trials(dataset).expect("the dataset can be read");
    let (n_slots, mut n_frames) = (trials.n_slots, 0);
    let copies = (0..).flat_map(|copy: usize| {
        let renamed =
            move |trial: &TrialData| TrialData { task_id: format!("{}/{copy}", trial.task_id), ..trial.clone() };
        trials.trials.iter().map(renamed)
    });
    let enough = copies.take_while(|trial| {
        n_frames += trial.n_frames;
        n_frames < STREAMED_FRAMES
    });
    let folder = tempfile::tempdir_in(dataset.parent().expect("a folder")).expect("a temporary folder can be made");
    let spool = TrialSpool::of(folder.path(), n_slots, enough).expect("trials can be written");
    let (stream, secs) = cpu_secs(|| TrialStream::new(spool, 1_500_000).expect("trials can be read"));
    report("train_streamed_trials", stream.n_trials() as f64, "trials");
    report("train_streamed_first_pass", STREAMED_FRAMES as f64 / secs, "frames per CPU-second");
    let rate = train_steps(Source::Streamed(&stream, None), folder.path());
    report("train_streamed", rate, "decisions per CPU-second");
    report("train_streamed_peak_mb", peak_mb(), "MB");
}

/// Decisions learned from in a CPU-second.
fn train_steps(source: Source<'_>, folder: &Path) -> f64 {
    let config = TrainConfig { steps: Some(STREAMED_STEPS), checkpoint_every: 10_000, ..TrainConfig::default() };
    let training = Training { variant: Variant::NTP, specification: SpecificationForm::default(), seed: 0, config };
    let mut hooks = Hooks { on_progress: &mut |_| {}, should_stop: &|| false };
    let (summary, secs) = cpu_secs(|| train_at(Place::new(folder), &training, source, &mut hooks));
    summary.expect("training goes well").examples as f64 / secs
}

/// The paper's seven convolutions there and back over 32 pictures of 64 pixels, as `tests/bench/peers/pytorch_convolutions.py` does in
/// `PyTorch`.
fn train_convolutions() {
    const STEPS: usize = 30;
    const BATCH: usize = 32;
    let config = ConvolvedConfig::of_pixels(64);
    let network = Ntp::<FlatEncoder<Convolved>>::new(&config, 8, Seed(1), &Device::flex().autodiff());
    let mut pictures = Pictures::of_size(64, 64);
    let value = |picture: usize, at: usize| ((picture * 7919 + at * 104_729) % 251) as u8;
    (0..BATCH).for_each(|n| {
        pictures.push(&(0..64 * 64 * 3).map(|at| value(n, at)).collect::<Vec<u8>>(), GripperState::default());
    });
    let step = || drop(network.perceive(&pictures).expect("it reads").powf_scalar(2.0).sum().backward());
    step();
    let ((), secs) = cpu_secs(|| (0..STEPS).for_each(|_| step()));
    report("train_convolutions_64", (STEPS * BATCH) as f64 / secs, "pictures per CPU-second");
}

/// Pictures of a demonstration from the front: colours, depths and segments of the table, 8 blocks and the gripper.
fn render() {
    let tasks = stacking_tasks();
    let task = tasks.of_split(Split::Seen).next().expect("there are tasks");
    let episode = demonstration(task, &trial(task, 0, 1), 0, 10);
    for (name, look) in [("", Look::plain()), ("_smooth", Look::smooth())] {
        for (size, n_frames) in [(64, 4000), (224, 400)] {
            let camera = Camera::front(Family::BlockStacking, [size, size]);
            let mut renderer = Renderer::new(look.clone());
            renderer.draw(&episode.scene, &episode.frames[0].state, &camera);
            let frames = episode.frames.iter().cycle().take(n_frames);
            let mut draw = |frame: &Frame| renderer.draw(&episode.scene, &frame.state, &camera).segments.len();
            let (_, secs) = cpu_secs(|| frames.map(&mut draw).sum::<usize>());
            report(&format!("render_{size}{name}"), n_frames as f64 / secs, "frames per CPU-second");
        }
    }
}

struct Bench {
    folder: PathBuf,
}

fn stacking_tasks() -> TaskSet {
    sample(Family::BlockStacking, 100, 50, Seed(11)).expect("there are so many tasks")
}

fn trial(task: &Task, index: u32, count: u16) -> Trial {
    let counts = task.counts(|| count);
    Trial { index, counts, seed: Seed(5).derive(&task.id, &[u64::from(index)]) }
}

fn world(task: &Task, trial: &Trial, frame_hz: u32) -> Simulation {
    world_of(task, trial, &SimulationConfig { frame_hz, ..SimulationConfig::default() })
}

fn world_of(task: &Task, trial: &Trial, config: &SimulationConfig) -> Simulation {
    let scene = scene_on(config.layout(), task.family, &trial.counts);
    let initial = initial_state_on(config.layout(), task.family, &scene, trial.seed);
    Simulation::new(scene, &initial, config).expect("a drawn start is allowed")
}

/// All postures of 100 000 places over a table, in closed form.
fn arm_inverse() {
    const N_PLACES: u32 = 100_000;
    let place = |number: u32| {
        let share = |factor: u32| f64::from(number.wrapping_mul(factor) % 10_007) / 10_007.0;
        let position = Vector::new(0.35 + 0.4 * share(7919), 0.8 * share(104_729) - 0.4, 0.3 * share(1_299_709));
        Upright { position, yaw_rad: share(611_953) - 0.5 }
    };
    let places: Vec<Upright> = (0..N_PLACES).map(place).collect();
    let (n_found, secs) = cpu_secs(|| places.iter().map(|place| solutions(place).count()).sum::<usize>());
    report("arm_inverse_us", secs / f64::from(N_PLACES) * 1e6, "CPU-microseconds a place, all postures");
    report("arm_inverse_postures", n_found as f64 / f64::from(N_PLACES), "postures a place");
}

/// Demonstrations of 100 tasks by the arm, and how long the plan of each `move_to` takes.
fn arm() {
    let tasks = stacking_tasks();
    let config = SimulationConfig { robot: RobotKind::Sawyer, ..SimulationConfig::default() };
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let n_episodes = 100_u64;
    let seen: Vec<&Task> = tasks.of_split(Split::Seen).collect();
    let (failed, secs) = cpu_secs(|| {
        let mut failed = 0;
        let mut writer = ShardWriter::create(&folder.path().join("arm.mcap"), "{}").expect("the folder can be written");
        for index in 0..n_episodes {
            let task = seen[index as usize % seen.len()];
            let provenance = Provenance::new(task, &trial(task, 0, 1), Actor::Expert, index);
            let mut world = world_of(task, &trial(task, 0, 1), &config);
            let episode = demonstrate(task, &mut world, provenance).expect("the trace is right");
            failed += u64::from(!episode.outcome.is_success());
            writer.write(&episode).expect("the recording can be written");
        }
        writer.finish().expect("the recording can be written");
        failed
    });
    report("generate_stacking_arm", n_episodes as f64 / secs, "demonstrations per CPU-second");
    report("generate_stacking_arm_success", 1.0 - failed as f64 / n_episodes as f64, "share");
    let mut plans = Vec::new();
    for task in &seen {
        plan_all(task, &config, &mut plans);
    }
    plans.sort_by(f64::total_cmp);
    let at = |share: f64| plans[((plans.len() - 1) as f64 * share) as usize] * 1e6;
    report("arm_plan_us", at(0.5), "CPU-microseconds a primitive, median");
    report("arm_plan_us_99", at(0.99), "CPU-microseconds a primitive, 99 %");
    report("arm_plan_us_most", at(1.0), "CPU-microseconds a primitive, most");
}

/// Acts a task and times the plan of each `move_to` before it is made.
fn plan_all(task: &Task, config: &SimulationConfig, plans: &mut Vec<f64>) {
    let mut world = world_of(task, &trial(task, 1, 1), config);
    for goal in &task.goals {
        for (slot, then) in [(goal.source, Action::Grip), (goal.target, Action::Release)] {
            let (planned, secs) = cpu_secs(|| (0..10).map(|_| world.planned_stretches(slot)).next_back());
            plans.push(secs / 10.0);
            if planned.is_some_and(|planned| planned.is_err()) || world.act(Action::MoveTo(slot)).is_err() {
                return;
            }
            if world.act(then).is_err() {
                return;
            }
        }
    }
}

fn demonstration(task: &Task, trial: &Trial, index: u64, frame_hz: u32) -> Episode {
    let provenance = Provenance::new(task, trial, Actor::Expert, index);
    demonstrate(task, &mut world(task, trial, frame_hz), provenance).expect("the trace is right")
}

impl Bench {
    fn recordings(&self) -> PathBuf {
        self.folder.join("recordings")
    }

    /// 400 demonstrations of 100 tasks, all frames, to MCAP.
    fn generate_stacking(&self) {
        let tasks = stacking_tasks();
        let seen: Vec<&Task> = tasks.of_split(Split::Seen).collect();
        let n_episodes = 400_u64;
        let (failed, secs) = cpu_secs(|| {
            let mut failed = 0;
            for shard in 0..4 {
                let path = self.recordings().join(format!("shard-{shard:05}.mcap"));
                let mut writer = ShardWriter::create(&path, "{}").expect("the folder can be written");
                for index in shard * 100..(shard + 1) * 100 {
                    let task = seen[(index % 100) as usize];
                    let episode = demonstration(task, &trial(task, (index / 100) as u32, 1), index, 10);
                    failed += u64::from(!episode.outcome.is_success());
                    writer.write(&episode).expect("the recording can be written");
                }
                writer.finish().expect("the recording can be written");
            }
            failed
        });
        report("generate_stacking", n_episodes as f64 / secs, "demonstrations per CPU-second");
        report("generate_stacking_success", 1.0 - failed as f64 / n_episodes as f64, "share");
    }

    /// Demonstrations with a camera of 64 pixels: all frames as H.264, and boundary frames as PNG to a dataset.
    fn videos(&self) {
        let tasks = stacking_tasks();
        let seen: Vec<&Task> = tasks.of_split(Split::Seen).collect();
        let camera = CameraConfig::new(Viewpoint::Front, [64, 64]);
        let n_episodes = 100_u64;
        let generate = |name: &str, format: PictureFormat, frame_hz: u32| {
            let path = self.folder.join(name);
            let writer = ShardWriter::create(&path, "{}").expect("the folder can be written");
            let mut writer = writer.with_cameras(&[CameraConfig { format, ..camera.clone() }]);
            for index in 0..n_episodes {
                let task = seen[index as usize % seen.len()];
                let episode = demonstration(task, &trial(task, 0, 1), index, frame_hz);
                writer.write(&episode).expect("the recording can be written");
            }
            writer.finish().expect("the recording can be written");
            path
        };
        let (_, secs) = cpu_secs(|| generate("video.mcap", PictureFormat::H264, 10));
        report("generate_stacking_video_64", n_episodes as f64 / secs, "demonstrations per CPU-second");
        let convert = |path: &Path, out: &Path| {
            let episodes = ShardReader::open(path).expect("the recording can be read").boundaries().pictured();
            let (file, sha256) = ("recording.mcap".to_owned(), String::new());
            let recording = Ok::<_, RecordingError>(RecordingEpisodes { file, sha256, episodes });
            convert([recording], &ConvertConfig::default(), out).expect("it can be converted")
        };
        let path = generate("images.mcap", PictureFormat::Png, 0);
        let (images, videos) = (self.folder.join("images"), self.folder.join("videos"));
        let (_, secs) = cpu_secs(|| convert(&path, &images));
        report("convert_images_64", n_episodes as f64 / secs, "episodes per CPU-second");
        convert(&self.folder.join("video.mcap"), &videos);
        for (name, dataset) in [("load_images_64", &images), ("load_video_64", &videos)] {
            let (n_pictures, secs) = cpu_secs(|| load(dataset));
            report(name, n_pictures as f64 / secs, "pictures per CPU-second");
        }
    }

    /// Demonstrations with 40 objects, boundary frames, to MCAP.
    fn generate_sorting_40(&self) {
        let tasks = sample(Family::ObjectSorting, 4, 252, Seed(11)).expect("there are so many tasks");
        let unseen: Vec<&Task> = tasks.of_split(Split::Unseen).collect();
        let n_episodes = 20_u64;
        let (failed, secs) = cpu_secs(|| {
            let path = self.folder.join("sorting.mcap");
            let mut writer = ShardWriter::create(&path, "{}").expect("the folder can be written");
            let mut failed = 0;
            for index in 0..n_episodes {
                let task = unseen[index as usize * 12];
                let episode = demonstration(task, &trial(task, 0, 10), index, 0);
                failed += u64::from(!episode.outcome.is_success());
                writer.write(&episode).expect("the recording can be written");
            }
            writer.finish().expect("the recording can be written");
            failed
        });
        report("generate_sorting_40", n_episodes as f64 / secs, "demonstrations per CPU-second");
        report("generate_sorting_40_success", 1.0 - failed as f64 / n_episodes as f64, "share");
    }

    /// Recordings to a dataset, decoding and checking included.
    fn convert_rows(&self) -> DatasetTrials {
        let out = self.folder.join("dataset");
        let (rows, secs) = cpu_secs(|| convert_all(&self.recordings(), &out));
        report("convert_rows", rows as f64 / secs, "frame and call rows per CPU-second");
        read_trials(&out).expect("the dataset can be read")
    }

    fn convert_peak_mb(&self) {
        let output = Command::new(std::env::current_exe().expect("the bench knows itself"))
            .args([CONVERT_CHILD.as_ref(), self.recordings().as_os_str(), self.folder.join("child").as_os_str()])
            .output()
            .expect("the child can be run");
        let text = String::from_utf8_lossy(&output.stdout);
        let peak = text.trim().parse().unwrap_or(f64::NAN);
        report("convert_peak_mb", peak, "MB");
    }

    fn train_streamed(&self) {
        let status = Command::new(std::env::current_exe().expect("the bench knows itself"))
            .args([STREAM_CHILD.as_ref(), self.folder.join("dataset").as_os_str()])
            .status();
        assert!(status.is_ok_and(|status| status.success()), "the child failed");
    }

    /// Decisions learned from in training, batch building included.
    fn train_samples(&self, name: &str, variant: Variant, trials: &DatasetTrials) {
        let config = TrainConfig { steps: Some(60), checkpoint_every: 1000, ..TrainConfig::default() };
        let training = Training { variant, specification: SpecificationForm::default(), seed: 0, config };
        let mut hooks = Hooks { on_progress: &mut |_| {}, should_stop: &|| false };
        let (summary, secs) = cpu_secs(|| train(&training, trials, &self.folder.join(variant.name()), &mut hooks));
        let summary = summary.expect("training goes well");
        report(name, summary.examples as f64 / secs, "decisions per CPU-second");
    }

    /// One decision at a time on a 25-frame demonstration, and whole rollouts in physics by the same untrained model.
    fn policies(&self) {
        let folder = self.folder.join(Variant::NTP.name());
        let tasks = stacking_tasks();
        let longest = tasks.tasks.iter().find(|task| task.goals.len() == 6);
        let task = longest.or(tasks.tasks.first()).expect("there are tasks");
        let (_, mut policy) = load_policy(&folder, Decoder::default()).expect("the model can be read");
        let demonstration_of = |task: &Task| demonstration(task, &trial(task, 90, 1), 0, 0);
        let query = first_query(&demonstration_of(task));
        for _ in 0..200 {
            policy.decide(std::slice::from_ref(&query)).expect("it decides");
        }
        let n_steps = 2000;
        let (_, secs) = cpu_secs(|| (0..n_steps).for_each(|_| drop(policy.decide(std::slice::from_ref(&query)))));
        report("policy_step_us", secs / f64::from(n_steps) * 1e6, "CPU-microseconds");
        report("policy_step_frames", f64::from(query.window.end), "frames of the specification");

        let unseen: Vec<&Task> = tasks.of_split(Split::Unseen).collect();
        let (rollouts, secs) = cpu_secs(|| {
            let starts: Vec<Start<'_>> = unseen.iter().map(|task| start(task, demonstration_of(task))).collect();
            let mut oracle = ntp::rollout::Oracle::for_starts(&starts);
            run(&mut oracle, starts, Limits::default()).expect("the trace is right").len()
        });
        report("rollout_stacking", rollouts as f64 / secs, "rollouts per CPU-second, demonstrations included, oracle");
    }
}

fn first_query(demonstration: &Episode) -> ntp::rollout::Query {
    let specification = ntp::rollout::Specification::of(demonstration);
    ntp::rollout::Query {
        episode: 0,
        decision: 0,
        depth: 0,
        step: 0,
        window: specification.whole(),
        specification: std::sync::Arc::new(specification),
        program: demonstration.provenance.family.root_program(),
        observation: demonstration.frames[0].observation(),
        seen: Default::default(),
        allowed: None,
    }
}

fn start(task: &Task, demonstration: Episode) -> Start<'_> {
    let own = trial(task, 91, 1);
    let provenance = Provenance::new(task, &own, Actor::Policy(String::new()), 0);
    Start { task, demonstration, world: Box::new(world(task, &own, 0)), sight: None, provenance }
}

fn convert_all(recordings: &Path, out: &Path) -> u64 {
    let read = |shard: u32| -> Result<_, RecordingError> {
        let file = format!("shard-{shard:05}.mcap");
        let episodes = ShardReader::open(&recordings.join(&file))?.boundaries();
        Ok(RecordingEpisodes { file, sha256: String::new(), episodes })
    };
    let summary = convert((0..4).map(read), &ConvertConfig::default(), out).expect("recordings can be converted");
    summary.frames + summary.calls
}

/// Peak resident memory of this process, in MB.
fn peak_mb() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmHWM:")).unwrap_or_default();
    let kilobytes: f64 = line.split_whitespace().nth(1).and_then(|word| word.parse().ok()).unwrap_or(f64::NAN);
    kilobytes / 1024.0
}
