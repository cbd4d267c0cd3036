//! Episodes to MCAP and back: nothing lost, nothing read that is not right.

mod camera_faults;
mod cameras;
mod container;
mod faults;
mod layouts;
mod random;

use std::fs;
use std::path::{Path, PathBuf};

use ntp::geometry::Pose;
use ntp::recording::{RecordingError, ShardReader, ShardSummary, ShardWriter, inspect};
use ntp::task::Split;
use ntp::trace::{Actor, Episode, Outcome};
use proptest::prelude::{ProptestConfig, any};
use proptest::{prop_assert, prop_assert_eq, proptest};
use tempfile::TempDir;

use crate::kinematic::{demonstration, sorting, tower, trial};
use random::episodes;

const PLAN: &str = "{\"stage\":\"generate\"}";

/// A folder with a recording in it.
struct Recording {
    folder: TempDir,
    summary: ShardSummary,
}

impl Recording {
    fn of(episodes: &[Episode]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut writer = ShardWriter::create(&folder.path().join("shard.mcap"), PLAN).unwrap();
        for episode in episodes {
            writer.write(episode).unwrap();
        }
        let summary = writer.finish().unwrap();
        Self { folder, summary }
    }

    fn path(&self) -> PathBuf {
        self.folder.path().join("shard.mcap")
    }

    fn bytes(&self) -> Vec<u8> {
        fs::read(self.path()).unwrap()
    }
}

fn read(path: &Path) -> Result<Vec<Episode>, RecordingError> {
    ShardReader::open(path)?.collect()
}

/// Expert episodes of both kinds are of one family a file: these are of stacking.
fn stacking_episodes(n: u16) -> Vec<Episode> {
    let episode = |index: u16| {
        let task = tower(&format!("tower_{index}"), &[index % 8, (index + 3) % 8, (index + 5) % 8], Split::Seen);
        demonstration(&task, &trial(&task, u32::from(index), 1), u64::from(index))
    };
    (0..n).map(episode).collect()
}

fn pose_bits(episode: &Episode) -> Vec<u32> {
    let bits = |pose: &Pose| -> Vec<u32> {
        let numbers = pose.translation.vector.iter().chain(pose.rotation.coords.iter());
        numbers.map(|number| number.to_bits()).collect()
    };
    let states = episode.frames.iter().map(|frame| &frame.state);
    states.flat_map(|state| state.bodies_in_world.iter().chain([&state.gripper_in_world])).flat_map(bits).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn episodes_come_back_as_they_were(written in episodes()) {
        let recording = Recording::of(&written);
        let found = read(&recording.path()).unwrap();
        prop_assert_eq!(&found, &written);
        for (found, written) in found.iter().zip(&written) {
            prop_assert!(pose_bits(found) == pose_bits(written), "poses differ in their bits");
        }
        let mut reader = ShardReader::open(&recording.path()).unwrap();
        for position in (0..written.len()).rev() {
            prop_assert_eq!(&reader.read_episode(position as u64).unwrap(), &written[position]);
        }
        prop_assert_eq!(reader.n_episodes(), written.len() as u64);
        prop_assert_eq!(reader.count(), written.len());
    }

    #[test]
    fn same_episodes_give_the_same_bytes(written in episodes()) {
        let first = Recording::of(&written).bytes();
        for _ in 0..4 {
            prop_assert!(Recording::of(&written).bytes() == first);
        }
    }

    #[test]
    fn damaged_messages_give_an_error_or_an_episode(seed in any::<u64>()) {
        faults::check_damaged_message(seed);
    }
}

#[test]
fn demonstrations_of_both_families_come_back() {
    let stacking = stacking_episodes(20);
    assert_eq!(read(&Recording::of(&stacking).path()).unwrap(), stacking);
    let task = sorting("map", [3, 1, 0, 2], Split::Unseen);
    let sorting = [demonstration(&task, &trial(&task, 4, 10), 9)];
    assert_eq!(read(&Recording::of(&sorting).path()).unwrap(), sorting);
}

#[test]
fn a_shard_of_many_chunks_is_read_in_order_and_by_position() {
    let written: Vec<Episode> = (0..30).flat_map(|_| stacking_episodes(40)).collect();
    let recording = Recording::of(&written);
    assert!(inspect(&recording.path()).unwrap().chunks > 3);
    let mut reader = ShardReader::open(&recording.path()).unwrap();
    for position in [1199, 0, 600, 601, 77] {
        assert_eq!(reader.read_episode(position).unwrap(), written[position as usize]);
    }
    assert!(reader.map(Result::unwrap).eq(written));
}

#[test]
fn boundaries_are_read_as_the_episode_without_other_frames() {
    let written = stacking_episodes(12);
    let with_more: Vec<Episode> = written.iter().map(|episode| crate::dataset::densify(episode, 3)).collect();
    let recording = Recording::of(&with_more);
    let found: Vec<_> = ShardReader::open(&recording.path()).unwrap().boundaries().map(Result::unwrap).collect();
    assert_eq!(found.len(), written.len());
    for (found, recorded) in found.iter().zip(&with_more) {
        assert_eq!(*found.episode(), recorded.clone().boundaries_only());
        let positions: Vec<u32> = recorded.boundary_frames().map(|(at, _)| at as u32).collect();
        assert_eq!(found.recorded().positions, positions);
        assert_eq!(found.recorded().count as usize, recorded.frames.len());
        assert_eq!(found.recorded().end_nanos, recorded.frames.last().unwrap().time_nanos);
    }
}

