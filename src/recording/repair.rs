//! What can be verified of a recording that is cut off or damaged.
//!
//! The file is read from its beginning, without its index. Episodes are kept until the first checksum, message or rule
//! or picture that is wrong; nothing behind it is looked at. What cameras saw is kept as it is.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use mcap::records::op;
use serde::Serialize;

use super::assembler::{Assembled, Assembler};
use super::decode::check_pictures;
use super::error::{Damage, RecordingError};
use super::index::{Channel, check_metadata, parse_metadata};
use super::plan::PlanSearch;
use super::reader::ShardReader;
use super::schema::Topic;
use super::sink::PLAN;
use super::stream::{RawMessage, Stream, damaged};
use super::survey::{declare, is_metadata};
use super::writer::{ShardSummary, ShardWriter};
use crate::artifact::{self, Plan, read_json};
use crate::trace::Episode;

/// Where the plan of a repaired recording is from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum PlanSource {
    /// From the recording.
    Recording,
    /// From `plan.json` beside it: that of the recording was behind the damage.
    Folder,
    /// From nowhere: the repaired recording has an empty one, and its episodes cannot be simulated again.
    Lost,
}

/// What became of a recording.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct RecordingRepair {
    /// Why it is not whole; `None` when it is, and then nothing is written.
    pub reason: Option<String>,
    /// Episodes that were kept, all when it is whole.
    pub kept: u64,
    /// Where the plan is from.
    pub plan: PlanSource,
}

/// Writes the longest verified prefix of a recording that is not whole, as the writer of recordings would have.
///
/// # Errors
///
/// When not even the first episode can be verified, with what is wrong.
pub fn repair(path: &Path, to: &Path) -> Result<RecordingRepair, RecordingError> {
    let (n_episodes, damage) = check(path);
    let Some(damage) = damage else {
        return Ok(RecordingRepair { reason: None, kept: n_episodes, plan: PlanSource::Recording });
    };
    let mut salvage = Salvage::new(path, to)?;
    let end = salvage.run();
    let Salvage { writer, plan, n_kept, .. } = salvage;
    if n_kept == 0 {
        return Err(end.err().unwrap_or(damage));
    }
    let plan = keep_plan(path, plan.finish().unwrap_or_default(), writer)?;
    Ok(RecordingRepair { reason: Some(damage.to_string()), kept: n_kept, plan })
}

/// Reads the whole recording: how many episodes could be read, and what is wrong.
fn check(path: &Path) -> (u64, Option<RecordingError>) {
    let mut n_episodes = 0;
    let mut read = || -> Result<(), RecordingError> {
        for episode in ShardReader::open(path)?.checked() {
            episode?;
            n_episodes += 1;
        }
        Ok(())
    };
    let damage = read().err();
    (n_episodes, damage)
}

/// Ends the repaired recording with the plan that was found.
fn keep_plan(path: &Path, found: Option<String>, mut writer: ShardWriter) -> Result<PlanSource, RecordingError> {
    let beside = path.with_file_name(PLAN);
    let of_folder = || read_json::<Plan>(&beside).ok().and_then(|plan| serde_json::to_string(&plan).ok());
    let (plan, source) = match found {
        Some(plan) => (plan, PlanSource::Recording),
        None => of_folder().map_or(("{}".to_owned(), PlanSource::Lost), |plan| (plan, PlanSource::Folder)),
    };
    writer.set_plan(plan);
    writer.finish().map(|_summary: ShardSummary| source)
}

/// A recording being read without its index, and what is kept of it being written.
struct Salvage {
    path: PathBuf,
    writer: ShardWriter,
    assembler: Assembler,
    schemas: BTreeMap<u16, String>,
    channels: BTreeMap<u16, Channel>,
    has_metadata: bool,
    plan: PlanSearch,
    last_log_time_nanos: u64,
    n_kept: u64,
}

impl Salvage {
    fn new(path: &Path, to: &Path) -> Result<Self, RecordingError> {
        // Where no index tells, cameras are those that are met, and the metadata record must be met before the messages.
        let reader = ShardReader::open(path).ok();
        let cameras = reader.as_ref().map(ShardReader::cameras).unwrap_or_default();
        Ok(Self {
            path: path.to_owned(),
            writer: ShardWriter::create(to, "{}")?,
            assembler: Assembler::default().with_pictures(cameras),
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            has_metadata: reader.is_some(),
            plan: PlanSearch::default(),
            last_log_time_nanos: 0,
            n_kept: 0,
        })
    }

