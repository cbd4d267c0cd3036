//! What is there once for a dataset: declared features, task texts, statistics, files.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde::Deserialize as _;

use crate::artifact::{IoError, read_json};
use crate::dataset::DatasetError;
use crate::dataset::files::finding::Validation;
use crate::dataset::files::info::{Dtype, Info, LEROBOT_VERSION, NTP_VERSION, NtpInfo};
use crate::dataset::files::layout::{self, FilePlace};
use crate::dataset::schema::{FRAMES, META_EPISODES};
use crate::dataset::statistics::FeatureStatistics;
use crate::dataset::tables::frames::feature::{FEATURES, Feature, known};
use crate::dataset::tables::texts::read::{Texts, read_all_texts};
use crate::program::KnownPrograms;
use crate::table::{Columns, TableError, TableReader};
use crate::words::counted;

/// Checks the files below `meta/` and `ntp/info.json`.
pub(super) fn check(root: &Path, validation: &mut Validation) -> Texts {
    let mut texts = read_all_texts(root, validation);
    let info = read_json::<Info>(&root.join(layout::INFO));
    // A file of totals that cannot be read is found when the episodes are.
    if let Ok(info) = info {
        check_info(root, &info, &texts, validation);
        texts.state_range = check_statistics(root, &info, validation);
    }
    if let Err(error) = check_episode_statistics(root, validation) {
        validation.failed("episodes.row", &error);
    }
    check_ntp_info(root, validation);
    check_card(root, validation);
    texts
}

/// A dataset that was published has a card, and nobody may use what has no licence.
pub(super) fn check_card(root: &Path, validation: &mut Validation) {
    let path = root.join(layout::CARD);
    let card = match std::fs::read(&path) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return,
        Err(error) => return validation.failed("card.license", &IoError::system("read", &path)(error).into()),
        Ok(card) => String::from_utf8_lossy(&card).into_owned(),
    };
    let mut lines = card.lines();
    let is_yaml = lines.next() == Some("---");
    let mut fields = lines.take_while(|line| is_yaml && *line != "---").filter_map(|line| line.split_once(':'));
    if !fields.any(|(key, value)| key == "license" && !value.trim().is_empty()) {
        let message = "the card names no licence: `license: ID` is missing from its head".to_owned();
        validation.error("card.license", &path, String::new(), message);
    }
}

fn check_info(root: &Path, info: &Info, texts: &Texts, validation: &mut Validation) {
    let path = root.join(layout::INFO);
    let mut error = |place: &str, message: String| validation.error("info.value", &path, place.to_owned(), message);
    if info.codebase_version != LEROBOT_VERSION {
        error("codebase_version", format!("it is {:?}, but {LEROBOT_VERSION:?} is read", info.codebase_version));
    }
    if info.total_tasks != texts.tasks.len() as u64 {
        error(
            "total_tasks",
            format!("it is {}, but {} has {}", info.total_tasks, layout::TASKS, counted(texts.tasks.len(), "row")),
        );
    }
    let declared: BTreeMap<_, _> = info.features.0.iter().map(|(name, feature)| (name.as_str(), feature)).collect();
    for feature in FEATURES.iter() {
        match declared.get(feature.name) {
            None => error("features", format!("{:?} is not declared", feature.name)),
            Some(found) if found.dtype != feature.dtype => {
                error(
                    "features",
                    format!("{:?} is declared as {}, not {}", feature.name, found.dtype.name(), feature.dtype.name()),
                );
            }
            Some(_) => {}
        }
    }
}

fn check_ntp_info(root: &Path, validation: &mut Validation) {
    let path = root.join(layout::NTP_INFO);
    match read_json::<NtpInfo>(&path) {
        Err(error) => validation.failed("info.value", &error.into()),
        Ok(info) => {
            let mut error = |place: &str, message| validation.error("info.value", &path, place.to_owned(), message);
            if info.schema_version != NTP_VERSION {
                error("schema_version", format!("it is {}, but {NTP_VERSION} is read", info.schema_version));
            }
            if KnownPrograms::of_hash(&info.vocabulary_hash).is_none() {
                error("vocabulary_hash", "the programs are not those of this version".to_owned());
            }
        }
    }
}

