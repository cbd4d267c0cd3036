//! One model that looks with several cameras.

use std::path::Path;

use ntp::dataset::Wanted;
use ntp::model::{Convolved, ConvolvedConfig, Decoder, FlatEncoder, Network as _, Ntp, Pictures};
use ntp::rollout::{Eye, Limits, Sight, Start, load_policy};
use ntp::scene::Scene;
use ntp::seed::Seed;
use ntp::task::{Family, Split, Task, sample};
use ntp::trace::{Actor, Episode, Frame, Provenance};
use ntp::training::Gallery;

use crate::kinematic::{KinematicWorld, demonstration, trial};
use crate::painter::{Painter, Paintings};
use crate::pipeline::{hashes, run};
use crate::pipeline_pictures::with_models;
use crate::seeing::{learn_from, shown, training};

/// Two cameras, of which the first has its lid on.
struct LidOn<G>(G);

fn with_lid(seen: &Pictures) -> Pictures {
    let mut both = Pictures::of_size(seen.width, 2 * seen.height);
    for (picture, gripper) in seen.iter().zip(&seen.grippers) {
        both.push(&[&vec![20; seen.n_bytes()], picture].concat(), *gripper);
    }
    both
}

impl Gallery for LidOn<Paintings> {
    fn size(&self) -> (usize, usize) {
        let (width, height) = self.0.size();
        (width, 2 * height)
    }

    fn fetch(&self, wanted: &Wanted, into: &mut Pictures) -> Result<(), String> {
        let mut seen = Painter::nothing();
        self.0.fetch(wanted, &mut seen)?;
        let both = with_lid(&seen);
        both.iter().zip(&both.grippers).for_each(|(picture, gripper)| into.push(picture, *gripper));
        Ok(())
    }
}

impl Eye for LidOn<Painter> {
    fn look(&mut self, scene: &Scene, frame: &Frame) -> Pictures {
        with_lid(&self.0.look(scene, frame))
    }
}

#[test]
fn what_only_the_second_camera_sees_is_learned_and_acted() {
    let set = sample(Family::BlockStacking, 40, 20, Seed(3)).unwrap();
    let (seen, unseen): (Vec<Task>, Vec<Task>) = set.tasks.into_iter().partition(|task| task.split == Split::Seen);
    let folder = tempfile::tempdir().unwrap();
    let (data, paintings) = shown(&seen, 5);
    let loss = learn_from(&training(600), &data, &LidOn(paintings), folder.path());
    let (config, mut policy) = load_policy(folder.path(), Decoder::Mss).unwrap();
    assert_eq!(config.network.cameras(), 2);
    let start = |task| {
        let own = trial(task, 100, 1);
        let demonstration: Episode = demonstration(task, &trial(task, 101, 1), 0);
        let video = with_lid(&Painter::sight(&demonstration).video);
        Start {
            task,
            sight: Some(Sight { video, eye: Box::new(LidOn(Painter)) }),
            demonstration,
            world: Box::new(KinematicWorld::new(task.family, &own)),
            provenance: Provenance::new(task, &own, Actor::Policy(String::new()), 0),
        }
    };
    let rollouts = ntp::rollout::run(policy.as_mut(), unseen.iter().map(start).collect(), Limits::default()).unwrap();
    let succeeded = rollouts.iter().filter(|rollout| rollout.episode.outcome.is_success()).count();
    assert!(succeeded >= 4, "{succeeded} of 20 with a loss of {loss}");
}

#[test]
fn convolutions_give_the_vectors_of_both_cameras_side_by_side() {
    let config = ConvolvedConfig { cameras: 2, ..ConvolvedConfig::of_pixels(64) };
    let network = Ntp::<FlatEncoder<Convolved>>::new(&config, 8, Seed(1), &burn::tensor::Device::flex());
    let mut seen = Painter::nothing();
    let (_, paintings) = shown(&[crate::kinematic::tower("a", &[0, 1], Split::Seen)], 1);
    paintings.show(0, &[0, 1], &mut seen);
    let vectors = network.perceive(&with_lid(&seen)).unwrap();
    assert_eq!(vectors.dims(), [2, 256]);
    let values: Vec<f32> = vectors.into_data().try_into_vec().unwrap();
    assert_eq!(values[..128], values[256..384], "the first camera sees the same twice");
    assert_ne!(values[128..256], values[384..], "the second does not");
}

