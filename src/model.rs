//! NTP in burn: encoders, interpreter, core, program memory, argument decoder.
//!
//! A variant is a type that implements [`Network`] and shares its parts with the others: the program memory, the
//! reactive core, the scoping head, the temporal convolution.
//!
//! # Shapes
//!
//! `B` windows in a batch, `T` frames of the longest, `N` slots, `H` hidden features.
//!
//! # Invariants
//!
//! All windows of a batch are read for the same running program. A window's output does not depend on what it is
//! batched or padded with, but for rounding.
//!
//! # Source
//!
//! Paper, section IV.

mod config;
mod decoder;
mod features;
mod flattened;
mod heads;
mod layers;
mod memory;
mod network;
mod object_centric;
mod store;

pub use config::{AnyNetwork, ModelConfig, NetworkConfig, Variant};
pub use decoder::{Decoder, LabelScores, span_score};
pub use flattened::{FlatDemonstration, FlatReading, Flattened, FlattenedConfig};
pub use heads::{CoreOutput, ScopeHead};
pub use memory::ProgramMemory;
pub use network::{Network, Windows};
pub use object_centric::{ObjectCentric, ObjectCentricConfig, ObjectDemonstration, ObjectReading};
pub use store::{
    CONFIG_FILE, ModelError, ModelSummary, WEIGHTS_FILE, check_purpose, inspect, load, load_config, weights_from_bytes,
    weights_to_bytes,
};
