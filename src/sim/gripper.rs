//! The free-flying gripper: a palm and two fingers that follow a [`Tool`], and what they hold.
//!
//! The actions speak of a tool (a place, a turn, an opening) alone and only this file knows the colliders behind it:
//! an arm takes the gripper's place by offering the same methods.
//!
//! # Free flight
//!
//! While everything but the held body sleeps and the way is known to be clear, nothing can happen but the rigid
//! motion of the gripper and of what is fixed to it. That motion is computed directly and the engine is not stepped;
//! the engine's gripper catches up before the next step. The simulated time is the same either way.

use rapier3d::dynamics::{FixedJointBuilder, ImpulseJointHandle, RigidBody, RigidBodyBuilder, RigidBodyHandle};
use rapier3d::geometry::{Collider, ColliderBuilder, Group, SharedShape};
use rapier3d::math::{Pose as EnginePose, Vector};
use rapier3d::parry::query::distance;
use rapier3d::parry::shape::Cuboid;

use crate::arm::Load;
use crate::scene::{BodyIndex, Mobility, Scene};
use crate::sim::motion::Tool;
use crate::sim::sweep::AtStart;
use crate::sim::world::{GRIPPER_GROUP, SCENE_GROUP, World, groups};

/// The widest opening, in metres.
pub(super) const MAX_OPENING_M: f32 = 0.07;
/// From the gripper's reference point down to the finger tips, in metres.
pub(super) const TIP_M: f32 = 0.028;
/// From the gripper's reference point up to the palm's lower side, in metres.
pub(super) const PALM_M: f32 = 0.015;
/// Half of a finger's extents, in metres: narrow enough for neighbours 7 cm apart.
const FINGER_HALF_M: [f32; 3] = [0.009, 0.003, (TIP_M + PALM_M) / 2.0];
const PALM_HALF_M: [f32; 3] = [0.013, 0.044, 0.008];
const FINGER_FRICTION: f32 = 0.6;
/// From the gripper's axis to a fully open finger's outer side, in metres.
const OPEN_REACH_M: f32 = reach_m(MAX_OPENING_M);
/// Half of the palm's width along the fingers' flat side, in metres.
const PALM_HALF_X_M: f32 = PALM_HALF_M[0];
/// How far a held body may shift before it counts as lost, in metres.
const SLIP_M: f32 = 0.005;
/// The most that the fingers hold, in newtons. A block weighs 0.6.
const GRIP_N: f32 = 10.0;
/// For how long: what the fingers pressed into the table resists for a few steps.
const OVERLOAD_SECS: f32 = 0.03;

/// A body in the grasp.
#[derive(Clone, Copy)]
pub(super) struct Held {
    pub(super) body: BodyIndex,
    pub(super) handle: RigidBodyHandle,
    pub(super) in_gripper: EnginePose,
    joint: ImpulseJointHandle,
    /// How long it has pulled harder than the fingers hold.
    overloaded_secs: f32,
}

/// Whether the engine's gripper is where the tool is.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Engine {
    Current,
    Behind,
}

/// Palm, fingers, and what they hold.
pub(super) struct Gripper {
    pub(super) tool: Tool,
    pub(super) held: Option<Held>,
    /// How far the fingers open at most.
    pub(super) jaw_m: f32,
    /// How far the fingers will open next: their way is kept clear so far.
    pub(super) opens_to_m: f32,
    palm: RigidBodyHandle,
    fingers: [RigidBodyHandle; 2],
    engine: Engine,
    /// What an arm has above the palm, as shapes about the gripper's reference point.
    above: Vec<(SharedShape, EnginePose)>,
}

/// The body of an arm's gripper, which is along the fingers' closing, and the end of its wrist: from the reference point
/// up, half of its length, its radius.
const BODY_M: [f32; 3] = [0.0701, 0.022, 0.029];
const WRIST_M: [f32; 3] = [0.1221, 0.0, 0.045];
/// Height of all that is above the reference point, in metres.
const HAND_M: f32 = 0.1;

/// From the gripper's axis to a finger's outer side, in metres.
pub(super) const fn reach_m(opening_m: f32) -> f32 {
    opening_m / 2.0 + 2.0 * FINGER_HALF_M[1]
}

