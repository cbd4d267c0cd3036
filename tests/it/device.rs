//! Devices: what is refused by name, and that an accelerator learns what the processor learns.
//!
//! The second needs a program that was built with `--features wgpu`: this one, or that of `NTP_WGPU`; and an adapter,
//! for which Mesa's software Vulkan (`mesa-vulkan-drivers` on Debian) will do.

use std::path::{Path, PathBuf};
use std::process::Command;

use ntp::feature::Feature;
use ntp::table::read;
use ntp::training::{DETECTOR_METRICS, DETECTOR_METRICS_FILE, METRICS, METRICS_FILE};

use crate::length::tell;
use crate::pipeline::{repository, run};
use crate::smoke;

/// What differs at most, of a loss and of one: the order of sums.
const TOLERANCE: f32 = 1e-5;

/// Every kind of network: those of positions with each core and scoping, the one of instructions, and those that see.
const PIPELINE: &str = r#"
name = "devices"
seed = 3
[tasks]
family = "block_stacking"
train = 3
unseen = 4
[generate]
trials_per_task = 3
[[generate.cameras]]
name = "front"
size_px = [32, 32]
[rollout]
[[rollout.suites]]
name = "stacking_unseen"
split = "unseen"
episodes = 2
"#;

const VARIANTS: [&str; 17] = [
    "ntp",
    "ntp_gru",
    "ntp_no_scope",
    "flat",
    "flat_gru",
    "npi",
    "ntp_paper",
    "ntp_gru_paper",
    "ntp_no_scope_paper",
    "flat_paper",
    "flat_gru_paper",
    "npi_paper",
    "ntp_vid_e2e",
    "ntp_vid_e2e_paper",
    "ntp_vid_e2e_general",
    "ntp_vid_detector",
    "ntp_vid_detector_paper",
];

/// The program with wgpu in it, if there is one.
fn with_wgpu() -> Option<PathBuf> {
    let own = Feature::Wgpu.is_built_in().then(|| PathBuf::from(env!("CARGO_BIN_EXE_ntp")));
    own.or_else(|| std::env::var_os("NTP_WGPU").map(PathBuf::from))
}

/// A pipeline file with a model of each variant.
fn written(folder: &Path) -> String {
    let mut text = PIPELINE.to_owned();
    let settings = "[models.training]\nsteps = 6\nmetrics_every = 1\nbatch = 8\n";
    for variant in VARIANTS {
        text.push_str(&format!("[[models]]\nvariant = \"{variant}\"\n{settings}"));
        if variant.contains("detector") {
            text.push_str("detector = { steps = 6, pictures = 8 }\n");
        }
    }
    text.push_str(&format!(
        "[[models]]\nvariant = \"ntp\"\ntag = \"by_words\"\nspecification = \"instructions\"\n{settings}"
    ));
    let path = folder.join("devices.toml");
    std::fs::write(&path, text).unwrap();
    path.to_string_lossy().into_owned()
}

/// What is lost, and how much; nothing where a level has none.
type Loss = (String, Option<f32>);

/// All losses that a model's folder tells, one after another, with what they are of.
fn losses(model: &Path) -> Vec<Loss> {
    let mut losses = Vec::new();
    let mut table = read(&model.join(METRICS_FILE), &METRICS).unwrap();
    for name in ["loss_program", "loss_end", "loss_scope", "loss_argument", "loss_total"] {
        losses.extend(table.optional_float32(name).unwrap().into_iter().map(|loss| (name.to_owned(), loss)));
    }
    let detector = model.join(DETECTOR_METRICS_FILE);
    if detector.is_file() {
        let mut table = read(&detector, &DETECTOR_METRICS).unwrap();
        for name in ["loss", "distance_m"] {
            losses.extend(
                table.optional_float32(name).unwrap().into_iter().map(|loss| (format!("detector {name}"), loss)),
            );
        }
    }
    losses
}

