//! The rules of the program tree: each one, broken on purpose, is named.

use ntp::program::Program;
use ntp::scene::{BodyIndex, SlotIndex};
use ntp::task::Split;
use ntp::trace::{
    CallId, CallProblem, Episode, EpisodeParts, ProgramCall, Push, PushProblem, Span, TraceError, Vocabulary,
    instruction_spans, instructions, sentence,
};
use proptest::prelude::*;

use crate::kinematic::{demonstration, sorting, tower, trial};

fn parts() -> EpisodeParts {
    let task = tower("t", &[2, 5, 0], Split::Seen);
    demonstration(&task, &trial(&task, 0, 1), 0).into_parts()
}

#[track_caller]
fn check_refused(spoil: impl FnOnce(&mut EpisodeParts), expected: impl FnOnce(&TraceError) -> bool) {
    let mut parts = parts();
    spoil(&mut parts);
    let error = Episode::new(parts).unwrap_err();
    assert!(expected(&error), "{error}");
}

#[track_caller]
fn check_call_refused(spoil: impl FnOnce(&mut EpisodeParts), expected: impl FnOnce(&CallProblem) -> bool) {
    check_refused(spoil, |error| matches!(error, TraceError::Call { problem, .. } if expected(problem)));
}

#[test]
fn frames_must_be_there_in_order_and_finite() {
    check_refused(|parts| parts.frames.clear(), |error| *error == TraceError::NoFrames);
    check_refused(|parts| parts.frames[0].boundary = false, |error| *error == TraceError::FirstFrameInside);
    check_refused(
        |parts| parts.frames[3].time_nanos = parts.frames[2].time_nanos,
        |error| *error == TraceError::TimeNotIncreasing { frame: 3 },
    );
    check_refused(
        |parts| parts.frames[1].state.bodies_in_world[0].translation.x = f32::NAN,
        |error| *error == TraceError::NotFinite { frame: 1 },
    );
    check_refused(
        |parts| parts.frames[1].state.bodies_in_world.truncate(7),
        |error| matches!(error, TraceError::BodyCount { frame: 1, found: 7, expected: 8 }),
    );
    check_refused(
        |parts| parts.frames[1].slots[0] = BodyIndex(3),
        |error| matches!(error, TraceError::ForeignBody { frame: 1, slot: 0, body: 3 }),
    );
}

#[test]
fn pushes_follow_one_another_from_a_frame_to_a_later_boundary() {
    let push = |begin: u32, end: u32| Push {
        frames: Span { begin, end },
        body: BodyIndex(1),
        impulse_ns: [0.1, 0.0, 0.0],
        toppled: vec![BodyIndex(1)],
    };
    let check = |pushes: Vec<Push>, expected: fn(&PushProblem) -> bool| {
        let is_expected = |error: &TraceError| matches!(error, TraceError::Push { problem, .. } if expected(problem));
        check_refused(|parts| parts.pushes = pushes, is_expected);
    };
    let mut sound = parts();
    sound.pushes = vec![push(0, 3), push(2, 4)];
    assert!(Episode::new(sound).is_ok());
    for (begin, end) in [(0, 1), (3, 2), (0, 0), (0, 1000)] {
        check(vec![push(begin, end)], |problem| matches!(problem, PushProblem::Frames { .. }));
    }
    check(vec![push(0, 3), push(1, 4)], |problem| matches!(problem, PushProblem::Overlap { begin: 1, before: 2 }));
    check(vec![Push { body: BodyIndex(8), ..push(0, 2) }], |problem| {
        matches!(problem, PushProblem::Body { body: 8, bodies: 8 })
    });
    check(vec![Push { toppled: vec![BodyIndex(9)], ..push(0, 2) }], |problem| {
        matches!(problem, PushProblem::Body { body: 9, .. })
    });
    check(vec![Push { impulse_ns: [0.0, f32::NAN, 0.0], ..push(0, 2) }], |problem| *problem == PushProblem::NotFinite);
    check_refused(
        |parts| {
            parts.frames[2].boundary = false;
            parts.pushes = vec![push(0, 3)];
        },
        |error| matches!(error, TraceError::Push { push: 0, problem: PushProblem::OffBoundary { frame: 2 } }),
    );
}

