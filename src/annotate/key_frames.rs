//! The ends of primitives, found in how gripper and objects move.
//!
//! A gripper that closes or opens ends a primitive. Between two such moments it goes to another place and stops above
//! it, before it goes down: the last frame before the way down is the other kind of key frame.
//!
//! # Units and frames
//!
//! Metres and seconds. Heights are along the world's z axis.

use crate::dataset::ObservedEpisode;
use crate::trace::ObservationRows;

/// Which rows of a dataset are key frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum KeyFrames {
    /// All of a dataset that holds ends of primitives alone; those that are found in another.
    #[default]
    Auto,
    /// All.
    Rows,
    /// Those that are found.
    Found,
}

/// A gripper nearer to where it closed or opened than this has not left, in metres. Less than a primitive ever moves.
const STILL_M: f32 = 0.004;
/// What is this far beside the place of the next grip or release is still on its way there, in metres.
const BESIDE_M: f32 = 0.03;
/// The farthest that a gripper shifts between hovering and going down, in metres: within a container.
const SHIFT_M: f32 = 0.12;
/// A gripper pauses where it is so much slower than before and after.
const PAUSE_PACE: f32 = 0.5;
/// The least height from which a gripper goes down to a thing, in metres.
const WAY_DOWN_M: f32 = 0.015;
/// What stays within this of where it is in the end rests, in metres. Less than a gripper rises from what it let go.
const REST_M: f32 = 0.001;
/// A rest at the end that is no longer than this belongs to the last primitive, which waits for it, in seconds.
const REST_SECS: f64 = 0.35;
/// A change of the gripper that lasts shorter is a flicker, in frames.
const FLICKER_FRAMES: usize = 2;

/// A key frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeyFrame {
    /// Which frame of the episode.
    pub frame: u32,
    /// The frame that shows where things are then: of several things of one kind the next is shown once the gripper is
    /// open, when it may be on its way up already.
    pub shown: u32,
    /// From where the gripper is in `frame` to where it is in `shown`, in metres.
    pub shift_m: [f32; 3],
    /// Whether the gripper is closed then. A frame that was taken a moment before it closes stands for the moment.
    pub closed: bool,
}

impl KeyFrame {
    /// A frame as it is.
    pub fn at(frame: usize, closed: bool) -> Self {
        Self { frame: frame as u32, shown: frame as u32, shift_m: [0.0; 3], closed }
    }
}

/// The key frames of an episode, in order: the first frame, then the ends of primitives.
pub fn key_frames(episode: &ObservedEpisode) -> Vec<KeyFrame> {
    let path = gripper_path(episode);
    let closed: Vec<bool> = episode.observations.iter().map(|row| !row.is_open()).collect();
    let mut keys = vec![KeyFrame::at(0, closed.first().copied().unwrap_or(false))];
    let changes = changes(&closed);
    for (number, &change) in changes.iter().enumerate() {
        let begin = keys.last().map_or(0, |key| key.frame as usize);
        let until = changes.get(number + 1).map_or(path.len(), |&next| next);
        let place = resting(&path, begin, change);
        let leaves = leaves(&path, place, until).max(place);
        let end = if until == path.len() { leaves.min(rests(episode).max(place)) } else { leaves };
        if let Some(hover) = hover(&path, begin, place) {
            keys.push(KeyFrame::at(hover, closed[change - 1]));
        }
        if end > begin {
            let shown = if closed[change] { end } else { end.max(change) };
            let shift_m = [0, 1, 2].map(|axis| path[shown][axis] - path[end][axis]);
            keys.push(KeyFrame { shown: shown as u32, shift_m, ..KeyFrame::at(end, closed[change]) });
        }
    }
    keys.extend(cut_release(&path, &closed, &keys));
    keys
}

