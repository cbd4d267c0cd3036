//! The meshes of bodies. Their forms are those of simulation; forks, nuts, gears and pegs are drawn within theirs.

use crate::geometry::Vec3;
use crate::render::look::{Letters, linear, mixed};
use crate::render::mesh::{Mesh, Paint, Print, Surface};
use crate::render::texture::{self, Texture};
use crate::scene::{Body, Bowl, Prism, Shape};

/// Walls of bowls are thinner than the texels of a small picture's shadow map.
const BOWL_SLACK: f32 = 0.75;
/// Half of the height that a face needs to bear a letter.
const LEAST_PRINT_M: f32 = 0.01;
/// Sides of round bodies.
const N_SIDES: usize = 24;

pub(super) fn mesh(body: &Body, rgb: [u8; 3], letters: Letters) -> Mesh {
    let color = linear(rgb);
    let mut mesh = Mesh::default();
    let kind = body.name.split('_').next().unwrap_or_default();
    match body.shape {
        Shape::Cuboid { half_extents_m } if kind == "fork" => fork(&mut mesh, half_extents_m, color),
        Shape::Cuboid { half_extents_m } if kind == "nut" => nut(&mut mesh, half_extents_m, color),
        Shape::Cuboid { half_extents_m } => {
            let print = letter_of(&body.name).and_then(|letter| texture::letter(letter, letters));
            block(&mut mesh, half_extents_m.into(), color, print);
        }
        Shape::Cylinder { radius_m, half_height_m } if kind == "peg" => peg(&mut mesh, radius_m, half_height_m, color),
        Shape::Cylinder { radius_m, half_height_m } if kind == "gear" => {
            gear(&mut mesh, radius_m, half_height_m, color);
        }
        Shape::Cylinder { radius_m, half_height_m } => can(&mut mesh, radius_m, half_height_m, color),
        Shape::Ball { radius_m } => mesh.ball(radius_m, N_SIDES, Paint { color, gloss: 0.5 }),
        Shape::OpenBox { inner_m, wall_m } => open_box(&mut mesh, inner_m, wall_m, color),
        Shape::Bowl(form) => bowl(&mut mesh, &form, color),
    }
    mesh
}

/// `D` of `block_D` and of `place_D`.
fn letter_of(name: &str) -> Option<char> {
    let mut letters = name.strip_prefix("block_").or_else(|| name.strip_prefix("place_"))?.chars();
    letters.next().filter(|_| letters.next().is_none())
}

fn block(mesh: &mut Mesh, half: Vec3, color: [f32; 3], texture: Option<&'static Texture>) {
    let [red, green, blue] = color;
    let is_light = 0.2126 * red + 0.7152 * green + 0.0722 * blue > 0.28;
    let ink = if is_light { mixed(color, [0.01, 0.01, 0.02], 0.88) } else { [0.95, 0.94, 0.9] };
    mesh.cuboid(Vec3::zeros(), half, Paint { color, gloss: 0.0 }, |normal| {
        let up = if normal.z.abs() > 0.5 { Vec3::y() } else { Vec3::z() };
        let print = |texture: &'static Texture| {
            let right = up.cross(&normal);
            let over_face = |axis: Vec3| axis / (2.0 * axis.abs().dot(&half));
            Print { texture, ink, across: (over_face(right), 0.5), down: (-over_face(up), 0.5) }
        };
        Surface::Flat(texture.filter(|_| up.dot(&half) >= LEAST_PRINT_M).map(print))
    });
}

