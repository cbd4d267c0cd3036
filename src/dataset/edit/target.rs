//! The dataset that is made: rows are carried over as they are; indices, texts and statistics are made anew.

mod finish;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use arrow::array::AsArray as _;
use arrow::datatypes::Int64Type;
use serde_json::Value;

use crate::artifact::read_json;
use crate::dataset::edit::EditError;
use crate::dataset::edit::cursor::BatchCursor;
use crate::dataset::edit::pictures::CarriedPictures;
use crate::dataset::edit::pieces::Piece;
use crate::dataset::edit::renumber::{Renumbered, replace};
use crate::dataset::edit::source::{Source, SourceEpisode};
use crate::dataset::files::info::{Info, NtpInfo};
use crate::dataset::files::layout::{self, FilePlace};
use crate::dataset::files::rolling::Rolling;
use crate::dataset::schema::{CALLS, EPISODES, FRAMES, META_EPISODES, SCOPES};
use crate::dataset::statistics::batches::{flags, lists, numeric_features, values};
use crate::dataset::statistics::{NumericFeature, Statistics};
use crate::dataset::tables::episodes::read::EpisodeRow;
use crate::dataset::tables::frames::feature::action_of;
use crate::dataset::tables::frames::write::FrameRows;
use crate::dataset::write::sheaf::{EPISODE_GROUP_ROWS, GROUP_ROWS, MEGABYTE, SCOPE_GROUP_ROWS};
use crate::table::{BatchWriter, TableSchema, TextTable, WriteOptions};
use crate::task::Family;

/// Rows that hold pictures make a row group when they are this large.
const GROUP_BYTES: usize = 32 * MEGABYTE;

const FRAME_NUMBERS: [&str; 4] = ["episode_index", "index", "task_index", "subtask_index"];
const META_NUMBERS: [&str; 7] = [
    "episode_index",
    "data/chunk_index",
    "data/file_index",
    "dataset_from_index",
    "dataset_to_index",
    "meta/episodes/chunk_index",
    "meta/episodes/file_index",
];
const PROVENANCE_NUMBERS: [&str; 7] = [
    "episode_index",
    "calls/chunk_index",
    "calls/file_index",
    "calls_from_index",
    "scopes/chunk_index",
    "scopes/file_index",
    "scopes_from_index",
];

/// What was written.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct EditSummary {
    /// Episodes in the dataset.
    pub episodes: u64,
    /// Rows of `data/`.
    pub frames: u64,
    /// Rows of `ntp/calls/`.
    pub calls: u64,
    /// Rows of `ntp/scopes/`.
    pub scopes: u64,
    /// Distinct task texts.
    pub tasks: u64,
    /// Episodes that failed.
    pub failed: u64,
    /// Episodes of the sources that are not in it.
    pub left_out: u64,
    /// Features without statistics: nothing finite is in one of their dimensions, or their sources state none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub without_statistics: Vec<String>,
    /// Files and folders of the sources that are not in it, as labels of other forms are.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub left_behind: Vec<String>,
    /// Every file, relative to the dataset with `/`, in order of their names.
    #[serde(skip)]
    pub files: Vec<String>,
}

/// A dataset being made of others.
pub(super) struct Target {
    root: PathBuf,
    info: Info,
    /// `meta/info.json` of an imported dataset as it is: others declare more than we know of.
    theirs: Option<Value>,
    ntp: NtpInfo,
    features: Vec<NumericFeature>,
    statistics: Statistics,
    pictures: CarriedPictures,
    tasks: TextTable,
    subtasks: TextTable,
    families: BTreeSet<Family>,
    /// Names of the slots; `None` before the first episode.
    slots: Option<Vec<String>>,
    frames: Renumbered<4>,
    /// How many rows of `frames` each episode has.
    lengths: Vec<usize>,
    calls: Renumbered<1>,
    scopes: Renumbered<1>,
    meta: Renumbered<7>,
    provenance: Renumbered<7>,
    frame_files: Rolling<BatchWriter>,
    call_files: Rolling<BatchWriter>,
    scope_files: Rolling<BatchWriter>,
    meta_files: Rolling<BatchWriter>,
    provenance_file: BatchWriter,
    summary: EditSummary,
}

