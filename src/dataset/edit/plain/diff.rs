//! What differs between two datasets of anybody's features.
//!
//! An episode has no name but its number, so those with the same content are found first, wherever they lie; of those
//! that are left, the ones with the same number are told apart. Tasks and sub-tasks are compared by their texts, videos
//! by their packets.

use std::collections::{BTreeMap, BTreeSet};
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::path::Path;
use std::sync::Arc;

use arrow::array::{Array as _, ArrayRef, BinaryArray, RecordBatch, StringArray};
use arrow::error::ArrowError;
use arrow::row::{RowConverter, SortField};

use crate::dataset::DatasetError;
use crate::dataset::edit::EditError;
use crate::dataset::edit::plain::schema::{fitted, plain_schema};
use crate::dataset::plain::{DeclaredKind, PlainEpisode, PlainSource, PlainTexts, RowCursor, whole_numbers};
use crate::table::BatchReader;
use crate::video::VideoTrackFile;

/// Columns that say only where rows lie, or that texts take the place of.
const PLACES: [&str; 4] = ["episode_index", "index", "task_index", "subtask_index"];

/// An episode's columns by their names, each as a hash of its rows.
pub(in crate::dataset::edit) type Digest = BTreeMap<String, u64>;

/// The content of all episodes in order.
pub(in crate::dataset::edit) fn digests(root: &Path) -> Result<Vec<Digest>, EditError> {
    let mut content = Contents::open(root)?;
    (0..content.source.episodes.len()).map(|position| content.digest(position)).collect()
}

/// By column, in how many frames two episodes differ; `rows` counts those that only one has.
pub(in crate::dataset::edit) fn differing(
    before: &mut Contents,
    after: &mut Contents,
    [first, second]: [usize; 2],
) -> Result<BTreeMap<String, u64>, EditError> {
    let (a, b) = (before.columns(first)?, after.columns(second)?);
    let n_rows = |columns: &BTreeMap<String, ArrayRef>| columns.values().next().map_or(0, arrow::array::Array::len);
    let (in_first, in_second) = (n_rows(&a), n_rows(&b));
    let mut differing = BTreeMap::new();
    if in_first != in_second {
        differing.insert("rows".to_owned(), in_first.abs_diff(in_second) as u64);
    }
    let names: BTreeSet<&String> = a.keys().chain(b.keys()).collect();
    for name in names {
        let n = match (a.get(name), b.get(name)) {
            (Some(a), Some(b)) => {
                let hashes = |column: &ArrayRef| row_hashes(column).map_err(EditError::rows(before.source.info.root()));
                let (a, b) = (hashes(a)?, hashes(b)?);
                a.iter().zip(&b).filter(|(a, b)| a != b).count()
            }
            _ => in_first.max(in_second),
        };
        if n > 0 {
            differing.insert(name.clone(), n as u64);
        }
    }
    Ok(differing)
}

/// A video and its packets of an episode, one a frame.
type VideoPackets = (String, Vec<Vec<u8>>);

/// A dataset whose episodes are compared.
pub(in crate::dataset::edit) struct Contents {
    pub(in crate::dataset::edit) source: PlainSource,
    rows: RowCursor,
    /// By video, the file that was read last.
    tracks: Vec<Option<(std::path::PathBuf, VideoTrackFile)>>,
}

impl Contents {
    pub(in crate::dataset::edit) fn open(root: &Path) -> Result<Self, EditError> {
        let source = PlainSource::open(root)?;
        let has_pictures = source.info.features.iter().any(|feature| feature.kind == DeclaredKind::Image);
        let tracks = source.info.videos().map(|_| None).collect();
        Ok(Self { rows: RowCursor::new(has_pictures), tracks, source })
    }

    fn digest(&mut self, position: usize) -> Result<Digest, EditError> {
        let mut hashers: BTreeMap<String, DefaultHasher> = BTreeMap::new();
        let root = self.source.info.root().to_owned();
        self.each(position, |name, column| {
            let hasher = hashers.entry(name.to_owned()).or_default();
            for hash in row_hashes(column).map_err(EditError::rows(&root))? {
                hasher.write_u64(hash);
            }
            Ok(())
        })?;
        let episode = self.source.episodes[position].clone();
        for (name, packets) in self.packets(&episode)? {
            let mut hasher = DefaultHasher::new();
            packets.hash(&mut hasher);
            hashers.insert(name, hasher);
        }
        Ok(hashers.into_iter().map(|(name, hasher)| (name, hasher.finish())).collect())
    }

