//! A world whose robot sees: where it takes things to be, and what it does by that.
//!
//! The robot goes to where a thing was seen, with the turn and to the height that was seen, plans round what it takes to
//! stand there, and chooses where to let go by what it has seen. Where it is wrong, its fingers come down beside or on
//! the thing and the engine tells what becomes of it: the gripper stops where it touches something on its way down. With
//! no camera the robot takes everything to be where it is.

use rapier3d::math::{Pose as EnginePose, Vector};
use rapier3d::parry::bounding_volume::{Aabb, BoundingVolume as _};

use crate::perception::Perception;
use crate::robot::RobotApi as _;
use crate::scene::{BodyIndex, Mobility, SceneState};
use crate::sim::Simulation;
use crate::sim::act::Air;
use crate::sim::engine_shape::{from_engine, to_engine};
use crate::sim::grasp::Grasp;
use crate::sim::gripper::{PALM_M, TIP_M, hull};
use crate::sim::motion::Tool;
use crate::trace::Cause;

/// Fingers that are stopped so much before they are where they should be are on something, in metres.
const BLOCKED_M: f32 = 0.005;
/// How far above what was seen below it a held body is let go, in metres.
const SET_DOWN_M: f32 = 0.001;
/// How far beside the gripper's axis a body may end to be below it, in metres.
const BELOW_M: f32 = 0.005;
/// What a body rests on is below more than its edge, in metres.
const EDGE_M: f32 = 0.004;
/// No lower do fingers close, above the table, in metres.
const ON_TABLE_M: f32 = 0.002;

/// A camera, and how what is held lies in the gripper.
pub(super) struct Sight {
    perception: Perception,
    /// Of the held body, in the gripper.
    held: Option<(BodyIndex, EnginePose)>,
}

impl Simulation {
    /// The same world with a robot that knows of it what a camera shows. It looks once before it begins, and then at the
    /// end of each action.
    #[must_use]
    pub fn with_perception(mut self, mut perception: Perception) -> Self {
        perception.look_first(&self.scene, &self.state());
        self.sight = Some(Sight { perception, held: None });
        self.frames.clear();
        self.record(true);
        self
    }

    /// Whether the robot knows of its table what a camera shows.
    pub(super) fn sees(&self) -> bool {
        self.sight.is_some()
    }

    /// Looks at the table as it is now.
    pub(super) fn look(&mut self) {
        let state = self.state();
        let Some(sight) = &mut self.sight else { return };
        let held = self.gripper.held.map(|held| held.body);
        if held.is_none() {
            sight.held = None;
        }
        sight.perception.look(&self.scene, &state);
    }

    /// Whether the robot knows where a body is.
    pub(super) fn knows(&self, body: BodyIndex) -> bool {
        self.sight.as_ref().is_none_or(|sight| sight.perception.memory(body).is_known)
    }

    /// Where the robot takes a body to be. What it holds moves with it.
    pub(super) fn believed(&self, body: BodyIndex) -> EnginePose {
        let Some(Sight { perception, held }) = &self.sight else { return self.body_in_world(body) };
        match held {
            Some((held, in_gripper)) if *held == body => self.gripper.tool.in_world() * *in_gripper,
            _ => to_engine(&perception.memory(body).in_world),
        }
    }

    fn body_in_world(&self, body: BodyIndex) -> EnginePose {
        match self.gripper.flown() {
            Some((flown, in_world)) if flown == body => in_world,
            _ => self.world.in_world(body),
        }
    }

    /// The world as the robot takes it to be.
    pub(super) fn believed_state(&self) -> SceneState {
        let state = self.state();
        if !self.sees() {
            return state;
        }
        let bodies = self.scene.body_indices();
        SceneState { bodies_in_world: bodies.map(|body| from_engine(&self.believed(body))).collect(), ..state }
    }

    /// Bodies that the robot knows of and does not hold.
    fn others(&self) -> impl Iterator<Item = BodyIndex> {
        let held = self.gripper.held.map(|held| held.body);
        self.scene.body_indices().filter(move |&body| Some(body) != held && self.knows(body))
    }

    /// Boxes around everything that is not held, where the robot takes it to be.
    pub(super) fn boxes(&self) -> Vec<Aabb> {
        if !self.sees() {
            return self.world.boxes(self.gripper.held_handle()).collect();
        }
        self.others().flat_map(|body| self.world.boxes_at(body, &self.believed(body))).collect()
    }

    /// Height of the highest point of all that is not held, at least the table's.
    pub(super) fn top_z(&self) -> f32 {
        if !self.sees() {
            return self.world.top_z(self.gripper.held_handle());
        }
        self.boxes().iter().map(|bounds| bounds.maxs.z).fold(0.0, f32::max)
    }

    /// Down to a height, with nothing in the way.
    pub(super) fn sink_freely(&mut self, z: f32) -> Result<(), Cause> {
        let short_m = self.sink(z, 0.0)?;
        if short_m > BLOCKED_M { Err(Cause::Collided) } else { Ok(()) }
    }

    /// Down onto what was seen below, with the turn that it was seen with; where the fingers come down on something,
    /// once more with the next turn.
    pub(super) fn grip_what_is_seen(&mut self) -> Result<(), Cause> {
        let hover = self.gripper.tool;
        let Some(body) = self.aim() else {
            self.sink(TIP_M + ON_TABLE_M, 0.0)?;
            self.close_on_air()?;
            return self.miss();
        };
        let mut refused = Cause::Collided;
        for grasp in self.grasps(body) {
            let over = Tool { yaw_rad: grasp.yaw_rad, ..self.gripper.tool.over(grasp.position) };
            let z = grasp.position.z.max(TIP_M + ON_TABLE_M);
            let down = self.follow(over, Air::Unknown).and_then(|()| self.sink(z, 0.0));
            match down {
                Ok(short_m) if short_m <= BLOCKED_M => return self.take_what_is_there(body),
                Ok(_) => refused = Cause::Collided,
                Err(cause) => refused = cause,
            }
            self.rise(hover.position.z)?;
        }
        Err(refused)
    }

