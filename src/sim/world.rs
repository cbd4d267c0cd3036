//! The engine's world: table, ground and the scene's bodies, without a robot.
//!
//! # Invariants
//!
//! Whatever the engine knows of a body is reached through [`BodyIndex`]. Whole-scene scans happen once an action or a
//! recorded frame, never once a step.
//!
//! # Source
//!
//! The constants are measured, not derived, at 240 steps per second. With the engine's defaults an 8-high tower of 5 cm
//! cubes is 16 mm too short; with [`CONTACT_HZ`] 0.7 mm, and stiffer contacts drift sideways. With a fifth of
//! [`REST_M_PER_S`] and of the balls' damping, two of five sortings of 40 objects never came to rest.

use rapier3d::dynamics::{ImpulseJointHandle, RigidBody, RigidBodyBuilder, RigidBodyHandle, SpringCoefficients};
use rapier3d::geometry::{
    Collider, ColliderBuilder, ColliderHandle, Group, InteractionGroups, InteractionTestMode, Ray,
};
use rapier3d::math::{Pose as EnginePose, Vector};
use rapier3d::parry::bounding_volume::{Aabb, BoundingVolume as _};
use rapier3d::parry::shape::Shape as EngineShape;
use rapier3d::pipeline::{PhysicsWorld, QueryFilter, QueryPipeline};

use crate::geometry::Pose;
use crate::scene::{BodyIndex, Mobility, Scene, SceneState, Shape};
use crate::sim::SimulationConfig;
use crate::sim::engine_shape::{Part, from_engine, parts, to_engine};
use crate::sim::sweep::{self, AtStart};

/// Natural frequency of contacts, in Hz.
const CONTACT_HZ: f32 = 150.0;
const CONTACT_DAMPING: f32 = 10.0;
/// How near two surfaces must be for the engine to look for contacts, in metres.
const PREDICTION_M: f32 = 0.002;
/// How far a pair may move before its contacts are computed anew, in metres. Contacts that lag behind drive what
/// rolls: at 1 mm a lying can never stops.
const RECYCLE_M: f32 = 0.000_2;
/// The standoff that the engine keeps, in metres.
const SLOP_M: f32 = 0.000_2;
/// A body that moves slower than twice this for [`REST_SECS`] is put to sleep, in metres per second.
const REST_M_PER_S: f32 = 0.02;
const REST_SECS: f32 = 0.05;
/// What has not come to rest for long and is slower than this only jitters, in metres per second.
const JITTER_M_PER_S: f32 = 0.1;
const DENSITY_KG_PER_M3: f32 = 500.0;
const FRICTION: f32 = 0.7;
/// Loss of spin, in 1/s. Of balls it stands in for the rolling resistance that the engine does not have.
const ANGULAR_DAMPING: f32 = 4.0;
const BALL_ANGULAR_DAMPING: f32 = 40.0;
const TABLE_HALF_THICKNESS_M: f32 = 0.02;
/// Floor and walls of an open box.
const N_OPEN_BOX_PARTS: usize = 5;
/// Where what falls off the table comes to rest.
const GROUND_Z_M: f32 = -0.4;
const GROUND_HALF_M: f32 = 5.0;

/// The collision group of everything but the gripper.
pub(super) const SCENE_GROUP: Group = Group::GROUP_1;
/// The collision group of the gripper.
pub(super) const GRIPPER_GROUP: Group = Group::GROUP_2;

/// Groups of a collider: what it is, and what it touches.
pub(super) fn groups(of: Group, with: Group) -> InteractionGroups {
    InteractionGroups::new(of, with, InteractionTestMode::And)
}

/// What a query found.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hit {
    /// The body, or `None` for table and ground.
    pub(super) body: Option<BodyIndex>,
    /// How far away, in metres.
    pub(super) distance_m: f32,
}

/// Table, ground and bodies in the engine.
pub(super) struct World {
    pub(super) engine: PhysicsWorld,
    bodies: Vec<RigidBodyHandle>,
}

impl World {
    /// Builds the world; the scene must have been checked.
    pub(super) fn new(scene: &Scene, initial: &SceneState, config: &SimulationConfig) -> Self {
        let mut engine = PhysicsWorld::new();
        engine.gravity = Vector::new(0.0, 0.0, -9.81);
        tune(&mut engine, config);
        add_ground(&mut engine, scene);
        let bodies = scene
            .body_indices()
            .map(|index| add_body(&mut engine, scene, index, initial.body_in_world(index)))
            .collect();
        Self { engine, bodies }
    }

    /// One step of the engine.
    pub(super) fn step(&mut self) {
        self.engine.step();
    }

    pub(super) fn handle(&self, index: BodyIndex) -> RigidBodyHandle {
        self.bodies[usize::from(index.0)]
    }

    pub(super) fn body(&self, index: BodyIndex) -> &RigidBody {
        &self.engine.bodies[self.handle(index)]
    }

