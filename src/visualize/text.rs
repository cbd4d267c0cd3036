//! Names, recording properties and the page of text beside the scene.

use std::fmt::Write as _;

use rerun::components::{Scalar, Text};
use rerun::external::re_log_types::EntityPath;
use rerun::{AnyValues, RecordingInfo, TextDocument};
use sha2::{Digest as _, Sha256};

use crate::artifact::hex;
use crate::rollout::Divergence;
use crate::trace::{Episode, Outcome};
use crate::visualize::store::Store;
use crate::visualize::{Replay, VisualizeError, agreement, recording_name};
use crate::words::counted;

/// The id of a recording: readable, and other for other content.
pub(super) fn recording_id(replay: &Replay<'_>) -> String {
    let mut hasher = Sha256::new();
    for episode in [Some(replay.episode), replay.demonstration].into_iter().flatten() {
        hash(&mut hasher, episode);
    }
    for camera in replay.cameras {
        hasher.update(format!("{camera:?}"));
    }
    let digest = hex(&hasher.finalize()[..6]);
    format!("{}-ep-{:06}-{digest}", replay.episode.provenance.task_id, replay.episode.provenance.index)
}

fn hash(hasher: &mut Sha256, episode: &Episode) {
    hasher.update(format!("{:?}{:?}{:?}", episode.provenance, episode.outcome, episode.calls));
    hasher.update(format!("{:?}", episode.pushes));
    for frame in &episode.frames {
        hasher.update(frame.time_nanos.to_le_bytes());
        for pose in frame.state.bodies_in_world.iter().chain([&frame.state.gripper_in_world]) {
            for number in pose.translation.vector.iter().chain(pose.rotation.coords.iter()) {
                hasher.update(number.to_le_bytes());
            }
        }
    }
}

/// Name, provenance and outcome as properties of the recording.
pub(super) fn put_properties(store: &mut Store, replay: &Replay<'_>) -> Result<(), VisualizeError> {
    let episode = replay.episode;
    store.put_static(EntityPath::properties(), &RecordingInfo::new().with_name(recording_name(episode)))?;
    let words = facts(replay)
        .into_iter()
        .fold(AnyValues::default(), |values, (name, value)| values.with_component::<Text>(name, [value]));
    let sizes = words
        .with_component::<Scalar>("frames", [episode.frames.len() as f64])
        .with_component::<Scalar>("calls", [episode.calls.len() as f64])
        .with_component::<Scalar>("duration_secs", [duration_secs(episode)]);
    store.put_static(EntityPath::properties().join(&EntityPath::from("episode")), &sizes)
}

/// The page of text.
pub(super) fn put_document(store: &mut Store, replay: &Replay<'_>) -> Result<(), VisualizeError> {
    store.put_static("episode", &TextDocument::from_markdown(markdown(replay)))
}

fn duration_secs(episode: &Episode) -> f64 {
    episode.frames.last().map_or(0.0, |frame| frame.time_nanos as f64 / 1e9)
}

fn facts(replay: &Replay<'_>) -> Vec<(&'static str, String)> {
    let episode = replay.episode;
    let provenance = &episode.provenance;
    let divergence = replay.divergence.map(|divergence| ("divergence", divergence_in_words(episode, divergence)));
    let mut facts = vec![
        ("task", provenance.task_id.clone()),
        ("text", provenance.task_text.clone()),
        ("family", provenance.family.name().to_owned()),
        ("split", provenance.split.name().to_owned()),
        ("actor", provenance.actor.name().to_owned()),
        ("outcome", episode.outcome.to_string()),
        ("trial", provenance.trial.to_string()),
        ("seed", provenance.seed.to_string()),
        ("episode", provenance.index.to_string()),
    ];
    facts.extend(divergence);
    facts.extend(pushes_in_words(episode).map(|words| ("adversary", words)));
    facts
}

/// `2 pushes, 3 bodies toppled`; nothing without a push.
fn pushes_in_words(episode: &Episode) -> Option<String> {
    let n_toppled: usize = episode.pushes.iter().map(|push| push.toppled.len()).sum();
    let told = || format!("{}, {} toppled", counted(episode.pushes.len(), "push"), counted(n_toppled, "body"));
    (!episode.pushes.is_empty()).then(told)
}

/// What, and when.
fn divergence_in_words(episode: &Episode, divergence: Divergence) -> String {
    let frame = agreement::frame_of(episode, divergence).and_then(|frame| Some((frame, episode.frames.get(frame)?)));
    let when = frame.map(|(at, frame)| format!(", at {:.1} s, frame {at}", frame.time_nanos as f64 / 1e9));
    format!("{}{}", agreement::words(divergence), when.unwrap_or_default())
}

fn markdown(replay: &Replay<'_>) -> String {
    let episode = replay.episode;
    let provenance = &episode.provenance;
    let outcome = match episode.outcome {
        Outcome::Success => "**success**".to_owned(),
        Outcome::Failure(cause) => format!("**failure**: {}", cause.name()),
    };
    let mut page = format!("# {}\n\n{outcome}, by `{}`\n\n", provenance.task_id, provenance.actor.name());
    for (index, goal) in provenance.task_text.split(", then ").enumerate() {
        // Writing to a string cannot fail.
        let _written = writeln!(page, "{}. {goal}", index + 1);
    }
    let _written = write!(
        page,
        "\n`{}` task, trial {} of seed `{}`, episode {}\n\n{}, {}, {:.1} s\n",
        provenance.split.name(),
        provenance.trial,
        provenance.seed,
        provenance.index,
        counted(episode.frames.len(), "frame"),
        counted(episode.calls.len(), "call"),
        duration_secs(episode)
    );
    if let Some(words) = pushes_in_words(episode) {
        let _written = write!(page, "\nadversary: {words}\n");
    }
    if let Some(divergence) = replay.divergence {
        let _written = write!(page, "\n**{}**\n", divergence_in_words(episode, divergence));
    }
    page
}
