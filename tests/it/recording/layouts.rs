//! Recordings laid out otherwise than ours, as the MCAP specification allows: what is read is the same.

use std::collections::BTreeMap;
use std::fs;
use std::io::Cursor;
use std::path::Path;

use mcap::records::{MessageHeader, Metadata, Record};
use mcap::{Attachment, Compression, MessageStream, WriteOptions};
use ntp::recording::{PlanSource, RecordingError, RecordingInspection, ShardReader, inspect, repair};
use ntp::trace::Episode;
use proptest::prelude::ProptestConfig;
use proptest::proptest;

use super::{Recording, read, stacking_episodes};

/// A plan as stages write it.
const PLAN: &str = r#"{"version":1,"stage":"generate","ntp_version":"0.1.0","shards":1,"inputs":{},"config":{}}"#;
/// A plan of someone else, under the name of ours.
const FOREIGN_PLAN: &str = r#"{"waypoints":[[0.1,0.2,0.3]]}"#;

/// What a writer of MCAP may leave out or do otherwise, one bit each.
const CHOICES: [fn(WriteOptions) -> WriteOptions; 14] = [
    |options| options.use_chunks(false),
    |options| options.compression(Some(Compression::Lz4)),
    |options| options.compression(None),
    |options| options.chunk_size(Some(900)),
    // Without those of chunks the library writes a wrong one of the data: `mcap` 0.25, `ChunkWriter::finish`.
    |options| options.calculate_chunk_crcs(false).calculate_data_section_crc(false),
    |options| options.calculate_data_section_crc(false).calculate_summary_section_crc(false),
    |options| options.calculate_attachment_crcs(false),
    |options| options.emit_statistics(false),
    |options| options.emit_message_indexes(false),
    |options| options.emit_chunk_indexes(false),
    |options| options.emit_attachment_indexes(false).emit_metadata_indexes(false),
    |options| options.repeat_channels(false),
    |options| options.repeat_schemas(false),
    |options| options.emit_summary_records(false).emit_summary_offsets(false),
];

fn options(choices: u16) -> WriteOptions {
    let chosen = CHOICES.iter().enumerate().filter(|(bit, _)| choices >> bit & 1 == 1);
    chosen.fold(WriteOptions::new().compression_threads(0).chunk_size(Some(1 << 16)), |options, (_, choice)| {
        choice(options)
    })
}

fn attachment<'a>(name: &str, data: &'a [u8]) -> Attachment<'a> {
    let (name, media_type) = (name.to_owned(), "application/octet-stream".to_owned());
    Attachment { log_time: 0, create_time: 0, name, media_type, data: data.into() }
}