    /// Reads up to the end, or to what is wrong.
    fn run(&mut self) -> Result<(), RecordingError> {
        let file = artifact::open(&self.path)?;
        let mut stream = Stream::whole(&self.path, file)?;
        let end: Option<()> = stream.records(|opcode, record, offset| {
            self.record(opcode, record, offset)?;
            Ok(ControlFlow::Continue(()))
        })?;
        debug_assert!(end.is_none(), "nothing breaks");
        Ok(())
    }

    fn record(&mut self, opcode: u8, record: &[u8], offset: u64) -> Result<(), RecordingError> {
        match opcode {
            op::METADATA => self.metadata(record, offset),
            op::SCHEMA | op::CHANNEL => self.declaration(opcode, record, offset),
            op::MESSAGE => self.message(record, offset),
            op::ATTACHMENT => self.plan.attachment(&self.path, offset, record),
            _ => Ok(()),
        }
    }

    fn metadata(&mut self, record: &[u8], offset: u64) -> Result<(), RecordingError> {
        if !is_metadata(record) {
            return Ok(());
        }
        let source = Damage::Index { record: "metadata record" };
        let metadata = parse_metadata(record).ok_or_else(|| RecordingError::Damaged {
            path: self.path.clone(),
            offset,
            source,
        })?;
        check_metadata(&self.path, &metadata)?;
        self.has_metadata = true;
        Ok(())
    }

    fn declaration(&mut self, opcode: u8, record: &[u8], offset: u64) -> Result<(), RecordingError> {
        let declaration = mcap::parse_record(opcode, record).map_err(|error| damaged(&self.path, offset, error))?;
        declare(declaration, &mut self.schemas, &mut self.channels);
        Ok(())
    }

    fn message(&mut self, record: &[u8], offset: u64) -> Result<(), RecordingError> {
        let damage = |source| RecordingError::Damaged { path: self.path.clone(), offset, source };
        let Some(message) = RawMessage::parse(record, offset) else {
            return Err(damage(Damage::Index { record: "message" }));
        };
        let RawMessage { channel, sequence, log_time_nanos, data, .. } = message;
        if !self.has_metadata {
            return Err(RecordingError::Foreign { path: self.path.clone(), record: "metadata record ntp.recording" });
        }
        if log_time_nanos < self.last_log_time_nanos {
            let (before_nanos, after_nanos) = (self.last_log_time_nanos, log_time_nanos);
            return Err(damage(Damage::TimeGoesBack { before_nanos, after_nanos }));
        }
        self.last_log_time_nanos = log_time_nanos;
        let Some(declared) = self.channels.get(&channel) else {
            return Err(damage(Damage::UnknownChannel { channel, sequence }));
        };
        let is_topic = |topic: &Topic| {
            let names = (declared.topic.as_str(), declared.schema.as_str(), declared.encoding.as_str());
            names == (topic.name(), topic.message(), "protobuf")
        };
        let assembler = &mut self.assembler;
        let taken = match (Topic::read().find(is_topic), declared.camera_topic()) {
            (Some(topic), _) => assembler.message(topic, log_time_nanos, data),
            (None, Some((camera, topic))) => assembler.camera_message(camera, topic, data).map(|()| None),
            (None, None) => return Ok(()),
        };
        let assembled = taken.map_err(|problem| {
            let (path, topic, episode) = (self.path.clone(), declared.topic.clone(), self.n_kept);
            RecordingError::Message { path, topic, episode, sequence, log_time_nanos, problem }
        })?;
        assembled.map_or(Ok(()), |assembled| self.keep(assembled))
    }

    fn keep(&mut self, assembled: Assembled) -> Result<(), RecordingError> {
        let (path, episode) = (&self.path, self.n_kept);
        let of_trace = |source| RecordingError::Trace { path: path.clone(), episode, source };
        let Assembled { parts, cameras, .. } = assembled;
        let whole = Episode::new(parts).map_err(of_trace)?;
        check_pictures(path, episode, &cameras)?;
        self.writer.write_filmed(&whole, cameras)?;
        self.n_kept += 1;
        Ok(())
    }
}