    /// Closes on what is between the fingers, which the robot takes for a body.
    fn take_what_is_there(&mut self, aimed: BodyIndex) -> Result<(), Cause> {
        let Some(found) = self.gripper.between_fingers(&self.scene, &self.world) else {
            self.close_on_air()?;
            return self.miss();
        };
        let mut in_gripper = self.gripper.tool.in_world().inv_mul(&self.believed(aimed));
        if self.scene.body(aimed).shape.rim_m().is_none() {
            // Both fingers touch it.
            in_gripper.translation.y = 0.0;
        }
        self.take(found)?;
        if let Some(sight) = &mut self.sight {
            sight.held = Some((found, in_gripper));
        }
        Ok(())
    }

    /// What is held is where the gripper has brought it, until it is seen again.
    pub(super) fn leave(&mut self) {
        let Some((body, _)) = self.sight.as_ref().and_then(|sight| sight.held) else { return };
        let in_world = from_engine(&self.believed(body));
        if let Some(sight) = &mut self.sight {
            sight.perception.remember(body, in_world);
            sight.held = None;
        }
    }

    /// The uppermost of the movable bodies that were seen below the palm.
    fn aim(&self) -> Option<BodyIndex> {
        let palm = self.gripper.tool.at_height(self.gripper.tool.position.z + PALM_M).position;
        let is_below = |bounds: &Aabb| {
            let least = bounds.mins - Vector::new(BELOW_M, BELOW_M, 0.0);
            let most = bounds.maxs + Vector::new(BELOW_M, BELOW_M, 0.0);
            (least.x..=most.x).contains(&palm.x) && (least.y..=most.y).contains(&palm.y) && bounds.mins.z < palm.z
        };
        let movable = self.others().filter(|&body| self.scene.body(body).mobility == Mobility::Movable);
        let boxes = movable.flat_map(|body| {
            let boxes = self.world.boxes_at(body, &self.believed(body)).into_iter();
            boxes.map(move |bounds| (body, bounds))
        });
        let below = boxes.filter(|(_, bounds)| is_below(bounds));
        below.max_by(|(_, a), (_, b)| a.maxs.z.total_cmp(&b.maxs.z)).map(|(body, _)| body)
    }

    /// Ways to close on a body where it was seen; those first whose fingers come down beside nothing else that was seen.
    fn grasps(&self, body: BodyIndex) -> Vec<Grasp> {
        let believed = self.believed(body);
        let tool = Tool { position: believed.translation, ..self.gripper.tool };
        let mut grasps = Grasp::plans(&self.scene.body(body).shape, &believed, &tool, self.gripper.jaw_m);
        let around: Vec<Aabb> = self
            .others()
            .filter(|&other| other != body)
            .flat_map(|other| self.world.boxes_at(other, &self.believed(other)))
            .collect();
        grasps.sort_by_key(|grasp| {
            let there = Tool { position: grasp.position, yaw_rad: grasp.yaw_rad, ..self.gripper.tool };
            let parts = hull(&there, self.gripper.jaw_m);
            parts.iter().any(|(shape, pose)| around.iter().any(|other| shape.compute_aabb(pose).intersects(other)))
        });
        grasps
    }

    /// Height of what was seen below a held body, if the gripper were at a place.
    pub(super) fn support_z(&self, place: Vector) -> f32 {
        let Some(held) = self.gripper.held else { return 0.0 };
        let shift = Vector::new(place.x - self.gripper.tool.position.x, place.y - self.gripper.tool.position.y, 0.0);
        let in_world = self.believed(held.body);
        let bounds = self.world.boxes_at(held.body, &in_world).into_iter().reduce(|a, b| a.merged(&b));
        let Some(bounds) = bounds.map(|bounds| bounds.translated(shift)) else { return 0.0 };
        let is_below = |other: &&Aabb| {
            let reaches = |axis: usize| {
                bounds.mins[axis] + EDGE_M < other.maxs[axis] && other.mins[axis] + EDGE_M < bounds.maxs[axis]
            };
            reaches(0) && reaches(1)
        };
        self.boxes().iter().filter(is_below).map(|other| other.maxs.z).fold(0.0, f32::max)
    }

    /// Height of the gripper at which what it holds rests on what was seen below. The lowest where only touch tells:
    /// without a camera, and for what stands in another.
    pub(super) fn rest_z(&self) -> f32 {
        let Some(held) =
            self.gripper.held.filter(|held| self.sees() && self.scene.body(held.body).shape.rim_m().is_none())
        else {
            return f32::MIN;
        };
        let boxes = self.world.boxes_at(held.body, &self.believed(held.body));
        let bottom_z = boxes.iter().map(|bounds| bounds.mins.z).fold(f32::MAX, f32::min);
        let tool = self.gripper.tool.position;
        (tool.z - bottom_z + self.support_z(tool) + SET_DOWN_M).min(tool.z)
    }

    /// Whether arm or palm touch something that moves.
    pub(super) fn has_touched(&self) -> bool {
        let links = self.links.as_ref().is_some_and(|links| links.are_touching(&self.world));
        links || self.gripper.is_palm_touching(&self.world)
    }
}
