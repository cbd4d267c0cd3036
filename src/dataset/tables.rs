//! The tables, a room each: what their columns are, how they are filled, read back and checked.
//!
//! Knows nothing of which tables a command needs, nor of pictures and statistics.

pub(crate) mod annotated;
pub(crate) mod calls;
pub(crate) mod episodes;
pub(crate) mod frames;
pub(crate) mod map;
pub(crate) mod meta_episodes;
pub(crate) mod scopes;
pub(crate) mod texts;
pub(crate) mod view;
