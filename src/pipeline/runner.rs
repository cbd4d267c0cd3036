//! Runs stages in order; skips what is up to date, and says why it does not.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use serde::Serialize;

use crate::artifact::{ContractError, IoError, Plan, RunLock, StageDir, remove_partials};
use crate::model::Decoder;
use crate::pipeline::costs::Costs;
use crate::pipeline::{
    Pipeline, PipelineError, RunDir, Stage, Study, convert, generate, report, rollout, tasks, train,
};
use crate::progress::Stopwatch;

/// What the command line chooses.
#[derive(Clone, Debug)]
pub struct Options {
    /// First stage.
    pub from: Stage,
    /// Last stage.
    pub to: Stage,
    /// Threads.
    pub jobs: usize,
    /// Only say what would be done.
    pub dry_run: bool,
    /// Do again what is up to date.
    pub force: bool,
    /// Only this shard of a stage that has shards.
    pub shard: Option<u32>,
    /// Whether progress is shown on stderr.
    pub progress: bool,
    /// Of which commit the pipeline file is, for the costs.
    pub commit: Option<String>,
    /// Which experiment of a study is run; `None` for one by itself.
    pub experiment: Option<String>,
    /// Set when the user presses Ctrl-C.
    pub stop: Arc<AtomicBool>,
}

/// What came of one unit of a stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// Nothing to do.
    UpToDate,
    /// Done now.
    Done,
    /// Would be done (with `--dry-run`).
    Needed,
}

/// What came of one unit of a stage, for people and for `--json`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct StageReport {
    /// Which experiment of a study; `None` for one by itself, and for the study's own report.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub experiment: Option<String>,
    /// The stage.
    pub stage: Stage,
    /// Which of its units: a model, a model's suite, or the stage's own name.
    pub unit: String,
    /// What came of it.
    pub status: Status,
    /// Why it was or would be done; `up to date` otherwise.
    pub reason: String,
    /// Episodes it holds.
    pub episodes: u64,
    /// How many of them failed.
    pub failed: u64,
}

/// One thing a stage makes: a folder by a plan.
pub(super) struct Unit {
    pub(super) name: String,
    pub(super) dir: StageDir,
    pub(super) plan: Plan,
    pub(super) part: Part,
}

/// Which unit of its stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    /// The only one.
    Whole,
    /// A model, by its place in the pipeline file and its seed.
    Model { model: usize, seed: u64 },
    /// A suite acted by a model, or by the oracle.
    Suite { actor: Option<ModelActor>, suite: usize },
}

/// A trained model with a way to decode: who acts a suite.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ModelActor {
    /// Its place in the pipeline file.
    pub(super) model: usize,
    /// The seed of its training.
    pub(super) seed: u64,
    /// How it decodes scopes.
    pub(super) decoder: Decoder,
}

/// What every stage is given.
pub(super) struct Context<'a> {
    pub(super) pipeline: &'a Pipeline,
    pub(super) dir: &'a RunDir,
    pub(super) options: &'a Options,
}

impl Context<'_> {
    /// Fails once the user has pressed Ctrl-C.
    pub(super) fn go_on(&self) -> Result<(), PipelineError> {
        if self.options.stop.load(Ordering::Relaxed) { Err(PipelineError::Interrupted) } else { Ok(()) }
    }

    /// The shards of a unit that are to be done: all, or the one that was asked for.
    pub(super) fn shards(&self, unit: &Unit) -> Result<Vec<u32>, PipelineError> {
        let n_shards = unit.plan.shards;
        match self.options.shard {
            None => Ok((0..n_shards).collect()),
            Some(shard) if shard < n_shards => Ok(vec![shard]),
            Some(shard) => Err(PipelineError::Value {
                path: self.pipeline.path.clone(),
                key: "--shard".to_owned(),
                problem: format!("is {shard}; {} has shards 0 to {}", unit.name, n_shards.saturating_sub(1)),
            }),
        }
    }

    /// Progress of one unit.
    pub(super) fn progress(&self, unit: &Unit, total: u64, what: &str) -> crate::progress::Progress {
        if self.options.progress {
            let experiment = self.options.experiment.as_ref().map(|name| format!("{name}: ")).unwrap_or_default();
            crate::progress::Progress::new(&format!("{experiment}{}", unit.name), total, what)
        } else {
            crate::progress::Progress::hidden()
        }
    }
}

