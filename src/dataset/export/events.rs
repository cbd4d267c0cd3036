//! Calls as `foxglove.Event` messages: episodes back to back, a second apart.

use std::path::Path;

use crate::dataset::edit::EditError;
use crate::dataset::export::ExportSummary;
use crate::dataset::export::labels::{LabelReader, LabelledCalls, LabelledEpisode};
use crate::recording::EventWriter;
use crate::trace::{Span, sentence};

/// Time between the end of an episode and the next one's start, as in recordings.
const GAP_NANOS: u64 = 1_000_000_000;

/// Writes an event for each call, at its end.
pub(super) fn write(root: &Path, to: &Path) -> Result<ExportSummary, EditError> {
    let mut writer = EventWriter::create(to)?;
    let mut summary = ExportSummary::default();
    let mut start_nanos = 0;
    for episode in LabelReader::open(root)?.1 {
        let episode = episode?;
        let calls = spans(&episode);
        let mut by_end: Vec<usize> = (0..calls.len()).collect();
        // Callees return before their callers.
        by_end.sort_by_key(|&call| (calls[call].0.end, std::cmp::Reverse(calls[call].1)));
        for call in by_end {
            let frames = calls[call].0;
            let ends = [frames.begin, frames.last()].map(|frame| start_nanos + nanos(&episode, frame));
            writer.write(ends, metadata(&episode, call, calls[call]))?;
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

/// Frames and depth of each call.
fn spans(episode: &LabelledEpisode) -> Vec<(Span, u8)> {
    match &episode.calls {
        LabelledCalls::Own(calls) => calls.iter().map(|call| (call.frames, call.depth)).collect(),
        LabelledCalls::Annotated(calls) => {
            calls.iter().map(|call| (Span { begin: call.frames[0], end: call.frames[1] }, call.depth)).collect()
        }
    }
}

fn metadata(episode: &LabelledEpisode, position: usize, (frames, depth): (Span, u8)) -> Vec<(&'static str, String)> {
    let (program, id) = match &episode.calls {
        LabelledCalls::Own(calls) => (calls[position].program.name().to_owned(), calls[position].id.0),
        LabelledCalls::Annotated(calls) => (calls[position].program.clone(), calls[position].call_id),
    };
    let mut metadata = vec![
        ("program", program),
        ("episode", episode.row.episode_index.to_string()),
        ("task", episode.row.task_id.clone()),
        ("call", id.to_string()),
        ("depth", depth.to_string()),
        ("frames", format!("{}..{}", frames.begin, frames.end)),
    ];
    metadata.extend(episode.argument(position).map(|argument| ("argument", argument.to_owned())));
    if let LabelledCalls::Own(calls) = &episode.calls {
        let sentence = sentence(calls, position, |slot| episode.slot(slot));
        metadata.extend(sentence.map(|sentence| ("instruction", sentence)));
    }
    metadata
}
