//! What the sun sees: a map of how high above the ground, towards the sun, the far sides of things are.
//!
//! A point is in shadow when the far side of something is nearer to the sun than it is. Far sides rather than near ones,
//! so that nothing shadows its own lit side.

use crate::geometry::{Pose, Vec3};
use crate::render::look::Shadows;
use crate::render::mesh::Mesh;
use crate::render::raster::{Affine, Raster};
use crate::render::view::{Linear, View};

/// How far below a far side shadow begins, in metres.
const BIAS_M: f32 = 0.0006;
/// The map's sides move in steps of this, in metres, so that edges do not swim.
const STEP_M: f32 = 0.1;
/// Left free around what casts shadows, in metres, so that soft edges end on the map.
const MARGIN_M: f32 = 0.04;
/// Texels to each side that a soft edge is the mean of.
const SOFTNESS: usize = 2;
/// Sides that look away from the sun by less are left out.
const GRAZING: f32 = 1e-4;

/// The map, along two axes across the sun's light.
#[derive(Debug, Default)]
pub(super) struct ShadowMap {
    map: Raster,
    softness: usize,
    across: Vec3,
    down: Vec3,
    to_sun: Vec3,
    /// `across` and `down` of the map's corner.
    corner: [f32; 2],
    texels_per_m: f32,
    corners: Vec<[f32; 2]>,
}

/// Where the samples of a view fall on the map.
#[derive(Clone, Copy, Debug)]
pub(super) struct MapPlace {
    pub(super) column: Linear,
    pub(super) row: Linear,
    pub(super) height: Linear,
}

impl ShadowMap {
    /// Draws the map, `size` texels wide and high. Nothing is in shadow when shadows are not wanted.
    pub(super) fn draw(&mut self, casters: &[(&Mesh, Pose)], to_sun: &Vec3, shadows: Shadows, size: usize) {
        self.softness = if shadows == Shadows::Soft { SOFTNESS } else { 0 };
        let wanted = shadows != Shadows::None && to_sun.z > 0.05;
        self.map.clear(if wanted { size } else { 0 }, if wanted { size } else { 0 }, f32::MIN);
        if !wanted {
            return;
        }
        self.aim(casters, to_sun, size);
        for (mesh, in_world) in casters {
            self.cast(mesh, in_world);
        }
    }

    /// Turns the axes to the sun and fits the map to what casts shadows.
    fn aim(&mut self, casters: &[(&Mesh, Pose)], to_sun: &Vec3, size: usize) {
        self.to_sun = *to_sun;
        self.across = Vec3::y().cross(to_sun).normalize();
        self.down = to_sun.cross(&self.across);
        let mut begin = [f32::MAX; 2];
        let mut end = [f32::MIN; 2];
        for (mesh, in_world) in casters {
            let center = in_world.translation.vector;
            for (axis, place) in [self.across.dot(&center), self.down.dot(&center)].into_iter().enumerate() {
                begin[axis] = begin[axis].min(((place - mesh.radius_m - MARGIN_M) / STEP_M).floor() * STEP_M);
                end[axis] = end[axis].max(((place + mesh.radius_m + MARGIN_M) / STEP_M).ceil() * STEP_M);
            }
        }
        self.corner = begin;
        self.texels_per_m = size as f32 / (end[0] - begin[0]).max(end[1] - begin[1]).max(STEP_M);
    }

    fn cast(&mut self, mesh: &Mesh, in_world: &Pose) {
        let rotation = in_world.rotation.to_rotation_matrix();
        let origin = in_world.translation.vector;
        let [across, down, to_sun] =
            [self.across, self.down, self.to_sun].map(|axis| rotation.inverse_transform_vector(&axis));
        let [origin_across, origin_down, origin_height] =
            [self.across, self.down, self.to_sun].map(|axis| axis.dot(&origin));
        let scale = self.texels_per_m;
        for face in &mesh.faces {
            let away = face.normal.dot(&to_sun);
            if away > -GRAZING {
                continue;
            }
            self.corners.clear();
            self.corners.extend(mesh.corners[face.corners.clone()].iter().map(|corner| {
                let column = origin_across + across.dot(corner) - self.corner[0];
                [column * scale, (origin_down + down.dot(corner) - self.corner[1]) * scale]
            }));
            // height = (offset - n·across a - n·down d) / n·sun about the origin, as a function of texels.
            let [by_across, by_down] = [-face.normal.dot(&across) / away, -face.normal.dot(&down) / away];
            let constant = origin_height
                + face.offset / away
                + by_across * (self.corner[0] - origin_across)
                + by_down * (self.corner[1] - origin_down);
            let (x, y) = (by_across / scale, by_down / scale);
            // Within a texel a slanted side is lower than at its middle; a thin wall's other side lies in between.
            let constant = constant - mesh.shadow_slack * (x.abs() + y.abs());
            let height = Affine { x, y, constant };
            self.map.fill(&self.corners, &height, 0);
        }
    }

    /// Where a view's samples fall.
    pub(super) fn place(&self, view: &View) -> MapPlace {
        let scaled =
            |axis: &Vec3, corner: f32| view.linear_in_world(&(axis * self.texels_per_m), -corner * self.texels_per_m);
        MapPlace {
            column: scaled(&self.across, self.corner[0]),
            row: scaled(&self.down, self.corner[1]),
            height: view.linear_in_world(&self.to_sun, BIAS_M),
        }
    }

    /// The share of the sun's light that reaches a point, given by its place on the map and its height.
    #[inline]
    pub(super) fn light(&self, column: f32, row: f32, height: f32) -> f32 {
        if self.softness > 0 {
            return self.soft_light(column, row, height);
        }
        let inside = column >= 0.0 && row >= 0.0 && column < self.map.width as f32 && row < self.map.height as f32;
        if inside && self.map.nearness[row as usize * self.map.width + column as usize] > height { 0.0 } else { 1.0 }
    }

    /// The mean over a square of texels that moves smoothly with the point.
    fn soft_light(&self, column: f32, row: f32, height: f32) -> f32 {
        let size = self.map.width;
        let n_taps = 2 * self.softness + 2;
        let reach = self.softness as f32 + 0.5;
        let (left, top) = (column - reach, row - reach);
        let end = (size - n_taps) as f32;
        if !(left >= 0.0 && top >= 0.0 && left < end && top < end) {
            return 1.0;
        }
        let (first_column, first_row) = (left as u32, top as u32);
        let (right, below) = (left - first_column as f32, top - first_row as f32);
        let mut hidden = 0.0;
        for tap in 0..n_taps {
            let first = (first_row as usize + tap) * size + first_column as usize;
            let texels = &self.map.nearness[first..first + n_taps];
            let is_hidden = |texel: usize| f32::from(u8::from(texels[texel] > height));
            let inner: f32 = texels.iter().map(|&texel| f32::from(u8::from(texel > height))).sum();
            let in_row = inner - is_hidden(0) * right - is_hidden(n_taps - 1) * (1.0 - right);
            hidden += in_row * edge_weight(tap, n_taps, below);
        }
        let width = (n_taps - 1) as f32;
        1.0 - hidden / (width * width)
    }
}

/// Of a row of taps, the first and last of which count in part.
fn edge_weight(tap: usize, n_taps: usize, offset: f32) -> f32 {
    match tap {
        0 => 1.0 - offset,
        last if last == n_taps - 1 => offset,
        _ => 1.0,
    }
}
