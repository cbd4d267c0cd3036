//! Numbers over time: what a learned policy thought, and how far each slot is from the gripper.

use rerun::components::InterpolationMode;
use rerun::{Color, Scalars, SeriesLines};

use crate::scene::{BodyIndex, Scene, Slot};
use crate::trace::{Episode, Prediction, ProgramCall};
use crate::visualize::store::Store;
use crate::visualize::{VisualizeError, clock, palette};

/// Whether any of an episode's calls has probabilities to show.
pub(super) fn has_predictions(episode: &Episode) -> bool {
    episode.calls.iter().any(|call| call.prediction.is_some())
}

/// Logs all series.
pub(super) fn put(store: &mut Store, episode: &Episode) -> Result<(), VisualizeError> {
    put_observation(store, episode)?;
    let deepest = episode.calls.iter().map(|call| call.depth).max().unwrap_or(0);
    for depth in 1..=deepest {
        put_probability(store, episode, depth, "end_of_program", |prediction| prediction.end_probability)?;
        put_probability(store, episode, depth, "program", |prediction| prediction.program_probability)?;
    }
    Ok(())
}

/// One probability of the decisions that made the calls of one depth.
fn put_probability(
    store: &mut Store,
    episode: &Episode,
    depth: u8,
    name: &str,
    value: impl Fn(&Prediction) -> f32,
) -> Result<(), VisualizeError> {
    let of_depth = episode.calls.iter().filter(|call| call.depth == depth);
    let predicted: Vec<(&ProgramCall, &Prediction)> =
        of_depth.filter_map(|call| Some((call, call.prediction.as_ref()?))).collect();
    if predicted.is_empty() {
        return Ok(());
    }
    let path = format!("probability/{name}/depth_{depth}");
    let style = SeriesLines::new()
        .with_names([format!("depth {depth}")])
        .with_colors([palette::of_depth(depth)])
        .with_widths([2.0])
        .with_interpolation_mode(InterpolationMode::StepAfter);
    store.put_static(path.as_str(), &style)?;
    let positions: Vec<usize> = predicted.iter().map(|(call, _)| call.frames.begin as usize).collect();
    let scalars = Scalars::new(predicted.iter().map(|(_, prediction)| f64::from(value(prediction))));
    store.put_rows(path.as_str(), clock::times(&episode.frames, &positions), &scalars)
}

/// Distance of what each slot shows from the gripper.
fn put_observation(store: &mut Store, episode: &Episode) -> Result<(), VisualizeError> {
    let positions: Vec<usize> = (0..episode.frames.len()).collect();
    let observations: Vec<Vec<[f32; 3]>> = episode.frames.iter().map(|frame| frame.observation().slots_m).collect();
    for (index, slot) in episode.scene.slots.iter().enumerate() {
        let path = format!("observation/{}", slot.name);
        let style = SeriesLines::new()
            .with_names([slot.name.as_str()])
            .with_colors([color(&episode.scene, slot)])
            .with_widths([1.5]);
        store.put_static(path.as_str(), &style)?;
        let length = |[x, y, z]: [f32; 3]| f64::from((x * x + y * y + z * z).sqrt());
        let distances = observations.iter().map(|slots| length(slots[index]));
        store.put_rows(path.as_str(), clock::times(&episode.frames, &positions), &Scalars::new(distances))?;
    }
    Ok(())
}

fn color(scene: &Scene, slot: &Slot) -> Color {
    let first: Option<&BodyIndex> = slot.bodies.first();
    palette::color(first.map_or(palette::TARGET, |&body| scene.body(body).color))
}
