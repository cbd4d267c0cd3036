//! Throughput of every stage, one JSON line each.

fn main() {}
