//! How far a point is from the surface of a form, and in which direction.
//!
//! # Units and frames
//!
//! Metres in the body's frame. Distances are above 0 outside and below 0 within.

use crate::geometry::Vec3;
use crate::scene::{Bowl, Shape};

/// A distance with the direction in which it grows.
pub(super) type Distance = (f32, Vec3);

/// From the surface of a form.
pub(super) fn distance(shape: &Shape, point: &Vec3) -> Distance {
    match *shape {
        Shape::Cuboid { half_extents_m } => of_cuboid(&half_extents_m.into(), point),
        Shape::Cylinder { radius_m, half_height_m } => of_cylinder(radius_m, half_height_m, point),
        Shape::Ball { radius_m } => {
            let length = point.norm();
            (length - radius_m, point.try_normalize(1e-9).unwrap_or(Vec3::z()))
        }
        Shape::OpenBox { inner_m, wall_m } => of_open_box(inner_m, wall_m, point),
        Shape::Bowl(bowl) => of_bowl(&bowl, point),
    }
}

fn of_cuboid(half: &Vec3, point: &Vec3) -> Distance {
    let beyond = point.abs() - half;
    let outside = beyond.map(|length| length.max(0.0));
    let length = outside.norm();
    let signed = |axis: usize, length: f32| if point[axis] < 0.0 { -length } else { length };
    if length > 0.0 {
        return (length, Vec3::from_fn(|axis, _| signed(axis, outside[axis] / length)));
    }
    let nearest = beyond.imax();
    let mut direction = Vec3::zeros();
    direction[nearest] = signed(nearest, 1.0);
    (beyond[nearest], direction)
}

/// From a rectangle about the origin, in the plane.
fn of_rectangle(half: [f32; 2], point: [f32; 2]) -> (f32, [f32; 2]) {
    let (length, direction) = of_cuboid(&Vec3::new(half[0], half[1], f32::MAX), &Vec3::new(point[0], point[1], 0.0));
    (length, [direction.x, direction.y])
}

fn of_cylinder(radius_m: f32, half_height_m: f32, point: &Vec3) -> Distance {
    let level = point.xy();
    let length = level.norm();
    let outwards = level.try_normalize(1e-9).unwrap_or(nalgebra::Vector2::x());
    let (signed, [radial, axial]) = of_rectangle([radius_m, half_height_m], [length, point.z]);
    (signed, Vec3::new(outwards.x * radial, outwards.y * radial, axial))
}

/// From the nearest of floor and walls.
fn of_open_box([x, y, height]: [f32; 3], wall_m: f32, point: &Vec3) -> Distance {
    let half_wall = wall_m / 2.0;
    let (wall_z, half_height) = (height / 2.0 - half_wall, height / 2.0 + half_wall);
    let side_x = Vec3::new(half_wall, y + wall_m, half_height);
    let side_y = Vec3::new(x, half_wall, half_height);
    let parts = [
        (Vec3::new(0.0, 0.0, -half_wall), Vec3::new(x + wall_m, y + wall_m, half_wall)),
        (Vec3::new(x + half_wall, 0.0, wall_z), side_x),
        (Vec3::new(-x - half_wall, 0.0, wall_z), side_x),
        (Vec3::new(0.0, y + half_wall, wall_z), side_y),
        (Vec3::new(0.0, -y - half_wall, wall_z), side_y),
    ];
    nearest(parts.into_iter().map(|(center, half)| of_cuboid(&half, &(point - center))))
}

/// A bowl is the same about its axis at every eighth of a turn: the point is turned to the side towards x, whose section
/// is a sloping wall, a floor and a foot.
fn of_bowl(bowl: &Bowl, point: &Vec3) -> Distance {
    let Bowl { floor_radius_m, rim_radius_m, height_m, wall_m, foot_radius_m, foot_height_m } = *bowl;
    let side_rad = std::f32::consts::FRAC_PI_4;
    let side = (libm::atan2f(point.y, point.x) / side_rad).round();
    let (sin, cos) = libm::sincosf(side * side_rad);
    let section = [cos * point.x + sin * point.y, point.z];
    let half_wall = wall_m / 2.0;
    let wall_ends = [[floor_radius_m + half_wall, 0.0], [rim_radius_m + half_wall, height_m - half_wall]];
    let floor = of_rectangle([floor_radius_m + wall_m, half_wall], [section[0], section[1] + half_wall]);
    let foot_z = -wall_m - foot_height_m / 2.0;
    let foot = of_rectangle([foot_radius_m, foot_height_m / 2.0], [section[0], section[1] - foot_z]);
    let (signed, [out, up]) = [of_segment(wall_ends, half_wall, section), floor, foot]
        .into_iter()
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .unwrap_or(floor);
    (signed, Vec3::new(cos * out, sin * out, up))
}

