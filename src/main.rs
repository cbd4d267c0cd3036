//! The `ntp` binary: reads the command line, maps the outcome to an exit code.

use std::process::ExitCode;

use clap::Parser as _;
use ntp::cli::Cli;

/// Gives a step's buffers back to the next step, not to the system, which would hand them out page by page again.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    ntp::commands::execute(&Cli::parse())
}
