//! The measures of one level, added up over episodes.

use std::collections::BTreeMap;

use crate::annotate::measure::boundaries::{boundaries, matches};
use crate::annotate::measure::edit::edit_distance;
use crate::annotate::measure::{LevelMeasured, TOLERANCES_SECS};
use crate::dataset::FrameLabel;

/// What has been counted so far.
#[derive(Default)]
pub(super) struct Tally {
    frames: u64,
    frames_right: u64,
    labels: u64,
    iou: f64,
    boundaries: u64,
    boundaries_found: u64,
    matched: [u64; TOLERANCES_SECS.len()],
    episodes: u64,
    edit: f64,
}

impl Tally {
    /// Adds an episode: labels with the frames that have them, and the time of each frame.
    pub(super) fn add(&mut self, right: &[FrameLabel], found: &[FrameLabel], times_secs: &[f64]) {
        let n_frames = times_secs.len();
        let (right_frames, found_frames) = (by_frame(right, n_frames), by_frame(found, n_frames));
        let agree = right_frames.iter().zip(&found_frames).filter(|(right, found)| right == found).count();
        self.frames += n_frames as u64;
        self.frames_right += agree as u64;
        self.add_iou(&right_frames, &found_frames);
        let secs = |labels: &[FrameLabel]| {
            let frames = boundaries(labels, n_frames).into_iter();
            frames.filter_map(|frame| times_secs.get(frame).copied()).collect::<Vec<f64>>()
        };
        let (right_secs, found_secs) = (secs(right), secs(found));
        self.boundaries += right_secs.len() as u64;
        self.boundaries_found += found_secs.len() as u64;
        for (matched, tolerance) in self.matched.iter_mut().zip(TOLERANCES_SECS) {
            *matched += matches(&right_secs, &found_secs, tolerance) as u64;
        }
        let texts = |labels: &[FrameLabel]| labels.iter().map(|label| label.text.clone()).collect::<Vec<_>>();
        let (right_texts, found_texts) = (texts(right), texts(found));
        let longest = right_texts.len().max(found_texts.len()).max(1);
        self.edit += 1.0 - edit_distance(&right_texts, &found_texts) as f64 / longest as f64;
        self.episodes += 1;
    }

    /// Adds the intersection over union of each true label.
    fn add_iou(&mut self, right: &[Option<&str>], found: &[Option<&str>]) {
        let mut counts: BTreeMap<&str, [u64; 2]> = BTreeMap::new();
        for (right, found) in right.iter().zip(found) {
            for label in [right, found].into_iter().flatten() {
                let [both, either] = counts.entry(label).or_default();
                let is_both = right == found;
                *both += u64::from(is_both);
                *either += 1;
            }
        }
        for label in right.iter().flatten().copied().collect::<std::collections::BTreeSet<_>>() {
            let [both, either] = counts[label];
            // A frame that has the label in both was counted twice.
            self.iou += (both / 2) as f64 / (either - both / 2) as f64;
            self.labels += 1;
        }
    }

    pub(super) fn finish(self) -> LevelMeasured {
        let share = |part: f64, of: u64| if of == 0 { 1.0 } else { part / of as f64 };
        let f1 = |matched: u64| share(2.0 * matched as f64, self.boundaries + self.boundaries_found);
        LevelMeasured {
            frame_accuracy: share(self.frames_right as f64, self.frames),
            iou: share(self.iou, self.labels),
            boundary_f1: TOLERANCES_SECS
                .iter()
                .zip(self.matched)
                .map(|(secs, of)| (secs.to_string(), f1(of)))
                .collect(),
            edit_score: share(self.edit, self.episodes),
        }
    }
}

/// The label of each frame.
fn by_frame(labels: &[FrameLabel], n_frames: usize) -> Vec<Option<&str>> {
    let mut frames = vec![None; n_frames];
    for label in labels {
        if let Some(rows) = frames.get_mut(label.begin as usize..label.end as usize) {
            rows.fill(Some(label.text.as_str()));
        }
    }
    frames
}
