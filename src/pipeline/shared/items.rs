//! Items done by this process: each by itself, so that one that fails keeps no other from being done.

use std::collections::BTreeSet;

use rayon::iter::{IntoParallelIterator as _, ParallelIterator as _};

use crate::artifact::{ContractError, FileEntry};
use crate::pipeline::costs::Measured;
use crate::pipeline::failures::{self, Failure};
use crate::pipeline::items::{ItemRanges, Numbered};
use crate::pipeline::runner::{finish, report_of, run_shard};
use crate::pipeline::shared::{commit_unit, is_committed, plan_of, settle};
use crate::pipeline::stored::Stored;
use crate::pipeline::unit::{Context, Job, Worker, open};
use crate::pipeline::{Options, Pipeline, PipelineError, Scope, StageReport, Status};
use crate::progress::Stopwatch;
use crate::words::counted;

/// Does items, and goes on with the others where one fails.
pub(super) fn run_items(
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
        let plan = match plan_of(context, unit) {
            Err(PipelineError::Contract(missing @ ContractError::Unfinished { .. })) => {
                return self.report_missing(&shards, &missing);
            }
            plan => plan?,
        };
        let plan = settle(context, unit, plan)?;
        let job = Job::new(context, unit, plan, &[], options.force);
        let done = self.done(&job, &shards)?;
        let mut reports = Vec::new();
        let mut left = Vec::new();
        for shard in shards {
            match done.contains(&shard) {
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

    /// The shards that are done: what has one shard alone, with its commit; in a store, what it has a receipt of.
    fn done(&self, job: &Job<'_>, shards: &[u32]) -> Result<BTreeSet<u32>, PipelineError> {
        let (unit, stored) = (self.numbered.unit.as_ref(), Stored::of(self.context));
        let is_committed = (unit.shards() == 1 || stored.is_some()) && is_committed(self.context, unit, &job.plan)?;
        match stored {
            Some(_) if is_committed => Ok(shards.iter().copied().collect()),
            Some(stored) => {
                let kept: BTreeSet<u32> = stored.receipts(&job.dir, &job.plan, shards)?.into_keys().collect();
                Self::forget_damaged(job, shards.iter().filter(|shard| !kept.contains(shard)))?;
                Ok(if unit.shards() == 1 { BTreeSet::new() } else { kept })
            }
            None if unit.shards() == 1 && !is_committed => Ok(BTreeSet::new()),
            None => {
                let mut done = BTreeSet::new();
                for &shard in shards {
                    done.extend(job.is_done(shard)?.then_some(shard));
                }
                Ok(done)
            }
        }
    }

    /// What was done here before and could not be kept in the store is done again where it is not whole.
    fn forget_damaged<'s>(job: &Job<'_>, shards: impl Iterator<Item = &'s u32>) -> Result<(), PipelineError> {
        for &shard in shards {
            let is_damaged = |file: &FileEntry| job.dir.check_file(file, true).is_err();
            if job.receipt(shard)?.is_some_and(|receipt| receipt.files.iter().any(is_damaged)) {
                job.dir.forget_shard(shard)?;
            }
        }
        Ok(())
    }

    /// What cannot be done before a stage that it reads: other units may have what they need.
    fn report_missing(&self, shards: &[u32], missing: &ContractError) -> Result<Vec<StageReport>, PipelineError> {
        let report = |&shard: &u32| match self.context.options.dry_run {
            true => Ok(self.report(shard, Status::Needed, &missing.to_string())),
            false => self.report_made(shard, Err(PipelineError::Inputs(missing.to_string()))),
        };
        shards.iter().map(report).collect()
    }

    fn work(&self, job: &Job<'_>, shards: Vec<u32>) -> Result<Vec<StageReport>, PipelineError> {
        let Self { context, pipeline, numbered } = self;
        let unit = numbered.unit.as_ref();
        let watch = Stopwatch::start();
        let worked = self.attempt(job, &shards);
        let commit = (context.options.commit)(&pipeline.path);
        let measured = Measured { stage: unit.stage(), unit: &unit.name(), plan: &job.plan, commit };
        let noted = measured.note(context.dir, watch.taken(), job.done())?;
        if let (Some(stored), Some(path)) = (Stored::of(context), noted) {
            stored.keep_note(&path)?;
        }
        let mut reports = Vec::new();
        for (shard, made) in shards.into_iter().zip(worked) {
            reports.push(self.report_made(shard, made)?);
        }
        Ok(reports)
    }

    /// Does shards; whether each was done here.
    fn attempt(&self, job: &Job<'_>, shards: &[u32]) -> Vec<Result<bool, PipelineError>> {
        let unit = self.numbered.unit.as_ref();
        let worker = match self.bring_inputs().and_then(|()| open(unit, job)) {
            Ok(worker) => worker,
            Err(error) => return shards.iter().map(|_| Err(PipelineError::Inputs(error.to_string()))).collect(),
        };
        let run = |shard: u32| self.run_shard(job, worker.as_ref(), shard);
        let worked = shards.to_vec().into_par_iter().map(run).collect();
        if unit.shards() > 1 {
            job.progress.finish(&format!("{} of {}", job.done().len(), counted(unit.shards(), "shard")));
        }
        worked
    }

    fn bring_inputs(&self) -> Result<(), PipelineError> {
        Stored::of(self.context).map_or(Ok(()), |stored| stored.bring_inputs(self.numbered.unit.as_ref()))
    }

    /// Does a shard, and keeps it in the store if there is one. What has one shard alone is finished with it.
    fn run_shard(&self, job: &Job<'_>, worker: &dyn Worker, shard: u32) -> Result<bool, PipelineError> {
        let unit = self.numbered.unit.as_ref();
        let made = run_shard(unit, job, worker, shard)?;
        let Some(stored) = Stored::of(self.context) else {
            if unit.shards() == 1 {
                finish(unit, job, made.as_ref().and_then(|made| made.told.clone()))?;
            }
            return Ok(made.is_some());
        };
        let is_first = stored.keep_shard(&job.dir, shard)?;
        if !is_first {
            job.note_lost(shard);
        }
        if unit.shards() == 1 {
            commit_unit(self.context, self.numbered)?;
            job.progress.finish(&made.and_then(|made| made.told).unwrap_or_else(|| "done".to_owned()));
        }
        Ok(is_first)
    }

    fn report_made(&self, shard: u32, made: Result<bool, PipelineError>) -> Result<StageReport, PipelineError> {
        let (run, stage) = (self.context.dir, self.numbered.unit.stage());
        let item = self.numbered.numbers.start + u64::from(shard);
        match made {
            Err(PipelineError::Interrupted) => Err(PipelineError::Interrupted),
            Err(error) => {
                let message = error.to_string();
                self.note_failure(item, shard, &message)?;
                Ok(self.report(shard, Status::Failed, &message))
            }
            Ok(is_done_here) => {
                Failure::forget(run, stage, item);
                let reason = if is_done_here { "done" } else { "another process was first" };
                Ok(self.report(shard, Status::ShardDone, reason))
            }
        }
    }

    fn note_failure(&self, item: u64, shard: u32, message: &str) -> Result<(), PipelineError> {
        let (run, stage) = (self.context.dir, self.numbered.unit.stage());
        let (stored, path) = (Stored::of(self.context), failures::path(run, stage, item));
        stored.map_or(Ok(()), |stored| stored.bring_note(&path))?;
        let (unit, message) = (self.numbered.unit.name(), message.to_owned());
        Failure { item, unit, shard, message, attempts: 0, node: None }.note(run, stage)?;
        stored.map_or(Ok(()), |stored| stored.keep_note(&path))
    }

    fn report(&self, shard: u32, status: Status, reason: &str) -> StageReport {
        let item = Some(self.numbered.numbers.start + u64::from(shard));
        let report = report_of(self.context, self.numbered.unit.as_ref(), status, reason.to_owned());
        StageReport { item, shard: Some(shard), ..report }
    }
}
