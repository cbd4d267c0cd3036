//! Every call in words, and how the episode ended.

use rerun::TextLog;
use rerun::components::TextLogLevel;

use crate::trace::{CallId, Episode, Outcome, ProgramCall};
use crate::visualize::store::Store;
use crate::visualize::{Replay, VisualizeError, agreement, clock, lanes, palette};

/// Logs a line a call when it is called, and one for the outcome at the last frame.
pub(super) fn put(store: &mut Store, replay: &Replay<'_>) -> Result<(), VisualizeError> {
    let &Replay { episode, divergence, .. } = replay;
    let last = episode.frames.len() - 1;
    let (outcome, level) = match episode.outcome {
        Outcome::Success => ("success".to_owned(), TextLogLevel::INFO),
        Outcome::Failure(cause) => (format!("failure: {}", cause.name()), TextLogLevel::ERROR),
    };
    let positions: Vec<usize> = episode.calls.iter().map(|call| call.frames.begin as usize).chain([last]).collect();
    let first = |call: &ProgramCall| divergence.filter(|divergence| divergence.call() == call.id);
    let line = |call| match first(call) {
        Some(divergence) => format!("{} ({})", path_in_words(episode, call), agreement::words(divergence)),
        None => path_in_words(episode, call),
    };
    let lines = episode.calls.iter().map(line).chain([outcome]);
    let level_of = |call| if first(call).is_some() { TextLogLevel::WARN } else { TextLogLevel::INFO };
    let levels = episode.calls.iter().map(level_of).chain([level]);
    let color_of = |call| if first(call).is_some() { palette::STOP } else { palette::of_call(&episode.scene, call) };
    let colors = episode.calls.iter().map(|call| palette::color(color_of(call)));
    let log = TextLog::update_fields()
        .with_many_text(lines)
        .with_many_level(levels)
        .with_many_color(colors.chain([palette::color(palette::TARGET)]));
    store.put_rows("calls", clock::times(&episode.frames, &positions), &log)
}

/// The stack from the root's callee to a call: `pick_and_place › pick › move_to(block_D)`.
fn path_in_words(episode: &Episode, call: &ProgramCall) -> String {
    let mut words = vec![lanes::label(&episode.scene, call)];
    let mut caller = call.caller;
    while let Some(CallId(id)) = caller.filter(|id| id.0 > 0) {
        let running = &episode.calls[id as usize];
        words.push(lanes::label(&episode.scene, running));
        caller = running.caller;
    }
    words.reverse();
    // Rerun's font has no better arrow than this.
    let path = words.join(" › ");
    match call.caller.filter(|_| call.end_of_program) {
        Some(CallId(caller)) => format!("{path} (ends {})", episode.calls[caller as usize].program),
        None => path,
    }
}
