//! The episodes of a dataset: `ntp/episodes.parquet` and `meta/episodes/` side by side.

use std::path::{Path, PathBuf};

use crate::artifact::read_json;
use crate::dataset::DatasetError;
use crate::dataset::files::cursor::Cursor;
use crate::dataset::files::info::Info;
use crate::dataset::files::layout::{self, FilePlace};
use crate::dataset::tables::annotated::FAMILY as ANNOTATED;
use crate::dataset::tables::{episodes, meta_episodes};
use crate::table::{Batch as _, Columns, TableError, TableReader, TextRows, batch};
use crate::words::counted;

/// One episode's row.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct EpisodeRow {
    pub(crate) episode_index: i64,
    pub(crate) task_id: String,
    pub(crate) task_text: String,
    pub(crate) family: String,
    pub(crate) split: String,
    pub(crate) trial: i64,
    pub(crate) actor: String,
    pub(crate) outcome: String,
    pub(crate) cause: Option<String>,
    pub(crate) is_success: bool,
    pub(crate) specification: String,
    pub(crate) specification_frames: i64,
    pub(crate) recording: String,
    pub(crate) recording_sha256: String,
    pub(crate) recording_index: i64,
    pub(crate) slots: Vec<String>,
    pub(crate) n_frames: i64,
    pub(crate) n_calls: i64,
    pub(crate) n_scopes: i64,
    pub(crate) data: FilePlace,
    pub(crate) first_index: i64,
    pub(crate) calls: FilePlace,
    pub(crate) first_call: i64,
    pub(crate) scopes: FilePlace,
    pub(crate) first_scope: i64,
    /// What `LeRobot`'s table repeats of this row, but otherwise.
    pub(crate) copies_problem: Option<String>,
    /// Where its row of `meta/episodes/` is.
    pub(crate) meta: FilePlace,
}

batch! {
    /// Where the frames of episodes are, and what is said of them twice.
    struct MetaBatch of meta_episodes {
        episode_index,
        tasks,
        length,
        data_chunk,
        data_file,
        from_index,
        to_index,
        own_chunk,
        own_file,
        task_id,
        split,
        success,
    }
}

impl MetaBatch {
    /// What is wrong with the columns that repeat what the episode's own row says.
    fn copies_problem(&self, at: usize, row: &EpisodeRow) -> Option<String> {
        let copies = (self.task_id.row(at), self.split.row(at), self.success.value(at));
        let originals = (row.task_id.as_str(), row.split.as_str(), row.is_success);
        (copies != originals).then(|| {
            let names = "(ntp/task_id, ntp/split, ntp/success)";
            format!("{names} are {copies:?}, but {} makes them {originals:?}", layout::EPISODES)
        })
    }
}

/// Reads the episodes in order.
pub(crate) struct EpisodeRows {
    path: PathBuf,
    reader: TableReader,
    meta: Cursor<MetaBatch>,
    batch: std::vec::IntoIter<EpisodeRow>,
    total: i64,
    n_read: i64,
    next_index: i64,
    next_call: i64,
    next_scope: i64,
}

impl EpisodeRows {
    /// Opens the episodes of a dataset and reads its `meta/info.json`.
    pub(crate) fn open(root: &Path) -> Result<(Info, Self), DatasetError> {
        let info: Info = read_json(&root.join(layout::INFO))?;
        let reader = Self::reader(root)?;
        if reader.n_rows() != info.total_episodes {
            let (found, expected) = (reader.n_rows(), info.total_episodes);
            let problem = format!(
                "it has {found}, but {} says {expected}",
                layout::INFO,
                found = counted(found, "row"),
                expected = counted(expected, "episode")
            );
            return Err(DatasetError::Count { path: root.join(layout::EPISODES), problem });
        }
        let total = info.total_episodes;
        Ok((info, Self::new(root, reader, total)))
    }

    /// Opens the episodes of a dataset whose totals may be wrong: as many as both totals and table have. Also gives how
    /// many one of them has.
    pub(crate) fn open_prefix(root: &Path) -> Result<(Info, Self, u64), DatasetError> {
        let info: Info = read_json(&root.join(layout::INFO))?;
        let reader = Self::reader(root)?;
        let (in_table, in_info) = (reader.n_rows(), info.total_episodes);
        Ok((info, Self::new(root, reader, in_table.min(in_info)), in_table.max(in_info)))
    }

    fn reader(root: &Path) -> Result<TableReader, DatasetError> {
        let columns = episodes::SCHEMA.columns();
        let names: Vec<&str> = columns.iter().map(|(name, _)| name.as_str()).collect();
        Ok(TableReader::open_columns(&root.join(layout::EPISODES), &episodes::SCHEMA, &names)?)
    }

    fn new(root: &Path, reader: TableReader, total: u64) -> Self {
        Self {
            path: root.join(layout::EPISODES),
            reader,
            meta: Cursor::new(root, layout::META_EPISODES),
            batch: Vec::new().into_iter(),
            total: total as i64,
            n_read: 0,
            next_index: 0,
            next_call: 0,
            next_scope: 0,
        }
    }

