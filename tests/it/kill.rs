//! `kill -9` at random moments: the same command then ends with the very bytes of a run that was never killed.
//!
//! Equal bytes in equally many files are the strictest form of: nothing lost, nothing doubled, nothing unreadable.
//! `NTP_KILLS=200 cargo test --release kills -- --nocapture` kills two hundred times.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use ntp::progress::Stopwatch;
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use crate::killing::killed_after;
use crate::length::{from_environment, tell};
use crate::pipeline::{hashes, run};
use crate::smoke::copy_folder;

/// Kills of each command in the suite.
const IN_SUITE: u64 = 3;

const PIPELINE: &str = r#"
name = "kill"
seed = 5
[tasks]
family = "block_stacking"
train = 16
unseen = 2
[generate]
trials_per_task = 8
episodes_per_shard = 8
[convert]
frames = "all"
"#;

/// A command that makes folders.
struct Attempt {
    name: &'static str,
    arguments: Vec<String>,
    /// What must be there before, copied from the whole run.
    needs: &'static [&'static str],
    /// What it makes.
    makes: &'static [&'static str],
}

fn text(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

fn attempts(pipeline: &Path, root: &Path) -> Vec<Attempt> {
    let stage = |stage: &str| {
        ["run", &text(pipeline), "--from", stage, "--to", stage, "--out", &text(root)].map(ToOwned::to_owned).to_vec()
    };
    let publish = ["publish", &text(&root.join("dataset")), "--to", &text(&root.join("published")), "--license", "mit"];
    let publish = publish.into_iter().chain(["--date", "2026-11-24"]).map(ToOwned::to_owned).collect();
    let part = |name: &str| text(&root.join("parts").join(name));
    let merge = ["dataset", "merge", &part("a"), &part("b"), "--to", &text(&root.join("merged"))];
    let merge = merge.map(ToOwned::to_owned).to_vec();
    vec![
        Attempt { name: "generate", arguments: stage("generate"), needs: &["tasks"], makes: &["recordings"] },
        Attempt { name: "convert", arguments: stage("convert"), needs: &["tasks", "recordings"], makes: &["dataset"] },
        Attempt {
            name: "publish",
            arguments: publish,
            needs: &["tasks", "recordings", "dataset"],
            makes: &["published"],
        },
        Attempt { name: "merge", arguments: merge, needs: &["parts"], makes: &["merged"] },
    ]
}

/// Gives the command again. A merged dataset is there as a whole or not, and is not written again.
fn finish(attempt: &Attempt, root: &Path) {
    if attempt.name == "merge" && root.join("merged").exists() {
        return;
    }
    let arguments: Vec<&str> = attempt.arguments.iter().map(String::as_str).collect();
    let (code, _, stderr) = run(&arguments);
    assert_eq!(code, 0, "{}: {stderr}", attempt.name);
}

/// Starts the command and kills it after a while; false when it had ended by itself.
fn kill_after(attempt: &Attempt, wait: Duration) -> bool {
    let child = Command::new(env!("CARGO_BIN_EXE_ntp"))
        .args(&attempt.arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    killed_after(child, wait)
}

#[test]
fn kills_at_random_moments_lose_double_and_spoil_nothing() {
    let n_kills = from_environment("NTP_KILLS", 4 * IN_SUITE).div_ceil(4);
    let folder = tempfile::tempdir().unwrap();
    let pipeline = folder.path().join("kill.toml");
    std::fs::write(&pipeline, PIPELINE).unwrap();
    let whole = folder.path().join("whole");
    let mut moments: Vec<Duration> = Vec::new();
    let (code, _, stderr) = run(&["run", &text(&pipeline), "--to", "tasks", "--out", &text(&whole)]);
    assert_eq!(code, 0, "{stderr}");
    for attempt in attempts(&pipeline, &whole) {
        if attempt.name == "merge" {
            let parts = ["--shares", "a=0.5,b=0.5", "--to", &text(&whole.join("parts"))];
            let (code, _, stderr) = run(&[&["dataset", "split", &text(&whole.join("dataset"))], &parts[..]].concat());
            assert_eq!(code, 0, "{stderr}");
        }
        let stopwatch = Stopwatch::start();
        finish(&attempt, &whole);
        moments.push(Duration::from_secs_f64(stopwatch.taken().wall_secs));
    }
    let mut rng = ChaCha8Rng::seed_from_u64(from_environment("NTP_SEED", 1));
    let mut n_running = 0;
    for kill in 0..n_kills {
        let root: PathBuf = folder.path().join(format!("killed-{kill}"));
        for (attempt, lasts) in attempts(&pipeline, &root).iter().zip(&moments) {
            for part in attempt.needs.iter().filter(|part| !root.join(part).exists()) {
                copy_folder(&whole.join(part), &root.join(part));
            }
            // Twice in a row, every other time: also what resumes is killed.
            for _ in 0..=kill % 2 {
                n_running += u64::from(kill_after(attempt, lasts.mul_f64(rng.random_range(0.0..1.0))));
            }
            finish(attempt, &root);
            let (expected, found) = (hashes(&whole, attempt.makes), hashes(&root, attempt.makes));
            assert_eq!(found, expected, "{} after kill {kill}", attempt.name);
        }
        std::fs::remove_dir_all(&root).unwrap();
    }
    assert!(n_running > 0, "none was running when it was killed");
    tell(&format!(
        "{n_running} kills of running processes in {n_kills} rounds; every folder had the same bytes afterwards"
    ));
}