/// The key frames of a release that the end of the episode cuts: it closes on nothing any more, and has gone down.
fn cut_release(path: &[[f32; 3]], closed: &[bool], keys: &[KeyFrame]) -> Vec<KeyFrame> {
    let (last, begin) = (path.len().saturating_sub(1), keys.last().map_or(0, |key| key.frame as usize));
    if !closed.last().copied().unwrap_or(false) || keys.len() == 1 || begin + 1 >= last {
        return Vec::new();
    }
    match hover(path, begin, last) {
        Some(hover) if path[hover][2] - path[last][2] >= WAY_DOWN_M => {
            vec![KeyFrame::at(hover, true), KeyFrame::at(last, false)]
        }
        _ => Vec::new(),
    }
}

/// The frame at which the gripper is where it changes: at it or, where it is on its way up by then, right before.
fn resting(path: &[[f32; 3]], begin: usize, change: usize) -> usize {
    let is_before = change > begin + 1 && path[change - 1][2] < path[change][2] - STILL_M / 2.0;
    if is_before { change - 1 } else { change }
}

/// Where the gripper is in each frame. Where it is not told, it is the opposite of how most objects move past it, from
/// where it was in the first frame.
fn gripper_path(episode: &ObservedEpisode) -> Vec<[f32; 3]> {
    if episode.grippers_m.len() == episode.n_frames() {
        return episode.grippers_m.clone();
    }
    let rows = &episode.observations;
    let mut at = [0.0; 3];
    let mut path = vec![at; rows.len().min(1)];
    for frame in 1..rows.len() {
        let moved = [0, 1, 2].map(|axis| median_step(rows, frame, axis));
        at = [0, 1, 2].map(|axis| at[axis] - moved[axis]);
        path.push(at);
    }
    path
}

/// How far the objects moved since the frame before, along an axis: the median, as few of them are carried.
fn median_step(rows: &ObservationRows, frame: usize, axis: usize) -> f32 {
    let (Some(before), Some(now)) = (rows.get(frame - 1), rows.get(frame)) else { return 0.0 };
    let steps = before.positions.iter().zip(now.positions).map(|(before, now)| now[axis] - before[axis]);
    let mut steps: Vec<f32> = steps.collect();
    steps.sort_by(f32::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(0.0)
}

/// The frames at which the gripper has closed or opened, for longer than a flicker.
fn changes(closed: &[bool]) -> Vec<usize> {
    let mut state = closed.first().copied().unwrap_or(false);
    let mut changes = Vec::new();
    for frame in 1..closed.len() {
        let lasts = closed[frame..].iter().take(FLICKER_FRAMES).all(|&now| now != state);
        if lasts {
            state = !state;
            changes.push(frame);
        }
    }
    changes
}

fn distance_m(a: [f32; 3], b: [f32; 3]) -> f32 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f32>().sqrt()
}

fn beside_m(a: [f32; 3], b: [f32; 3]) -> f32 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// The last frame of those behind `change` and before `until` at which the gripper is where it changed.
fn leaves(path: &[[f32; 3]], change: usize, until: usize) -> usize {
    let Some(&place) = path.get(change) else { return change };
    let stays = path[change..until].iter().take_while(|&&at| distance_m(at, place) < STILL_M).count();
    change + stays.max(1) - 1
}

/// The frame from which on nothing moves any more; the last where that is hardly before the end.
fn rests(episode: &ObservedEpisode) -> usize {
    let rows = &episode.observations;
    let last = rows.len().saturating_sub(1);
    let Some(end) = rows.get(last) else { return last };
    let is_there = |frame: &usize| {
        let row = rows.get(*frame);
        row.is_some_and(|row| {
            row.positions.iter().zip(end.positions).all(|(&now, &then)| distance_m(now, then) < REST_M)
        })
    };
    let rests = last - (0..last).rev().take_while(is_there).count();
    let secs = |frame: usize| episode.times_secs.get(frame).copied().unwrap_or(0.0);
    if secs(last) - secs(rests) > REST_SECS { rests } else { last }
}

/// The frame between two at which the gripper hovers, before it goes down to where it changes; nothing where there is
/// none between them.
fn hover(path: &[[f32; 3]], begin: usize, change: usize) -> Option<usize> {
    let place = path.get(change)?;
    let is_hover = |&frame: &usize| path[frame][2] - place[2] >= WAY_DOWN_M && beside_m(path[frame], *place) < SHIFT_M;
    let height_mm = |frame: usize| (path[frame][2] / STILL_M).round() as i32;
    // The lowest, as it may pause above everything on its way too; of these the first, as it may shift before it goes
    // down.
    let lowest =
        pauses(path, begin, change).into_iter().filter(is_hover).min_by_key(|&frame| (height_mm(frame), frame));
    let found = lowest.unwrap_or_else(|| way_down(path, begin, change));
    (begin + 1 < change).then(|| found.clamp(begin + 1, change - 1))
}

