//! What a depth sensor makes of a picture.
//!
//! # Source
//!
//! The deviation along the ray is of the form that Fankhauser et al., "Kinect v2 for mobile robot navigation: evaluation
//! and modeling", ICAR 2015, fitted: with the depth and with the angle at which a surface is seen. Pixels at an edge may
//! lie anywhere between the two surfaces ("flying pixels").

use rand::Rng;
use rand_chacha::ChaCha8Rng;

use crate::geometry::Vec3;
use crate::perception::Sensor;
use crate::render::{Camera, Picture, Segment};

/// No more points of a body are taken, and every so many rows and columns one of the table.
const MOST_POINTS: usize = 240;
const TABLE_STRIDE: usize = 16;
/// How far aside a depth is measured from where it is told, as a standard deviation, in pixels.
const LATERAL_PX: f32 = 0.4;
/// Surfaces of neighbouring pixels that are farther apart mix, in metres.
const JUMP_M: f32 = 0.02;
/// How often they do.
const MIXED: f32 = 0.5;
/// How often there is no depth.
const HOLES: f32 = 0.01;
/// Surfaces that are seen flatter give no depth.
const MOST_ANGLE_RAD: f32 = 1.4;

/// Points in the camera's frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Cloud {
    pub(super) table: Vec<Vec3>,
    /// Of each body.
    pub(super) bodies: Vec<Shown>,
}

/// What shows a body.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Shown {
    /// How many pixels of the picture.
    pub(super) n_pixels: usize,
    /// Points of its surface, not of all of them.
    pub(super) points: Vec<Vec3>,
}

impl Cloud {
    /// The same with something added to all depths.
    pub(super) fn farther_by(mut self, offset_m: f32) -> Self {
        let all = self.table.iter_mut().chain(self.bodies.iter_mut().flat_map(|shown| &mut shown.points));
        all.for_each(|point| *point *= (point.z + offset_m) / point.z);
        self
    }
}

/// Two draws from the standard normal distribution, by Box and Muller.
pub(super) fn normals(rng: &mut impl Rng) -> [f32; 2] {
    let (radius, turn): (f32, f32) = (1.0 - rng.random::<f32>(), rng.random());
    let length = (-2.0 * libm::logf(radius)).sqrt();
    let (sin, cos) = libm::sincosf(std::f32::consts::TAU * turn);
    [length * cos, length * sin]
}

/// Measures a picture.
pub(super) fn measure(
    picture: &Picture,
    camera: &Camera,
    sensor: Sensor,
    n_bodies: usize,
    rng: &mut ChaCha8Rng,
) -> Cloud {
    let (table, bodies) = pixels(picture, n_bodies);
    let mut points = |pixels: &[u32]| -> Vec<Vec3> {
        let pixel = |&pixel: &u32| {
            let (column, row) = (pixel % picture.width, pixel / picture.width);
            let depth_m = match sensor {
                Sensor::Exact => picture.depth_at_m(column, row),
                Sensor::Kinect => kinect_m(picture, camera, [column, row], rng)?,
            };
            Some(ray(camera, [column, row]) * depth_m)
        };
        pixels.iter().filter_map(pixel).collect()
    };
    let table = points(&table);
    let shown = |(n_pixels, pixels): &(usize, Vec<u32>)| Shown { n_pixels: *n_pixels, points: points(pixels) };
    let bodies = bodies.iter().map(shown).collect();
    Cloud { table, bodies }
}

/// The pixels that are measured: of the table and of each body, evenly, after how many the body has.
fn pixels(picture: &Picture, n_bodies: usize) -> (Vec<u32>, Vec<(usize, Vec<u32>)>) {
    let first = Segment::Body(crate::scene::BodyIndex(0)).number();
    let table_number = Segment::Table.number();
    let mut table = Vec::new();
    let mut bodies: Vec<Vec<u32>> = vec![Vec::new(); n_bodies];
    let width = picture.width as usize;
    for (row, segments) in picture.segments.chunks_exact(width.max(1)).enumerate() {
        for (column, &segment) in segments.iter().enumerate() {
            if let Some(pixels) = segment.checked_sub(first).and_then(|body| bodies.get_mut(usize::from(body))) {
                pixels.push((row * width + column) as u32);
            } else if segment == table_number && row % TABLE_STRIDE == 0 && column % TABLE_STRIDE == 0 {
                table.push((row * width + column) as u32);
            }
        }
    }
    let thinned = |pixels: Vec<u32>| {
        let stride = pixels.len().div_ceil(MOST_POINTS).max(1);
        (pixels.len(), pixels.into_iter().step_by(stride).collect())
    };
    (table, bodies.into_iter().map(thinned).collect())
}

