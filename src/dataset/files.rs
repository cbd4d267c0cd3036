//! The files of a dataset: where they lie, what their JSON says, how tables in many files are read and written.
//!
//! Knows nothing of what is in a table.

pub(crate) mod annotation;
pub(crate) mod cursor;
pub(crate) mod error;
pub(crate) mod finding;
pub(crate) mod info;
pub(crate) mod layout;
pub(crate) mod rolling;
pub(crate) mod stated;
