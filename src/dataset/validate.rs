//! Checks every cross-reference of a dataset, in memory that does not grow with it.
//!
//! All tables are read side by side, episode by episode. What breaks one table off (rows out of order, a file that is
//! missing) ends the check of that table; the others go on.

mod annotated;
mod by_model;
mod meta;
mod pictures;
mod plain;

use std::path::Path;

pub(crate) use plain::episode::episode_problem;

use crate::artifact::read_json;
use crate::dataset::DatasetError;
use crate::dataset::files::cursor::Cursor;
use crate::dataset::files::finding::Validation;
use crate::dataset::files::info::{Info, NtpInfo};
use crate::dataset::files::layout;
use crate::dataset::plain::{ProgramTables, program_tables};
use crate::dataset::tables::calls::check::{ArgumentBatch, check_arguments, check_tree};
use crate::dataset::tables::calls::read::{CallBatch, read_calls};
use crate::dataset::tables::episodes::check::EpisodeCheck;
use crate::dataset::tables::episodes::read::{EpisodeRow, EpisodeRows};
use crate::dataset::tables::frames::check::FrameCheck;
use crate::dataset::tables::frames::expected::FullFrameBatch;
use crate::dataset::tables::frames::feature::{action_of, n_slots};
use crate::dataset::tables::scopes::check::{self as scopes, Labelled, ScopeBatch};
use crate::dataset::tables::texts::read::{Texts, read_all_texts};
use crate::trace::ProgramCall;

/// Checks a dataset.
///
/// Holds the counts and the order of all rows, the rules of the program tree, labels against spans, actions against
/// positions, task texts, the declared features, the presence and range of statistics, and that no task is in two
/// splits. It reads no recordings. A dataset without program tables is held against the rules of `LeRobot`'s format
/// alone, one that was annotated elsewhere also against those of its program tree.
pub fn validate(root: &Path) -> Validation {
    let mut validation = Validation::default();
    let tables = program_tables(root);
    // One that cannot be read is found below.
    let info = read_json::<NtpInfo>(&root.join(layout::NTP_INFO));
    let annotated = info.ok().filter(|info| info.annotated_by.is_some());
    if tables != ProgramTables::Own || annotated.is_some() {
        plain::check(root, &mut validation);
        meta::check_card(root, &mut validation);
    }
    if tables != ProgramTables::Own && root.join(layout::ANNOTATION).is_file() {
        by_model::check_annotation(root, validation.episodes, &mut validation);
    }
    if tables == ProgramTables::None {
        return validation;
    }
    if let Some(info) = annotated {
        validation = Validation { episodes: 0, frames: 0, ..validation };
        let texts = read_all_texts(root, &mut validation);
        let check = if info.has_our_programs() { by_model::check } else { annotated::check };
        if let Err(error) = check(root, &texts, &mut validation) {
            validation.failed("episodes.row", &error);
        }
        return validation;
    }
    let texts = meta::check(root, &mut validation);
    if let Err(error) = check_episodes(root, texts, &mut validation) {
        validation.failed("episodes.row", &error);
    }
    pictures::check(root, &mut validation);
    validation
}

/// The tables that are read side by side; `None` once a table could not be read on.
struct Tables {
    frames: Option<Cursor<FullFrameBatch>>,
    calls: Option<Cursor<CallBatch>>,
    arguments: Option<Cursor<ArgumentBatch>>,
    scopes: Option<Cursor<ScopeBatch>>,
}

fn check_episodes(root: &Path, texts: Texts, validation: &mut Validation) -> Result<(), DatasetError> {
    let (info, mut rows) = EpisodeRows::open(root)?;
    let mut checks = EpisodeChecks::with_texts(root, &info, texts)?;
    while let Some(row) = rows.next() {
        checks.check(rows.path(), &row?, validation);
    }
    checks.finish(root, validation);
    Ok(())
}

/// Checks one episode after another, with its rows of every table.
pub(crate) struct EpisodeChecks {
    n_slots: usize,
    texts: Texts,
    tables: Tables,
    episodes: EpisodeCheck,
    frames: FrameCheck,
    calls: Vec<ProgramCall>,
}

