//! What a recording holds, for people.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::ops::ControlFlow;
use std::path::Path;

use prost::Message as _;
use serde::Serialize;

use super::error::{MessageProblem, RecordingError};
use super::index::{self, Index};
use super::schema::{SCHEMA_VERSION, Topic, proto};
use super::stream::{RawMessage, Stream};
use crate::artifact::{self, IoError};

/// What a recording holds.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RecordingInspection {
    /// Size of the file.
    pub bytes: u64,
    /// Version of topics and messages.
    pub schema_version: u32,
    /// Hash of the programs' names and order.
    pub vocabulary_hash: String,
    /// Who wrote it: names and versions of program and library.
    pub library: String,
    /// Family of its tasks; `None` without episodes.
    pub family: Option<String>,
    /// Episodes.
    pub episodes: u64,
    /// How many of the episodes ended so: `success`, or the cause of failure.
    pub outcomes: BTreeMap<String, u64>,
    /// How many of the episodes are of each split.
    pub splits: BTreeMap<String, u64>,
    /// How many of the episodes each actor acted: `expert`, or a variant.
    pub actors: BTreeMap<String, u64>,
    /// Different tasks.
    pub tasks: u64,
    /// Frames of all episodes.
    pub frames: u64,
    /// How many of them are boundaries.
    pub boundary_frames: u64,
    /// Program calls of all episodes.
    pub calls: u64,
    /// Log time of the last message, in nanoseconds: simulated time with the gaps between episodes.
    pub end_nanos: u64,
    /// Chunks.
    pub chunks: u64,
    /// Messages of all topics.
    pub messages: u64,
    /// Each topic.
    pub topics: Vec<TopicInspection>,
}

/// What one topic holds.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct TopicInspection {
    /// Its name.
    pub topic: String,
    /// Full name of its message type.
    pub schema: String,
    /// Its messages.
    pub messages: u64,
}

/// Reads a recording through, checking every checksum, and tells what it holds.
///
/// # Errors
///
/// As [`super::ShardReader`], but for the rules of single episodes, which are not looked into.
pub fn inspect(path: &Path) -> Result<RecordingInspection, RecordingError> {
    let mut file = artifact::open(path)?;
    let index = Index::read(path, &mut file)?;
    let mut found = overview(path, &mut file, &index)?;
    let mut tasks = BTreeSet::new();
    Stream::whole(path, file)?.messages(|message| {
        let &RawMessage { channel, sequence, log_time_nanos, data, offset, .. } = message;
        let topic = index.topic(channel, sequence).map_err(|source| RecordingError::Damaged {
            path: path.to_owned(),
            offset,
            source,
        })?;
        let counted = match topic {
            Some(Topic::EpisodeStart) => proto::EpisodeStart::decode(data).map(|start| {
                *found.splits.entry(start.split).or_default() += 1;
                *found.actors.entry(start.policy.unwrap_or_else(|| "expert".to_owned())).or_default() += 1;
                tasks.insert(start.task_id);
            }),
            Some(Topic::EpisodeEnd) => proto::EpisodeEnd::decode(data).map(|end| count_end(&mut found, end)),
            _ => Ok(()),
        };
        counted.map_err(|error| RecordingError::Message {
            path: path.to_owned(),
            topic: topic.map_or("", Topic::name).to_owned(),
            episode: found.episodes,
            sequence,
            log_time_nanos,
            problem: MessageProblem::Wire(error),
        })?;
        Ok(ControlFlow::<()>::Continue(()))
    })?;
    found.tasks = tasks.len() as u64;
    Ok(found)
}

fn count_end(found: &mut RecordingInspection, end: proto::EpisodeEnd) {
    // Pushes are counted by their topic.
    let proto::EpisodeEnd { index: _, success, cause, frames, boundary_frames, calls, pushes: _ } = end;
    let outcome = if success { "success".to_owned() } else { cause };
    *found.outcomes.entry(outcome).or_default() += 1;
    found.episodes += 1;
    found.frames += u64::from(frames);
    found.boundary_frames += u64::from(boundary_frames);
    found.calls += u64::from(calls);
}

/// What the index tells.
fn overview(path: &Path, file: &mut File, index: &Index) -> Result<RecordingInspection, RecordingError> {
    let contents = &index.contents;
    let topics = contents.channels.iter().map(|(id, channel)| TopicInspection {
        topic: channel.topic.clone(),
        schema: channel.schema.clone(),
        messages: contents.messages.get(id).copied().unwrap_or_default(),
    });
    Ok(RecordingInspection {
        bytes: file.metadata().map_err(IoError::system("read", path))?.len(),
        schema_version: SCHEMA_VERSION,
        vocabulary_hash: index.metadata.get("vocabulary_hash").cloned().unwrap_or_default(),
        library: index::library(path, file)?,
        family: index.family.map(|family| family.name().to_owned()),
        end_nanos: contents.end_nanos,
        chunks: contents.n_chunks,
        messages: contents.messages.values().sum(),
        topics: topics.collect(),
        ..RecordingInspection::default()
    })
}
