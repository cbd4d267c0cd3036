//! The columns that hold an episode's labels, frame by frame.

use std::sync::Arc;

use arrow::array::{ArrayRef, RecordBatch};
use arrow::datatypes::{Field, Schema};
use arrow::error::ArrowError;

use crate::dataset::export::language::{Entry, numbered};
use crate::dataset::labelled::TreeLabels;
use crate::dataset::relabel::EpisodeTree;
use crate::dataset::tables::frames::expected::Labels;
use crate::dataset::tables::frames::paths::ProgramPaths;
use crate::dataset::tables::texts::subtask::subtask_text;
use crate::table::TextTable;

/// Names that frames are labelled with, each once.
#[derive(Default)]
pub(super) struct LabelTexts {
    paths: ProgramPaths,
    programs: TextTable,
    /// Those that `subtask_index` counts.
    pub(super) subtasks: TextTable,
}

/// The labels of an episode, a value a frame.
pub(super) struct LabelColumns {
    pub(super) call_ids: Vec<i64>,
    pub(super) programs: Vec<String>,
    pub(super) subtasks: Vec<i64>,
    pub(super) boundaries: Vec<bool>,
    /// What `language_persistent` says in each of its frames.
    pub(super) entries: Vec<Entry>,
}

impl LabelTexts {
    /// The columns of an episode of so many frames.
    pub(super) fn columns(&mut self, tree: &EpisodeTree, slots: &[String], n_frames: u32, fps: u32) -> LabelColumns {
        let calls = &tree.calls;
        let labelled = TreeLabels { calls, slots, n_frames };
        self.paths.note(calls, &mut self.programs);
        let mut running = Labels::new(calls, &self.paths, self.programs.texts());
        let running = (0..i64::from(n_frames)).map(|frame| running.at(frame));
        let (call_ids, programs) = running.map(|(call, path)| (call, path.to_owned())).unzip();
        let mut boundaries = vec![false; n_frames as usize];
        for &frame in &tree.boundaries {
            if let Some(flag) = boundaries.get_mut(frame as usize) {
                *flag = true;
            }
        }
        let subtasks = self.subtasks(labelled, n_frames);
        LabelColumns { call_ids, programs, subtasks, boundaries, entries: entries(labelled, fps) }
    }

    /// The root's callee that goes on from each frame; the root where none does.
    fn subtasks(&mut self, labelled: TreeLabels<'_>, n_frames: u32) -> Vec<i64> {
        let calls = labelled.calls;
        let root = calls.first().map_or("", |root| root.program.name());
        let mut subtasks = vec![i64::from(self.subtasks.key(root)); n_frames as usize];
        for (position, call) in calls.iter().enumerate().filter(|(_, call)| call.depth == 1) {
            let frames = call.frames.begin as usize..call.frames.last() as usize;
            if let Some(rows) = subtasks.get_mut(frames).filter(|rows| !rows.is_empty()) {
                let text = subtask_text(calls, position, |slot| labelled.slot(slot));
                rows.fill(i64::from(self.subtasks.key(&text)));
            }
        }
        subtasks
    }
}

/// What an episode says, in order of time: sub-tasks that are still to be done, skills and primitives in words.
fn entries(labelled: TreeLabels<'_>, fps: u32) -> Vec<Entry> {
    // As `timestamp` is made, so that both are equal.
    let timestamp = |begin: u32| (f64::from(begin) / f64::from(fps)) as f32;
    let entry = |style, begin, content| Entry { timestamp: timestamp(begin), style, content };
    let subtasks = labelled.subtasks();
    let plans = (0..subtasks.len()).map(|at| entry("plan", subtasks[at].begin, numbered(&subtasks[at..])));
    let skills = labelled.skills().into_iter().map(|label| entry("subtask", label.begin, label.text));
    let motions = labelled.primitives().into_iter();
    let motions = motions.map(|label| entry("motion", label.begin, label.text.replace('_', " ")));
    let mut entries: Vec<Entry> = plans.chain(skills).chain(motions).collect();
    entries.sort_by(|a, b| a.timestamp.total_cmp(&b.timestamp));
    entries
}

/// The rows with columns in place of those of the same name, or behind all.
pub(super) fn with_columns(rows: &RecordBatch, columns: Vec<(Field, ArrayRef)>) -> Result<RecordBatch, ArrowError> {
    let schema = rows.schema();
    let mut all: Vec<(Arc<Field>, ArrayRef)> = schema.fields().iter().cloned().zip(rows.columns().to_vec()).collect();
    for (field, array) in columns {
        match all.iter_mut().find(|(known, _)| known.name() == field.name()) {
            Some(known) => *known = (Arc::new(field), array),
            None => all.push((Arc::new(field), array)),
        }
    }
    let (fields, arrays): (Vec<_>, Vec<_>) = all.into_iter().unzip();
    RecordBatch::try_new(Arc::new(Schema::new(fields).with_metadata(schema.metadata().clone())), arrays)
}
