//! `ntp act MODEL --demonstration PATH --robot ROBOT`.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use anyhow::Context as _;
use serde_json::{Value, json};

use crate::artifact::StageDir;
use crate::cli::ActArgs;
use crate::commands::replay::{self, Found};
use crate::commands::{CommandOutcome, UsageError, output};
use crate::deploy::{DeployError, Driver, Record, Recorded, Trials, rehearse, shown_task};
use crate::remote::{Session, connect};
use crate::rollout::RolloutEpisode;
use crate::task;
use crate::trace::{Actor, Episode, Provenance};
use crate::words::counted;

/// In place of a model: do what the demonstration shows.
const ORACLE: &str = "oracle";

pub(super) fn run(args: &ActArgs, stop: &Arc<AtomicBool>) -> anyhow::Result<CommandOutcome> {
    let demonstrations = demonstrations(args)?;
    let first = demonstrations.first().context("an episode that was found")?;
    let mut driver = match args.model.to_str() {
        Some(ORACLE) => Driver::Oracle,
        _ => Driver::load(&args.model, args.device.device, first)?,
    };
    let counts = args.counts.clone().unwrap_or_else(|| first.provenance.counts.clone());
    let trials = |demonstration| {
        let task = shown_task(demonstration)?;
        Ok::<_, DeployError>(Trials { task, demonstration, counts: counts.clone(), seed: args.seed })
    };
    let trials = demonstrations.iter().map(trials).collect::<Result<Vec<_>, _>>()?;
    let mut record = args.record.as_deref().map(Record::begin).transpose()?;
    let session = session(args, &trials[0], stop)?;
    let acted = match args.dry_run {
        true => {
            // Beside a result in JSON there is nothing else on standard output.
            let is_json = args.json;
            let tell = move |line: &str| {
                if is_json {
                    output::note(line);
                } else {
                    let _closed = output::print(line);
                }
            };
            let rehearsal = rehearse(&session, trials[0].task.family, tell)?;
            vec![trials[0].act(&mut driver, &rehearsal, 0, false)?]
        }
        false => act(args, &trials, &mut driver, &session, record.as_mut())?,
    };
    if let Some(record) = record {
        record.finish(&recorded(args, &trials, &driver, &session))?;
    }
    conclude(args, &session, &acted, asked(args, &trials), stop)
}

/// The expert's episodes that show what is to be done, all of one family.
fn demonstrations(args: &ActArgs) -> anyhow::Result<Vec<Episode>> {
    let mut demonstrations: Vec<Episode> = Vec::new();
    for Found { number, episode, .. } in replay::find(&args.demonstration, &args.episode)? {
        let place = format!("episode {number} of {}", args.demonstration.display());
        let Provenance { actor, family, .. } = &episode.provenance;
        if *actor != Actor::Expert || !episode.outcome.is_success() {
            let problem = format!("{place} is of {} and ended in {}", actor.name(), episode.outcome);
            return Err(UsageError(format!("{problem}; allowed: a success of the expert")).into());
        }
        if let Some(first) = demonstrations.first().filter(|first| first.provenance.family != *family) {
            let allowed = first.provenance.family.name();
            return Err(
                UsageError(format!("{place} is of {}; allowed with the first: {allowed}", family.name())).into()
            );
        }
        demonstrations.push(episode);
    }
    if args.reset || demonstrations.len() == 1 {
        return Ok(demonstrations);
    }
    Err(UsageError("several demonstrations need --reset: without it the robot acts once".to_owned()).into())
}

fn session(args: &ActArgs, trials: &Trials<'_>, stop: &Arc<AtomicBool>) -> anyhow::Result<Session> {
    let wire = connect(&args.robot, Arc::clone(stop)).with_context(|| format!("robot {}", args.robot))?;
    let (family, deadline) = (trials.task.family, Duration::from_secs(u64::from(args.deadline)));
    let scene = task::scene(family, &trials.counts);
    Ok(Session::begin(wire, &args.robot.to_string(), family, scene, deadline).map_err(DeployError::from)?)
}

