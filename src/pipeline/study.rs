//! A study: experiments that are run one after the other and told of in one report.
//!
//! # Input and output
//!
//! A TOML file (schemas/study.schema.json) that names pipeline files in place of tasks. Each runs in a folder of its
//! name under the study's run directory, exactly as it would by itself; the combined report lies beside them.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::pipeline::resolve::{check_name, parse, read_text};
use crate::pipeline::{Pipeline, PipelineError, ReportSpec, RunDir};

/// Experiments that belong together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StudySpec {
    /// Names the run's folder: letters, digits, `_` and `-`.
    pub name: String,
    /// Pipeline files, relative to this one; run in this order.
    pub experiments: Vec<String>,
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

/// The combined report's folder, which no experiment may be named after.
const REPORT: &str = "report";

impl PipelineFile {
    /// Reads and checks a file: it is a study if it has the key `experiments`.
    ///
    /// # Errors
    ///
    /// As [`Pipeline::load`] and [`Study::load`].
    pub fn load(path: &Path) -> Result<Self, PipelineError> {
        let table = read_text(path)?.parse::<toml::Table>();
        if table.is_ok_and(|table| table.contains_key("experiments")) {
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
        Ok(Self { path: path.to_owned(), spec, experiments })
    }

    /// The title of the combined report.
    pub(super) fn title(&self) -> &str {
        self.spec.report.title.as_deref().unwrap_or(&self.spec.name)
    }
}

fn load_experiment(study: &Path, key: &str, file: &str) -> Result<Pipeline, PipelineError> {
    let path = study.parent().unwrap_or(Path::new("")).join(file);
    if !path.is_file() {
        return Err(value(study, key, format!("no such file: {}", path.display())));
    }
    match PipelineFile::load(&path)? {
        PipelineFile::Experiment(pipeline) => Ok(*pipeline),
        PipelineFile::Study(_) => {
            Err(value(study, key, format!("{} is a study; allowed are files of one experiment", path.display())))
        }
    }
}

fn value(path: &Path, key: &str, problem: String) -> PipelineError {
    PipelineError::Value { path: path.to_owned(), key: key.to_owned(), problem }
}