#[test]
fn a_push_between_boundaries_counts_from_the_boundary_before_without_the_others() {
    let mut spread = crate::dataset::densify(&Episode::new(parts()).unwrap(), 3).into_parts();
    let boundaries: Vec<u32> =
        spread.frames.iter().zip(0..).filter(|(frame, _)| frame.boundary).map(|(_, at)| at).collect();
    let frames = Span { begin: boundaries[2] + 1, end: boundaries[3] + 1 };
    spread.pushes = vec![Push { frames, body: BodyIndex(0), impulse_ns: [0.0, 0.1, 0.0], toppled: Vec::new() }];
    let found = Episode::new(spread).unwrap().boundaries_only();
    assert_eq!(found.pushes[0].frames, Span { begin: 2, end: 4 });
    assert!(Episode::new(found.into_parts()).is_ok());
}

#[test]
fn a_callee_sees_what_its_caller_chose_and_nothing_beyond() {
    check_call_refused(
        |parts| parts.calls[2].input.end += 1,
        |problem| matches!(problem, CallProblem::InputIsNotCallersWindow { .. }),
    );
    check_call_refused(
        |parts| parts.calls[3].output = Some(Span { begin: 0, end: 6 }),
        |problem| matches!(problem, CallProblem::OutputOutsideInput { .. }),
    );
    check_call_refused(
        |parts| parts.specification_frames = 4,
        |problem| matches!(problem, CallProblem::BeyondSpecification { end: 9, frames: 4 }),
    );
}

#[test]
fn a_span_that_ends_before_it_begins_is_refused() {
    for spoil in [
        |call: &mut ProgramCall| call.frames = Span { begin: 70, end: 0 },
        |call: &mut ProgramCall| call.input = Span { begin: 2, end: 2 },
        |call: &mut ProgramCall| call.output = Some(Span { begin: 1, end: 0 }),
    ] {
        check_call_refused(
            |parts| spoil(&mut parts.calls[3]),
            |problem| matches!(problem, CallProblem::EmptySpan { found } if found.is_empty()),
        );
    }
}

#[test]
fn siblings_are_ordered_and_each_program_ends_once() {
    check_call_refused(
        |parts| parts.calls[5].frames.begin = 0,
        |problem| matches!(problem, CallProblem::SiblingOverlap { begin: 0, .. }),
    );
    check_call_refused(|parts| parts.calls[2].end_of_program = true, |problem| *problem == CallProblem::AfterEnd);
    check_call_refused(
        |parts| parts.calls[5].end_of_program = false,
        |problem| matches!(problem, CallProblem::NotEnded { .. }),
    );
    check_call_refused(
        |parts| parts.calls[5].step = 2,
        |problem| matches!(problem, CallProblem::Step { found: 2, expected: 1 }),
    );
}

#[test]
fn leaves_are_primitives_with_their_arguments() {
    check_call_refused(
        |parts| parts.calls[4].caller = Some(CallId(3)),
        |problem| matches!(problem, CallProblem::CallerIsLeaf { caller: Program::MoveTo }),
    );
    check_call_refused(
        |parts| parts.calls[3].argument = None,
        |problem| matches!(problem, CallProblem::Argument { program: Program::MoveTo, argument: None }),
    );
    check_call_refused(
        |parts| parts.calls[3].argument = Some(SlotIndex(8)),
        |problem| matches!(problem, CallProblem::UnknownSlot { slot: 8, slots: 8 }),
    );
    check_call_refused(
        |parts| parts.calls[4].argument = Some(SlotIndex(0)),
        |problem| matches!(problem, CallProblem::Argument { program: Program::Grip, .. }),
    );
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn frames_between_boundaries_can_be_left_out_without_losing_the_tree(
        mapping in prop::array::uniform4(0_u16..4),
        count in 1_u16..4,
        every in 1_usize..4,
    ) {
        let task = sorting("m", mapping, Split::Seen);
        let boundaries = demonstration(&task, &trial(&task, 0, count), 0);
        let filled = with_frames_between(boundaries.clone(), every);
        prop_assert!(filled.frames.len() > boundaries.frames.len());
        prop_assert_eq!(filled.boundaries_only(), boundaries);
    }

    #[test]
    fn every_frame_of_a_span_has_one_label_and_exactly_one_starts(begin in 0_u32..20, length in 1_u32..20) {
        let span = Span::new(begin, begin + length).unwrap();
        let starts = (0..50).filter(|&frame| span.label(frame) == ntp::trace::ScopingLabel::Start).count();
        let within = (0..50).filter(|&frame| span.label(frame) != ntp::trace::ScopingLabel::Outside).count();
        prop_assert_eq!(starts, 1);
        prop_assert_eq!(within, span.len());
    }
}