/// The last frame from which the gripper only goes down to where it changes.
fn way_down(path: &[[f32; 3]], begin: usize, change: usize) -> usize {
    let place = path[change];
    let goes_down =
        |frame: usize| beside_m(path[frame], place) < BESIDE_M && path[frame][2] >= path[frame + 1][2] - STILL_M / 2.0;
    let top = (begin..change).rev().take_while(|&frame| goes_down(frame)).last().unwrap_or(change);
    let is_up = |&frame: &usize| path[frame][2] > path[top][2] - STILL_M;
    (top..change).take_while(is_up).last().unwrap_or(top)
}

/// The frames between two at which the gripper pauses: slower than the frames around it, and far slower than the
/// fastest ones before and behind.
fn pauses(path: &[[f32; 3]], begin: usize, end: usize) -> Vec<usize> {
    let steps: Vec<f32> = (begin..end).map(|frame| distance_m(path[frame], path[frame + 1])).collect();
    // The pace at a frame, from the steps to it and from it.
    let paces: Vec<f32> = steps.windows(2).map(|steps| steps[0] + steps[1]).collect();
    let fastest = |paces: &[f32]| paces.iter().copied().fold(0.0, f32::max);
    let is_pause = |&at: &usize| {
        let slow = PAUSE_PACE * fastest(&paces[..at]).min(fastest(&paces[at + 1..]));
        paces[at] <= slow && paces[at] <= paces[at - 1] && paces[at] < paces[at + 1]
    };
    (1..paces.len().saturating_sub(1)).filter(is_pause).map(|at| begin + at + 1).collect()
}

#[cfg(test)]
mod tests {
    use super::{KeyFrame, changes, cut_release, hover, key_frames, pauses, resting};
    use crate::dataset::ObservedEpisode;
    use crate::trace::{Observation, ObservationRows};

    /// Minimum jerk from one place to another, sampled.
    fn go(path: &mut Vec<[f32; 3]>, to: [f32; 3], n: usize) {
        let from = *path.last().unwrap();
        for step in 1..=n {
            let s = step as f32 / n as f32;
            let share = s * s * s * (10.0 + s * (-15.0 + 6.0 * s));
            path.push([0, 1, 2].map(|axis| from[axis] + share * (to[axis] - from[axis])));
        }
    }

    /// Up, across, down to hovering, down to the block at (0.3, 0.1): the frames of hovering, of closing, and all.
    fn grasp() -> (usize, usize, ObservedEpisode) {
        let mut path = vec![[0.0, 0.0, 0.1]];
        go(&mut path, [0.0, 0.0, 0.3], 8);
        go(&mut path, [0.3, 0.1, 0.3], 12);
        go(&mut path, [0.3, 0.1, 0.15], 6);
        let hover = path.len() - 1;
        go(&mut path, [0.3, 0.1, 0.045], 6);
        let closing = path.len() - 1;
        for _ in 0..3 {
            path.push(path[closing]);
        }
        let closed = closing + 2;
        go(&mut path, [0.3, 0.1, 0.3], 8);
        let blocks = [[0.3, 0.1, 0.025], [-0.2, 0.2, 0.025], [0.1, -0.3, 0.025]];
        let observe = |(frame, at): (usize, &[f32; 3])| Observation {
            slots_m: blocks.map(|block: [f32; 3]| [0, 1, 2].map(|axis| block[axis] - at[axis])).to_vec(),
            closed: frame >= closed,
        };
        let observations: Vec<Observation> = path.iter().enumerate().map(observe).collect();
        let times_secs = (0..path.len()).map(|frame| frame as f64 / 10.0).collect();
        let observations = ObservationRows::of(3, &observations);
        let (task_text, grippers_m) = (String::new(), Vec::new());
        let episode = ObservedEpisode { episode_index: 0, task_text, observations, grippers_m, times_secs };
        (hover, closing + 3, episode)
    }

