//! Every call and every push of an adversary in words, and how the episode ended.

use rerun::components::TextLogLevel;
use rerun::{Color, TextLog};

use crate::trace::{CallId, Episode, Outcome, ProgramCall, Push};
use crate::visualize::store::Store;
use crate::visualize::{Replay, VisualizeError, agreement, clock, palette};

/// A line of the log.
struct Line {
    frame: usize,
    text: String,
    level: &'static str,
    color: Color,
}

/// Logs a line a call when it is called, one a push when it happens, and one for the outcome at the last frame.
pub(super) fn put(store: &mut Store, replay: &Replay<'_>) -> Result<(), VisualizeError> {
    let episode = replay.episode;
    let calls = episode.calls.iter().map(|call| line_of_call(replay, call));
    let pushes = episode.pushes.iter().map(|push| line_of_push(episode, push));
    let mut lines: Vec<Line> = calls.chain(pushes).chain([line_of_outcome(episode)]).collect();
    lines.sort_by_key(|line| line.frame);
    let positions: Vec<usize> = lines.iter().map(|line| line.frame).collect();
    let log = TextLog::update_fields()
        .with_many_text(lines.iter().map(|line| line.text.as_str()))
        .with_many_level(lines.iter().map(|line| line.level))
        .with_many_color(lines.iter().map(|line| line.color));
    store.put_rows("calls", clock::times(&episode.frames, &positions), &log)
}

fn line_of_call(replay: &Replay<'_>, call: &ProgramCall) -> Line {
    let &Replay { episode, divergence, .. } = replay;
    let (frame, path) = (call.frames.begin as usize, path_in_words(episode, call));
    match divergence.filter(|divergence| divergence.call() == call.id) {
        Some(divergence) => Line {
            frame,
            text: format!("{path} ({})", agreement::words(divergence)),
            level: TextLogLevel::WARN,
            color: palette::color(palette::STOP),
        },
        None => {
            let color = palette::color(call.color(&episode.scene));
            Line { frame, text: path, level: TextLogLevel::INFO, color }
        }
    }
}

fn line_of_push(episode: &Episode, push: &Push) -> Line {
    Line {
        frame: push.frames.begin as usize,
        text: push.in_words(&episode.scene),
        level: TextLogLevel::WARN,
        color: palette::color(palette::STOP),
    }
}

fn line_of_outcome(episode: &Episode) -> Line {
    let (text, level) = match episode.outcome {
        Outcome::Success => ("success".to_owned(), TextLogLevel::INFO),
        Outcome::Failure(cause) => (format!("failure: {}", cause.name()), TextLogLevel::ERROR),
    };
    Line { frame: episode.frames.len() - 1, text, level, color: palette::color(palette::TARGET) }
}

/// The stack from the root's callee to a call: `pick_and_place › pick › move_to(block_D)`.
fn path_in_words(episode: &Episode, call: &ProgramCall) -> String {
    let mut words = vec![call.label(&episode.scene)];
    let mut caller = call.caller;
    while let Some(CallId(id)) = caller.filter(|id| id.0 > 0) {
        let running = &episode.calls[id as usize];
        words.push(running.label(&episode.scene));
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
