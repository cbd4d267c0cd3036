//! NTP in burn: encoders, interpreter, core, program memory, argument decoder.
//!
//! A variant is a type that implements [`Network`] and is put together from parts, which are types too: an
//! [`Encoder`], a [`Core`] and a [`ScopingKind`]. All share the program memory.
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

mod build;
mod colour_slots;
mod config;
mod convolution;
mod core_kind;
mod core_network;
mod decoder;
mod detecting;
mod detector;
mod device;
mod encoder;
mod encoder_kind;
mod features;
mod flattened;
mod instructed;
mod keypoints;
mod layers;
mod limits;
mod linear;
mod memory;
mod network;
mod npi;
mod object_centric;
mod perception;
mod pictures;
mod programmer;
mod read_error;
mod running_programs;
mod scoping;
mod scoping_kind;
mod sighted;
mod specification_rows;
mod store;
mod summary;
mod values;
mod variant;
mod vectors;
mod windows;

pub use build::{NetworkUse, with_network};
pub use colour_slots::{ColourSlots, ColourSlotsConfig};
pub use config::{ModelConfig, NetworkConfig};
pub use core_kind::CoreKind;
pub use core_network::{Cell, Core, Gru, GruCore, Lstm, LstmCore, Reactive, Recurrent};
pub use decoder::{Decoder, LabelScores, span_from, span_score};
pub use detecting::{Detecting, Detections, detected_rows};
pub use detector::{
    DetectionLoss, Detector, DetectorDefaults, PointDetector, PointDetectorConfig, VggDetector, VggDetectorConfig,
    detector_of,
};
pub(crate) use detector::{loss as detection_loss, loss_and_distance, positions_in_world};
pub use device::{ComputeDevice, DeviceError, NoDevice};
pub use encoder::{ArgumentDecoder, Encoder, TrainingDefaults, Widths};
pub use encoder_kind::EncoderKind;
pub use flattened::{FlatDemonstration, FlatEncoder, FlatReading, Flattened};
pub use instructed::{Instructed, InstructedConfig, InstructedReading, Sentences};
pub use keypoints::{CellLooks, GlimpseNaming, Keypoints, KeypointsConfig};
pub use limits::ConfigError;
pub(crate) use limits::MOST_CAMERAS;
pub use linear::Linear;
pub use memory::ProgramMemory;
pub use network::{CalledWith, CoreOutput, Network};
pub use npi::{BySlot, ByVector, CallEncoder, Npi, NpiReading, SlotReading};
pub use object_centric::{ObjectCentric, ObjectCentricConfig, ObjectDemonstration, ObjectReading};
pub use perception::{Looks, Perception};
pub use pictures::{PictureIndex, PictureSample, Pictures};
pub use programmer::{Ntp, NtpGru, Programmer};
pub use read_error::ReadError;
pub use running_programs::RunningPrograms;
pub use scoping::ScopeHead;
pub use scoping_kind::{MAX_ARGUMENTS, ScopingKind};
pub use sighted::{Naming, PerceptNaming, Percepts, Sighted, SightedConfig, SightedDemonstration, SightedReading};
pub use specification_rows::{SpecificationRows, States};
pub use store::{
    CONFIG_FILE, ModelError, ModelSummary, WEIGHTS_FILE, check_purpose, inspect, load, load_config, weights_from_bytes,
    weights_to_bytes,
};
pub use values::{TensorError, scalar, values};
pub use variant::{Variant, VariantError};
pub use vectors::{Convolved, ConvolvedConfig, FlattenedConfig, Positions, Vectors};
pub use windows::Windows;