/// A tin with a lid of bare metal within its rim, and bands around it.
fn can(mesh: &mut Mesh, radius_m: f32, half_m: f32, color: [f32; 3]) {
    let metal = Paint { color: linear([196, 200, 206]), gloss: 0.6 };
    let side = Paint { color, gloss: 0.35 };
    let smooth = |radial: f32, axial: f32| Surface::Cone { radial, axial };
    let band_m = 0.12 * half_m;
    for (bottom, top, paint) in
        [(-half_m, band_m - half_m, metal), (band_m - half_m, half_m - band_m, side), (half_m - band_m, half_m, metal)]
    {
        mesh.lathe(&[[radius_m, bottom], [radius_m, top]], N_SIDES, paint, smooth);
    }
    let rim_m = 0.86 * radius_m;
    mesh.lathe(&[[radius_m, half_m], [rim_m, half_m]], N_SIDES, metal, |_, _| Surface::Flat(None));
    mesh.lathe(&[[rim_m, half_m], [rim_m, half_m - band_m]], N_SIDES, metal, smooth);
    mesh.disk(rim_m, half_m - band_m, N_SIDES, Paint { color: linear([168, 172, 178]), gloss: 0.0 });
    let below = [[0.0, -half_m], [radius_m, -half_m]];
    mesh.lathe(&below, N_SIDES, metal, |_, _| Surface::Flat(None));
}

/// Handle, neck and four tines.
fn fork(mesh: &mut Mesh, [half_x, half_y, half_z]: [f32; 3], color: [f32; 3]) {
    let paint = Paint { color, gloss: 0.0 };
    let mut part = |from_x: f32, to_x: f32, y: f32, width: f32, height: f32| {
        let (center, half) = ((from_x + to_x) / 2.0, (to_x - from_x) / 2.0);
        mesh.plain_cuboid([center * half_x, y * half_y, 0.0], [half * half_x, width * half_y, height * half_z], paint);
    };
    part(-1.0, -0.25, 0.0, 0.72, 1.0);
    part(-0.25, 0.12, 0.0, 0.34, 0.8);
    part(0.12, 0.42, 0.0, 1.0, 0.8);
    for y in [-0.84, -0.28, 0.28, 0.84] {
        part(0.42, 1.0, y, 0.16, 0.8);
    }
}

/// A peg with a bevelled top.
fn peg(mesh: &mut Mesh, radius_m: f32, half_m: f32, color: [f32; 3]) {
    let paint = Paint { color, gloss: 0.5 };
    let bevel_m = 0.25 * radius_m;
    let profile = [[radius_m, -half_m], [radius_m, half_m - bevel_m], [radius_m - bevel_m, half_m]];
    mesh.lathe(&profile, N_SIDES, paint, |radial, axial| Surface::Cone { radial, axial });
    mesh.disk(radius_m - bevel_m, half_m, N_SIDES, paint);
    mesh.lathe(&[[0.0, -half_m], [radius_m, -half_m]], N_SIDES, paint, |_, _| Surface::Flat(None));
}

/// Six sides about a hole, as wide as the box is along x.
fn nut(mesh: &mut Mesh, [radius_m, _, half_m]: [f32; 3], color: [f32; 3]) {
    let paint = Paint { color, gloss: 0.4 };
    let inside = Paint { color: mixed(color, [0.0; 3], 0.5), ..paint };
    let hole_m = 0.5 * radius_m;
    let flat = |_, _| Surface::Flat(None);
    let outside = [[hole_m, -half_m], [radius_m, -half_m], [radius_m, half_m], [hole_m, half_m]];
    mesh.lathe(&outside, 6, paint, flat);
    mesh.lathe(&[[hole_m, half_m], [hole_m, -half_m]], 6, inside, flat);
}

