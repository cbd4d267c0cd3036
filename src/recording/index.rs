//! What is in a file: channels, counts, metadata and the plan, told by the file's end or found by reading it through.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom};
use std::path::Path;

use mcap::McapError;
use mcap::records::{ChunkIndex, op};

use super::container::{Fields, MAX_RECORD_BYTES, NoSummary, Summary};
use super::error::{Damage, RecordingError};
use super::schema::{CameraTopic, SCHEMA_VERSION, Topic};
use super::summarised::{self, Summarised};
use super::survey::survey;
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

/// What is in a file, whoever wrote it.
#[derive(Default)]
pub(super) struct Contents {
    /// By channel id.
    pub(super) channels: BTreeMap<u16, Channel>,
    /// Messages of each channel.
    pub(super) messages: BTreeMap<u16, u64>,
    /// Log time of the last message.
    pub(super) end_nanos: u64,
    pub(super) n_chunks: u64,
    /// In the order of the file; empty when the file was read through.
    pub(super) chunks: Vec<ChunkIndex>,
    /// Of a recording of ours.
    pub(super) metadata: Option<BTreeMap<String, String>>,
    /// Of a recording of ours.
    pub(super) plan_json: Option<String>,
    /// Log time of each first message of an episode, and where it, or its chunk, begins; `None` when the file was not
    /// read through.
    pub(super) starts: Option<Vec<(u64, u64)>>,
}

/// The contents of a recording of ours.
pub(super) struct Index {
    pub(super) contents: Contents,
    pub(super) metadata: BTreeMap<String, String>,
    pub(super) family: Option<Family>,
    pub(super) plan_json: String,
    /// Our topic of each channel id; `None` for ids that are not used and channels of others.
    topics: Vec<Option<Topic>>,
}

impl Index {
    /// Reads the index and checks that the file is one that this version can read. A file whose end does not tell
    /// enough is read through.
    pub(super) fn read(path: &Path, file: &mut File) -> Result<Self, RecordingError> {
        let size = file.metadata().map_err(IoError::system("read", path))?.len();
        check_start(path, file, size)?;
        let told = match Summary::read(file) {
            Ok(summary) => Summarised::read(path, size, &summary)?.contents(path, file, size)?,
            Err(NoSummary::Absent) => None,
            Err(error) => return Err(no_summary(path, size, error)),
        };
        let mut contents = told.map_or_else(|| survey(path, file), Ok)?;
        let metadata = contents.metadata.take().ok_or_else(|| foreign(path, "metadata record ntp.recording"))?;
        let family = check_metadata(path, &metadata)?;
        let plan_json = contents.plan_json.take().ok_or_else(|| foreign(path, "attachment plan.json"))?;
        let topics = topics(path, &contents.channels)?;
        Ok(Self { contents, metadata, family, plan_json, topics })
    }

    /// Our topic of a channel, if it is one of ours.
    ///
    /// # Errors
    ///
    /// When no such channel is declared.
    pub(super) fn topic(&self, channel: u16, sequence: u32) -> Result<Option<Topic>, Damage> {
        match self.topics.get(usize::from(channel)) {
            Some(Some(topic)) => Ok(Some(*topic)),
            _ if self.contents.channels.contains_key(&channel) => Ok(None),
            _ => Err(Damage::UnknownChannel { channel, sequence }),
        }
    }

    /// The camera and the topic of a channel, if it is a camera's.
    pub(super) fn camera_topic(&self, channel: u16) -> Option<(&str, CameraTopic)> {
        self.contents.channels.get(&channel)?.camera_topic()
    }

    /// The cameras that have a topic, in the order of their channels.
    pub(super) fn cameras(&self) -> Vec<String> {
        let mut cameras: Vec<String> = Vec::new();
        for (camera, _topic) in self.contents.channels.values().filter_map(Channel::camera_topic) {
            if !cameras.iter().any(|known| known == camera) {
                cameras.push(camera.to_owned());
            }
        }
        cameras
    }

    /// How many episodes there are.
    pub(super) fn n_episodes(&self) -> u64 {
        self.start_channels().filter_map(|channel| self.contents.messages.get(&channel)).sum()
    }

    fn start_channels(&self) -> impl Iterator<Item = u16> {
        (0..).zip(&self.topics).filter(|(_, topic)| **topic == Some(Topic::EpisodeStart)).map(|(id, _)| id)
    }

    /// Start time of each episode, and where its first message, or the chunk of it, begins.
    pub(super) fn starts(&self, path: &Path, file: &mut File) -> Result<Vec<(u64, u64)>, RecordingError> {
        if let Some(starts) = &self.contents.starts {
            return Ok(starts.clone());
        }
        let channels: Vec<u16> = self.start_channels().collect();
        let starts = summarised::places(path, file, &self.contents.chunks, &channels)?;
        // Messages outside of chunks have no index, and those in chunks need none.
        if starts.len() as u64 == self.n_episodes() {
            return Ok(starts);
        }
        Ok(survey(path, file)?.starts.unwrap_or_default())
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
        NoSummary::Absent | NoSummary::Astray => damage(Damage::NoSummary),
        NoSummary::Checksum { saved, calculated } => {
            damage(Damage::Mcap(Box::new(McapError::BadSummaryCrc { saved, calculated })))
        }
    }
}

fn foreign(path: &Path, record: &'static str) -> RecordingError {
    RecordingError::Foreign { path: path.to_owned(), record }
}

pub(super) fn broken(path: &Path, offset: u64, record: &'static str) -> RecordingError {
    RecordingError::Damaged { path: path.to_owned(), offset, source: Damage::Index { record } }
}

/// The content of the record at a place. Without a length it is the record's own.
pub(super) fn read_record(
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
