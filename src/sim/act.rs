//! The three actions of the robot API, as motions of the gripper.

use rapier3d::math::{Rotation, Vector};

use crate::arm::{Obstacles, Solid};
use crate::robot::{Action, HOVER_M};
use crate::scene::{BodyIndex, Mobility, SlotIndex};
use crate::sim::Simulation;
use crate::sim::drop_spot;
use crate::sim::grasp::{self, Grasp};
use crate::sim::gripper::{Gripper, PALM_M, TIP_M};
use crate::sim::motion::Tool;
use crate::sim::mover::{Around, MARGIN_M, Stance, Transit, Way, in_base};
use crate::sim::sweep::AtStart;
use crate::trace::Cause;

/// Least height of gripper and load above everything on the way across, in metres.
const CLEARANCE_M: f32 = 0.02;
/// How near the gripper comes to what it must not touch, in metres.
const NEAREST_M: f32 = 0.002;
/// How high above what lies below a held body is let go, in metres.
const SET_DOWN_M: f32 = 0.001;
/// The same in a container, where what lies below is uneven.
const DROP_M: f32 = 0.008;
/// A body that was just gripped is lifted by the engine this far, until it has left what it stood on, in metres.
const LIFT_OFF_M: f32 = 0.008;
/// Fingers nearer to a body than this touch it, in metres.
const TOUCH_M: f32 = 0.000_3;
/// Speed of each closing finger, in metres per second.
const CLOSE_M_PER_S: f32 = 0.25;
const SPARE_TICKS: u32 = 12;

/// What is known of the way ahead.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Air {
    /// Nothing that sleeps stands in it.
    Clear,
    /// Something may: the engine decides.
    Unknown,
    /// Nothing from this height up.
    ClearFrom(f32),
}

/// Where `move_to` leads to.
struct Goal {
    /// What is to be below the gripper.
    target: Vector,
    /// Height to go across at.
    transit_z: f32,
    /// Where it ends.
    hover_z: f32,
}

impl Simulation {
    pub(super) fn perform(&mut self, action: Action) -> Result<(), Cause> {
        match action {
            Action::MoveTo(slot) => self.move_to(slot),
            Action::Grip if self.gripper.held.is_some() => Ok(()),
            Action::Grip => self.grip(),
            Action::Release => match self.gripper.held {
                None => self.open(),
                Some(_) => self.release(),
            },
        }
    }

    fn move_to(&mut self, slot: SlotIndex) -> Result<(), Cause> {
        let goal = self.goal(slot)?;
        self.cross(&goal)?;
        if self.sees() {
            return self.sink_freely(goal.hover_z);
        }
        self.sink(goal.hover_z, CLEARANCE_M)?;
        Ok(())
    }

    /// Where `move_to` leads to now.
    fn goal(&self, slot: SlotIndex) -> Result<Goal, Cause> {
        let Some(&body) = self.locked().get(usize::from(slot.0)) else {
            return Err(Cause::UnknownSlot);
        };
        if !self.knows(body) {
            return Err(Cause::NotSeen);
        }
        let target = self.believed(body).translation;
        let hover_z = target.z + self.scene.body(body).shape.rim_m().unwrap_or(0.0) + HOVER_M;
        let lowest_z = self.gripper.lowest_z(&self.world);
        let below_m = self.gripper.tool.position.z - lowest_z;
        let transit_z = (self.top_z() + below_m + CLEARANCE_M).max(hover_z).max(self.gripper.tool.position.z);
        Ok(Goal { target, transit_z, hover_z })
    }

    /// Up, and across to above a place.
    fn cross(&mut self, goal: &Goal) -> Result<(), Cause> {
        let Some(stance) = self.mover.stance() else {
            self.rise(goal.transit_z)?;
            let above = Vector::new(goal.target.x, goal.target.y, goal.transit_z);
            let position = above - self.gripper.hangs_beside(&self.scene);
            return self.follow(Tool { position, yaw_rad: 0.0, ..self.gripper.tool }, Air::Clear);
        };
        for way in self.ways(stance, goal)? {
            match way {
                Way::Joints { .. } => self.go(&way, Air::Clear),
                Way::Free(_) | Way::Straight(..) => self.go_up(&way),
            }
        }
        Ok(())
    }

    /// The ways of an arm up and across.
    fn ways(&self, stance: &Stance, goal: &Goal) -> Result<Vec<Way>, Cause> {
        let beside = self.gripper.hangs_beside(&self.scene);
        let over = |yaw_rad: f32| goal.target - Rotation::from_rotation_z(yaw_rad) * beside;
        let transit = Transit { over: &over, transit_z: goal.transit_z, hover_z: goal.hover_z };
        stance.transit(self.gripper.tool, &transit, &self.around(), &self.config)
    }

