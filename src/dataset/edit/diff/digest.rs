//! Hashes of episodes: what an episode is, and what its rows hold.

use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::path::Path;
use std::sync::Arc;

use arrow::array::{ArrayRef, AsArray as _, RecordBatch, StringArray};
use arrow::compute::cast;
use arrow::datatypes::{DataType, Int64Type};
use arrow::error::ArrowError;
use arrow::row::{RowConverter, SortField};

use crate::dataset::edit::EditError;
use crate::dataset::edit::pieces::Piece;
use crate::dataset::edit::samples::Samples;
use crate::dataset::edit::source::{Source, SourceEpisode};
use crate::dataset::files::layout;
use crate::dataset::tables::episodes::read::EpisodeRow;

/// Columns that say only where rows lie.
const PLACES: [&str; 10] = [
    "episode_index",
    "index",
    "task_index",
    "calls/chunk_index",
    "calls/file_index",
    "calls_from_index",
    "scopes/chunk_index",
    "scopes/file_index",
    "scopes_from_index",
    "subtask_index",
];

/// An episode as two hashes.
pub(super) struct EpisodeDigest {
    /// Of where it comes from.
    pub(super) identity: [u64; 2],
    /// Of its rows, table by table.
    pub(super) content: u64,
}

/// The hashes of all episodes in order.
pub(super) fn digests(root: &Path) -> Result<Vec<EpisodeDigest>, EditError> {
    let mut source = Source::open(root)?;
    let mut videos = Samples::of_all(&source.info);
    let mut digests = Vec::new();
    while let Some(episode) = source.next_episode()? {
        let failed = EditError::rows(source.root().join(layout::EPISODES));
        let mut videos =
            videos.iter_mut().map(|video| video.column(&episode, &source)).collect::<Result<Vec<_>, _>>()?;
        videos.sort_by(|(a, _), (b, _)| a.cmp(b));
        let content = content(&episode, &source.subtasks, &videos).map_err(failed)?;
        digests.push(EpisodeDigest { identity: identity(&episode.row), content });
    }
    Ok(digests)
}

/// By place in the recording; an episode without one is known by its task and trial.
fn identity(row: &EpisodeRow) -> [u64; 2] {
    let hash = |salt: u8| {
        let mut hasher = DefaultHasher::new();
        salt.hash(&mut hasher);
        let name = if row.recording_sha256.is_empty() { &row.recording } else { &row.recording_sha256 };
        (name, row.recording_index).hash(&mut hasher);
        if name.is_empty() {
            (&row.task_id, row.trial).hash(&mut hasher);
        }
        hasher.finish()
    };
    [hash(0), hash(1)]
}

fn content(episode: &SourceEpisode, subtasks: &[String], videos: &[(String, ArrayRef)]) -> Result<u64, ArrowError> {
    let mut hasher = DefaultHasher::new();
    let pieces = &episode.pieces;
    for table in [&pieces.provenance, &pieces.calls, &pieces.scopes, &pieces.frames] {
        for rows in table.iter().map(Piece::rows) {
            hash_rows(&comparable(&rows, subtasks)?, &mut hasher)?;
        }
    }
    if !videos.is_empty() {
        hash_rows(videos, &mut hasher)?;
    }
    Ok(hasher.finish())
}

fn hash_rows(columns: &[(String, ArrayRef)], hasher: &mut DefaultHasher) -> Result<(), ArrowError> {
    let fields = columns.iter().map(|(_, column)| SortField::new(column.data_type().clone())).collect();
    let arrays: Vec<ArrayRef> = columns.iter().map(|(_, column)| column.clone()).collect();
    let rows = RowConverter::new(fields)?.convert_columns(&arrays)?;
    rows.iter().for_each(|row| hasher.write(row.data()));
    Ok(())
}

/// The columns that are the same wherever the rows lie, in the order of their names; sub-tasks are given by their texts,
/// lists of a fixed length as lists.
pub(super) fn comparable(rows: &RecordBatch, subtasks: &[String]) -> Result<Vec<(String, ArrayRef)>, ArrowError> {
    let mut columns = Vec::new();
    for (field, column) in rows.schema().fields().iter().zip(rows.columns()) {
        if !PLACES.contains(&field.name().as_str()) {
            let column = match field.data_type() {
                DataType::FixedSizeList(item, _) => cast(column, &DataType::List(Arc::clone(item)))?,
                _ => Arc::clone(column),
            };
            columns.push((field.name().clone(), column));
        }
    }
    if let Some(column) = rows.column_by_name("subtask_index").and_then(|column| column.as_primitive_opt::<Int64Type>())
    {
        let text = |index: &i64| usize::try_from(*index).ok().and_then(|index| subtasks.get(index)).map(String::as_str);
        let texts: StringArray = column.values().iter().map(text).collect();
        columns.push(("subtask".to_owned(), Arc::new(texts)));
    }
    columns.sort_by(|(a, _), (b, _)| a.cmp(b));
    Ok(columns)
}
