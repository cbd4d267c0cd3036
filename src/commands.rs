//! One file a command. Commands read the command line, call the library, and print: results to stdout, the rest to
//! stderr.

mod act;
mod annotate;
mod cluster;
mod completions;
mod dataset;
mod explain;
mod ingest;
mod inspect;
mod items;
mod kind;
mod output;
mod publish;
#[cfg(feature = "query")]
mod query;
mod render;
mod repair;
mod replay;
mod robot;
mod stages;
mod tasks;
mod validate;
mod verify;

use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::artifact::remove_unfinished;
use crate::cli::{Cli, Command};
use crate::cluster::ClusterError;
use crate::deploy::DeployError;
#[cfg(not(feature = "query"))]
use crate::feature::Feature;
use crate::feature::NotBuiltIn;
use crate::model::ComputeDevice;
use crate::pipeline::{PipelineError, Stage};
use crate::publish::PublishError;
use crate::store::StoreError;

/// How a command ended when it did not fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CommandOutcome {
    /// All was done.
    Done,
    /// Done, but something was left out.
    LeftOut,
    /// A check found something wrong.
    CheckFailed,
}

/// A mistake in how the command was used.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{0}")]
struct UsageError(String);

/// Executes a command and prints what went wrong, once.
pub fn execute(cli: &Cli) -> ExitCode {
    let stop = Arc::new(AtomicBool::new(false));
    let on_signal = Arc::clone(&stop);
    let stops_in_order = stops_in_order(&cli.command);
    // A second Ctrl-C ends at once, and the first where there is nothing to carry on.
    let handler = ctrlc::set_handler(move || {
        if on_signal.swap(true, Ordering::Relaxed) || !stops_in_order {
            remove_unfinished();
            std::process::exit(130);
        }
    });
    let result = handler.map_err(anyhow::Error::from).and_then(|()| dispatch(&cli.command, &stop));
    match result {
        Ok(CommandOutcome::Done) => ExitCode::SUCCESS,
        Ok(CommandOutcome::CheckFailed) => ExitCode::from(1),
        Ok(CommandOutcome::LeftOut) => ExitCode::from(3),
        Err(error) if output::is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            output::complain(&error);
            ExitCode::from(exit_code(&error))
        }
    }
}

/// Whether a command, when it is interrupted, keeps what is done, so that it can be carried on.
fn stops_in_order(command: &Command) -> bool {
    match command {
        Command::Run(_)
        | Command::Tasks(_)
        | Command::Generate(_)
        | Command::Convert(_)
        | Command::Train(_)
        | Command::Rollout(_)
        | Command::Report(_)
        | Command::Submit(_)
        | Command::Publish(_)
        | Command::Act(_) => true,
        Command::Items(_)
        | Command::Status(_)
        | Command::Ingest(_)
        | Command::Annotate(_)
        | Command::Inspect(_)
        | Command::Validate(_)
        | Command::Replay(_)
        | Command::Render(_)
        | Command::Query(_)
        | Command::Explain(_)
        | Command::Repair(_)
        | Command::Dataset(_)
        | Command::Verify(_)
        | Command::Robot(_)
        | Command::Completions { .. } => false,
    }
}

fn exit_code(error: &anyhow::Error) -> u8 {
    if error.downcast_ref::<UsageError>().is_some() || error.downcast_ref::<NotBuiltIn>().is_some() {
        return 2;
    }
    if error.downcast_ref::<StoreError>().is_some_and(StoreError::is_usage) {
        return 2;
    }
    if matches!(error.downcast_ref(), Some(PublishError::Interrupted))
        || matches!(error.downcast_ref(), Some(DeployError::Interrupted))
        || matches!(error.downcast_ref(), Some(ClusterError::Interrupted))
    {
        return 130;
    }
    if error.downcast_ref::<ClusterError>().is_some_and(ClusterError::is_usage) {
        return 2;
    }
    if matches!(error.downcast_ref(), Some(DeployError::Device(error)) if error.is_usage()) {
        return 2;
    }
    match error.downcast_ref::<PipelineError>() {
        Some(PipelineError::Interrupted) => 130,
        Some(error) if error.is_usage() => 2,
        _ => 1,
    }
}

fn dispatch(command: &Command, stop: &Arc<AtomicBool>) -> anyhow::Result<CommandOutcome> {
    match command {
        Command::Run(args) => stages::run(&args.stage, args.device.device, args.from, args.to, stop),
        Command::Tasks(args) => tasks::run(args, stop),
        Command::Generate(args) => stages::run(args, ComputeDevice::Cpu, Stage::Generate, Stage::Generate, stop),
        Command::Convert(args) => stages::run(args, ComputeDevice::Cpu, Stage::Convert, Stage::Convert, stop),
        Command::Train(args) => stages::run(&args.stage, args.device.device, Stage::Train, Stage::Train, stop),
        Command::Rollout(args) => stages::run(&args.stage, args.device.device, Stage::Rollout, Stage::Rollout, stop),
        Command::Report(args) => stages::report(args, stop),
        Command::Items(args) => items::run(args),
        Command::Submit(args) => cluster::submit(args, stop),
        Command::Status(args) => cluster::status(args),
        Command::Ingest(args) => ingest::run(args),
        Command::Annotate(args) => annotate::run(args),
        Command::Inspect(args) => inspect::run(args),
        Command::Validate(args) => validate::run(args),
        Command::Replay(args) => replay::run(args),
        Command::Render(args) => render::run(args),
        #[cfg(feature = "query")]
        Command::Query(args) => query::run(args),
        #[cfg(not(feature = "query"))]
        Command::Query(_) => Err(NotBuiltIn(Feature::Query).into()),
        Command::Explain(args) => explain::run(args),
        Command::Repair(args) => repair::run(args),
        Command::Dataset(command) => dataset::run(command),
        Command::Publish(args) => publish::run(args, stop),
        Command::Verify(args) => verify::run(args),
        Command::Act(args) => act::run(args, stop),
        Command::Robot(args) => robot::run(args),
        Command::Completions { shell } => completions::run(*shell),
    }
}
