//! The stack of running programs over time: one lane a depth.

use std::collections::BTreeMap;
use std::ops::Range;

use rerun::external::re_log_types::EntityPath;
use rerun::{StateChange, StateConfiguration};

use crate::scene::Scene;
use crate::trace::{Episode, Frame, ProgramCall, calls_by_depth};
use crate::visualize::store::Store;
use crate::visualize::{VisualizeError, clock, palette};

/// What is left of the colour of every other call, so that neighbours can be told apart.
const ODD_SHADE: f32 = 0.82;

/// At which frames which of the calls (of one depth, in order) begins to run; `None` where none runs any longer. A
/// call lasts until the frame of its return, or until the frame after when it returned at once.
pub(super) fn events<'c>(
    frames: &[Frame],
    calls: impl IntoIterator<Item = &'c ProgramCall>,
) -> Vec<(usize, Option<&'c ProgramCall>)> {
    let running = calls.into_iter().map(|call| {
        let begin = call.frames.begin as usize;
        (call, begin..(call.frames.last() as usize).max(begin + 1))
    });
    changes(frames.len(), running)
}

/// At which of the frames what begins to run; `None` where nothing runs any longer.
pub(super) fn changes<C: Copy>(
    n_frames: usize,
    running: impl IntoIterator<Item = (C, Range<usize>)>,
) -> Vec<(usize, Option<C>)> {
    let mut changes: BTreeMap<usize, Option<C>> = BTreeMap::new();
    for (call, Range { start, end }) in running.into_iter().filter(|(_, running)| running.start < n_frames) {
        changes.split_off(&start);
        changes.insert(start, Some(call));
        if end < n_frames {
            changes.insert(end, None);
        }
    }
    changes.into_iter().collect()
}

/// Logs one lane a depth below `root`.
pub(super) fn put(store: &mut Store, root: &str, episode: &Episode) -> Result<(), VisualizeError> {
    for (depth, calls) in calls_by_depth(episode) {
        let path = EntityPath::from(format!("{root}/depth_{depth}"));
        store.put_static(path.clone(), &configuration(&episode.scene, &calls))?;
        let events = events(&episode.frames, calls);
        let positions: Vec<usize> = events.iter().map(|&(position, _)| position).collect();
        let lengths: Vec<usize> = events.iter().map(|(_, call)| usize::from(call.is_some())).collect();
        let running = events.iter().filter_map(|&(_, call)| call);
        let changes = StateChange::new().with_state(running.map(|call| state(&episode.scene, call)));
        store.put_ragged_rows(path, clock::times(&episode.frames, &positions), &changes, &lengths)?;
    }
    Ok(())
}

/// A lane's state while a call runs. It holds the call's id, since Rerun would draw two equal states as one.
fn state(scene: &Scene, call: &ProgramCall) -> String {
    format!("{} #{}", call.label(scene), call.id.0)
}

/// What is shown for the states: labels without ids, and neighbours of one colour in two shades.
fn configuration(scene: &Scene, calls: &[&ProgramCall]) -> StateConfiguration {
    let shade = |(position, call): (usize, &&ProgramCall)| {
        let share = if position % 2 == 0 { 1.0 } else { ODD_SHADE };
        palette::dimmed(call.color(scene), share)
    };
    StateConfiguration::new()
        .with_values(calls.iter().map(|call| state(scene, call)))
        .with_labels(calls.iter().map(|call| call.label(scene)))
        .with_colors(calls.iter().enumerate().map(shade))
}
