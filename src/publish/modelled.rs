//! What `ntp/annotation.json` tells of labels that models made, in words.

use std::path::Path;

use serde::Serialize;
use serde_json::Value;

use crate::annotate::{ANNOTATION, Measured};
use crate::artifact::IoError;
use crate::dataset::AnnotationTold;
use crate::words::counted;

/// Labels that models made.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(super) struct Modelled {
    /// The models in words.
    models: String,
    /// The day, or nothing.
    day: String,
    /// How well the labels agreed with true ones.
    measured: String,
    /// How many episodes have labels of others, or of nobody.
    n_others: u64,
    /// How many episodes are listed as doubtful, where they are listed.
    n_doubtful: Option<usize>,
}

impl Modelled {
    /// What is told of a dataset of so many episodes; nothing where no model made its labels.
    pub(super) fn of(dataset: &Path, n_episodes: u64) -> Result<Option<Self>, IoError> {
        let Some(told) = AnnotationTold::of(dataset)? else { return Ok(None) };
        let measured = told.others.get("measured").cloned().map(serde_json::from_value::<Measured>).transpose();
        let measured = measured.map_err(|source| IoError::Json { path: dataset.join(ANNOTATION), source })?;
        Ok(Some(Self {
            models: told.models_in_words(),
            day: told.others.get("date").and_then(Value::as_str).map(|day| format!(" on {day}")).unwrap_or_default(),
            measured: measured.map_or_else(
                || "Their accuracy was not measured.".to_owned(),
                |measured| measured_in_words(&measured, n_episodes),
            ),
            n_others: told.episodes_of_others.len() as u64,
            n_doubtful: told.doubtful.as_ref().map(Vec::len),
        }))
    }

    pub(super) fn names(&self) -> &str {
        &self.models
    }

    /// Where the labels are from, and then what else there is to say of them.
    pub(super) fn words(&self, further: &str) -> String {
        let Self { models, day, measured, n_others, n_doubtful } = self;
        let others = match n_others {
            0 => String::new(),
            n => format!(" Of {}, the files do not tell who annotated them.", counted(*n, "other episode")),
        };
        let doubtful = n_doubtful.map_or_else(String::new, |n| {
            format!(" `{ANNOTATION}` lists {} with the reasons.", counted(n as u64, "doubtful episode"))
        });
        format!(
            "These labels are predictions: the model {models} made them of the demonstrations{day}. Nobody has drawn or \
             checked them by hand.{others} {measured}{further}{doubtful}"
        )
    }

    /// What they are not good for.
    pub(super) fn limit(&self) -> String {
        format!("The labels are a model's. {}", self.measured)
    }
}

/// A measurement in a sentence, of a dataset that has so many episodes now.
fn measured_in_words(measured: &Measured, n_episodes: u64) -> String {
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    let subtasks = measured.levels.get("sub_task").cloned().unwrap_or_default();
    let f1 = subtasks.boundary_f1.get("0.5").copied().unwrap_or(0.0);
    let episodes = counted(measured.episodes, "episode");
    let of_what = if n_episodes < measured.episodes { "of which a part is here" } else { "all that were compared" };
    let of_what = if n_episodes == measured.episodes { episodes } else { format!("{episodes}, {of_what}") };
    format!(
        "Measured against the labels of `{}` ({of_what}): {} of its calls were found with the right program and frames; of its \
         sub-tasks {} of the frames were right, and the F1 of boundaries within 0.5 s was {f1:.3}.",
        measured.truth,
        percent(measured.call_accuracy()),
        percent(subtasks.frame_accuracy)
    )
}
