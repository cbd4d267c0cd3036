//! What the end of a file says of the file: channels, chunks, counts, metadata and the plan.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom};
use std::path::Path;

use mcap::McapError;
use mcap::records::{ChunkIndex, MessageIndex, Record, Statistics, op};

use super::container::{Fields, MAX_RECORD_BYTES, NoSummary, Summary};
use super::error::{Damage, RecordingError};
use super::schema::{CameraTopic, SCHEMA_VERSION, Topic};
use super::sink::{METADATA, PLAN};
use super::stream::damaged;
use crate::artifact::IoError;
use crate::program::KnownPrograms;
use crate::task::Family;

/// A channel as the file declares it.
pub(super) struct Channel {
    pub(super) topic: String,
    pub(super) schema: String,
    pub(super) encoding: String,
}

impl Channel {
    /// The camera and the topic, if it is a camera's.
    pub(super) fn camera_topic(&self) -> Option<(&str, CameraTopic)> {
        CameraTopic::from_name(&self.topic).filter(|(_, topic)| topic.message() == self.schema)
    }
}

/// The index of a recording of ours.
pub(super) struct Index {
    pub(super) statistics: Statistics,
    /// By channel id.
    pub(super) channels: BTreeMap<u16, Channel>,
    pub(super) chunks: Vec<ChunkIndex>,
    pub(super) metadata: BTreeMap<String, String>,
    pub(super) family: Option<Family>,
    pub(super) plan_json: String,
    /// Our topic of each channel id; `None` for ids that are not used and channels of others.
    topics: Vec<Option<Topic>>,
}

/// Where records lie that are not in chunks: offset and length with framing.
type Places = BTreeMap<String, (u64, u64)>;

impl Index {
    /// Reads the index and checks that the file is one that this version can read.
    pub(super) fn read(path: &Path, file: &mut File) -> Result<Self, RecordingError> {
        let size = file.metadata().map_err(IoError::system("read", path))?.len();
        check_start(path, file, size)?;
        let summary = Summary::read(file).map_err(|error| no_summary(path, size, error))?;
        let mut statistics = None;
        let mut schemas = BTreeMap::new();
        let mut channels = BTreeMap::new();
        let mut chunks = Vec::new();
        let (mut metadata, mut attachments) = (Places::new(), Places::new());
        let mut records = summary.records();
        for (opcode, content, _) in records.by_ref() {
            // None is in a summary, and the library trusts its lengths.
            if opcode == op::ATTACHMENT {
                continue;
            }
            match mcap::parse_record(opcode, content).map_err(|error| damaged(path, size, error))? {
                Record::Statistics(found) => statistics = Some(found),
                Record::Schema { header, .. } => {
                    schemas.insert(header.id, header.name);
                }
                Record::Channel(mcap::records::Channel {
                    id, schema_id, topic, message_encoding: encoding, ..
                }) => {
                    let schema = schemas.get(&schema_id).cloned().unwrap_or_default();
                    channels.insert(id, Channel { topic, schema, encoding });
                }
                Record::ChunkIndex(chunk) => chunks.push(chunk),
                Record::MetadataIndex(index) => {
                    metadata.insert(index.name, (index.offset, index.length));
                }
                Record::AttachmentIndex(index) => {
                    attachments.insert(index.name, (index.offset, index.length));
                }
                _ => {}
            }
        }
        if !records.rest().is_empty() {
            return Err(broken(path, size, "whole record in the summary"));
        }
        let place = *metadata.get(METADATA).ok_or_else(|| foreign(path, "metadata record ntp.recording"))?;
        let metadata = read_metadata(path, file, size, place)?;
        let family = check_metadata(path, &metadata)?;
        let place = *attachments.get(PLAN).ok_or_else(|| foreign(path, "attachment plan.json"))?;
        let plan_json = read_plan(path, file, size, place)?;
        let topics = topics(path, &channels)?;
        let statistics = statistics.ok_or_else(|| broken(path, size, "statistics record"))?;
        Ok(Self { statistics, channels, chunks, metadata, family, plan_json, topics })
    }

    /// Our topic of a channel, if it is one of ours.
    ///
    /// # Errors
    ///
    /// When no such channel is declared.
    pub(super) fn topic(&self, channel: u16, sequence: u32) -> Result<Option<Topic>, Damage> {
        match self.topics.get(usize::from(channel)) {
            Some(Some(topic)) => Ok(Some(*topic)),
            _ if self.channels.contains_key(&channel) => Ok(None),
            _ => Err(Damage::UnknownChannel { channel, sequence }),
        }
    }

    /// The camera and the topic of a channel, if it is a camera's.
    pub(super) fn camera_topic(&self, channel: u16) -> Option<(&str, CameraTopic)> {
        self.channels.get(&channel)?.camera_topic()
    }

