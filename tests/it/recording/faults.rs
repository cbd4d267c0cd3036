//! Files that are wrong: each kind has its named error, none a panic, and none is read as if it were right.

use std::collections::BTreeMap;
use std::fs;
use std::io::{Cursor, Seek as _, SeekFrom, Write as _};

use mcap::records::{MessageHeader, Metadata, Record};
use mcap::{Attachment, Message, MessageStream, WriteOptions, Writer};
use ntp::program::KnownPrograms;
use ntp::recording::{Damage, EpisodeProblem, MessageProblem, RecordingError, ShardReader, ShardWriter, inspect};
use ntp::scene::BodyIndex;
use ntp::task::{Family, Split};
use ntp::trace::{Episode, TraceError};
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::random::episode;
use super::{PLAN, Recording, read, stacking_episodes};
use crate::kinematic::{demonstration, sorting, trial};

/// Writes `bytes` in place of the recording and reads them.
fn read_bytes(recording: &Recording, bytes: &[u8]) -> Result<Vec<Episode>, RecordingError> {
    fs::write(recording.path(), bytes).unwrap();
    read(&recording.path())
}

#[test]
fn a_file_cut_anywhere_is_named_as_cut() {
    let recording = Recording::of(&stacking_episodes(1));
    let bytes = recording.bytes();
    let step = 1 + bytes.len() / 400;
    for end in (0..bytes.len()).step_by(step).chain(bytes.len() - 60..bytes.len()) {
        let error = read_bytes(&recording, &bytes[..end]).unwrap_err();
        assert!(matches!(error, RecordingError::Truncated { .. }), "cut at {end}: {error}");
        assert!(error.to_string().contains("shard.mcap"));
        assert!(matches!(inspect(&recording.path()).unwrap_err(), RecordingError::Truncated { .. }));
    }
}

#[test]
fn every_flipped_byte_is_noticed() {
    let written = [episode(Family::BlockStacking, 1, 2, 3)];
    let recording = Recording::of(&written);
    let whole = recording.bytes();
    let mut file = fs::OpenOptions::new().write(true).open(recording.path()).unwrap();
    let mut put = |position: usize, byte: u8| {
        file.seek(SeekFrom::Start(position as u64)).unwrap();
        file.write_all(&[byte]).unwrap();
    };
    // The summary is one checksum's matter, so some of its bytes are enough.
    let summary = mcap::read::footer(&whole).unwrap().summary_start as usize;
    let footer = whole.len() - 60;
    for position in (0..summary).chain((summary..footer).step_by(31)).chain(footer..whole.len()) {
        put(position, whole[position] ^ (1 << (position % 8)));
        let mut found = Vec::new();
        let failed = ShardReader::open(&recording.path()).and_then(|reader| {
            reader.into_iter().try_for_each(|episode| {
                found.push(episode?);
                Ok(())
            })
        });
        assert!(failed.is_err(), "byte {position} of {} was flipped unnoticed", whole.len());
        assert!(found.iter().all(|episode| *episode == written[0]), "byte {position}: a wrong episode was read");
        put(position, whole[position]);
    }
    assert_eq!(read(&recording.path()).unwrap(), written);
}

#[test]
fn bytes_behind_the_end_are_refused() {
    let recording = Recording::of(&stacking_episodes(1));
    let mut bytes = recording.bytes();
    bytes.push(0);
    assert!(matches!(read_bytes(&recording, &bytes).unwrap_err(), RecordingError::Truncated { .. }));
}

#[test]
fn what_is_no_mcap_file_is_named_so() {
    let recording = Recording::of(&[]);
    let error = read_bytes(&recording, b"PAR1 and more of it").unwrap_err();
    assert!(matches!(error, RecordingError::NotMcap { .. }), "{error}");
    let error = read(&recording.path().with_extension("gone")).unwrap_err();
    assert!(matches!(error, RecordingError::Io(_)), "{error}");
    let error = read(recording.folder.path()).unwrap_err();
    assert!(matches!(error, RecordingError::Io(_)), "{error}");
}

