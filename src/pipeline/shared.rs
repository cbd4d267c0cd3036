//! Work that processes share: plans begun, items done, units committed, each by a process of its own.
//!
//! # Invariants
//!
//! An item joins a plan or is refused; it removes nothing that it has not made. A commit does no work. Where the file
//! system has locks, items and commits share that of the run directory, so that no whole run clears away what they
//! are writing; where it has none they go on, since names are taken once and receipts decide. Where the run is in a
//! store, done is what the store has a receipt of.

mod items;

use std::time::Duration;

use crate::artifact::{ContractError, LockError, Plan, Receipt, RunLock, StageDir, remove_partials};
use crate::pipeline::items::{ItemRanges, Numbered, number};
use crate::pipeline::runner::{report_of, why_needed};
use crate::pipeline::shared::items::run_items;
use crate::pipeline::stored::Stored;
use crate::pipeline::unit::{Context, Job, Unit};
use crate::pipeline::{Options, Pipeline, PipelineError, RunDir, Scope, StageReport, Status};
use crate::progress::{self, Stopwatch};
use crate::words::counted;

/// After which time it is looked again for what is missing, or held by another.
const LOOK_AGAIN: Duration = Duration::from_millis(250);
/// How long it is waited for a process that has the run directory alone.
const MOST_WAITED_SECS: f64 = 2.0;

/// The lock of items and commits: together with others. A commit clears away what killed processes left, if nobody else
/// is there; whoever meets it then waits a moment.
pub(super) fn lock(dir: &RunDir, options: &Options) -> Result<Option<RunLock>, PipelineError> {
    if matches!(options.scope, Scope::Commit { .. })
        && let Ok(_alone) = RunLock::take(dir.root())
    {
        remove_partials(dir.root())?;
    }
    let watch = Stopwatch::start();
    loop {
        match RunLock::share(dir.root()) {
            Err(LockError::Held { .. }) if watch.taken().wall_secs < MOST_WAITED_SECS => {
                std::thread::sleep(LOOK_AGAIN);
            }
            Err(LockError::Unsupported { source, .. }) => {
                say_no_locks(dir, options, &source);
                return Ok(None);
            }
            lock => return Ok(Some(lock?)),
        }
    }
}

fn say_no_locks(dir: &RunDir, options: &Options, source: &std::io::Error) {
    if options.progress {
        let place = dir.root().display();
        progress::say(&format!("{place} has no file locks ({source}); receipts alone decide whose work counts"));
    }
}

/// Does what was asked for of a stage.
pub(super) fn run_units(
    context: &Context<'_>,
    pipeline: &Pipeline,
    units: Vec<Box<dyn Unit + '_>>,
) -> Result<Vec<StageReport>, PipelineError> {
    let numbered = number(units);
    match context.options.scope {
        Scope::Whole => run_whole(context, pipeline, &numbered),
        Scope::Begin => numbered.iter().map(|numbered| begin(context, numbered.unit.as_ref())).collect(),
        Scope::Commit { wait_secs } => commit(context, &numbered, wait_secs),
        Scope::Fetch => numbered.iter().map(|numbered| fetch(context, numbered)).collect(),
        _ => run_items(context, pipeline, &numbered),
    }
}