/// From what is so near to a segment, in the plane.
fn of_segment([from, to]: [[f32; 2]; 2], half_m: f32, point: [f32; 2]) -> (f32, [f32; 2]) {
    let [along, of] = [[to[0] - from[0], to[1] - from[1]], [point[0] - from[0], point[1] - from[1]]];
    let share = (along[0] * of[0] + along[1] * of[1]) / (along[0] * along[0] + along[1] * along[1]);
    let share = share.clamp(0.0, 1.0);
    let beside = [of[0] - share * along[0], of[1] - share * along[1]];
    let length = (beside[0] * beside[0] + beside[1] * beside[1]).sqrt().max(1e-9);
    (length - half_m, [beside[0] / length, beside[1] / length])
}

fn nearest(distances: impl Iterator<Item = Distance>) -> Distance {
    distances.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((0.0, Vec3::z()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(shape: &Shape, point: [f32; 3], expected_m: f32) {
        let (found, _) = distance(shape, &point.into());
        assert!((found - expected_m).abs() < 1e-6, "{found} instead of {expected_m}");
    }

    #[test]
    fn distances_are_those_by_hand() {
        let cube = Shape::Cuboid { half_extents_m: [0.02, 0.03, 0.04] };
        check(&cube, [0.05, 0.07, 0.0], 0.05); // 3 and 4 centimetres beyond
        check(&cube, [0.015, 0.0, 0.0], -0.005);
        let can = Shape::Cylinder { radius_m: 0.02, half_height_m: 0.05 };
        check(&can, [0.03, 0.04, 0.0], 0.03);
        check(&can, [0.0, 0.0, 0.06], 0.01);
        check(&Shape::Ball { radius_m: 0.02 }, [0.0, 0.0, -0.05], 0.03);
        let bin = Shape::OpenBox { inner_m: [0.1, 0.08, 0.06], wall_m: 0.004 };
        check(&bin, [0.0, 0.0, 0.01], 0.01); // above the floor, whose upper side is at 0
        check(&bin, [0.09, 0.0, 0.03], 0.01); // before a wall
        check(&bin, [0.102, 0.0, 0.03], -0.002); // in the middle of it
    }

    #[test]
    fn a_bowl_is_a_floor_and_eight_sloping_walls() {
        let bowl = Bowl {
            floor_radius_m: 0.04,
            rim_radius_m: 0.07,
            height_m: 0.04,
            wall_m: 0.01,
            foot_radius_m: 0.03,
            foot_height_m: 0.02,
        };
        let shape = Shape::Bowl(bowl);
        check(&shape, [0.0, 0.0, 0.01], 0.01);
        check(&shape, [0.0, 0.0, -0.04], 0.01); // below the foot
        // From the middle of the floor's edge, 0.045 and 0, the wall rises 35 mm on 30: 10 mm aside of it are 5 outside.
        let slope = (0.030_f32.hypot(0.035), 0.030, 0.035);
        let beside = [slope.2 / slope.0 * 0.01, -slope.1 / slope.0 * 0.01];
        let middle = [0.06 + beside[0], 0.0175 + beside[1]];
        check(&shape, [middle[0], 0.0, middle[1]], 0.005);
        check(&shape, [0.0, -middle[0], middle[1]], 0.005);
    }

    #[test]
    fn directions_are_the_slopes_of_distances() {
        let bowl = Bowl {
            floor_radius_m: 0.04,
            rim_radius_m: 0.065,
            height_m: 0.05,
            wall_m: 0.004,
            foot_radius_m: 0.03,
            foot_height_m: 0.016,
        };
        let shapes = [
            Shape::Cuboid { half_extents_m: [0.02, 0.03, 0.04] },
            Shape::Cylinder { radius_m: 0.02, half_height_m: 0.05 },
            Shape::Ball { radius_m: 0.02 },
            Shape::OpenBox { inner_m: [0.1, 0.08, 0.06], wall_m: 0.004 },
            Shape::Bowl(bowl),
        ];
        let points = [[0.033, 0.041, 0.012], [-0.05, 0.013, 0.07], [0.011, -0.062, -0.03]];
        for (shape, point) in shapes.iter().flat_map(|shape| points.map(|point| (shape, Vec3::from(point)))) {
            let (_, direction) = distance(shape, &point);
            for axis in 0..3 {
                let mut step = Vec3::zeros();
                step[axis] = 1e-4;
                let slope = (distance(shape, &(point + step)).0 - distance(shape, &(point - step)).0) / 2e-4;
                assert!(
                    (slope - direction[axis]).abs() < 0.02,
                    "{shape:?} {point:?} {axis}: {slope} {}",
                    direction[axis]
                );
            }
        }
    }
}
