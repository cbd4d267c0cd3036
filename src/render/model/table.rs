//! The table: a wooden board.

use crate::geometry::Vec3;
use crate::render::look::{Look, linear, mixed};
use crate::render::mesh::{Mesh, Paint, Print, Surface};
use crate::render::texture;

const THICKNESS_M: f32 = 0.035;
/// Length and width of the wood's texture.
const GRAIN_M: [f32; 2] = [1.3, 0.7];
/// How much darker the grain is.
const GRAIN: f32 = 0.3;

pub(super) fn mesh([half_x, half_y]: [f32; 2], look: &Look) -> Mesh {
    let color = linear(look.table_color);
    let print = Print {
        texture: texture::wood(),
        ink: mixed(color, [0.0; 3], GRAIN),
        across: (Vec3::x() / GRAIN_M[0], 0.3),
        down: (Vec3::y() / GRAIN_M[1], 0.1),
    };
    let center = Vec3::new(0.0, 0.0, -THICKNESS_M / 2.0);
    let mut mesh = Mesh::default();
    mesh.cuboid(center, Vec3::new(half_x, half_y, THICKNESS_M / 2.0), Paint { color, gloss: 0.0 }, |normal| {
        Surface::Flat((normal.z > 0.0).then_some(print))
    });
    mesh
}
