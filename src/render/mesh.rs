//! Surfaces of convex polygons, and how each is painted.
//!
//! # Units and frames
//!
//! Metres, in the frame of the body that the mesh is of. Corners run anticlockwise seen from outside.

use crate::geometry::Vec3;
use crate::render::texture::Texture;
use crate::scene::Prism;

/// The ink of a texture on a face.
#[derive(Clone, Copy, Debug)]
pub(super) struct Print {
    /// What is printed.
    pub(super) texture: &'static Texture,
    /// Colour of the ink, linear.
    pub(super) ink: [f32; 3],
    /// Place on the texture: x is `across.0 · point + across.1`, with 1 the width of the texture; y likewise.
    pub(super) across: (Vec3, f32),
    /// See `across`.
    pub(super) down: (Vec3, f32),
}

/// How a face's normal runs over it.
#[derive(Clone, Copy, Debug)]
pub(super) enum Surface {
    /// The same everywhere, with or without print.
    Flat(Option<Print>),
    /// Part of a ball about the frame's origin.
    Ball,
    /// Part of a cone about the frame's z axis: `radial` away from the axis, and `axial` along it.
    Cone {
        /// Share away from the axis; below 0 when seen from within.
        radial: f32,
        /// Share along z.
        axial: f32,
    },
}

/// A convex polygon.
#[derive(Clone, Debug)]
pub(super) struct Face {
    /// Its corners in [`Mesh::corners`].
    pub(super) corners: std::ops::Range<usize>,
    /// Outwards, of length 1.
    pub(super) normal: Vec3,
    /// `normal · corner`, the same for each.
    pub(super) offset: f32,
    /// Linear.
    pub(super) color: [f32; 3],
    pub(super) surface: Surface,
    /// How much it shines, from 0.
    pub(super) gloss: f32,
}

/// Faces of one rigid thing.
#[derive(Clone, Debug, Default)]
pub(super) struct Mesh {
    pub(super) corners: Vec<Vec3>,
    pub(super) faces: Vec<Face>,
    /// No corner is farther from the frame's origin.
    pub(super) radius_m: f32,
    /// By how many texels of the shadow map its far sides may be misplaced before they shadow their own lit sides: 0
    /// for what is thicker than texels are wide.
    pub(super) shadow_slack: f32,
}

/// A colour with its shine.
#[derive(Clone, Copy, Debug)]
pub(super) struct Paint {
    /// Linear.
    pub(super) color: [f32; 3],
    pub(super) gloss: f32,
}

impl Mesh {
    /// Adds a polygon; one without area is left out.
    pub(super) fn polygon(&mut self, corners: &[Vec3], paint: Paint, surface: Surface) {
        let first = corners[0];
        let doubled: Vec3 = corners.windows(2).map(|pair| (pair[0] - first).cross(&(pair[1] - first))).sum();
        let Some(normal) = doubled.try_normalize(1e-12) else { return };
        let begin = self.corners.len();
        self.corners.extend_from_slice(corners);
        self.radius_m = corners.iter().map(Vec3::norm).fold(self.radius_m, f32::max);
        let Paint { color, gloss } = paint;
        let corners = begin..self.corners.len();
        self.faces.push(Face { corners, normal, offset: normal.dot(&first), color, surface, gloss });
    }

    /// A box; `surface` is asked for each side by its outward axis.
    pub(super) fn cuboid(&mut self, center: Vec3, half: Vec3, paint: Paint, surface: impl Fn(Vec3) -> Surface) {
        for axis in 0..3 {
            for sign in [1.0, -1.0] {
                let mut normal = Vec3::zeros();
                normal[axis] = sign;
                let (mut across, mut up) = (Vec3::zeros(), Vec3::zeros());
                across[(axis + 1) % 3] = half[(axis + 1) % 3] * sign;
                up[(axis + 2) % 3] = half[(axis + 2) % 3];
                let middle = center + normal.component_mul(&half);
                let corners = [middle - across - up, middle + across - up, middle + across + up, middle - across + up];
                self.polygon(&corners, paint, surface(normal));
            }
        }
    }

    /// A box with plain sides.
    pub(super) fn plain_cuboid(&mut self, center: [f32; 3], half: [f32; 3], paint: Paint) {
        self.cuboid(center.into(), half.into(), paint, |_| Surface::Flat(None));
    }

