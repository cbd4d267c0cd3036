//! What stands on the table and where: the one value that simulation, recordings and viewers share.
//!
//! A [`Scene`] is what does not change in an episode (bodies and slots), a [`SceneState`] what does (poses). Neither
//! knows of the physics engine.
//!
//! # Slots
//!
//! A program's argument and an observation speak of *slots*, not of bodies. A slot of a block, bowl or container
//! shows that one body. A slot of a category shows one of its instances: the one locked now, see [`Slot::bodies`].

mod bowl;

pub use bowl::{Bowl, Prism};

use crate::arm::N_JOINTS;
use crate::geometry::{Pose, Vec3, horizontal_distance};

/// Index of a body in [`Scene::bodies`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct BodyIndex(pub u16);

/// Index of a slot in [`Scene::slots`]: what `move_to` takes as its argument.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct SlotIndex(pub u16);

/// The form of a body, about its own centre, z up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A box.
    Cuboid {
        /// Half of each edge, in metres.
        half_extents_m: [f32; 3],
    },
    /// An upright cylinder.
    Cylinder {
        /// Radius in metres.
        radius_m: f32,
        /// Half of the height in metres.
        half_height_m: f32,
    },
    /// A ball.
    Ball {
        /// Radius in metres.
        radius_m: f32,
    },
    /// A box without lid. The body's centre is the middle of the *floor's upper side*.
    OpenBox {
        /// Half of the inner width and depth, and the inner height, in metres.
        inner_m: [f32; 3],
        /// Thickness of walls and floor, in metres.
        wall_m: f32,
    },
    /// A bowl on a foot. The body's centre is the middle of the *floor's upper side*.
    Bowl(Bowl),
}

impl Shape {
    /// Half of the axis-aligned box around the body when upright; for open boxes and bowls of their inner space.
    pub fn half_extents_m(&self) -> Vec3 {
        match *self {
            Self::Cuboid { half_extents_m: [x, y, z] } => Vec3::new(x, y, z),
            Self::Cylinder { radius_m, half_height_m } => Vec3::new(radius_m, radius_m, half_height_m),
            Self::Ball { radius_m } => Vec3::repeat(radius_m),
            Self::OpenBox { inner_m: [x, y, height], .. } => Vec3::new(x, y, height / 2.0),
            Self::Bowl(Bowl { rim_radius_m, height_m, .. }) => Vec3::new(rim_radius_m, rim_radius_m, height_m / 2.0),
        }
    }

    /// Height of the rim above the floor of what other bodies are put into; nothing for other shapes.
    pub fn rim_m(&self) -> Option<f32> {
        match *self {
            Self::OpenBox { inner_m: [_, _, height_m], .. } | Self::Bowl(Bowl { height_m, .. }) => Some(height_m),
            Self::Cuboid { .. } | Self::Cylinder { .. } | Self::Ball { .. } => None,
        }
    }

    /// From the body's centre down to where it stands, when upright, in metres.
    pub fn foot_m(&self) -> f32 {
        match *self {
            Self::OpenBox { wall_m, .. } => wall_m,
            Self::Bowl(bowl) => bowl.pitch_m(),
            Self::Cuboid { .. } | Self::Cylinder { .. } | Self::Ball { .. } => self.half_extents_m().z,
        }
    }

    /// From the body's centre up to where another body stands on it, or in it, in metres.
    pub fn seat_m(&self) -> f32 {
        if self.rim_m().is_some() { 0.0 } else { self.half_extents_m().z }
    }

    /// Whether a point, given about the body's centre, lies between walls and below twice the rim.
    fn encloses(&self, point: &Vec3) -> bool {
        let between_walls = match *self {
            Self::OpenBox { inner_m: [half_x, half_y, _], .. } => point.x.abs() <= half_x && point.y.abs() <= half_y,
            Self::Bowl(Bowl { rim_radius_m, .. }) => horizontal_distance(point, &Vec3::zeros()) <= rim_radius_m,
            Self::Cuboid { .. } | Self::Cylinder { .. } | Self::Ball { .. } => false,
        };
        between_walls && self.rim_m().is_some_and(|rim_m| (-0.01..2.0 * rim_m).contains(&point.z))
    }
}

/// Whether a body moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mobility {
    /// Pushed, grasped and dropped.
    Movable,
    /// Stays where it is as long as programs run.
    Fixed,
}

