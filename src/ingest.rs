//! Recordings of robots as a `LeRobotDataset`.
//!
//! # Input and output
//!
//! MCAP files of any writer (ROS 2 in CDR, protobuf, JSON) and a [`Map`], a TOML file that says which topics and fields
//! become which features. [`ingest`] writes a `LeRobotDataset` v3.0 and tells what became of every message. [`propose`]
//! writes a map for what is in a file.
//!
//! # Units
//!
//! Times of recordings are nanoseconds; a row is `1 / fps` seconds behind the one before. Numbers keep the units of
//! their messages.
//!
//! # Errors
//!
//! [`IngestError`] names file, topic, time, what was found and what is taken.
//!
//! # Invariants
//!
//! Files are read once, in the order given, and memory holds what the matching of times needs: the greatest age, and the
//! slack for messages that come late. The same files and map give the same bytes, with any number of threads. Pictures
//! that are encoded stay as they are; H.264 is not encoded again, unless the map says so. Nothing is made up: where a
//! feature has no value that is young enough, the episode ends, and this is counted.

mod counts;
mod decode;
mod episode;
mod error;
mod few;
mod map;
mod observe;
mod path;
mod picture;
mod probe;
mod propose;
mod rows;
mod sample;
mod track;
mod value;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use crate::artifact::StagedDir;
use crate::dataset::plain::PlainWriter;
use rows::Rows;

pub use counts::{IngestSummary, TopicCounts};
pub use error::IngestError;
pub use map::Map;
pub use propose::propose;

/// Refuses a file that is there twice, by whatever name.
fn check_apart(files: &[PathBuf]) -> Result<(), IngestError> {
    let mut seen = BTreeSet::new();
    for path in files {
        if !seen.insert(path.canonicalize().unwrap_or_else(|_gone| path.clone())) {
            return Err(IngestError::Twice { path: path.clone() });
        }
    }
    Ok(())
}

/// Writes a dataset of recordings.
///
/// # Errors
///
/// When a file is given twice, is damaged, lacks a topic of the map, or there is something at `to`.
pub fn ingest(files: &[PathBuf], map: &Map, to: &Path) -> Result<IngestSummary, IngestError> {
    check_apart(files)?;
    let features = probe::features(files, map)?;
    let staged = StagedDir::begin(to)?;
    let observer = probe::observer(&files[0], map, &features)?;
    let declared: Vec<_> = match &observer {
        // The numbers that observations are made of are the first feature.
        Some(observer) => {
            observer.declared().into_iter().chain(features[1..].iter().map(probe::Feature::declared)).collect()
        }
        None => features.iter().map(probe::Feature::declared).collect(),
    };
    let writer = PlainWriter::create(staged.partial_path(), &declared, map.fps, &map.robot_type, map.file_megabytes);
    let mut rows = Rows::new(map, &features, observer, writer);
    for file in files {
        rows.file(file)?;
    }
    let summary = rows.finish()?;
    staged.commit()?;
    Ok(summary)
}
