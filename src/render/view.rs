//! A camera at one instant, and functions of space as it sees them.
//!
//! A linear function of space divided by depth is affine in the picture. So is nearness (1 / depth) on a plane: this
//! is what the rasteriser interpolates, and from it every other function follows without another division.

use crate::geometry::{Pose, Vec3};
use crate::render::raster::Affine;

/// Nothing nearer than this is drawn, in metres.
pub(super) const NEAR_M: f32 = 0.01;

/// A camera at one instant, by samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    pub(super) camera_in_world: Pose,
    /// Focal length in samples.
    pub(super) focal: f32,
    /// Principal point from the upper left corner, in samples.
    pub(super) center: [f32; 2],
}

/// A linear function of space: `depth * slope + constant`, with the slope affine in the picture.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Linear {
    pub(super) slope: Affine,
    pub(super) constant: f32,
}

/// A rigid thing as a camera sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sight {
    pub(super) in_camera: Pose,
    /// Where the camera is, seen from the thing.
    pub(super) eye: Vec3,
}

impl View {
    /// How a thing is seen.
    pub(super) fn sight(&self, in_world: &Pose) -> Sight {
        let in_camera = self.camera_in_world.inv_mul(in_world);
        let eye = in_camera.rotation.inverse_transform_vector(&-in_camera.translation.vector);
        Sight { in_camera, eye }
    }

    /// `axis · ray` for the ray of each sample, with 1 along the camera's z.
    pub(super) fn slope(&self, axis_in_camera: &Vec3) -> Affine {
        let (x, y) = (axis_in_camera.x / self.focal, axis_in_camera.y / self.focal);
        Affine { x, y, constant: axis_in_camera.z - x * self.center[0] - y * self.center[1] }
    }

    /// `axis · point + constant`, for points and an axis in a thing's frame.
    pub(super) fn linear(&self, sight: &Sight, axis: &Vec3, constant: f32) -> Linear {
        let axis_in_camera = sight.in_camera.rotation * axis;
        let constant = constant - axis_in_camera.dot(&sight.in_camera.translation.vector);
        Linear { slope: self.slope(&axis_in_camera), constant }
    }

    /// `axis · point + constant` in the world.
    pub(super) fn linear_in_world(&self, axis: &Vec3, constant: f32) -> Linear {
        let axis_in_camera = self.camera_in_world.rotation.inverse_transform_vector(axis);
        Linear {
            slope: self.slope(&axis_in_camera),
            constant: constant + axis.dot(&self.camera_in_world.translation.vector),
        }
    }

    /// Column and row of a point in the camera's frame.
    pub(super) fn project(&self, point: &Vec3) -> [f32; 2] {
        let scale = self.focal / point.z;
        [self.center[0] + scale * point.x, self.center[1] + scale * point.y]
    }
}

/// The part of a convex polygon, in the camera's frame, that is not too near.
pub(super) fn clip_near(corners: &mut Vec<Vec3>, scratch: &mut Vec<Vec3>) {
    if corners.iter().all(|corner| corner.z >= NEAR_M) {
        return;
    }
    scratch.clear();
    for (position, to) in corners.iter().enumerate() {
        let from = corners[(position + corners.len() - 1) % corners.len()];
        if (from.z >= NEAR_M) != (to.z >= NEAR_M) {
            scratch.push(from + (to - from) * ((NEAR_M - from.z) / (to.z - from.z)));
        }
        if to.z >= NEAR_M {
            scratch.push(*to);
        }
    }
    std::mem::swap(corners, scratch);
}
