//! The `ntp` binary: reads the command line, maps the outcome to an exit code.

use std::process::ExitCode;

use clap::Parser as _;
use mimalloc::MiMalloc;
use ntp::cli::Cli;

#[global_allocator]
static ALLOCATOR: MiMalloc = MiMalloc;

fn main() -> ExitCode {
    ntp::commands::execute(&Cli::parse())
}
