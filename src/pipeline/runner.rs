//! Runs stages in order; skips what is up to date, and says why it does not.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use rayon::iter::{IntoParallelIterator as _, ParallelIterator as _};

use crate::artifact::{ContractError, IoError, LockError, Plan, RunLock, remove_partials};
use crate::feature::Feature;
use crate::pipeline::costs::{Costs, Measured};
use crate::pipeline::unit::{Context, Job, Made, Unit, Worker, open};
use crate::pipeline::{
    Options, Pipeline, PipelineError, RunDir, Scope, Stage, StageReport, Status, Study, report, rollout, shared, train,
    upstream,
};
use crate::progress::Stopwatch;
use crate::words::counted;

/// Runs the chosen stages.
///
/// # Errors
///
/// The first thing that went wrong; what was committed before stays.
pub fn run(pipeline: &Pipeline, dir: &RunDir, options: &Options) -> Result<Vec<StageReport>, PipelineError> {
    run_experiment(pipeline, dir, options, &mut ToDo::default())
}

/// In a dry run: the folders that would be made anew, each with its stage. What reads one of them is to do as well.
#[derive(Default)]
struct ToDo(BTreeMap<PathBuf, Stage>);

impl ToDo {
    /// What comes before a unit, as a reason.
    fn before(&self, unit: &dyn Unit, run: &RunDir) -> Option<String> {
        let stage = unit.reads(run).iter().find_map(|dir| self.0.get(dir.path()).copied())?;
        Some(format!("{stage} comes first"))
    }

    fn note(&mut self, unit: &dyn Unit, run: &RunDir, report: &StageReport) {
        if report.status == Status::Needed {
            self.0.insert(unit.dir(run).path().to_owned(), unit.stage());
        }
    }
}

fn run_experiment(
    pipeline: &Pipeline,
    dir: &RunDir,
    options: &Options,
    to_do: &mut ToDo,
) -> Result<Vec<StageReport>, PipelineError> {
    check_scope(pipeline, options)?;
    check_device(options)?;
    let dir = &if options.store.is_some() { dir.clone().with_files_elsewhere() } else { dir.clone() };
    let _lock = lock(dir, options)?;
    if !options.dry_run && !options.is_shared() {
        remove_partials(dir.root())?;
    }
    if let Some(store) = options.store.as_ref().filter(|_| !options.dry_run) {
        store.check_conditions()?;
    }
    let pool = pool(&pipeline.path, options)?;
    let context = Context { dir, options };
    let mut reports = Vec::new();
    for stage in Stage::ALL.into_iter().filter(|stage| (options.from..=options.to).contains(stage)) {
        let stage_units = units(pipeline, stage);
        let of_stage = pool.install(|| match (&options.scope, &options.store) {
            (Scope::Whole, None) => run_units(&context, &pipeline.path, stage_units, to_do),
            _ => shared::run_units(&context, pipeline, stage_units),
        })?;
        if options.progress && !options.dry_run {
            of_stage.iter().filter(|report| report.status == Status::UpToDate).for_each(say_up_to_date);
        }
        let is_left = of_stage.iter().any(|report| matches!(report.status, Status::Failed | Status::Missing));
        reports.extend(of_stage);
        if is_left {
            break;
        }
    }
    Ok(reports)
}

