//! The form of a bowl: an eight-sided funnel on a foot, made of convex prisms.
//!
//! # Nesting
//!
//! A bowl in an equal bowl stands with its foot on the other's floor. Nothing wedges: their walls stay apart by
//! [`Bowl::clearance_m`], on all sides.
//!
//! # Units and frames
//!
//! Metres; the origin is the middle of the floor's upper side, z up. Radii reach to the middles of sides.

/// The numbers of a bowl.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bowl {
    /// Inner radius of the floor.
    pub floor_radius_m: f32,
    /// Inner radius at the rim, greater than the floor's.
    pub rim_radius_m: f32,
    /// Height of the rim above the floor.
    pub height_m: f32,
    /// Thickness of walls (level) and floor.
    pub wall_m: f32,
    /// Radius of the foot.
    pub foot_radius_m: f32,
    /// Height of the foot below the floor.
    pub foot_height_m: f32,
}

/// A convex body between two polygons of as many corners, counted anticlockwise from above.
#[derive(Clone, Debug, PartialEq)]
pub struct Prism {
    /// Corners of the lower polygon.
    pub lower: Vec<[f32; 3]>,
    /// Corners of the upper one, each above its lower.
    pub upper: Vec<[f32; 3]>,
}

/// tan(22.5°): half of a side over the radius to its middle.
const HALF_SIDE: f32 = 0.414_213_57;
/// Corners of the octagon of radius 1, anticlockwise from the side towards x.
const CORNERS: [[f32; 2]; 8] = [
    [1.0, -HALF_SIDE],
    [1.0, HALF_SIDE],
    [HALF_SIDE, 1.0],
    [-HALF_SIDE, 1.0],
    [-1.0, HALF_SIDE],
    [-1.0, -HALF_SIDE],
    [-HALF_SIDE, -1.0],
    [HALF_SIDE, -1.0],
];

impl Bowl {
    /// Inner radius at a height above the floor.
    pub fn radius_at_m(&self, height_m: f32) -> f32 {
        self.floor_radius_m + (self.rim_radius_m - self.floor_radius_m) * height_m / self.height_m
    }

    /// Height of a bowl's floor above that of the equal bowl it stands in.
    pub fn pitch_m(&self) -> f32 {
        self.foot_height_m + self.wall_m
    }

    /// Level distance between the walls of two equal bowls, one standing in the middle of the other.
    pub fn clearance_m(&self) -> f32 {
        self.radius_at_m(self.pitch_m()) - self.floor_radius_m - self.wall_m
    }

    /// Foot, floor, and the eight walls anticlockwise from the one towards x.
    pub fn prisms(&self) -> Vec<Prism> {
        let Self { floor_radius_m, rim_radius_m, height_m, wall_m, foot_radius_m, foot_height_m } = *self;
        let floor_outer_m = floor_radius_m + wall_m;
        let foot =
            Prism { lower: octagon(foot_radius_m, -wall_m - foot_height_m), upper: octagon(foot_radius_m, -wall_m) };
        let floor = Prism { lower: octagon(floor_outer_m, -wall_m), upper: octagon(floor_outer_m, 0.0) };
        let wall = |side: usize| {
            let trapezoid = |inner_m: f32, z: f32| {
                let [inner, outer] = [inner_m, inner_m + wall_m].map(|radius_m| octagon(radius_m, z));
                let next = (side + 1) % CORNERS.len();
                vec![inner[side], outer[side], outer[next], inner[next]]
            };
            Prism { lower: trapezoid(floor_radius_m, 0.0), upper: trapezoid(rim_radius_m, height_m) }
        };
        [foot, floor].into_iter().chain((0..CORNERS.len()).map(wall)).collect()
    }
}

fn octagon(radius_m: f32, z: f32) -> Vec<[f32; 3]> {
    CORNERS.iter().map(|[x, y]| [radius_m * x, radius_m * y, z]).collect()
}

impl Prism {
    /// All corners: the lower polygon's, then the upper's.
    pub fn corners(&self) -> Vec<[f32; 3]> {
        [self.lower.as_slice(), &self.upper].concat()
    }

    /// The surface as triangles of corners, anticlockwise from outside.
    pub fn triangles(&self) -> Vec<[u32; 3]> {
        let n_corners = self.lower.len() as u32;
        let caps = (1..n_corners.saturating_sub(1))
            .flat_map(|corner| [[0, corner + 1, corner], [n_corners, n_corners + corner, n_corners + corner + 1]]);
        let sides = (0..n_corners).flat_map(|corner| {
            let next = (corner + 1) % n_corners;
            [[corner, next, n_corners + next], [corner, n_corners + next, n_corners + corner]]
        });
        caps.chain(sides).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOWL: Bowl = Bowl {
        floor_radius_m: 0.04,
        rim_radius_m: 0.065,
        height_m: 0.05,
        wall_m: 0.004,
        foot_radius_m: 0.03,
        foot_height_m: 0.016,
    };

    /// Volume from the surface by the divergence theorem; positive only when the triangles look outwards.
    fn volume_m3(prism: &Prism) -> f32 {
        let corners = prism.corners();
        let of = |[a, b, c]: [u32; 3]| {
            let [a, b, c] = [a, b, c].map(|corner| nalgebra::Vector3::from(corners[corner as usize]));
            a.dot(&b.cross(&c)) / 6.0
        };
        prism.triangles().into_iter().map(of).sum()
    }

    #[test]
    fn the_surface_of_each_prism_is_closed_and_looks_outwards() {
        let octagon_m2 = |radius_m: f32| 8.0 * HALF_SIDE * radius_m * radius_m;
        let prisms = BOWL.prisms();
        assert_eq!(prisms.len(), 10);
        assert!((volume_m3(&prisms[0]) - octagon_m2(0.03) * 0.016).abs() < 1e-9);
        assert!((volume_m3(&prisms[1]) - octagon_m2(0.044) * 0.004).abs() < 1e-9);
        let walls_m3: f32 = prisms[2..].iter().map(volume_m3).sum();
        // The area of the ring grows linearly with the height.
        let ring_m2 = |radius_m: f32| octagon_m2(radius_m + 0.004) - octagon_m2(radius_m);
        assert!((walls_m3 - (ring_m2(0.04) + ring_m2(0.065)) / 2.0 * 0.05).abs() < 1e-8);
    }

    #[test]
    fn the_walls_of_nested_bowls_do_not_touch() {
        assert!((BOWL.pitch_m() - 0.02).abs() < 1e-6);
        assert!((BOWL.clearance_m() - 0.006).abs() < 1e-6);
    }
}
