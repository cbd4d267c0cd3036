//! What an adversary did: an arrow in the scene and a lane, from the push until all rests again.

use std::collections::BTreeMap;

use rerun::{Arrows3D, StateChange, StateConfiguration};

use crate::trace::{Episode, Push};
use crate::visualize::store::Store;
use crate::visualize::{VisualizeError, clock, palette};

/// Length of an arrow for each newton second.
const METRES_PER_NS: f32 = 2.5;
const RADIUS_M: f32 = 0.008;
/// Of the lane, and of the arrow in the scene.
const LANE: &str = "adversary";
const ARROW: &str = "world/adversary";

/// Logs every push; nothing where there is none.
pub(super) fn put(store: &mut Store, episode: &Episode) -> Result<(), VisualizeError> {
    let events = events(&episode.pushes);
    let positions: Vec<usize> = events.keys().copied().collect();
    let lengths: Vec<usize> = events.values().map(|push| usize::from(push.is_some())).collect();
    let pushes: Vec<(usize, &Push)> = events.values().filter_map(|push| *push).collect();
    if pushes.is_empty() {
        return Ok(());
    }
    let origins = pushes.iter().map(|(_, push)| origin(episode, push));
    let vectors = pushes.iter().map(|(_, push)| push.impulse_ns.map(|part| METRES_PER_NS * part));
    let arrows = Arrows3D::from_vectors(vectors)
        .with_origins(origins)
        .with_radii(vec![RADIUS_M; pushes.len()])
        .with_colors(vec![palette::color(palette::STOP); pushes.len()]);
    store.put_ragged_rows(ARROW, clock::times(&episode.frames, &positions), &arrows, &lengths)?;
    let states = || pushes.iter().map(|&(number, push)| format!("{} #{number}", label(episode, push)));
    let configuration = StateConfiguration::new()
        .with_values(states())
        .with_labels(pushes.iter().map(|(_, push)| label(episode, push)))
        .with_colors(vec![palette::color(palette::STOP); pushes.len()]);
    store.put_static(LANE, &configuration)?;
    let changes = StateChange::new().with_state(states());
    store.put_ragged_rows(LANE, clock::times(&episode.frames, &positions), &changes, &lengths)
}

/// At which frames which push (with its number) begins to show; `None` where all rests again.
fn events(pushes: &[Push]) -> BTreeMap<usize, Option<(usize, &Push)>> {
    let mut events = BTreeMap::new();
    for (number, push) in pushes.iter().enumerate() {
        events.insert(push.frames.begin as usize, Some((number, push)));
        events.insert(push.frames.last() as usize, None);
    }
    events
}

/// The middle of the lowest pushed body when it was pushed.
fn origin(episode: &Episode, push: &Push) -> [f32; 3] {
    let state = &episode.frames[push.frames.begin as usize].state;
    state.body_in_world(push.body).translation.vector.into()
}

fn label(episode: &Episode, push: &Push) -> String {
    format!("pushes {}", episode.scene.body(push.body).name)
}
