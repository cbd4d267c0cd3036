//! The program tables of datasets that were annotated elsewhere, carried along with their episodes.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

use crate::artifact::{read_json, write_json};
use crate::dataset::edit::EditError;
use crate::dataset::edit::cursor::{BatchCursor, TableFiles};
use crate::dataset::edit::pieces::Piece;
use crate::dataset::edit::renumber::Renumbered;
use crate::dataset::files::info::NtpInfo;
use crate::dataset::files::layout::{self, FilePlace};
use crate::dataset::files::rolling::Rolling;
use crate::dataset::schema::{CALLS, EPISODES, SCOPES};
use crate::dataset::tables::annotated::{ROOT, vocabulary};
use crate::dataset::tables::episodes::read::{EpisodeRow, EpisodeRows};
use crate::dataset::write::sheaf::{EPISODE_GROUP_ROWS, GROUP_ROWS, MEGABYTE, SCOPE_GROUP_ROWS};
use crate::table::{BatchWriter, TableSchema};

const FILE_BYTES: usize = 100 * MEGABYTE;
const PROVENANCE_NUMBERS: [&str; 7] = [
    "episode_index",
    "calls/chunk_index",
    "calls/file_index",
    "calls_from_index",
    "scopes/chunk_index",
    "scopes/file_index",
    "scopes_from_index",
];

/// The program tables of a source.
pub(in crate::dataset::edit) struct SourcePrograms {
    pub(in crate::dataset::edit) ntp: NtpInfo,
    rows: EpisodeRows,
    calls: BatchCursor,
    scopes: BatchCursor,
    provenance: BatchCursor,
}

/// What they hold of an episode.
pub(in crate::dataset::edit) struct EpisodePrograms {
    pub(in crate::dataset::edit) row: EpisodeRow,
    calls: Vec<Piece>,
    scopes: Vec<Piece>,
    provenance: Vec<Piece>,
}

impl SourcePrograms {
    pub(in crate::dataset::edit) fn open(root: &Path) -> Result<Self, EditError> {
        let open = |files| BatchCursor::open(root, files);
        Ok(Self {
            ntp: read_json(&root.join(layout::NTP_INFO))?,
            rows: EpisodeRows::open(root)?.1,
            calls: open(TableFiles::Numbered(layout::CALLS))?,
            scopes: open(TableFiles::Numbered(layout::SCOPES))?,
            provenance: open(TableFiles::Single(layout::EPISODES))?,
        })
    }

    /// Those of the next episode.
    pub(in crate::dataset::edit) fn next(&mut self) -> Result<Option<EpisodePrograms>, EditError> {
        let Some(row) = self.rows.next().transpose()? else { return Ok(None) };
        let n = |number: i64| usize::try_from(number).unwrap_or(0);
        let calls = self.calls.take(row.calls, n(row.n_calls))?;
        let scopes = self.scopes.take(row.scopes, n(row.n_scopes))?;
        let provenance = self.provenance.take(FilePlace::default(), 1)?;
        Ok(Some(EpisodePrograms { row, calls, scopes, provenance }))
    }
}

impl EpisodePrograms {
    /// Whether a program is called in the episode.
    pub(in crate::dataset::edit) fn calls_program(&self, name: &str) -> bool {
        self.calls.iter().any(|piece| {
            let programs = crate::dataset::plain::texts(&piece.rows(), "program");
            programs.is_some_and(|programs| programs.iter().any(|program| program == name))
        })
    }
}

/// The program tables that are being written.
pub(in crate::dataset::edit) struct TargetPrograms {
    ntp: NtpInfo,
    calls: Renumbered<1>,
    scopes: Renumbered<1>,
    provenance: Renumbered<7>,
    call_files: Rolling<BatchWriter>,
    scope_files: Rolling<BatchWriter>,
    provenance_file: BatchWriter,
    n_episodes: i64,
    /// Every program that is called, but for the root.
    names: BTreeSet<String>,
    pub(in crate::dataset::edit) n_calls: u64,
    pub(in crate::dataset::edit) n_scopes: u64,
}