/// Checks that every numeric feature has statistics in order; returns the range of observations.
fn check_statistics(root: &Path, info: &Info, validation: &mut Validation) -> Option<(Vec<f64>, Vec<f64>)> {
    let path = root.join(layout::STATS);
    let is_picture = |name: &String| {
        let declared = info.features.0.iter().find(|(feature, _)| feature == name);
        declared.is_some_and(|(_, declared)| matches!(declared.dtype, Dtype::Image | Dtype::Video))
    };
    let all: Result<BTreeMap<String, serde_json::Value>, _> = read_json(&path);
    let numeric = all.map(|all| {
        let numeric = all.into_iter().filter(|(name, _)| !is_picture(name));
        numeric.collect::<BTreeMap<String, serde_json::Value>>()
    });
    let stats = match numeric {
        Ok(stats) => stats,
        Err(error) => {
            validation.failed("stats.value", &error.into());
            return None;
        }
    };
    let mut state_range = None;
    for feature in FEATURES.iter().filter(|feature| feature.is_numeric()) {
        let problem = match stats.get(feature.name).map(FeatureStatistics::deserialize) {
            None => Some("it has no statistics".to_owned()),
            Some(Err(error)) => Some(error.to_string()),
            Some(Ok(statistics)) => {
                let problem = statistics_problem(&statistics, feature, info);
                if feature.name == "observation.state" {
                    state_range = Some((statistics.min, statistics.max));
                }
                problem
            }
        };
        if let Some(problem) = problem {
            validation.error("stats.value", &path, feature.name.to_owned(), problem);
        }
    }
    state_range
}

/// Checks the statistics of each episode in `meta/episodes/`: as many values as frames, all in order. What is wrong
/// with the numbers of rows is found when episodes are read.
fn check_episode_statistics(root: &Path, validation: &mut Validation) -> Result<(), DatasetError> {
    let columns = META_EPISODES.columns();
    let names: Vec<&str> = columns.iter().map(|(name, _)| name.as_str()).collect();
    let features = names.iter().filter_map(|name| name.strip_prefix("stats/")?.strip_suffix("/count"));
    let features: Vec<&str> = features.collect();
    let mut place = FilePlace::default();
    let mut n_episodes = 0;
    loop {
        let path = place.in_dataset(root, layout::META_EPISODES);
        if n_episodes > 0 && !place.is_there(root, layout::META_EPISODES)? {
            return Ok(());
        }
        for batch in TableReader::open_columns(&path, &META_EPISODES, &names)? {
            let mut batch = batch?;
            let lengths = batch.int64("length")?;
            for feature in &features {
                let problems = episode_statistics_problems(&mut batch, feature, &lengths)?;
                for (row, problem) in problems {
                    let place = format!("episode {}, stats/{feature}", n_episodes + row);
                    validation.error("stats.value", &path, place, problem);
                }
            }
            n_episodes += lengths.len();
        }
        place = place.next();
    }
}

/// What is wrong with the statistics of one feature, by row of the batch.
fn episode_statistics_problems(
    batch: &mut Columns,
    feature: &str,
    lengths: &[i64],
) -> Result<Vec<(usize, String)>, TableError> {
    let count = batch.number_rows(&format!("stats/{feature}/count"))?;
    let mut list = |name: &str| batch.double_rows(&format!("stats/{feature}/{name}"));
    let (min, mean, max, std) = (list("min")?, list("mean")?, list("max")?, list("std")?);
    let mut problems = Vec::new();
    for (row, &length) in lengths.iter().enumerate() {
        if count.row(row) != [length] {
            problems.push((
                row,
                format!(
                    "count is {:?}, but the episode has {length}",
                    count.row(row),
                    length = counted(length, "frame")
                ),
            ));
        }
        let (min, mean, max, std) = (min.row(row), mean.row(row), max.row(row), std.row(row));
        let is_ordered = [mean.len(), max.len(), std.len()] == [min.len(); 3]
            && (0..min.len()).all(|at| in_order(&[min[at], mean[at], max[at]]) && std[at] >= 0.0);
        if !is_ordered {
            problems.push((row, "minimum, mean and maximum are not in order, or of other lengths".to_owned()));
        }
    }
    Ok(problems)
}

