//! The kinds of network: the parts that each is put together from, and names for those that results are told of.
//!
//! A preset is one line of the list below and nothing else: whatever parts it names, they are put together, trained,
//! stored, rolled out and reported. A combination without a name is written by its parts, and its name is made of them.

use std::fmt;
use std::str::FromStr;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::MapAccessDeserializer;
use serde::de::{Error as _, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::model::core_kind::CoreKind;
use crate::model::encoder_kind::EncoderKind;
use crate::model::scoping_kind::ScopingKind;
use crate::trace::SpecificationForm;

/// A kind of network: a core, a scoping and an encoder that go together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Variant {
    core: CoreKind,
    scoping: ScopingKind,
    encoder: EncoderKind,
}

/// A combination that has a name.
struct Preset {
    name: &'static str,
    meaning: &'static [&'static str],
    variant: Variant,
}

macro_rules! presets {
    ($($(#[doc = $meaning:literal])+ $constant:ident = $name:literal: $core:ident, $scoping:ident, $encoder:ident;)+) => {
        /// The variants that have a name.
        impl Variant {
            $(
                $(#[doc = $meaning])+
                pub const $constant: Self =
                    Self { core: CoreKind::$core, scoping: ScopingKind::$scoping, encoder: EncoderKind::$encoder };
            )+
        }

        const PRESETS: &[Preset] =
            &[$(Preset { name: $name, meaning: &[$($meaning),+], variant: Variant::$constant }),+];
    };
}

// A plain name has the object-centric encoder; `_paper` behind it means the paper's.
presets! {
    /// NTP: reactive, scoped.
    NTP = "ntp": Reactive, Scoped, ObjectCentric;
    /// NTP with the paper's encoder.
    NTP_PAPER = "ntp_paper": Reactive, Scoped, Flattened;
    /// NTP with a GRU core, whose state belongs to a program call.
    NTP_GRU = "ntp_gru": Gru, Scoped, ObjectCentric;
    /// The same with the paper's encoder.
    NTP_GRU_PAPER = "ntp_gru_paper": Gru, Scoped, Flattened;
    /// NTP without scopes: every program sees the whole demonstration.
    NTP_NO_SCOPE = "ntp_no_scope": Reactive, Unscoped, ObjectCentric;
    /// The same with the paper's encoder.
    NTP_NO_SCOPE_PAPER = "ntp_no_scope_paper": Reactive, Unscoped, Flattened;
    /// No hierarchy: primitives directly from demonstration and observation.
    FLAT = "flat": Reactive, Primitives, ObjectCentric;
    /// The same with the paper's encoder.
    FLAT_PAPER = "flat_paper": Reactive, Primitives, Flattened;
    /// No hierarchy, with a GRU core.
    FLAT_GRU = "flat_gru": Gru, Primitives, ObjectCentric;
    /// The same with the paper's encoder.
    FLAT_GRU_PAPER = "flat_gru_paper": Gru, Primitives, Flattened;
    /// The Neural Programmer-Interpreter: an LSTM core, and program arguments in place of a demonstration. It knows
    /// the tasks that it was trained on by name, and no other.
    NPI = "npi": Lstm, Arguments, ObjectCentric;
    /// The same with observations as one vector.
    NPI_PAPER = "npi_paper": Lstm, Arguments, Flattened;
    /// NTP from pictures alone, end to end, which it sees as colour slots.
    NTP_VID_E2E = "ntp_vid_e2e": Reactive, Scoped, ColourSlots;
    /// The same, which it sees through the paper's convolutions, as one vector.
    NTP_VID_E2E_PAPER = "ntp_vid_e2e_paper": Reactive, Scoped, Convolved;
    /// The same, which it sees as keypoints of learned convolutions: things may differ in what is written on them alone,
    /// and the camera may stand elsewhere in each episode.
    NTP_VID_E2E_GENERAL = "ntp_vid_e2e_general": Reactive, Scoped, Keypoints;
    /// NTP behind a detector on colour slots.
    NTP_VID_DETECTOR = "ntp_vid_detector": Reactive, Scoped, Detected;
    /// NTP with the paper's encoder behind a detector of VGG16's shape.
    NTP_VID_DETECTOR_PAPER = "ntp_vid_detector_paper": Reactive, Scoped, DetectedFlattened;
}

/// A variant that cannot be.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum VariantError {
    /// No variant has this name.
    #[error(
        "unknown variant `{found}`, expected one of {}, or its parts: {{ core = \"…\", scoping = \"…\", encoder = \"…\" }}",
        names()
    )]
    Name {
        /// As found.
        found: String,
    },
    /// Parts that do not go together.
    #[error("core {core} with scoping {scoping} and encoder {encoder}; allowed: {allowed}")]
    Parts {
        /// As found.
        core: CoreKind,
        /// As found.
        scoping: ScopingKind,
        /// As found.
        encoder: EncoderKind,
        /// What goes with what.
        allowed: &'static str,
    },
}