/// Does every item that is left, then commits.
fn run_whole(
    context: &Context<'_>,
    pipeline: &Pipeline,
    numbered: &[Numbered<'_>],
) -> Result<Vec<StageReport>, PipelineError> {
    let done = run_items(context, pipeline, numbered)?;
    if context.options.dry_run || done.iter().any(|report| report.status == Status::Failed) {
        return Ok(done);
    }
    let is_new = |report: &&StageReport| report.status == Status::ShardDone;
    let is_done_now = |report: &StageReport| done.iter().filter(is_new).any(|done| done.unit == report.unit);
    let tell = |report: StageReport| match report.status {
        // What has one shard alone was committed with it.
        Status::UpToDate if is_done_now(&report) => {
            StageReport { status: Status::Done, reason: "not done yet".to_owned(), ..report }
        }
        _ => report,
    };
    Ok(commit(context, numbered, 0)?.into_iter().map(tell).collect())
}

/// Brings what is finished in the store.
fn fetch(context: &Context<'_>, numbered: &Numbered<'_>) -> Result<StageReport, PipelineError> {
    context.go_on()?;
    let unit = numbered.unit.as_ref();
    let dir = unit.dir(context.dir);
    let found = Stored::of(context).map_or(Ok(None), |stored| stored.bring_stage(&dir))?;
    let Some(manifest) = found else {
        let report = report_of(context, unit, Status::Missing, "not finished in the store".to_owned());
        return Ok(StageReport { missing: numbered.numbers.clone().collect(), ..report });
    };
    let report = report_of(context, unit, Status::Fetched, "fetched".to_owned());
    Ok(StageReport { episodes: manifest.episodes, failed: manifest.failed, ..report })
}

/// The plan of a unit, once what it reads is known here.
fn plan_of(context: &Context<'_>, unit: &dyn Unit) -> Result<Plan, PipelineError> {
    Stored::of(context).map_or(Ok(()), |stored| stored.bring_plans(unit))?;
    context.plan(unit)
}

/// The plan that all processes work by, once the unit's folder has it. A folder of another plan is refused.
fn settle(context: &Context<'_>, unit: &dyn Unit, plan: Plan) -> Result<Plan, PipelineError> {
    let dir = unit.dir(context.dir);
    if let Some(difference) = dir.plan()?.and_then(|own| own.difference(&plan)) {
        let again = match Stored::of(context) {
            Some(_) => format!("{difference}; a run in a store is begun anew by another --store and --out"),
            None => format!("{difference}; ntp {} --begin --force begins anew", plan.stage),
        };
        return Err(ContractError::OtherPlan { path: dir.path().to_owned(), difference: again }.into());
    }
    if context.options.dry_run {
        return Ok(plan);
    }
    let plan = Stored::of(context).map_or(Ok(plan.clone()), |stored| stored.settle(&dir, &plan))?;
    if !unit.appears_whole() {
        dir.join(&plan)?;
    }
    Ok(plan)
}

/// Writes the plan of a unit. What another plan has finished goes by `--force` alone, and in a store never.
fn begin(context: &Context<'_>, unit: &dyn Unit) -> Result<StageReport, PipelineError> {
    let Options { force, dry_run, .. } = *context.options;
    let plan = plan_of(context, unit)?;
    if Stored::of(context).is_some() {
        return begin_in_store(context, unit, plan);
    }
    let dir = unit.dir(context.dir);
    let difference = dir.plan()?.map(|own| own.difference(&plan));
    let receipts = dir.count_receipts()?;
    let reason = match difference {
        Some(None) if !force => return Ok(report_of(context, unit, Status::UpToDate, "up to date".to_owned())),
        Some(Some(difference)) if !force && receipts > 0 => {
            let difference =
                format!("{difference}; --force begins anew and removes its {}", counted(receipts, "finished shard"));
            return Err(ContractError::OtherPlan { path: dir.path().to_owned(), difference }.into());
        }
        Some(_) if receipts > 0 => format!("removed: {}", counted(receipts, "finished shard")),
        _ => "nothing was there".to_owned(),
    };
    if dry_run {
        return Ok(report_of(context, unit, Status::Needed, reason));
    }
    if difference.is_some() || receipts > 0 {
        dir.clear()?;
    }
    if !unit.appears_whole() {
        dir.join(&plan)?;
    }
    Ok(report_of(context, unit, Status::Begun, reason))
}

fn begin_in_store(context: &Context<'_>, unit: &dyn Unit, plan: Plan) -> Result<StageReport, PipelineError> {
    let is_begun = unit.dir(context.dir).plan()?.is_some();
    settle(context, unit, plan)?;
    let (status, reason) = match (is_begun, context.options.dry_run) {
        (true, _) => (Status::UpToDate, "up to date"),
        (false, true) => (Status::Needed, "nothing was there"),
        (false, false) => (Status::Begun, "nothing was there"),
    };
    Ok(report_of(context, unit, status, reason.to_owned()))
}

/// Commits every unit of a stage from its receipts; waits for those that are missing.
fn commit(context: &Context<'_>, numbered: &[Numbered<'_>], wait_secs: u64) -> Result<Vec<StageReport>, PipelineError> {
    let watch = Stopwatch::start();
    let mut reports = Vec::new();
    for numbered in numbered {
        loop {
            context.go_on()?;
            let report = commit_unit(context, numbered)?;
            if report.status != Status::Missing || watch.taken().wall_secs >= wait_secs as f64 {
                reports.push(report);
                break;
            }
            std::thread::sleep(LOOK_AGAIN);
        }
    }
    Ok(reports)
}