impl Target {
    /// Begins a dataset with the tables of a source.
    pub(super) fn create(root: &Path, like: &Source) -> Result<Self, EditError> {
        let (info, ntp, cursors) = (like.info.clone(), like.ntp.clone(), &like.cursors);
        let theirs = ntp.annotated_by.as_ref().map(|_| read_json(&like.root().join(layout::INFO))).transpose()?;
        let file_bytes = info.data_files_size_in_mb as usize * MEGABYTE;
        let rolling = |folder, table: TableSchema, cursor: &BatchCursor, options: WriteOptions| {
            let schema = Arc::clone(cursor.schema());
            let begin = move |path: &Path| BatchWriter::create(path, table.name(), &schema, options.clone());
            Rolling::new(root, folder, file_bytes, begin)
        };
        let features = numeric_features(&info, cursors.frames.schema());
        let (episodes, columns) = (root.join(layout::EPISODES), cursors.provenance.schema());
        Ok(Self {
            root: root.to_owned(),
            statistics: Statistics::new(root, features.clone()),
            features,
            pictures: CarriedPictures::new(root, &info, file_bytes),
            tasks: TextTable::default(),
            subtasks: TextTable::default(),
            families: BTreeSet::new(),
            slots: None,
            frames: Renumbered::new(FRAME_NUMBERS),
            lengths: Vec::new(),
            calls: Renumbered::new(["episode_index"]),
            scopes: Renumbered::new(["episode_index"]),
            meta: Renumbered::new(META_NUMBERS),
            provenance: Renumbered::new(PROVENANCE_NUMBERS),
            frame_files: rolling(
                layout::DATA,
                FRAMES,
                &cursors.frames,
                FrameRows::options(ntp.n_slots, action_of(&info)),
            ),
            call_files: rolling(layout::CALLS, CALLS, &cursors.calls, CALLS.options()),
            scope_files: rolling(layout::SCOPES, SCOPES, &cursors.scopes, SCOPES.options()),
            meta_files: rolling(layout::META_EPISODES, META_EPISODES, &cursors.meta, META_EPISODES.options()),
            provenance_file: BatchWriter::create(&episodes, EPISODES.name(), columns, EPISODES.options())?,
            info,
            theirs,
            ntp,
            summary: EditSummary::default(),
        })
    }

    /// How many episodes there are so far.
    pub(super) fn n_episodes(&self) -> u64 {
        self.summary.episodes
    }

    /// Adds an episode of a source, and writes the row groups that are full.
    ///
    /// # Errors
    ///
    /// [`EditError::Dataset`] when its pictures cannot be read: then nothing of it was added.
    pub(super) fn append(&mut self, episode: &SourceEpisode, source: &Source) -> Result<(), EditError> {
        let (row, pieces) = (&episode.row, &episode.pieces);
        let pictures = self.pictures.read(episode, source)?;
        self.pictures.append(&pictures)?;
        self.note(row);
        self.append_meta(row, &pieces.meta)?;
        self.append_provenance(row, &pieces.provenance)?;
        self.append_frames(row, &pieces.frames, source)?;
        self.calls.push(&pieces.calls).map_err(EditError::rows(layout::CALLS))?;
        self.scopes.push(&pieces.scopes).map_err(EditError::rows(layout::SCOPES))?;
        let episode_index = self.summary.episodes as i64;
        self.calls.fill(0, episode_index);
        self.scopes.fill(0, episode_index);
        self.summary.episodes += 1;
        self.summary.frames += row.n_frames as u64;
        self.summary.calls += row.n_calls as u64;
        self.summary.scopes += row.n_scopes as u64;
        self.summary.failed += u64::from(!row.is_success);
        self.write_full_groups()
    }

    /// Counts episodes that are not wanted.
    pub(super) fn leave_out(&mut self, n_episodes: u64) {
        self.summary.left_out += n_episodes;
    }

    /// Takes down families and slots; where the names of slots differ, features are named by number.
    fn note(&mut self, row: &EpisodeRow) {
        self.families.extend(row.family.parse::<Family>().ok());
        match &mut self.slots {
            None => self.slots = Some(row.slots.clone()),
            Some(slots) if *slots != row.slots => {
                *slots = (0..self.ntp.n_slots).map(|slot| format!("slot_{slot}")).collect();
            }
            Some(_) => {}
        }
    }

    fn append_meta(&mut self, row: &EpisodeRow, pieces: &[Piece]) -> Result<(), EditError> {
        let (data, own, from) = (self.frame_files.place(), self.meta_files.place(), self.summary.frames as i64);
        let numbers = [numbers_of(data), [from, from + row.n_frames], numbers_of(own)].concat();
        self.meta.push(pieces).map_err(EditError::rows(layout::META_EPISODES))?;
        self.meta.push_numbers(std::iter::once(self.summary.episodes as i64).chain(numbers));
        Ok(())
    }

    fn append_provenance(&mut self, _row: &EpisodeRow, pieces: &[Piece]) -> Result<(), EditError> {
        let [[calls_chunk, calls_file], [scopes_chunk, scopes_file]] =
            [self.call_files.place(), self.scope_files.place()].map(numbers_of);
        let (calls_from, scopes_from) = (self.summary.calls as i64, self.summary.scopes as i64);
        let episode_index = self.summary.episodes as i64;
        self.provenance.push(pieces).map_err(EditError::rows(layout::EPISODES))?;
        self.provenance.push_numbers([
            episode_index,
            calls_chunk,
            calls_file,
            calls_from,
            scopes_chunk,
            scopes_file,
            scopes_from,
        ]);
        Ok(())
    }

