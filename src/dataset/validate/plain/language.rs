//! Language columns: what lasts is the same in every row of its episode and of a known style; what happens is too.

use arrow::array::{Array as _, ArrayRef, AsArray as _};

use crate::dataset::plain::{Declared, list_at, numbers, texts};
use crate::dataset::validate::plain::run::Run;

/// Styles of what lasts, and of what happens at a frame.
const LASTING: [&str; 5] = ["subtask", "plan", "memory", "motion", "task_aug"];
const HAPPENING: [&str; 3] = ["interjection", "vqa", "trace"];

/// What is wrong first, and in which row.
pub(super) fn check_language(
    feature: &Declared,
    column: &ArrayRef,
    runs: &[Run],
) -> Option<(&'static str, usize, String)> {
    let is_lasting = feature.name == "language_persistent";
    if !is_lasting && feature.name != "language_events" {
        let problem = "only language_persistent and language_events are of this type".to_owned();
        return Some(("info.features", 0, problem));
    }
    for run in runs {
        let first = list_at(column, run.rows.start);
        for row in run.rows.clone() {
            let Some(list) = list_at(column, row) else { continue };
            let is_first = row == run.rows.start;
            if is_lasting && !is_first && Some(&list) != first.as_ref() {
                let problem = "it is not the same in every frame of the episode".to_owned();
                return Some(("frames.language", row, problem));
            }
            if (!is_lasting || is_first)
                && !list.is_empty()
                && let Some(problem) = entries_problem(&list, is_lasting)
            {
                return Some(("frames.language", row, problem));
            }
        }
    }
    None
}

fn entries_problem(list: &ArrayRef, is_lasting: bool) -> Option<String> {
    let Some(entries) = list.as_struct_opt() else {
        return Some(format!("its entries are {}, but should have role, content and style", list.data_type()));
    };
    let batch = arrow::array::RecordBatch::from(entries.clone());
    let column = |name: &str| texts(&batch, name);
    let (Some(_), Some(_), Some(styles)) = (column("role"), column("content"), column("style")) else {
        return Some("an entry has no role, content or style".to_owned());
    };
    let allowed: &[&str] = if is_lasting { &LASTING } else { &HAPPENING };
    if let Some(style) = styles.iter().find(|style| !style.is_empty() && !allowed.contains(&style.as_str())) {
        return Some(format!("style is {style:?}; allowed: {}", allowed.join(", ")));
    }
    if is_lasting {
        let Some(times) = numbers(&batch, "timestamp") else {
            return Some("an entry has no timestamp".to_owned());
        };
        if let Some(time) = times.iter().find(|time| !(time.is_finite() && **time >= 0.0)) {
            return Some(format!("an entry begins at {time} s"));
        }
    }
    None
}
