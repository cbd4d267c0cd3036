//! From a configuration to the network of its type.

use burn::module::ModuleDisplay;
use burn::tensor::Device;

use crate::model::colour_slots::ColourSlots;
use crate::model::config::{ModelConfig, NetworkConfig};
use crate::model::core_kind::CoreKind;
use crate::model::core_network::{Core, GruCore, LstmCore, Reactive};
use crate::model::detecting::Detecting;
use crate::model::detector::{Detector, PointDetector, VggDetector};
use crate::model::encoder::Encoder;
use crate::model::flattened::{FlatEncoder, Flattened};
use crate::model::instructed::Instructed;
use crate::model::keypoints::Keypoints;
use crate::model::layers::Init;
use crate::model::limits::ConfigError;
use crate::model::network::Network;
use crate::model::npi::{BySlot, ByVector, CallEncoder, Npi};
use crate::model::object_centric::ObjectCentric;
use crate::model::programmer::{Ntp, Programmer};
use crate::model::scoping_kind::ScopingKind;
use crate::model::sighted::Sighted;
use crate::model::vectors::Convolved;
use crate::seed::Seed;

/// Something to be done with a network, whatever its type.
pub trait NetworkUse {
    /// What comes of it.
    type Output;

    /// Does it.
    fn run<N: Network>(self, network: N) -> Self::Output;

    /// The same for a network behind a detector, where that makes a difference.
    fn run_detecting<D: Detector, N: Network<Percepts = ()> + ModuleDisplay>(
        self,
        network: Detecting<D, N>,
    ) -> Self::Output
    where
        Self: Sized,
    {
        self.run(network)
    }
}

/// Makes a fresh network as configured and hands it on; the same seed gives the same parameters.
///
/// # Errors
///
/// [`ConfigError`] when no network can be made of the configuration.
pub fn with_network<U: NetworkUse>(
    config: &ModelConfig,
    seed: Seed,
    device: &Device,
    wanted: U,
) -> Result<U::Output, ConfigError> {
    let mut init = Init::new(seed, device).knowing(config.programs()).sharing_root(config.shared_root);
    build(config, &mut init, wanted)
}

/// The same with parameters from anywhere.
pub(super) fn build<U: NetworkUse>(config: &ModelConfig, init: &mut Init, wanted: U) -> Result<U::Output, ConfigError> {
    config.check()?;
    match &config.network {
        NetworkConfig::ObjectCentric(widths) => of_positions::<ObjectCentric, BySlot, U>(config, widths, init, wanted),
        NetworkConfig::Flattened(widths) => of_positions::<Flattened, ByVector, U>(config, widths, init, wanted),
        NetworkConfig::Instructed(widths) => {
            let scoping = config.variant.scoping();
            Ok(wanted.run(Ntp::<Instructed>::drawn(scoping, widths, config.n_slots, init)))
        }
        NetworkConfig::ColourSlots(widths) => end_to_end::<Sighted<ColourSlots>, U>(config, widths, init, wanted),
        NetworkConfig::Convolved(widths) => end_to_end::<FlatEncoder<Convolved>, U>(config, widths, init, wanted),
        NetworkConfig::Keypoints(widths) => end_to_end::<Sighted<Keypoints>, U>(config, widths, init, wanted),
        NetworkConfig::Detected(detector, widths) => {
            behind::<PointDetector, ObjectCentric, U>(config, detector, widths, init, wanted)
        }
        NetworkConfig::DetectedFlattened(detector, widths) => {
            behind::<VggDetector, Flattened, U>(config, detector, widths, init, wanted)
        }
    }
}

/// A network that reads positions; `P` reads them where there is no specification.
fn of_positions<E: Encoder, P: CallEncoder<Config = E::Config>, U: NetworkUse>(
    config: &ModelConfig,
    widths: &E::Config,
    init: &mut Init,
    wanted: U,
) -> Result<U::Output, ConfigError> {
    match config.variant.scoping() {
        ScopingKind::Arguments => Ok(wanted.run(Npi::<P>::drawn(widths, config.n_slots, config.tasks.len(), init))),
        ScopingKind::Scoped | ScopingKind::Unscoped | ScopingKind::Primitives => {
            of_core::<E, _>(config, widths, init, Alone(wanted))
        }
    }
}

/// A network that learns from pictures by the losses of programs alone: its core has no memory.
fn end_to_end<E: Encoder, U: NetworkUse>(
    config: &ModelConfig,
    widths: &E::Config,
    init: &mut Init,
    wanted: U,
) -> Result<U::Output, ConfigError> {
    match config.variant.core() {
        CoreKind::Reactive => of_scoping::<E, Reactive, _>(config, widths, init, Alone(wanted)),
        CoreKind::Gru | CoreKind::Lstm => Err(never_together(config)),
    }
}

/// A detector with a network behind it. The two draw from one beginning, so that no parameters share an id.
fn behind<D: Detector, E: Encoder<Percepts = ()>, U: NetworkUse>(
    config: &ModelConfig,
    detector: &D::Config,
    widths: &E::Config,
    init: &mut Init,
    wanted: U,
) -> Result<U::Output, ConfigError> {
    let detector = D::new(detector, config.n_slots, init);
    of_core::<E, _>(config, widths, init, Behind { detector, n_slots: config.n_slots, wanted })
}

/// A network that reads a specification.
fn of_core<E: Encoder, U: ProgrammerUse<E>>(
    config: &ModelConfig,
    widths: &E::Config,
    init: &mut Init,
    wanted: U,
) -> Result<U::Output, ConfigError> {
    match config.variant.core() {
        CoreKind::Reactive => of_scoping::<E, Reactive, U>(config, widths, init, wanted),
        CoreKind::Gru => of_scoping::<E, GruCore, U>(config, widths, init, wanted),
        CoreKind::Lstm => of_scoping::<E, LstmCore, U>(config, widths, init, wanted),
    }
}

fn of_scoping<E: Encoder, C: Core, U: ProgrammerUse<E>>(
    config: &ModelConfig,
    widths: &E::Config,
    init: &mut Init,
    wanted: U,
) -> Result<U::Output, ConfigError> {
    let scoping = config.variant.scoping();
    if scoping == ScopingKind::Arguments {
        return Err(never_together(config));
    }
    Ok(wanted.take::<C>(Programmer::drawn(scoping, widths, config.n_slots, init)))
}

/// Parts that no [`super::Variant`] has together.
fn never_together(config: &ModelConfig) -> ConfigError {
    ConfigError { key: "variant", found: config.variant.name(), allowed: "parts that go together" }
}

/// What is to be done with a network that reads a specification, whatever its core.
trait ProgrammerUse<E: Encoder> {
    type Output;

    fn take<C: Core>(self, programmer: Programmer<E, C, E::Argument>) -> Self::Output;
}

/// It is used by itself.
struct Alone<U>(U);

impl<E: Encoder, U: NetworkUse> ProgrammerUse<E> for Alone<U> {
    type Output = U::Output;

    fn take<C: Core>(self, programmer: Programmer<E, C, E::Argument>) -> U::Output {
        self.0.run(programmer)
    }
}

/// It is used behind a detector.
struct Behind<D, U> {
    detector: D,
    n_slots: usize,
    wanted: U,
}

impl<E: Encoder<Percepts = ()>, D: Detector, U: NetworkUse> ProgrammerUse<E> for Behind<D, U> {
    type Output = U::Output;

    fn take<C: Core>(self, programmer: Programmer<E, C, E::Argument>) -> U::Output {
        self.wanted.run_detecting(Detecting::new(self.detector, programmer, self.n_slots))
    }
}