/// Runs the chosen stages.
///
/// # Errors
///
/// The first thing that went wrong; what was committed before stays.
pub fn run(pipeline: &Pipeline, dir: &RunDir, options: &Options) -> Result<Vec<StageReport>, PipelineError> {
    let _lock = lock(dir, options)?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(options.jobs).build().map_err(|error| {
        PipelineError::Value { path: pipeline.path.clone(), key: "--jobs".to_owned(), problem: error.to_string() }
    })?;
    let context = Context { pipeline, dir, options };
    let mut reports = Vec::new();
    for stage in Stage::ALL.into_iter().filter(|stage| (options.from..=options.to).contains(stage)) {
        let done_before = reports.len();
        pool.install(|| run_stage(&context, stage, &mut reports))?;
        let shown = &reports[done_before..];
        if options.progress && !options.dry_run {
            shown.iter().filter(|report| report.status == Status::UpToDate).for_each(say_up_to_date);
        }
    }
    Ok(reports)
}

/// Runs the chosen stages of every experiment of a study, each in a folder of its name, then the report of them all.
///
/// # Errors
///
/// As [`run`]; [`PipelineError::Value`] for `--shard`, which is of one experiment.
pub fn run_study(study: &Study, dir: &RunDir, options: &Options) -> Result<Vec<StageReport>, PipelineError> {
    if options.shard.is_some() {
        let problem = "is of one experiment: give its own file, and --out DIR/EXPERIMENT".to_owned();
        return Err(PipelineError::Value { path: study.path.clone(), key: "--shard".to_owned(), problem });
    }
    let _lock = if options.dry_run { None } else { Some(RunLock::take(dir.root())?) };
    let mut reports = Vec::new();
    for pipeline in &study.experiments {
        let options = Options { experiment: Some(pipeline.spec.name.clone()), ..options.clone() };
        reports.extend(run(pipeline, &dir.experiment(&pipeline.spec.name), &options)?);
    }
    if options.to == Stage::Report {
        let units = report::study_units(study, dir, options);
        for unit in or_what_comes_first(options, Stage::Report, units, &mut reports)?.unwrap_or_default() {
            let work = || report::work_study(study, dir, options, &unit);
            reports.push(run_unit(dir, options, Stage::Report, &unit, work)?);
        }
    }
    Ok(reports)
}

/// A whole run has its directory alone and clears away what a killed one left; shards may be done side by side.
fn lock(dir: &RunDir, options: &Options) -> Result<Option<RunLock>, PipelineError> {
    if options.dry_run {
        return Ok(None);
    }
    if options.shard.is_some() {
        return Ok(Some(RunLock::share(dir.root())?));
    }
    let lock = RunLock::take(dir.root())?;
    remove_partials(dir.root())?;
    Ok(Some(lock))
}

fn say_up_to_date(report: &StageReport) {
    let experiment = report.experiment.as_ref().map(|name| format!("{name}: ")).unwrap_or_default();
    crate::progress::say(&format!("{experiment}{}: up to date", report.unit));
}

fn run_stage(context: &Context<'_>, stage: Stage, reports: &mut Vec<StageReport>) -> Result<(), PipelineError> {
    let Some(units) = or_what_comes_first(context.options, stage, units(context, stage), reports)? else {
        return Ok(());
    };
    for unit in units {
        context.go_on()?;
        reports.push(run_unit(context.dir, context.options, stage, &unit, || work(context, stage, &unit))?);
    }
    Ok(())
}

/// The units of a stage; in a dry run a line instead when another stage must come first.
fn or_what_comes_first(
    options: &Options,
    stage: Stage,
    units: Result<Vec<Unit>, PipelineError>,
    reports: &mut Vec<StageReport>,
) -> Result<Option<Vec<Unit>>, PipelineError> {
    match units {
        Err(PipelineError::Contract(ContractError::Unfinished { stage: before, .. })) if options.dry_run => {
            reports.push(StageReport {
                experiment: options.experiment.clone(),
                stage,
                unit: stage.name().to_owned(),
                status: Status::Needed,
                reason: format!("{before} comes first"),
                episodes: 0,
                failed: 0,
            });
            Ok(None)
        }
        units => units.map(Some),
    }
}