    /// Plans an arm's ways up and across to above a slot, and moves nothing: how many stretches they are. None without
    /// an arm, which needs no plan.
    ///
    /// # Errors
    ///
    /// [`Cause::NoPath`] when there is no way, [`Cause::UnknownSlot`] when there is no such slot.
    pub fn planned_stretches(&self, slot: SlotIndex) -> Result<usize, Cause> {
        let goal = self.goal(slot)?;
        self.mover.stance().map_or(Ok(0), |stance| Ok(self.ways(stance, &goal)?.len()))
    }

    fn grip(&mut self) -> Result<(), Cause> {
        self.open()?;
        if self.sees() {
            return self.grip_what_is_seen();
        }
        // From the palm: a body that was just released reaches above the gripper's reference point.
        let palm = self.gripper.tool.at_height(self.gripper.tool.position.z + PALM_M).position;
        let found = self.world.below(palm, None);
        let found_z = palm.z - found.map_or(0.0, |hit| hit.distance_m);
        let aim = found.and_then(|hit| hit.body).filter(|&body| self.scene.body(body).mobility == Mobility::Movable);
        let Some(body) = aim else {
            self.sink(found_z + TIP_M, NEAREST_M)?;
            self.close_on_air()?;
            return self.miss();
        };
        let grasp = self.plan_grasp(body);
        self.follow(Tool { yaw_rad: grasp.yaw_rad, ..self.gripper.tool }, Air::Unknown)?;
        if !self.shift(grasp.position)? {
            return self.miss();
        }
        self.sink(grasp.position.z, 0.0)?;
        self.take(body)
    }

    /// Closes on a body and holds it, if it is well between the fingers then.
    pub(super) fn take(&mut self, body: BodyIndex) -> Result<(), Cause> {
        let shape = self.scene.body(body).shape;
        if !self.close_on(body) || !grasp::is_between_fingers(&shape, &self.gripper.tool, &self.world.in_world(body)) {
            return self.miss();
        }
        self.gripper.hold(&mut self.world, body);
        self.lift_off_z = Some(self.gripper.tool.position.z + LIFT_OFF_M);
        Ok(())
    }

    /// How to close on a body: with the turn with which the open fingers can go down beside it; the nearest when they
    /// never can.
    fn plan_grasp(&self, body: BodyIndex) -> Grasp {
        let tool = self.gripper.tool;
        let plans = Grasp::plans(&self.scene.body(body).shape, &self.world.in_world(body), &tool, self.gripper.jaw_m);
        let is_free = |grasp: &&Grasp| {
            let turned = Tool { yaw_rad: grasp.yaw_rad, ..tool };
            let down = Vector::new(0.0, 0.0, (grasp.position.z - tool.position.z).min(0.0));
            self.gripper.free_way_m(&self.world, &turned, down, AtStart::Stops) >= down.length()
        };
        let as_it_is = Grasp { position: tool.position, yaw_rad: tool.yaw_rad };
        plans.iter().find(is_free).or(plans.first()).copied().unwrap_or(as_it_is)
    }

    pub(super) fn miss(&mut self) -> Result<(), Cause> {
        self.open()?;
        Err(Cause::MissedGrasp)
    }

    fn release(&mut self) -> Result<(), Cause> {
        let below = drop_spot::container_below(&self.scene, |body| self.believed(body), &self.gripper);
        let (z, gap_m) = match below {
            None => (self.rest_z(), SET_DOWN_M),
            Some(container) => {
                self.gripper.opens_to_m = drop_spot::opening_m(&self.scene, &self.gripper, container);
                let spot = self.drop_spot(container);
                self.shift(spot)?;
                (f32::MIN, DROP_M)
            }
        };
        self.sink(z, gap_m)?;
        self.leave();
        self.lift_off_z = None;
        let Some(body) = self.gripper.let_go(&mut self.world) else {
            return Err(Cause::DroppedObject);
        };
        let open = Tool { opening_m: self.gripper.opens_to_m, ..self.gripper.tool };
        self.follow(open, Air::Unknown)?;
        Gripper::part_from(&mut self.world, body);
        self.rest()
    }

    /// Where in a container to let go of what is held.
    fn drop_spot(&self, container: BodyIndex) -> Vector {
        let Self { scene, world, gripper, .. } = self;
        let place = (container, self.believed(container));
        if self.sees() {
            return drop_spot::choose(scene, world, gripper, place, |spot| -self.support_z(spot));
        }
        drop_spot::choose(scene, world, gripper, place, |spot| drop_spot::fall_m(world, gripper, spot))
    }

    /// Steps until all is at rest.
    pub(super) fn rest(&mut self) -> Result<(), Cause> {
        for step in 0..self.config.settle_limit_steps() {
            self.tick(self.gripper.tool);
            if self.is_at_rest(step) {
                return Ok(());
            }
        }
        Err(Cause::TimeLimit)
    }

