//! What a running program decides from: with scoping and encoder it makes a variant.

use std::fmt;

use serde::{Deserialize, Serialize};

/// The kind of core network.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum CoreKind {
    /// Without memory: the same input gives the same decision.
    #[default]
    Reactive,
    /// A gated recurrent unit, whose state belongs to a program call.
    Gru,
    /// A long short-term memory, whose state belongs to a program call.
    Lstm,
}

impl CoreKind {
    /// Every kind.
    pub const ALL: [Self; 3] = [Self::Reactive, Self::Gru, Self::Lstm];

    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Reactive => "reactive",
            Self::Gru => "gru",
            Self::Lstm => "lstm",
        }
    }

    /// Whether a decision depends on the steps before it in the same call.
    pub fn is_recurrent(self) -> bool {
        self != Self::Reactive
    }
}

impl fmt::Display for CoreKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
