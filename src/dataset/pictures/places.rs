//! Where in a dataset the pictures of each episode are.

use std::path::Path;

use crate::dataset::DatasetError;
use crate::dataset::files::layout::{self, FilePlace};
use crate::dataset::pictures::video_columns;
use crate::dataset::schema::META_EPISODES;
use crate::table::{self, Columns};
use crate::words::counted;

/// Where the pictures of an episode are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) file: FilePlace,
    /// Of the file: its row, or its sample.
    pub(super) first: usize,
    pub(super) count: usize,
}

/// Where the pictures of all episodes are.
pub(super) fn places(
    root: &Path,
    feature: &str,
    is_video: bool,
    fps: f64,
    n_episodes: u64,
) -> Result<Vec<Place>, DatasetError> {
    let mut places = Vec::new();
    let mut file = FilePlace::default();
    while (places.len() as u64) < n_episodes {
        let path = file.in_dataset(root, layout::META_EPISODES);
        let mut columns = table::read(&path, &META_EPISODES)?;
        let lengths = columns.int64("length")?;
        let of_file = if is_video {
            video_places(table::read_further(&path, &META_EPISODES, &video_columns(feature))?, feature, &lengths, fps)?
        } else {
            image_places(columns, &lengths)?
        };
        if of_file.is_empty() {
            let problem =
                format!("it ends after {} of {n_episodes}", places.len(), n_episodes = counted(n_episodes, "episode"));
            return Err(DatasetError::Count { path, problem });
        }
        places.extend(of_file);
        file = file.next();
    }
    if !is_video {
        count_rows_of_files(&mut places);
    }
    Ok(places)
}

fn numbers(chunk: i64, file: i64) -> FilePlace {
    FilePlace { chunk: chunk.try_into().unwrap_or(u32::MAX), file: file.try_into().unwrap_or(u32::MAX) }
}

fn image_places(mut columns: Columns, lengths: &[i64]) -> Result<Vec<Place>, DatasetError> {
    let (chunks, files) = (columns.int64("data/chunk_index")?, columns.int64("data/file_index")?);
    let first = columns.int64("dataset_from_index")?;
    let rows = chunks.into_iter().zip(files).zip(first).zip(lengths);
    Ok(rows
        .map(|(((chunk, file), first), &length)| Place {
            file: numbers(chunk, file),
            first: usize::try_from(first).unwrap_or(usize::MAX),
            count: usize::try_from(length).unwrap_or(0),
        })
        .collect())
}

/// From rows of the dataset to rows of each file.
fn count_rows_of_files(places: &mut [Place]) {
    let mut begin = (FilePlace::default(), 0);
    for place in places {
        if place.file != begin.0 {
            begin = (place.file, place.first);
        }
        place.first = place.first.saturating_sub(begin.1);
    }
}

fn video_places(mut columns: Columns, feature: &str, lengths: &[i64], fps: f64) -> Result<Vec<Place>, DatasetError> {
    let [chunk, file, from, _] = video_columns(feature).map(|(name, _)| name);
    let (chunks, files, from) = (columns.int64(&chunk)?, columns.int64(&file)?, columns.float64(&from)?);
    let rows = chunks.into_iter().zip(files).zip(from).zip(lengths);
    Ok(rows
        .map(|(((chunk, file), from), &length)| Place {
            file: numbers(chunk, file),
            first: (from * fps).round() as usize,
            count: usize::try_from(length).unwrap_or(0),
        })
        .collect())
}
