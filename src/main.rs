//! The `ntp` binary.

fn main() {}
