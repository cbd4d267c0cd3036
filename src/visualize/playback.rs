//! Episodes of datasets: running programs, cameras, and numbers over time. Nothing of a scene of ours is needed.

use rerun::blueprint::components::ContainerKind;
use rerun::components::{MediaType, VideoTimestamp};
use rerun::external::re_log_types::EntityPath;
use rerun::log::TimeColumn;
use rerun::{
    AssetVideo, EncodedImage, RecordingInfo, Scalars, SeriesLines, StateChange, StateConfiguration, TextDocument,
    TextLog, VideoFrameReference,
};
use sha2::{Digest as _, Sha256};

use crate::artifact::hex;
use crate::dataset::{CallFacts, CameraTrack, NumberTrack, Playback, TrackPictures};
use crate::visualize::layout::{Layout, Node};
use crate::visualize::store::Store;
use crate::visualize::{VisualizeError, VisualizeSummary, clock, lanes, palette};
use crate::words::counted;

/// What is left of the colour of every other call, so that neighbours can be told apart.
const ODD_SHADE: f32 = 0.82;

/// Builds the blueprint, then one recording after the other, and hands each on before the next is begun.
pub(super) fn each_store(
    playbacks: &[Playback],
    mut emit: impl FnMut(Store) -> Result<(), VisualizeError>,
) -> Result<VisualizeSummary, VisualizeError> {
    let first = playbacks.first().ok_or(VisualizeError::NoEpisodes)?;
    emit(blueprint(first, playbacks.len())?)?;
    let mut summary = VisualizeSummary::default();
    for playback in playbacks {
        emit(recording(playback)?)?;
        summary.episodes += 1;
        summary.frames += playback.times_secs.len();
        summary.calls += playback.facts.calls.len();
    }
    Ok(summary)
}

/// Cameras and lanes at the left, words and numbers at the right. Where there are no cameras, numbers lie below lanes.
fn blueprint(playback: &Playback, n_recordings: usize) -> Result<Store, VisualizeError> {
    let mut layout = Layout::new();
    let lanes = layout.view("StateTimeline", "Running programs", "", &["/programs/**"])?;
    let numbers = numbers(&mut layout, playback)?;
    let cameras = cameras(&mut layout, playback)?;
    let document = layout.view("TextDocument", "Episode", "episode", &["/episode"])?;
    let log = layout.log("Calls", "calls", clock::TIMESTAMP)?;
    let (left, right) = match (cameras, numbers) {
        (Some(cameras), Some(numbers)) => {
            let left = layout.split(ContainerKind::Vertical, &[cameras, lanes], &[0.6, 0.4])?;
            (left, layout.split(ContainerKind::Vertical, &[document, log, numbers], &[0.25, 0.35, 0.4])?)
        }
        (Some(other), None) | (None, Some(other)) => {
            let left = layout.split(ContainerKind::Vertical, &[lanes, other], &[0.4, 0.6])?;
            (left, layout.split(ContainerKind::Vertical, &[document, log], &[0.35, 0.65])?)
        }
        (None, None) => (lanes, layout.split(ContainerKind::Vertical, &[document, log], &[0.35, 0.65])?),
    };
    let root = layout.split(ContainerKind::Horizontal, &[left, right], &[0.62, 0.38])?;
    layout.finish(root, n_recordings, clock::TIMESTAMP, None)
}

/// A view a camera, where there are any.
fn cameras(layout: &mut Layout, playback: &Playback) -> Result<Option<Node>, VisualizeError> {
    let mut views = Vec::new();
    for camera in &playback.cameras {
        let origin = format!("camera/{}", camera.name);
        views.push(layout.view("2D", &camera.name, &origin, &[&format!("/{origin}")])?);
    }
    if views.is_empty() { Ok(None) } else { layout.split(ContainerKind::Grid, &views, &[]).map(Some) }
}

