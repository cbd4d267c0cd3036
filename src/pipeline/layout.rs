//! Where everything lies under a run directory.

use std::path::{Component, Path, PathBuf};

use crate::artifact::StageDir;
use crate::pipeline::ModelSpec;
use crate::pipeline::Stage;
use crate::trace::SpecificationForm;

/// The folders of its stages.
pub(super) const FOLDERS: [&str; 6] = ["tasks", "recordings", "dataset", "models", "rollouts", "report"];

/// A run directory.
#[derive(Clone, Debug)]
pub struct RunDir {
    root: PathBuf,
    /// The run directory of the study that it is part of.
    study: Option<PathBuf>,
    /// Whether files of stages may lie elsewhere.
    has_files_elsewhere: bool,
}

impl RunDir {
    /// The run directory at `root`; nothing is read or written.
    pub fn new(root: impl Into<PathBuf>) -> Self {
        Self { root: root.into(), study: None, has_files_elsewhere: false }
    }

    /// The same where plans, receipts and manifests lie, and other files of its stages may lie elsewhere.
    #[must_use]
    pub fn with_files_elsewhere(self) -> Self {
        Self { has_files_elsewhere: true, ..self }
    }

    /// Where it is.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// The run directory of an experiment of a study.
    pub fn experiment(&self, name: &str) -> Self {
        let has_files_elsewhere = self.has_files_elsewhere;
        Self { root: self.root.join(name), study: Some(self.root.clone()), has_files_elsewhere }
    }

    /// The run directory of the study that an experiment is part of; its own for anything else.
    pub(super) fn of_study(&self) -> Self {
        let root = self.study.as_ref().unwrap_or(&self.root).clone();
        Self { root, study: None, has_files_elsewhere: self.has_files_elsewhere }
    }

    fn stage(&self, stage: Stage, folder: &str) -> StageDir {
        let dir = StageDir::new(stage.name(), self.root.join(folder));
        if self.has_files_elsewhere { dir.with_files_elsewhere() } else { dir }
    }

    /// `tasks/tasks.json`.
    pub fn tasks(&self) -> StageDir {
        self.stage(Stage::Tasks, "tasks")
    }

    /// `recordings/*.mcap`.
    pub fn recordings(&self) -> StageDir {
        self.stage(Stage::Generate, "recordings")
    }

    /// `dataset/`: a LeRobotDataset with plan and manifest.
    pub fn dataset(&self) -> StageDir {
        self.stage(Stage::Convert, "dataset")
    }

    /// `models/<variant>[-instructions][-<tag>][-tasks<n>]-seed<k>/`.
    pub fn model(&self, name: &str) -> StageDir {
        self.stage(Stage::Train, &format!("models/{name}"))
    }

    /// The folder of a stage of this run or another, by its path from this one's.
    pub(super) fn at(&self, stage: Stage, path: &Path) -> StageDir {
        let mut folder = self.root.clone();
        for part in path.components() {
            match part {
                Component::CurDir => {}
                // Of a path that ends in a name, so that the folder is found under the name that it was made by.
                Component::ParentDir if matches!(folder.components().next_back(), Some(Component::Normal(_))) => {
                    folder.pop();
                }
                other => folder.push(other),
            }
        }
        StageDir::new(stage.name(), folder)
    }

    /// `rollouts/<model>-<decoder>/<suite>/`, or `rollouts/oracle/<suite>/`.
    pub fn rollouts(&self, actor: &str, suite: &str) -> StageDir {
        self.stage(Stage::Rollout, &format!("rollouts/{actor}/{suite}"))
    }

    /// `report/`.
    pub fn report(&self) -> StageDir {
        self.stage(Stage::Report, "report")
    }
}

/// The folder name of a trained model.
pub(super) fn model_name(spec: &ModelSpec, seed: u64) -> String {
    let specification = match spec.specification() {
        SpecificationForm::Trajectories | SpecificationForm::Video => String::new(),
        form @ SpecificationForm::Instructions => format!("-{form}"),
    };
    let tasks = spec.train_tasks.map(|tasks| format!("-tasks{tasks}")).unwrap_or_default();
    let tag = spec.tag.as_ref().map(|tag| format!("-{tag}")).unwrap_or_default();
    format!("{}{specification}{tag}{tasks}-seed{seed}", spec.variant)
}
