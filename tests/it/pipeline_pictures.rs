//! Runs with cameras: training from the dataset's pictures alone, broken off and carried on, and what cameras may not
//! be.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use ntp::artifact::sha256_file;
use ntp::recording::ShardReader;
use ntp::video::decode_png;

use crate::killing::killed_after;
use crate::pipeline::{ALL, hashes, run};

/// What is seen is learned from, and acted.
const PIPELINE: &str = r#"
name = "seeing"
seed = 3
[tasks]
family = "block_stacking"
train = 3
unseen = 4
[generate]
trials_per_task = 3
episodes_per_shard = 4
[[generate.cameras]]
name = "front"
size_px = [32, 32]
[[generate.cameras]]
name = "wrist"
view = "wrist"
size_px = [32, 32]
format = "h264"
[[models]]
variant = "ntp_vid_e2e"
[models.training]
steps = 6
checkpoint_every = 2
[rollout]
record = 2
[[rollout.suites]]
name = "stacking_unseen"
split = "unseen"
episodes = 4
"#;

/// The pipeline with other models, and with what else stands before them.
pub(crate) fn with_models(models: &str) -> String {
    let (before, rest) = PIPELINE.split_once("[[models]]").unwrap();
    let (_, after) = rest.split_once("[rollout]").unwrap();
    [before, models, "[rollout]", after].concat()
}

/// Writes a pipeline file, changed, into a folder; its path and that of the run.
fn written(folder: &Path, change: impl Fn(&str) -> String) -> [String; 2] {
    let path = folder.join("seeing.toml");
    let text = change(PIPELINE);
    assert!(!text.is_empty());
    std::fs::write(&path, text).unwrap();
    [path, folder.join("run")].map(|path| path.to_string_lossy().into_owned())
}

fn unchanged(text: &str) -> String {
    text.to_owned()
}

fn command(arguments: &[&str]) -> (i32, String) {
    let (code, _, stderr) = run(arguments);
    (code, stderr)
}

/// Starts a command and kills it after a while; false when it had ended by itself.
fn killed(arguments: &[&str], after_millis: u64) -> bool {
    let child = Command::new(env!("CARGO_BIN_EXE_ntp"))
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    killed_after(child, Duration::from_millis(after_millis))
}

/// A finished run; its folder.
fn finished() -> (tempfile::TempDir, String, String) {
    let folder = tempfile::tempdir().unwrap();
    let [pipeline, out] = written(folder.path(), unchanged);
    let (code, stderr) = command(&["run", &pipeline, "--out", &out]);
    assert_eq!(code, 0, "{stderr}");
    (folder, pipeline, out)
}

#[test]
fn a_dataset_with_pictures_is_all_that_training_needs() {
    let (folder, pipeline, out) = finished();
    let run_dir = folder.path().join("run");
    let before = hashes(&run_dir, &["models"]);
    std::fs::remove_dir_all(run_dir.join("models")).unwrap();
    std::fs::remove_dir_all(run_dir.join("recordings")).unwrap();
    let (code, stderr) = command(&["train", &pipeline, "--out", &out, "--jobs", "1"]);
    assert_eq!(code, 0, "{stderr}");
    assert_eq!(hashes(&run_dir, &["models"]), before);
}

#[test]
fn a_run_with_pictures_killed_at_any_moment_carries_on_to_the_same_bytes() {
    let (whole, ..) = finished();
    let wanted = hashes(&whole.path().join("run"), &ALL);
    let mut n_killed = 0;
    for kill_after_millis in [100, 300, 500, 800, 1200] {
        let folder = tempfile::tempdir().unwrap();
        let [pipeline, out] = written(folder.path(), unchanged);
        n_killed += usize::from(killed(&["run", &pipeline, "--out", &out], kill_after_millis));
        let (code, stderr) = command(&["run", &pipeline, "--out", &out]);
        assert_eq!(code, 0, "killed after {kill_after_millis} ms: {stderr}");
        assert_eq!(hashes(&folder.path().join("run"), &ALL), wanted, "killed after {kill_after_millis} ms");
    }
    assert!(n_killed > 0, "none was running when it was killed");
}

/// The pipeline with both detectors in place of its model.
fn detecting() -> String {
    let model = |variant: &str| {
        format!(
            "[[models]]\nvariant = \"{variant}\"\n[models.training]\nsteps = 4\ncheckpoint_every = 2\n\
             [models.training.detector]\nsteps = 5\npictures = 8\n"
        )
    };
    with_models(&(model("ntp_vid_detector") + &model("ntp_vid_detector_paper")))
}

