//! Small scenes by hand.

use ntp::geometry::{Pose, Vec3, upright};
use ntp::robot::Action;
use ntp::scene::{Body, BodyIndex, Mobility, Scene, SceneState, Shape, Slot, SlotIndex};
use ntp::sim::{Simulation, SimulationConfig};

/// A stacking block.
pub(crate) const BLOCK: Shape = Shape::Cuboid { half_extents_m: [0.025; 3] };

/// A table of 80 cm with bodies, each with a slot of its own.
pub(crate) struct Table {
    bodies: Vec<Body>,
    poses: Vec<Pose>,
    gripper: [f32; 3],
}

impl Default for Table {
    fn default() -> Self {
        Self { bodies: Vec::new(), poses: Vec::new(), gripper: [0.0, 0.3, 0.5] }
    }
}

impl Table {
    /// Adds a body that stands on the table.
    pub(crate) fn add(&mut self, name: &str, shape: Shape, [x, y]: [f32; 2]) {
        let z = match shape {
            Shape::OpenBox { wall_m, .. } => wall_m,
            _ => shape.half_extents_m().z,
        };
        self.add_at(name, shape, [x, y, z]);
    }

    pub(crate) fn add_at(&mut self, name: &str, shape: Shape, [x, y, z]: [f32; 3]) {
        let mobility = match shape {
            Shape::OpenBox { .. } => Mobility::Fixed,
            _ => Mobility::Movable,
        };
        self.bodies.push(Body { name: name.to_owned(), shape, mobility, color: [128; 3] });
        self.poses.push(upright(Vec3::new(x, y, z), 0.0));
    }

    pub(crate) fn with(mut self, name: &str, shape: Shape, at: [f32; 2]) -> Self {
        self.add(name, shape, at);
        self
    }

    pub(crate) fn at(mut self, name: &str, shape: Shape, at: [f32; 3]) -> Self {
        self.add_at(name, shape, at);
        self
    }

    /// Turns the last body.
    pub(crate) fn turned(mut self, yaw_rad: f32) -> Self {
        if let Some(last) = self.poses.last_mut() {
            *last = upright(last.translation.vector, yaw_rad);
        }
        self
    }

    pub(crate) fn gripper(mut self, at: [f32; 3]) -> Self {
        self.gripper = at;
        self
    }

    pub(crate) fn parts(self) -> (Scene, SceneState) {
        let slot =
            |(index, body): (usize, &Body)| Slot { name: body.name.clone(), bodies: vec![BodyIndex(index as u16)] };
        let slots = self.bodies.iter().enumerate().map(slot).collect();
        let initial = SceneState {
            gripper_in_world: upright(self.gripper.into(), 0.0),
            opening_m: 0.07,
            held: None,
            bodies_in_world: self.poses,
            joints_rad: None,
        };
        (Scene { bodies: self.bodies, slots, table_half_m: [0.4, 0.4] }, initial)
    }

    pub(crate) fn world(self) -> Simulation {
        let (scene, initial) = self.parts();
        Simulation::new(scene, &initial, &SimulationConfig::default()).unwrap()
    }
}

/// The four actions that bring one slot's body onto another's.
pub(crate) fn pick_and_place(source: u16, target: u16) -> [Action; 4] {
    [Action::MoveTo(SlotIndex(source)), Action::Grip, Action::MoveTo(SlotIndex(target)), Action::Release]
}
