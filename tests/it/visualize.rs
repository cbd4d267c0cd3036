//! Episodes as Rerun recordings, read back from the file.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use ntp::model::ScopingKind;
use ntp::program::Program;
use ntp::rollout::{
    Decision, Divergence, DivergenceKind, Expectation, Limits, Oracle, Policy, PolicyError, Query, Start, run,
};
use ntp::scene::BodyIndex;
use ntp::task::{Split, Task};
use ntp::trace::{Actor, Cause, Episode, Frame, Outcome, Prediction, ProgramCall, Provenance, Push, Span};
use ntp::visualize::{Replay, VisualizeError, save, save_replays};
use rerun::StoreKind;
use rerun::external::re_log_encoding::DecoderApp;
use rerun::log::{Chunk, LogMsg};

use crate::kinematic::{KinematicWorld, demonstration, sorting, tower, trial};

/// An oracle that also says how sure it is, so that there is something to plot.
struct Sure(Oracle);

impl Policy for Sure {
    fn name(&self) -> &str {
        "ntp"
    }

    fn decide(&mut self, queries: &[Query]) -> Result<Vec<Decision>, PolicyError> {
        let mut decisions = self.0.decide(queries)?;
        for (query, decision) in queries.iter().zip(&mut decisions) {
            decision.prediction = Some(prediction(query, decision));
        }
        Ok(decisions)
    }
}

fn prediction(query: &Query, decision: &Decision) -> Prediction {
    let wave = (query.decision as f32 * 0.7).sin().abs();
    let peak = |at: u32| {
        let near = |frame: u32| (-0.7 * (f64::from(frame) - f64::from(at)).powi(2)).exp() as f32;
        (query.window.begin..query.window.end).map(near).collect::<Vec<f32>>()
    };
    let composite = decision.program.is_composite();
    Prediction {
        program_probability: 1.0 - 0.1 * wave,
        end_probability: if decision.end_of_program { 0.9 + 0.1 * wave } else { 0.1 * wave },
        start_probabilities: if composite { peak(decision.scope.begin) } else { Vec::new() },
        stop_probabilities: if composite { peak(decision.scope.last()) } else { Vec::new() },
    }
}

/// A demonstration and the rollout that was given it.
fn rollout(task: &Task) -> (Episode, Episode) {
    let shown = demonstration(task, &trial(task, 0, 2), 4);
    let own_trial = trial(task, 1, 2);
    let start = Start {
        task,
        demonstration: shown.clone(),
        world: Box::new(KinematicWorld::new(task.family, &own_trial)),
        sight: None,
        provenance: Provenance::new(task, &own_trial, Actor::Policy(String::new()), 42),
    };
    let expected = Expectation::new(ScopingKind::Scoped, &start.demonstration, start.world.scene());
    let mut policy = Sure(Oracle::new(vec![expected]));
    let episode = run(&mut policy, vec![start], Limits::default()).unwrap().remove(0).episode;
    (shown, smooth(episode))
}

/// The same episode with frames between the boundaries, as physics would record them.
fn smooth(episode: Episode) -> Episode {
    const STEPS: u32 = 8;
    let mut parts = episode.into_parts();
    let between = |pair: &[Frame]| -> Vec<Frame> {
        (0..STEPS)
            .map(|step| {
                let share = step as f32 / STEPS as f32;
                let mut frame = pair[if step == 0 { 0 } else { 1 }].clone();
                frame.boundary = step == 0;
                frame.time_nanos =
                    pair[0].time_nanos + (pair[1].time_nanos - pair[0].time_nanos) * u64::from(step) / u64::from(STEPS);
                frame.slots.clone_from(&pair[0].slots);
                let (from, to) = (&pair[0].state, &pair[1].state);
                frame.state.gripper_in_world = from.gripper_in_world.lerp_slerp(&to.gripper_in_world, share);
                let poses = from.bodies_in_world.iter().zip(&to.bodies_in_world);
                frame.state.bodies_in_world = poses.map(|(from, to)| from.lerp_slerp(to, share)).collect();
                frame.state.held = from.held.and(to.held);
                frame
            })
            .collect()
    };
    let last = parts.frames[parts.frames.len() - 1].clone();
    parts.frames = parts.frames.windows(2).flat_map(between).chain([last]).collect();
    let moved = |span: Span| Span { begin: span.begin * STEPS, end: span.last() * STEPS + 1 };
    let own = parts.provenance.actor == Actor::Expert;
    for call in &mut parts.calls {
        call.frames = moved(call.frames);
        if own {
            call.input = moved(call.input);
            call.output = call.output.map(moved);
        }
    }
    if own {
        parts.specification_frames = parts.frames.len() as u32;
    }
    Episode::new(parts).unwrap()
}