impl Variant {
    /// Whether one network of it can be trained on several families: it reads positions, and what to do from a specification.
    pub fn reads_any_family(self) -> bool {
        matches!(self.encoder, EncoderKind::ObjectCentric | EncoderKind::Flattened)
            && self.scoping != ScopingKind::Arguments
    }

    /// The variant of these parts.
    ///
    /// # Errors
    ///
    /// [`VariantError::Parts`] when they do not go together.
    pub fn of(core: CoreKind, scoping: ScopingKind, encoder: EncoderKind) -> Result<Self, VariantError> {
        let refuse = |allowed| Err(VariantError::Parts { core, scoping, encoder, allowed });
        if scoping == ScopingKind::Arguments && (core != CoreKind::Lstm || encoder.sees()) {
            return refuse("scoping arguments with core lstm and encoder object_centric or flattened");
        }
        if core.is_recurrent() && encoder.is_end_to_end() {
            // Their batches hold single decisions on shared pictures, and no whole calls.
            return refuse("core reactive with encoders that learn from pictures end to end");
        }
        Ok(Self { core, scoping, encoder })
    }

    /// Every variant that has a name of its own, in the order of reports.
    pub fn named() -> impl Iterator<Item = Self> {
        PRESETS.iter().map(|preset| preset.variant)
    }

    /// Every variant there is.
    pub fn every() -> impl Iterator<Item = Self> {
        let parts = EncoderKind::ALL.into_iter().flat_map(|encoder| {
            let scopings = ScopingKind::ALL.into_iter();
            scopings.flat_map(move |scoping| CoreKind::ALL.map(|core| Self::of(core, scoping, encoder)))
        });
        parts.filter_map(Result::ok)
    }

    /// What a running program decides from.
    pub fn core(self) -> CoreKind {
        self.core
    }

    /// What callees are given to see.
    pub fn scoping(self) -> ScopingKind {
        self.scoping
    }

    /// How observations and demonstrations are read.
    pub fn encoder(self) -> EncoderKind {
        self.encoder
    }

    /// The name in files and reports: a preset's, or made of the parts.
    pub fn name(self) -> String {
        let Self { core, scoping, encoder } = self;
        self.preset().map_or_else(|| format!("{core}_{scoping}_{encoder}"), |preset| preset.name.to_owned())
    }

    /// Whether it is given pictures in place of positions.
    pub fn sees(self) -> bool {
        self.encoder.sees()
    }

    /// Whether a detector is before it, which is trained first.
    pub fn detects(self) -> bool {
        self.encoder.detects()
    }

    /// The form of task specification that it reads, when another is asked for where it has a choice.
    pub fn specification(self, asked: SpecificationForm) -> SpecificationForm {
        if self.sees() { SpecificationForm::Video } else { asked }
    }

    fn preset(self) -> Option<&'static Preset> {
        PRESETS.iter().find(|preset| preset.variant == self)
    }
}

fn names() -> String {
    PRESETS.iter().map(|preset| format!("`{}`", preset.name)).collect::<Vec<_>>().join(", ")
}

impl fmt::Display for Variant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&self.name())
    }
}

impl FromStr for Variant {
    type Err = VariantError;

    fn from_str(name: &str) -> Result<Self, VariantError> {
        Self::every()
            .find(|variant| variant.name() == name)
            .ok_or_else(|| VariantError::Name { found: name.to_owned() })
    }
}

/// A variant by its parts, as it stands in files; what is left out is NTP's.
#[derive(Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
struct Parts {
    /// What a running program decides from.
    core: CoreKind,
    /// What callees are given to see.
    scoping: ScopingKind,
    /// How observations and demonstrations are read.
    encoder: EncoderKind,
}

/// A preset's name; its parts for any other.
impl Serialize for Variant {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let &Self { core, scoping, encoder } = self;
        match self.preset() {
            Some(preset) => serializer.serialize_str(preset.name),
            None => Parts { core, scoping, encoder }.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for Variant {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(NameOrParts)
    }
}

struct NameOrParts;

impl<'de> Visitor<'de> for NameOrParts {
    type Value = Variant;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the name of a variant, or its parts: core, scoping and encoder")
    }

    fn visit_str<E: serde::de::Error>(self, name: &str) -> Result<Variant, E> {
        name.parse().map_err(E::custom)
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Variant, A::Error> {
        let Parts { core, scoping, encoder } = Parts::deserialize(MapAccessDeserializer::new(map))?;
        Variant::of(core, scoping, encoder).map_err(A::Error::custom)
    }
}

impl JsonSchema for Variant {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Variant".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let named = |preset: &Preset| {
            let meaning: Vec<&str> = preset.meaning.iter().map(|line| line.trim()).collect();
            json_schema!({ "description": meaning.join("\n"), "type": "string", "const": preset.name })
        };
        let mut one_of: Vec<Schema> = PRESETS.iter().map(named).collect();
        one_of.push(generator.subschema_for::<Parts>());
        json_schema!({
            "description": "A kind of network, by name or by its parts. A plain name has the object-centric encoder; \
                            `_paper` behind it means the paper's.",
            "oneOf": one_of,
        })
    }
}