/// One body of the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Unique in the scene, e.g. `block_D` or `can_3`.
    pub name: String,
    /// Its form.
    pub shape: Shape,
    /// Whether it moves.
    pub mobility: Mobility,
    /// Red, green, blue as in an sRGB picture.
    pub color: [u8; 3],
}

/// What an argument can name: one body, or whichever instance of a category is locked now.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Slot {
    /// Unique in the scene, e.g. `block_D` or `can`.
    pub name: String,
    /// The bodies the slot may show. With several, the slot shows the one that is *locked*: the nearest to the gripper
    /// that lies in no container; it stays locked while it is carried and is chosen anew when it lies in one.
    /// With none left to choose, the last one stays.
    pub bodies: Vec<BodyIndex>,
}

impl Slot {
    /// A slot that always shows one body, given by its number.
    pub fn single(name: String, body: usize) -> Self {
        Self { name, bodies: vec![BodyIndex(body as u16)] }
    }
}

/// The unchanging part of an episode's world.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// All bodies but table and gripper.
    pub bodies: Vec<Body>,
    /// What arguments and observations speak of.
    pub slots: Vec<Slot>,
    /// Half of the table's width (x) and depth (y), in metres. Its surface is at z = 0.
    pub table_half_m: [f32; 2],
}

impl Scene {
    /// The body behind an index.
    pub fn body(&self, index: BodyIndex) -> &Body {
        &self.bodies[usize::from(index.0)]
    }

    /// The slot behind an index.
    pub fn slot(&self, index: SlotIndex) -> &Slot {
        &self.slots[usize::from(index.0)]
    }

    /// All body indices in order.
    pub fn body_indices(&self) -> impl Iterator<Item = BodyIndex> + use<> {
        (0..self.bodies.len() as u16).map(BodyIndex)
    }
}

/// The changing part: where everything is at one instant.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneState {
    /// The gripper's reference point: 2 cm above the centre of what it holds, between the fingers.
    pub gripper_in_world: Pose,
    /// Distance between the fingers, in metres.
    pub opening_m: f32,
    /// The body in the gripper, if any.
    pub held: Option<BodyIndex>,
    /// One pose a body, in the order of [`Scene::bodies`].
    pub bodies_in_world: Vec<Pose>,
    /// The angles of the arm's joints in radians, from its base on; `None` of a gripper without an arm.
    pub joints_rad: Option<[f32; N_JOINTS]>,
}

impl SceneState {
    /// Where a body is.
    pub fn body_in_world(&self, index: BodyIndex) -> &Pose {
        &self.bodies_in_world[usize::from(index.0)]
    }
}

/// Whether a body's centre lies inside an open box or bowl: between its walls and below twice its rim.
pub fn lies_inside(scene: &Scene, state: &SceneState, body: BodyIndex, container: BodyIndex) -> bool {
    let body_in_container = state.body_in_world(container).inv_mul(state.body_in_world(body)).translation.vector;
    scene.body(container).shape.encloses(&body_in_container)
}

/// Whether a body lies inside any open box or bowl of the scene.
pub fn lies_in_any_container(scene: &Scene, state: &SceneState, body: BodyIndex) -> bool {
    scene.body_indices().any(|container| container != body && lies_inside(scene, state, body, container))
}

/// The bodies that the slots show now, given those they showed before (none at the start). See [`Slot::bodies`].
pub fn locked_bodies(scene: &Scene, state: &SceneState, before: Option<&[BodyIndex]>) -> Vec<BodyIndex> {
    let gripper = state.gripper_in_world.translation.vector;
    let distance = |body: BodyIndex| (state.body_in_world(body).translation.vector - gripper).norm();
    let lock = |slot_idx: usize, slot: &Slot| {
        let last = before.map(|bodies| bodies[slot_idx]);
        if slot.bodies.len() == 1 {
            return slot.bodies[0];
        }
        let keeps = |body: BodyIndex| state.held == Some(body) || !lies_in_any_container(scene, state, body);
        if let Some(last) = last.filter(|&body| keeps(body)) {
            return last;
        }
        let free = slot.bodies.iter().copied().filter(|&body| !lies_in_any_container(scene, state, body));
        free.min_by(|&a, &b| distance(a).total_cmp(&distance(b))).or(last).unwrap_or(slot.bodies[0])
    };
    scene.slots.iter().enumerate().map(|(slot_idx, slot)| lock(slot_idx, slot)).collect()
}
