//! The arm: its capsules, link by link, and the angles of its joints over time.

use rerun::components::FillMode;
use rerun::{Boxes3D, Capsules3D, Quaternion, Scalars, SeriesLines};

use crate::arm::{BASE_IN_WORLD_M, Capsule, JOINT_NAMES, N_JOINTS, capsules, links_in_world};
use crate::geometry::Pose;
use crate::trace::{Episode, Frame};
use crate::visualize::store::Store;
use crate::visualize::world::put_poses;
use crate::visualize::{VisualizeError, clock, palette};

/// Half of the width of the pedestal that the base stands on.
const PEDESTAL_M: f32 = 0.1;

/// Whether an episode's robot has an arm.
pub(super) fn is_there(episode: &Episode) -> bool {
    joints(&episode.frames[0]).is_some()
}

fn joints(frame: &Frame) -> Option<&[f32; N_JOINTS]> {
    frame.state.joints_rad.as_ref()
}

/// Logs links and joints at all frames; nothing without an arm.
pub(super) fn put(store: &mut Store, episode: &Episode) -> Result<(), VisualizeError> {
    if !is_there(episode) {
        return Ok(());
    }
    let pose =
        |frame: &Frame, link: usize| joints(frame).map_or_else(Pose::identity, |joints| links_in_world(joints)[link]);
    for link in 0..=N_JOINTS {
        let path = format!("world/arm/link_{link}");
        put_poses(store, path.as_str(), episode, |frame| pose(frame, link))?;
        store.put_static(format!("{path}/shape"), &shape(link))?;
    }
    let half_z = BASE_IN_WORLD_M[2] as f32 / 2.0;
    let pedestal = Boxes3D::from_centers_and_half_sizes([[0.0, 0.0, -half_z]], [[PEDESTAL_M, PEDESTAL_M, half_z]])
        .with_colors([palette::color(palette::ARM)])
        .with_fill_mode(FillMode::Solid);
    store.put_static("world/arm/link_0/pedestal", &pedestal)?;
    put_joints(store, episode)
}

fn shape(link: usize) -> Capsules3D {
    let own: Vec<Capsule> = capsules().filter(|capsule| capsule.link == link).collect();
    let standing: Vec<(f32, Pose)> = own.iter().map(Capsule::standing).collect();
    let lengths = standing.iter().map(|(length_m, _)| *length_m);
    Capsules3D::from_lengths_and_radii(lengths, own.iter().map(|capsule| capsule.radius_m as f32))
        .with_translations(standing.iter().map(|(_, in_link)| <[f32; 3]>::from(in_link.translation.vector)))
        .with_quaternions(standing.iter().map(|(_, in_link)| Quaternion::from_xyzw(in_link.rotation.coords.into())))
        .with_colors(vec![palette::color(palette::ARM); own.len()])
        .with_fill_mode(FillMode::Solid)
}

/// A line a joint.
fn put_joints(store: &mut Store, episode: &Episode) -> Result<(), VisualizeError> {
    let positions: Vec<usize> = (0..episode.frames.len()).collect();
    for (joint, name) in JOINT_NAMES.into_iter().enumerate() {
        let path = format!("joints/{name}");
        let style = SeriesLines::new().with_names([name]).with_widths([1.5]);
        store.put_static(path.as_str(), &style)?;
        let angles = episode.frames.iter().filter_map(|frame| joints(frame).map(|joints| f64::from(joints[joint])));
        store.put_rows(path.as_str(), clock::times(&episode.frames, &positions), &Scalars::new(angles))?;
    }
    Ok(())
}
