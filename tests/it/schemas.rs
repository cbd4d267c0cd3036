//! The contracts in `schemas/` against what is written and read.

mod messages;
