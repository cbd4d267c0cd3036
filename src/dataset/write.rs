//! Episodes into a new dataset: all tables side by side, in memory that does not grow with their number.

pub(crate) mod convert;
pub(crate) mod sheaf;
pub(crate) mod summary;
pub(crate) mod writer;