    /// The cameras that have a topic, in the order of their channels.
    pub(super) fn cameras(&self) -> Vec<String> {
        let mut cameras: Vec<String> = Vec::new();
        for (camera, _topic) in self.channels.keys().filter_map(|&channel| self.camera_topic(channel)) {
            if !cameras.iter().any(|known| known == camera) {
                cameras.push(camera.to_owned());
            }
        }
        cameras
    }

    /// How many episodes there are.
    pub(super) fn n_episodes(&self) -> u64 {
        let starts = self.channels_of(Topic::EpisodeStart);
        starts.filter_map(|channel| self.statistics.channel_message_counts.get(&channel)).sum()
    }

    fn channels_of(&self, topic: Topic) -> impl Iterator<Item = u16> {
        (0..).zip(&self.topics).filter(move |(_, found)| **found == Some(topic)).map(|(id, _)| id)
    }

    /// Start time of each episode and the offset of the chunk it begins in.
    pub(super) fn starts(&self, path: &Path, file: &mut File) -> Result<Vec<(u64, u64)>, RecordingError> {
        let size = file.metadata().map_err(IoError::system("read", path))?.len();
        let mut starts = Vec::new();
        for chunk in &self.chunks {
            for channel in self.channels_of(Topic::EpisodeStart) {
                let Some(&offset) = chunk.message_index_offsets.get(&channel) else { continue };
                let content = read_record(path, file, size, (offset, 0), (op::MESSAGE_INDEX, "message index"))?;
                let record = mcap::parse_record(op::MESSAGE_INDEX, &content);
                let Record::MessageIndex(MessageIndex { records, .. }) =
                    record.map_err(|error| damaged(path, offset, error))?
                else {
                    return Err(broken(path, offset, "message index"));
                };
                starts.extend(records.iter().map(|entry| (entry.log_time, chunk.chunk_start_offset)));
            }
        }
        Ok(starts)
    }
}

fn check_start(path: &Path, file: &mut File, size: u64) -> Result<(), RecordingError> {
    let mut magic = Vec::new();
    file.take(mcap::MAGIC.len() as u64).read_to_end(&mut magic).map_err(IoError::system("read", path))?;
    if magic == mcap::MAGIC {
        Ok(())
    } else if mcap::MAGIC.starts_with(&magic) {
        Err(RecordingError::Truncated { path: path.to_owned(), offset: size })
    } else {
        Err(RecordingError::NotMcap { path: path.to_owned() })
    }
}

fn no_summary(path: &Path, size: u64, error: NoSummary) -> RecordingError {
    let damage = |source| RecordingError::Damaged { path: path.to_owned(), offset: size, source };
    match error {
        NoSummary::Io(source) => IoError::system("read", path)(source).into(),
        NoSummary::CutOff => RecordingError::Truncated { path: path.to_owned(), offset: size },
        NoSummary::Absent => damage(Damage::NoSummary),
        NoSummary::Checksum { saved, calculated } => {
            damage(Damage::Mcap(Box::new(McapError::BadSummaryCrc { saved, calculated })))
        }
    }
}

fn foreign(path: &Path, record: &'static str) -> RecordingError {
    RecordingError::Foreign { path: path.to_owned(), record }
}

fn broken(path: &Path, offset: u64, record: &'static str) -> RecordingError {
    RecordingError::Damaged { path: path.to_owned(), offset, source: Damage::Index { record } }
}

/// The content of the record at a place. Without a length it is the record's own.
fn read_record(
    path: &Path,
    file: &mut File,
    size: u64,
    (offset, length): (u64, u64),
    (opcode, name): (u8, &'static str),
) -> Result<Vec<u8>, RecordingError> {
    let io = IoError::system("read", path);
    let read = |file: &mut File| -> std::io::Result<Option<Vec<u8>>> {
        file.seek(SeekFrom::Start(offset))?;
        let mut framing = Vec::new();
        file.take(9).read_to_end(&mut framing)?;
        let Some((&found, content_length)) = framing.split_first() else { return Ok(None) };
        let Some(content_length) = content_length.first_chunk().map(|bytes| u64::from_le_bytes(*bytes)) else {
            return Ok(None);
        };
        let fits = content_length <= size && content_length <= MAX_RECORD_BYTES as u64;
        if found != opcode || !fits || (length != 0 && length != content_length + 9) {
            return Ok(None);
        }
        let mut content = Vec::new();
        file.take(content_length).read_to_end(&mut content)?;
        Ok((content.len() as u64 == content_length).then_some(content))
    };
    read(file).map_err(io)?.ok_or_else(|| broken(path, offset, name))
}

fn read_metadata(
    path: &Path,
    file: &mut File,
    size: u64,
    place: (u64, u64),
) -> Result<BTreeMap<String, String>, RecordingError> {
    let content = read_record(path, file, size, place, (op::METADATA, "metadata record"))?;
    parse_metadata(&content).ok_or_else(|| broken(path, place.0, "metadata record"))
}

/// The content of a metadata record: name, size of the map, keys and values.
pub(super) fn parse_metadata(content: &[u8]) -> Option<BTreeMap<String, String>> {
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).ok();
    let mut fields = Fields::new(content);
    let (_name, _size) = (fields.text()?, fields.u32()?);
    let mut metadata = BTreeMap::new();
    while !fields.rest().is_empty() {
        metadata.insert(text(fields.text()?)?, text(fields.text()?)?);
    }
    Some(metadata)
}