fn commit_unit(context: &Context<'_>, numbered: &Numbered<'_>) -> Result<StageReport, PipelineError> {
    let unit = numbered.unit.as_ref();
    let plan = plan_of(context, unit)?;
    let dir = unit.dir(context.dir);
    if let Some(difference) = dir.plan()?.and_then(|own| own.difference(&plan)) {
        return Err(ContractError::OtherPlan { path: dir.path().to_owned(), difference }.into());
    }
    if is_committed(context, unit, &plan)? {
        let manifest = dir.manifest()?;
        let (episodes, failed) = manifest.map_or((0, 0), |manifest| (manifest.episodes, manifest.failed));
        return Ok(StageReport { episodes, failed, ..report_of(context, unit, Status::UpToDate, "up to date".into()) });
    }
    let (receipts, missing) = receipts(context, &dir, &plan)?;
    if !missing.is_empty() {
        let missing: Vec<u64> = missing.into_iter().map(|shard| numbered.numbers.start + u64::from(shard)).collect();
        let items: ItemRanges = missing.iter().copied().collect();
        let reason = format!("{} of {} missing: {items}", missing.len(), counted(unit.shards(), "item"));
        return Ok(StageReport { missing, ..report_of(context, unit, Status::Missing, reason) });
    }
    if context.options.dry_run {
        return Ok(report_of(context, unit, Status::Needed, "not committed yet".to_owned()));
    }
    let job = Job::new(context, unit, plan, &[], false);
    if let Some(stored) = Stored::of(context) {
        let gathered = receipts.iter().flat_map(|receipt| &receipt.files).filter(|file| unit.gathers(&file.path));
        stored.bring_files(&dir, &gathered.collect::<Vec<_>>())?;
    }
    let tables = unit.gather(&job, &receipts)?;
    let manifest = dir.commit_receipts(&job.plan, receipts, &tables)?;
    Stored::of(context).map_or(Ok(()), |stored| stored.keep_manifest(&dir, &manifest, &tables))?;
    let report = report_of(context, unit, Status::Done, "committed".to_owned());
    Ok(StageReport { episodes: manifest.episodes, failed: manifest.failed, ..report })
}

fn is_committed(context: &Context<'_>, unit: &dyn Unit, plan: &Plan) -> Result<bool, PipelineError> {
    match Stored::of(context) {
        Some(stored) => stored.is_committed(&unit.dir(context.dir)),
        None => Ok(why_needed(context, unit, plan)?.is_none()),
    }
}

/// The receipts of a plan, and the shards that have none.
fn receipts(context: &Context<'_>, dir: &StageDir, plan: &Plan) -> Result<(Vec<Receipt>, Vec<u32>), PipelineError> {
    let Some(stored) = Stored::of(context) else { return Ok(dir.receipts(plan)?) };
    let shards: Vec<u32> = (0..plan.shards).collect();
    let kept = stored.receipts(dir, plan, &shards)?;
    let missing = shards.into_iter().filter(|shard| !kept.contains_key(shard)).collect();
    Ok((kept.into_values().collect(), missing))
}