/// A plot a feature, one over the other, where there are any.
fn numbers(layout: &mut Layout, playback: &Playback) -> Result<Option<Node>, VisualizeError> {
    let mut plots = Vec::new();
    for track in &playback.numbers {
        plots.push(layout.plot(&track.feature, &format!("numbers/{}", track.feature), None)?);
    }
    if plots.is_empty() { Ok(None) } else { layout.split(ContainerKind::Tabs, &plots, &[]).map(Some) }
}

fn recording(playback: &Playback) -> Result<Store, VisualizeError> {
    let mut store = Store::recording(&recording_id(playback));
    let facts = &playback.facts;
    let name = format!("{}/ep-{:06}", facts.task_id, facts.episode_index);
    store.put_static(EntityPath::properties(), &RecordingInfo::new().with_name(name))?;
    store.put_static("episode", &TextDocument::from_markdown(markdown(playback)))?;
    put_lanes(&mut store, playback)?;
    put_calls(&mut store, playback)?;
    playback.cameras.iter().try_for_each(|camera| put_camera(&mut store, playback, camera))?;
    playback.numbers.iter().try_for_each(|track| put_numbers(&mut store, playback, track))?;
    Ok(store)
}

/// Readable, and other for other content.
fn recording_id(playback: &Playback) -> String {
    let facts = &playback.facts;
    let mut hasher = Sha256::new();
    hasher.update(format!("{facts:?}"));
    playback.times_secs.iter().for_each(|secs| hasher.update(secs.to_le_bytes()));
    let numbers = playback.numbers.iter().flat_map(|track| &track.values);
    numbers.for_each(|number| hasher.update(number.to_le_bytes()));
    format!("{}-ep-{:06}-{}", facts.task_id, facts.episode_index, hex(&hasher.finalize()[..6]))
}

fn markdown(playback: &Playback) -> String {
    let facts = &playback.facts;
    let (n_frames, n_calls) = (playback.times_secs.len(), facts.calls.len());
    let duration = playback.times_secs.last().copied().unwrap_or(0.0);
    let episode = facts.episode_index;
    if facts.outcome.is_empty() {
        let split = if facts.split.is_empty() { String::new() } else { format!("split `{}`, ", facts.split) };
        return format!(
            "# {}\n\n{split}episode {episode}: {n_frames}, {duration:.1} s\n",
            facts.task_text,
            n_frames = counted(n_frames, "frame")
        );
    }
    format!(
        "# {}\n\n{}\n\n**{}**, by `{}`, `{}` task\n\nepisode {episode}: {n_frames}, {n_calls}, {duration:.1} s\n",
        facts.task_id,
        facts.task_text,
        facts.outcome,
        facts.actor,
        facts.split,
        n_frames = counted(n_frames, "frame"),
        n_calls = counted(n_calls, "call")
    )
}

/// Both timelines at some frames, given by position.
fn times(playback: &Playback, positions: &[usize]) -> [TimeColumn; 2] {
    let secs = |&position: &usize| playback.times_secs.get(position).copied().unwrap_or(0.0);
    let numbers = positions.iter().map(|&position| position as i64);
    let nanos = positions.iter().map(|position| (secs(position) * 1e9).round() as i64);
    [TimeColumn::new_duration_nanos(clock::TIMESTAMP, nanos), TimeColumn::new_sequence(clock::FRAME, numbers)]
}

fn label(call: &CallFacts) -> String {
    call.argument.as_ref().map_or_else(|| call.program.clone(), |argument| format!("{}({argument})", call.program))
}