    /// The sides of a prism that `wanted` lets through by number: lower cap, upper cap, then around.
    pub(super) fn prism(&mut self, prism: &Prism, paint: Paint, side: impl Fn(usize) -> Option<Surface>) {
        let point = |corner: &[f32; 3]| Vec3::from(*corner);
        let n_corners = prism.lower.len();
        let lower: Vec<Vec3> = prism.lower.iter().rev().map(point).collect();
        let upper: Vec<Vec3> = prism.upper.iter().map(point).collect();
        for (number, cap) in [lower, upper].iter().enumerate() {
            if let Some(surface) = side(number) {
                self.polygon(cap, paint, surface);
            }
        }
        for corner in 0..n_corners {
            let next = (corner + 1) % n_corners;
            let corners = [prism.lower[corner], prism.lower[next], prism.upper[next], prism.upper[corner]];
            if let Some(surface) = side(corner + 2) {
                self.polygon(&corners.map(Vec3::from), paint, surface);
            }
        }
    }

    /// Walls between rings about the z axis, given by radius and height, from below to above.
    pub(super) fn lathe(
        &mut self,
        profile: &[[f32; 2]],
        n_sides: usize,
        paint: Paint,
        surface: impl Fn(f32, f32) -> Surface,
    ) {
        for pair in profile.windows(2) {
            let [[lower_m, lower_z], [upper_m, upper_z]] = [pair[0], pair[1]];
            let (rise, shrink) = (upper_z - lower_z, lower_m - upper_m);
            let length = (rise * rise + shrink * shrink).sqrt().max(1e-9);
            let surface = surface(rise / length, shrink / length);
            for side in 0..n_sides {
                let [from, to] = [side, side + 1].map(|corner| direction(corner, n_sides));
                let ring = |[x, y]: [f32; 2], radius_m: f32, z: f32| Vec3::new(radius_m * x, radius_m * y, z);
                let mut corners = vec![ring(from, lower_m, lower_z), ring(to, lower_m, lower_z)];
                corners.extend([ring(to, upper_m, upper_z), ring(from, upper_m, upper_z)]);
                corners.dedup_by(|a, b| (*a - *b).norm() < 1e-7);
                if corners.len() > 3 && (corners[0] - corners[corners.len() - 1]).norm() < 1e-7 {
                    corners.pop();
                }
                self.polygon(&corners, paint, surface);
            }
        }
    }

    /// An upright cylinder with smooth sides.
    pub(super) fn cylinder(&mut self, radius_m: f32, [bottom, top]: [f32; 2], n_sides: usize, paint: Paint) {
        self.lathe(&[[radius_m, bottom], [radius_m, top]], n_sides, paint, |radial, axial| Surface::Cone {
            radial,
            axial,
        });
        self.disk(radius_m, top, n_sides, paint);
        let mut below: Vec<Vec3> = ring(radius_m, bottom, n_sides);
        below.reverse();
        self.polygon(&below, paint, Surface::Flat(None));
    }

    /// A disk that looks up.
    pub(super) fn disk(&mut self, radius_m: f32, z: f32, n_sides: usize, paint: Paint) {
        self.polygon(&ring(radius_m, z, n_sides), paint, Surface::Flat(None));
    }

    /// A ball about the origin.
    pub(super) fn ball(&mut self, radius_m: f32, n_sides: usize, paint: Paint) {
        let n_rings = n_sides / 2;
        let profile: Vec<[f32; 2]> = (0..=n_rings)
            .map(|ring| {
                let [cos, sin] = direction(ring, 2 * n_rings);
                [radius_m * sin, -radius_m * cos]
            })
            .collect();
        self.lathe(&profile, n_sides, paint, |_, _| Surface::Ball);
    }
}

fn ring(radius_m: f32, z: f32, n_sides: usize) -> Vec<Vec3> {
    let corner = |corner: usize| {
        let [x, y] = direction(corner, n_sides);
        Vec3::new(radius_m * x, radius_m * y, z)
    };
    (0..n_sides).map(corner).collect()
}

/// The unit vector to a corner of a polygon of `n_corners` corners; the first is towards x.
fn direction(corner: usize, n_corners: usize) -> [f32; 2] {
    let angle = std::f32::consts::TAU * (corner % n_corners) as f32 / n_corners as f32;
    [angle.cos(), angle.sin()]
}
