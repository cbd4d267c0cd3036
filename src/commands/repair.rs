//! `ntp repair PATH --to PATH`: what can be verified of a broken dataset or recording.

use serde_json::json;

use crate::cli::RepairArgs;
use crate::commands::kind::Kind;
use crate::commands::{CommandOutcome, UsageError, output};
use crate::dataset::edit;
use crate::recording::{self, Lost, Recovery};
use crate::words::counted;

pub(super) fn run(args: &RepairArgs) -> anyhow::Result<CommandOutcome> {
    if args.to.exists() {
        return Err(UsageError(format!("{} is there already; --to names something new", args.to.display())).into());
    }
    match Kind::of(&args.path)? {
        Kind::Dataset => dataset(args),
        Kind::Recording if recording::is_own(&args.path) => recording(args),
        Kind::Recording => others(args),
        kind => {
            let problem =
                format!("{} is {}; repair takes a dataset or a recording (.mcap)", args.path.display(), kind.name());
            Err(UsageError(problem).into())
        }
    }
}

fn dataset(args: &RepairArgs) -> anyhow::Result<CommandOutcome> {
    let repair = edit::repair(&args.path, &args.to)?;
    let Some(written) = &repair.written else { return whole(args, json!(repair)) };
    let lines = repair.reasons.iter().map(|reason| format!("found    {reason}"));
    let episodes = counted(written.episodes, "episode");
    let kept = format!("kept     {episodes}, left out {}: {}", written.left_out, args.to.display());
    tell(args, json!(repair), &lines.chain([kept]).collect::<Vec<_>>())?;
    Ok(if written.left_out > 0 { CommandOutcome::LeftOut } else { CommandOutcome::Done })
}

fn recording(args: &RepairArgs) -> anyhow::Result<CommandOutcome> {
    let repair = recording::repair(&args.path, &args.to)?;
    let Some(reason) = &repair.reason else { return whole(args, json!(repair)) };
    let plan = match repair.plan {
        recording::PlanSource::Recording => "its plan was kept",
        recording::PlanSource::Folder => "its plan was cut off; that of the folder was taken",
        recording::PlanSource::Lost => "its plan was cut off, so that no episode of it can be simulated again",
    };
    let lines = [
        format!("found    {reason}"),
        format!("kept     {}: {}", counted(repair.kept, "episode"), args.to.display()),
        "left out whatever came behind them".to_owned(),
        format!("plan     {plan}"),
    ];
    tell(args, json!(repair), &lines)?;
    Ok(CommandOutcome::LeftOut)
}

/// A recording of others: what is whole of it, whatever is in it.
fn others(args: &RepairArgs) -> anyhow::Result<CommandOutcome> {
    let found = recording::recover(&args.path, &args.to)?;
    if found.lost.is_empty() {
        return whole(args, json!(found));
    }
    let Recovery { messages, topics, counted: of, attachments, metadata, lost } = &found;
    let of = of.map(|of| format!(" of {of}")).unwrap_or_default();
    let others = [(*attachments, "attachment"), (*metadata, "metadata record")];
    let others: String =
        others.into_iter().filter(|(n, _)| *n > 0).map(|(n, what)| format!(", {}", counted(n, what))).collect();
    let messages = counted(*messages, "message");
    let kept = format!("kept     {messages}{of} on {}{others}: {}", counted(*topics, "topic"), args.to.display());
    let lines = lost.iter().map(|Lost { offset, bytes, problem }| {
        format!("lost     {} from byte {offset} on: {problem}", counted(*bytes, "byte"))
    });
    tell(args, json!(found), &std::iter::once(kept).chain(lines).collect::<Vec<_>>())?;
    Ok(CommandOutcome::LeftOut)
}

fn whole(args: &RepairArgs, repair: serde_json::Value) -> anyhow::Result<CommandOutcome> {
    tell(args, repair, &[format!("{} is whole: nothing to repair, nothing written", args.path.display())])?;
    Ok(CommandOutcome::Done)
}

fn tell(args: &RepairArgs, repair: serde_json::Value, lines: &[String]) -> anyhow::Result<()> {
    if args.json { output::print_json(&repair) } else { output::print(&lines.join("\n")) }
}