    #[test]
    fn a_grasp_has_the_frame_of_hovering_and_the_frame_before_the_gripper_leaves() {
        let (hover, leaves, episode) = grasp();
        let keys = key_frames(&episode).into_iter().map(|key| (key.frame as usize, key.closed));
        assert_eq!(keys.collect::<Vec<_>>(), [(0, false), (hover, false), (leaves, true)]);
    }

    #[test]
    fn what_comes_after_everything_has_come_to_rest_is_no_part_of_the_last_primitive() {
        let (_, _, mut episode) = grasp();
        let n_frames = episode.n_frames();
        let last = episode.observations.get(n_frames - 1).unwrap();
        let last = Observation { slots_m: last.positions.to_vec(), closed: !last.is_open() };
        let opened = Observation { closed: false, ..last };
        let mut rest = |n: usize| {
            let rows = &episode.observations;
            let row = |row: crate::trace::ObservationRow<'_>| Observation {
                slots_m: row.positions.to_vec(),
                closed: !row.is_open(),
            };
            let all: Vec<Observation> = rows.iter().map(row).chain(vec![opened.clone(); n]).collect();
            episode.observations = ObservationRows::of(3, &all);
            episode.times_secs = (0..all.len()).map(|frame| frame as f64 / 10.0).collect();
            key_frames(&episode).last().map(|key| key.frame as usize)
        };
        assert_eq!(rest(3), Some(n_frames + 2), "it waits for what it set down");
        // The gripper opens one frame after the last motion: nothing moves from there on.
        assert_eq!(rest(20), Some(n_frames));
    }

    #[test]
    fn a_gripper_that_is_on_its_way_up_closed_where_it_was_lowest() {
        let path = [[0.0, 0.0, 0.2], [0.0, 0.0, 0.1], [0.0, 0.0, 0.045], [0.0, 0.0, 0.12]];
        assert_eq!([resting(&path, 0, 3), resting(&path, 0, 2)], [2, 2]);
    }

    #[test]
    fn a_way_down_without_a_pause_begins_at_its_top() {
        let mut path = vec![[0.0, 0.0, 0.05], [0.0, 0.0, 0.2], [0.2, 0.0, 0.2]];
        path.extend([[0.2, 0.0, 0.15], [0.2, 0.0, 0.1], [0.2, 0.0, 0.045]]);
        assert_eq!(hover(&path, 0, 5), Some(2));
        assert_eq!(hover(&path, 4, 5), None, "there is no frame between");
    }

    #[test]
    fn a_release_that_the_end_cuts_ends_with_the_episode() {
        let path = [[0.0, 0.0, 0.05], [0.0, 0.0, 0.2], [0.2, 0.0, 0.2], [0.2, 0.0, 0.12], [0.2, 0.0, 0.1]];
        let keys = [KeyFrame::at(0, false), KeyFrame::at(0, true)];
        let cut = cut_release(&path, &[false, true, true, true, true], &keys);
        assert_eq!(cut, [KeyFrame::at(2, true), KeyFrame::at(4, false)]);
        assert_eq!(cut_release(&path[..3], &[false, true, true], &keys), [], "it is still up");
        assert_eq!(cut_release(&path, &[false, true, true, true, false], &keys), [], "it is open");
    }

    #[test]
    fn a_flicker_of_the_gripper_is_no_change() {
        assert_eq!(changes(&[false, false, true, false, true, true, true, false, false]), [4, 7]);
        assert_eq!(changes(&[]), [0; 0]);
    }

    #[test]
    fn a_stop_between_two_ways_is_a_pause() {
        let mut path = vec![[0.0; 3]];
        go(&mut path, [0.2, 0.0, 0.0], 7);
        go(&mut path, [0.2, 0.0, -0.1], 5);
        assert_eq!(pauses(&path, 0, path.len() - 1), [7]);
        assert_eq!(pauses(&path[..1], 0, 0), [0; 0]);
    }
}
