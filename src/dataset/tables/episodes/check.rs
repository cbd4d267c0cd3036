//! An episode's row on its own, and the split over all episodes.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::dataset::files::finding::Validation;
use crate::dataset::files::layout::FilePlace;
use crate::dataset::tables::episodes::read::EpisodeRow;
use crate::task::{Family, Split};
use crate::trace::Cause;
use crate::words::counted;

/// What the episodes so far said of their tasks.
#[derive(Default)]
pub(crate) struct EpisodeCheck {
    /// By task id: split and text.
    tasks: BTreeMap<String, (String, String)>,
    /// By task text: split.
    splits: BTreeMap<String, String>,
    data_places: BTreeSet<FilePlace>,
}

impl EpisodeCheck {
    /// The files of frames that episodes name.
    pub(crate) fn data_places(&self) -> &BTreeSet<FilePlace> {
        &self.data_places
    }

    pub(crate) fn check(&mut self, path: &Path, row: &EpisodeRow, n_slots: usize, validation: &mut Validation) {
        let place = || format!("episode {}", row.episode_index);
        for problem in problems_of(row, n_slots) {
            validation.error("episodes.value", path, place(), problem);
        }
        let is_hash =
            row.recording_sha256.len() == 64 && row.recording_sha256.bytes().all(|byte| byte.is_ascii_hexdigit());
        if !is_hash {
            let message =
                format!("recording_sha256 is {:?}: the recording cannot be found again", row.recording_sha256);
            validation.warn("episodes.recording", path, place(), message);
        }
        for problem in self.leaks(row) {
            validation.error("split.leak", path, place(), problem);
        }
        if let Some(problem) = &row.copies_problem {
            validation.error("episodes.value", path, place(), problem.clone());
        }
        self.data_places.insert(row.data);
    }

    fn leaks(&mut self, row: &EpisodeRow) -> Vec<String> {
        let mut leaks = Vec::new();
        let known = self.tasks.get(&row.task_id);
        if let Some((split, _)) = known.filter(|(split, _)| *split != row.split) {
            leaks.push(format!("task {:?} is {} here and {split} before", row.task_id, row.split));
        }
        if let Some((_, text)) = known.filter(|(_, text)| *text != row.task_text) {
            leaks.push(format!("task {:?} is {:?} here and {text:?} before", row.task_id, row.task_text));
        }
        if known.is_none() {
            self.tasks.insert(row.task_id.clone(), (row.split.clone(), row.task_text.clone()));
        }
        match self.splits.get(&row.task_text) {
            None => {
                self.splits.insert(row.task_text.clone(), row.split.clone());
            }
            Some(split) if *split != row.split && leaks.is_empty() => {
                leaks.push(format!("the task {:?} is {} here and {split} before", row.task_text, row.split));
            }
            Some(_) => {}
        }
        leaks
    }
}

fn problems_of(row: &EpisodeRow, n_slots: usize) -> Vec<String> {
    let mut problems = Vec::new();
    problems.extend(row.family.parse::<Family>().err().map(|error| error.to_string()));
    problems.extend(row.split.parse::<Split>().err().map(|error| error.to_string()));
    if !["episode", "demonstration"].contains(&row.specification.as_str()) {
        problems.push(format!("specification is {:?}; allowed: episode, demonstration", row.specification));
    }
    if row.specification == "episode" && row.specification_frames != row.n_frames {
        let (found, expected) = (row.specification_frames, row.n_frames);
        problems.push(format!("specification_frames is {found}, but the episode is its own and has {expected}"));
    }
    if row.slots.len() != n_slots {
        problems.push(format!("it names {}, but observations have {n_slots}", counted(row.slots.len(), "slot")));
    }
    let cause = row.cause.as_deref();
    let outcome = cause.unwrap_or("success");
    if row.is_success != cause.is_none() || row.outcome != outcome {
        let (success, found) = (row.is_success, &row.outcome);
        problems.push(format!("success {success}, outcome {found:?} and cause {cause:?} do not go together"));
    }
    if let Some(unknown) = cause.filter(|cause| Cause::from_name(cause).is_none()) {
        problems.push(format!("unknown cause {unknown:?}; causes are {}", Cause::ALL.map(Cause::name).join(", ")));
    }
    problems
}
