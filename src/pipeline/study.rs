//! A study: experiments that are run one after the other and told of in one report.
//!
//! # Input and output
//!
//! A TOML file (schemas/study.schema.json) that names pipeline files in place of tasks. Each runs in a folder of its
//! name under the study's run directory, exactly as it would by itself; the combined report lies beside them. So do the
//! study's own models, each of which learns from several experiments at once; what they act lies with each experiment.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::model::EncoderKind;
use crate::pipeline::layout::model_name;
use crate::pipeline::resolve::{check_decoders, check_name, parse, read_text};
use crate::pipeline::{ModelSpec, Pipeline, PipelineError, ReportSpec, RunDir};
use crate::trace::SpecificationForm;

/// Experiments that belong together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StudySpec {
    /// Names the run's folder: letters, digits, `_` and `-`.
    pub name: String,
    /// Pipeline files, relative to this one; run in this order.
    pub experiments: Vec<String>,
    /// Models that learn from several of the experiments together.
    #[serde(default)]
    pub models: Vec<ModelSpec>,
    /// How the results are shown.
    #[serde(default)]
    pub report: ReportSpec,
}

/// A checked study.
#[derive(Clone, Debug)]
pub struct Study {
    /// The file it was read from.
    pub path: PathBuf,
    /// Its settings.
    pub spec: StudySpec,
    /// Its experiments, each with a name of its own.
    pub experiments: Vec<Pipeline>,
}

/// What a TOML file describes.
#[derive(Clone, Debug)]
pub enum PipelineFile {
    /// One experiment.
    Experiment(Box<Pipeline>),
    /// Several.
    Study(Study),
}

/// Folders of the study itself, which no experiment may be named after.
const REPORT: &str = "report";
const MODELS: &str = "models";

impl PipelineFile {
    /// Reads and checks a file: it is a study if it has the key `experiments`.
    ///
    /// # Errors
    ///
    /// As [`Pipeline::load`] and [`Study::load`].
    pub fn load(path: &Path) -> Result<Self, PipelineError> {
        if is_study(path)? {
            return Ok(Self::Study(Study::load(path)?));
        }
        Ok(Self::Experiment(Box::new(Pipeline::load(path)?)))
    }

    /// Its experiments, each with its run directory: that of the whole for one by itself.
    pub fn experiments(&self, run: &RunDir) -> Vec<(&Pipeline, RunDir)> {
        match self {
            Self::Experiment(pipeline) => vec![(pipeline, run.clone())],
            Self::Study(study) => {
                study.experiments.iter().map(|pipeline| (pipeline, run.experiment(&pipeline.spec.name))).collect()
            }
        }
    }

    /// The file that it was read from.
    pub fn path(&self) -> &Path {
        match self {
            Self::Experiment(pipeline) => &pipeline.path,
            Self::Study(study) => &study.path,
        }
    }

    /// What names its run directory.
    pub fn name(&self) -> &str {
        match self {
            Self::Experiment(pipeline) => &pipeline.spec.name,
            Self::Study(study) => &study.spec.name,
        }
    }
}

impl Study {
    /// Reads and checks a study and all of its experiments.
    ///
    /// # Errors
    ///
    /// [`PipelineError::Syntax`] or [`PipelineError::Value`], which name file, key and what is allowed.
    pub fn load(path: &Path) -> Result<Self, PipelineError> {
        let spec: StudySpec = parse(path)?;
        check_name(path, "name", &spec.name)?;
        if spec.experiments.is_empty() {
            return Err(value(path, "experiments", "is empty; at least one pipeline file is needed".to_owned()));
        }
        let mut experiments: Vec<Pipeline> = Vec::new();
        for (idx, file) in spec.experiments.iter().enumerate() {
            let key = format!("experiments[{idx}]");
            let experiment = load_experiment(path, &key, file)?;
            let name = &experiment.spec.name;
            if name == MODELS && !spec.models.is_empty() {
                let problem = format!("{file} is named {name:?}, which is the folder of the study's own models");
                return Err(value(path, &key, problem));
            }
            if name == REPORT {
                let problem = format!("{file} is named {name:?}, which is the folder of the study's own report");
                return Err(value(path, &key, problem));
            }
            if let Some(other) = experiments.iter().position(|other| other.spec.name == *name) {
                let problem = format!("{file} is named {name:?} like {}; names must differ", spec.experiments[other]);
                return Err(value(path, &key, problem));
            }
            experiments.push(experiment);
        }
        let study = Self { path: path.to_owned(), spec, experiments };
        study.check_models()?;
        Ok(study)
    }

    /// The experiments that one of its own models learns from.
    pub(super) fn learned_by(&self, model: &ModelSpec) -> impl Iterator<Item = &Pipeline> {
        let names = model.experiments.clone();
        self.experiments.iter().filter(move |pipeline| names.contains(&pipeline.spec.name))
    }

