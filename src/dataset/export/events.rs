//! Calls as `foxglove.Event` messages: episodes back to back, a second apart.

use std::path::Path;

use crate::dataset::edit::EditError;
use crate::dataset::export::ExportSummary;
use crate::dataset::export::labels::{LabelReader, LabelledEpisode};
use crate::recording::EventWriter;
use crate::trace::sentence;

/// Time between the end of an episode and the next one's start, as in recordings.
const GAP_NANOS: u64 = 1_000_000_000;

/// Writes an event for each call, at its end.
pub(super) fn write(root: &Path, to: &Path) -> Result<ExportSummary, EditError> {
    let mut writer = EventWriter::create(to)?;
    let mut summary = ExportSummary::default();
    let mut start_nanos = 0;
    for episode in LabelReader::open(root)?.1 {
        let episode = episode?;
        let mut by_end: Vec<usize> = (0..episode.calls.len()).collect();
        // Callees return before their callers.
        by_end.sort_by_key(|&call| (episode.calls[call].frames.end, std::cmp::Reverse(episode.calls[call].depth)));
        for call in by_end {
            let frames = episode.calls[call].frames;
            let ends = [frames.begin, frames.last()].map(|frame| start_nanos + nanos(&episode, frame));
            writer.write(ends, metadata(&episode, call))?;
            summary.labels += 1;
        }
        summary.episodes += 1;
        start_nanos += episode.times_secs.last().map_or(0, |&secs| to_nanos(secs)) + GAP_NANOS;
    }
    writer.finish()?;
    Ok(summary)
}

fn nanos(episode: &LabelledEpisode, frame: u32) -> u64 {
    episode.times_secs.get(frame as usize).map_or(0, |&secs| to_nanos(secs))
}

fn to_nanos(secs: f64) -> u64 {
    (secs * 1e9).round() as u64
}

fn metadata(episode: &LabelledEpisode, position: usize) -> Vec<(&'static str, String)> {
    let call = &episode.calls[position];
    let mut metadata = vec![
        ("program", call.program.name().to_owned()),
        ("episode", episode.row.episode_index.to_string()),
        ("task", episode.row.task_id.clone()),
        ("call", call.id.0.to_string()),
        ("depth", call.depth.to_string()),
        ("frames", format!("{}..{}", call.frames.begin, call.frames.end)),
    ];
    metadata.extend(call.argument.map(|slot| ("argument", episode.slot(usize::from(slot.0)).to_owned())));
    let sentence = sentence(&episode.calls, position, |slot| episode.slot(slot));
    metadata.extend(sentence.map(|sentence| ("instruction", sentence)));
    metadata
}
