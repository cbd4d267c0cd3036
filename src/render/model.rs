//! The meshes of a scene: table, bodies, gripper.

mod arm;
mod body;
mod gripper;
mod table;

pub(super) use arm::ArmPart;

use crate::render::look::Look;
use crate::render::mesh::Mesh;
use crate::scene::Scene;

/// Everything that is drawn, each part in its own frame.
#[derive(Debug)]
pub(super) struct Model {
    pub(super) table: Mesh,
    /// In the scene's order.
    pub(super) bodies: Vec<Mesh>,
    /// Hand and arm, in the gripper's frame.
    pub(super) hand: Mesh,
    /// A finger whose inner side is at y = 0, on the side of y; the other is its mirror image by half a turn.
    pub(super) finger: Mesh,
    /// The hand below an arm, and the parts of that.
    pub(super) hand_of_arm: Mesh,
    pub(super) arm: Vec<ArmPart>,
}

impl Model {
    pub(super) fn new(scene: &Scene, look: &Look) -> Self {
        let color = |index: usize| look.body_colors.get(index).copied().unwrap_or(scene.bodies[index].color);
        let bodies = scene.bodies.iter().enumerate();
        Self {
            table: table::mesh(scene.table_half_m, look),
            bodies: bodies.map(|(index, body)| body::mesh(body, color(index), look.letters)).collect(),
            hand: gripper::hand(look.stem_m),
            finger: gripper::finger(),
            hand_of_arm: gripper::hand(0.0),
            arm: arm::parts(),
        }
    }
}
