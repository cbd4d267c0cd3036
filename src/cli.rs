//! Every clap definition; no logic.