/// A wheel with teeth and a hub that lies deeper.
fn gear(mesh: &mut Mesh, radius_m: f32, half_m: f32, color: [f32; 3]) {
    const N_TEETH: usize = 12;
    let paint = Paint { color, gloss: 0.3 };
    let hub = Paint { color: mixed(color, [0.0; 3], 0.5), ..paint };
    let (wheel_m, hub_m, hub_z) = (0.84 * radius_m, 0.4 * radius_m, 0.5 * half_m);
    let smooth = |radial: f32, axial: f32| Surface::Cone { radial, axial };
    mesh.lathe(&[[0.0, -half_m], [wheel_m, -half_m]], N_SIDES, paint, |_, _| Surface::Flat(None));
    mesh.lathe(&[[wheel_m, -half_m], [wheel_m, half_m]], N_SIDES, paint, smooth);
    mesh.lathe(&[[wheel_m, half_m], [hub_m, half_m]], N_SIDES, paint, |_, _| Surface::Flat(None));
    mesh.lathe(&[[hub_m, half_m], [hub_m, hub_z]], N_SIDES, hub, smooth);
    mesh.disk(hub_m, hub_z, N_SIDES, hub);
    for tooth in 0..N_TEETH {
        let at = |radius_m: f32, turn: f32, z: f32| {
            let angle = std::f32::consts::TAU * (tooth as f32 + turn) / N_TEETH as f32;
            [radius_m * angle.cos(), radius_m * angle.sin(), z]
        };
        let ring = |z: f32| {
            [(0.95 * wheel_m, -0.28), (radius_m, -0.18), (radius_m, 0.18), (0.95 * wheel_m, 0.28)]
                .map(|(radius_m, turn)| at(radius_m, turn, z))
                .to_vec()
        };
        mesh.prism(&Prism { lower: ring(-half_m), upper: ring(half_m) }, paint, |_| Some(Surface::Flat(None)));
    }
}

/// Floor, walls and their rim.
fn open_box(mesh: &mut Mesh, [half_x, half_y, height]: [f32; 3], wall: f32, color: [f32; 3]) {
    let outside = Paint { color, gloss: 0.0 };
    let [outer_x, outer_y] = [half_x + wall, half_y + wall];
    let flat = Surface::Flat(None);
    let ring = |x: f32, y: f32, z: f32| [[x, y], [-x, y], [-x, -y], [x, -y]].map(|[x, y]| Vec3::new(x, y, z));
    let inside = Paint { color: mixed(color, [0.0; 3], 0.12), ..outside };
    let rim = Paint { color: mixed(color, [1.0; 3], 0.25), ..outside };
    let walls = [
        (ring(outer_x, outer_y, -wall), ring(outer_x, outer_y, height), outside),
        (ring(outer_x, outer_y, height), ring(half_x, half_y, height), rim),
        (ring(half_x, half_y, height), ring(half_x, half_y, 0.0), inside),
    ];
    for (lower, upper, paint) in walls {
        for corner in 0..4 {
            let next = (corner + 1) % 4;
            mesh.polygon(&[lower[corner], lower[next], upper[next], upper[corner]], paint, flat);
        }
    }
    mesh.polygon(&ring(half_x, half_y, 0.0), inside, flat);
    let mut below = ring(outer_x, outer_y, -wall);
    below.reverse();
    mesh.polygon(&below, outside, flat);
}

/// The bowl's prisms; walls and foot are shaded as if they were round.
fn bowl(mesh: &mut Mesh, form: &Bowl, color: [f32; 3]) {
    let paint = Paint { color, gloss: 0.45 };
    mesh.shadow_slack = BOWL_SLACK;
    let flare = (form.rim_radius_m - form.floor_radius_m) / form.height_m;
    let length = (1.0 + flare * flare).sqrt();
    let outside = Surface::Cone { radial: 1.0 / length, axial: -flare / length };
    let inside = Surface::Cone { radial: -1.0 / length, axial: flare / length };
    for (number, prism) in form.prisms().iter().enumerate() {
        mesh.prism(prism, paint, |side| match (number, side) {
            (0 | 1, 0 | 1) => Some(Surface::Flat(None)),
            (0 | 1, _) => Some(Surface::Cone { radial: 1.0, axial: 0.0 }),
            (_, 1) => Some(Surface::Flat(None)),
            // Of a wall's sides around: the outer one, and the inner one; the others touch the neighbouring walls.
            (_, 3) => Some(outside),
            (_, 5) => Some(inside),
            _ => None,
        });
    }
}