/// How many trials are asked for.
fn asked(args: &ActArgs, demonstrated: &[Trials<'_>]) -> usize {
    demonstrated.len() * args.trials as usize
}

/// What the acted episodes depend on.
fn recorded<'a>(args: &ActArgs, trials: &'a [Trials<'a>], driver: &'a Driver, session: &'a Session) -> Recorded<'a> {
    let model = StageDir::new("train", &args.model).version().ok();
    Recorded { trials, driver, model, session, n_asked: asked(args, trials) }
}

/// Acts the trials of each demonstration, until the robot is lost. Each is recorded as soon as it has ended.
fn act(
    args: &ActArgs,
    demonstrated: &[Trials<'_>],
    driver: &mut Driver,
    session: &Session,
    mut record: Option<&mut Record>,
) -> Result<Vec<RolloutEpisode>, DeployError> {
    let mut acted = Vec::new();
    let each = demonstrated.iter().flat_map(|trials| (0..args.trials).map(move |_| trials));
    for (index, trials) in (0..).zip(each) {
        let rollout = match trials.act(driver, session, index, args.reset) {
            Ok(rollout) => rollout,
            // The robot was lost between two episodes: those before it are whole.
            Err(DeployError::Remote(_)) if !acted.is_empty() => break,
            Err(error) => return Err(error),
        };
        let words = in_words(index, &rollout);
        acted.push(rollout);
        if let Some(record) = &mut record {
            record.add(&recorded(args, demonstrated, driver, session), &acted)?;
        }
        output::note(&words);
        if session.lost().is_some() {
            break;
        }
    }
    Ok(acted)
}

fn in_words(index: u32, RolloutEpisode { episode, decisions, first_divergence, .. }: &RolloutEpisode) -> String {
    let secs = episode.frames.last().map_or(0.0, |frame| frame.time_nanos as f64 / 1e9);
    let divergence =
        first_divergence.map_or(String::new(), |divergence| format!("; leaves the expert at {divergence}"));
    let decisions = counted(*decisions, "decision");
    format!("trial {index}: {}, {decisions}, {secs:.1} s{divergence}", episode.outcome)
}

fn conclude(
    args: &ActArgs,
    session: &Session,
    acted: &[RolloutEpisode],
    n_asked: usize,
    stop: &AtomicBool,
) -> anyhow::Result<CommandOutcome> {
    let n_succeeded = acted.iter().filter(|rollout| rollout.episode.outcome.is_success()).count();
    let (robot, lost) = (session.robot(), session.lost());
    let recorded = args.record.as_deref().map(Path::display);
    if args.json {
        output::print_json(&json!({
            "robot": robot,
            "dry_run": args.dry_run,
            "trials": acted.iter().map(to_json).collect::<Vec<_>>(),
            "succeeded": n_succeeded,
            "lost": lost.as_ref().map(ToString::to_string),
            "recorded": args.record,
        }))?;
    } else {
        let to = recorded.map_or(String::new(), |folder| format!(" → {folder}"));
        let rehearsed = if args.dry_run { ", rehearsed in simulation" } else { "" };
        output::print(&format!("{robot}{rehearsed}: {n_succeeded} of {n_asked} succeeded{to}"))?;
    }
    if stop.load(Ordering::Relaxed) {
        return Err(DeployError::Interrupted.into());
    }
    if let Some(lost) = lost {
        return Err(DeployError::Remote(lost).into());
    }
    Ok(if n_succeeded == n_asked { CommandOutcome::Done } else { CommandOutcome::CheckFailed })
}

fn to_json(rollout: &RolloutEpisode) -> Value {
    let RolloutEpisode { episode, decisions, first_divergence, fault_decision, .. } = rollout;
    json!({
        "trial": episode.provenance.trial,
        "task_id": episode.provenance.task_id,
        "outcome": episode.outcome.to_string(),
        "decisions": decisions,
        "first_divergence": first_divergence.map(|divergence| divergence.decision),
        "fault_decision": fault_decision,
        "frames": episode.frames.len(),
        "secs": episode.frames.last().map(|frame| frame.time_nanos as f64 / 1e9),
    })
}
