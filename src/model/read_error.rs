//! What keeps a network from reading what it is given.

use crate::model::values::TensorError;

/// Something that a network cannot read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ReadError {
    /// Numbers could not be read out of a tensor.
    #[error(transparent)]
    Tensor(#[from] TensorError),
    /// It was given what another network reads.
    #[error("the network was given {found}; allowed: {allowed}")]
    Form {
        /// What it was given.
        found: &'static str,
        /// What it reads.
        allowed: &'static str,
    },
    /// A picture that is not among those that it was shown.
    #[error("picture {found} is asked for; allowed: the {n} that were shown")]
    Picture {
        /// Which one.
        found: u32,
        /// How many there are.
        n: usize,
    },
    /// What it says is no number.
    #[error("the network says {found} of {what}; allowed: finite numbers")]
    NotFinite {
        /// Of what.
        what: &'static str,
        /// What it says.
        found: String,
    },
}