    /// The colliders of a body, one a convex part.
    pub(super) fn colliders(&self, index: BodyIndex) -> impl Iterator<Item = &Collider> {
        self.body(index).colliders().iter().map(|&handle| &self.engine.colliders[handle])
    }

    /// Sets what a body's colliders are and what they touch.
    pub(super) fn set_groups(&mut self, index: BodyIndex, groups: InteractionGroups) {
        for handle in self.body(index).colliders().to_vec() {
            self.engine.colliders[handle].set_collision_groups(groups);
        }
    }

    /// Wakes everything that can move.
    pub(super) fn wake_all(&mut self) {
        for &handle in &self.bodies {
            if self.engine.bodies[handle].is_dynamic() {
                self.engine.wake_up(handle, true);
            }
        }
    }

    /// Where a body is.
    pub(super) fn in_world(&self, index: BodyIndex) -> EnginePose {
        *self.body(index).position()
    }

    /// Where all bodies are.
    pub(super) fn bodies_in_world(&self) -> Vec<Pose> {
        self.bodies.iter().map(|&handle| from_engine(self.engine.bodies[handle].position())).collect()
    }

    /// Whether all bodies but `held` sleep.
    pub(super) fn is_quiet(&self, held: Option<RigidBodyHandle>) -> bool {
        let awake = |&handle: &RigidBodyHandle| Some(handle) != held && self.engine.bodies[handle].is_dynamic();
        !self.engine.islands.active_bodies().any(|handle| awake(&handle))
    }

    /// Puts everything but `held` to sleep if it only jitters: a pile may do so in the engine for ever.
    pub(super) fn calm(&mut self, held: Option<RigidBodyHandle>) {
        let PhysicsWorld { islands, bodies, .. } = &mut self.engine;
        let is_free = |&handle: &RigidBodyHandle| Some(handle) != held && bodies[handle].is_dynamic();
        let awake: Vec<RigidBodyHandle> = islands.active_bodies().filter(is_free).collect();
        if awake.iter().all(|&handle| bodies[handle].linvel().length() < JITTER_M_PER_S) {
            awake.into_iter().for_each(|handle| bodies[handle].sleep());
        }
    }

    /// Pushes a body at its centre of mass, in newton seconds.
    pub(super) fn push(&mut self, index: BodyIndex, impulse_ns: Vector) {
        let handle = self.handle(index);
        self.engine.bodies[handle].apply_impulse(impulse_ns, true);
    }

    /// Length of a step.
    pub(super) fn step_secs(&self) -> f32 {
        self.engine.integration_parameters.dt
    }

    /// The force that a joint took in the last step, in newtons.
    pub(super) fn joint_force_n(&self, joint: ImpulseJointHandle) -> f32 {
        let parameters = &self.engine.integration_parameters;
        let substep_secs = parameters.dt / parameters.num_solver_iterations as f32;
        let impulses = self.engine.impulse_joints.get(joint).map_or([0.0; 6], |joint| joint.impulses);
        Vector::new(impulses[0], impulses[1], impulses[2]).length() / substep_secs
    }

    /// Height of the highest point of all bodies but `except`, at least the table's.
    pub(super) fn top_z(&self, except: Option<RigidBodyHandle>) -> f32 {
        let others = self.bodies.iter().filter(|&&handle| Some(handle) != except);
        let colliders = others.flat_map(|&handle| self.engine.bodies[handle].colliders());
        colliders.map(|&collider| self.engine.colliders[collider].compute_aabb().maxs.z).fold(0.0, f32::max)
    }

    /// Boxes around everything but `except`: one a body, of a box without lid one a wall.
    pub(super) fn boxes(&self, except: Option<RigidBodyHandle>) -> impl Iterator<Item = Aabb> {
        let others = self.bodies.iter().filter(move |&&handle| Some(handle) != except);
        others.flat_map(|&handle| {
            let colliders = self.engine.bodies[handle].colliders().iter();
            let boxes = colliders.map(|&collider| &self.engine.colliders[collider]).map(Collider::compute_aabb);
            let boxes: Vec<Aabb> = boxes.collect();
            // What is round is many small parts.
            match boxes.len() {
                0..=N_OPEN_BOX_PARTS => boxes,
                _ => boxes.into_iter().reduce(|a, b| a.merged(&b)).into_iter().collect(),
            }
        })
    }

    /// Boxes around a body if it were somewhere: one, of a box without lid one a wall.
    pub(super) fn boxes_at(&self, index: BodyIndex, in_world: &EnginePose) -> Vec<Aabb> {
        let bounds = |collider: &Collider| {
            let in_body = collider.position_wrt_parent().copied().unwrap_or(EnginePose::IDENTITY);
            collider.shape().compute_aabb(&(*in_world * in_body))
        };
        let boxes: Vec<Aabb> = self.colliders(index).map(bounds).collect();
        match boxes.len() {
            0..=N_OPEN_BOX_PARTS => boxes,
            _ => boxes.into_iter().reduce(|a, b| a.merged(&b)).into_iter().collect(),
        }
    }