/// What an `.rrd` file holds.
struct Read {
    recordings: BTreeMap<String, Vec<Chunk>>,
    _folder: tempfile::TempDir,
    path: PathBuf,
}

fn decode(path: &Path) -> Vec<LogMsg> {
    let file = std::io::BufReader::new(std::fs::File::open(path).unwrap());
    DecoderApp::decode_lazy(file).collect::<Result<_, _>>().unwrap()
}

fn read_back(replays: &[Replay<'_>]) -> Read {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("episode.rrd");
    let summary = save_replays(replays, &path).unwrap();
    assert_eq!(summary.bytes, std::fs::metadata(&path).unwrap().len());
    assert_eq!(summary.episodes, replays.len());
    Read { recordings: recordings(&path), _folder: folder, path }
}

/// The chunks of each recording in a file, blueprints left out.
pub(crate) fn recordings(path: &Path) -> BTreeMap<String, Vec<Chunk>> {
    let mut recordings: BTreeMap<String, Vec<Chunk>> = BTreeMap::new();
    for message in decode(path) {
        let LogMsg::ArrowMsg(store, message) = message else { continue };
        let chunk = Chunk::from_arrow_msg(&message).unwrap();
        if store.kind() == StoreKind::Recording {
            recordings.entry(store.recording_id().to_string()).or_default().push(chunk);
        }
    }
    recordings
}

impl Read {
    fn only(&self) -> &[Chunk] {
        assert_eq!(self.recordings.len(), 1);
        self.recordings.values().next().unwrap()
    }
}

pub(crate) fn entities(chunks: &[Chunk]) -> BTreeSet<String> {
    chunks.iter().map(|chunk| chunk.entity_path().to_string()).collect()
}

pub(crate) fn temporal<'c>(chunks: &'c [Chunk], entity: &str) -> &'c Chunk {
    let found: Vec<&Chunk> =
        chunks.iter().filter(|chunk| chunk.entity_path().to_string() == entity && !chunk.is_static()).collect();
    assert_eq!(found.len(), 1, "{entity}");
    found[0]
}

fn times(chunk: &Chunk, timeline: &'static str) -> Vec<i64> {
    chunk.timelines()[&timeline.into()].times_raw().to_vec()
}

/// Frames and labels of a lane.
pub(crate) fn lane(chunks: &[Chunk], entity: &str) -> Vec<(i64, String)> {
    let chunk = temporal(chunks, entity);
    let component = rerun::StateChange::descriptor_state().component;
    let labels = chunk.iter_slices::<String>(component);
    let label = |row: Vec<rerun::external::re_types_core::ArrowString>| {
        row.first().map(ToString::to_string).unwrap_or_default()
    };
    times(chunk, "frame").into_iter().zip(labels.map(label)).collect()
}

/// The two kinds of recordings: an expert's, and a rollout beside its demonstration.
fn replays_of_a_tower() -> (Episode, Episode, Episode) {
    let task = tower("stack_0012", &[4, 1, 6, 2], Split::Unseen);
    let expert = smooth(demonstration(&task, &trial(&task, 0, 1), 7));
    let (shown, acted) = rollout(&task);
    (expert, shown, acted)
}

