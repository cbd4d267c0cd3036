//! What the callees of a program are given to see: with core and encoder it makes a variant.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::program::Program;

/// Most slots that a program is called with.
pub const MAX_ARGUMENTS: usize = 2;

/// What a callee is given, and so what each step of a running program decides beside whether it ends.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum ScopingKind {
    /// A part of the specification, which the caller chooses: NTP. The next program, that part and a primitive's
    /// argument are decided.
    #[default]
    Scoped,
    /// The whole specification. The next program and a primitive's argument are decided.
    Unscoped,
    /// There is no hierarchy: the root calls primitives and nothing else, and sees the whole specification.
    Primitives,
    /// The slots that it is called with, and no specification: the Neural Programmer-Interpreter.
    Arguments,
}

impl ScopingKind {
    /// Every kind.
    pub const ALL: [Self; 4] = [Self::Scoped, Self::Unscoped, Self::Primitives, Self::Arguments];

    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scoped => "scoped",
            Self::Unscoped => "unscoped",
            Self::Primitives => "primitives",
            Self::Arguments => "arguments",
        }
    }

    /// Whether a callee's part of the specification is decided.
    pub fn has_scopes(self) -> bool {
        self == Self::Scoped
    }

    /// Whether a running program may call another.
    pub fn may_call(self, callee: Program) -> bool {
        self != Self::Primitives || !callee.is_composite()
    }

    /// How many slots a call is made with at most.
    pub fn n_arguments(self) -> usize {
        if self == Self::Arguments { MAX_ARGUMENTS } else { 1 }
    }

    /// With how many slots a program is called.
    pub fn n_arguments_of(self, callee: Program) -> usize {
        if self == Self::Arguments { callee.n_slots() } else { usize::from(callee.takes_argument()) }
    }
}

impl fmt::Display for ScopingKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