/// Whether this version can read a recording with this metadata; gives the family of its tasks.
pub(super) fn check_metadata(
    path: &Path,
    metadata: &BTreeMap<String, String>,
) -> Result<Option<Family>, RecordingError> {
    let word = |key: &str| metadata.get(key).map(String::as_str).unwrap_or_default();
    let found = word("schema_version");
    if found != SCHEMA_VERSION.to_string() {
        let found = found.to_owned();
        return Err(RecordingError::SchemaVersion { path: path.to_owned(), found, expected: SCHEMA_VERSION });
    }
    let found = word("vocabulary_hash");
    if KnownPrograms::of_hash(found).is_none() {
        let (found, expected) = (found.to_owned(), KnownPrograms::ALL.hash());
        return Err(RecordingError::Vocabulary { path: path.to_owned(), found, expected });
    }
    let family = metadata.get("task_family").map(|word| word.parse());
    family.transpose().map_err(|_error| foreign(path, "known task_family in its metadata"))
}

/// Log time, create time, name, media type, length, data, checksum.
fn read_plan(path: &Path, file: &mut File, size: u64, place: (u64, u64)) -> Result<String, RecordingError> {
    let content = read_record(path, file, size, place, (op::ATTACHMENT, "attachment"))?;
    parse_plan(path, place.0, &content)
}

/// The text of the attachment at an offset, checked.
pub(super) fn parse_plan(path: &Path, offset: u64, content: &[u8]) -> Result<String, RecordingError> {
    let broken = || broken(path, offset, "attachment");
    let (checked, checksum) = content.split_last_chunk().ok_or_else(broken)?;
    let (saved, calculated) = (u32::from_le_bytes(*checksum), crc32fast::hash(checked));
    if saved != calculated {
        return Err(damaged(path, offset, McapError::BadAttachmentCrc { saved, calculated }));
    }
    let data = || -> Option<&[u8]> {
        let mut fields = Fields::new(checked);
        let (_log_time, _create_time, _name, _media_type) =
            (fields.u64()?, fields.u64()?, fields.text()?, fields.text()?);
        let length = fields.u64()?;
        (length == fields.rest().len() as u64).then_some(fields.rest())
    };
    let data = data().ok_or_else(broken)?.to_vec();
    String::from_utf8(data).map_err(|_error| RecordingError::Damaged {
        path: path.to_owned(),
        offset,
        source: Damage::Text { record: PLAN },
    })
}

/// Which of our topics each channel is, when all that a reader needs are there.
fn topics(path: &Path, channels: &BTreeMap<u16, Channel>) -> Result<Vec<Option<Topic>>, RecordingError> {
    let size = channels.last_key_value().map_or(0, |(&id, _)| usize::from(id) + 1);
    let mut topics = vec![None; size];
    for topic in Topic::read() {
        let mut of_topic = channels.iter().filter(|(_, channel)| channel.topic == topic.name()).peekable();
        if of_topic.peek().is_none() && Topic::READ.contains(&topic) {
            return Err(RecordingError::MissingTopic { path: path.to_owned(), topic: topic.name() });
        }
        for (&id, channel) in of_topic {
            if channel.schema != topic.message() || channel.encoding != "protobuf" {
                return Err(RecordingError::TopicSchema {
                    path: path.to_owned(),
                    topic: topic.name(),
                    found: format!("{} in {}", channel.schema, channel.encoding),
                    expected: topic.message(),
                });
            }
            topics[usize::from(id)] = Some(topic);
        }
    }
    Ok(topics)
}

/// The library's name in the file's header.
pub(super) fn library(path: &Path, file: &mut File) -> Result<String, RecordingError> {
    let size = file.metadata().map_err(IoError::system("read", path))?.len();
    let offset = mcap::MAGIC.len() as u64;
    let content = read_record(path, file, size, (offset, 0), (op::HEADER, "header"))?;
    let mut fields = Fields::new(&content);
    let library = fields.text().and_then(|_profile| fields.text()).ok_or_else(|| broken(path, offset, "header"))?;
    Ok(String::from_utf8_lossy(library).into_owned())
}