/// The recording written again by someone who adds things of their own all over the file.
fn laid_out(bytes: &[u8], options: WriteOptions) -> Vec<u8> {
    let mut writer = options.create(Cursor::new(Vec::new())).unwrap();
    writer.attach(&attachment("robot.urdf", b"<robot/>")).unwrap();
    writer.attach(&attachment("plan.json", FOREIGN_PLAN.as_bytes())).unwrap();
    let other = Metadata { name: "operator".to_owned(), metadata: BTreeMap::from([("name".into(), "K.".into())]) };
    writer.write_metadata(&other).unwrap();
    for record in mcap::read::LinearReader::new(bytes).unwrap() {
        if let Record::Metadata(metadata) = record.unwrap() {
            writer.write_metadata(&metadata).unwrap();
        }
    }
    writer.write_private_record(0x99, b"anything", Default::default()).unwrap();
    // Without a schema, which JSON needs not have.
    let temperature = writer.add_channel(0, "/temperature", "json", &BTreeMap::new()).unwrap();
    let mut channels: BTreeMap<String, u16> = BTreeMap::new();
    for (sequence, message) in MessageStream::new(bytes).unwrap().enumerate() {
        let message = message.unwrap();
        let (log_time, publish_time) = (message.log_time, message.publish_time);
        if sequence % 7 == 0 {
            let header =
                MessageHeader { channel_id: temperature, sequence: sequence as u32, log_time, publish_time: 0 };
            writer.write_to_known_channel(&header, b"{\"celsius\": 40}").unwrap();
        }
        let channel_id = *channels.entry(message.channel.topic.clone()).or_insert_with(|| {
            let schema = message.channel.schema.as_ref().unwrap();
            let schema = writer.add_schema(&schema.name, &schema.encoding, &schema.data).unwrap();
            let (topic, encoding) = (&message.channel.topic, &message.channel.message_encoding);
            writer.add_channel(schema, topic, encoding, &BTreeMap::new()).unwrap()
        });
        let header = MessageHeader { channel_id, sequence: message.sequence, log_time, publish_time };
        writer.write_to_known_channel(&header, &message.data).unwrap();
    }
    writer.attach(&attachment("plan.json", PLAN.as_bytes())).unwrap();
    writer.attach(&attachment("notes.bin", &[0xff; 64])).unwrap();
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

/// What is told of the recordings but how it is told.
fn told(path: &Path) -> RecordingInspection {
    let mut found = inspect(path).unwrap();
    found.topics.retain(|topic| topic.topic != "/temperature" && topic.messages > 0);
    found.topics.sort_by(|a, b| a.topic.cmp(&b.topic));
    RecordingInspection { bytes: 0, library: String::new(), chunks: 0, messages: 0, ..found }
}

fn check(episodes: &[Episode], recording: &Recording, choices: u16) {
    let path = recording.folder.path().join("other.mcap");
    fs::write(&path, laid_out(&recording.bytes(), options(choices))).unwrap();
    assert!(read(&path).unwrap() == episodes, "choices {choices:b}");
    let mut reader = ShardReader::open(&path).unwrap();
    assert_eq!(reader.n_episodes(), episodes.len() as u64, "choices {choices:b}");
    assert_eq!(reader.plan_json(), PLAN);
    for position in (0..episodes.len()).rev() {
        assert!(reader.read_episode(position as u64).unwrap() == episodes[position], "choices {choices:b}");
    }
    assert!(ShardReader::open(&path).unwrap().checked().map(Result::unwrap).eq(episodes.iter().cloned()));
    assert_eq!(told(&path), told(&recording.path()), "choices {choices:b}");
    let whole = repair(&path, &recording.folder.path().join("repaired.mcap")).unwrap();
    assert_eq!((whole.reason, whole.kept), (None, episodes.len() as u64));
}

#[test]
fn each_choice_of_a_writer_alone_changes_nothing_that_is_read() {
    let episodes = stacking_episodes(4);
    let recording = Recording::of(&episodes);
    check(&episodes, &recording, 0);
    for choice in 0..CHOICES.len() {
        check(&episodes, &recording, 1 << choice);
    }
}

#[test]
fn any_choices_of_a_writer_together_change_nothing_that_is_read() {
    let episodes = stacking_episodes(2);
    let recording = Recording::of(&episodes);
    proptest!(ProptestConfig::with_cases(48), |(choices in 0..1_u16 << CHOICES.len())| {
        check(&episodes, &recording, choices);
    });
}

#[test]
fn the_chunks_and_messages_of_a_file_without_a_summary_are_counted() {
    let recording = Recording::of(&stacking_episodes(2));
    let path = recording.folder.path().join("other.mcap");
    let n_messages = inspect(&recording.path()).unwrap().messages;
    let no_summary = 1 << 13;
    for (choices, n_chunks) in [(no_summary, 1), (no_summary | 1, 0)] {
        fs::write(&path, laid_out(&recording.bytes(), options(choices))).unwrap();
        let found = inspect(&path).unwrap();
        assert_eq!((found.messages, found.chunks), (n_messages + n_messages.div_ceil(7), n_chunks));
    }
}

#[test]
fn a_repaired_recording_has_its_own_plan_and_no_foreign_attachment() {
    let episodes = stacking_episodes(3);
    let recording = Recording::of(&episodes);
    for choices in [0, 1, 2, 1 << 13] {
        let whole = laid_out(&recording.bytes(), options(choices));
        let [cut, to] = [format!("cut-{choices}.mcap"), format!("to-{choices}.mcap")];
        let [cut, to] = [cut, to].map(|name| recording.folder.path().join(name));
        // The footer and the closing magic are cut off.
        fs::write(&cut, &whole[..whole.len() - 30]).unwrap();
        let found = repair(&cut, &to).unwrap();
        assert_eq!((found.kept, found.plan), (3, PlanSource::Recording));
        assert_eq!(ShardReader::open(&to).unwrap().plan_json(), PLAN);
        assert_eq!(read(&to).unwrap(), episodes);
    }
}

#[test]
fn a_file_cut_before_its_plan_takes_no_foreign_attachment_for_it() {
    let episodes = stacking_episodes(3);
    let recording = Recording::of(&episodes);
    let whole = laid_out(&recording.bytes(), options(1));
    let plan = whole.windows(PLAN.len()).position(|window| window == PLAN.as_bytes()).unwrap();
    let without_foreign_plan = |bytes: &[u8]| {
        let at = bytes.windows(9).position(|window| window == b"plan.json").unwrap();
        let mut bytes = bytes.to_vec();
        bytes[at..at + 9].copy_from_slice(b"path.json");
        bytes
    };
    let [cut, to] = ["cut.mcap", "to.mcap"].map(|name| recording.folder.path().join(name));
    fs::write(&cut, without_foreign_plan(&whole[..plan])).unwrap();
    let found = repair(&cut, &to).unwrap();
    assert_eq!((found.kept, found.plan), (3, PlanSource::Lost));
    assert_eq!(ShardReader::open(&to).unwrap().plan_json(), "{}");
}

#[test]
fn a_damaged_file_without_a_summary_is_still_found_out() {
    let episodes = stacking_episodes(1);
    let recording = Recording::of(&episodes);
    let whole = laid_out(&recording.bytes(), options(1 << 13));
    let path = recording.folder.path().join("other.mcap");
    let step = 1 + whole.len() / 300;
    for position in (0..whole.len()).step_by(step).chain(whole.len() - 80..whole.len()) {
        let mut bytes = whole.clone();
        bytes[position] ^= 1 << (position % 8);
        fs::write(&path, &bytes).unwrap();
        assert!(read(&path).is_err(), "byte {position} of {} was flipped unnoticed", whole.len());
        fs::write(&path, &whole[..position]).unwrap();
        let error = read(&path).unwrap_err();
        assert!(matches!(error, RecordingError::Truncated { .. }), "cut at {position}: {error}");
    }
}

#[test]
fn attachments_larger_than_any_record_that_is_read_are_passed_over() {
    let episodes = stacking_episodes(1);
    let recording = Recording::of(&episodes);
    let path = recording.folder.path().join("large.mcap");
    let bytes = recording.bytes();
    let mut writer = WriteOptions::new().compression_threads(0).create(fs::File::create(&path).unwrap()).unwrap();
    for record in mcap::read::LinearReader::new(&bytes).unwrap() {
        if let Record::Metadata(metadata) = record.unwrap() {
            writer.write_metadata(&metadata).unwrap();
        }
    }
    writer.attach(&attachment("bag.zip", &vec![0; (256 << 20) + 1])).unwrap();
    MessageStream::new(&bytes).unwrap().for_each(|message| writer.write(&message.unwrap()).unwrap());
    writer.attach(&attachment("plan.json", PLAN.as_bytes())).unwrap();
    writer.finish().unwrap();
    drop(writer);
    assert_eq!(read(&path).unwrap(), episodes);
}