/// The two sides that the fingers are on.
const SIDES: [f32; 2] = [1.0, -1.0];

impl Gripper {
    pub(super) fn new(world: &mut World, tool: Tool, jaw_m: f32) -> Self {
        let mut insert = |half: [f32; 3], in_world: EnginePose| {
            let collider = ColliderBuilder::cuboid(half[0], half[1], half[2])
                .friction(FINGER_FRICTION)
                .collision_groups(groups(GRIPPER_GROUP, SCENE_GROUP));
            world.engine.insert(RigidBodyBuilder::kinematic_position_based().pose(in_world), collider).0
        };
        let palm = insert(PALM_HALF_M, palm_in_world(&tool));
        let fingers = SIDES.map(|side| insert(FINGER_HALF_M, finger_in_world(&tool, side)));
        Self { tool, held: None, jaw_m, opens_to_m: jaw_m, palm, fingers, engine: Engine::Current, above: Vec::new() }
    }

    /// The same below an arm: its body and the arm's wrist must pass too.
    pub(super) fn below_arm(mut self) -> Self {
        let [body_z, half_m, radius_m] = BODY_M;
        let body = SharedShape::capsule_y(half_m, radius_m);
        let [wrist_z, _, wrist_radius_m] = WRIST_M;
        let at = |z| EnginePose::translation(0.0, 0.0, z);
        self.above = vec![(body, at(body_z)), (SharedShape::ball(wrist_radius_m), at(wrist_z))];
        self
    }

    /// Half of what the gripper needs between walls: across the fingers' closing, and along it with them open.
    pub(super) fn half_widths_m(&self) -> [f32; 2] {
        if self.above.is_empty() {
            return [PALM_HALF_X_M, OPEN_REACH_M];
        }
        [WRIST_M[2].max(PALM_HALF_X_M), (BODY_M[1] + BODY_M[2]).max(OPEN_REACH_M)]
    }

    /// Gripper and what it holds as an upright cylinder.
    pub(super) fn load(&self, world: &World) -> Load {
        let place = self.tool.position;
        let parts = self.carried(world, &self.tool);
        let bounds = parts.iter().map(|(shape, pose)| shape.compute_aabb(pose));
        let [x, y] = self.half_widths_m();
        let hand_m = Vector::new(x, y, 0.0).length();
        let radius_m = bounds.fold(hand_m, |radius_m, bounds| {
            let far = (bounds.mins - place).abs().max((bounds.maxs - place).abs());
            radius_m.max(Vector::new(far.x, far.y, 0.0).length())
        });
        let below_m = place.z - self.lowest_z(world);
        Load { radius_m: f64::from(radius_m), below_m: f64::from(below_m), above_m: f64::from(HAND_M) }
    }

    /// Moves in free flight; see the module.
    pub(super) fn fly(&mut self, tool: Tool) {
        self.tool = tool;
        self.engine = Engine::Behind;
    }

    /// Asks the engine to move the gripper in its next step.
    pub(super) fn drive(&mut self, world: &mut World, tool: Tool) {
        self.catch_up(world);
        self.tool = tool;
        let [left, right] = SIDES.map(|side| finger_in_world(&tool, side));
        let targets = [(self.palm, palm_in_world(&tool)), (self.fingers[0], left), (self.fingers[1], right)];
        for (handle, in_world) in targets {
            world.engine.bodies[handle].set_next_kinematic_position(in_world);
        }
    }

    /// Brings the engine's gripper, and what it holds, to where they flew.
    pub(super) fn catch_up(&mut self, world: &mut World) {
        if self.engine == Engine::Current {
            return;
        }
        self.engine = Engine::Current;
        let bodies = &mut world.engine.bodies;
        bodies[self.palm].set_position(palm_in_world(&self.tool), false);
        for (handle, side) in self.fingers.into_iter().zip(SIDES) {
            bodies[handle].set_position(finger_in_world(&self.tool, side), false);
        }
        if let Some(held) = self.held {
            let body = &mut bodies[held.handle];
            body.set_position(self.tool.in_world() * held.in_gripper, true);
            stop(body);
        }
    }