#[test]
fn detectors_are_trained_to_their_receipts_and_killed_at_any_moment_to_the_same_bytes() {
    let whole = tempfile::tempdir().unwrap();
    let [pipeline, out] = written(whole.path(), |_| detecting());
    let (code, stderr) = command(&["run", &pipeline, "--out", &out]);
    assert_eq!(code, 0, "{stderr}");
    let (code, told, _) = run(&["run", &pipeline, "--out", &out, "--dry-run"]);
    assert_eq!(code, 0);
    assert!(told.lines().count() > 6 && told.lines().all(|line| line.contains("up to date")), "{told}");
    let wanted = hashes(&whole.path().join("run"), &["models"]);
    let mut n_killed = 0;
    for kill_after_millis in [300, 600, 1000] {
        let folder = tempfile::tempdir().unwrap();
        let [pipeline, out] = written(folder.path(), |_| detecting());
        n_killed += usize::from(killed(&["run", &pipeline, "--out", &out], kill_after_millis));
        let (code, stderr) = command(&["run", &pipeline, "--out", &out, "--to", "train"]);
        assert_eq!(code, 0, "killed after {kill_after_millis} ms: {stderr}");
        assert_eq!(hashes(&folder.path().join("run"), &["models"]), wanted, "killed after {kill_after_millis} ms");
    }
    assert!(n_killed > 0, "none was running when it was killed");
}

#[test]
fn rollouts_are_recorded_with_what_the_policy_saw() {
    let (folder, ..) = finished();
    let suite = folder.path().join("run/rollouts/ntp_vid_e2e-seed0-mss/stacking_unseen");
    let recording = std::fs::read_dir(suite.join("recordings")).unwrap().next().unwrap().unwrap().path();
    let rollouts: Vec<_> = ShardReader::open(&recording).unwrap().pictured().map(Result::unwrap).collect();
    assert_eq!(rollouts.len(), 3, "the two that are asked for are two of the first three failures");
    for rollout in rollouts {
        let cameras: Vec<&str> = rollout.cameras.iter().map(|pictures| pictures.camera.as_str()).collect();
        assert_eq!(cameras, ["front", "wrist"]);
        for pictures in &rollout.cameras {
            assert_eq!(pictures.pictures.len(), rollout.episode.frames.len());
        }
        assert_eq!(decode_png(&rollout.cameras[0].pictures[0]).unwrap().size_px, [32, 32]);
    }
    let out = folder.path().join("replay.rrd").to_string_lossy().into_owned();
    let (code, stderr) = command(&["replay", &recording.to_string_lossy(), "--episode", "0", "--save", &out]);
    assert_eq!(code, 0, "{stderr}");
    let bytes = std::fs::read(&out).unwrap();
    let says = |words: &str| bytes.windows(words.len()).any(|window| window == words.as_bytes());
    assert!(says("/filmed/front") && says("/filmed/wrist"));
}

#[test]
fn a_video_feature_serves_for_training_too() {
    let folder = tempfile::tempdir().unwrap();
    let as_video = |text: &str| text.replacen("size_px = [32, 32]", "size_px = [32, 32]\nformat = \"h264\"", 1);
    let [pipeline, out] = written(folder.path(), as_video);
    let (code, stderr) = command(&["run", &pipeline, "--out", &out, "--to", "train"]);
    assert_eq!(code, 0, "{stderr}");
    assert!(folder.path().join("run/dataset/videos/observation.images.front").is_dir());
}

#[test]
fn a_dataset_of_all_frames_serves_for_training_with_its_boundaries() {
    let (boundaries, ..) = finished();
    let folder = tempfile::tempdir().unwrap();
    let all = |text: &str| text.replacen("[generate]", "[convert]\nframes = \"all\"\n[generate]", 1);
    let [pipeline, out] = written(folder.path(), all);
    let (code, stderr) = command(&["run", &pipeline, "--out", &out, "--to", "train"]);
    assert_eq!(code, 0, "{stderr}");
    let weights = "run/models/ntp_vid_e2e-seed0/model.safetensors";
    let read = |folder: &tempfile::TempDir| std::fs::read(folder.path().join(weights)).unwrap();
    assert!(read(&folder) == read(&boundaries), "other pictures than those of the boundaries were learned from");
}

#[test]
fn a_camera_that_sees_nothing_is_named_with_the_episode_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let away = "view = \"fixed\"\neye_m = [0.0, -0.8, 0.8]\ntarget_m = [0.0, -2.0, 1.5]\nsize_px = [32, 32]";
    let [pipeline, out] = written(folder.path(), |text| text.replacen("size_px = [32, 32]", away, 1));
    let (code, stderr) = command(&["run", &pipeline, "--out", &out]);
    assert_eq!(code, 1);
    let said = "camera front: none of the things in the scene is in any of its pictures";
    assert!(stderr.contains("episode 0") || stderr.contains("episode 4") || stderr.contains("episode 8"), "{stderr}");
    assert!(stderr.contains(said), "{stderr}");
    let left = std::fs::read_dir(folder.path().join("run/recordings")).unwrap();
    let left: Vec<_> = left.map(|entry| entry.unwrap().path()).collect();
    assert!(left.iter().all(|path| path.extension().is_none_or(|extension| extension != "mcap")), "{left:?}");
}

