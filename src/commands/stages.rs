//! `ntp run`, and the commands of single stages.

use std::io::IsTerminal as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::artifact;
use crate::cli::{Part, ScopeArgs, StageArgs};
use crate::commands::{CommandOutcome, UsageError, output};
use crate::model::ComputeDevice;
use crate::pipeline::{self, ItemRanges, Options, PipelineFile, RunDir, Scope, Stage, StageReport, Stale, Status};
use crate::store::StoreAddress;
use crate::words::{counted, shell_path};

/// Runs the stages `from..=to` and prints a line for each unit.
pub(super) fn run(
    args: &StageArgs,
    device: ComputeDevice,
    from: Stage,
    to: Stage,
    stop: &Arc<AtomicBool>,
) -> anyhow::Result<CommandOutcome> {
    let (_, reports) = run_stages(args, device, from, to, stop)?;
    if args.json {
        output::print_json(&reports)?;
    } else {
        reports.iter().try_for_each(|report| output::print(&line(report)))?;
    }
    if args.dry_run {
        output::note(&undone(&reports).unwrap_or_else(|| left(&reports)));
        return Ok(CommandOutcome::Done);
    }
    Ok(outcome(&reports))
}

/// Makes the report and prints it.
pub(super) fn report(args: &StageArgs, stop: &Arc<AtomicBool>) -> anyhow::Result<CommandOutcome> {
    if scope(&args.scope) != Scope::Whole {
        return run(args, ComputeDevice::Cpu, Stage::Report, Stage::Report, stop);
    }
    let (dir, reports) = run_stages(args, ComputeDevice::Cpu, Stage::Report, Stage::Report, stop)?;
    if args.dry_run {
        match args.json {
            true => output::print_json(&reports)?,
            false => reports.iter().try_for_each(|report| output::print(&line(report)))?,
        }
        return Ok(CommandOutcome::Done);
    }
    let folder = dir.report();
    if args.store.is_some() {
        if outcome(&reports) == CommandOutcome::CheckFailed {
            reports.iter().try_for_each(|report| output::print(&line(report)))?;
            return Ok(CommandOutcome::CheckFailed);
        }
        fetch_report(args, stop)?;
    }
    if args.json {
        let text = artifact::read(&folder.path().join("report.json"))?;
        output::print(&String::from_utf8(text)?)?;
    } else {
        let text = artifact::read(&folder.path().join("report.md"))?;
        output::print(&String::from_utf8(text)?)?;
        output::note(&format!("{}", folder.path().join("index.html").display()));
    }
    Ok(CommandOutcome::Done)
}

/// Brings a report that is up to date in the store, and may have been made elsewhere.
fn fetch_report(args: &StageArgs, stop: &Arc<AtomicBool>) -> anyhow::Result<()> {
    let fetch = StageArgs { scope: ScopeArgs { fetch: true, ..ScopeArgs::default() }, ..args.clone() };
    run_stages(&fetch, ComputeDevice::Cpu, Stage::Report, Stage::Report, stop).map(|_| ())
}

fn run_stages(
    args: &StageArgs,
    device: ComputeDevice,
    from: Stage,
    to: Stage,
    stop: &Arc<AtomicBool>,
) -> anyhow::Result<(RunDir, Vec<StageReport>)> {
    let file = PipelineFile::load(&args.pipeline)?;
    let store = args.store.as_ref().map(StoreAddress::open).transpose()?;
    // What a dry run looks at in a store is no copy to be kept.
    let looked_at = store.as_ref().filter(|_| args.dry_run).map(|_| tempfile::tempdir()).transpose()?;
    let out = looked_at.as_ref().map(tempfile::TempDir::path).or(args.out.as_deref());
    let dir = RunDir::new(run_directory(out, &file));
    let options = Options {
        from,
        to,
        scope: scope(&args.scope),
        jobs: args.jobs.map_or_else(all_cores, usize::from),
        device,
        dry_run: args.dry_run,
        force: args.force,
        no_lock: args.no_lock,
        store: store.map(Arc::from),
        progress: true,
        commit: commit_of,
        experiment: None,
        stop: Arc::clone(stop),
    };
    if options.scope != Scope::Whole {
        refuse_stale(args, &pipeline::stale(&file, &dir, from), from)?;
    }
    let reports = match &file {
        PipelineFile::Experiment(pipeline) => pipeline::run(pipeline, &dir, &options)?,
        PipelineFile::Study(study) => pipeline::run_study(study, &dir, &options)?,
    };
    if options.scope == Scope::Whole {
        say_stale(args, &pipeline::stale(&file, &dir, from), from);
    }
    Ok((dir, reports))
}

/// Says what the stages read that the pipeline file would make otherwise now: they took it as it is.
fn say_stale(args: &StageArgs, stale: &[Stale], from: Stage) {
    stale.iter().for_each(|stale| output::note(&format!("stale: {stale}")));
    if !stale.is_empty() && args.store.is_none() {
        let (pipeline, out) = (shell_path(&args.pipeline), args.out.as_deref().map(shell_path));
        let out = out.map(|out| format!(" --out {out}")).unwrap_or_default();
        output::note(&format!("{from} takes it as it is; ntp run {pipeline}{out} makes it anew"));
    }
}

