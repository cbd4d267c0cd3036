//! From a configuration to the network of its type.

use burn::tensor::Device;

use crate::model::colour_slots::ColourSlots;
use crate::model::config::{ModelConfig, NetworkConfig};
use crate::model::encoder::Encoder;
use crate::model::flattened::Flattened;
use crate::model::instructed::Instructed;
use crate::model::network::Network;
use crate::model::npi::{BySlot, ByVector, CallEncoder, Npi};
use crate::model::object_centric::ObjectCentric;
use crate::model::programmer::{Flat, FlatGru, Ntp, NtpGru, NtpNoScope};
use crate::model::sighted::Sighted;
use crate::model::variant::Architecture;
use crate::seed::Seed;

/// Something to be done with a network, whatever its type.
pub trait NetworkUse {
    /// What comes of it.
    type Output;

    /// Does it.
    fn run<N: Network>(self, network: N) -> Self::Output;
}

/// Makes a fresh network as configured and hands it on; the same seed gives the same parameters.
pub fn with_network<U: NetworkUse>(config: &ModelConfig, seed: Seed, device: &Device, wanted: U) -> U::Output {
    match &config.network {
        NetworkConfig::ObjectCentric(widths) => {
            of_encoder::<ObjectCentric, BySlot, U>(config, widths, seed, device, wanted)
        }
        NetworkConfig::Flattened(widths) => of_encoder::<Flattened, ByVector, U>(config, widths, seed, device, wanted),
        NetworkConfig::Instructed(widths) => wanted.run(Ntp::<Instructed>::new(widths, config.n_slots, seed, device)),
        NetworkConfig::ColourSlots(widths) => {
            wanted.run(Ntp::<Sighted<ColourSlots>>::new(widths, config.n_slots, seed, device))
        }
    }
}

fn of_encoder<E: Encoder, P: CallEncoder<Config = E::Config>, U: NetworkUse>(
    config: &ModelConfig,
    widths: &E::Config,
    seed: Seed,
    device: &Device,
    wanted: U,
) -> U::Output {
    let n_slots = config.n_slots;
    match config.variant.architecture() {
        Architecture::Ntp => wanted.run(Ntp::<E>::new(widths, n_slots, seed, device)),
        Architecture::NtpGru => wanted.run(NtpGru::<E>::new(widths, n_slots, seed, device)),
        Architecture::NtpNoScope => wanted.run(NtpNoScope::<E>::new(widths, n_slots, seed, device)),
        Architecture::Flat => wanted.run(Flat::<E>::new(widths, n_slots, seed, device)),
        Architecture::Npi => wanted.run(Npi::<P>::new(widths, n_slots, config.tasks.len(), seed, device)),
        Architecture::FlatGru => wanted.run(FlatGru::<E>::new(widths, n_slots, seed, device)),
    }
}