/// A model of some cameras.
fn model(variant: &str, tag: &str, cameras: &str) -> String {
    format!("[[models]]\nvariant = \"{variant}\"\ntag = \"{tag}\"\n{cameras}\n[models.training]\nsteps = 2\n")
}

/// Writes a pipeline file with a third camera and other models into a folder; its path and that of the run.
fn written(folder: &Path, models: &[String]) -> [String; 2] {
    let path = folder.join("several.toml");
    let wide = "[[generate.cameras]]\nname = \"wide\"\nsize_px = [48, 32]\n";
    std::fs::write(&path, with_models(&(wide.to_owned() + &models.concat()))).unwrap();
    [path, folder.join("run")].map(|path| path.to_string_lossy().into_owned())
}

#[test]
fn models_that_look_with_several_cameras_are_trained_and_act_to_the_same_bytes_on_any_number_of_threads() {
    let both = r#"cameras = ["front", "wrist"]"#;
    let models =
        ["ntp_vid_e2e", "ntp_vid_e2e_paper", "ntp_vid_e2e_general"].map(|variant| model(variant, "both", both));
    let made = |jobs: &str| {
        let folder = tempfile::tempdir().unwrap();
        let [pipeline, out] = written(folder.path(), &models);
        let (code, _, stderr) = run(&["run", &pipeline, "--out", &out, "--jobs", jobs]);
        assert_eq!(code, 0, "{stderr}");
        let (_, told, _) = run(&["run", &pipeline, "--out", &out, "--dry-run"]);
        assert!(told.lines().all(|line| line.contains("up to date")), "{told}");
        let config = folder.path().join("run/models/ntp_vid_e2e-both-seed0/config.json");
        assert!(std::fs::read_to_string(config).unwrap().contains("\"cameras\": 2"));
        hashes(&folder.path().join("run"), &["models", "rollouts"])
    };
    assert_eq!(made("1"), made("2"));
}

#[test]
fn a_model_looks_with_the_cameras_that_it_names_and_with_the_first_where_it_names_none() {
    let folder = tempfile::tempdir().unwrap();
    let of = |tag: &str, cameras: &str| model("ntp_vid_e2e", tag, cameras);
    let models = [of("first", ""), of("front", "cameras = [\"front\"]"), of("wrist", "cameras = [\"wrist\"]")];
    let [pipeline, out] = written(folder.path(), &models);
    let (code, _, stderr) = run(&["run", &pipeline, "--out", &out]);
    assert_eq!(code, 0, "{stderr}");
    let folders =
        ["first", "front", "wrist"].map(|tag| folder.path().join(format!("run/models/ntp_vid_e2e-{tag}-seed0")));
    let [first, front, wrist] =
        folders.each_ref().map(|folder| std::fs::read(folder.join("model.safetensors")).unwrap());
    assert!(first == front && front != wrist);
    let named = std::fs::read_to_string(folders[0].join("config.json")).unwrap();
    assert!(named.contains("\"cameras\": [\n    \"front\"\n  ]"), "{named}");
}