/// Whether numbers grow, but for what rounding does to a mean.
fn in_order(numbers: &[f64]) -> bool {
    numbers.windows(2).all(|pair| pair[0] <= pair[1] + 1e-9 * pair[1].abs().max(1.0))
}

fn statistics_problem(statistics: &FeatureStatistics, feature: &Feature, info: &Info) -> Option<String> {
    let declared = info.features.0.iter().find(|(name, _)| name == feature.name)?;
    let width = declared.1.shape.first().copied().unwrap_or(1);
    let FeatureStatistics { min, max, mean, std, count, q01, q10, q50, q90, q99 } = statistics;
    let lists = [min, q01, q10, q50, q90, q99, max, mean, std];
    if let Some(list) = lists.iter().find(|list| list.len() != width) {
        return Some(format!("it has {width} dimensions, but statistics of {}", list.len()));
    }
    if *count != [info.total_frames as i64] {
        return Some(format!("count is {count:?}, but there are {}", counted(info.total_frames, "frame")));
    }
    let in_order = |at: usize| lists[..7].windows(2).all(|pair| pair[0][at] <= pair[1][at]) && std[at] >= 0.0;
    (0..width)
        .find(|&at| !in_order(at))
        .map(|at| format!("dimension {at}: minimum, quantiles, maximum are not in order"))
}

/// Files that no episode names and columns that are not declared: `LeRobot` takes all files that lie there, and refuses
/// columns that it does not know of.
pub(super) fn check_files(root: &Path, data: &BTreeSet<FilePlace>, validation: &mut Validation) {
    let listed: BTreeSet<PathBuf> = data.iter().map(|place| place.in_dataset(root, layout::DATA)).collect();
    let mut found = Vec::new();
    files_below(&root.join(layout::DATA), &mut found, validation);
    let is_table = |path: &&PathBuf| path.extension().is_some_and(|extension| extension == "parquet");
    for path in found.iter().filter(is_table).filter(|path| !listed.contains(*path)) {
        let message = "no episode is in this file, but readers that take all files of the folder would read it";
        validation.error("file.unlisted", path, String::new(), message.to_owned());
    }
    let info: Info = match read_json(&root.join(layout::INFO)) {
        Ok(info) => info,
        Err(error) => return validation.failed_once("file.undeclared", &DatasetError::from(error)),
    };
    let columns = info.features.0.iter().filter(|(_, feature)| feature.dtype != Dtype::Video);
    let declared: BTreeSet<&str> = columns.map(|(name, _)| name.as_str()).collect();
    for path in &listed {
        let reader = match TableReader::open_columns(path, &FRAMES, &["index"]) {
            Ok(reader) => reader,
            Err(error) => {
                validation.failed_once("file.unreadable", &error.into());
                continue;
            }
        };
        let there: BTreeSet<&str> = reader.file_columns().collect();
        if let Some(name) = there.difference(&declared).next() {
            let message = format!("column {name:?} is not declared in {}", layout::INFO);
            validation.error("file.undeclared", path, String::new(), message);
        }
        // Columns of ours that are missing are found when frames are read.
        let is_other = |name: &&&str| !known().any(|feature| feature.name == **name);
        if let Some(name) = declared.difference(&there).find(is_other) {
            let message = format!("no column {name:?}, which is declared: readers take nothing for it");
            validation.error("frames.missing", path, String::new(), message);
        }
    }
}

/// Every file below a folder, at any depth, in order of paths. What cannot be listed is a finding.
fn files_below(folder: &Path, files: &mut Vec<PathBuf>, validation: &mut Validation) {
    let listed = std::fs::read_dir(folder).and_then(|entries| {
        let paths = entries.map(|entry| Ok(entry?.path()));
        paths.collect::<std::io::Result<BTreeSet<PathBuf>>>()
    });
    let paths = match listed {
        Ok(paths) => paths,
        Err(error) => return validation.failed_once("file.unreadable", &IoError::system("list", folder)(error).into()),
    };
    for path in paths {
        match std::fs::metadata(&path) {
            Ok(metadata) if metadata.is_dir() => files_below(&path, files, validation),
            Ok(_) => files.push(path),
            Err(error) => validation.failed_once("file.unreadable", &IoError::system("read", &path)(error).into()),
        }
    }
}