/// The ray of a pixel, with 1 along the camera's z.
fn ray(camera: &Camera, [column, row]: [u32; 2]) -> Vec3 {
    let [center_x, center_y] = camera.center_px();
    Vec3::new((column as f32 - center_x) / camera.focal_px, (row as f32 - center_y) / camera.focal_px, 1.0)
}

/// The depth that a Kinect tells of a pixel; `None` for a hole.
fn kinect_m(picture: &Picture, camera: &Camera, [column, row]: [u32; 2], rng: &mut ChaCha8Rng) -> Option<f32> {
    let [aside, below] = normals(rng);
    let [along, _] = normals(rng);
    let [hole, mix, share]: [f32; 3] = rng.random();
    let moved =
        |at: u32, by: f32, size: u32| (at as f32 + LATERAL_PX * by).round().clamp(0.0, (size - 1) as f32) as u32;
    let at = [moved(column, aside, picture.width), moved(row, below, picture.height)];
    let depth_m = picture.depth_at_m(at[0], at[1]);
    let around = neighbours(picture, at);
    let [nearest_m, farthest_m] = around.iter().fold([depth_m; 2], |[low, high], &m| [low.min(m), high.max(m)]);
    if hole < HOLES || !depth_m.is_finite() {
        return None;
    }
    if farthest_m - nearest_m > JUMP_M && mix < MIXED {
        let farthest_m = if farthest_m.is_finite() { farthest_m } else { depth_m };
        return Some(nearest_m + share * (farthest_m - nearest_m));
    }
    let angle_rad = angle_rad(camera, at, depth_m, &around);
    (angle_rad <= MOST_ANGLE_RAD).then(|| depth_m + deviation_m(depth_m, angle_rad) * along)
}

/// The depths left, right, above and below a pixel; its own where there is none.
fn neighbours(picture: &Picture, [column, row]: [u32; 2]) -> [f32; 4] {
    let (last_column, last_row) = (picture.width - 1, picture.height - 1);
    let at = |column: u32, row: u32| picture.depth_at_m(column, row);
    [
        at(column.saturating_sub(1), row),
        at((column + 1).min(last_column), row),
        at(column, row.saturating_sub(1)),
        at(column, (row + 1).min(last_row)),
    ]
}

/// The angle between a surface's normal and the ray to it, from the depths around; across an edge the nearer side counts.
fn angle_rad(camera: &Camera, at: [u32; 2], depth_m: f32, [left, right, above, below]: &[f32; 4]) -> f32 {
    let slope = |before_m: &f32, after_m: &f32| {
        let steps = [depth_m - before_m, after_m - depth_m];
        if steps[0].abs() < steps[1].abs() { steps[0] } else { steps[1] }
    };
    let ray_here = ray(camera, at);
    let pixel = 1.0 / camera.focal_px;
    let (slope_x, slope_y) = (slope(left, right), slope(above, below));
    let across = ray_here * slope_x + Vec3::new(pixel, 0.0, 0.0) * (depth_m + slope_x);
    let down = ray_here * slope_y + Vec3::new(0.0, pixel, 0.0) * (depth_m + slope_y);
    let cos = across.cross(&down).try_normalize(1e-12).map_or(1.0, |normal| normal.dot(&ray_here.normalize()).abs());
    libm::acosf(cos.min(1.0))
}

/// The standard deviation along the ray, in metres.
fn deviation_m(depth_m: f32, angle_rad: f32) -> f32 {
    let z = depth_m;
    let flatness = angle_rad / (std::f32::consts::FRAC_PI_2 - angle_rad);
    let millimetres = 1.5 - 0.5 * z + 0.3 * z * z + 0.1 * z * z.sqrt() * flatness * flatness;
    millimetres / 1000.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depths_are_off_by_about_a_millimetre_before_the_camera_and_by_more_aslant() {
        // 1.5 - 0.5 + 0.3 = 1.3 mm; at 45 degrees 0.1 more.
        assert!((deviation_m(1.0, 0.0) - 0.0013).abs() < 1e-7);
        assert!((deviation_m(1.0, std::f32::consts::FRAC_PI_4) - 0.0014).abs() < 1e-7);
    }

    #[test]
    fn what_is_added_to_depths_moves_points_along_their_rays() {
        let cloud = Cloud {
            table: vec![Vec3::new(1.0, 0.5, 2.0)],
            bodies: vec![Shown { n_pixels: 1, points: vec![Vec3::new(0.0, 0.0, 1.0)] }],
        };
        let farther = cloud.farther_by(0.5);
        assert_eq!(farther.table, [Vec3::new(1.25, 0.625, 2.5)]);
        assert_eq!(farther.bodies[0].points, [Vec3::new(0.0, 0.0, 1.5)]);
    }
}