#[test]
fn a_recording_has_scene_programs_scopes_and_words_on_two_timelines() {
    let (_, shown, acted) = replays_of_a_tower();
    let read = read_back(&[Replay { episode: &acted, demonstration: Some(&shown), divergence: None, cameras: &[] }]);
    let chunks = read.only();
    let found = entities(chunks);
    let bodies = acted.scene.bodies.iter().map(|body| format!("/world/bodies/{}", body.name));
    let lanes = (0..4).flat_map(|depth| {
        ["programs", "programs_of_expert", "specification/scope"].map(|root| format!("/{root}/depth_{depth}"))
    });
    let others = [
        "/__properties",
        "/__properties/episode",
        "/calls",
        "/camera/front",
        "/camera/wrist",
        "/episode",
        "/observation/block_A",
        "/probability/end_of_program/depth_3",
        "/specification/demonstration",
        "/specification/probability/depth_2",
        "/world/gripper",
        "/world/gripper/fingers",
        "/world/table",
        "/world/target",
    ];
    for entity in bodies.chain(lanes).chain(others.map(str::to_owned)) {
        assert!(found.contains(&entity), "{entity} is not among {found:?}");
    }
    for chunk in chunks.iter().filter(|chunk| !chunk.is_static()) {
        let names: BTreeSet<&str> = chunk.timelines().keys().map(rerun::TimelineName::as_str).collect();
        assert_eq!(names, BTreeSet::from(["frame", "sim_time"]), "{}", chunk.entity_path());
    }
}

#[test]
fn an_expert_has_neither_probabilities_nor_a_second_set_of_lanes() {
    let (expert, ..) = replays_of_a_tower();
    let read = read_back(&[Replay::from(&expert)]);
    let found = entities(read.only());
    assert!(!found.iter().any(|entity| entity.contains("probability") || entity.contains("of_expert")));
    assert!(found.contains("/specification/demonstration"));
}

#[test]
fn bodies_are_where_the_frames_say_whenever_they_have_moved() {
    let (expert, ..) = replays_of_a_tower();
    let read = read_back(&[Replay::from(&expert)]);
    for (index, body) in expert.scene.body_indices().zip(&expert.scene.bodies) {
        let chunk = temporal(read.only(), &format!("/world/bodies/{}", body.name));
        let component = rerun::Transform3D::descriptor_translation().component;
        let logged: Vec<[f32; 3]> = chunk.iter_slices::<[f32; 3]>(component).map(|row| row[0]).collect();
        let frames = times(chunk, "frame");
        assert_eq!(frames.len(), logged.len());
        for (number, frame) in expert.frames.iter().enumerate() {
            let last = frames.partition_point(|&at| at <= number as i64) - 1;
            let position: [f32; 3] = frame.state.body_in_world(index).translation.vector.into();
            assert_eq!(logged[last], position, "{} at frame {number}", body.name);
        }
    }
}

#[test]
fn time_is_the_episodes_own_clock() {
    let (expert, ..) = replays_of_a_tower();
    let read = read_back(&[Replay::from(&expert)]);
    let chunk = temporal(read.only(), "/observation/block_A");
    let expected: Vec<i64> = expert.frames.iter().map(|frame| frame.time_nanos as i64).collect();
    assert_eq!(times(chunk, "sim_time"), expected);
}