/// A recording as another program might write it.
#[derive(Clone)]
struct Forged {
    metadata: BTreeMap<String, String>,
    plan: Option<&'static str>,
    /// Topic, schema.
    channels: Vec<(&'static str, &'static str)>,
}

impl Forged {
    /// As ours.
    fn sound() -> Self {
        let metadata = [("schema_version", "1".to_owned()), ("vocabulary_hash", KnownPrograms::ALL.hash())];
        Self {
            metadata: metadata.map(|(key, value)| (key.to_owned(), value)).into(),
            plan: Some(PLAN),
            channels: vec![
                ("/ntp/episode/start", "ntp.v1.EpisodeStart"),
                ("/ntp/episode/end", "ntp.v1.EpisodeEnd"),
                ("/tf", "foxglove.FrameTransforms"),
                ("/ntp/observation", "ntp.v1.Observation"),
                ("/ntp/call", "ntp.v1.ProgramCall"),
                ("/ntp/return", "ntp.v1.ProgramReturn"),
            ],
        }
    }

    fn read(&self) -> Result<Vec<Episode>, RecordingError> {
        let mut writer = Writer::new(Cursor::new(Vec::new())).unwrap();
        if !self.metadata.is_empty() {
            let metadata = Metadata { name: "ntp.recording".to_owned(), metadata: self.metadata.clone() };
            writer.write_metadata(&metadata).unwrap();
        }
        for (topic, schema) in &self.channels {
            let schema = writer.add_schema(schema, "protobuf", b"").unwrap();
            writer.add_channel(schema, topic, "protobuf", &BTreeMap::new()).unwrap();
        }
        if let Some(plan) = self.plan {
            writer.attach(&plan_attachment(plan.as_bytes())).unwrap();
        }
        writer.finish().unwrap();
        read_bytes(&Recording::of(&[]), &writer.into_inner().into_inner())
    }
}

fn plan_attachment(data: &[u8]) -> Attachment<'_> {
    let (name, media_type) = ("plan.json".to_owned(), "application/json".to_owned());
    Attachment { log_time: 0, create_time: 0, name, media_type, data: data.into() }
}

#[test]
fn recordings_of_others_are_named_as_such() {
    let sound = Forged::sound();
    assert_eq!(sound.read().unwrap(), []);

    let error = Forged { metadata: BTreeMap::new(), ..sound.clone() }.read().unwrap_err();
    assert!(matches!(error, RecordingError::Foreign { .. }), "{error}");
    let error = Forged { plan: None, ..sound.clone() }.read().unwrap_err();
    assert!(matches!(error, RecordingError::Foreign { record: "attachment plan.json", .. }), "{error}");

    let mut newer = sound.clone();
    newer.metadata.insert("schema_version".to_owned(), "2".to_owned());
    let error = newer.read().unwrap_err();
    assert!(matches!(&error, RecordingError::SchemaVersion { found, expected: 1, .. } if found == "2"), "{error}");

    let mut other = sound.clone();
    other.metadata.insert("vocabulary_hash".to_owned(), "0123456789abcdef".to_owned());
    let error = other.read().unwrap_err();
    assert!(matches!(error, RecordingError::Vocabulary { .. }), "{error}");

    for missing in 0..sound.channels.len() {
        let mut lacking = sound.clone();
        let (topic, _) = lacking.channels.remove(missing);
        let error = lacking.read().unwrap_err();
        assert!(matches!(error, RecordingError::MissingTopic { topic: found, .. } if found == topic), "{error}");
    }

    let mut mistyped = sound;
    mistyped.channels[2].1 = "foxglove.FrameTransform";
    let error = mistyped.read().unwrap_err();
    assert!(matches!(error, RecordingError::TopicSchema { topic: "/tf", .. }), "{error}");
}