/// Logs one lane a depth.
fn put_lanes(store: &mut Store, playback: &Playback) -> Result<(), VisualizeError> {
    let deepest = playback.facts.calls.iter().map(|call| call.depth).max().unwrap_or(0);
    for depth in 0..=deepest {
        let calls = playback.facts.calls.iter().zip(&playback.running).filter(|(call, _)| call.depth == depth);
        let calls: Vec<_> = calls.map(|(call, &[begin, end])| (call, begin as usize..end as usize)).collect();
        let shade = |(position, (call, _)): (usize, &(&CallFacts, _))| {
            let share = if position % 2 == 0 { 1.0 } else { ODD_SHADE };
            palette::dimmed(palette::of_name(&call.program), share)
        };
        // A state holds the call's id, since Rerun would draw two equal states as one.
        let state = |call: &CallFacts| format!("{} #{}", label(call), call.call_id);
        let configuration = StateConfiguration::new()
            .with_values(calls.iter().map(|(call, _)| state(call)))
            .with_labels(calls.iter().map(|(call, _)| label(call)))
            .with_colors(calls.iter().enumerate().map(shade));
        let path = EntityPath::from(format!("programs/depth_{depth}"));
        store.put_static(path.clone(), &configuration)?;
        let changes = lanes::changes(playback.times_secs.len(), calls);
        let positions: Vec<usize> = changes.iter().map(|&(position, _)| position).collect();
        let lengths: Vec<usize> = changes.iter().map(|(_, call)| usize::from(call.is_some())).collect();
        let states = StateChange::new().with_state(changes.iter().filter_map(|&(_, call)| call).map(state));
        store.put_ragged_rows(path, times(playback, &positions), &states, &lengths)?;
    }
    Ok(())
}

/// Logs a line a call when it is called.
fn put_calls(store: &mut Store, playback: &Playback) -> Result<(), VisualizeError> {
    let calls = &playback.facts.calls;
    let positions: Vec<usize> = calls.iter().map(|call| call.frames[0] as usize).collect();
    let line = |call: &CallFacts| format!("{}{}", "  ".repeat(usize::from(call.depth)), label(call));
    let log = TextLog::update_fields()
        .with_many_text(calls.iter().map(line))
        .with_many_color(calls.iter().map(|call| palette::color(palette::of_name(&call.program))));
    store.put_rows("calls", times(playback, &positions), &log)
}

fn put_camera(store: &mut Store, playback: &Playback, camera: &CameraTrack) -> Result<(), VisualizeError> {
    let path = format!("camera/{}", camera.name);
    let n_frames = playback.times_secs.len();
    match &camera.pictures {
        TrackPictures::Images(images) => {
            let shown: Vec<usize> = (0..n_frames.min(images.len())).filter(|&at| !images[at].is_empty()).collect();
            let types = shown.iter().map(|&at| media_type(&images[at]));
            let blobs = shown.iter().map(|&at| images[at].clone());
            let images = EncodedImage::update_fields().with_many_media_type(types).with_many_blob(blobs);
            store.put_rows(path, times(playback, &shown), &images)
        }
        TrackPictures::Video { mp4, from_secs } => {
            store.put_static(path.as_str(), &AssetVideo::from_file_contents(mp4.clone(), Some(MediaType::mp4())))?;
            let at = playback.times_secs.iter().map(|secs| VideoTimestamp::from_secs(from_secs + secs));
            let positions: Vec<usize> = (0..n_frames).collect();
            let references = VideoFrameReference::update_fields().with_many_timestamp(at);
            store.put_rows(path, times(playback, &positions), &references)
        }
    }
}

/// Told by the first bytes: JPEG, or else PNG.
fn media_type(picture: &[u8]) -> MediaType {
    if picture.starts_with(&[0xff, 0xd8]) { MediaType::jpeg() } else { MediaType::png() }
}

fn put_numbers(store: &mut Store, playback: &Playback, track: &NumberTrack) -> Result<(), VisualizeError> {
    let width = track.names.len();
    let positions: Vec<usize> = (0..playback.times_secs.len()).collect();
    for (dimension, name) in track.names.iter().enumerate() {
        let path = EntityPath::from_iter(["numbers", &track.feature, name].map(|part| part.to_owned().into()));
        store.put_static(path.clone(), &SeriesLines::new().with_names([name.as_str()]).with_widths([1.5]))?;
        let values = track.values.iter().skip(dimension).step_by(width.max(1)).copied();
        store.put_rows(path, times(playback, &positions), &Scalars::new(values))?;
    }
    Ok(())
}
