//! How well a detector finds things in scenes that it has not learned from: it looks at each demonstration of a suite,
//! picture by picture, and is compared with the world.

use crate::render::{CameraConfig, Visibility};
use crate::rollout::{Acted, Detected, DetectionRows, Policy, Start};
use crate::seed::Seed;

/// Of a suite, all shards together.
pub(super) const TABLE: &str = "detections.parquet";

/// The errors of a policy's detector in the demonstrations of some episodes, filmed by `camera`; nothing of a policy
/// without a detector.
pub(super) fn of_starts(
    policy: &dyn Policy,
    suite: &str,
    by: &Acted,
    camera: &CameraConfig,
    starts: &[Start<'_>],
) -> Option<DetectionRows> {
    let mut rows = DetectionRows::default();
    let mut visibility = Visibility::default();
    for start in starts {
        let demonstration = &start.demonstration;
        let found = policy.detect(&start.sight.as_ref()?.video)?;
        let camera = camera.camera(demonstration.provenance.family, Seed(demonstration.provenance.seed));
        let frames = demonstration.boundary_frames();
        let shares: Vec<Vec<f64>> =
            frames.map(|(_, frame)| visibility.shares(&demonstration.scene, &frame.state, &camera)).collect();
        let detected =
            Detected { episode: start.provenance.index, demonstration, rows: &found, visible_shares: &shares };
        rows.push(policy.name(), suite, by, &detected);
    }
    Some(rows)
}
