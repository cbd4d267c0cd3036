//! The arm above the gripper: its collision capsules, painted as the maker paints them.

use crate::arm::{BASE_IN_WORLD_M, Capsule, capsules};
use crate::geometry::Pose;
use crate::render::look::linear;
use crate::render::mesh::{Mesh, Paint, Surface};

/// A part of a link.
#[derive(Debug)]
pub(in crate::render) struct ArmPart {
    /// 0 for the base.
    pub(in crate::render) link: usize,
    pub(in crate::render) in_link: Pose,
    pub(in crate::render) mesh: Mesh,
}

const N_SIDES: usize = 24;
/// Rings of a rounded end.
const N_RINGS: usize = 6;
/// Radius of the pedestal that the base stands on.
const PEDESTAL_M: f32 = 0.11;
/// Shoulder, upper arm and forearm.
const RED_LINKS: [usize; 3] = [1, 3, 5];
/// From here up the first link is the head.
const HEAD_M: f64 = 0.3;

/// All parts.
pub(super) fn parts() -> Vec<ArmPart> {
    let pedestal = ArmPart { link: 0, in_link: Pose::identity(), mesh: pedestal() };
    capsules().map(|capsule| part(&capsule)).chain([pedestal]).collect()
}

fn part(capsule: &Capsule) -> ArmPart {
    let (length_m, in_link) = capsule.standing();
    ArmPart { link: capsule.link, in_link, mesh: rounded(capsule.radius_m as f32, length_m, paint(capsule)) }
}

/// The long links are red; joints, head and gripper are dark.
fn paint(capsule: &Capsule) -> Paint {
    let is_red = RED_LINKS.contains(&capsule.link) && capsule.from_m[2] < HEAD_M;
    let color = if is_red { linear([158, 32, 36]) } else { linear([58, 60, 66]) };
    Paint { color, gloss: 0.35 }
}

/// A cylinder of a length with rounded ends below and above.
fn rounded(radius_m: f32, length_m: f32, paint: Paint) -> Mesh {
    let mut mesh = Mesh::default();
    let quarter = |ring: usize| {
        let angle = std::f32::consts::FRAC_PI_2 * ring as f32 / N_RINGS as f32;
        [radius_m * angle.cos(), radius_m * angle.sin()]
    };
    let below = (0..=N_RINGS).rev().map(|ring| {
        let [out, down] = quarter(ring);
        [out, -down]
    });
    let above = (0..=N_RINGS).map(|ring| {
        let [out, up] = quarter(ring);
        [out, length_m + up]
    });
    let profile: Vec<[f32; 2]> = below.chain(above).collect();
    mesh.lathe(&profile, N_SIDES, paint, |radial, axial| Surface::Cone { radial, axial });
    mesh
}

/// From the table up to the base.
fn pedestal() -> Mesh {
    let mut mesh = Mesh::default();
    let paint = Paint { color: linear([70, 72, 78]), gloss: 0.1 };
    mesh.cylinder(PEDESTAL_M, [-BASE_IN_WORLD_M[2] as f32, 0.0], N_SIDES, paint);
    mesh
}