    /// The file with the provenance.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    fn read_next(&mut self) -> Result<Option<EpisodeRow>, DatasetError> {
        if self.n_read == self.total {
            self.meta.finish()?;
            return match self.reader.next() {
                None => Ok(None),
                Some(Err(error)) => Err(error.into()),
                Some(Ok(_)) => Err(self.problem("its footer does not count this row".to_owned())),
            };
        }
        while self.batch.as_slice().is_empty() {
            match self.reader.next() {
                Some(columns) => self.batch = take_rows(&mut columns?)?.into_iter(),
                None => return Err(self.problem("its footer counts rows that are not there".to_owned())),
            }
        }
        let Some(row) = self.batch.next() else { return Ok(None) };
        let row = self.with_meta(row)?;
        self.check_order(&row)?;
        self.n_read += 1;
        self.next_index += row.n_frames;
        self.next_call += row.n_calls;
        self.next_scope += row.n_scopes;
        Ok(Some(row))
    }

    /// Adds where the frames are.
    fn with_meta(&mut self, mut row: EpisodeRow) -> Result<EpisodeRow, DatasetError> {
        let (meta, at) = self.meta.next_in_order()?;
        row.data = place(meta.data_chunk[at], meta.data_file[at]);
        row.first_index = meta.from_index[at];
        row.meta = place(meta.own_chunk[at], meta.own_file[at]);
        let found = (meta.episode_index[at], meta.length[at], meta.to_index[at]);
        let expected = (row.episode_index, row.n_frames, row.first_index + row.n_frames);
        row.copies_problem = meta.copies_problem(at, &row);
        let tasks = &meta.tasks[at];
        // Episodes of others may have several tasks, of which the first is the episode's here.
        let is_single = tasks.len() == 1 || row.family == ANNOTATED;
        let tasks_agree = is_single && tasks.first().is_some_and(|task| *task == row.task_text);
        if found != expected {
            return Err(self.meta.problem(format!(
                "(episode_index, length, dataset_to_index) are {found:?}, but {} makes them {expected:?}",
                layout::EPISODES
            )));
        }
        if row.meta != self.meta.place() {
            return Err(self
                .meta
                .problem(format!("it says that it is in {}", row.meta.relative(layout::META_EPISODES))));
        }
        if !tasks_agree {
            return Err(self.meta.problem(format!("its tasks are not the one of {}", layout::EPISODES)));
        }
        Ok(row)
    }

    fn check_order(&self, row: &EpisodeRow) -> Result<(), DatasetError> {
        let numbers = [
            ("episode_index", row.episode_index, self.n_read),
            ("calls_from_index", row.first_call, self.next_call),
            ("scopes_from_index", row.first_scope, self.next_scope),
        ];
        if let Some((name, found, expected)) = numbers.into_iter().find(|(_, found, expected)| found != expected) {
            return Err(self.problem(format!("{name} is {found}, but {expected} comes next")));
        }
        let too_few = [("n_frames", row.n_frames), ("n_calls", row.n_calls)].into_iter().find(|(_, n)| *n < 1);
        if let Some((name, found)) = too_few {
            return Err(self.problem(format!("{name} is {found}, but an episode has at least 1")));
        }
        if row.first_index != self.next_index {
            let (found, expected) = (row.first_index, self.next_index);
            return Err(self.meta.problem(format!("dataset_from_index is {found}, but {expected} comes next")));
        }
        Ok(())
    }

    /// Names the row that is being read.
    fn problem(&self, problem: String) -> DatasetError {
        DatasetError::Row { path: self.path.clone(), row: self.n_read as u64, problem }
    }
}

impl Iterator for EpisodeRows {
    type Item = Result<EpisodeRow, DatasetError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.read_next().transpose()
    }
}

fn place(chunk: i64, file: i64) -> FilePlace {
    FilePlace { chunk: u32::try_from(chunk).unwrap_or(u32::MAX), file: u32::try_from(file).unwrap_or(u32::MAX) }
}

fn take_rows(columns: &mut Columns) -> Result<Vec<EpisodeRow>, TableError> {
    let n_rows = columns.n_rows();
    let mut rows = EpisodeBatch::take(columns)?;
    Ok((0..n_rows).map(|at| rows.row(at)).collect())
}

batch! {
    /// What is known of an episode, but for where its frames are.
    struct EpisodeBatch of episodes {
        episode_index,
        task_id,
        task_text,
        family,
        split,
        trial,
        actor,
        outcome,
        cause,
        success,
        recording,
        recording_sha256,
        recording_index,
        n_frames,
        specification,
        specification_frames,
        slots,
        n_calls,
        calls_chunk,
        calls_file,
        calls_from,
        n_scopes,
        scopes_chunk,
        scopes_file,
        scopes_from,
    }
}

impl EpisodeBatch {
    /// Takes a row out.
    fn row(&mut self, at: usize) -> EpisodeRow {
        let text = |column: &TextRows| column.row(at).to_owned();
        EpisodeRow {
            episode_index: self.episode_index[at],
            task_id: text(&self.task_id),
            task_text: text(&self.task_text),
            family: text(&self.family),
            split: text(&self.split),
            trial: self.trial[at],
            actor: text(&self.actor),
            outcome: text(&self.outcome),
            cause: self.cause.get(at).map(ToOwned::to_owned),
            is_success: self.success.value(at),
            specification: text(&self.specification),
            specification_frames: self.specification_frames[at],
            recording: text(&self.recording),
            recording_sha256: text(&self.recording_sha256),
            recording_index: self.recording_index[at],
            slots: std::mem::take(&mut self.slots[at]),
            n_frames: self.n_frames[at],
            n_calls: self.n_calls[at],
            n_scopes: self.n_scopes[at],
            data: FilePlace::default(),
            first_index: 0,
            calls: place(self.calls_chunk[at], self.calls_file[at]),
            first_call: self.calls_from[at],
            scopes: place(self.scopes_chunk[at], self.scopes_file[at]),
            first_scope: self.scopes_from[at],
            copies_problem: None,
            meta: FilePlace::default(),
        }
    }
}