    fn open(&mut self) -> Result<(), Cause> {
        let opening_m = self.gripper.jaw_m;
        self.gripper.opens_to_m = opening_m;
        self.follow(Tool { opening_m, ..self.gripper.tool }, Air::Unknown)
    }

    /// Closes until the fingers meet each other or something that is not to be grasped.
    pub(super) fn close_on_air(&mut self) -> Result<(), Cause> {
        let opening_m = self.gripper.tool.opening_m - 2.0 * self.gripper.free_closing_m(&self.world);
        self.follow(Tool { opening_m, ..self.gripper.tool }, Air::Unknown)
    }

    /// Closes until both fingers touch the body, which the first to touch pushes to the other; whether they do in
    /// little more than the time that it takes: something else may be between them.
    fn close_on(&mut self, body: BodyIndex) -> bool {
        let most_m = CLOSE_M_PER_S / self.config.step_hz as f32;
        let [left_m, right_m] = self.gripper.finger_gaps_m(&self.world, body);
        let n_ticks = (left_m.max(right_m) / most_m).ceil() as u32 + SPARE_TICKS;
        for _ in 0..n_ticks {
            let [left_m, right_m] = self.gripper.finger_gaps_m(&self.world, body);
            let farther_m = left_m.max(right_m);
            if farther_m <= TOUCH_M {
                return true;
            }
            let tool = self.gripper.tool;
            let opening_m = (tool.opening_m - 2.0 * farther_m.min(most_m)).max(0.0);
            self.tick(Tool { opening_m, ..tool });
        }
        false
    }

    /// Level to above a place; whether the way was free, else nothing moves.
    fn shift(&mut self, place: Vector) -> Result<bool, Cause> {
        let tool = self.gripper.tool;
        let over = Vector::new(place.x, place.y, tool.position.z);
        if self.sees() {
            self.follow(Tool { position: over, ..tool }, Air::Unknown)?;
            return Ok(true);
        }
        let way = over - tool.position;
        let is_free = self.gripper.free_way_m(&self.world, &tool, way, AtStart::MayLeave) >= way.length();
        if is_free {
            self.follow(Tool { position: over, ..tool }, Air::Clear)?;
        }
        Ok(is_free)
    }

    /// Straight up to a height; not at all when it is higher already.
    pub(super) fn rise(&mut self, z: f32) -> Result<(), Cause> {
        let tool = self.gripper.tool;
        if z > tool.position.z {
            let way = self.way(tool.at_height(z))?;
            self.go_up(&way);
        }
        Ok(())
    }

    /// Follows a way that leads straight up.
    fn go_up(&mut self, way: &Way) {
        let tool = self.gripper.tool;
        let up = Vector::new(0.0, 0.0, way.end().0.position.z - tool.position.z);
        if up.z <= 0.0 {
            return;
        }
        let is_free = self.gripper.free_way_m(&self.world, &tool, up, AtStart::MayLeave) >= up.z;
        let clear_z = if is_free { self.lift_off_z.unwrap_or(f32::MIN) } else { f32::MAX };
        self.go(way, Air::ClearFrom(clear_z));
        self.lift_off_z = None;
    }

    /// Straight down to a height, or until the gripper or what it holds is `gap_m` above something; gives how far above
    /// the height it ended.
    pub(super) fn sink(&mut self, z: f32, gap_m: f32) -> Result<f32, Cause> {
        let tool = self.gripper.tool;
        let depth_m = (tool.position.z - z).min(2.0);
        let free_m = self.gripper.free_way_m(&self.world, &tool, Vector::new(0.0, 0.0, -depth_m), AtStart::Stops);
        let way_m = if free_m < depth_m { (free_m - gap_m).max(0.0) } else { depth_m };
        self.follow(tool.at_height(tool.position.z - way_m), Air::Clear)?;
        Ok(depth_m - way_m)
    }

    /// A straight way from where the gripper is.
    fn way(&self, to: Tool) -> Result<Way, Cause> {
        self.mover.way(self.gripper.tool, to, || self.around(), &self.config)
    }

    pub(super) fn follow(&mut self, to: Tool, air: Air) -> Result<(), Cause> {
        let way = self.way(to)?;
        self.go(&way, air);
        Ok(())
    }

    /// Where one sees, the way is not known to be as free as it looks.
    fn go(&mut self, way: &Way, air: Air) {
        let air = if self.sees() { Air::Unknown } else { air };
        (1..=way.n_steps()).for_each(|step| self.step_along(way, step, air));
    }

    /// What an arm must keep clear of now: everything that it does not hold.
    pub(super) fn around(&self) -> Around {
        let boxes = self.boxes().into_iter();
        let solids = boxes.map(|bounds| Solid { least: in_base(bounds.mins), most: in_base(bounds.maxs) });
        let obstacles = Obstacles { solids: solids.collect(), ..Obstacles::table(in_base(Vector::ZERO).z, MARGIN_M) };
        Around { obstacles, load: self.gripper.load(&self.world) }
    }
}