/// Refuses to do a part of a stage that reads what the pipeline file would make otherwise now: the parts that others do
/// may read what was made anew.
fn refuse_stale(args: &StageArgs, stale: &[Stale], from: Stage) -> Result<(), UsageError> {
    let Some(first) = stale.first() else { return Ok(()) };
    let (pipeline, out) = (shell_path(&args.pipeline), args.out.as_deref().map(shell_path));
    let out = out.map(|out| format!(" --out {out}")).unwrap_or_default();
    Err(UsageError(format!(
        "{from} would read what is of another plan: {first}; ntp run {pipeline}{out} makes it anew, and so does --begin \
         --force with each stage whose settings differ"
    )))
}

fn scope(args: &ScopeArgs) -> Scope {
    match args {
        ScopeArgs { items: Some(ItemRanges(ranges)), .. } => Scope::Items(ranges.clone()),
        ScopeArgs { part: Some(Part { part, of }), .. } => Scope::Part { part: *part, of: *of },
        ScopeArgs { shard: Some(shard), .. } => Scope::Shard(*shard),
        ScopeArgs { fetch: true, .. } => Scope::Fetch,
        ScopeArgs { begin: true, .. } => Scope::Begin,
        ScopeArgs { commit: true, wait, .. } => Scope::Commit { wait_secs: *wait },
        _ => Scope::Whole,
    }
}

/// Of which commit a file is, if it is under version control and git is there.
fn commit_of(file: &Path) -> Option<String> {
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let described = Command::new("git")
        .arg("-C")
        .arg(folder)
        .args(["describe", "--always", "--dirty", "--abbrev=10", "--exclude=*"])
        .stdin(Stdio::null())
        .stderr(Stdio::null())
        .output()
        .ok()?;
    let commit = String::from_utf8(described.stdout).ok()?;
    described.status.success().then(|| commit.trim().to_owned())
}

/// `--out`, or a folder of the pipeline's name.
pub(super) fn run_directory(out: Option<&Path>, file: &PipelineFile) -> PathBuf {
    out.map_or_else(|| Path::new("data/runs").join(file.name()), Path::to_owned)
}

pub(super) fn all_cores() -> usize {
    std::thread::available_parallelism().map_or(1, std::num::NonZero::get)
}

/// One unit in a line.
pub(super) fn line(report: &StageReport) -> String {
    let what = match report.status {
        Status::UpToDate => "up to date".to_owned(),
        Status::Done => format!("done (before: {})", report.reason),
        Status::ShardDone | Status::Fetched => report.reason.clone(),
        Status::Begun => format!("begun ({})", report.reason),
        Status::Needed => format!("to do: {}", report.reason),
        Status::Missing => report.reason.clone(),
        Status::Failed => format!("failed: {}", report.reason),
    };
    let shard = report.shard.map(|shard| format!(" shard {shard} of {}", report.shards)).unwrap_or_default();
    let episodes = match (report.episodes, report.failed) {
        (0, _) => String::new(),
        (episodes, 0) => format!("  {}", counted(episodes, "episode")),
        (episodes, failed) => format!("  {}, {failed} failed", counted(episodes, "episode")),
    };
    let experiment = report.experiment.as_ref().map(|name| format!("{name}: ")).unwrap_or_default();
    let name = format!("{experiment}{}{shard}", report.unit);
    let name = if std::io::stdout().is_terminal() { format!("{name:<52}") } else { name };
    format!("{name}  {what}{episodes}")
}

/// What a dry run found to do, stage by stage: `left: train 3 of 84, rollout 40 of 620`.
fn left(reports: &[StageReport]) -> String {
    let of_stage = |stage: Stage| {
        let own = || reports.iter().filter(move |report| report.stage == stage);
        let n_needed = own().filter(|report| report.status == Status::Needed).count();
        (n_needed > 0).then(|| format!("{} {n_needed} of {}", stage.name(), own().count()))
    };
    let stages: Vec<String> = Stage::ALL.into_iter().filter_map(of_stage).collect();
    if stages.is_empty() { "nothing is left to do".to_owned() } else { format!("left: {}", stages.join(", ")) }
}

/// What failed or is missing, by stage and item: `generate: 2 items failed: 3,17`.
fn undone(reports: &[StageReport]) -> Option<String> {
    let stage = reports.last()?.stage;
    let failed = reports.iter().filter(|report| report.status == Status::Failed).filter_map(|report| report.item);
    let missing = reports.iter().flat_map(|report| report.missing.iter().copied());
    let told = |numbers: Vec<u64>, what: [&str; 2]| {
        let count = numbers.len();
        let items: ItemRanges = numbers.into_iter().collect();
        let verb = if count == 1 { what[0] } else { what[1] };
        (count > 0).then(|| format!("{stage}: {} {verb}: {items}", counted(count, "item")))
    };
    told(failed.collect(), ["failed"; 2]).or_else(|| told(missing.collect(), ["is missing", "are missing"]))
}

/// Demonstrations that failed are left out of the dataset; rollouts that failed are a result.
pub(super) fn outcome(reports: &[StageReport]) -> CommandOutcome {
    if let Some(left) = undone(reports) {
        output::note(&left);
        return CommandOutcome::CheckFailed;
    }
    let left_out: u64 =
        reports.iter().filter(|report| report.stage == Stage::Convert).map(|report| report.failed).sum();
    if left_out == 0 {
        return CommandOutcome::Done;
    }
    output::note(&format!("left out of the dataset: {}", counted(left_out, "failed demonstration")));
    CommandOutcome::LeftOut
}
