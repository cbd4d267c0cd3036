//! Which columns, calls and labels of an episode differ.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use arrow::array::{ArrayRef, AsArray as _, RecordBatch};
use arrow::compute::concat_batches;
use arrow::datatypes::Int64Type;
use arrow::error::ArrowError;
use arrow::row::{RowConverter, SortField};

use crate::dataset::edit::EditError;
use crate::dataset::edit::diff::digest::comparable;
use crate::dataset::edit::diff::{ChangedEpisode, EpisodeName};
use crate::dataset::edit::pieces::Piece;
use crate::dataset::edit::samples::Samples;
use crate::dataset::edit::source::Source;
use crate::dataset::files::layout;
use crate::dataset::tables::episodes::read::{EpisodeRow, EpisodeRows};

/// The columns of an episode's rows, table by table.
struct Content {
    name: EpisodeName,
    provenance: Vec<(String, ArrayRef)>,
    calls: Vec<(String, ArrayRef)>,
    scopes: Vec<(String, ArrayRef)>,
    frames: Vec<(String, ArrayRef)>,
}

/// Names of some episodes, which are in order.
pub(super) fn names(root: &Path, episodes: &[usize]) -> Result<Vec<EpisodeName>, EditError> {
    let mut names = Vec::new();
    let mut wanted = episodes.iter().peekable();
    for (at, row) in EpisodeRows::open(root)?.1.enumerate() {
        let row = row?;
        if wanted.next_if(|&&wanted| wanted == at).is_some() {
            names.push(name_of(&row));
        }
    }
    Ok(names)
}

fn name_of(row: &EpisodeRow) -> EpisodeName {
    EpisodeName {
        episode_index: row.episode_index,
        task_id: row.task_id.clone(),
        recording: row.recording.clone(),
        recording_index: row.recording_index,
    }
}

/// What differs in some pairs of episodes.
pub(super) fn details(before: &Path, after: &Path, pairs: &[(usize, usize)]) -> Result<Vec<ChangedEpisode>, EditError> {
    if pairs.is_empty() {
        return Ok(Vec::new());
    }
    let first = contents(before, pairs.iter().map(|(a, _)| *a).collect())?;
    let second = contents(after, pairs.iter().map(|(_, b)| *b).collect())?;
    let detail = |(a, b): &(usize, usize)| {
        let (Some(a), Some(b)) = (first.get(a), second.get(b)) else { return Ok(None) };
        compare(a, b).map(Some).map_err(EditError::rows(before.join(layout::EPISODES)))
    };
    pairs.iter().filter_map(|pair| detail(pair).transpose()).collect()
}

fn contents(root: &Path, wanted: BTreeSet<usize>) -> Result<BTreeMap<usize, Content>, EditError> {
    let mut source = Source::open(root)?;
    let mut videos = Samples::of_all(&source.info);
    let mut contents = BTreeMap::new();
    let mut at = 0;
    while let Some(episode) = source.next_episode()? {
        if wanted.contains(&at) {
            let pieces = &episode.pieces;
            let columns = |pieces: &[Piece]| {
                columns(pieces, &source.subtasks).map_err(EditError::rows(source.root().join(layout::EPISODES)))
            };
            let videos = videos.iter_mut().map(|video| video.column(&episode, &source));
            let frames = columns(&pieces.frames)?.into_iter().map(Ok).chain(videos);
            let content = Content {
                name: name_of(&episode.row),
                provenance: columns(&pieces.provenance)?,
                calls: columns(&pieces.calls)?,
                scopes: columns(&pieces.scopes)?,
                frames: frames.collect::<Result<_, _>>()?,
            };
            contents.insert(at, content);
        }
        at += 1;
    }
    Ok(contents)
}

fn columns(pieces: &[Piece], subtasks: &[String]) -> Result<Vec<(String, ArrayRef)>, ArrowError> {
    let Some(first) = pieces.first() else { return Ok(Vec::new()) };
    let rows: Vec<RecordBatch> = pieces.iter().map(Piece::rows).collect();
    comparable(&concat_batches(&first.batch.schema(), &rows)?, subtasks)
}

fn compare(before: &Content, after: &Content) -> Result<ChangedEpisode, ArrowError> {
    let ids = |columns: &[(String, ArrayRef)]| -> Vec<i64> {
        let ids = columns.iter().find(|(name, _)| name == "call_id");
        ids.and_then(|(_, ids)| ids.as_primitive_opt::<Int64Type>())
            .map(|ids| ids.values().to_vec())
            .unwrap_or_default()
    };
    let longer =
        if ids(&before.calls).len() >= ids(&after.calls).len() { ids(&before.calls) } else { ids(&after.calls) };
    let changed_calls: BTreeSet<usize> = differing(&before.calls, &after.calls)?.into_values().flatten().collect();
    let scopes: BTreeSet<usize> = differing(&before.scopes, &after.scopes)?.into_values().flatten().collect();
    let frames = differing(&before.frames, &after.frames)?;
    Ok(ChangedEpisode {
        before: before.name.clone(),
        after_index: after.name.episode_index,
        episode_columns: differing(&before.provenance, &after.provenance)?.into_keys().collect(),
        calls: changed_calls.into_iter().filter_map(|row| longer.get(row).copied()).collect(),
        scopes: scopes.len() as u64,
        frames: frames.into_iter().map(|(name, rows)| (name, rows.len() as u64)).collect(),
    })
}

/// By column, the rows in which it differs; `rows` are those that only one has.
fn differing(
    before: &[(String, ArrayRef)],
    after: &[(String, ArrayRef)],
) -> Result<BTreeMap<String, Vec<usize>>, ArrowError> {
    let n_rows = |columns: &[(String, ArrayRef)]| columns.first().map_or(0, |(_, column)| column.len());
    let (a, b) = (n_rows(before), n_rows(after));
    let mut differing = BTreeMap::new();
    if a != b {
        differing.insert("rows".to_owned(), (a.min(b)..a.max(b)).collect());
    }
    let names: BTreeSet<&String> = before.iter().chain(after).map(|(name, _)| name).collect();
    for name in names {
        let find = |columns: &[(String, ArrayRef)]| {
            columns.iter().find(|(of, _)| of == name).map(|(_, column)| column.clone())
        };
        let rows = match (find(before), find(after)) {
            (Some(a), Some(b)) if a.data_type() == b.data_type() => differing_rows(&a, &b)?,
            _ => (0..a.max(b)).collect(),
        };
        if !rows.is_empty() {
            differing.insert(name.clone(), rows);
        }
    }
    Ok(differing)
}

fn differing_rows(before: &ArrayRef, after: &ArrayRef) -> Result<Vec<usize>, ArrowError> {
    let converter = RowConverter::new(vec![SortField::new(before.data_type().clone())])?;
    let [a, b] = [before, after].map(|column| converter.convert_columns(std::slice::from_ref(column)));
    let (a, b) = (a?, b?);
    Ok(a.iter().zip(b.iter()).enumerate().filter(|(_, (a, b))| a != b).map(|(row, _)| row).collect())
}
