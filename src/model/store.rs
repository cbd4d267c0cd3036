//! A model's folder: `config.json` and `model.safetensors`.
//!
//! # Errors
//!
//! A folder that does not fit (another vocabulary, another number of slots, weights of other shapes) is refused with
//! its path; nothing is loaded in part.

use std::path::{Path, PathBuf};

use burn::module::{Module, ModuleVisitor, Param};
use burn::store::{ModuleSnapshot as _, ModuleStore as _, SafetensorsStore};
use burn::tensor::{DType, Device, Tensor};
use serde::Serialize;

use crate::artifact::{self, IoError};
use crate::model::build::{NetworkUse, build};
use crate::model::config::ModelConfig;
use crate::model::layers::Init;
use crate::model::limits::ConfigError;
use crate::model::network::Network;
use crate::model::values::values;
use crate::program::KnownPrograms;

/// Name of the resolved configuration in a model's folder.
pub const CONFIG_FILE: &str = "config.json";
/// Name of the weights in a model's folder.
pub const WEIGHTS_FILE: &str = "model.safetensors";

/// A model that cannot be stored or used.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// A file could not be read or written.
    #[error(transparent)]
    Io(#[from] IoError),
    /// `config.json` is of a version that is not known.
    #[error("model configuration has version {found}, this program reads {}: {}", ModelConfig::VERSION, path.display())]
    Version {
        /// As found.
        found: u32,
        /// The file.
        path: PathBuf,
    },
    /// The model knows other programs.
    #[error("model was trained for the program vocabulary {found}, this program has {expected}: {}", path.display())]
    Vocabulary {
        /// Hash in the file.
        found: String,
        /// Hash of this program's.
        expected: String,
        /// The file.
        path: PathBuf,
    },
    /// No network can be made of `config.json`.
    #[error("model configuration cannot be used: {problem}: {}", path.display())]
    Config {
        /// Which key, what was found and what is allowed.
        problem: ConfigError,
        /// The file.
        path: PathBuf,
    },
    /// The model is for other scenes.
    #[error("model is for {field} {found}, but {expected} is asked for: {}", path.display())]
    Purpose {
        /// `variant`, `family`, `specification`, `n_slots`, `pictures` or `cameras`.
        field: &'static str,
        /// As found.
        found: String,
        /// As asked for.
        expected: String,
        /// The file.
        path: PathBuf,
    },
    /// The weights are not those of the configuration.
    #[error("model weights do not fit their configuration: {problem}: {}", path.display())]
    Weights {
        /// Which tensor, what was expected and found.
        problem: String,
        /// The file.
        path: PathBuf,
    },
}

/// The weights as a safetensors file: names in order, no metadata, so the same weights are the same bytes.
///
/// # Errors
///
/// [`ModelError::Weights`] when they cannot be written in that format; `path` is for the message alone.
pub fn weights_to_bytes(network: &impl Module, path: &Path) -> Result<Vec<u8>, ModelError> {
    let problem = |error: &dyn std::fmt::Display| ModelError::Weights { problem: error.to_string(), path: path.into() };
    let mut store = SafetensorsStore::from_bytes(None).clear_metadata();
    network.save_into(&mut store).map_err(|error| problem(&error))?;
    store.get_bytes().map_err(|error| problem(&error))
}

/// Replaces the weights of a network.
///
/// # Errors
///
/// [`ModelError::Weights`] when the bytes are not exactly this network's; `path` is for the message alone.
pub fn weights_from_bytes<M: Module>(mut network: M, bytes: Vec<u8>, path: &Path) -> Result<M, ModelError> {
    match fill(&mut network, bytes).and_then(|()| check_numbers(&network)) {
        Ok(()) => Ok(network),
        Err(problem) => Err(ModelError::Weights { problem, path: path.into() }),
    }
}

/// Fills the parameters of a network, each of them and with nothing left over.
fn fill<M: Module>(network: &mut M, bytes: Vec<u8>) -> Result<(), String> {
    // What is wrong is told below, tensor by tensor.
    let mut store = SafetensorsStore::from_bytes(Some(bytes)).validate(false).allow_partial(true);
    let tensors = store.get_all_tensors().map_err(|error| error.to_string())?;
    if let Some(other) = tensors.values().find(|tensor| tensor.dtype != DType::F32) {
        return Err(format!("tensor {:?} is of {:?}; allowed is F32", other.name, other.dtype));
    }
    let applied = network.load_from(&mut store).map_err(|error| error.to_string())?;
    if let Some(error) = applied.errors.first() {
        return Err(error.to_string());
    }
    if let Some((name, _)) = applied.missing.first() {
        return Err(format!("tensor {name:?} is missing"));
    }
    match applied.unused.first() {
        Some(name) => Err(format!("tensor {name:?} is not one of the network's")),
        None => Ok(()),
    }
}

/// Refuses parameters that are no numbers: whatever is decided by them is decided by default.
fn check_numbers(network: &impl Module) -> Result<(), String> {
    let mut numbers = Numbers { path: Vec::new(), wrong: None };
    network.visit(&mut numbers);
    numbers.wrong.map_or(Ok(()), Err)
}

