//! Where labels begin and end, and how many of these are found.

use std::collections::BTreeSet;

use crate::dataset::FrameLabel;

/// The frames at which a label begins or ends, but for the first and the end of the episode.
pub(super) fn boundaries(labels: &[FrameLabel], n_frames: usize) -> Vec<usize> {
    let ends = labels.iter().flat_map(|label| [label.begin as usize, label.end as usize]);
    let inside: BTreeSet<usize> = ends.filter(|&frame| frame > 0 && frame < n_frames).collect();
    inside.into_iter().collect()
}

/// How many true boundaries have one of the others within a tolerance, each for itself. Both grow.
pub(super) fn matches(right_secs: &[f64], found_secs: &[f64], tolerance_secs: f64) -> usize {
    // Times are sums of steps of a tenth of a second and the like: what rounding adds is no distance.
    let tolerance_secs = tolerance_secs + 1e-6;
    let (mut n, mut next) = (0, 0);
    for &right in right_secs {
        while found_secs.get(next).is_some_and(|&found| found < right - tolerance_secs) {
            next += 1;
        }
        if found_secs.get(next).is_some_and(|&found| found <= right + tolerance_secs) {
            n += 1;
            next += 1;
        }
    }
    n
}

#[cfg(test)]
mod tests {
    use super::matches;

    #[test]
    fn each_boundary_is_found_once() {
        assert_eq!(matches(&[1.0, 2.0], &[1.4, 1.5], 0.5), 2);
        assert_eq!(matches(&[1.0, 1.2], &[1.1], 0.5), 1);
        assert_eq!(matches(&[1.0], &[0.2, 1.9, 2.0], 0.5), 0);
        assert_eq!(matches(&[0.3], &[0.1 + 0.1], 0.1), 1);
    }
}