    /// Whether one of its own models can act the tasks of an experiment: it knows the root program, and reads as many slots.
    pub(super) fn can_act(&self, model: &ModelSpec, pipeline: &Pipeline) -> bool {
        let family = pipeline.spec.tasks.family;
        let mut learned = self.learned_by(model).map(|own| own.spec.tasks.family);
        let knows = |own: crate::task::Family| {
            let reads_slots = model.encoder() == EncoderKind::ObjectCentric || own.n_slots() == family.n_slots();
            reads_slots && (model.training.shared_root || own.root_program() == family.root_program())
        };
        learned.any(knows)
    }

    fn check_models(&self) -> Result<(), PipelineError> {
        let mut names: Vec<String> = Vec::new();
        for pipeline in &self.experiments {
            for model in &pipeline.spec.models {
                names.extend(model.seeds.iter().map(|&seed| model_name(model, seed)));
            }
        }
        for (idx, model) in self.spec.models.iter().enumerate() {
            let refuse =
                |field: &str, problem: String| Err(value(&self.path, &format!("models[{idx}]{field}"), problem));
            if let Some(tag) = &model.tag {
                check_name(&self.path, &format!("models[{idx}].tag"), tag)?;
            }
            self.check_learning(idx, model)?;
            check_decoders(&self.path, idx, model)?;
            for &seed in &model.seeds {
                let name = model_name(model, seed);
                if names.contains(&name) {
                    return refuse(
                        "",
                        format!("{name} is there twice, here or in an experiment; a tag tells them apart"),
                    );
                }
                names.push(name);
            }
            if let Err(problem) = model.training(model.seeds.first().copied().unwrap_or_default()).check() {
                return refuse(".training", problem.to_string());
            }
            let acted = self.experiments.iter().filter(|pipeline| self.can_act(model, pipeline));
            let suites: Vec<&str> =
                acted.flat_map(|pipeline| &pipeline.spec.rollout.suites).map(|suite| suite.name.as_str()).collect();
            if let Some(name) = model.suites.iter().flatten().find(|name| !suites.contains(&name.as_str())) {
                return refuse(
                    ".suites",
                    format!("{name:?} is no suite that it can act; there are {}", suites.join(", ")),
                );
            }
        }
        Ok(())
    }

    /// What one of its own models learns from.
    fn check_learning(&self, idx: usize, model: &ModelSpec) -> Result<(), PipelineError> {
        let refuse = |field: &str, problem: String| Err(value(&self.path, &format!("models[{idx}].{field}"), problem));
        let known: Vec<&str> = self.experiments.iter().map(|pipeline| pipeline.spec.name.as_str()).collect();
        if model.experiments.is_empty() {
            return refuse("experiments", format!("is empty; allowed are {}", known.join(", ")));
        }
        for (position, name) in model.experiments.iter().enumerate() {
            if !known.contains(&name.as_str()) {
                return refuse("experiments", format!("{name:?} is no experiment; there are {}", known.join(", ")));
            }
            if model.experiments[..position].contains(name) {
                return refuse("experiments", format!("{name:?} is there twice"));
            }
        }
        if !model.variant.reads_any_family() {
            let allowed = "allowed are variants that read positions and a demonstration of them";
            return refuse("variant", format!("is {}; {allowed}", model.variant));
        }
        if model.cameras.is_some() {
            return refuse("cameras", "is of models that see; a study's own read positions".to_owned());
        }
        if model.specification() == SpecificationForm::Instructions {
            let problem = "is instructions, whose words name other slots in each family; allowed is trajectories";
            return refuse("specification", problem.to_owned());
        }
        if model.seeds.is_empty() {
            return refuse("seeds", "is empty; at least one is needed".to_owned());
        }
        let most = self.learned_by(model).map(|pipeline| pipeline.spec.tasks.train).max().unwrap_or_default();
        match model.train_tasks.filter(|&tasks| tasks == 0 || tasks > most) {
            Some(tasks) => {
                refuse("train_tasks", format!("is {tasks}; allowed is 1 to {most}, the most of an experiment"))
            }
            None => Ok(()),
        }
    }

    /// The title of the combined report.
    pub(super) fn title(&self) -> &str {
        self.spec.report.title.as_deref().unwrap_or(&self.spec.name)
    }
}

fn is_study(path: &Path) -> Result<bool, PipelineError> {
    let table = read_text(path)?.parse::<toml::Table>();
    Ok(table.is_ok_and(|table| table.contains_key("experiments")))
}

fn load_experiment(study: &Path, key: &str, file: &str) -> Result<Pipeline, PipelineError> {
    let path = study.parent().unwrap_or(Path::new("")).join(file);
    if !path.is_file() {
        return Err(value(study, key, format!("no such file: {}", path.display())));
    }
    // Looked at before it is read: a study may name itself.
    if is_study(&path)? {
        return Err(value(study, key, format!("{} is a study; allowed are files of one experiment", path.display())));
    }
    Pipeline::load(&path)
}

fn value(path: &Path, key: &str, problem: String) -> PipelineError {
    PipelineError::Value { path: path.to_owned(), key: key.to_owned(), problem }
}
