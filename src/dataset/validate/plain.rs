//! Checks a `LeRobotDataset` of anybody's features: what `LeRobot`'s own reader would refuse or silently misread.
//!
//! Memory holds an entry for each episode, some thousand rows, and the list of samples of one video.

pub(crate) mod episode;
mod episodes;
mod frames;
mod images;
mod info;
mod language;
mod ranges;
mod run;
mod statistics;
mod videos;

use std::path::Path;

use crate::dataset::files::finding::Validation;
use crate::dataset::plain::PlainSource;

/// Checks all of it.
pub(super) fn check(root: &Path, validation: &mut Validation) {
    let source = match PlainSource::open(root) {
        Ok(source) => source,
        Err(error) => return validation.failed("info.value", &error),
    };
    info::check(&source, validation);
    episodes::check(&source, validation);
    let (ranges, n_rows) = frames::check(&source, validation);
    statistics::check(&source, &ranges, n_rows, validation);
    videos::check(&source, validation);
}
