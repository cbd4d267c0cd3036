//! A dataset that is read to make another of: its episodes one by one, each with its rows of every table.

use std::path::{Path, PathBuf};

use arrow::array::AsArray as _;
use serde::Serialize;

use crate::artifact::{IoError, Plan, StageDir, read_json, sha256_bytes, sha256_file};
use crate::dataset::DatasetError;
use crate::dataset::edit::EditError;
use crate::dataset::edit::cursor::{BatchCursor, TableFiles};
use crate::dataset::edit::pieces::Piece;
use crate::dataset::files::info::{Info, NtpInfo};
use crate::dataset::files::layout::{self, FilePlace};
use crate::dataset::schema::SUBTASKS;
use crate::dataset::tables::episodes::read::{EpisodeRow, EpisodeRows};
use crate::table;

/// The tables of a dataset, each with something for it.
#[derive(Debug, Default)]
pub(super) struct PerTable<T> {
    pub(super) frames: T,
    pub(super) calls: T,
    pub(super) scopes: T,
    pub(super) meta: T,
    pub(super) provenance: T,
}

/// Where the tables are.
pub(super) const FILES: PerTable<TableFiles> = PerTable {
    frames: TableFiles::Numbered(layout::DATA),
    calls: TableFiles::Numbered(layout::CALLS),
    scopes: TableFiles::Numbered(layout::SCOPES),
    meta: TableFiles::Numbered(layout::META_EPISODES),
    provenance: TableFiles::Single(layout::EPISODES),
};

/// A dataset being read.
pub(super) struct Source {
    root: PathBuf,
    pub(super) info: Info,
    pub(super) ntp: NtpInfo,
    /// Texts of its `subtask_index`.
    pub(super) subtasks: Vec<String>,
    rows: EpisodeRows,
    pub(super) cursors: PerTable<BatchCursor>,
}

/// One episode: its row and its rows of every table.
pub(super) struct SourceEpisode {
    pub(super) row: EpisodeRow,
    pub(super) pieces: PerTable<Vec<Piece>>,
}

impl Source {
    pub(super) fn open(root: &Path) -> Result<Self, EditError> {
        let (info, rows) = EpisodeRows::open(root)?;
        Self::with_rows(root, info, rows)
    }

    /// Opens what can be read of a dataset whose totals may be wrong.
    pub(super) fn with_rows(root: &Path, info: Info, rows: EpisodeRows) -> Result<Self, EditError> {
        let ntp = read_json(&root.join(layout::NTP_INFO))?;
        let subtasks = table::read(&root.join(layout::SUBTASKS), &SUBTASKS)?.text("subtask")?;
        let open = |files| BatchCursor::open(root, files);
        let cursors = PerTable {
            frames: open(FILES.frames)?,
            calls: open(FILES.calls)?,
            scopes: open(FILES.scopes)?,
            meta: open(FILES.meta)?,
            provenance: open(FILES.provenance)?,
        };
        Ok(Self { root: root.to_owned(), info, ntp, subtasks, rows, cursors })
    }

    pub(super) fn root(&self) -> &Path {
        &self.root
    }

    /// The file of some frames.
    pub(super) fn frames_path(&self, place: FilePlace) -> PathBuf {
        FILES.frames.path(&self.root, place)
    }

    /// The next episode; `None` after the last one.
    pub(super) fn next_episode(&mut self) -> Result<Option<SourceEpisode>, DatasetError> {
        let Some(row) = self.rows.next().transpose()? else { return Ok(None) };
        let n = |number: i64| usize::try_from(number).unwrap_or(0);
        let cursors = &mut self.cursors;
        let pieces = PerTable {
            frames: cursors.frames.take(row.data, n(row.n_frames))?,
            calls: cursors.calls.take(row.calls, n(row.n_calls))?,
            scopes: cursors.scopes.take(row.scopes, n(row.n_scopes))?,
            meta: cursors.meta.take(row.meta, 1)?,
            provenance: cursors.provenance.take(FilePlace::default(), 1)?,
        };
        Ok(Some(SourceEpisode { row, pieces }))
    }
}

/// Names a dataset for the plan of what is made of it.
pub(super) fn describe(root: &Path) -> Result<SourceDescription, EditError> {
    let path = root.canonicalize().unwrap_or_else(|_gone| root.to_owned());
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let version = version_of(root)?;
    let plan = StageDir::new("dataset", root).plan()?;
    Ok(SourceDescription { name, version, episodes: [0, 0], plan })
}

/// A hash of what a dataset holds: of its totals, its texts, its exact statistics and its rows per episode.
pub(super) fn version_of(root: &Path) -> Result<String, EditError> {
    let files = [layout::INFO, layout::STATS, layout::TASKS, layout::SUBTASKS, layout::NTP_INFO, layout::EPISODES];
    let mut lines = String::new();
    for file in files {
        let path = root.join(file);
        let is_there = path.try_exists().map_err(IoError::system("read", &path))?;
        let hash = if is_there { sha256_file(&path)? } else { String::new() };
        lines.push_str(&format!("{hash}  {file}\n"));
    }
    Ok(sha256_bytes(lines.as_bytes()))
}

/// A source, as the plan of what was made of it tells.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct SourceDescription {
    /// The folder's name.
    pub(super) name: String,
    /// [`version_of`] it.
    pub(super) version: String,
    /// Which episodes of the result are from it, half-open.
    pub(super) episodes: [u64; 2],
    /// The plan that it was made by, where it has one.
    pub(super) plan: Option<Plan>,
}

impl SourceEpisode {
    /// Whether a program is called in it.
    pub(super) fn calls_program(&self, name: &str) -> bool {
        self.pieces.calls.iter().any(|piece| {
            let programs = piece.batch.column_by_name("program").and_then(|column| column.as_string_opt::<i32>());
            programs.is_some_and(|programs| (piece.begin..piece.end).any(|row| programs.value(row) == name))
        })
    }
}
