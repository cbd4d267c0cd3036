//! From a configuration to the network of its type.

use burn::module::ModuleDisplay;
use burn::tensor::Device;

use crate::model::colour_slots::ColourSlots;
use crate::model::config::{ModelConfig, NetworkConfig};
use crate::model::detecting::Detecting;
use crate::model::detector::{Detector, PointDetector, VggDetector};
use crate::model::encoder::Encoder;
use crate::model::flattened::{FlatEncoder, Flattened};
use crate::model::instructed::Instructed;
use crate::model::keypoints::Keypoints;
use crate::model::layers::Init;
use crate::model::network::Network;
use crate::model::npi::{BySlot, ByVector, CallEncoder, Npi};
use crate::model::object_centric::ObjectCentric;
use crate::model::programmer::{Flat, FlatGru, Ntp, NtpGru, NtpNoScope};
use crate::model::sighted::Sighted;
use crate::model::variant::Architecture;
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
pub fn with_network<U: NetworkUse>(config: &ModelConfig, seed: Seed, device: &Device, wanted: U) -> U::Output {
    let init = &mut Init::new(seed, device).knowing(config.programs());
    let n_slots = config.n_slots;
    match &config.network {
        NetworkConfig::ObjectCentric(widths) => of_encoder::<ObjectCentric, BySlot, U>(config, widths, init, wanted),
        NetworkConfig::Flattened(widths) => of_encoder::<Flattened, ByVector, U>(config, widths, init, wanted),
        NetworkConfig::Instructed(widths) => wanted.run(Ntp::<Instructed>::drawn(widths, n_slots, init)),
        NetworkConfig::ColourSlots(widths) => wanted.run(Ntp::<Sighted<ColourSlots>>::drawn(widths, n_slots, init)),
        NetworkConfig::Convolved(widths) => wanted.run(Ntp::<FlatEncoder<Convolved>>::drawn(widths, n_slots, init)),
        NetworkConfig::Keypoints(widths) => wanted.run(Ntp::<Sighted<Keypoints>>::drawn(widths, n_slots, init)),
        NetworkConfig::Detected(detector, widths) => {
            wanted.run_detecting(detecting::<PointDetector, ObjectCentric>(detector, widths, n_slots, init))
        }
        NetworkConfig::DetectedFlattened(detector, widths) => {
            wanted.run_detecting(detecting::<VggDetector, Flattened>(detector, widths, n_slots, init))
        }
    }
}

/// A detector with NTP behind it. The two draw from one beginning, so that no parameters share an id.
fn detecting<D: Detector, E: Encoder<Percepts = ()>>(
    detector: &D::Config,
    widths: &E::Config,
    n_slots: usize,
    init: &mut Init,
) -> Detecting<D, Ntp<E>> {
    let detector = D::new(detector, n_slots, init);
    Detecting::new(detector, Ntp::<E>::drawn(widths, n_slots, init), n_slots)
}

fn of_encoder<E: Encoder, P: CallEncoder<Config = E::Config>, U: NetworkUse>(
    config: &ModelConfig,
    widths: &E::Config,
    init: &mut Init,
    wanted: U,
) -> U::Output {
    let n_slots = config.n_slots;
    match config.variant.architecture() {
        Architecture::Ntp => wanted.run(Ntp::<E>::drawn(widths, n_slots, init)),
        Architecture::NtpGru => wanted.run(NtpGru::<E>::drawn(widths, n_slots, init)),
        Architecture::NtpNoScope => wanted.run(NtpNoScope::<E>::drawn(widths, n_slots, init)),
        Architecture::Flat => wanted.run(Flat::<E>::drawn(widths, n_slots, init)),
        Architecture::Npi => wanted.run(Npi::<P>::drawn(widths, n_slots, config.tasks.len(), init)),
        Architecture::FlatGru => wanted.run(FlatGru::<E>::drawn(widths, n_slots, init)),
    }
}