pub(super) fn units(context: &Context<'_>, stage: Stage) -> Result<Vec<Unit>, PipelineError> {
    match stage {
        Stage::Tasks => tasks::units(context),
        Stage::Generate => generate::units(context),
        Stage::Convert => convert::units(context),
        Stage::Train => train::units(context),
        Stage::Rollout => rollout::units(context),
        Stage::Report => report::units(context),
    }
}

fn work(context: &Context<'_>, stage: Stage, unit: &Unit) -> Result<(), PipelineError> {
    match stage {
        Stage::Tasks => tasks::work(context, unit),
        Stage::Generate => generate::work(context, unit),
        Stage::Convert => convert::work(context, unit),
        Stage::Train => train::work(context, unit),
        Stage::Rollout => rollout::work(context, unit),
        Stage::Report => report::work(context, unit),
    }
}

fn run_unit(
    dir: &RunDir,
    options: &Options,
    stage: Stage,
    unit: &Unit,
    work: impl FnOnce() -> Result<(), PipelineError>,
) -> Result<StageReport, PipelineError> {
    let need = if options.force { Some("--force".to_owned()) } else { why_needed(unit)? };
    let status = match (&need, options.dry_run) {
        (None, _) => Status::UpToDate,
        (Some(_), true) => Status::Needed,
        (Some(_), false) => {
            if options.force {
                unit.dir.clear()?;
            }
            let watch = Stopwatch::start();
            let worked = work();
            if options.shard.is_none() {
                let costs = Costs::read(dir)?;
                costs.add(dir, stage, (&unit.name, &unit.plan), watch.taken(), options.commit.as_deref())?;
            }
            worked?;
            Status::Done
        }
    };
    let manifest = unit.dir.manifest()?;
    let counts = manifest.filter(|_| status != Status::Needed).map_or((0, 0), |m| (m.episodes, m.failed));
    Ok(StageReport {
        experiment: options.experiment.clone(),
        stage,
        unit: unit.name.clone(),
        status,
        reason: need.unwrap_or_else(|| "up to date".to_owned()),
        episodes: counts.0,
        failed: counts.1,
    })
}

/// Why a unit must be done; nothing when it is up to date.
fn why_needed(unit: &Unit) -> Result<Option<String>, IoError> {
    let Some(plan) = unit.dir.plan()? else { return Ok(Some("not done yet".to_owned())) };
    if plan != unit.plan {
        return Ok(Some(plan_difference(&plan, &unit.plan)));
    }
    let Some(manifest) = unit.dir.manifest()? else {
        return Ok(Some("begun but not finished".to_owned()));
    };
    match unit.dir.check_files(&manifest, false) {
        Ok(()) => Ok(None),
        Err(error) => Ok(Some(error.to_string())),
    }
}

fn plan_difference(old: &Plan, new: &Plan) -> String {
    if old.ntp_version != new.ntp_version {
        return format!("made by ntp {}, this is {}", old.ntp_version, new.ntp_version);
    }
    if let Some(input) = changed_keys(&old.inputs, &new.inputs) {
        return format!("its input {input} changed");
    }
    match (old.config.as_object(), new.config.as_object()) {
        (Some(old_config), Some(new_config)) => {
            let flat = |map: &serde_json::Map<String, serde_json::Value>| {
                map.iter().map(|(key, value)| (key.clone(), value.to_string())).collect::<BTreeMap<_, _>>()
            };
            let changed = changed_keys(&flat(old_config), &flat(new_config));
            changed.map_or_else(|| "its plan changed".to_owned(), |key| format!("its setting {key} changed"))
        }
        _ => "its plan changed".to_owned(),
    }
}

fn changed_keys(old: &BTreeMap<String, String>, new: &BTreeMap<String, String>) -> Option<String> {
    let keys = old.keys().chain(new.keys().filter(|key| !old.contains_key(*key)));
    keys.into_iter().find(|key| old.get(*key) != new.get(*key)).cloned()
}