/// The recording with its messages changed, as a whole file with right checksums.
fn rewritten(bytes: &[u8], change: impl FnMut(usize, &mut Message<'_>) -> bool) -> Vec<u8> {
    rewritten_with_plan(bytes, PLAN, change)
}

/// As [`rewritten`], with a plan.
pub(super) fn rewritten_with_plan(
    bytes: &[u8],
    plan: &str,
    mut change: impl FnMut(usize, &mut Message<'_>) -> bool,
) -> Vec<u8> {
    let mut writer = WriteOptions::new().compression_threads(0).create(Cursor::new(Vec::new())).unwrap();
    for record in mcap::read::LinearReader::new(bytes).unwrap() {
        if let Record::Metadata(metadata) = record.unwrap() {
            writer.write_metadata(&metadata).unwrap();
        }
    }
    for (position, message) in MessageStream::new(bytes).unwrap().enumerate() {
        let mut message = message.unwrap();
        if change(position, &mut message) {
            writer.write(&message).unwrap();
        }
    }
    writer.attach(&plan_attachment(plan.as_bytes())).unwrap();
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

/// Leaves out the `n`th message of a topic.
fn without(recording: &Recording, topic: &str, n: u32) -> RecordingError {
    let bytes = rewritten(&recording.bytes(), |_, message| !(message.channel.topic == topic && message.sequence == n));
    read_bytes(&Recording::of(&[]), &bytes).unwrap_err()
}

#[test]
fn a_message_that_is_missing_is_noticed() {
    let recording = Recording::of(&stacking_episodes(2));
    assert_eq!(read_bytes(&Recording::of(&[]), &rewritten(&recording.bytes(), |_, _| true)).unwrap().len(), 2);
    for topic in ["/ntp/episode/start", "/tf", "/ntp/observation", "/ntp/call", "/ntp/return"] {
        for n in 0..2 {
            let error = without(&recording, topic, n);
            assert!(matches!(error, RecordingError::Message { .. }), "{n} of {topic}: {error}");
        }
    }
    let error = without(&recording, "/ntp/episode/end", 0);
    let is_named = matches!(&error, RecordingError::Message { episode: 0, topic, .. } if topic == "/ntp/episode/start");
    assert!(is_named, "{error}");
    let error = without(&recording, "/ntp/episode/end", 1);
    assert!(matches!(error, RecordingError::Unfinished { episode: 1, .. }), "{error}");
    // Viewers' messages may be missing.
    let bytes = rewritten(&recording.bytes(), |_, message| !message.channel.topic.starts_with("/scene"));
    assert_eq!(read_bytes(&Recording::of(&[]), &bytes).unwrap().len(), 2);
}

#[test]
fn an_error_of_a_message_names_file_topic_and_episode() {
    let recording = Recording::of(&stacking_episodes(2));
    let bytes = rewritten(&recording.bytes(), |_, message| {
        if message.channel.topic == "/ntp/return" && message.sequence == 20 {
            message.data.to_mut().truncate(1);
        }
        true
    });
    let error = read_bytes(&recording, &bytes).unwrap_err();
    assert!(matches!(error, RecordingError::Message { problem: MessageProblem::Wire(_), .. }), "{error}");
    let text = error.to_string();
    let said = "episode 1 of the file: message 20 of /ntp/return at ";
    assert!(text.starts_with(said) && text.ends_with("shard.mcap"), "{text}");
}

#[test]
fn a_time_that_goes_back_is_noticed() {
    let recording = Recording::of(&stacking_episodes(1));
    let bytes = rewritten(&recording.bytes(), |position, message| {
        message.log_time += u64::from(position == 5);
        true
    });
    let error = read_bytes(&recording, &bytes).unwrap_err();
    let is_named = matches!(error, RecordingError::Damaged { source: Damage::TimeGoesBack { .. }, .. })
        || matches!(error, RecordingError::Message { .. });
    assert!(is_named, "{error}");
}

#[test]
fn a_message_of_an_undeclared_channel_is_noticed() {
    let mut writer = Writer::new(Cursor::new(Vec::new())).unwrap();
    let id = writer.add_channel(0, "/other", "json", &BTreeMap::new()).unwrap();
    let header = MessageHeader { channel_id: id, sequence: 0, log_time: 0, publish_time: 0 };
    writer.write_to_known_channel(&header, b"{}").unwrap();
    writer.finish().unwrap();
    let error = read_bytes(&Recording::of(&[]), &writer.into_inner().into_inner()).unwrap_err();
    assert!(matches!(error, RecordingError::Foreign { .. }), "{error}");
}

/// Changes bytes of messages under right checksums: what is read then is an error or a sound episode.
pub(super) fn check_damaged_message(seed: u64) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let recording = Recording::of(&[episode(Family::ObjectSorting, seed, 3, 4)]);
    let chosen = rng.random_range(0..30);
    let bytes = rewritten(&recording.bytes(), |position, message| {
        if position == chosen && !message.data.is_empty() {
            let data = message.data.to_mut();
            for _ in 0..rng.random_range(1..4) {
                let at = rng.random_range(0..data.len());
                data[at] = rng.random();
            }
        }
        true
    });
    match read_bytes(&recording, &bytes) {
        Ok(episodes) => {
            // What was taken for sound can be used.
            let frames = episodes.iter().flat_map(|episode| episode.frames.iter());
            frames.for_each(|frame| assert_eq!(frame.observation().slots_m.len(), frame.slots.len()));
        }
        Err(error) => assert!(matches!(
            error,
            RecordingError::Message { .. } | RecordingError::Trace { .. } | RecordingError::Damaged { .. }
        )),
    }
}

#[test]
fn an_episode_that_cannot_be_told_is_refused_and_leaves_no_trace() {
    let good = stacking_episodes(2);
    let renamed = |name: &str| {
        let mut parts = good[0].clone().into_parts();
        parts.scene.bodies[1].name = name.to_owned();
        Episode::new(parts).unwrap()
    };
    let task = sorting("map", [0, 1, 2, 3], Split::Seen);
    let other_family = demonstration(&task, &trial(&task, 0, 1), 0);
    let mut parts = good[0].clone().into_parts();
    parts.frames.last_mut().unwrap().time_nanos = u64::MAX - 1;
    let too_late = Episode::new(parts).unwrap();

    let recording = Recording::of(&[]);
    let mut writer = ShardWriter::create(&recording.path(), PLAN).unwrap();
    writer.write(&good[0]).unwrap();
    let mut refuse = |episode: &Episode| match writer.write(episode).unwrap_err() {
        RecordingError::Unrecordable { problem, .. } => problem,
        error => panic!("{error}"),
    };
    assert_eq!(refuse(&renamed("gripper")), EpisodeProblem::NameTaken { name: "gripper".to_owned() });
    assert_eq!(refuse(&renamed("world")), EpisodeProblem::NameTaken { name: "world".to_owned() });
    let twice = good[0].scene.bodies[0].name.clone();
    assert_eq!(refuse(&renamed(&twice)), EpisodeProblem::NameTaken { name: twice });
    assert_eq!(refuse(&other_family), EpisodeProblem::Family { found: "object_sorting", expected: "block_stacking" });
    assert_eq!(refuse(&too_late), EpisodeProblem::TimeOverflow);
    writer.write(&good[1]).unwrap();
    writer.finish().unwrap();
    assert_eq!(read(&recording.path()).unwrap(), good);
    assert_eq!(recording.bytes(), Recording::of(&good).bytes());
}

#[test]
fn bodies_that_the_scene_does_not_have_are_refused_by_the_trace() {
    let good = stacking_episodes(1).remove(0);
    let mut parts = good.clone().into_parts();
    parts.scene.slots[2].bodies.push(BodyIndex(8));
    assert_eq!(Episode::new(parts).unwrap_err(), TraceError::SlotBody { slot: 2, body: 8, bodies: 8 });
    let mut parts = good.into_parts();
    parts.frames[1].state.held = Some(BodyIndex(9));
    assert_eq!(Episode::new(parts).unwrap_err(), TraceError::HeldBody { frame: 1, body: 9, bodies: 8 });
}