    fn append_frames(&mut self, row: &EpisodeRow, pieces: &[Piece], source: &Source) -> Result<(), EditError> {
        let failed = || EditError::rows(source.root().join(layout::DATA));
        let before = self.frames.n_rows();
        self.frames.push(pieces).map_err(failed())?;
        let n_rows = self.frames.n_rows() - before;
        self.lengths.push(n_rows);
        self.frames.fill(0, self.summary.episodes as i64);
        let first = self.summary.frames as i64;
        self.frames.numbers[1].extend(first..first + n_rows as i64);
        let task = i64::from(self.tasks.key(&row.task_text));
        self.frames.fill(2, task);
        for piece in pieces {
            self.append_subtasks(piece, source)?;
        }
        Ok(())
    }

    /// Counts sub-tasks by their texts. Texts that are new come in the order in which their source has them.
    fn append_subtasks(&mut self, piece: &Piece, source: &Source) -> Result<(), EditError> {
        let rows = piece.rows();
        let column = rows.column_by_name("subtask_index").and_then(|column| column.as_primitive_opt::<Int64Type>());
        let known: &[i64] = column.map_or(&[], |column| column.values());
        let used: BTreeSet<i64> = known.iter().copied().collect();
        let text = |index: i64| usize::try_from(index).ok().and_then(|index| source.subtasks.get(index));
        // What is annotated elsewhere has no sub-task where the number is negative.
        let is_none = |index: i64| index < 0 && source.ntp.annotated_by.is_some();
        if let Some(unknown) = used.iter().find(|&&index| text(index).is_none() && !is_none(index)) {
            let problem = format!("subtask_index is {unknown}, but there are {}", source.subtasks.len());
            return Err(EditError::refused("edit.columns", &source.root().join(layout::DATA), problem));
        }
        let keys: Vec<(i64, i64)> =
            used.into_iter().filter_map(|index| Some((index, i64::from(self.subtasks.key(text(index)?))))).collect();
        let key = |index: &i64| keys.iter().find(|(known, _)| known == index).map_or(*index, |(_, key)| *key);
        self.frames.numbers[3].extend(known.iter().map(key));
        Ok(())
    }

    fn write_full_groups(&mut self) -> Result<(), EditError> {
        if self.frames.n_rows() >= GROUP_ROWS || self.frames.n_bytes() >= GROUP_BYTES {
            self.write_frames()?;
        }
        if self.calls.n_rows() >= GROUP_ROWS {
            self.write_calls()?;
        }
        if self.scopes.n_rows() >= SCOPE_GROUP_ROWS {
            self.write_scopes()?;
        }
        if self.meta.n_rows() >= EPISODE_GROUP_ROWS {
            self.write_episodes()?;
        }
        Ok(())
    }

    fn write_frames(&mut self) -> Result<(), EditError> {
        let failed = || EditError::rows(layout::DATA);
        let Some(rows) = self.frames.take().map_err(failed())? else { return Ok(()) };
        let flags = flags(&rows, &self.features);
        let columns = values(&rows, &self.features, &flags).map_err(failed())?;
        let mut begin = 0;
        for length in self.lengths.drain(..) {
            self.statistics.append(&columns, &(begin..begin + length));
            begin += length;
        }
        self.statistics.keep(&columns, rows.num_rows())?;
        Ok(self.frame_files.write(|file| file.write(&rows))?)
    }

    fn write_calls(&mut self) -> Result<(), EditError> {
        let rows = self.calls.take().map_err(EditError::rows(layout::CALLS))?;
        Ok(rows.map_or(Ok(()), |rows| self.call_files.write(|file| file.write(&rows)))?)
    }

    fn write_scopes(&mut self) -> Result<(), EditError> {
        let rows = self.scopes.take().map_err(EditError::rows(layout::SCOPES))?;
        Ok(rows.map_or(Ok(()), |rows| self.scope_files.write(|file| file.write(&rows)))?)
    }

    /// Writes the rows of episodes, whose statistics need their frames.
    fn write_episodes(&mut self) -> Result<(), EditError> {
        self.write_frames()?;
        let failed = || EditError::rows(layout::META_EPISODES);
        if let Some(rows) = self.meta.take().map_err(failed())? {
            let schema = rows.schema();
            let statistics = self.statistics.columns().filter_map(|(name, values)| {
                let field = schema.field_with_name(name).ok()?;
                Some(lists(field, values).map(|column| (field.name().as_str(), column)))
            });
            let statistics = statistics.collect::<Result<Vec<_>, _>>().map_err(failed())?;
            let videos = self.pictures.meta_columns();
            let videos = videos.iter().map(|(name, column)| (name.as_str(), Arc::clone(column)));
            let rows = replace(&rows, statistics.into_iter().chain(videos)).map_err(failed())?;
            self.meta_files.write(|file| file.write(&rows))?;
        }
        self.pictures.clear_episodes();
        self.statistics.clear();
        let rows = self.provenance.take().map_err(EditError::rows(layout::EPISODES))?;
        Ok(rows.map_or(Ok(()), |rows| self.provenance_file.write(&rows))?)
    }
}

fn numbers_of(place: FilePlace) -> [i64; 2] {
    [i64::from(place.chunk), i64::from(place.file)]
}
