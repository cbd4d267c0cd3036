//! What a variant decides at each step, and so what it learns.

use crate::program::Program;

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
}