    /// The columns of an episode, whole.
    fn columns(&mut self, position: usize) -> Result<BTreeMap<String, ArrayRef>, EditError> {
        let mut parts: BTreeMap<String, Vec<ArrayRef>> = BTreeMap::new();
        self.each(position, |name, column| {
            parts.entry(name.to_owned()).or_default().push(Arc::clone(column));
            Ok(())
        })?;
        let root = self.source.info.root().to_owned();
        let mut columns = BTreeMap::new();
        for (name, arrays) in parts {
            let arrays: Vec<&dyn arrow::array::Array> = arrays.iter().map(AsRef::as_ref).collect();
            columns.insert(name, arrow::compute::concat(&arrays).map_err(EditError::rows(&root))?);
        }
        let episode = self.source.episodes[position].clone();
        for (name, packets) in self.packets(&episode)? {
            columns.insert(name, Arc::new(BinaryArray::from_iter_values(packets)));
        }
        Ok(columns)
    }

    /// Gives parts of an episode's columns, one after another.
    fn each(
        &mut self,
        position: usize,
        mut take: impl FnMut(&str, &ArrayRef) -> Result<(), EditError>,
    ) -> Result<(), EditError> {
        let Self { source, rows, .. } = self;
        let episode = &source.episodes[position];
        let (path, first) = source.rows_of(episode)?;
        let schema = plain_schema(BatchReader::open(&path, 1)?.schema());
        rows.each(&path, first, episode.length as usize, |rows| {
            let rows = fitted(&rows, &schema).map_err(EditError::rows(&path))?;
            for (field, column) in schema.fields().iter().zip(rows.columns()) {
                if !PLACES.contains(&field.name().as_str()) {
                    take(field.name(), column)?;
                }
            }
            for (name, number, texts) in
                [("task", "task_index", Some(&source.tasks)), ("subtask", "subtask_index", source.subtasks.as_ref())]
            {
                if let Some(texts) = texts_of(&rows, number, texts) {
                    take(name, &texts)?;
                }
            }
            Ok(())
        })
    }

    /// The packets of an episode's videos, one a frame.
    fn packets(&mut self, episode: &PlainEpisode) -> Result<Vec<VideoPackets>, EditError> {
        let mut all = Vec::new();
        let info = &self.source.info;
        for ((video, span), open) in info.videos().zip(&episode.videos).zip(&mut self.tracks) {
            let Some(span) = span else { continue };
            let path = info.video_file(&video.name, span.file);
            if open.as_ref().is_none_or(|(of, _)| *of != path) {
                *open = Some((path.clone(), VideoTrackFile::open(&path)?));
            }
            let Some((_, track)) = open else { continue };
            let mut packets = Vec::new();
            for frame in 0..episode.length {
                let secs = span.from_secs + frame as f64 / info.fps;
                let at = track.nearest(secs).ok_or_else(|| DatasetError::Count {
                    path: path.clone(),
                    problem: "it has no picture".to_owned(),
                })?;
                let mut bytes = Vec::new();
                track.read(track.samples[at], &mut bytes)?;
                packets.push(bytes);
            }
            all.push((video.name.clone(), packets));
        }
        Ok(all)
    }
}

/// The texts that a column counts.
fn texts_of(rows: &RecordBatch, number: &str, texts: Option<&PlainTexts>) -> Option<ArrayRef> {
    let texts = texts?;
    let numbers = whole_numbers(rows, number)?;
    Some(Arc::new(numbers.into_iter().map(|number| texts.get(number)).collect::<StringArray>()))
}

/// A hash of each row of a column.
fn row_hashes(column: &ArrayRef) -> Result<Vec<u64>, ArrowError> {
    // Lists of a fixed length are compared as lists.
    let column = match column.data_type() {
        arrow::datatypes::DataType::FixedSizeList(item, _) => {
            arrow::compute::cast(column, &arrow::datatypes::DataType::List(Arc::clone(item)))?
        }
        _ => Arc::clone(column),
    };
    let converter = RowConverter::new(vec![SortField::new(column.data_type().clone())])?;
    let rows = converter.convert_columns(&[column])?;
    let hash = |row: arrow::row::Row<'_>| {
        let mut hasher = DefaultHasher::new();
        hasher.write(row.data());
        hasher.finish()
    };
    Ok(rows.iter().map(hash).collect())
}
