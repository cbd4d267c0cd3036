//! Where a body of known form stands, from points of its surface.
//!
//! The sum of squared distances of the points from the surface is made small over position and turn about the vertical
//! (Gauss and Newton, damped; Tukey's weights, so that points of other surfaces count for nothing), from where the body
//! was seen last, and where that does not do from several turns and with each of its sides up.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use crate::geometry::{Pose, Rotation, Vec3};
use crate::perception::surface;
use crate::scene::{Bowl, Shape};

/// Fewer points tell nothing.
const LEAST_POINTS: usize = 20;
/// Points farther from the surface than this count for nothing, in metres: at first, and in the end.
const WIDE_M: f32 = 0.03;
const NEAR_M: f32 = 0.008;
const N_STEPS: usize = 12;
/// How many of them are wide.
const N_WIDE: usize = 6;
/// Part of the points' number that damps a step: what the points do not tell stays as it was.
const DAMPING: f32 = 0.01;
/// Turns are damped as if points were so far from the axis, in metres.
const ARM_M: f32 = 0.03;
/// A fit is believed with so many of its points near, and those so near on average, in metres.
const LEAST_INLIERS: f32 = 0.6;
const MOST_MISFIT_M: f32 = 0.004;
/// With so good a fit where the body was seen last nothing else is looked for.
const SAME_INLIERS: f32 = 0.75;
const SAME_MISFIT_M: f32 = 0.0028;
/// How far a body may have gone to be looked for from where it was, in metres.
const SAME_PLACE_M: f32 = 0.03;

/// A body as it was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fit {
    pub(super) in_world: Pose,
    /// Share of the points that are near its surface.
    inliers: f32,
    /// Root of their mean squared distance.
    misfit_m: f32,
    /// Sum of squared distances of all points, each at most [`NEAR_M`] squared.
    cost: f32,
}

impl Fit {
    fn is_believed(&self) -> bool {
        self.inliers >= LEAST_INLIERS && self.misfit_m <= MOST_MISFIT_M
    }

    fn is_the_same(&self) -> bool {
        self.inliers >= SAME_INLIERS && self.misfit_m <= SAME_MISFIT_M
    }
}

/// Finds a body from points in the world that a camera at `eye` sees of it; `None` where they do not show it.
pub(super) fn locate(shape: &Shape, points: &[Vec3], eye: &Vec3, last: Option<&Pose>) -> Option<Pose> {
    if points.len() < LEAST_POINTS {
        return None;
    }
    let start = start(shape, points, eye);
    let is_near = |last: &&Pose| (last.translation.vector - start).norm() <= SAME_PLACE_M;
    if let Some(last) = last.filter(is_near) {
        let found = fit(shape, points, last);
        if found.is_the_same() {
            return Some(alike(shape, found.in_world, last));
        }
    }
    let stances = stances(shape);
    let starts = stances.iter().flat_map(|&(stance, half_height_m)| {
        let position = Vec3::new(start.x, start.y, top_z(points) - half_height_m);
        turns_rad(shape, &stance).map(move |turn_rad| Pose::from_parts(position.into(), yaw(turn_rad) * stance))
    });
    let best = starts.map(|start| fit(shape, points, &start)).min_by(|a, b| a.cost.total_cmp(&b.cost))?;
    best.is_believed().then(|| last.map_or(best.in_world, |last| alike(shape, best.in_world, last)))
}

fn yaw(turn_rad: f32) -> Rotation {
    Rotation::from_axis_angle(&Vec3::z_axis(), turn_rad)
}

/// The turns that points are fitted from, over the period of a form.
fn turns_rad(shape: &Shape, stance: &Rotation) -> impl Iterator<Item = f32> + use<> {
    let n_starts: usize = match shape {
        Shape::Ball { .. } => 1,
        Shape::Cylinder { .. } if *stance == Rotation::identity() => 1,
        Shape::Bowl(_) => 2,
        Shape::Cylinder { .. } | Shape::Cuboid { .. } | Shape::OpenBox { .. } => 4,
    };
    let period_rad = period_rad(shape);
    (0..n_starts).map(move |start| period_rad * start as f32 / n_starts as f32)
}

/// The least turn about the vertical after which a form is the same.
fn period_rad(shape: &Shape) -> f32 {
    match *shape {
        Shape::Cuboid { half_extents_m: [x, y, z] } if x == y && y == z => FRAC_PI_2,
        Shape::OpenBox { inner_m: [x, y, _], .. } if x == y => FRAC_PI_2,
        Shape::Bowl(_) => FRAC_PI_4,
        Shape::Cuboid { .. } | Shape::OpenBox { .. } | Shape::Cylinder { .. } | Shape::Ball { .. } => PI,
    }
}

