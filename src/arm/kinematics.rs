//! From the angles of joints to the places of links, and how these change with the angles.

use std::sync::LazyLock;

use nalgebra::{Matrix3, Rotation3, SMatrix, UnitQuaternion, Vector3};

use crate::arm::sawyer::{BASE_IN_WORLD_M, HAND_M, HAND_TURN_RAD, JOINTS, N_JOINTS, TOOL_M};
use crate::arm::{Posture, Vector};
use crate::geometry::Pose;

/// Where a link or the gripper is in the base's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Its axes, a column each.
    pub rotation: Matrix3<f64>,
    /// Its origin.
    pub position: Vector,
}

impl Frame {
    /// The base's own.
    pub fn identity() -> Self {
        Self { rotation: Matrix3::identity(), position: Vector::zeros() }
    }

    /// A point of this frame in the base's.
    pub fn point(&self, [x, y, z]: [f64; 3]) -> Vector {
        self.rotation * Vector3::new(x, y, z) + self.position
    }
}

/// The turns that the links have in those before them.
static TURNS: LazyLock<[Matrix3<f64>; N_JOINTS]> = LazyLock::new(|| {
    std::array::from_fn(|joint| {
        let [roll, pitch, yaw] = JOINTS[joint].roll_pitch_yaw;
        about_z(yaw) * about_y(pitch) * about_x(roll)
    })
});

fn about_x(angle: f64) -> Matrix3<f64> {
    let (sin, cos) = libm::sincos(angle);
    Matrix3::new(1.0, 0.0, 0.0, 0.0, cos, -sin, 0.0, sin, cos)
}

fn about_y(angle: f64) -> Matrix3<f64> {
    let (sin, cos) = libm::sincos(angle);
    Matrix3::new(cos, 0.0, sin, 0.0, 1.0, 0.0, -sin, 0.0, cos)
}

fn about_z(angle: f64) -> Matrix3<f64> {
    let (sin, cos) = libm::sincos(angle);
    Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0)
}

/// Where the seven links are.
pub fn links(posture: &Posture) -> [Frame; N_JOINTS] {
    let turns = &*TURNS;
    let mut frame = Frame::identity();
    std::array::from_fn(|joint| {
        let position = frame.point(JOINTS[joint].origin_m);
        let still = frame.rotation * turns[joint];
        let (sin, cos) = libm::sincos(posture.0[joint]);
        let (x, y) = (still.column(0), still.column(1));
        let rotation = Matrix3::from_columns(&[x * cos + y * sin, y * cos - x * sin, still.column(2).into_owned()]);
        frame = Frame { rotation, position };
        frame
    })
}

/// Where base and links are in the world, for those who draw them.
pub fn links_in_world(joints_rad: &[f32; N_JOINTS]) -> [Pose; N_JOINTS + 1] {
    let links = links(&Posture(joints_rad.map(f64::from)));
    std::array::from_fn(|link| {
        let frame = link.checked_sub(1).map_or_else(Frame::identity, |link| links[link]);
        let rotation = Rotation3::from_matrix_unchecked(frame.rotation);
        let rotation = UnitQuaternion::from_rotation_matrix(&rotation).cast::<f32>();
        let position = frame.position + Vector::from(BASE_IN_WORLD_M);
        Pose::from_parts(position.cast::<f32>().into(), rotation)
    })
}

/// Where the gripper's reference point is, and the gripper's axes: its z points away from the hand, down when it is
/// upright, and its fingers close along its y.
pub fn forward(posture: &Posture) -> Frame {
    tool(&links(posture)[N_JOINTS - 1])
}

/// Where the gripper is with the last link there.
pub(super) fn tool(last: &Frame) -> Frame {
    Frame { rotation: last.rotation * about_z(HAND_TURN_RAD), position: last.point([0.0, 0.0, HAND_M + TOOL_M]) }
}

/// How the gripper moves with each joint: three rows of velocity, three of turning, a column a joint.
pub fn jacobian(posture: &Posture) -> SMatrix<f64, 6, N_JOINTS> {
    let links = links(posture);
    let at = tool(&links[N_JOINTS - 1]).position;
    let mut jacobian = SMatrix::<f64, 6, N_JOINTS>::zeros();
    for (joint, link) in links.iter().enumerate() {
        let axis: Vector = link.rotation.column(2).into_owned();
        let moving = axis.cross(&(at - link.position));
        jacobian.fixed_view_mut::<3, 1>(0, joint).copy_from(&moving);
        jacobian.fixed_view_mut::<3, 1>(3, joint).copy_from(&axis);
    }
    jacobian
}