    /// Where the held body is, if the engine does not know it.
    pub(super) fn flown(&self) -> Option<(BodyIndex, EnginePose)> {
        let held = self.held.filter(|_| self.engine == Engine::Behind)?;
        Some((held.body, self.tool.in_world() * held.in_gripper))
    }

    /// Height of the lowest point of gripper and load.
    pub(super) fn lowest_z(&self, world: &World) -> f32 {
        let tips_z = self.tool.position.z - TIP_M;
        let parts = self.carried(world, &self.tool);
        parts.iter().map(|(shape, pose)| shape.compute_aabb(pose).mins.z).fold(tips_z, f32::min)
    }

    /// The parts of what is held as they would be with the gripper at `tool`; none with nothing held.
    pub(super) fn carried(&self, world: &World, tool: &Tool) -> Vec<(SharedShape, EnginePose)> {
        let Some(held) = self.held else { return Vec::new() };
        let part = |collider: &Collider| {
            let in_body = collider.position_wrt_parent().copied().unwrap_or(EnginePose::IDENTITY);
            (collider.shared_shape().clone(), tool.in_world() * held.in_gripper * in_body)
        };
        world.colliders(held.body).map(part).collect()
    }

    /// Whether the palm touches something that moves.
    pub(super) fn is_palm_touching(&self, world: &World) -> bool {
        world.is_touching(self.palm)
    }

    /// The body that is best between the fingers, if both are nearer to it than they are open.
    pub(super) fn between_fingers(&self, scene: &Scene, world: &World) -> Option<BodyIndex> {
        let movable = scene.body_indices().filter(|&body| scene.body(body).mobility == Mobility::Movable);
        let farther_m = |body: BodyIndex| {
            let [left_m, right_m] = self.finger_gaps_m(world, body);
            left_m.max(right_m)
        };
        let gaps = movable.map(|body| (body, farther_m(body))).filter(|(_, gap_m)| *gap_m < self.tool.opening_m);
        gaps.min_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(body, _)| body)
    }

    pub(super) fn held_handle(&self) -> Option<RigidBodyHandle> {
        self.held.map(|held| held.handle)
    }

    /// How far, level, a body that is held at its rim hangs beside the gripper when that is turned to 0; nothing for
    /// what is held at its middle.
    pub(super) fn hangs_beside(&self, scene: &Scene) -> Vector {
        let at_rim = self.held.filter(|held| scene.body(held.body).shape.rim_m().is_some());
        at_rim
            .map_or(Vector::ZERO, |held| Vector::new(held.in_gripper.translation.x, held.in_gripper.translation.y, 0.0))
    }

    /// Fixes a body to the palm as they are now. Contacts between the two end: the joint does the fingers' work.
    pub(super) fn hold(&mut self, world: &mut World, body: BodyIndex) {
        self.catch_up(world);
        let handle = world.handle(body);
        let in_palm = palm_in_world(&self.tool).inv_mul(&world.in_world(body));
        let joint = FixedJointBuilder::new().local_frame1(in_palm).contacts_enabled(false);
        let joint = world.engine.insert_impulse_joint(self.palm, handle, joint);
        world.set_groups(body, groups(SCENE_GROUP, SCENE_GROUP));
        // What the fingers' push left it with must not be set free when it is let go.
        stop(&mut world.engine.bodies[handle]);
        let in_gripper = self.tool.in_world().inv_mul(&world.in_world(body));
        self.held = Some(Held { body, handle, in_gripper, joint, overloaded_secs: 0.0 });
    }

    /// Lets go. The body does not touch the gripper until [`Gripper::part_from`].
    pub(super) fn let_go(&mut self, world: &mut World) -> Option<BodyIndex> {
        self.catch_up(world);
        let held = self.held.take()?;
        world.engine.remove_impulse_joint(held.joint);
        world.engine.wake_up(held.handle, true);
        Some(held.body)
    }

    /// Lets a body that was let go collide with the gripper again.
    pub(super) fn part_from(world: &mut World, body: BodyIndex) {
        world.set_groups(body, groups(SCENE_GROUP, Group::ALL));
    }

    /// After a step of the engine: whether what is held was torn out of the grasp, because it has shifted or because
    /// it has pulled harder than the fingers hold.
    pub(super) fn has_slipped(&mut self, world: &World) -> bool {
        let tool_in_world = self.tool.in_world();
        let Some(held) = &mut self.held else {
            return false;
        };
        let now = tool_in_world.inv_mul(&world.in_world(held.body));
        let is_overloaded = world.joint_force_n(held.joint) > GRIP_N;
        held.overloaded_secs = if is_overloaded { held.overloaded_secs + world.step_secs() } else { 0.0 };
        let shift_m = (now.translation - held.in_gripper.translation).length();
        shift_m > SLIP_M || held.overloaded_secs > OVERLOAD_SECS
    }

    /// Distance from each finger to a body, in metres; 0 when they touch.
    pub(super) fn finger_gaps_m(&self, world: &World, body: BodyIndex) -> [f32; 2] {
        let [x, y, z] = FINGER_HALF_M;
        let finger = Cuboid::new(Vector::new(x, y, z));
        SIDES.map(|side| {
            let pose = finger_in_world(&self.tool, side);
            let gap_m = |part: &Collider| {
                let found = distance(&pose, &finger, part.position(), part.shape());
                found.map_or(f32::MAX, |found| found.distance)
            };
            world.colliders(body).map(gap_m).fold(f32::MAX, f32::min)
        })
    }

    /// How far each finger can close before one of them meets something, in metres.
    pub(super) fn free_closing_m(&self, world: &World) -> f32 {
        let [x, y, z] = FINGER_HALF_M;
        let finger = Cuboid::new(Vector::new(x, y, z));
        let free_m = |side: f32| {
            let way = self.tool.in_world().transform_vector(Vector::new(0.0, -side * self.tool.opening_m / 2.0, 0.0));
            world.cast(&finger, &finger_in_world(&self.tool, side), way, AtStart::Stops, None)
        };
        SIDES.into_iter().filter_map(free_m).fold(self.tool.opening_m / 2.0, f32::min)
    }

    /// How far the gripper, with what it holds, can move along `path` before it meets something; its whole length
    /// when it meets nothing.
    pub(super) fn free_way_m(&self, world: &World, tool: &Tool, path: Vector, at_start: AtStart) -> f32 {
        let held = self.held_handle();
        let above = self.above.iter().map(|(shape, pose)| (shape.clone(), tool.in_world() * *pose));
        let parts = hull(tool, self.opens_to_m).into_iter().chain(above).chain(self.carried(world, tool));
        parts.filter_map(|(shape, from)| world.cast(&*shape, &from, path, at_start, held)).fold(path.length(), f32::min)
    }
}