/// The same episode with `every` frames after each boundary but the last.
fn with_frames_between(episode: Episode, every: usize) -> Episode {
    let mut parts = episode.into_parts();
    let stride = every as u32 + 1;
    let moved = |span: Span| Span { begin: span.begin * stride, end: span.last() * stride + 1 };
    for call in &mut parts.calls {
        call.frames = moved(call.frames);
        call.input = moved(call.input);
        call.output = call.output.map(moved);
    }
    let last = parts.frames.len() - 1;
    let between = |(idx, frame): (usize, ntp::trace::Frame)| {
        let copies = if idx == last { 0 } else { every };
        (0..=copies).map(move |copy| ntp::trace::Frame {
            time_nanos: frame.time_nanos + copy as u64,
            boundary: copy == 0,
            ..frame.clone()
        })
    };
    parts.frames = parts.frames.drain(..).enumerate().flat_map(between).collect();
    parts.specification_frames = parts.frames.len() as u32;
    Episode::new(parts).unwrap()
}

#[test]
fn instructions_are_a_sentence_for_each_call_that_calls_primitives() {
    let parts = parts();
    let name = |slot: usize| parts.scene.slots[slot].name.as_str();
    let sentences: Vec<String> =
        (0..parts.calls.len()).filter_map(|position| sentence(&parts.calls, position, name)).collect();
    assert_eq!(sentences, ["pick block_F", "place on block_C", "pick block_A", "place on block_F"]);
    let task = sorting("s", [1, 0, 3, 2], Split::Seen);
    let sorted = demonstration(&task, &trial(&task, 0, 1), 0);
    let name = |slot: usize| sorted.scene.slots[slot].name.as_str();
    assert_eq!(sentence(&sorted.calls, 5, name).as_deref(), Some("drop into bin_2"));
}

#[test]
fn a_call_spans_the_instructions_of_what_it_calls() {
    let parts = parts();
    let instructions = instructions(&parts.calls, &parts.scene.slots);
    let spans = instruction_spans(&parts.calls, &instructions);
    let of = |program: Program| -> Vec<(u32, u32)> {
        let calls = parts.calls.iter().zip(&spans).filter(|(call, _)| call.program == program);
        calls.filter_map(|(_, span)| span.map(|span| (span.begin, span.end))).collect()
    };
    assert_eq!(of(Program::BlockStacking), [(0, 4)]);
    assert_eq!(of(Program::PickAndPlace), [(0, 2), (2, 4)]);
    assert_eq!(of(Program::Pick), [(0, 1), (2, 3)]);
    assert_eq!(of(Program::Place), [(1, 2), (3, 4)]);
    assert_eq!(of(Program::MoveTo), [], "what lies below an instruction has none of its own");
}

#[test]
fn words_outside_the_vocabulary_are_named() {
    let vocabulary = Vocabulary::new(["block_A", "block_B"]);
    assert_eq!(vocabulary.words("place on block_B"), Ok([2, 3, 7]));
    assert_eq!(Vocabulary::size(2), 8);
    let refused = |sentence: &str| vocabulary.words(sentence).unwrap_err().to_string();
    assert!(refused("pick block_Z").starts_with("unknown word \"block_Z\" in the instruction \"pick block_Z\""));
    assert!(refused("pick block_Z").contains("block_A, block_B"));
    assert!(refused("  ").starts_with("no word"));
    assert!(refused("place on on block_A").starts_with("too many words"));
}