/// The ways to stand or lie that look different, each with the height of the centre's upper end above it.
fn stances(shape: &Shape) -> Vec<(Rotation, f32)> {
    let upright = Rotation::identity();
    let x_up = Rotation::from_axis_angle(&Vec3::y_axis(), -FRAC_PI_2);
    let y_up = Rotation::from_axis_angle(&Vec3::x_axis(), FRAC_PI_2);
    match *shape {
        Shape::Cuboid { half_extents_m: [x, y, z] } if x == y && y == z => vec![(upright, z)],
        Shape::Cuboid { half_extents_m: [x, y, z] } if y == z => vec![(upright, z), (x_up, x)],
        Shape::Cuboid { half_extents_m: [x, y, z] } => vec![(upright, z), (x_up, x), (y_up, y)],
        Shape::Cylinder { radius_m, half_height_m } => vec![(upright, half_height_m), (x_up, radius_m)],
        Shape::Ball { radius_m } => vec![(upright, radius_m)],
        // Most points are of the rim, or of the floor.
        Shape::OpenBox { inner_m: [.., height_m], .. } | Shape::Bowl(Bowl { height_m, .. }) => {
            vec![(upright, height_m), (upright, 0.0)]
        }
    }
}

/// About where the body's middle is: behind the middle of its points, as the camera sees them; of what has a rim in the
/// middle of that.
fn start(shape: &Shape, points: &[Vec3], eye: &Vec3) -> Vec3 {
    let z = top_z(points) - shape.half_extents_m().z;
    if shape.rim_m().is_some() {
        let [x, y] = [0, 1].map(|axis| (level(points, axis, 0.02) + level(points, axis, 0.98)) / 2.0);
        return Vec3::new(x, y, z);
    }
    let middle = points.iter().sum::<Vec3>() / points.len() as f32;
    let away = Vec3::new(middle.x - eye.x, middle.y - eye.y, 0.0).try_normalize(1e-6).unwrap_or_default();
    let center = middle + away * (0.4 * shape.half_extents_m().min());
    Vec3::new(center.x, center.y, z)
}

/// The height that nine points of ten are below.
fn top_z(points: &[Vec3]) -> f32 {
    level(points, 2, 0.9)
}

/// What a share of the points is below, along an axis.
fn level(points: &[Vec3], axis: usize, share: f32) -> f32 {
    let mut along: Vec<f32> = points.iter().map(|point| point[axis]).collect();
    let at = (along.len().saturating_sub(1) as f32 * share) as usize;
    *along.select_nth_unstable_by(at, f32::total_cmp).1
}

fn fit(shape: &Shape, points: &[Vec3], start: &Pose) -> Fit {
    let mut pose = *start;
    for step in 0..N_STEPS {
        let width_m = if step < N_WIDE { WIDE_M } else { NEAR_M };
        let Some(by) = improvement(shape, points, &pose, width_m) else { break };
        pose.translation.vector += by.xyz();
        pose.rotation = yaw(by.w.clamp(-0.5, 0.5)) * pose.rotation;
        if by.xyz().norm() < 1e-5 && by.w.abs() < 1e-4 && step >= N_WIDE {
            break;
        }
    }
    judged(shape, points, pose)
}

/// A step of Gauss and Newton: a displacement and a turn.
fn improvement(shape: &Shape, points: &[Vec3], pose: &Pose, width_m: f32) -> Option<nalgebra::Vector4<f32>> {
    let mut normal = nalgebra::Matrix4::<f32>::zeros();
    let mut right = nalgebra::Vector4::<f32>::zeros();
    for point in points {
        let about = point - pose.translation.vector;
        let (distance_m, direction) = surface::distance(shape, &pose.rotation.inverse_transform_vector(&about));
        let share = distance_m / width_m;
        if share.abs() >= 1.0 {
            continue;
        }
        let weight = (1.0 - share * share) * (1.0 - share * share);
        let out = pose.rotation * direction;
        // Moving the body along `out` brings its surface nearer; so does turning it under the point.
        let row = nalgebra::Vector4::new(out.x, out.y, out.z, out.y * about.x - out.x * about.y);
        normal += row * row.transpose() * weight;
        right += row * (weight * distance_m);
    }
    let damping = DAMPING * points.len() as f32;
    normal += nalgebra::Matrix4::from_diagonal(&nalgebra::Vector4::new(1.0, 1.0, 1.0, ARM_M * ARM_M)) * damping;
    Some(normal.cholesky()?.solve(&right))
}

fn judged(shape: &Shape, points: &[Vec3], in_world: Pose) -> Fit {
    let (mut n_near, mut squares, mut cost) = (0, 0.0, 0.0);
    for point in points {
        let (distance_m, _) = surface::distance(shape, &in_world.inverse_transform_point(&(*point).into()).coords);
        let square = distance_m * distance_m;
        cost += square.min(NEAR_M * NEAR_M);
        if distance_m.abs() < NEAR_M {
            (n_near, squares) = (n_near + 1, squares + square);
        }
    }
    let inliers = n_near as f32 / points.len() as f32;
    Fit { in_world, inliers, misfit_m: (squares / (n_near as f32).max(1.0)).sqrt(), cost }
}

