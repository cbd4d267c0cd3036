//! The kinds of network by name.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::trace::SpecificationForm;

/// A kind of network. A plain name has the object-centric encoder; `_paper` behind it means the paper's flattened one.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Variant {
    /// NTP: reactive, scoped.
    #[default]
    Ntp,
    /// NTP with the paper's encoder.
    NtpPaper,
    /// NTP with a GRU core, whose state belongs to a program call.
    NtpGru,
    /// The same with the paper's encoder.
    NtpGruPaper,
    /// NTP without scopes: every program sees the whole demonstration.
    NtpNoScope,
    /// The same with the paper's encoder.
    NtpNoScopePaper,
    /// No hierarchy: primitives directly from demonstration and observation.
    Flat,
    /// The same with the paper's encoder.
    FlatPaper,
    /// No hierarchy, with a GRU core.
    FlatGru,
    /// The same with the paper's encoder.
    FlatGruPaper,
    /// The Neural Programmer-Interpreter: an LSTM core, and program arguments in place of a demonstration. It knows
    /// the tasks that it was trained on by name, and no other.
    Npi,
    /// The same with observations as one vector.
    NpiPaper,
    /// NTP from pictures alone, end to end, which it sees as colour slots.
    NtpVidE2e,
    /// The same, which it sees through the paper's convolutions, as one vector.
    NtpVidE2ePaper,
    /// The same, which it sees as keypoints of learned convolutions: things may differ in what is written on them alone,
    /// and the camera may stand elsewhere in each episode.
    NtpVidE2eGeneral,
    /// NTP behind a detector on colour slots.
    NtpVidDetector,
    /// NTP with the paper's encoder behind a detector of VGG16's shape.
    NtpVidDetectorPaper,
}

/// The parts of a network, but for its encoder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Architecture {
    /// [`super::Ntp`]
    Ntp,
    /// [`super::NtpGru`]
    NtpGru,
    /// [`super::NtpNoScope`]
    NtpNoScope,
    /// [`super::Flat`]
    Flat,
    /// [`super::FlatGru`]
    FlatGru,
    /// [`super::Npi`]
    Npi,
}

/// How observations and demonstrations are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EncoderKind {
    /// Slot by slot.
    ObjectCentric,
    /// As one vector: the paper's.
    Flattened,
    /// As pictures, in which things are told apart by colour.
    ColourSlots,
    /// As pictures, each as one vector: the paper's.
    Convolved,
    /// As pictures, in which learned convolutions find each slot's object.
    Keypoints,
    /// Slot by slot, as detected in pictures.
    Detected,
    /// As one vector, as detected in pictures: the paper's.
    DetectedFlattened,
}

impl Variant {
    /// Every variant.
    pub const ALL: [Self; 17] = [
        Self::Ntp,
        Self::NtpPaper,
        Self::NtpGru,
        Self::NtpGruPaper,
        Self::NtpNoScope,
        Self::NtpNoScopePaper,
        Self::Flat,
        Self::FlatPaper,
        Self::FlatGru,
        Self::FlatGruPaper,
        Self::Npi,
        Self::NpiPaper,
        Self::NtpVidE2e,
        Self::NtpVidE2ePaper,
        Self::NtpVidE2eGeneral,
        Self::NtpVidDetector,
        Self::NtpVidDetectorPaper,
    ];

    /// The name in files and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ntp => "ntp",
            Self::NtpPaper => "ntp_paper",
            Self::NtpGru => "ntp_gru",
            Self::NtpGruPaper => "ntp_gru_paper",
            Self::NtpNoScope => "ntp_no_scope",
            Self::NtpNoScopePaper => "ntp_no_scope_paper",
            Self::Flat => "flat",
            Self::FlatPaper => "flat_paper",
            Self::FlatGru => "flat_gru",
            Self::FlatGruPaper => "flat_gru_paper",
            Self::Npi => "npi",
            Self::NpiPaper => "npi_paper",
            Self::NtpVidE2e => "ntp_vid_e2e",
            Self::NtpVidE2ePaper => "ntp_vid_e2e_paper",
            Self::NtpVidE2eGeneral => "ntp_vid_e2e_general",
            Self::NtpVidDetector => "ntp_vid_detector",
            Self::NtpVidDetectorPaper => "ntp_vid_detector_paper",
        }
    }

    /// What its parts are, but for the encoder.
    pub fn architecture(self) -> Architecture {
        match self {
            Self::Ntp
            | Self::NtpPaper
            | Self::NtpVidE2e
            | Self::NtpVidE2ePaper
            | Self::NtpVidE2eGeneral
            | Self::NtpVidDetector
            | Self::NtpVidDetectorPaper => Architecture::Ntp,
            Self::NtpGru | Self::NtpGruPaper => Architecture::NtpGru,
            Self::NtpNoScope | Self::NtpNoScopePaper => Architecture::NtpNoScope,
            Self::Flat | Self::FlatPaper => Architecture::Flat,
            Self::FlatGru | Self::FlatGruPaper => Architecture::FlatGru,
            Self::Npi | Self::NpiPaper => Architecture::Npi,
        }
    }

    /// Its encoder.
    pub fn encoder(self) -> EncoderKind {
        match self {
            Self::Ntp | Self::NtpGru | Self::NtpNoScope | Self::Flat | Self::FlatGru | Self::Npi => {
                EncoderKind::ObjectCentric
            }
            Self::NtpPaper
            | Self::NtpGruPaper
            | Self::NtpNoScopePaper
            | Self::FlatPaper
            | Self::FlatGruPaper
            | Self::NpiPaper => EncoderKind::Flattened,
            Self::NtpVidE2e => EncoderKind::ColourSlots,
            Self::NtpVidE2ePaper => EncoderKind::Convolved,
            Self::NtpVidE2eGeneral => EncoderKind::Keypoints,
            Self::NtpVidDetector => EncoderKind::Detected,
            Self::NtpVidDetectorPaper => EncoderKind::DetectedFlattened,
        }
    }

    /// Whether it is given pictures in place of positions.
    pub fn sees(self) -> bool {
        !matches!(self.encoder(), EncoderKind::ObjectCentric | EncoderKind::Flattened)
    }

    /// Whether a detector is before it, which is trained first.
    pub fn detects(self) -> bool {
        matches!(self.encoder(), EncoderKind::Detected | EncoderKind::DetectedFlattened)
    }

    /// The form of task specification that it reads, when another is asked for where it has a choice.
    pub fn specification(self, asked: SpecificationForm) -> SpecificationForm {
        if self.sees() { SpecificationForm::Video } else { asked }
    }
}

impl fmt::Display for Variant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