#[test]
fn an_episode_behind_the_last_is_refused() {
    let recording = Recording::of(&stacking_episodes(2));
    let mut reader = ShardReader::open(&recording.path()).unwrap();
    let error = reader.read_episode(2).unwrap_err();
    assert!(matches!(error, RecordingError::NoSuchEpisode { position: 2, episodes: 2, .. }), "{error}");
}

#[test]
fn an_empty_shard_is_a_recording_without_episodes() {
    let recording = Recording::of(&[]);
    let mut reader = ShardReader::open(&recording.path()).unwrap();
    assert_eq!((reader.plan_json(), reader.n_episodes(), reader.family()), (PLAN, 0, None));
    assert!(reader.next().is_none());
}

#[test]
fn the_plan_comes_back_and_the_summary_counts() {
    let mut written = stacking_episodes(3);
    let mut parts = written.remove(1).into_parts();
    parts.outcome = Outcome::Failure(ntp::trace::Cause::KnockedTower);
    parts.provenance.actor = Actor::Policy("ntp".to_owned());
    parts.provenance.split = Split::Unseen;
    written.insert(1, Episode::new(parts).unwrap());
    let recording = Recording::of(&written);
    assert_eq!(ShardReader::open(&recording.path()).unwrap().plan_json(), PLAN);
    let n_frames: usize = written.iter().map(|episode| episode.frames.len()).sum();
    let n_calls: usize = written.iter().map(|episode| episode.calls.len()).sum();
    let expected = ShardSummary { episodes: 3, failed: 1, frames: n_frames as u64, calls: n_calls as u64 };
    assert_eq!(recording.summary, expected);

    let found = inspect(&recording.path()).unwrap();
    assert_eq!((found.episodes, found.frames, found.calls, found.tasks), (3, n_frames as u64, n_calls as u64, 3));
    assert_eq!(found.boundary_frames, found.frames);
    let count = |counts: &std::collections::BTreeMap<String, u64>| {
        counts.iter().map(|(word, n)| format!("{word} {n}")).collect::<Vec<_>>().join(", ")
    };
    assert_eq!(count(&found.outcomes), "knocked_tower 1, success 2");
    assert_eq!(count(&found.splits), "seen 2, unseen 1");
    assert_eq!(count(&found.actors), "expert 2, ntp 1");
    assert_eq!((found.family.as_deref(), found.schema_version), (Some("block_stacking"), 1));
    assert_eq!(found.bytes, recording.bytes().len() as u64);
    assert_eq!(found.messages, found.topics.iter().map(|topic| topic.messages).sum::<u64>());
    let transforms = found.topics.iter().find(|topic| topic.topic == "/tf").unwrap();
    assert_eq!((transforms.messages, transforms.schema.as_str()), (n_frames as u64, "foxglove.FrameTransforms"));
}

#[test]
fn a_writer_that_is_dropped_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let mut writer = ShardWriter::create(&folder.path().join("shard.mcap"), PLAN).unwrap();
    writer.write(&stacking_episodes(1)[0]).unwrap();
    drop(writer);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

/// Other angles at each frame, a zero with a sign among them.
fn with_joints(episode: Episode) -> Episode {
    let mut parts = episode.into_parts();
    for (number, frame) in parts.frames.iter_mut().enumerate() {
        let angle = |joint: usize| number as f32 * 0.01 - joint as f32 * 0.3;
        frame.state.joints_rad = Some(std::array::from_fn(|joint| if joint == 6 { -0.0 } else { angle(joint) }));
    }
    Episode::new(parts).unwrap()
}

#[test]
fn joints_come_back_bit_for_bit() {
    let episodes: Vec<Episode> = stacking_episodes(3).into_iter().map(with_joints).collect();
    let recording = Recording::of(&episodes);
    let found = read(&recording.path()).unwrap();
    assert_eq!(found, episodes);
    let bits = |episodes: &[Episode]| -> Vec<u32> {
        let frames = episodes.iter().flat_map(|episode| &episode.frames);
        frames.flat_map(|frame| frame.state.joints_rad.unwrap().map(f32::to_bits)).collect()
    };
    assert_eq!(bits(&found), bits(&episodes));
}

#[test]
fn a_recording_is_of_robots_with_joints_or_without() {
    let folder = tempfile::tempdir().unwrap();
    let [without, with] = [stacking_episodes(2).remove(0), with_joints(stacking_episodes(2).remove(1))];
    let mut writer = ShardWriter::create(&folder.path().join("shard.mcap"), PLAN).unwrap();
    writer.write(&without).unwrap();
    let refused = writer.write(&with).unwrap_err().to_string();
    assert!(refused.contains("its robot has joints and those of the file's others have none"), "{refused}");
    let mut parts = with.into_parts();
    parts.frames[1].state.joints_rad = None;
    let refused = Episode::new(parts).unwrap_err().to_string();
    assert_eq!(refused, "frame 1: it tells joints and the first frame does not, or the other way round");
}
