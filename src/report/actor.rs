//! Who acted: a model by its name and its parts, and what else tells it apart.

use schemars::JsonSchema;
use serde::Serialize;

use crate::report::order::DECODERS;
use crate::trace::SpecificationForm;

/// The parts of a network. Null for an oracle, and where they were not written down.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
pub struct ModelParts {
    /// How it remembers the steps of a program call: `reactive` (not at all), `gru` or `lstm`.
    pub core: Option<String>,
    /// What it decides of the task specification: `scoped`, `unscoped`, `primitives` or `arguments`.
    pub scoping: Option<String>,
    /// How it reads observations.
    pub encoder: Option<String>,
}

/// Who acts: what tells models apart but for the seed of their training.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
pub struct Actor {
    /// Of which experiment: a pipeline file's name.
    pub experiment: String,
    /// The model's variant: its name.
    pub variant: String,
    /// Its parts.
    #[serde(flatten)]
    pub parts: ModelParts,
    /// What tells it apart from other models of its variant; null for most.
    pub tag: Option<String>,
    /// How many tasks it was trained on; null for an oracle.
    pub train_tasks: Option<i64>,
    /// What a demonstration is given as; null for an oracle.
    pub specification: Option<String>,
    /// How scopes are decoded; null for an oracle.
    pub decoder: Option<String>,
}

impl Actor {
    /// The variant, the form of its task specification where it is not the paper's, and its tag.
    pub(super) fn model(&self) -> String {
        model_name(&self.variant, self.specification.as_deref().unwrap_or_default(), self.tag.as_deref())
    }

    /// Whether it stands for its variant in the paper's figures and claims: told by a demonstration what to do, as all
    /// of the paper's models are, and not trained otherwise on purpose.
    pub(super) fn is_the_papers(&self) -> bool {
        self.is_demonstrated() && self.tag.is_none()
    }

    /// Whether it is told by a demonstration what to do.
    pub(super) fn is_demonstrated(&self) -> bool {
        self.specification.as_deref() != Some(SpecificationForm::Instructions.name())
    }

    /// The model in a few words, and what else tells it apart.
    pub(super) fn words(&self) -> String {
        let tasks = self.train_tasks.map(|tasks| format!(" {tasks}"));
        let decoder = self.decoder.as_deref().filter(|decoder| *decoder != DECODERS[0]).map(|name| format!(" {name}"));
        format!("{}{}{}", self.model(), tasks.unwrap_or_default(), decoder.unwrap_or_default())
    }

    /// Whether it repeats the expert and was not trained.
    pub(super) fn is_oracle(&self) -> bool {
        self.train_tasks.is_none()
    }

    /// Which other rows differ in their training tasks and decoder alone.
    pub(super) fn is_same_model(&self, other: &Self) -> bool {
        (&self.experiment, self.model()) == (&other.experiment, other.model())
    }
}

/// A variant's name, the form of its task specification where it is not the paper's, and its tag.
pub(super) fn model_name(variant: &str, specification: &str, tag: Option<&str>) -> String {
    let tag = tag.map(|tag| format!(" ({tag})")).unwrap_or_default();
    match specification {
        form if form == SpecificationForm::Instructions.name() => format!("{variant} by {form}{tag}"),
        _ => format!("{variant}{tag}"),
    }
}