/// Every call of the episode begins and ends in the lane of its depth at its own frames.
#[track_caller]
fn check_lanes(chunks: &[Chunk], root: &str, episode: &Episode) {
    let takes_time = |call: &&ProgramCall| call.program != Program::None;
    for call in episode.calls.iter().filter(takes_time) {
        let lane = lane(chunks, &format!("/{root}/depth_{}", call.depth));
        let begin = lane.iter().position(|(_, state)| state.ends_with(&format!("#{}", call.id.0))).unwrap();
        let (at, state) = &lane[begin];
        assert_eq!(*at, i64::from(call.frames.begin), "{state}");
        assert!(state.starts_with(call.program.name()), "{state}");
        assert_eq!(lane[begin + 1].0, i64::from(call.frames.last()), "{state}");
    }
    let n_states: usize = (0..=3)
        .flat_map(|depth| lane(chunks, &format!("/{root}/depth_{depth}")))
        .filter(|(_, state)| !state.is_empty())
        .count();
    assert_eq!(n_states, episode.calls.iter().filter(takes_time).count());
}

#[test]
fn each_calls_lane_begins_and_ends_at_its_frames() {
    let (expert, shown, acted) = replays_of_a_tower();
    check_lanes(read_back(&[Replay::from(&expert)]).only(), "programs", &expert);
    let read = read_back(&[Replay { episode: &acted, demonstration: Some(&shown), divergence: None, cameras: &[] }]);
    check_lanes(read.only(), "programs", &acted);
    check_lanes(read.only(), "programs_of_expert", &shown);
}

#[test]
fn a_lane_turns_at_the_first_divergence_and_words_say_what_it_is() {
    let (_, shown, acted) = replays_of_a_tower();
    let divergence = Divergence { decision: 6, kind: DivergenceKind::Argument, program: Program::Pick };
    let replay = Replay { episode: &acted, demonstration: Some(&shown), divergence: Some(divergence), cameras: &[] };
    let read = read_back(&[replay]);
    let frame = i64::from(acted.calls[7].frames.begin);
    assert!(frame > 0);
    let words = "first divergence: argument of pick, decision 6";
    assert_eq!(lane(read.only(), "/agreement"), [(0, "as the expert".to_owned()), (frame, words.to_owned())]);
    let log = temporal(read.only(), "/calls");
    let lines = log.iter_slices::<String>(rerun::TextLog::descriptor_text().component);
    let told: Vec<usize> = lines.enumerate().filter(|(_, row)| row[0].contains(words)).map(|(at, _)| at).collect();
    assert_eq!(told, [7]);
    let agreed = read_back(&[Replay { divergence: None, ..replay }]);
    assert_eq!(lane(agreed.only(), "/agreement"), [(0, "as the expert".to_owned())]);
}

#[test]
fn a_push_is_an_arrow_a_lane_and_a_line_until_all_rests() {
    let (expert, ..) = replays_of_a_tower();
    let mut parts = expert.into_parts();
    let boundaries: Vec<u32> =
        parts.frames.iter().zip(0..).filter(|(frame, _)| frame.boundary).map(|(_, at)| at).collect();
    let frames = Span { begin: boundaries[4] - 2, end: boundaries[4] + 1 };
    let body = BodyIndex(1);
    parts.pushes = vec![Push { frames, body, impulse_ns: [0.0, 0.06, 0.0], toppled: vec![body] }];
    let episode = Episode::new(parts).unwrap();
    let read = read_back(&[Replay::from(&episode)]);
    let [begin, end] = [i64::from(frames.begin), i64::from(frames.last())];
    let name = &episode.scene.body(body).name;
    assert_eq!(lane(read.only(), "/adversary"), [(begin, format!("pushes {name} #0")), (end, String::new())]);
    let arrow = temporal(read.only(), "/world/adversary");
    assert_eq!(times(arrow, "frame"), [begin, end]);
    let component = rerun::Arrows3D::descriptor_origins().component;
    let origins: Vec<Option<[f32; 3]>> =
        arrow.iter_slices::<[f32; 3]>(component).map(|row| row.first().copied()).collect();
    let stood: [f32; 3] = episode.frames[frames.begin as usize].state.body_in_world(body).translation.vector.into();
    assert_eq!(origins, [Some(stood), None]);
    let log = temporal(read.only(), "/calls");
    let lines = log.iter_slices::<String>(rerun::TextLog::descriptor_text().component);
    let told = format!("adversary: pushes {name} with 0.060 N s; {name} topples");
    let at: Vec<i64> =
        lines.zip(times(log, "frame")).filter(|(row, _)| row[0].as_str() == told).map(|(_, at)| at).collect();
    assert_eq!(at, [begin]);
}