fn models(run: &Path) -> Vec<PathBuf> {
    let folders = std::fs::read_dir(run.join("models")).unwrap().map(|entry| entry.unwrap().path());
    let mut models: Vec<PathBuf> = folders.filter(|folder| folder.join(METRICS_FILE).is_file()).collect();
    models.sort();
    models
}

/// Trains every variant on the processor, and then again by a program on a device; what differs.
fn differences(program: &Path, device: &str) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let (pipeline, out) = (written(folder.path()), folder.path().join("run"));
    let out_word = out.to_string_lossy().into_owned();
    let (code, _, stderr) = run(&["run", &pipeline, "--out", &out_word, "--to", "train"]);
    assert_eq!(code, 0, "{stderr}");
    let before: Vec<(PathBuf, Vec<Loss>)> =
        models(&out).into_iter().map(|model| (model.clone(), losses(&model))).collect();
    assert_eq!(before.len(), VARIANTS.len() + 1);
    let mut command = Command::new(program);
    command.args(["train", &pipeline, "--out", &out_word, "--device", device, "--force"]);
    let output = command.current_dir(repository()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut wrong = Vec::new();
    for (model, on_processor) in before {
        let config = std::fs::read_to_string(model.join("config.json")).unwrap();
        assert!(config.contains(&format!(r#""trained_on": "{device}""#)), "{config}");
        let (name, there) = (model.file_name().unwrap().to_string_lossy().into_owned(), losses(&model));
        assert_eq!(there.len(), on_processor.len(), "{name}");
        for (at, ((what, here), (_, there))) in on_processor.into_iter().zip(there).enumerate() {
            let is_near = match (here, there) {
                (Some(here), Some(there)) => (here - there).abs() <= TOLERANCE * here.abs().max(1.0),
                (here, there) => here == there,
            };
            if !is_near {
                wrong.push(format!("{name}, {what}, row {at}: {here:?} and {there:?}"));
            }
        }
    }
    wrong
}

#[test]
fn a_step_that_is_one_batch_learns_in_every_variant_what_its_groups_learn_one_by_one() {
    let wrong = differences(Path::new(env!("CARGO_BIN_EXE_ntp")), "cpu:batched");
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn every_variant_learns_on_wgpu_what_it_learns_on_the_processor() {
    let Some(program) = with_wgpu() else {
        tell("skipped: this program was built without wgpu, and NTP_WGPU names none that was");
        return;
    };
    let wrong = differences(&program, "wgpu:cpu");
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn what_is_not_built_in_is_refused_by_name_before_anything_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("run").to_string_lossy().into_owned();
    for feature in [Feature::Wgpu, Feature::Cuda].into_iter().filter(|feature| !feature.is_built_in()) {
        let (code, _, stderr) = run(&["run", smoke::PIPELINE, "--out", &out, "--device", feature.name()]);
        assert_eq!(code, 2, "{stderr}");
        let ask = format!("build it with: cargo build --release --features {feature}");
        assert!(stderr.contains(&ask), "{stderr}");
        assert!(!Path::new(&out).exists());
    }
}

#[test]
fn a_device_that_is_none_is_refused_with_what_is_allowed() {
    for command in ["run", "train", "rollout"] {
        let (code, _, stderr) = run(&[command, smoke::PIPELINE, "--device", "gpu"]);
        assert_eq!(code, 2, "{stderr}");
        assert!(
            stderr.contains(r#""gpu" is no device; allowed: cpu, cpu:batched, wgpu, wgpu:N, wgpu:cpu, cuda, cuda:N"#),
            "{stderr}"
        );
    }
}

#[test]
fn stages_that_compute_no_network_ask_for_no_device() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("run").to_string_lossy().into_owned();
    let (code, _, stderr) = run(&["run", smoke::PIPELINE, "--out", &out, "--device", "cuda:7", "--to", "tasks"]);
    assert_eq!(code, 0, "{stderr}");
}
