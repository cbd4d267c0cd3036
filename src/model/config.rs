//! Which network a model is, and for what it was made.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::model::flattened::{Flattened, FlattenedConfig};
use crate::model::object_centric::{ObjectCentric, ObjectCentricConfig};
use crate::program::vocabulary_hash;
use crate::task::Family;

/// A kind of network.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Variant {
    /// NTP with the object-centric encoder.
    #[default]
    Ntp,
    /// NTP with the paper's flattened encoder.
    NtpPaper,
}

impl Variant {
    /// Every variant.
    pub const ALL: [Self; 2] = [Self::Ntp, Self::NtpPaper];

    /// The name in files and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ntp => "ntp",
            Self::NtpPaper => "ntp_paper",
        }
    }
}

impl fmt::Display for Variant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The widths of a variant's network.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NetworkConfig {
    /// Of [`Variant::Ntp`].
    ObjectCentric(ObjectCentricConfig),
    /// Of [`Variant::NtpPaper`].
    Flattened(FlattenedConfig),
}

impl NetworkConfig {
    /// A variant's default.
    pub fn of(variant: Variant) -> Self {
        match variant {
            Variant::Ntp => Self::ObjectCentric(ObjectCentricConfig::default()),
            Variant::NtpPaper => Self::Flattened(FlattenedConfig::default()),
        }
    }
}

/// What stands in a model's `config.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelConfig {
    /// Version of this file; [`ModelConfig::VERSION`].
    pub version: u32,
    /// The kind of network.
    pub variant: Variant,
    /// The family of tasks that it was trained on.
    pub family: Family,
    /// Slots of the scenes that it was trained on.
    pub n_slots: usize,
    /// Hash of the program vocabulary.
    pub vocabulary: String,
    /// Widths.
    pub network: NetworkConfig,
    /// How it was trained, for people; loading does not read it.
    pub training: serde_json::Value,
}

impl ModelConfig {
    /// Version of `config.json`.
    pub const VERSION: u32 = 1;

    /// A model of a variant's default widths and the current vocabulary.
    pub fn new(variant: Variant, family: Family, n_slots: usize, training: serde_json::Value) -> Self {
        Self {
            version: Self::VERSION,
            variant,
            family,
            n_slots,
            vocabulary: vocabulary_hash(),
            network: NetworkConfig::of(variant),
            training,
        }
    }
}

/// A network of any variant.
#[derive(Debug)]
pub enum AnyNetwork {
    /// Of [`Variant::Ntp`].
    ObjectCentric(Box<ObjectCentric>),
    /// Of [`Variant::NtpPaper`].
    Flattened(Box<Flattened>),
}
