//! The timelines: simulated time and position among the recorded frames.

use rerun::log::TimeColumn;

use crate::trace::Frame;

/// Simulated time since the episode began.
pub(super) const SIM_TIME: &str = "sim_time";
/// Position among the recorded frames, from 0.
pub(super) const FRAME: &str = "frame";

/// Time since the episode began, as a dataset gives it.
pub(super) const TIMESTAMP: &str = "timestamp";

/// Both timelines at some frames, given by position.
pub(super) fn times(frames: &[Frame], positions: &[usize]) -> [TimeColumn; 2] {
    let nanos = positions.iter().map(|&position| frames[position].time_nanos as i64);
    let numbers = positions.iter().map(|&position| position as i64);
    [TimeColumn::new_duration_nanos(SIM_TIME, nanos), TimeColumn::new_sequence(FRAME, numbers)]
}

/// Positions of the frames at which a value is not what it was in the frame before; the first is always one.
pub(super) fn changes<T: PartialEq>(frames: &[Frame], value: impl Fn(&Frame) -> T) -> Vec<usize> {
    let changed = |&position: &usize| position == 0 || value(&frames[position]) != value(&frames[position - 1]);
    (0..frames.len()).filter(changed).collect()
}
