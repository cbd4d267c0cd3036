//! How well a detector finds things in scenes that it has not learned from: it looks at each demonstration of a suite,
//! picture by picture, and is compared with the world.

use crate::render::{CameraConfig, Visibility};
use crate::rollout::{Acted, Detected, DetectionRows, Policy, PolicyError, Start};
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
) -> Result<Option<DetectionRows>, PolicyError> {
    let mut rows = DetectionRows::default();
    let mut visibility = Visibility::default();
    for start in starts {
        let demonstration = &start.demonstration;
        let Some(sight) = &start.sight else { return Ok(None) };
        let Some(found) = policy.detect(&sight.video)? else { return Ok(None) };
        let family = demonstration.provenance.family;
        let layout = family.layout_of(&demonstration.scene);
        let camera = camera.camera_of(family, layout, Seed(demonstration.provenance.seed));
        let frames = demonstration.boundary_frames();
        let shares: Vec<Vec<f64>> =
            frames.map(|(_, frame)| visibility.shares(&demonstration.scene, &frame.state, &camera)).collect();
        let detected =
            Detected { episode: start.provenance.index, demonstration, rows: &found, visible_shares: &shares };
        rows.push(policy.name(), suite, by, &detected);
    }
    Ok(Some(rows))
}
