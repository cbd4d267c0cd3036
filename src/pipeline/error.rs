//! Why a pipeline could not be loaded or run.

use std::path::PathBuf;

use crate::artifact::{ContractError, IoError, LockError};
use crate::dataset::{ConvertError, DatasetError};
use crate::feature::NotBuiltIn;
use crate::model::{DeviceError, ModelError};
use crate::recording::RecordingError;
#[cfg(feature = "report")]
use crate::report::ReportError;
use crate::rollout::RolloutError;
use crate::sim::SimError;
use crate::store::StoreError;
use crate::table::TableError;
use crate::task::{ImportError, SampleError, TaskFileError, TaskSetError};
use crate::trace::TraceError;
use crate::training::TrainError;
use crate::video::VideoError;

/// Why a pipeline could not be loaded or run.
#[derive(Debug, thiserror::Error)]
pub enum PipelineError {
    /// The file is not a pipeline: an unknown key, a wrong type.
    #[error("{}: {message}", path.display())]
    Syntax {
        /// The pipeline file.
        path: PathBuf,
        /// What the parser says, with line, column and what is allowed.
        message: String,
    },
    /// A value is of the right type but not allowed.
    #[error("{}: {key}: {problem}", path.display())]
    Value {
        /// The pipeline file.
        path: PathBuf,
        /// The key, dotted.
        key: String,
        /// What is wrong and what is allowed.
        problem: String,
    },
    /// What several items read cannot be read.
    #[error("{0}")]
    Inputs(String),
    /// Ctrl-C.
    #[error("interrupted; the same command carries on")]
    Interrupted,
    #[expect(missing_docs, reason = "wraps an error that documents itself")]
    #[error(transparent)]
    Io(#[from] IoError),
    #[expect(missing_docs, reason = "wraps an error that documents itself")]
    #[error(transparent)]
    Store(#[from] StoreError),
    #[expect(missing_docs, reason = "wraps an error that documents itself")]
    #[error(transparent)]
    Video(#[from] VideoError),
    #[expect(missing_docs, reason = "wraps an error that documents itself")]
    #[error(transparent)]
    Contract(#[from] ContractError),
    #[expect(missing_docs, reason = "wraps an error that documents itself")]
    #[error(transparent)]
    Lock(#[from] LockError),
    #[expect(missing_docs, reason = "wraps an error that documents itself")]
    #[error(transparent)]
    Sample(#[from] SampleError),
    #[expect(missing_docs, reason = "wraps an error that documents itself")]
    #[error(transparent)]
    Import(#[from] ImportError),
    #[expect(missing_docs, reason = "wraps an error that documents itself")]
    #[error(transparent)]
    TaskSet(#[from] TaskSetError),
    #[expect(missing_docs, reason = "wraps an error that documents itself")]
    #[error(transparent)]
    TaskFile(#[from] TaskFileError),
    #[expect(missing_docs, reason = "wraps an error that documents itself")]
    #[error(transparent)]
    Sim(#[from] SimError),
    #[expect(missing_docs, reason = "wraps an error that documents itself")]
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// A world or policy broke a rule of traces.
    #[error("{task_id}, trial {trial}: {source}")]
    Trace {
        /// The task.
        task_id: String,
        /// The trial.
        trial: u32,
        /// The rule.
        source: TraceError,
    },
    /// A suite's episodes cannot be acted.
    #[error("{unit}: {source}")]
    Rollout {
        /// What was under way.
        unit: String,
        /// Why not.
        source: RolloutError,
    },
    #[expect(missing_docs, reason = "wraps an error that documents itself")]
    #[error(transparent)]
    Recording(#[from] RecordingError),
    #[expect(missing_docs, reason = "wraps an error that documents itself")]
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    #[expect(missing_docs, reason = "wraps an error that documents itself")]
    #[error(transparent)]
    Convert(#[from] ConvertError),
    #[expect(missing_docs, reason = "wraps an error that documents itself")]
    #[error(transparent)]
    Model(#[from] ModelError),
    #[expect(missing_docs, reason = "wraps an error that documents itself")]
    #[error(transparent)]
    Train(#[from] TrainError),
    #[expect(missing_docs, reason = "wraps an error that documents itself")]
    #[error(transparent)]
    Table(#[from] TableError),
    #[cfg(feature = "report")]
    #[expect(missing_docs, reason = "wraps an error that documents itself")]
    #[error(transparent)]
    Report(#[from] ReportError),
    #[expect(missing_docs, reason = "wraps an error that documents itself")]
    #[error(transparent)]
    NotBuiltIn(#[from] NotBuiltIn),
    /// A model that sees cannot look at an episode.
    #[error("suite {suite}, episode {episode} (task {task_id}), camera {camera}: {source}")]
    Sight {
        /// The suite.
        suite: String,
        /// Its episode.
        episode: u64,
        /// The task.
        task_id: String,
        /// The camera's name.
        camera: String,
        /// Why not.
        source: Box<VideoError>,
    },
    /// The expert could not demonstrate a task for a suite.
    #[error("suite {suite}: the expert failed all {attempts} attempts to demonstrate {task_id}")]
    NoDemonstration {
        /// The suite.
        suite: String,
        /// The task.
        task_id: String,
        /// How often it was tried.
        attempts: u64,
    },
}

impl PipelineError {
    /// Whether the command or the pipeline file is at fault, and nothing was written.
    pub fn is_usage(&self) -> bool {
        match self {
            Self::Syntax { .. } | Self::Value { .. } | Self::NotBuiltIn(_) => true,
            Self::Contract(error) => matches!(error, ContractError::OtherPlan { .. }),
            Self::Device(error) => error.is_usage(),
            Self::Store(error) => error.is_usage(),
            _ => false,
        }
    }
}
