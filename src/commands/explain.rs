//! `ntp explain PATH`: where an episode, a frame or a model comes from.

use crate::cli::ExplainArgs;
use crate::commands::kind::Kind;
use crate::commands::{CommandOutcome, UsageError, output};
use crate::dataset::{CallFacts, EpisodeFacts, FrameFacts};
use crate::lineage::{EpisodeLineage, RecordingLineage, StageLineage, explain_episode, explain_model};
use crate::words::counted;

pub(super) fn run(args: &ExplainArgs) -> anyhow::Result<CommandOutcome> {
    match (Kind::of(&args.path)?, args.episode) {
        (Kind::Dataset, Some(episode)) => {
            let lineage = explain_episode(&args.path, episode, args.frame, &args.recordings)?;
            tell(args.json, &lineage, || episode_text(&lineage))?;
        }
        (Kind::Dataset, None) => {
            return Err(UsageError("explain needs --episode K of a dataset".to_owned()).into());
        }
        (Kind::Model, None) => {
            let lineage = explain_model(&args.path)?;
            tell(args.json, &lineage, || stage_text(&lineage, 0).join("\n"))?;
        }
        (kind, _) => {
            let problem = format!(
                "{} is {}; explain takes a dataset with --episode, or a model",
                args.path.display(),
                kind.name()
            );
            return Err(UsageError(problem).into());
        }
    }
    Ok(CommandOutcome::Done)
}

fn tell(as_json: bool, lineage: &impl serde::Serialize, text: impl FnOnce() -> String) -> anyhow::Result<()> {
    if as_json { output::print_json(lineage) } else { output::print(&text()) }
}

fn episode_text(lineage: &EpisodeLineage) -> String {
    let mut lines = Vec::new();
    lines.extend(lineage.frame.iter().flat_map(|frame| frame_text(frame, &lineage.episode)));
    lines.extend(facts_text(&lineage.episode, lineage.frame.is_none()));
    lines.extend(recording_text(&lineage.recording));
    if let Some(models) = &lineage.labels_predicted_by {
        lines.push(format!("labels: predictions of the model {models}; ntp/annotation.json tells more"));
    }
    match &lineage.dataset {
        Some(stage) => {
            lines.push("dataset".to_owned());
            lines.extend(stage_text(stage, 1));
        }
        None => lines.push("dataset: it has no plan.json, so nothing says what made it".to_owned()),
    }
    lines.join("\n")
}

fn frame_text(frame: &FrameFacts, episode: &EpisodeFacts) -> Vec<String> {
    let FrameFacts { frame_index, index, recording_frame, time_secs, .. } = frame;
    let kind = if frame.is_boundary { "boundary" } else { "between boundaries" };
    let mut lines = vec![
        format!("frame {frame_index} of episode {}: {kind}, {time_secs} s", episode.episode_index),
        format!("  row {index} of the dataset, in {}; frame {recording_frame} of the recording", episode.data_file),
        "  running".to_owned(),
    ];
    lines.extend(frame.stack.iter().map(|call| format!("    {}", call_text(call))));
    lines
}

fn call_text(call: &CallFacts) -> String {
    let argument = call.argument.as_ref().map(|argument| format!(" {argument}")).unwrap_or_default();
    let [begin, end] = call.frames;
    let indent = "  ".repeat(usize::from(call.depth));
    let scope = call.output.map_or_else(|| "none".to_owned(), |[begin, end]| format!("{begin}..{end}"));
    format!("{indent}call {}: {}{argument}, frames {begin}..{end}, scope {scope}", call.call_id, call.program)
}

fn facts_text(episode: &EpisodeFacts, with_calls: bool) -> Vec<String> {
    let EpisodeFacts { episode_index, task_id, task_text, family, split, trial, actor, outcome, n_frames, .. } =
        episode;
    let mut lines = vec![
        format!("episode {episode_index}: {task_text}"),
        format!(
            "  task {task_id} ({family}, {split}), trial {trial}, acted by {actor}, {outcome}, {}",
            counted(*n_frames, "frame")
        ),
    ];
    if with_calls {
        lines.extend(episode.calls.iter().map(|call| format!("  {}", call_text(call))));
    }
    lines.push(format!("recording {}: episode {} of its recordings", episode.recording, episode.recording_index));
    lines
}

fn recording_text(recording: &RecordingLineage) -> Vec<String> {
    let mut lines = vec![format!("  sha256 {}", recording.sha256)];
    lines.extend(recording.other_files.iter().map(|path| format!("  another file of this name: {}", path.display())));
    match &recording.path {
        Some(path) => lines.push(format!("  found, with this hash: {}", path.display())),
        None => lines.push("  not found; --recordings DIR names a folder to look in".to_owned()),
    }
    lines.extend(recording.stage.iter().flat_map(|stage| stage_text(stage, 1)));
    lines
}

/// A stage and those upstream, each deeper by one.
fn stage_text(stage: &StageLineage, depth: usize) -> Vec<String> {
    let indent = "  ".repeat(depth);
    let path = stage.path.as_ref().map(|path| format!(" → {}", path.display())).unwrap_or_default();
    let commit = stage.commit.as_ref().map(|commit| format!(", pipeline file at commit {commit}")).unwrap_or_default();
    let mut lines = vec![format!("{indent}{} by ntp {}{commit}{path}", stage.stage, stage.ntp_version)];
    lines.push(format!("{indent}  plan {}", stage.plan_id));
    lines.extend(stage.version.iter().map(|version| format!("{indent}  manifest {version}")));
    // An edited dataset also keeps its sources' plans there: these are told below.
    let settings = stage.config.get("settings").filter(|_| stage.config.get("sources").is_some());
    lines.push(format!("{indent}  settings {}", settings.unwrap_or(&stage.config)));
    for (name, input) in &stage.inputs {
        let found = if input.stage.is_some() { "" } else { " (not found here)" };
        lines.push(format!("{indent}  from {name} {}{found}", input.version));
        lines.extend(input.stage.iter().flat_map(|stage| stage_text(stage, depth + 2)));
    }
    lines
}