/// Runs the chosen stages of every experiment of a study, each in a folder of its name; then the study's own models and
/// what they act, and the report of them all.
///
/// # Errors
///
/// As [`run`]; [`PipelineError::Value`] for items, which are of one experiment.
pub fn run_study(study: &Study, dir: &RunDir, options: &Options) -> Result<Vec<StageReport>, PipelineError> {
    if options.store.is_some() {
        return Err(value(&study.path, "--store", "is of one experiment: give its own file".to_owned()));
    }
    let is_report_alone = options.from == Stage::Report;
    if options.scope != Scope::Whole && !is_report_alone {
        let problem = "is of one experiment: give its own file, and --out DIR/EXPERIMENT".to_owned();
        return Err(value(&study.path, options.scope.option(), problem));
    }
    let _lock = lock(dir, options)?;
    let (mut reports, mut to_do) = (Vec::new(), ToDo::default());
    for pipeline in &study.experiments {
        let options = Options { experiment: Some(pipeline.spec.name.clone()), ..options.clone() };
        reports.extend(run_experiment(pipeline, &dir.experiment(&pipeline.spec.name), &options, &mut to_do)?);
    }
    reports.extend(run_models(study, dir, options, &mut to_do)?);
    if options.to == Stage::Report {
        let own = upstream::boxed(vec![report::of_study(study)]);
        reports.extend(run_units(&Context { dir, options }, &study.path, own, &mut to_do)?);
    }
    Ok(reports)
}

/// Trains the study's own models, and lets them act the suites of its experiments.
fn run_models(
    study: &Study,
    dir: &RunDir,
    options: &Options,
    to_do: &mut ToDo,
) -> Result<Vec<StageReport>, PipelineError> {
    let is_asked_for = |stage| (options.from..=options.to).contains(&stage);
    let mut reports = Vec::new();
    if is_asked_for(Stage::Train) {
        let models = upstream::boxed(train::units_of_study(study));
        let context = Context { dir, options };
        reports.extend(pool(&study.path, options)?.install(|| run_units(&context, &study.path, models, to_do))?);
    }
    for pipeline in study.experiments.iter().filter(|_| is_asked_for(Stage::Rollout)) {
        let suites = upstream::boxed(rollout::units_of_study(study, pipeline));
        let own = dir.experiment(&pipeline.spec.name);
        let options = Options { experiment: Some(pipeline.spec.name.clone()), ..options.clone() };
        let _lock = if suites.is_empty() { None } else { lock(&own, &options)? };
        let context = Context { dir: &own, options: &options };
        reports.extend(pool(&study.path, &options)?.install(|| run_units(&context, &study.path, suites, to_do))?);
    }
    Ok(reports)
}

fn value(path: &Path, key: &str, problem: String) -> PipelineError {
    PipelineError::Value { path: path.to_owned(), key: key.to_owned(), problem }
}

fn pool(path: &Path, options: &Options) -> Result<rayon::ThreadPool, PipelineError> {
    rayon::ThreadPoolBuilder::new().num_threads(options.jobs).build().map_err(|error| PipelineError::Value {
        path: path.to_owned(),
        key: "--jobs".to_owned(),
        problem: error.to_string(),
    })
}

/// The units of a stage, in the pipeline file's order.
pub(super) fn units(pipeline: &Pipeline, stage: Stage) -> Vec<Box<dyn Unit + '_>> {
    match stage {
        Stage::Report => upstream::boxed(report::units(pipeline)),
        stage => upstream::units(pipeline, stage),
    }
}

/// Refuses what the chosen stages cannot be asked for.
fn check_scope(pipeline: &Pipeline, options: &Options) -> Result<(), PipelineError> {
    let Options { from, to, ref scope, dry_run, force, .. } = *options;
    if force && options.store.is_some() {
        let problem = "is of no use with --store: nothing in a store is removed; allowed is another --store";
        return Err(value(&pipeline.path, "--force", problem.to_owned()));
    }
    // Before hours of work, and not after them.
    if to == Stage::Report && !dry_run {
        Feature::Report.require()?;
    }
    let problem = match scope {
        _ if from > to => Some(("--from", format!("is {from}, which comes after --to {to}"))),
        Scope::Whole => None,
        Scope::Fetch if options.store.is_some() => None,
        Scope::Fetch => {
            return Err(value(&pipeline.path, "--fetch", "is of a run in a store; it needs --store".into()));
        }
        scope if from != to => Some((scope.option(), "is of one stage, and this command runs several".to_owned())),
        Scope::Shard(_) if !to.has_shards() => Some((scope.option(), format!("is of no use to {to}, which has none"))),
        _ => None,
    };
    let Some((key, problem)) = problem else { return Ok(()) };
    let with_shards = Stage::ALL.into_iter().filter(|stage| stage.has_shards()).map(Stage::name);
    let allowed = match key {
        "--from" => "stages run in the order tasks, generate, convert, train, rollout, report".to_owned(),
        _ => format!("stages with shards are {}", with_shards.collect::<Vec<_>>().join(", ")),
    };
    Err(value(&pipeline.path, key, format!("{problem}; {allowed}")))
}