#[test]
fn the_layout_for_foxglove_names_topics_and_fields_that_recordings_have() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let layout = std::fs::read_to_string(root.join("data/foxglove_layout.json")).unwrap();
    let layout: serde_json::Value = serde_json::from_str(&layout).unwrap();
    let topics = std::fs::read_to_string(root.join("schemas/mcap/README.md")).unwrap();
    let messages = ["program_stack", "program_call", "observation"]
        .map(|name| std::fs::read_to_string(root.join(format!("schemas/mcap/ntp/v1/{name}.proto"))).unwrap());
    let mut waiting = vec![&layout];
    let mut n_paths = 0;
    while let Some(value) = waiting.pop() {
        waiting.extend(value.as_array().into_iter().flatten());
        waiting.extend(value.as_object().into_iter().flat_map(|map| map.values()));
        let Some(path) = value.as_str().filter(|text| text.starts_with('/')) else { continue };
        let mut parts = path.split('.');
        let topic = parts.next().unwrap();
        assert!(topics.contains(&format!("| `{topic}` |")), "{topic}");
        for field in parts {
            assert!(messages.iter().any(|message| message.contains(&format!(" {field} = "))), "{path}");
        }
        n_paths += 1;
    }
    assert!(n_paths > 8);
}

/// Where the bars of a strip begin and end, as shares of the specification.
fn bars(chunks: &[Chunk], entity: &str) -> Vec<Option<(f32, f32)>> {
    let chunk = temporal(chunks, entity);
    let radii: Vec<Option<f32>> = chunk
        .iter_slices::<f32>(rerun::LineStrips2D::descriptor_radii().component)
        .map(|row| row.first().copied())
        .collect();
    let lines = chunk.iter_component::<rerun::LineStrip2D>(rerun::LineStrips2D::descriptor_strips().component);
    let lines = lines.map(|row| row.first().map(|line| (line.0[0].x(), line.0[line.0.len() - 1].x())));
    let bar = |(line, radius): (Option<(f32, f32)>, Option<f32>)| {
        let ((begin, end), radius) = (line?, radius?);
        Some(((begin - radius) / 100.0, (end + radius) / 100.0))
    };
    lines.zip(radii).map(bar).collect()
}

#[test]
fn scopes_are_the_output_spans_on_the_boundary_frames_of_the_specification() {
    let (expert, shown, acted) = replays_of_a_tower();
    for (episode, demonstration) in [(&expert, None), (&acted, Some(&shown))] {
        let read = read_back(&[Replay { episode, demonstration, divergence: None, cameras: &[] }]);
        let spans = if demonstration.is_none() { episode.clone().boundaries_only() } else { episode.clone() };
        for depth in 0..3_u8 {
            let entity = format!("/specification/scope/depth_{depth}");
            let shown: Vec<(f32, f32)> = bars(read.only(), &entity).into_iter().flatten().collect();
            let outputs = spans.calls.iter().filter(|call| call.depth == depth).filter_map(|call| call.output);
            let outputs: Vec<Span> = outputs.collect();
            assert_eq!(shown.len(), outputs.len());
            for ((begin, end), output) in shown.into_iter().zip(outputs) {
                let share = |frame: u32| frame as f32 / spans.specification_frames as f32;
                assert!((begin - share(output.begin)).abs() < 1e-4 && (end - share(output.end)).abs() < 1e-4);
            }
        }
    }
}

