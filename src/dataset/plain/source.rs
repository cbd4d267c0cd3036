//! A dataset of anybody's, opened: what it declares, its texts, its episodes, the files of its frames.

use std::path::{Path, PathBuf};

use crate::artifact::read_json;
use crate::dataset::DatasetError;
use crate::dataset::files::info::BY_MODEL;
use crate::dataset::files::layout;
use crate::dataset::plain::declared::PlainInfo;
use crate::dataset::plain::episode::{PlainEpisode, read_episodes};
use crate::dataset::plain::listing::parquet_files;
use crate::dataset::plain::texts::{PlainTexts, read_subtasks, read_tasks};
use crate::table::BatchReader;
use crate::words::counted;

/// Whose program tables a dataset has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ProgramTables {
    /// None.
    None,
    /// Those of labels that were annotated elsewhere: programs are texts.
    Annotated,
    /// Those of programs of ours, that acted or that a model found.
    Own,
}

/// Whether a dataset has tables of programs, and whose. What these allow is decided here alone.
pub(crate) fn program_tables(root: &Path) -> ProgramTables {
    let path = root.join(layout::NTP_INFO);
    match read_json::<serde_json::Value>(&path) {
        Ok(info) if info["annotated_by"].as_str().is_some_and(|by| by != BY_MODEL) => ProgramTables::Annotated,
        // What cannot be read is found by whoever reads it.
        _ if has_tables(root) => ProgramTables::Own,
        _ => ProgramTables::None,
    }
}

/// Whether there is more than the word of who made labels, which datasets without tables have too.
fn has_tables(root: &Path) -> bool {
    let told = root.join(layout::ANNOTATION);
    let entries = told.parent().and_then(|folder| std::fs::read_dir(folder).ok());
    entries.into_iter().flatten().any(|entry| entry.is_ok_and(|entry| entry.path() != told))
}

/// Whether a dataset has tables of programs.
pub(crate) fn has_programs(root: &Path) -> bool {
    program_tables(root) != ProgramTables::None
}

/// A dataset. Memory holds an entry for each episode.
pub(crate) struct PlainSource {
    pub(crate) info: PlainInfo,
    pub(crate) tasks: PlainTexts,
    pub(crate) subtasks: Option<PlainTexts>,
    pub(crate) episodes: Vec<PlainEpisode>,
    /// Files of `meta/episodes`, or the one of lines.
    pub(crate) episode_files: Vec<PathBuf>,
    /// Files of frames in the order in which readers take them.
    pub(crate) data_files: Vec<PathBuf>,
    /// One past the last row of each of them, as far as they can be opened.
    file_ends: Vec<usize>,
}

impl PlainSource {
    /// Opens a dataset; no frame is read.
    pub(crate) fn open(root: &Path) -> Result<Self, DatasetError> {
        let info = PlainInfo::read(root)?;
        let tasks = read_tasks(root, info.version)?;
        let subtasks = read_subtasks(root)?;
        let (episodes, episode_files) = read_episodes(&info)?;
        let data_files = data_files(&info, &episodes)?;
        let file_ends = if info.version.is_by_episode() { Vec::new() } else { file_ends(&data_files) };
        Ok(Self { info, tasks, subtasks, episodes, episode_files, data_files, file_ends })
    }

    /// The forms of labels that are there.
    pub(crate) fn label_forms(&self) -> Vec<&'static str> {
        let is_declared = |name: &str| self.info.feature(name).is_some();
        let has_sarm = ["sparse", "dense"]
            .into_iter()
            .any(|level| self.info.root().join(format!("meta/temporal_proportions_{level}.json")).is_file());
        let forms = [
            ("subtask_index", is_declared("subtask_index")),
            ("language", is_declared("language_persistent")),
            ("sarm", has_sarm),
            ("behavior", self.info.root().join("annotations").is_dir()),
        ];
        forms.into_iter().filter(|(_, is_there)| *is_there).map(|(form, _)| form).collect()
    }

    /// The position of an episode by its number.
    pub(crate) fn position(&self, number: u64) -> Result<usize, DatasetError> {
        let is_it = |episode: &PlainEpisode| episode.index.unsigned_abs() == number;
        let expected = usize::try_from(number).ok().filter(|&at| self.episodes.get(at).is_some_and(is_it));
        let position = expected.or_else(|| self.episodes.iter().position(is_it));
        position.ok_or_else(|| DatasetError::Count {
            path: self.info.root().join(layout::INFO),
            problem: format!("there is no episode {number}; there are {}, counted from 0", self.episodes.len()),
        })
    }

    /// The file that holds an episode's frames, and the position of its first among that file's rows.
    pub(crate) fn rows_of(&self, episode: &PlainEpisode) -> Result<(PathBuf, usize), DatasetError> {
        let first = usize::try_from(episode.rows[0]).unwrap_or(0);
        if self.info.version.is_by_episode() {
            let place = episode.data.unwrap_or_default();
            return Ok((self.info.data_file(place), 0));
        }
        // As readers do: all files one after the other, whatever the episodes say of them.
        let at = self.file_ends.partition_point(|&end| end <= first);
        let before = at.checked_sub(1).map_or(0, |before| self.file_ends[before]);
        if at < self.file_ends.len() {
            return Ok((self.data_files[at].clone(), first - before));
        }
        // The first file that cannot be opened says why.
        if let Some(path) = self.data_files.get(at) {
            BatchReader::open_columns(path, 1, |_name| false)?;
        }
        let problem =
            format!("the files have {before}, but an episode begins at row {first}", before = counted(before, "row"));
        Err(DatasetError::Count { path: self.info.root().join(layout::DATA), problem })
    }

    /// The file that a row is in, where files can be opened.
    pub(crate) fn file_of_row(&self, row: i64) -> Option<&PathBuf> {
        let row = usize::try_from(row).ok()?;
        self.data_files.get(self.file_ends.partition_point(|&end| end <= row)).filter(|_| !self.file_ends.is_empty())
    }
}

/// One past the last row of each file, up to the first that cannot be opened.
fn file_ends(files: &[PathBuf]) -> Vec<usize> {
    let mut end = 0;
    let ends = files.iter().map_while(|path| {
        let reader = BatchReader::open_columns(path, 1, |_name| false).ok()?;
        end += reader.n_rows() as usize;
        Some(end)
    });
    ends.collect()
}

/// The files of frames: all that readers find, or one an episode.
fn data_files(info: &PlainInfo, episodes: &[PlainEpisode]) -> Result<Vec<PathBuf>, DatasetError> {
    if info.version.is_by_episode() {
        return Ok(episodes.iter().map(|episode| info.data_file(episode.data.unwrap_or_default())).collect());
    }
    Ok(parquet_files(&info.root().join(layout::DATA))?)
}
