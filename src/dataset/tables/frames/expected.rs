//! What frames should be: by the row before them, and by the calls.

use crate::dataset::config::ActionChoice;
use crate::dataset::tables::frames;
use crate::dataset::tables::frames::feature::ACTION_NAMES;
use crate::dataset::tables::frames::paths::ProgramPaths;
use crate::table::batch;
use crate::trace::ProgramCall;

batch! {
    /// Every column.
    pub(crate) struct FullFrameBatch of frames {
        pub(crate) state,
        pub(crate) action,
        pub(crate) timestamp,
        pub(crate) frame_index,
        pub(crate) episode_index,
        pub(crate) index,
        pub(crate) task_index,
        pub(crate) subtask_index,
        pub(crate) done,
        pub(crate) success,
        pub(crate) time_secs,
        pub(crate) boundary,
        pub(crate) recording_frame,
        pub(crate) gripper,
        pub(crate) call_id,
        pub(crate) program,
    }
}

/// What the row before said that the next one must fit.
pub(crate) struct Before {
    action: [f32; ACTION_NAMES.len()],
    /// The last value of the action.
    closing: f32,
    gripper: [f32; 3],
    time_secs: f64,
    recording_frame: i64,
}

impl Before {
    pub(crate) fn new(batch: &FullFrameBatch, at: usize) -> Self {
        Self {
            action: first(batch.action.row(at)),
            closing: batch.action.row(at).last().copied().unwrap_or(f32::NAN),
            gripper: first(batch.gripper.row(at)),
            time_secs: batch.time_secs[at],
            recording_frame: batch.recording_frame[at],
        }
    }
}

/// The action of the row before must lead to this one, later in time.
pub(crate) fn step_problem(
    before: &Before,
    batch: &FullFrameBatch,
    at: usize,
    action: ActionChoice,
) -> Option<(&'static str, String)> {
    if batch.time_secs[at] <= before.time_secs || batch.recording_frame[at] <= before.recording_frame {
        let found = (batch.time_secs[at], batch.recording_frame[at]);
        return Some((
            "frames.time",
            format!("(ntp.time_secs, ntp.recording_frame) are {found:?}, not after the row before"),
        ));
    }
    let [x, y, z] = first(batch.gripper.row(at));
    let [from_x, from_y, from_z] = before.gripper;
    let closed = batch.state.row(at).last().copied().unwrap_or(f32::NAN);
    if action == ActionChoice::Joints {
        let found = before.closing;
        return (found != closed).then(|| {
            ("frames.action", format!("the action of the row before ends with {found}, but leads to {closed}"))
        });
    }
    let expected = [x - from_x, y - from_y, z - from_z, closed];
    (before.action != expected).then(|| {
        ("frames.action", format!("the action of the row before is {:?}, but leads to {expected:?}", before.action))
    })
}

/// Whether an action tells angles, and whether the gripper holds something then.
pub(crate) fn are_joints(action: &[f32], closed: f32) -> bool {
    action.iter().all(|value| value.is_finite()) && action.last() == Some(&closed)
}

/// The first values of a vector; nothing but itself equals what is not there.
fn first<const N: usize>(values: &[f32]) -> [f32; N] {
    std::array::from_fn(|at| values.get(at).copied().unwrap_or(f32::NAN))
}

/// The labels that frames should have, in their order; some may be passed over.
pub(crate) struct Labels<'c> {
    calls: &'c [ProgramCall],
    /// Stacks of running programs, as texts.
    paths: &'c ProgramPaths,
    texts: &'c [String],
    /// The calls that go on, by position; the root is always there.
    running: Vec<usize>,
    /// Position of the next call that has not begun.
    next: usize,
}

impl<'c> Labels<'c> {
    pub(crate) fn new(calls: &'c [ProgramCall], paths: &'c ProgramPaths, texts: &'c [String]) -> Self {
        Self { calls, paths, texts, running: Vec::new(), next: 1 }
    }

    /// The deepest call that goes on from a frame, and its path. Frames are asked for in order.
    pub(crate) fn at(&mut self, frame: i64) -> (i64, &'c str) {
        let has_ended = |&call: &usize| i64::from(self.calls[call].frames.last()) <= frame;
        while self.running.pop_if(|call| has_ended(call)).is_some() {}
        while let Some(call) = self.calls.get(self.next).filter(|call| i64::from(call.frames.begin) <= frame) {
            if i64::from(call.frames.last()) > frame {
                self.running.push(self.next);
            }
            self.next += 1;
        }
        let deepest = self.running.last().copied().unwrap_or(0);
        (deepest as i64, self.texts.get(self.paths.key(deepest) as usize).map_or("", String::as_str))
    }
}

/// What is wrong with the label of a row.
pub(crate) fn label_problem(
    expected: (i64, &str),
    batch: &FullFrameBatch,
    at: usize,
) -> Option<(&'static str, String)> {
    let found = (batch.call_id[at], batch.program.row(at));
    (found != expected).then(|| {
        ("frames.label", format!("(ntp.call_id, ntp.program) are {found:?}, but the calls make them {expected:?}"))
    })
}
