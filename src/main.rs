//! The `ntp` binary: reads the command line, maps the outcome to an exit code.

use std::process::ExitCode;

use clap::Parser as _;
use ntp::cli::Cli;

fn main() -> ExitCode {
    ntp::commands::execute(&Cli::parse())
}
