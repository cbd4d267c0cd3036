//! How sure a decision is.

use crate::program::Program;
use crate::rollout::Decision;
use crate::trace::{Prediction, Span};

/// The product of the probabilities of what was decided, made of what `window` shows; 1 where nothing was weighed.
pub(super) fn confidence(decision: &Decision, window: Span) -> f32 {
    let Some(prediction) = &decision.prediction else { return 1.0 };
    let ends = if decision.program == Program::None {
        1.0
    } else if decision.end_of_program {
        prediction.end_probability
    } else {
        1.0 - prediction.end_probability
    };
    prediction.program_probability * decision.argument_probability * ends * of_scope(prediction, decision.scope, window)
}

/// How likely first and last frame of a part are. Of several alike the first is named: one that lies behind is as good.
fn of_scope(prediction: &Prediction, scope: Span, window: Span) -> f32 {
    let of = |probabilities: &[f32], frame: u32| {
        let at = frame.checked_sub(window.begin).and_then(|at| probabilities.get(at as usize));
        at.copied().unwrap_or(1.0)
    };
    let start = |frame: u32| of(&prediction.start_probabilities, frame);
    let stop = |frame: u32| of(&prediction.stop_probabilities, frame);
    let first =
        (window.begin..scope.begin).fold(scope.begin, |best, at| if start(at) > start(best) { at } else { best });
    let stops = if first < scope.begin {
        (first + 1..=scope.begin).map(stop).fold(0.0, f32::max)
    } else if scope.len() > 1 {
        stop(scope.last())
    } else {
        // A part of one frame has no end of its own.
        1.0
    };
    start(first) * stops
}

#[cfg(test)]
mod tests {
    use super::of_scope;
    use crate::trace::{Prediction, Span};

    fn prediction() -> Prediction {
        Prediction {
            program_probability: 1.0,
            end_probability: 0.0,
            start_probabilities: vec![0.8, 0.0, 0.1, 0.0, 0.05],
            stop_probabilities: vec![0.0, 0.1, 0.5, 0.0, 0.25],
        }
    }

    #[test]
    fn a_part_is_as_sure_as_its_first_and_last_frame() {
        let whole = Span { begin: 10, end: 15 };
        assert_eq!(of_scope(&prediction(), Span { begin: 10, end: 13 }, whole), 0.8 * 0.5);
        // The window begins at frame 12 of the demonstration, which has the first of the probabilities.
        let part = Span { begin: 12, end: 17 };
        assert_eq!(of_scope(&prediction(), Span { begin: 12, end: 15 }, part), 0.8 * 0.5);
    }

    #[test]
    fn a_part_like_one_that_lies_behind_is_as_sure_as_that_one() {
        let whole = Span { begin: 0, end: 5 };
        assert_eq!(of_scope(&prediction(), Span { begin: 2, end: 5 }, whole), 0.8 * 0.5);
    }

    #[test]
    fn what_was_not_weighed_is_sure() {
        let nothing = Prediction { start_probabilities: Vec::new(), stop_probabilities: Vec::new(), ..prediction() };
        assert_eq!(of_scope(&nothing, Span { begin: 2, end: 5 }, Span { begin: 0, end: 5 }), 1.0);
    }
}
