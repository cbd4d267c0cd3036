//! The scene's poses and shapes in the engine's types, and back.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use rapier3d::geometry::SharedShape;
use rapier3d::math::{Pose as EnginePose, Rotation, Vector};

use crate::geometry::Pose;
use crate::scene::{Bowl, Prism, Shape};

/// A pose for the engine.
pub(super) fn to_engine(pose: &Pose) -> EnginePose {
    let [x, y, z, w] = pose.rotation.coords.into();
    EnginePose::from_parts(pose.translation.vector.into_engine(), Rotation::from_xyzw(x, y, z, w))
}

/// A pose from the engine.
pub(super) fn from_engine(pose: &EnginePose) -> Pose {
    let [x, y, z] = pose.translation.to_array();
    let [i, j, k, w] = pose.rotation.to_array();
    let rotation = UnitQuaternion::new_unchecked(Quaternion::new(w, i, j, k));
    Isometry3::from_parts(Translation3::new(x, y, z), rotation)
}

/// A vector for the engine.
pub(super) trait IntoEngine {
    /// The same vector in the engine's type.
    fn into_engine(self) -> Vector;
}

impl IntoEngine for crate::geometry::Vec3 {
    fn into_engine(self) -> Vector {
        Vector::new(self.x, self.y, self.z)
    }
}

/// One convex part of a body.
#[derive(Clone)]
pub(super) struct Part {
    /// Where the part is in its body.
    pub(super) in_body: EnginePose,
    /// Its form.
    pub(super) shape: SharedShape,
}

impl Part {
    fn cuboid(center: [f32; 3], half: [f32; 3]) -> Self {
        let [x, y, z] = half;
        Self { in_body: EnginePose::from_translation(center.into()), shape: SharedShape::cuboid(x, y, z) }
    }

    /// Nothing for a prism without volume, which no checked scene has.
    fn prism(prism: &Prism) -> Option<Self> {
        let corners: Vec<Vector> = prism.corners().into_iter().map(Vector::from).collect();
        Some(Self { in_body: EnginePose::IDENTITY, shape: SharedShape::convex_hull(&corners)? })
    }
}

/// The convex parts of a shape: one, the floor and four walls of an open box, or foot, floor and eight walls of a bowl.
pub(super) fn parts(shape: &Shape) -> Vec<Part> {
    match *shape {
        Shape::Cuboid { half_extents_m } => vec![Part::cuboid([0.0; 3], half_extents_m)],
        Shape::Ball { radius_m } => {
            vec![Part { in_body: EnginePose::IDENTITY, shape: SharedShape::ball(radius_m) }]
        }
        // The engine's cylinders lie along y.
        Shape::Cylinder { radius_m, half_height_m } => vec![Part {
            in_body: EnginePose::from_rotation(Rotation::from_rotation_x(std::f32::consts::FRAC_PI_2)),
            shape: SharedShape::cylinder(half_height_m, radius_m),
        }],
        Shape::OpenBox { inner_m: [x, y, height], wall_m } => {
            let half_wall = wall_m / 2.0;
            let wall_z = height / 2.0 - half_wall;
            let half_wall_height = height / 2.0 + half_wall;
            vec![
                Part::cuboid([0.0, 0.0, -half_wall], [x + wall_m, y + wall_m, half_wall]),
                Part::cuboid([x + half_wall, 0.0, wall_z], [half_wall, y + wall_m, half_wall_height]),
                Part::cuboid([-x - half_wall, 0.0, wall_z], [half_wall, y + wall_m, half_wall_height]),
                Part::cuboid([0.0, y + half_wall, wall_z], [x, half_wall, half_wall_height]),
                Part::cuboid([0.0, -y - half_wall, wall_z], [x, half_wall, half_wall_height]),
            ]
        }
        Shape::Bowl(bowl) => bowl.prisms().iter().filter_map(Part::prism).collect(),
    }
}

/// The sizes of a shape, all of which must be positive.
pub(super) fn sizes_m(shape: &Shape) -> Vec<f32> {
    match *shape {
        Shape::Cuboid { half_extents_m } => half_extents_m.to_vec(),
        Shape::Cylinder { radius_m, half_height_m } => vec![radius_m, half_height_m],
        Shape::Ball { radius_m } => vec![radius_m],
        Shape::OpenBox { inner_m: [x, y, height], wall_m } => vec![x, y, height, wall_m],
        Shape::Bowl(Bowl { floor_radius_m, rim_radius_m, height_m, wall_m, foot_radius_m, foot_height_m }) => {
            vec![floor_radius_m, rim_radius_m, height_m, wall_m, foot_radius_m, foot_height_m]
        }
    }
}