/// Refuses a device that cannot be used, where one is needed.
fn check_device(options: &Options) -> Result<(), PipelineError> {
    let is_needed = options.from <= Stage::Rollout && options.to >= Stage::Train && !options.dry_run;
    if is_needed {
        options.device.open()?;
    }
    Ok(())
}

/// A whole run has its directory alone and clears away what a killed one left; items are done side by side.
fn lock(dir: &RunDir, options: &Options) -> Result<Option<RunLock>, PipelineError> {
    if options.dry_run {
        return Ok(None);
    }
    if options.is_shared() {
        return shared::lock(dir, options);
    }
    match RunLock::take(dir.root()) {
        Err(LockError::Unsupported { .. }) if options.no_lock => Ok(None),
        lock => Ok(Some(lock?)),
    }
}

fn say_up_to_date(report: &StageReport) {
    let experiment = report.experiment.as_ref().map(|name| format!("{name}: ")).unwrap_or_default();
    crate::progress::say(&format!("{experiment}{}: up to date", report.unit));
}

/// Runs whole units, one after the other.
fn run_units(
    context: &Context<'_>,
    pipeline: &Path,
    units: Vec<Box<dyn Unit + '_>>,
    to_do: &mut ToDo,
) -> Result<Vec<StageReport>, PipelineError> {
    // All are planned before the first is run: what is missing of one is told at once. One that reads what another of them
    // makes is planned after that.
    let mut made = BTreeSet::new();
    let plan = |unit: &dyn Unit| {
        let is_later = unit.reads(context.dir).iter().any(|dir| made.contains(dir.path()));
        made.insert(unit.dir(context.dir).path().to_owned());
        if is_later { Ok(None) } else { Planned::of(context, unit).map(Some) }
    };
    let planned: Vec<Option<Planned>> =
        units.iter().map(Box::as_ref).map(plan).collect::<Result<_, PipelineError>>()?;
    let run = |(unit, planned): (&dyn Unit, Option<Planned>)| {
        let planned = match (to_do.before(unit, context.dir), planned) {
            (Some(reason), _) => Planned::Behind(reason),
            (None, Some(planned)) => planned,
            (None, None) => Planned::of(context, unit)?,
        };
        let report = match planned {
            Planned::Known(plan) => run_unit(context, pipeline, unit, *plan)?,
            Planned::Behind(reason) => report_of(context, unit, Status::Needed, reason),
        };
        to_do.note(unit, context.dir, &report);
        Ok(report)
    };
    units.iter().map(Box::as_ref).zip(planned).map(run).collect()
}

/// What is known of a unit's plan.
enum Planned {
    Known(Box<Plan>),
    /// In a dry run: what comes first.
    Behind(String),
}

impl Planned {
    fn of(context: &Context<'_>, unit: &dyn Unit) -> Result<Self, PipelineError> {
        match context.plan(unit) {
            Err(PipelineError::Contract(ContractError::Unfinished { stage, .. })) if context.options.dry_run => {
                Ok(Self::Behind(format!("{stage} comes first")))
            }
            plan => Ok(Self::Known(Box::new(plan?))),
        }
    }
}

