//! Poses and spans of space: nalgebra's types under the project's names.
//!
//! # Units and frames
//!
//! Metres and radians. The world is right-handed with z up; its origin is the middle of the table's surface.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

/// A rigid pose, named by `child_in_parent`.
pub type Pose = Isometry3<f32>;
/// A displacement or an extent, in metres.
pub type Vec3 = Vector3<f32>;
/// A position, in metres.
pub type Point = Point3<f32>;
/// A rotation.
pub type Rotation = UnitQuaternion<f32>;

/// The pose at `position` turned by `yaw_rad` about the vertical.
pub fn upright(position: Vec3, yaw_rad: f32) -> Pose {
    Pose::from_parts(position.into(), Rotation::from_axis_angle(&Vec3::z_axis(), yaw_rad))
}

/// Horizontal distance between two positions, in metres.
pub fn horizontal_distance(a: &Vec3, b: &Vec3) -> f32 {
    (a.xy() - b.xy()).norm()
}

/// The turn about the vertical that a pose has, in (-pi, pi].
pub fn yaw_rad(pose: &Pose) -> f32 {
    let x_axis = pose.rotation * Vec3::x();
    x_axis.y.atan2(x_axis.x)
}