#[test]
fn a_model_acts_with_no_other_cameras_than_those_that_it_learned_from() {
    let folder = tempfile::tempdir().unwrap();
    let of = |cameras: &str| model("ntp_vid_e2e", "seen", cameras);
    let refused = |cameras: &str, said: &str| {
        let [pipeline, out] = written(folder.path(), &[of(cameras)]);
        let (code, _, stderr) = run(&["rollout", &pipeline, "--out", &out, "--force"]);
        assert!(code == 1 && stderr.contains(said), "{stderr}");
    };
    let [pipeline, out] = written(folder.path(), &[of(r#"cameras = ["front", "wrist"]"#)]);
    let (code, _, stderr) = run(&["run", &pipeline, "--out", &out]);
    assert_eq!(code, 0, "{stderr}");
    let acted = hashes(&folder.path().join("run"), &["models", "rollouts"]);
    let swapped = r#"cameras = ["wrist", "front"]"#;
    refused(swapped, "model is for cameras front, wrist, but wrist, front is asked for");
    refused("", "of 32x32 pixels from 2 cameras, but of 32x32 pixels is asked for");
    // What was acted with the model's own cameras is still that.
    let [pipeline, out] = written(folder.path(), &[of(r#"cameras = ["front", "wrist"]"#)]);
    assert_eq!(run(&["run", &pipeline, "--out", &out]).0, 0);
    assert_eq!(hashes(&folder.path().join("run"), &["models", "rollouts"]), acted);
    // Other cameras are another training, and other rollouts.
    let [pipeline, out] = written(folder.path(), &[of(swapped)]);
    let (_, told, _) = run(&["run", &pipeline, "--out", &out, "--dry-run"]);
    for unit in ["train ntp_vid_e2e-seen-seed0", "rollout ntp_vid_e2e-seen-seed0-mss stacking_unseen"] {
        let line = told.lines().find(|line| line.contains(unit)).unwrap();
        assert!(!line.contains("up to date"), "{line}");
    }
}

#[test]
fn cameras_that_a_model_cannot_look_with_are_refused_with_those_that_it_can() {
    let refused = |variant: &str, cameras: &str| {
        let folder = tempfile::tempdir().unwrap();
        let [pipeline, out] = written(folder.path(), &[model(variant, "seen", &format!("cameras = {cameras}"))]);
        let (code, _, stderr) = run(&["run", &pipeline, "--out", &out, "--dry-run"]);
        assert_eq!(code, 2, "{stderr}");
        assert!(stderr.contains("models[0].cameras"), "{stderr}");
        stderr
    };
    let said = refused("ntp_vid_e2e", r#"["front", "side"]"#);
    assert!(said.contains("\"side\" is no camera of generate.cameras; there are front, wrist, wide"), "{said}");
    let said = refused("ntp_vid_e2e", r#"["wrist", "wrist"]"#);
    assert!(said.contains("\"wrist\" is there twice"), "{said}");
    let said = refused("ntp_vid_e2e", r#"["front", "wide"]"#);
    assert!(said.contains("wide has 48 x 32 pixels, and front has 32 x 32 pixels; allowed is one size"), "{said}");
    let said = refused("ntp_vid_e2e", r#"["wide"]"#);
    assert!(said.contains("wide has 48 x 32 pixels; allowed are pictures as wide as high"), "{said}");
    let said = refused("ntp_vid_e2e", "[]");
    assert!(said.contains("is empty; there are front, wrist, wide"), "{said}");
    let said = refused("ntp_vid_detector", r#"["front", "wrist"]"#);
    assert!(said.contains("names 2 cameras; a detector looks with 1 at most"), "{said}");
    let said = refused("ntp", r#"["front"]"#);
    assert!(said.contains("ntp reads positions and looks with no camera; leave it out"), "{said}");
}

#[test]
fn a_training_begins_with_no_weights_of_other_cameras() {
    let start = "start_from = \"models/ntp_vid_e2e-first-seed0\"\n";
    let models = |first: &str, second: &str| {
        [model("ntp_vid_e2e", "first", first), model("ntp_vid_e2e", "second", second) + start]
    };
    let folder = tempfile::tempdir().unwrap();
    let (one, both, swapped) = ("", r#"cameras = ["front", "wrist"]"#, r#"cameras = ["wrist", "front"]"#);
    let said = "models[1].training.start_from: is models/ntp_vid_e2e-first-seed0, which looks with ";
    for (first, second, cameras) in
        [(one, both, "front; allowed is front, wrist"), (both, swapped, "front, wrist; allowed is wrist, front")]
    {
        let [pipeline, out] = written(folder.path(), &models(first, second));
        let (code, _, stderr) = run(&["run", &pipeline, "--out", &out, "--dry-run"]);
        assert!(code == 2 && stderr.contains(&format!("{said}{cameras}")), "{stderr}");
    }
    // Of a model elsewhere it is known when it is there.
    let [pipeline, out] = written(folder.path(), &models(both, both));
    assert_eq!(run(&["run", &pipeline, "--out", &out, "--to", "train"]).0, 0);
    let elsewhere = start.replace("models/", "../run/models/");
    let [pipeline, out] = written(folder.path(), &[model("ntp_vid_e2e", "third", swapped) + &elsewhere]);
    let (code, _, stderr) = run(&["run", &pipeline, "--out", &out, "--to", "train"]);
    let said = "whose list of cameras is front, wrist; allowed: wrist, front";
    assert!(code == 1 && stderr.contains(said), "{stderr}");
}