#[test]
fn a_model_made_for_another_size_of_pictures_is_refused_with_both_sizes() {
    let (folder, pipeline, out) = finished();
    let other = tempfile::tempdir().unwrap();
    let [larger, larger_out] = written(other.path(), |text| text.replacen("[32, 32]", "[48, 48]", 1));
    let (code, stderr) = command(&["run", &larger, "--out", &larger_out, "--to", "train"]);
    assert_eq!(code, 0, "{stderr}");
    let models = folder.path().join("run/models");
    std::fs::remove_dir_all(&models).unwrap();
    std::fs::rename(other.path().join("run/models"), &models).unwrap();
    let (code, stderr) = command(&["rollout", &pipeline, "--out", &out]);
    assert_eq!(code, 1);
    assert!(stderr.contains("model is for pictures of 48x48 pixels, but of 32x32 pixels is asked for"), "{stderr}");
    assert!(stderr.contains("config.json"), "{stderr}");
}

#[test]
fn a_damaged_picture_stops_training_with_task_episode_and_camera() {
    let (folder, pipeline, out) = finished();
    let data = folder.path().join("run/dataset/data/chunk-000/file-000.parquet");
    let mut bytes = std::fs::read(&data).unwrap();
    let png = b"\x89PNG";
    let starts: Vec<usize> = (0..bytes.len() - 4).filter(|&at| &bytes[at..at + 4] == png).collect();
    assert!(starts.len() > 100);
    let hash_before = sha256_file(&data).unwrap();
    starts.iter().for_each(|&at| bytes[at..at + 4].fill(0));
    std::fs::write(&data, bytes).unwrap();
    // As if it had been made so: what is not as its manifest says is not even read.
    let manifest = folder.path().join("run/dataset/manifest.json");
    let told = std::fs::read_to_string(&manifest).unwrap();
    std::fs::write(&manifest, told.replace(&hash_before, &sha256_file(&data).unwrap())).unwrap();
    std::fs::remove_dir_all(folder.path().join("run/models")).unwrap();
    let (code, stderr) = command(&["train", &pipeline, "--out", &out]);
    assert_eq!(code, 1);
    for said in ["of task ", "episode ", "observation.images.front: picture of row 0: failed to decode PNG"] {
        assert!(stderr.contains(said), "{stderr}");
    }
    assert!(!folder.path().join("run/models/ntp_vid_e2e-seed0/config.json").exists());
}

#[test]
fn a_frame_rendered_as_filmed_is_the_recorded_picture_and_a_camera_that_is_not_there_is_named_with_those_that_are() {
    let folder = tempfile::tempdir().unwrap();
    let moved = "size_px = [32, 32]\nrandomize = { light = 0.5, color = 0.3, camera_m = 0.03, camera_rad = 0.05 }";
    let [pipeline, out] = written(folder.path(), |text| text.replacen("size_px = [32, 32]", moved, 1));
    assert_eq!(command(&["run", &pipeline, "--out", &out, "--to", "generate"]).0, 0);
    let recordings = folder.path().join("run/recordings");
    let mut files: Vec<_> = std::fs::read_dir(&recordings).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|file| file.extension().is_some_and(|extension| extension == "mcap"));
    files.sort();
    let first = ShardReader::open(&files[0]).unwrap().pictured().next().unwrap().unwrap();
    let png = folder.path().join("frame.png");
    let render = |camera: &[&str]| {
        let paths = [recordings.to_str().unwrap(), "--episode", "0", "--frame", "7", "--png", png.to_str().unwrap()];
        command(&[&["render"], &paths[..], camera].concat())
    };
    let (code, stderr) = render(&["--camera", "front", "--as-filmed"]);
    assert_eq!(code, 0, "{stderr}");
    let rendered = decode_png(&std::fs::read(&png).unwrap()).unwrap();
    assert!(rendered == decode_png(&first.cameras[0].pictures[7]).unwrap());
    let (code, stderr) = render(&["--camera", "side"]);
    assert!(code == 2 && stderr.contains("the recording's cameras are: front, wrist"), "{code}: {stderr}");
    std::fs::remove_file(&files[1]).unwrap();
    let (code, stderr) = render(&[]);
    assert!(code == 1 && stderr.contains(files[1].to_str().unwrap()) && stderr.contains("missing"), "{code}: {stderr}");
}