#[test]
fn probabilities_are_those_of_the_decisions() {
    let (_, _, acted) = replays_of_a_tower();
    let read = read_back(&[Replay::from(&acted)]);
    let chunk = temporal(read.only(), "/probability/end_of_program/depth_2");
    let component = rerun::Scalars::descriptor_scalars().component;
    let logged: Vec<f64> = chunk.iter_slices::<f64>(component).map(|row| row[0]).collect();
    let of_depth = acted.calls.iter().filter(|call| call.depth == 2);
    let expected: Vec<f64> =
        of_depth.map(|call| f64::from(call.prediction.as_ref().unwrap().end_probability)).collect();
    assert_eq!(logged, expected);
}

#[test]
fn the_same_replays_give_the_same_bytes() {
    let (expert, shown, acted) = replays_of_a_tower();
    let replays = [
        Replay::from(&expert),
        Replay { episode: &acted, demonstration: Some(&shown), divergence: None, cameras: &[] },
    ];
    let (first, second) = (read_back(&replays), read_back(&replays));
    let (first, second) = (std::fs::read(&first.path).unwrap(), std::fs::read(&second.path).unwrap());
    let first_difference = first.iter().zip(&second).position(|(a, b)| a != b);
    assert_eq!((first_difference, first.len()), (None, second.len()));
}

#[test]
fn other_content_has_another_recording_id() {
    let (expert, ..) = replays_of_a_tower();
    let mut parts = expert.clone().into_parts();
    parts.frames[3].state.gripper_in_world.translation.x += 0.01;
    let moved = Episode::new(parts).unwrap();
    assert_eq!(read_back(&[Replay::from(&expert), Replay::from(&moved)]).recordings.len(), 2);
}

#[test]
fn each_episode_is_a_recording_with_its_name_and_outcome_under_one_blueprint() {
    let task = tower("stack_0012", &[4, 1], Split::Seen);
    let episodes: Vec<Episode> =
        (0..3_u32).map(|index| demonstration(&task, &trial(&task, index, 1), index.into())).collect();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("all.rrd");
    let summary = save(&episodes, &path).unwrap();
    assert_eq!((summary.episodes, summary.frames, summary.calls), (3, 15, 3 * 9));
    let messages = decode(&path);
    let activations = messages.iter().filter(|message| matches!(message, LogMsg::BlueprintActivationCommand(_)));
    assert_eq!(activations.count(), 1);
    let names: Vec<String> = messages.iter().filter_map(recording_name_of).collect();
    assert_eq!(names, ["stack_0012/ep-000000", "stack_0012/ep-000001", "stack_0012/ep-000002"]);
    let outcomes = messages.iter().filter_map(|message| property(message, "outcome"));
    assert_eq!(outcomes.collect::<Vec<_>>(), ["success"; 3]);
}

fn recording_name_of(message: &LogMsg) -> Option<String> {
    text_at(message, "/__properties", rerun::RecordingInfo::descriptor_name().component)
}

fn property(message: &LogMsg, name: &'static str) -> Option<String> {
    text_at(message, "/__properties/episode", name.into())
}

fn text_at(message: &LogMsg, entity: &str, component: rerun::ComponentIdentifier) -> Option<String> {
    let LogMsg::ArrowMsg(_, message) = message else { return None };
    let chunk = Chunk::from_arrow_msg(message).unwrap();
    (chunk.entity_path().to_string() == entity)
        .then(|| chunk.iter_slices::<String>(component).next().map(|row| row[0].to_string()))?
}

#[test]
fn the_footer_lists_each_store_in_the_order_of_the_file() {
    let (expert, ..) = replays_of_a_tower();
    let read = read_back(&[Replay::from(&expert)]);
    let file = std::io::BufReader::new(std::fs::File::open(&read.path).unwrap());
    let mut decoder = DecoderApp::decode_lazy(file);
    let n_chunks = decoder.by_ref().filter(|message| matches!(message, Ok(LogMsg::ArrowMsg(..)))).count();
    let manifests = decoder.rrd_manifests().unwrap();
    let kinds: Vec<StoreKind> = manifests.iter().map(|manifest| manifest.store_id.kind()).collect();
    assert_eq!(kinds, [StoreKind::Blueprint, StoreKind::Recording]);
    let listed: usize = manifests.iter().map(|manifest| manifest.data.num_rows()).sum();
    assert_eq!(listed, n_chunks);
}

