//! What a variant decides at each step, and so what it learns.

use crate::program::Program;

/// Most slots that a program is called with.
pub const MAX_ARGUMENTS: usize = 2;

/// The decisions of one step of a running program, beside whether it ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Decisions {
    /// The next program, the part of the specification that it may see, and a primitive's argument: NTP.
    #[default]
    Scoped,
    /// The same without the part: every program sees the whole specification.
    Unscoped,
    /// The next primitive and its argument, from the whole specification; the root calls nothing else.
    Primitives,
    /// The next program and the slots that it is called with; there is no specification: the Neural
    /// Programmer-Interpreter.
    Arguments,
}

impl Decisions {
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