fn run_unit(context: &Context<'_>, pipeline: &Path, unit: &dyn Unit, plan: Plan) -> Result<StageReport, PipelineError> {
    let Context { dir: run, options } = *context;
    let need = if options.force { Some("--force".to_owned()) } else { why_needed(context, unit, &plan)? };
    let (status, reason) = match need {
        None => (Status::UpToDate, "up to date".to_owned()),
        Some(reason) if options.dry_run => (Status::Needed, reason),
        Some(reason) => {
            context.go_on()?;
            let watch = Stopwatch::start();
            let shards: Vec<u32> = (0..plan.shards).collect();
            let job = Job::new(context, unit, plan, &shards, false);
            let worked = run_whole(unit, &job, shards);
            let commit = (options.commit)(pipeline);
            let measured = Measured { stage: unit.stage(), unit: &unit.name(), plan: &job.plan, commit };
            Costs::read(run)?.add(&measured, watch.taken(), job.done())?;
            worked?;
            (Status::Done, reason)
        }
    };
    let manifest = unit.dir(run).manifest()?.filter(|_| status != Status::Needed);
    let (episodes, failed) = manifest.map_or((0, 0), |manifest| (manifest.episodes, manifest.failed));
    Ok(StageReport { episodes, failed, ..report_of(context, unit, status, reason) })
}

/// Begins, does and commits a unit.
fn run_whole(unit: &dyn Unit, job: &Job<'_>, shards: Vec<u32>) -> Result<(), PipelineError> {
    let worker = open(unit, job)?;
    if job.context.options.force {
        job.dir.clear()?;
    }
    if !unit.appears_whole() {
        job.dir.begin(&job.plan)?;
    }
    let made: Result<Vec<Option<Made>>, PipelineError> =
        shards.into_par_iter().map(|shard| run_shard(unit, job, worker.as_ref(), shard)).collect();
    finish(unit, job, made?.into_iter().flatten().find_map(|made| made.told))
}

/// Does a shard unless it is done.
pub(super) fn run_shard(
    unit: &dyn Unit,
    job: &Job<'_>,
    worker: &dyn Worker,
    shard: u32,
) -> Result<Option<Made>, PipelineError> {
    if job.is_done(shard)? {
        job.progress.inc(unit.amount(shard).count);
        return Ok(None);
    }
    job.context.go_on()?;
    let made = worker.shard(shard)?;
    match &made {
        // Its receipt came with the folder.
        Some(_) if unit.appears_whole() => job.note_done(shard),
        Some(made) => job.commit_shard(shard, made)?,
        None => {}
    }
    Ok(made)
}

/// Commits a unit whose shards are done.
pub(super) fn finish(unit: &dyn Unit, job: &Job<'_>, told: Option<String>) -> Result<(), PipelineError> {
    let receipts = job.dir.all_receipts(&job.plan)?;
    let tables = unit.gather(job, &receipts)?;
    let manifest = job.dir.commit_receipts(&job.plan, receipts, &tables)?;
    job.progress.finish(&told.unwrap_or_else(|| unit.told(&manifest)));
    Ok(())
}

pub(super) fn report_of(context: &Context<'_>, unit: &dyn Unit, status: Status, reason: String) -> StageReport {
    StageReport {
        experiment: context.options.experiment.clone(),
        stage: unit.stage(),
        unit: unit.name(),
        item: None,
        shard: None,
        shards: unit.shards(),
        status,
        reason,
        missing: Vec::new(),
        episodes: 0,
        failed: 0,
    }
}

/// Why a unit must be done; nothing when it is up to date.
pub(super) fn why_needed(context: &Context<'_>, unit: &dyn Unit, plan: &Plan) -> Result<Option<String>, IoError> {
    let dir = unit.dir(context.dir);
    let Some(own) = dir.plan()? else { return Ok(Some("not done yet".to_owned())) };
    if let Some(difference) = own.difference(plan) {
        return Ok(Some(match dir.count_receipts()? {
            0 => difference,
            receipts => format!("{difference}; it loses {}", counted(receipts, "finished shard")),
        }));
    }
    let Some(manifest) = dir.manifest()? else {
        return Ok(Some("begun but not finished".to_owned()));
    };
    Ok(dir.check_files(&manifest, false).err().map(|error| error.to_string()))
}