/// The same as it was seen before: of the turns that look alike the nearest.
fn alike(shape: &Shape, found: Pose, last: &Pose) -> Pose {
    let period_rad = period_rad(shape);
    let n_turns = (2.0 * PI / period_rad).round() as u32;
    let turned = |turn: u32| yaw(period_rad * turn as f32) * found.rotation;
    let off_rad = |rotation: &Rotation| rotation.angle_to(&last.rotation);
    let nearest = (0..n_turns).map(turned).min_by(|a, b| off_rad(a).total_cmp(&off_rad(b)));
    Pose::from_parts(found.translation, nearest.unwrap_or(found.rotation))
}

/// How large a body's outline is as a camera at `eye` sees it with nothing before it, at a focal length of 1; of a bowl
/// about.
pub(super) fn outline(shape: &Shape, in_world: &Pose, eye: &Vec3) -> f32 {
    let to_eye = eye - in_world.translation.vector;
    let toward = in_world.rotation.inverse_transform_vector(&to_eye).abs().normalize();
    let half = shape.half_extents_m();
    let sides = Vec3::new(half.y * half.z, half.x * half.z, half.x * half.y) * 4.0;
    let part = match shape {
        Shape::Ball { .. } => FRAC_PI_4 / toward.sum(),
        Shape::Cylinder { .. } | Shape::Bowl(_) => FRAC_PI_4,
        Shape::Cuboid { .. } | Shape::OpenBox { .. } => 1.0,
    };
    part * sides.dot(&toward) / to_eye.norm_squared()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points on the upper side and on two sides of a cube, as a camera before and above it sees them.
    fn seen_of_cube(half_m: f32, in_world: &Pose) -> Vec<Vec3> {
        let grid = || {
            (0..10).flat_map(|row| (0..10).map(move |column| [row, column].map(|at| half_m * (at as f32 / 4.5 - 1.0))))
        };
        let faces = grid().flat_map(|[a, b]| [[a, b, half_m], [a, -half_m, b], [half_m, a, b]]);
        faces.map(|point| in_world.transform_point(&point.into()).coords).collect()
    }

    #[test]
    fn a_cube_is_found_where_it_stands_turned_as_it_is() {
        let shape = Shape::Cuboid { half_extents_m: [0.025; 3] };
        for turn_rad in [0.0, 0.3, 0.7, 1.2] {
            let in_world = crate::geometry::upright(Vec3::new(0.1, -0.05, 0.075), turn_rad);
            let found = locate(&shape, &seen_of_cube(0.025, &in_world), &Vec3::new(0.3, -1.0, 1.0), None).unwrap();
            let off_m = (found.translation.vector - in_world.translation.vector).norm();
            let turn = (crate::geometry::yaw_rad(&found) - turn_rad).rem_euclid(FRAC_PI_2);
            assert!(off_m < 1e-4, "{turn_rad}: {off_m}");
            assert!(turn.min(FRAC_PI_2 - turn) < 1e-3, "{turn_rad}: {turn}");
        }
    }

    #[test]
    fn a_cube_keeps_the_turn_that_it_was_seen_with() {
        let shape = Shape::Cuboid { half_extents_m: [0.025; 3] };
        let in_world = crate::geometry::upright(Vec3::new(0.1, -0.05, 0.025), 0.3 + FRAC_PI_2);
        let last = crate::geometry::upright(Vec3::new(0.11, -0.05, 0.025), 0.25 + PI);
        let found = locate(&shape, &seen_of_cube(0.025, &in_world), &Vec3::new(0.3, -1.0, 1.0), Some(&last)).unwrap();
        assert!((crate::geometry::yaw_rad(&found) - (0.3 - PI)).abs() < 1e-3);
    }

    #[test]
    fn few_points_and_points_of_something_else_show_nothing() {
        let shape = Shape::Cuboid { half_extents_m: [0.025; 3] };
        let eye = Vec3::new(0.3, -1.0, 1.0);
        let in_world = crate::geometry::upright(Vec3::new(0.1, -0.05, 0.025), 0.3);
        assert_eq!(locate(&shape, &seen_of_cube(0.025, &in_world)[..19], &eye, None), None);
        assert_eq!(locate(&shape, &seen_of_cube(0.1, &in_world), &eye, None), None);
    }

    #[test]
    fn an_outline_is_that_of_the_sides_that_face_the_camera() {
        let at = Pose::translation(0.0, 0.0, 0.0);
        let brick = Shape::Cuboid { half_extents_m: [0.1, 0.2, 0.3] };
        // From above, 2 m away: 0.2 by 0.4 m.
        assert!((outline(&brick, &at, &Vec3::new(0.0, 0.0, 2.0)) - 0.08 / 4.0).abs() < 1e-6);
        // A ball of 0.1 m from anywhere: a disk.
        let ball = Shape::Ball { radius_m: 0.1 };
        let disk = PI * 0.01;
        assert!((outline(&ball, &at, &Vec3::new(1.0, 0.0, 0.0)) - disk).abs() < 1e-5);
        assert!((outline(&ball, &at, &Vec3::new(0.6, 0.0, 0.8)) - disk).abs() < 1e-5);
    }

    /// What a camera sees of a body: where rays 3 mm apart meet its surface.
    fn seen(shape: &Shape, in_world: &Pose, eye: &Vec3) -> Vec<Vec3> {
        let forward = (in_world.translation.vector - eye).normalize();
        let right = forward.cross(&Vec3::z()).normalize();
        let up = right.cross(&forward);
        let grid = (-60..=60).flat_map(|row| (-60..=60).map(move |column| (column as f32, row as f32)));
        let ray = |(column, row): (f32, f32)| {
            let to = in_world.translation.vector + right * (0.003 * column) + up * (0.003 * row);
            let way = (to - eye).normalize();
            let mut along_m = 0.0;
            for _ in 0..200 {
                let point = eye + way * along_m;
                let in_body = in_world.inverse_transform_point(&point.into()).coords;
                let (distance_m, _) = surface::distance(shape, &in_body);
                if distance_m < 1e-4 {
                    return Some(point);
                }
                along_m += distance_m;
                if along_m > 3.0 {
                    return None;
                }
            }
            None
        };
        let hits: Vec<Vec3> = grid.filter_map(ray).collect();
        let stride = hits.len().div_ceil(240).max(1);
        hits.into_iter().step_by(stride).collect()
    }

    #[test]
    fn every_form_is_found_from_what_a_camera_sees_of_it() {
        let bowl = crate::scene::Bowl {
            floor_radius_m: 0.042,
            rim_radius_m: 0.0645,
            height_m: 0.045,
            wall_m: 0.0035,
            foot_radius_m: 0.028,
            foot_height_m: 0.0165,
        };
        let shapes = [
            Shape::Cuboid { half_extents_m: [0.025; 3] },
            Shape::Cuboid { half_extents_m: [0.028, 0.015, 0.015] },
            Shape::Cuboid { half_extents_m: [0.035, 0.0045, 0.003] },
            Shape::Cylinder { radius_m: 0.0175, half_height_m: 0.02 },
            Shape::Ball { radius_m: 0.018 },
            Shape::OpenBox { inner_m: [0.09, 0.09, 0.02], wall_m: 0.005 },
            Shape::Bowl(bowl),
        ];
        for (shape, turn_rad) in shapes.iter().flat_map(|shape| [0.1, 0.5, 1.0].map(|turn| (shape, turn))) {
            let in_world = crate::geometry::upright(Vec3::new(0.1, -0.05, shape.foot_m()), turn_rad);
            let eye = Vec3::new(-0.2, 1.0, 1.0);
            let points = seen(shape, &in_world, &eye);
            let found = locate(shape, &points, &eye, None);
            // A wall's inner side may be taken for its outer one.
            let most_m = if let Shape::OpenBox { wall_m, .. } = shape { *wall_m } else { 1e-3 };
            let off_m = found.map(|found| (found.translation.vector - in_world.translation.vector).norm());
            assert!(
                off_m.is_some_and(|off_m| off_m < most_m),
                "{shape:?} turned by {turn_rad}: {off_m:?} of {}",
                points.len()
            );
        }
    }

    #[test]
    fn a_can_that_lies_is_told_from_one_that_stands() {
        let shape = Shape::Cylinder { radius_m: 0.0175, half_height_m: 0.03 };
        let lying = Pose::from_parts(
            Vec3::new(0.0, 0.1, 0.0175).into(),
            yaw(0.4) * Rotation::from_axis_angle(&Vec3::y_axis(), -FRAC_PI_2),
        );
        let points = (0..20).flat_map(|turn| {
            let angle = 0.15 * turn as f32 - 0.5;
            (0..8).map(move |at| Vec3::new(0.0175 * angle.cos(), 0.0175 * angle.sin(), 0.03 * (at as f32 / 3.5 - 1.0)))
        });
        let points: Vec<Vec3> = points.map(|point| lying.transform_point(&point.into()).coords).collect();
        let found = locate(&shape, &points, &Vec3::new(0.0, -0.95, 0.95), None).unwrap();
        let axis = found.rotation * Vec3::z();
        assert!(axis.z.abs() < 1e-3, "it stands: {axis:?}");
        assert!((found.translation.vector - lying.translation.vector).norm() < 2e-3);
    }
}
