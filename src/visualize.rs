//! Episodes into Rerun.