impl EpisodeChecks {
    /// Begins with the first episode of a dataset.
    pub(crate) fn new(root: &Path, info: &Info) -> Result<Self, DatasetError> {
        let texts = meta::check(root, &mut Validation::default());
        Self::with_texts(root, info, texts)
    }

    fn with_texts(root: &Path, info: &Info, texts: Texts) -> Result<Self, DatasetError> {
        let n_slots = n_slots(root, info)?;
        let tables = Tables {
            frames: Some(Cursor::new(root, layout::DATA)),
            calls: Some(Cursor::new(root, layout::CALLS)),
            arguments: Some(Cursor::new(root, layout::CALLS)),
            scopes: Some(Cursor::new(root, layout::SCOPES)),
        };
        let (episodes, frames) = (EpisodeCheck::default(), FrameCheck::new(n_slots, info.whole_fps(), action_of(info)));
        Ok(Self { n_slots, texts, tables, episodes, frames, calls: Vec::new() })
    }

    /// Checks the next episode; `path` is the file of its row.
    pub(crate) fn check(&mut self, path: &Path, row: &EpisodeRow, validation: &mut Validation) {
        let Self { n_slots, texts, tables, episodes, frames, calls } = self;
        validation.episodes += 1;
        episodes.check(path, row, *n_slots, validation);
        let calls_are_there = tables.check_calls(row, *n_slots, calls, validation);
        tables.check_frames(frames, row, calls_are_there.then_some(&*calls), texts, validation);
        tables.check_scopes(row, calls_are_there.then_some(&*calls), validation);
    }

    /// Checks what is there of all episodes together.
    fn finish(self, root: &Path, validation: &mut Validation) {
        self.tables.finish(validation);
        meta::check_files(root, self.episodes.data_places(), validation);
        self.frames.compare_ranges(root, &self.texts, validation);
    }
}

impl Tables {
    /// Reads and checks the calls of an episode; false when they are not there.
    fn check_calls(
        &mut self,
        row: &EpisodeRow,
        n_slots: usize,
        calls: &mut Vec<ProgramCall>,
        validation: &mut Validation,
    ) -> bool {
        let Some(cursor) = &mut self.calls else { return false };
        if let Err(error) = read_calls(cursor, row, calls) {
            validation.failed("calls.row", &error);
            self.calls = None;
            return false;
        }
        validation.calls += calls.len() as u64;
        if let Err((call, problem)) = check_tree(row, n_slots, calls) {
            let place = format!("episode {}, call {call}", row.episode_index);
            validation.error("calls.tree", &cursor.path(), place, problem);
        }
        if let Some(arguments) = &mut self.arguments
            && let Err(error) = check_arguments(arguments, row, calls, validation)
        {
            validation.failed("calls.row", &error);
            self.arguments = None;
        }
        true
    }

    fn check_frames(
        &mut self,
        check: &mut FrameCheck,
        row: &EpisodeRow,
        calls: Option<&Vec<ProgramCall>>,
        texts: &Texts,
        validation: &mut Validation,
    ) {
        let Some(cursor) = &mut self.frames else { return };
        if let Err(error) = check.check(cursor, row, calls.map(Vec::as_slice), texts, validation) {
            validation.failed("frames.row", &error);
            self.frames = None;
        }
    }

    fn check_scopes(&mut self, row: &EpisodeRow, calls: Option<&Vec<ProgramCall>>, validation: &mut Validation) {
        let (Some(cursor), Some(calls)) = (&mut self.scopes, calls) else { return };
        let labelled =
            calls.iter().filter_map(|call| Some(Labelled { call: call.id.0, input: call.input, output: call.output? }));
        if let Err(error) = scopes::check(cursor, row, labelled, validation) {
            validation.failed("scopes.row", &error);
            self.scopes = None;
        }
    }

    /// Makes sure that nothing is left of the tables that were read to their end.
    fn finish(&self, validation: &mut Validation) {
        let ends = [
            ("frames.row", self.frames.as_ref().map(Cursor::finish)),
            ("calls.row", self.calls.as_ref().map(Cursor::finish)),
            ("scopes.row", self.scopes.as_ref().filter(|_| self.calls.is_some()).map(Cursor::finish)),
        ];
        for (code, end) in ends {
            if let Some(Err(error)) = end {
                validation.failed(code, &error);
            }
        }
    }
}