    /// Whether a part of the robot touches something that moves.
    pub(super) fn is_touching(&self, part: RigidBodyHandle) -> bool {
        let colliders = self.engine.bodies[part].colliders().iter();
        let mut pairs = colliders.flat_map(|&collider| self.engine.narrow_phase.contact_pairs_with(collider));
        pairs.any(|pair| pair.find_deepest_contact().is_some_and(|(_, contact)| contact.dist < 0.0))
    }

    /// The first thing straight below a point.
    pub(super) fn below(&self, point: Vector, except: Option<RigidBodyHandle>) -> Option<Hit> {
        let ray = Ray::new(point, Vector::new(0.0, 0.0, -1.0));
        let (collider, distance_m) = self.queries(except).cast_ray(&ray, 10.0, true)?;
        Some(Hit { body: self.owner(collider), distance_m })
    }

    /// How far a shape can move along `path` before it meets something; `None` when it meets nothing.
    pub(super) fn cast(
        &self,
        shape: &dyn EngineShape,
        from: &EnginePose,
        path: Vector,
        at_start: AtStart,
        except: Option<RigidBodyHandle>,
    ) -> Option<f32> {
        let start = shape.compute_aabb(from);
        let swept = start.merged(&start.translated(path));
        let queries = self.queries(except);
        let near = queries.intersect_aabb_conservative(swept).map(|(_, collider)| collider);
        near.filter(|collider| collider.compute_aabb().intersects(&swept))
            .filter_map(|collider| sweep::free_way_m(shape, from, path, collider, at_start))
            .min_by(f32::total_cmp)
    }

    fn queries(&self, except: Option<RigidBodyHandle>) -> QueryPipeline<'_> {
        let filter = QueryFilter {
            groups: Some(groups(SCENE_GROUP, SCENE_GROUP)),
            exclude_rigid_body: except,
            ..QueryFilter::default()
        };
        let Self { engine, .. } = self;
        let dispatcher = engine.narrow_phase.query_dispatcher();
        engine.broad_phase.as_query_pipeline(dispatcher, &engine.bodies, &engine.colliders, filter)
    }

    fn owner(&self, collider: ColliderHandle) -> Option<BodyIndex> {
        let number = self.engine.colliders.get(collider)?.user_data;
        number.checked_sub(1).map(|index| BodyIndex(index as u16))
    }
}

fn tune(engine: &mut PhysicsWorld, config: &SimulationConfig) {
    let contact = SpringCoefficients::new(CONTACT_HZ, CONTACT_DAMPING);
    let parameters = &mut engine.integration_parameters;
    parameters.dt = 1.0 / config.step_hz as f32;
    parameters.contact_softness = contact;
    parameters.static_contact_softness = contact;
    parameters.normalized_prediction_distance = PREDICTION_M;
    parameters.normalized_allowed_linear_error = SLOP_M;
    parameters.normalized_contact_recycle_distance = RECYCLE_M;
    // Nothing here moves more than a few millimetres a step.
    parameters.max_ccd_substeps = 0;
}

fn add_ground(engine: &mut PhysicsWorld, scene: &Scene) {
    let [half_x, half_y] = scene.table_half_m;
    let mut slab = |half: [f32; 3], top_z: f32| {
        let body = RigidBodyBuilder::fixed().translation(Vector::new(0.0, 0.0, top_z - half[2]));
        let collider = ColliderBuilder::cuboid(half[0], half[1], half[2])
            .friction(FRICTION)
            .collision_groups(groups(SCENE_GROUP, Group::ALL));
        engine.insert(body, collider);
    };
    slab([half_x, half_y, TABLE_HALF_THICKNESS_M], 0.0);
    slab([GROUND_HALF_M, GROUND_HALF_M, 0.05], GROUND_Z_M);
}

fn add_body(engine: &mut PhysicsWorld, scene: &Scene, index: BodyIndex, in_world: &Pose) -> RigidBodyHandle {
    let body = scene.body(index);
    let builder = match body.mobility {
        Mobility::Movable => RigidBodyBuilder::dynamic(),
        Mobility::Fixed => RigidBodyBuilder::fixed(),
    };
    let angular_damping = match body.shape {
        Shape::Ball { .. } => BALL_ANGULAR_DAMPING,
        _ => ANGULAR_DAMPING,
    };
    let mut rigid_body = builder.angular_damping(angular_damping).pose(to_engine(in_world)).build();
    let rest = rigid_body.activation_mut();
    rest.normalized_linear_threshold = REST_M_PER_S;
    rest.time_until_sleep = REST_SECS;
    let handle = engine.insert_body(rigid_body);
    for Part { in_body, shape } in parts(&body.shape) {
        let collider = ColliderBuilder::new(shape)
            .position(in_body)
            .density(DENSITY_KG_PER_M3)
            .friction(FRICTION)
            .collision_groups(groups(SCENE_GROUP, Group::ALL))
            .user_data(u128::from(index.0) + 1);
        engine.insert_collider(collider, Some(handle));
    }
    handle
}