/// Looks for the first parameter that is no number.
struct Numbers {
    path: Vec<String>,
    wrong: Option<String>,
}

impl ModuleVisitor for Numbers {
    fn enter_module(&mut self, name: &str, _container: &str) {
        self.path.push(name.to_owned());
    }

    fn exit_module(&mut self, _name: &str, _container: &str) {
        self.path.pop();
    }

    fn visit_float<const D: usize>(&mut self, parameter: &Param<Tensor<D>>) {
        let name = || self.path.join(".");
        let wrong = match values(parameter.val()) {
            Err(error) => Some(format!("tensor {:?}: {error}", name())),
            Ok(numbers) => numbers
                .iter()
                .position(|number| !number.is_finite())
                .map(|at| format!("tensor {:?} has {} at {at}; allowed are finite numbers", name(), numbers[at])),
        };
        self.wrong = self.wrong.take().or(wrong);
    }
}

/// Reads and checks `config.json`.
///
/// # Errors
///
/// When it is not there, not readable, of another version or vocabulary, or nothing that a network can be made of.
pub fn load_config(folder: &Path) -> Result<ModelConfig, ModelError> {
    let path = folder.join(CONFIG_FILE);
    let config: ModelConfig = artifact::read_json(&path)?;
    if config.version != ModelConfig::VERSION {
        return Err(ModelError::Version { found: config.version, path });
    }
    if KnownPrograms::of_hash(&config.vocabulary).is_none() {
        return Err(ModelError::Vocabulary { found: config.vocabulary, expected: KnownPrograms::ALL.hash(), path });
    }
    match config.check() {
        Ok(()) => Ok(config),
        Err(problem) => Err(ModelError::Config { problem, path }),
    }
}

/// Refuses a model that was made for something else than what is asked for.
///
/// # Errors
///
/// [`ModelError::Purpose`] for the first field that differs.
pub fn check_purpose(config: &ModelConfig, wanted: &ModelConfig, folder: &Path) -> Result<(), ModelError> {
    let family = if config.acts(wanted.family) { wanted.family.name().to_owned() } else { config.family_names() };
    let n_slots = if config.reads_slots(wanted.n_slots) { wanted.n_slots } else { config.n_slots };
    let fields = [
        ("variant", config.variant.to_string(), wanted.variant.to_string()),
        ("family", family, wanted.family.name().to_owned()),
        ("specification", config.network.specification().to_string(), wanted.network.specification().to_string()),
        ("n_slots", n_slots.to_string(), wanted.n_slots.to_string()),
        ("pictures", pixels(config), pixels(wanted)),
        ("cameras", config.cameras_beside(wanted), wanted.cameras_beside(config)),
    ];
    match fields.into_iter().find(|(_, found, expected)| found != expected) {
        Some((field, found, expected)) => {
            Err(ModelError::Purpose { field, found, expected, path: folder.join(CONFIG_FILE) })
        }
        None => Ok(()),
    }
}

fn pixels(config: &ModelConfig) -> String {
    let Some(pixels) = config.network.pixels() else { return "none".to_owned() };
    let each = format!("of {pixels}x{pixels} pixels");
    match config.network.cameras() {
        0 | 1 => each,
        cameras => format!("{each} from {cameras} cameras"),
    }
}

/// Loads a trained model onto a device for inference and hands its network on.
///
/// # Errors
///
/// As [`load_config`], and when the weights do not fit.
pub fn load<U: NetworkUse>(
    folder: &Path,
    config: &ModelConfig,
    device: &Device,
    wanted: U,
) -> Result<U::Output, ModelError> {
    let path = folder.join(WEIGHTS_FILE);
    let bytes = artifact::read(&path)?;
    let loading = Loading { bytes, path: &path, wanted };
    let mut init = Init::unfilled(device).knowing(config.programs()).sharing_root(config.shared_root);
    build(config, &mut init, loading)
        .unwrap_or_else(|problem| Err(ModelError::Config { problem, path: folder.join(CONFIG_FILE) }))
}

/// Gives a network its stored weights before it is used.
struct Loading<'l, U> {
    bytes: Vec<u8>,
    path: &'l Path,
    wanted: U,
}

impl<U: NetworkUse> NetworkUse for Loading<'_, U> {
    type Output = Result<U::Output, ModelError>;

    fn run<N: Network>(self, network: N) -> Self::Output {
        Ok(self.wanted.run(weights_from_bytes(network, self.bytes, self.path)?))
    }
}

/// What `ntp inspect` says of a model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModelSummary {
    /// How many numbers were learned.
    pub parameters: usize,
    /// Its `config.json`.
    pub config: ModelConfig,
}

/// Reads a model and counts its parameters.
///
/// # Errors
///
/// As [`load`].
pub fn inspect(folder: &Path) -> Result<ModelSummary, ModelError> {
    let config = load_config(folder)?;
    Ok(ModelSummary { parameters: load(folder, &config, &Device::flex(), Parameters)?, config })
}

/// How many numbers were learned.
struct Parameters;

impl NetworkUse for Parameters {
    type Output = usize;

    fn run<N: Network>(self, network: N) -> usize {
        network.num_params()
    }
}