fn stop(body: &mut RigidBody) {
    body.set_linvel(Vector::ZERO, true);
    body.set_angvel(Vector::ZERO, true);
}

fn palm_in_world(tool: &Tool) -> EnginePose {
    tool.in_world() * EnginePose::translation(0.0, 0.0, PALM_M + PALM_HALF_M[2])
}

fn finger_in_world(tool: &Tool, side: f32) -> EnginePose {
    let y = side * (tool.opening_m / 2.0 + FINGER_HALF_M[1]);
    tool.in_world() * EnginePose::translation(0.0, y, (PALM_M - TIP_M) / 2.0)
}

/// The gripper's parts as they are swept by opening the fingers so far: what is clear of these stays clear of the
/// fingers when they open.
pub(super) fn hull(tool: &Tool, opens_to_m: f32) -> [(SharedShape, EnginePose); 3] {
    let [x, thickness, z] = FINGER_HALF_M;
    let inner = tool.opening_m.min(opens_to_m) / 2.0;
    let outer = (opens_to_m.max(tool.opening_m)) / 2.0 + 2.0 * thickness;
    let finger = |side: f32| {
        let pose = EnginePose::translation(0.0, side * (inner + outer) / 2.0, (PALM_M - TIP_M) / 2.0);
        (SharedShape::cuboid(x, (outer - inner) / 2.0, z), tool.in_world() * pose)
    };
    let [palm_x, palm_y, palm_z] = PALM_HALF_M;
    [(SharedShape::cuboid(palm_x, palm_y, palm_z), palm_in_world(tool)), finger(1.0), finger(-1.0)]
}
