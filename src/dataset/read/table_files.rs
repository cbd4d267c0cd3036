//! Which files each table of a dataset has, for readers that take tables as a whole.

use std::path::{Path, PathBuf};

use crate::artifact::{IoError, is_pointer, read_json};
use crate::dataset::DatasetError;
use crate::dataset::files::info::{Info, NtpInfo};
use crate::dataset::files::layout::{self, FilePlace};
use crate::dataset::plain::{EPISODE_LINES, PlainSource, has_programs};
use crate::dataset::schema::{CALLS, EPISODES, FRAMES, SCOPES, SUBTASKS, TASKS};
use crate::table::{Column, TableReader, TableSchema};
use crate::words::counted;

/// Where the rows of a table are.
#[derive(Clone, Debug)]
pub enum TableFiles {
    /// In files of Parquet.
    Parquet(Vec<PathBuf>),
    /// In lines of JSON, which were read.
    Columns(PathBuf, Vec<(&'static str, Column)>),
}

/// The files of each table, by the table's name. Only footers are read. A dataset without program tables has frames,
/// episodes as `LeRobot` has them, tasks, and sub-tasks where there are any.
///
/// # Errors
///
/// When a file cannot be opened, or the files of a table have another number of rows than the dataset counts: then one
/// is missing.
pub fn table_files(root: &Path) -> Result<Vec<(&'static str, TableFiles)>, DatasetError> {
    if !has_programs(root) {
        return plain_tables(PlainSource::open(root)?);
    }
    let files = own_tables(root)?;
    Ok(files.into_iter().map(|(name, files)| (name, TableFiles::Parquet(files))).collect())
}

fn plain_tables(source: PlainSource) -> Result<Vec<(&'static str, TableFiles)>, DatasetError> {
    if let Some(path) = source.data_files.iter().find(|path| is_pointer(path)) {
        return Err(IoError::Pointer { path: path.clone() }.into());
    }
    let root = source.info.root().to_owned();
    let mut tables = Vec::new();
    if source.info.version.is_by_episode() {
        let (numbers, texts): (Vec<i64>, Vec<String>) = source.tasks.rows.iter().cloned().unzip();
        let tasks = vec![("task_index", Column::Int64(numbers)), ("task", Column::Text(texts))];
        tables.push((TASKS.name(), TableFiles::Columns(root.join("meta/tasks.jsonl"), tasks)));
        let episodes = &source.episodes;
        let columns = vec![
            ("episode_index", Column::Int64(episodes.iter().map(|episode| episode.index).collect())),
            ("tasks", Column::TextList(episodes.iter().map(|episode| episode.tasks.clone()).collect())),
            ("length", Column::Int64(episodes.iter().map(|episode| episode.length as i64).collect())),
        ];
        tables.push((EPISODES.name(), TableFiles::Columns(root.join(EPISODE_LINES), columns)));
    } else {
        tables.push((TASKS.name(), TableFiles::Parquet(vec![root.join(layout::TASKS)])));
        tables.push((EPISODES.name(), TableFiles::Parquet(source.episode_files)));
    }
    if source.subtasks.is_some() {
        tables.push((SUBTASKS.name(), TableFiles::Parquet(vec![root.join(layout::SUBTASKS)])));
    }
    if !source.data_files.is_empty() {
        tables.push((FRAMES.name(), TableFiles::Parquet(source.data_files)));
    }
    Ok(tables)
}

fn own_tables(root: &Path) -> Result<Vec<(&'static str, Vec<PathBuf>)>, DatasetError> {
    let info: Info = read_json(&root.join(layout::INFO))?;
    let ntp: NtpInfo = read_json(&root.join(layout::NTP_INFO))?;
    let rolling = [
        (FRAMES, layout::DATA, info.total_frames),
        (CALLS, layout::CALLS, ntp.total_calls),
        (SCOPES, layout::SCOPES, ntp.total_scopes),
    ];
    let single = [(EPISODES, layout::EPISODES), (TASKS, layout::TASKS), (SUBTASKS, layout::SUBTASKS)];
    let mut tables = Vec::new();
    for (schema, folder, n_rows) in rolling {
        tables.push((schema.name(), files_of(root, &schema, folder, n_rows)?));
    }
    tables.extend(single.map(|(schema, file)| (schema.name(), vec![root.join(file)])));
    Ok(tables)
}

/// Files are numbered without gaps; the first that is not there ends the table.
fn files_of(root: &Path, schema: &TableSchema, folder: &str, expected: u64) -> Result<Vec<PathBuf>, DatasetError> {
    let mut files = Vec::new();
    let (mut place, mut n_rows) = (FilePlace::default(), 0);
    loop {
        let path = place.in_dataset(root, folder);
        if !files.is_empty() && !place.is_there(root, folder)? {
            break;
        }
        n_rows += TableReader::open_columns(&path, schema, &[])?.n_rows();
        files.push(path);
        place = place.next();
    }
    if n_rows != expected {
        let problem = format!(
            "its {} have {n_rows}, but the dataset counts {expected}",
            counted(files.len(), "file"),
            n_rows = counted(n_rows, "row")
        );
        return Err(DatasetError::Count { path: root.join(folder), problem });
    }
    Ok(files)
}
