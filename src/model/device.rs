//! What networks are computed on: the processor, or an accelerator that the program was built for.
//!
//! # Errors
//!
//! What is not built in, and what is not there, is refused by name before anything is computed.

use std::fmt;
use std::str::FromStr;

use burn::tensor::Device;
#[cfg(feature = "wgpu")]
use burn::tensor::DeviceKind;
#[cfg(any(feature = "wgpu", feature = "cuda"))]
use burn::tensor::DeviceType;

#[cfg(not(all(feature = "wgpu", feature = "cuda")))]
use crate::feature::Feature;
use crate::feature::NotBuiltIn;

/// What networks are computed on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ComputeDevice {
    /// The processor. Its numbers are the same with any number of threads.
    #[default]
    Cpu,
    /// The processor, learning as an accelerator does: a step is one batch. For tests.
    CpuBatched,
    /// A graphics card behind Vulkan, Metal or DirectX, by its number among the cards of this machine.
    Wgpu(u32),
    /// What the system has in place of a graphics card: the same programs, drawn by the processor. For tests.
    WgpuSoftware,
    /// A card of NVIDIA's, by its number.
    Cuda(u32),
}

/// Words that are no device.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{found:?} is no device; allowed: cpu, cpu:batched, wgpu, wgpu:N, wgpu:cpu, cuda, cuda:N, with N the card's number from 0"
)]
pub struct NoDevice {
    /// As typed.
    pub found: String,
}

/// A device that cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DeviceError {
    #[expect(missing_docs, reason = "wraps an error that documents itself")]
    #[error(transparent)]
    NotBuiltIn(#[from] NotBuiltIn),
    /// The machine has none, or not so many.
    #[error("device {asked} is not there: this machine has {found}")]
    NotThere {
        /// What was asked for.
        asked: ComputeDevice,
        /// What there is of its kind.
        found: String,
    },
}

impl DeviceError {
    /// Whether the command or the build is at fault.
    pub fn is_usage(&self) -> bool {
        matches!(self, Self::NotBuiltIn(_))
    }
}

impl FromStr for ComputeDevice {
    type Err = NoDevice;

    fn from_str(word: &str) -> Result<Self, NoDevice> {
        let no_device = || NoDevice { found: word.to_owned() };
        let (kind, card) = word.split_once(':').map_or((word, None), |(kind, card)| (kind, Some(card)));
        let number = || card.map_or(Ok(0), |card| card.parse().map_err(|_no_number| no_device()));
        match (kind, card) {
            ("cpu", None) => Ok(Self::Cpu),
            ("cpu", Some("batched")) => Ok(Self::CpuBatched),
            ("wgpu", Some("cpu")) => Ok(Self::WgpuSoftware),
            ("wgpu", _) => Ok(Self::Wgpu(number()?)),
            ("cuda", _) => Ok(Self::Cuda(number()?)),
            _ => Err(no_device()),
        }
    }
}

impl fmt::Display for ComputeDevice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Cpu => f.write_str("cpu"),
            Self::CpuBatched => f.write_str("cpu:batched"),
            Self::Wgpu(card) => write!(f, "wgpu:{card}"),
            Self::WgpuSoftware => f.write_str("wgpu:cpu"),
            Self::Cuda(card) => write!(f, "cuda:{card}"),
        }
    }
}

impl ComputeDevice {
    /// Finds it: the one place that makes a device of a name.
    ///
    /// # Errors
    ///
    /// [`DeviceError`] when it is not built in, or not there.
    pub fn open(self) -> Result<Device, DeviceError> {
        match self {
            Self::Cpu | Self::CpuBatched => Ok(Device::flex()),
            Self::Wgpu(card) => wgpu(self, Some(card)),
            Self::WgpuSoftware => wgpu(self, None),
            Self::Cuda(card) => cuda(self, card),
        }
    }

    /// Whether it is the processor as always, where every number is the same with any number of threads.
    pub fn is_cpu(self) -> bool {
        self == Self::Cpu
    }
}

/// Whether a device, with gradients or without, is the processor by burn's own programs for it.
pub(crate) fn is_processor(device: &Device) -> bool {
    *device == Device::flex()
}

/// A card by its number, or what stands in for one.
#[cfg(feature = "wgpu")]
fn wgpu(asked: ComputeDevice, card: Option<u32>) -> Result<Device, DeviceError> {
    let software = Device::wgpu(DeviceKind::Cpu);
    let (software, cards): (Vec<Device>, Vec<Device>) =
        Device::enumerate(DeviceType::Wgpu).into_vec().into_iter().partition(|device| *device == software);
    let n_cards = cards.len();
    let found = match card {
        Some(card) => cards.into_iter().nth(card as usize),
        None => software.first().cloned(),
    };
    found.ok_or_else(|| {
        let stand_in =
            if software.is_empty() { "no software adapter" } else { "a software adapter, which is wgpu:cpu" };
        DeviceError::NotThere { asked, found: format!("{} behind wgpu, and {stand_in}", counted(n_cards)) }
    })
}

#[cfg(not(feature = "wgpu"))]
fn wgpu(_asked: ComputeDevice, _card: Option<u32>) -> Result<Device, DeviceError> {
    Err(NotBuiltIn(Feature::Wgpu).into())
}

#[cfg(feature = "cuda")]
fn cuda(asked: ComputeDevice, card: u32) -> Result<Device, DeviceError> {
    let cards = Device::enumerate(DeviceType::Cuda).into_vec();
    let n_cards = cards.len();
    let found = cards.into_iter().nth(card as usize);
    found.ok_or_else(|| DeviceError::NotThere { asked, found: format!("{} behind CUDA", counted(n_cards)) })
}

#[cfg(not(feature = "cuda"))]
fn cuda(_asked: ComputeDevice, _card: u32) -> Result<Device, DeviceError> {
    Err(NotBuiltIn(Feature::Cuda).into())
}

#[cfg(any(feature = "wgpu", feature = "cuda"))]
fn counted(n_cards: usize) -> String {
    match n_cards {
        0 => "no card".to_owned(),
        1 => "one card".to_owned(),
        n => format!("{n} cards"),
    }
}

#[cfg(test)]
mod tests {
    use super::ComputeDevice;

    #[test]
    fn a_device_is_read_as_it_is_written() {
        for (words, device) in [
            ("cpu", ComputeDevice::Cpu),
            ("cpu:batched", ComputeDevice::CpuBatched),
            ("wgpu", ComputeDevice::Wgpu(0)),
            ("wgpu:2", ComputeDevice::Wgpu(2)),
            ("wgpu:cpu", ComputeDevice::WgpuSoftware),
            ("cuda:1", ComputeDevice::Cuda(1)),
        ] {
            assert_eq!(words.parse(), Ok(device));
            assert_eq!(device.to_string().parse(), Ok(device));
        }
        for words in ["", "gpu", "cpu:0", "cuda:cpu", "wgpu:", "wgpu:-1", "CUDA"] {
            assert!(words.parse::<ComputeDevice>().is_err(), "{words}");
        }
    }
}