#[test]
fn an_episode_that_was_broken_off_shows_its_cause_and_its_open_calls() {
    let task = tower("stack_0012", &[4, 1, 6], Split::Seen);
    let whole = smooth(demonstration(&task, &trial(&task, 0, 1), 0));
    let mut parts = whole.into_parts();
    parts.frames.truncate(20);
    parts.calls.retain(|call| call.frames.begin < 20);
    let cut = |span: Span| Span { begin: span.begin, end: span.end.min(20) };
    for call in &mut parts.calls {
        call.frames = cut(call.frames);
        call.input = cut(call.input);
        call.output = call.output.map(cut);
    }
    parts.specification_frames = 20;
    parts.outcome = Outcome::Failure(Cause::DroppedObject);
    let episode = Episode::new(parts).unwrap();
    let read = read_back(&[Replay::from(&episode)]);
    check_lanes(read.only(), "programs", &episode);
    let log = temporal(read.only(), "/calls");
    let lines: Vec<String> =
        log.iter_slices::<String>(rerun::TextLog::descriptor_text().component).map(|row| row[0].to_string()).collect();
    assert_eq!(lines.last().unwrap(), "failure: dropped_object");
    assert!(lines.contains(&"pick_and_place › place › move_to(block_E)".to_owned()), "{lines:?}");
}

#[test]
fn an_episode_of_one_frame_can_be_shown() {
    let task = tower("stack_0012", &[4, 1], Split::Seen);
    let mut parts = demonstration(&task, &trial(&task, 0, 1), 0).into_parts();
    let one = Span { begin: 0, end: 1 };
    parts.frames.truncate(1);
    parts.calls.truncate(4);
    for call in &mut parts.calls {
        (call.frames, call.input, call.output) = (one, one, Some(one));
    }
    parts.specification_frames = 1;
    parts.outcome = Outcome::Failure(Cause::TimeLimit);
    let episode = Episode::new(parts).unwrap();
    let read = read_back(&[Replay::from(&episode)]);
    assert_eq!(lane(read.only(), "/programs/depth_3"), [(0, "move_to(block_B) #3".to_owned())]);
}

#[test]
fn forty_objects_in_four_containers_can_be_shown() {
    let task = sorting("sort_0003", [2, 0, 3, 1], Split::Seen);
    let episode = smooth(demonstration(&task, &trial(&task, 0, 10), 7));
    let read = read_back(&[Replay::from(&episode)]);
    let found = entities(read.only());
    assert_eq!(found.iter().filter(|entity| entity.starts_with("/world/bodies/")).count(), 44);
    check_lanes(read.only(), "programs", &episode);
}

#[test]
fn a_demonstration_of_another_length_is_refused_by_number() {
    let (_, _, acted) = replays_of_a_tower();
    let other = tower("other", &[4, 1], Split::Seen);
    let foreign = demonstration(&other, &trial(&other, 0, 1), 3);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("episode.rrd");
    let replays = [Replay { episode: &acted, demonstration: Some(&foreign), divergence: None, cameras: &[] }];
    let error = save_replays(&replays, &path).unwrap_err();
    let expected = "episode 42 was given a specification of 13 frames, but the demonstration to show beside it \
                    (episode 3) has 5 boundary frames";
    assert_eq!(error.to_string(), expected);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn no_episodes_are_an_error_and_leave_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("episode.rrd");
    assert!(matches!(save(&[], &path), Err(VisualizeError::NoEpisodes)));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