impl TargetPrograms {
    pub(in crate::dataset::edit) fn create(root: &Path, like: &SourcePrograms) -> Result<Self, EditError> {
        let rolling = |folder, table: TableSchema, cursor: &BatchCursor| {
            let schema = Arc::clone(cursor.schema());
            let begin = move |path: &Path| BatchWriter::create(path, table.name(), &schema, table.options());
            Rolling::new(root, folder, FILE_BYTES, begin)
        };
        let columns = like.provenance.schema();
        Ok(Self {
            ntp: like.ntp.clone(),
            calls: Renumbered::new(["episode_index"]),
            scopes: Renumbered::new(["episode_index"]),
            provenance: Renumbered::new(PROVENANCE_NUMBERS),
            call_files: rolling(layout::CALLS, CALLS, &like.calls),
            scope_files: rolling(layout::SCOPES, SCOPES, &like.scopes),
            provenance_file: BatchWriter::create(
                &root.join(layout::EPISODES),
                EPISODES.name(),
                columns,
                EPISODES.options(),
            )?,
            n_episodes: 0,
            names: BTreeSet::new(),
            n_calls: 0,
            n_scopes: 0,
        })
    }

    pub(in crate::dataset::edit) fn append(&mut self, of: &EpisodePrograms) -> Result<(), EditError> {
        let [calls, scopes] = [self.call_files.place(), self.scope_files.place()];
        self.provenance.push(&of.provenance).map_err(EditError::rows(layout::EPISODES))?;
        self.provenance.push_numbers([
            self.n_episodes,
            i64::from(calls.chunk),
            i64::from(calls.file),
            self.n_calls as i64,
            i64::from(scopes.chunk),
            i64::from(scopes.file),
            self.n_scopes as i64,
        ]);
        self.calls.push(&of.calls).map_err(EditError::rows(layout::CALLS))?;
        self.scopes.push(&of.scopes).map_err(EditError::rows(layout::SCOPES))?;
        for piece in &of.calls {
            let names = crate::dataset::plain::texts(&piece.rows(), "program").unwrap_or_default();
            self.names.extend(names.into_iter().filter(|name| name != ROOT));
        }
        self.calls.fill(0, self.n_episodes);
        self.scopes.fill(0, self.n_episodes);
        self.n_episodes += 1;
        self.n_calls += of.row.n_calls.unsigned_abs();
        self.n_scopes += of.row.n_scopes.unsigned_abs();
        if self.calls.n_rows() >= GROUP_ROWS {
            self.write_calls()?;
        }
        if self.scopes.n_rows() >= SCOPE_GROUP_ROWS {
            self.write_scopes()?;
        }
        if self.provenance.n_rows() >= EPISODE_GROUP_ROWS {
            self.write_provenance()?;
        }
        Ok(())
    }

    fn write_calls(&mut self) -> Result<(), EditError> {
        let rows = self.calls.take().map_err(EditError::rows(layout::CALLS))?;
        Ok(rows.map_or(Ok(()), |rows| self.call_files.write(|file| file.write(&rows)))?)
    }

    fn write_scopes(&mut self) -> Result<(), EditError> {
        let rows = self.scopes.take().map_err(EditError::rows(layout::SCOPES))?;
        Ok(rows.map_or(Ok(()), |rows| self.scope_files.write(|file| file.write(&rows)))?)
    }

    fn write_provenance(&mut self) -> Result<(), EditError> {
        let rows = self.provenance.take().map_err(EditError::rows(layout::EPISODES))?;
        Ok(rows.map_or(Ok(()), |rows| self.provenance_file.write(&rows))?)
    }

    /// Ends the tables. Returns their files.
    pub(in crate::dataset::edit) fn finish(mut self, root: &Path) -> Result<Vec<String>, EditError> {
        self.write_calls()?;
        self.write_scopes()?;
        self.write_provenance()?;
        let (vocabulary, vocabulary_hash) = vocabulary(&self.names.into_iter().collect::<Vec<_>>());
        let ntp = NtpInfo {
            vocabulary,
            vocabulary_hash,
            ntp_version: env!("CARGO_PKG_VERSION").to_owned(),
            total_calls: self.n_calls,
            total_scopes: self.n_scopes,
            ..self.ntp
        };
        write_json(&root.join(layout::NTP_INFO), &ntp)?;
        let mut files = vec![layout::NTP_INFO.to_owned(), layout::EPISODES.to_owned()];
        files.extend(self.call_files.finish()?);
        files.extend(self.scope_files.finish()?);
        self.provenance_file.commit()?;
        Ok(files)
    }
}
