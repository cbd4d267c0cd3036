//! Kinds of models by their parts: the order in which they are told, and how they look.

use crate::report::actor::ModelParts;

/// What a model is shown of the world.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Sight {
    /// Where things are.
    Positions,
    /// Pictures, end to end, in which things differ in colour; or by the paper's convolutions.
    EndToEnd,
    /// Pictures, end to end, by keypoints of learned convolutions.
    Keypoints,
    /// What a detector finds in pictures.
    Detector,
}

/// Encoders, what they see, and whether they are the paper's.
const ENCODERS: [(&str, Sight, bool); 7] = [
    ("object_centric", Sight::Positions, false),
    ("flattened", Sight::Positions, true),
    ("colour_slots", Sight::EndToEnd, false),
    ("convolved", Sight::EndToEnd, true),
    ("keypoints", Sight::Keypoints, false),
    ("detected", Sight::Detector, false),
    ("detected_flattened", Sight::Detector, true),
];

/// Core, scoping and sight from the paper's model to its ancestor, then what sees.
const KINDS: [(&str, &str, Sight); 9] = [
    ("reactive", "scoped", Sight::Positions),
    ("gru", "scoped", Sight::Positions),
    ("reactive", "unscoped", Sight::Positions),
    ("reactive", "primitives", Sight::Positions),
    ("gru", "primitives", Sight::Positions),
    ("lstm", "arguments", Sight::Positions),
    ("reactive", "scoped", Sight::EndToEnd),
    ("reactive", "scoped", Sight::Keypoints),
    ("reactive", "scoped", Sight::Detector),
];

/// The place of the oracle, which has no parts, and of what is not known behind it.
const ORACLE: usize = KINDS.len();
/// Colours of the style sheet: one for each kind, the oracle and all others.
const N_COLORS: usize = KINDS.len() + 2;

/// A core and what is decided of the task specification, as the paper tells its models apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Design(pub(super) &'static str, pub(super) &'static str);

impl Design {
    pub(super) const NTP: Self = Self("reactive", "scoped");
    pub(super) const NTP_GRU: Self = Self("gru", "scoped");
    pub(super) const NO_SCOPE: Self = Self("reactive", "unscoped");
    pub(super) const FLAT: Self = Self("reactive", "primitives");
    pub(super) const FLAT_GRU: Self = Self("gru", "primitives");
}

impl ModelParts {
    /// Whether it has this core and decides this.
    pub(super) fn is(&self, design: Design) -> bool {
        self.core.as_deref() == Some(design.0) && self.scoping.as_deref() == Some(design.1)
    }

    /// Whether it reads its observations so.
    pub(super) fn reads_by(&self, encoder: &str) -> bool {
        self.encoder.as_deref() == Some(encoder)
    }

    fn known_encoder(&self) -> Option<(Sight, bool)> {
        let name = self.encoder.as_deref()?;
        ENCODERS.into_iter().find(|(known, ..)| *known == name).map(|(_, sight, papers)| (sight, papers))
    }

    /// What it is shown of the world.
    pub(super) fn sight(&self) -> Option<Sight> {
        self.known_encoder().map(|(sight, _)| sight)
    }

    /// Whether it is given pictures in place of positions.
    pub(super) fn sees(&self) -> bool {
        self.sight().is_some_and(|sight| sight != Sight::Positions)
    }

    /// Whether its encoder is the paper's.
    pub(super) fn has_papers_encoder(&self) -> bool {
        self.known_encoder().is_some_and(|(_, papers)| papers)
    }

    /// The place of its kind, whichever its encoder; an oracle's and what is not known behind all others.
    pub(super) fn rank(&self, is_oracle: bool) -> usize {
        let kind = (self.core.as_deref(), self.scoping.as_deref(), self.sight());
        let is_own = |(core, scoping, sight): (&str, &str, Sight)| kind == (Some(core), Some(scoping), Some(sight));
        KINDS.into_iter().position(is_own).unwrap_or(if is_oracle { ORACLE } else { ORACLE + 1 })
    }

    /// The colour of its kind: the same in every report, and for both encoders.
    pub(super) fn color(&self, is_oracle: bool) -> usize {
        self.rank(is_oracle) % N_COLORS
    }
}
