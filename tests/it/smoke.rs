//! One run of `pipelines/smoke.toml` for all tests: read as it lies, or copied as far as a stage and then changed.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::Duration;

use ntp::progress::Stopwatch;
use tempfile::TempDir;

use crate::pipeline::run;

/// The stages' folders in the order of the data.
const FOLDERS: [(&str, &str); 6] = [
    ("tasks", "tasks"),
    ("generate", "recordings"),
    ("convert", "dataset"),
    ("train", "models"),
    ("rollout", "rollouts"),
    ("report", "report"),
];

pub(crate) const PIPELINE: &str = "pipelines/smoke.toml";

struct Smoke {
    root: PathBuf,
    lasted: Duration,
}

fn smoke() -> &'static Smoke {
    static SMOKE: OnceLock<Smoke> = OnceLock::new();
    SMOKE.get_or_init(|| {
        let root = Path::new(env!("CARGO_TARGET_TMPDIR")).join("smoke");
        let _gone = std::fs::remove_dir_all(&root);
        let root = root.join(std::process::id().to_string());
        let stopwatch = Stopwatch::start();
        let (code, _, stderr) = run(&["run", PIPELINE, "--jobs", "2", "--out", &root.to_string_lossy()]);
        assert_eq!(code, 0, "{stderr}");
        Smoke { root, lasted: Duration::from_secs_f64(stopwatch.taken().wall_secs) }
    })
}

/// The whole run. Nobody writes into it.
pub(crate) fn whole() -> &'static Path {
    &smoke().root
}

/// How long the whole run took.
pub(crate) fn lasted() -> Duration {
    smoke().lasted
}

/// A copy of the run as far as a stage.
pub(crate) fn copy_to(stage: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let n_stages = 1 + FOLDERS.iter().position(|(name, _)| *name == stage).unwrap();
    for (_, part) in &FOLDERS[..n_stages] {
        copy_folder(&whole().join(part), &folder.path().join(part));
    }
    std::fs::copy(whole().join("costs.json"), folder.path().join("costs.json")).unwrap();
    folder
}

pub(crate) fn copy_folder(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        let target = to.join(path.file_name().unwrap());
        if path.is_dir() {
            copy_folder(&path, &target);
        } else {
            std::fs::copy(&path, &target).unwrap();
        }
    }
}
