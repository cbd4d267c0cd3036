//! A lane that shows until when a rollout decides as the expert does: where it ends is the first divergence.

use rerun::{StateChange, StateConfiguration};

use crate::rollout::Divergence;
use crate::trace::Episode;
use crate::visualize::store::Store;
use crate::visualize::{VisualizeError, clock, palette};

const AGREES: &str = "as the expert";

/// The frame of the decision that first differs.
pub(super) fn frame_of(episode: &Episode, divergence: Divergence) -> Option<usize> {
    episode.calls.get(divergence.call().0 as usize).map(|call| call.frames.begin as usize)
}

/// Logs the lane.
pub(super) fn put(store: &mut Store, episode: &Episode, divergence: Option<Divergence>) -> Result<(), VisualizeError> {
    let differs = divergence.and_then(|divergence| Some((frame_of(episode, divergence)?, divergence)));
    let mut events: Vec<(usize, String)> = Vec::new();
    if differs.is_none_or(|(frame, _)| frame > 0) {
        events.push((0, AGREES.to_owned()));
    }
    events.extend(differs.map(|(frame, divergence)| (frame, words(divergence))));
    let colors = events.iter().map(|(_, state)| if state == AGREES { palette::START } else { palette::STOP });
    let configuration = StateConfiguration::new()
        .with_values(events.iter().map(|(_, state)| state.as_str()))
        .with_labels(events.iter().map(|(_, state)| state.as_str()))
        .with_colors(colors.map(palette::color));
    store.put_static("agreement", &configuration)?;
    let positions: Vec<usize> = events.iter().map(|&(frame, _)| frame).collect();
    let changes = StateChange::new().with_state(events.iter().map(|(_, state)| state.as_str()));
    store.put_rows("agreement", clock::times(&episode.frames, &positions), &changes)
}

/// `first divergence: argument of pick, decision 12`.
pub(super) fn words(divergence: Divergence) -> String {
    format!("first divergence: {} of {}, decision {}", divergence.kind.name(), divergence.program, divergence.decision)
}
