//! `ntp completions SHELL`.

use clap::CommandFactory as _;
use clap_complete::Shell;

use crate::cli::Cli;
use crate::commands::{CommandOutcome, output};

pub(super) fn run(shell: Shell) -> anyhow::Result<CommandOutcome> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "ntp", &mut script);
    output::print(&String::from_utf8(script)?)?;
    Ok(CommandOutcome::Done)
}
