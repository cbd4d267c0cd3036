//! Work that processes share: plans begun, items done, units committed, each by a process of its own.
//!
//! # Invariants
//!
//! An item joins a plan or is refused; it removes nothing that it has not made. A commit does no work. Where the file
//! system has locks, items and commits share that of the run directory, so that no whole run clears away what they
//! are writing; where it has none they go on, since names are taken once and receipts decide.

use std::time::Duration;

use rayon::iter::{IntoParallelIterator as _, ParallelIterator as _};

use crate::artifact::{ContractError, LockError, RunLock, remove_partials};
use crate::pipeline::costs::Measured;
use crate::pipeline::failures::Failure;
use crate::pipeline::items::{ItemRanges, Numbered, number};
use crate::pipeline::runner::{finish, report_of, run_shard, why_needed};
use crate::pipeline::unit::{Context, Job, Made, Unit, open};
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
        Scope::Begin => numbered.iter().map(|numbered| begin(context, numbered.unit.as_ref())).collect(),
        Scope::Commit { wait_secs } => commit(context, &numbered, wait_secs),
        _ => run_items(context, pipeline, &numbered),
    }
}

/// Writes the plan of a unit. What another plan has finished goes by `--force` alone.
fn begin(context: &Context<'_>, unit: &dyn Unit) -> Result<StageReport, PipelineError> {
    let Options { force, dry_run, .. } = *context.options;
    let plan = context.plan(unit)?;
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

/// Does items, and goes on with the others where one fails.
fn run_items(
    context: &Context<'_>,
    pipeline: &Pipeline,
    numbered: &[Numbered<'_>],
) -> Result<Vec<StageReport>, PipelineError> {
    let n_items = numbered.last().map_or(0, |last| last.numbers.end);
    check_asked(context, pipeline, numbered, n_items)?;
    let mut reports = Vec::new();
    for numbered in numbered {
        let shards = numbered.asked(&context.options.scope, n_items);
        if !shards.is_empty() {
            context.go_on()?;
            reports.extend(Items { context, pipeline, numbered }.run(shards)?);
        }
    }
    Ok(reports)
}

/// Refuses items that are not there.
fn check_asked(
    context: &Context<'_>,
    pipeline: &Pipeline,
    numbered: &[Numbered<'_>],
    n_items: u64,
) -> Result<(), PipelineError> {
    let Options { ref scope, to, .. } = *context.options;
    let most_shards = numbered.iter().map(|numbered| numbered.unit.shards()).max().unwrap_or(0);
    let (asked, what, n_there) = match scope {
        Scope::Shard(shard) => (shard.to_string(), "shards", u64::from(most_shards)),
        Scope::Items(ranges) => (ItemRanges(ranges.clone()).to_string(), "items", n_items),
        _ => return Ok(()),
    };
    let last_asked = match scope {
        Scope::Shard(shard) => u64::from(*shard),
        Scope::Items(ranges) => ranges.iter().map(|range| *range.end()).max().unwrap_or(0),
        _ => 0,
    };
    if last_asked < n_there {
        return Ok(());
    }
    let there = if n_there == 0 { format!("no {what}") } else { format!("{what} 0 to {}", n_there - 1) };
    let (key, problem) = (scope.option().to_owned(), format!("is {asked}; {to} has {there}"));
    Err(PipelineError::Value { path: pipeline.path.clone(), key, problem })
}

/// Items of one unit.
struct Items<'a> {
    context: &'a Context<'a>,
    pipeline: &'a Pipeline,
    numbered: &'a Numbered<'a>,
}

impl Items<'_> {
    fn run(&self, shards: Vec<u32>) -> Result<Vec<StageReport>, PipelineError> {
        let Self { context, numbered, .. } = self;
        let (unit, options) = (numbered.unit.as_ref(), context.options);
        let plan = match context.plan(unit) {
            Err(PipelineError::Contract(missing @ ContractError::Unfinished { .. })) => {
                return self.report_missing(&shards, &missing);
            }
            plan => plan?,
        };
        let job = Job::new(context, unit, plan, &[], options.force);
        self.join(&job)?;
        let mut reports = Vec::new();
        let mut left = Vec::new();
        for shard in shards {
            match job.is_done(shard)? {
                true => reports.push(self.report(shard, Status::UpToDate, "up to date")),
                false if options.dry_run => reports.push(self.report(shard, Status::Needed, "not done yet")),
                false => left.push(shard),
            }
        }
        if !left.is_empty() {
            let job = Job::new(context, unit, job.plan, &left, options.force);
            reports.extend(self.work(&job, left)?);
        }
        reports.sort_by_key(|report| report.item);
        Ok(reports)
    }

    /// What cannot be done before a stage that it reads: other units may have what they need.
    fn report_missing(&self, shards: &[u32], missing: &ContractError) -> Result<Vec<StageReport>, PipelineError> {
        let report = |&shard: &u32| match self.context.options.dry_run {
            true => Ok(self.report(shard, Status::Needed, &missing.to_string())),
            false => self.report_made(shard, Err(PipelineError::Inputs(missing.to_string()))),
        };
        shards.iter().map(report).collect()
    }

    /// Refuses a folder of another plan.
    fn join(&self, job: &Job<'_>) -> Result<(), PipelineError> {
        let own = job.dir.plan()?.and_then(|own| own.difference(&job.plan));
        if let Some(difference) = own {
            let again = format!("{difference}; ntp {} --begin --force begins anew", job.plan.stage);
            return Err(ContractError::OtherPlan { path: job.dir.path().to_owned(), difference: again }.into());
        }
        if !self.context.options.dry_run && !self.numbered.unit.appears_whole() {
            job.dir.join(&job.plan)?;
        }
        Ok(())
    }

    fn work(&self, job: &Job<'_>, shards: Vec<u32>) -> Result<Vec<StageReport>, PipelineError> {
        let Self { context, pipeline, numbered } = self;
        let unit = numbered.unit.as_ref();
        let watch = Stopwatch::start();
        let worked = self.attempt(job, &shards);
        let commit = (context.options.commit)(&pipeline.path);
        let measured = Measured { stage: unit.stage(), unit: &unit.name(), plan: &job.plan, commit };
        measured.note(context.dir, watch.taken(), job.done())?;
        let mut reports = Vec::new();
        for (shard, made) in shards.into_iter().zip(worked) {
            reports.push(self.report_made(shard, made)?);
        }
        Ok(reports)
    }

    /// Does shards; what comes of each.
    fn attempt(&self, job: &Job<'_>, shards: &[u32]) -> Vec<Result<Option<Made>, PipelineError>> {
        let unit = self.numbered.unit.as_ref();
        let worker = match open(unit, job) {
            Ok(worker) => worker,
            Err(error) => return shards.iter().map(|_| Err(PipelineError::Inputs(error.to_string()))).collect(),
        };
        let run = |shard: u32| {
            let made = run_shard(unit, job, worker.as_ref(), shard)?;
            // What has one shard alone is finished with it.
            if unit.shards() == 1 {
                finish(unit, job, made.as_ref().and_then(|made| made.told.clone()))?;
            }
            Ok(made)
        };
        let worked = shards.to_vec().into_par_iter().map(run).collect();
        if unit.shards() > 1 {
            job.progress.finish(&format!("{} of {}", job.done().len(), counted(unit.shards(), "shard")));
        }
        worked
    }

    fn report_made(&self, shard: u32, made: Result<Option<Made>, PipelineError>) -> Result<StageReport, PipelineError> {
        let (run, stage) = (self.context.dir, self.numbered.unit.stage());
        let item = self.numbered.numbers.start + u64::from(shard);
        match made {
            Err(PipelineError::Interrupted) => Err(PipelineError::Interrupted),
            Err(error) => {
                let message = error.to_string();
                let unit = self.numbered.unit.name();
                let failure = Failure { item, unit, shard, message: message.clone(), attempts: 0, node: None };
                failure.note(run, stage)?;
                Ok(self.report(shard, Status::Failed, &message))
            }
            Ok(made) => {
                Failure::forget(run, stage, item);
                let reason = if made.is_some() { "done" } else { "another process was first" };
                Ok(self.report(shard, Status::ShardDone, reason))
            }
        }
    }

    fn report(&self, shard: u32, status: Status, reason: &str) -> StageReport {
        let item = Some(self.numbered.numbers.start + u64::from(shard));
        let report = report_of(self.context, self.numbered.unit.as_ref(), status, reason.to_owned());
        StageReport { item, shard: Some(shard), ..report }
    }
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
    let plan = context.plan(unit)?;
    let dir = unit.dir(context.dir);
    if let Some(difference) = dir.plan()?.and_then(|own| own.difference(&plan)) {
        return Err(ContractError::OtherPlan { path: dir.path().to_owned(), difference }.into());
    }
    if why_needed(context, unit, &plan)?.is_none() {
        let manifest = dir.manifest()?;
        let (episodes, failed) = manifest.map_or((0, 0), |manifest| (manifest.episodes, manifest.failed));
        return Ok(StageReport { episodes, failed, ..report_of(context, unit, Status::UpToDate, "up to date".into()) });
    }
    let missing: Vec<u64> =
        dir.missing(&plan)?.into_iter().map(|shard| numbered.numbers.start + u64::from(shard)).collect();
    if !missing.is_empty() {
        let items: ItemRanges = missing.iter().copied().collect();
        let reason = format!("{} of {} missing: {items}", missing.len(), counted(unit.shards(), "item"));
        return Ok(StageReport { missing, ..report_of(context, unit, Status::Missing, reason) });
    }
    if context.options.dry_run {
        return Ok(report_of(context, unit, Status::Needed, "not committed yet".to_owned()));
    }
    let job = Job::new(context, unit, plan, &[], false);
    let tables = unit.gather(&job)?;
    let manifest = dir.commit(&job.plan, &tables)?;
    let report = report_of(context, unit, Status::Done, "committed".to_owned());
    Ok(StageReport { episodes: manifest.episodes, failed: manifest.failed, ..report })
}
