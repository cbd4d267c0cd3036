//! What moves the gripper: nothing, and it flies freely; or an arm, which has to reach and to pass.
//!
//! The actions speak of a [`Tool`] alone. For each stretch they ask for a [`Way`] there, which an arm may refuse.
//!
//! # Invariants
//!
//! A way that is refused moves nothing. On a way of an arm no joint is beyond its limits, nor faster or harder
//! accelerated than it allows.

use std::f32::consts::PI;
use std::f64::consts::FRAC_PI_2;

use rapier3d::math::Vector;

use crate::arm::{
    self, BASE_IN_WORLD_M, Branch, HOME, Line, Load, Obstacles, PlannerConfig, Posture, Upright, duration_through_secs,
    forward, on_branch, plan, solutions,
};
use crate::seed::Seed;
use crate::sim::SimulationConfig;
use crate::sim::motion::{Motion, Tool, turn_rad};
use crate::trace::Cause;

/// How near the arm comes to itself and to what stands there, in metres.
pub(super) const MARGIN_M: f64 = 0.01;
/// The same beside what it grips, where a neighbour may stand as near as the gripper's palm lets it.
const NEAREST_M: f64 = 0.002;
/// Postures of a straight way that are looked at, beside the first.
const N_SAMPLES: u32 = 16;
/// Every so many of them are checked for what stands there.
const CHECK_EVERY: usize = 4;
/// How densely lines in the space of joints are checked, in radians.
const CHECK_RAD: f64 = 0.05;
/// Above an object the last joint can still turn so far either way: fingers turn by a quarter at most.
const SPARE_TURN_RAD: f64 = FRAC_PI_2 + 0.2;
/// The last joint's limit.
const MOST_TURN_RAD: f64 = 4.7124;
/// A line in the space of joints sags: where it would touch something it begins so much higher, in metres.
const LIFT_M: f32 = 0.02;
const N_LIFTS: u32 = 4;
/// Heights that are tried where the highest is out of reach, in metres apart.
const LOWER_M: f32 = 0.02;

/// What moves the gripper.
pub(super) enum Mover {
    /// Nothing: it flies.
    Free,
    /// An arm.
    Arm(Stance),
}

/// How an arm stands: upright, with the third and the fifth joint at 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stance {
    pub(super) posture: Posture,
    branch: Branch,
}

/// A stretch of a motion.
#[derive(Clone, Debug)]
pub(super) enum Way {
    /// The gripper goes straight, without an arm.
    Free(Motion),
    /// The gripper goes straight and the arm follows.
    Straight(Motion, Tool, Stance),
    /// The arm goes straight in the space of its joints: from a tool to another.
    Joints { line: Line, from: Tool, to: Tool, branch: Branch, n_steps: u32 },
}

/// What an arm must see to, beside its own limits.
pub(super) struct Around {
    pub(super) obstacles: Obstacles,
    pub(super) load: Load,
}

impl Way {
    /// How many steps it takes; 0 when there is nothing to do.
    pub(super) fn n_steps(&self) -> u32 {
        match self {
            Self::Free(motion) | Self::Straight(motion, ..) => motion.n_steps,
            Self::Joints { n_steps, .. } => *n_steps,
        }
    }

    /// Where the gripper is after a step.
    pub(super) fn tool(&self, step: u32) -> Tool {
        match self {
            Self::Free(motion) | Self::Straight(motion, ..) => motion.at(step),
            Self::Joints { to, n_steps, .. } if step >= *n_steps => *to,
            Self::Joints { line, from, to, n_steps, .. } => {
                let share = f64::from(step) / f64::from(*n_steps);
                let s = arm::min_jerk(share) as f32;
                Tool {
                    position: in_world(&forward(&line.at(share)).position),
                    yaw_rad: from.yaw_rad + (to.yaw_rad - from.yaw_rad) * s,
                    opening_m: from.opening_m + (to.opening_m - from.opening_m) * s,
                }
            }
        }
    }

    /// How the arm stands after a step; `None` without an arm.
    pub(super) fn stance(&self, step: u32) -> Option<Stance> {
        match self {
            Self::Free(_) => None,
            // Between places that were reached all are.
            Self::Straight(motion, from, stance) => Some(stance.following(from, &motion.at(step)).unwrap_or(*stance)),
            Self::Joints { line, branch, n_steps, .. } => {
                let share = f64::from(step) / f64::from((*n_steps).max(1));
                Some(Stance { posture: line.at(share), branch: *branch })
            }
        }
    }

    /// Where it ends.
    pub(super) fn end(&self) -> (Tool, Option<Stance>) {
        (self.tool(self.n_steps()), self.stance(self.n_steps()))
    }
}

/// A place of the base's frame in the world.
pub(super) fn in_world(position: &arm::Vector) -> Vector {
    let [x, y, z] = BASE_IN_WORLD_M;
    Vector::new((position.x + x) as f32, (position.y + y) as f32, (position.z + z) as f32)
}

/// A place of the world in the base's frame.
pub(super) fn in_base(position: Vector) -> arm::Vector {
    let [x, y, z] = position.to_array().map(f64::from);
    arm::Vector::new(x, y, z) - arm::Vector::from(BASE_IN_WORLD_M)
}

fn upright(tool: &Tool) -> Upright {
    Upright { position: in_base(tool.position), yaw_rad: f64::from(tool.yaw_rad) }
}

impl Stance {
    /// At home, with the gripper so far open.
    pub(super) fn home(opening_m: f32) -> (Self, Tool) {
        let stance = Self { posture: HOME, branch: Branch::ALL[0] };
        (stance, Tool { position: in_world(&forward(&HOME).position), yaw_rad: 0.0, opening_m })
    }

    /// The stance at another tool of the same branch, which the last joint follows from that at `from`.
    fn following(&self, from: &Tool, to: &Tool) -> Option<Self> {
        let mut posture = on_branch(&upright(to), self.branch)?;
        let turn = f64::from(turn_rad(from.yaw_rad, to.yaw_rad));
        posture.0[6] = self.posture.0[6] + posture.0[0] - self.posture.0[0] - turn;
        posture.is_within_limits().then_some(Self { posture, ..*self })
    }

    /// A straight way of the gripper, no faster than the joints allow.
    fn straight(&self, from: Tool, to: Tool, around: &Around, config: &SimulationConfig) -> Result<Way, Cause> {
        let mut motion = Motion::new(from, to, config);
        if from.position == to.position && from.yaw_rad == to.yaw_rad {
            return Ok(Way::Straight(motion, from, *self));
        }
        let sampled = motion.in_steps(N_SAMPLES);
        let stances = (0..=N_SAMPLES).map(|step| self.following(&from, &sampled.at(step)));
        let postures: Option<Vec<Posture>> = stances.map(|stance| Some(stance?.posture)).collect();
        let postures = postures.ok_or(Cause::NoPath)?;
        let mut checked = postures.iter().skip(CHECK_EVERY).step_by(CHECK_EVERY);
        if !checked.all(|posture| around.obstacles.arm_is_clear(posture, NEAREST_M)) {
            return Err(Cause::NoPath);
        }
        motion.n_steps = motion.n_steps.max(steps(duration_through_secs(&postures), config));
        Ok(Way::Straight(motion, from, *self))
    }

    /// A straight way in the space of joints.
    fn line(&self, from: Tool, to: Tool, end: Self, config: &SimulationConfig) -> Way {
        let line = Line { from: self.posture, to: end.posture };
        let n_steps = steps(line.duration_secs(), config).max(Motion::new(from, to, config).n_steps);
        Way::Joints { line, from, to, branch: end.branch, n_steps }
    }

    /// All stances with the gripper there from which it can still turn either way.
    fn all_at(tool: &Tool) -> Vec<Self> {
        let most = MOST_TURN_RAD - SPARE_TURN_RAD;
        let upright = upright(tool);
        let found = solutions(&upright).map(|(branch, posture)| Self { posture, branch });
        // Half a turn more or less is another tool's.
        let is_turned_so = |stance: &Self| turn_rad(stance.yaw_rad(), tool.yaw_rad).abs() < 1e-3;
        found.filter(|stance| stance.posture.0[6].abs() <= most && is_turned_so(stance)).collect()
    }

    /// The turn about the vertical that the gripper has.
    fn yaw_rad(&self) -> f32 {
        (self.posture.0[0] - self.posture.0[6] + yaw_at_zero()) as f32
    }
}

/// The gripper's turn where first and last joint are alike.
fn yaw_at_zero() -> f64 {
    HOME.0[6] - HOME.0[0]
}

fn steps(secs: f64, config: &SimulationConfig) -> u32 {
    (secs * f64::from(config.step_hz)).ceil() as u32
}

impl Around {
    /// Whether a line in the space of joints keeps clear of everything.
    fn is_line_clear(&self, from: &Posture, to: &Posture) -> bool {
        let longest = from.0.iter().zip(&to.0).map(|(from, to)| (to - from).abs()).fold(0.0, f64::max);
        let n_parts = (longest / CHECK_RAD).ceil().max(1.0) as u32;
        (1..=n_parts).all(|part| {
            let posture = from.between(to, f64::from(part) / f64::from(n_parts));
            self.obstacles.are_clear(&posture, &self.load)
        })
    }
}

/// Where the gripper is to go: up, across and down. `over` says where its reference point is to be with a turn.
pub(super) struct Transit<'a> {
    pub(super) over: &'a dyn Fn(f32) -> Vector,
    /// Height to go across at, at least.
    pub(super) transit_z: f32,
    /// Where it ends.
    pub(super) hover_z: f32,
}

impl Mover {
    /// How the arm stands, if there is one.
    pub(super) fn stance(&self) -> Option<&Stance> {
        match self {
            Self::Free => None,
            Self::Arm(stance) => Some(stance),
        }
    }

    /// The arm stands so now, if there is one.
    pub(super) fn stand(&mut self, stance: Option<Stance>) {
        if let (Self::Arm(now), Some(stance)) = (self, stance) {
            *now = stance;
        }
    }

    /// A straight way from where the gripper is.
    pub(super) fn way(
        &self,
        from: Tool,
        to: Tool,
        around: impl Fn() -> Around,
        config: &SimulationConfig,
    ) -> Result<Way, Cause> {
        match self {
            Self::Free => Ok(Way::Free(Motion::new(from, to, config))),
            Self::Arm(stance) => stance.straight(from, to, &around(), config),
        }
    }

    /// Whether it holds the gripper at some turn there.
    pub(super) fn reaches(&self, position: Vector) -> bool {
        match self {
            Self::Free => true,
            Self::Arm(_) => {
                let there = Upright { position: in_base(position), yaw_rad: 0.0 };
                solutions(&there).next().is_some()
            }
        }
    }
}

fn at_height(position: Vector, z: f32) -> Vector {
    Vector::new(position.x, position.y, z)
}

impl Stance {
    /// The ways up and across of a transit, in order; the last one ends above its goal, from where it goes straight down.
    pub(super) fn transit(
        &self,
        from: Tool,
        transit: &Transit<'_>,
        around: &Around,
        config: &SimulationConfig,
    ) -> Result<Vec<Way>, Cause> {
        for lift in 0..N_LIFTS {
            let z = transit.transit_z + LIFT_M * lift as f32;
            let risen = from.at_height(z);
            let Ok(up) = self.straight(from, risen, around, config) else { break };
            let Some(top) = up.end().1 else { break };
            if let Some((to, end)) = top.across(risen, z, transit, around) {
                return Ok(vec![up, top.line(risen, to, end, config)]);
            }
        }
        self.planned(from, transit, around, config)
    }

    /// The nearest stance above the goal that a clear line leads to and that reaches the goal below.
    fn across(&self, from: Tool, z: f32, transit: &Transit<'_>, around: &Around) -> Option<(Tool, Self)> {
        self.goals(from, z, transit).into_iter().find(|(_, end)| around.is_line_clear(&self.posture, &end.posture))
    }

    /// Stances above the goal from which it is reached, the nearest first; and the gripper there.
    fn goals(&self, from: Tool, z: f32, transit: &Transit<'_>) -> Vec<(Tool, Self)> {
        let mut goals = Vec::new();
        // What hangs beside the gripper hangs at the other side when that is turned by half.
        for yaw_rad in [0.0, PI] {
            let position = at_height((transit.over)(yaw_rad), z);
            let to = Tool { position, yaw_rad, ..from };
            let reaching = |end: &Self| end.following(&to, &to.at_height(transit.hover_z)).is_some();
            let ends = Self::all_at(&to).into_iter().filter(reaching);
            goals.extend(ends.map(|end| (Tool { yaw_rad: end.yaw_rad(), ..to }, end)));
        }
        goals.sort_by(|a, b| self.posture.secs_to(&a.1.posture).total_cmp(&self.posture.secs_to(&b.1.posture)));
        goals
    }

    /// A way round, where up, across and down does not do: from as high as it can go up to as low as it has to come
    /// down.
    fn planned(
        &self,
        from: Tool,
        transit: &Transit<'_>,
        around: &Around,
        config: &SimulationConfig,
    ) -> Result<Vec<Way>, Cause> {
        let mut heights = (0..).map(|step| transit.transit_z - LOWER_M * step as f32);
        let up = heights.by_ref().take_while(|&z| z > from.position.z).find_map(|z| {
            let way = self.straight(from, from.at_height(z), around, config).ok()?;
            around.obstacles.are_clear(&way.end().1?.posture, &around.load).then_some(way)
        });
        let (risen, top) = up.as_ref().map_or((from, Some(*self)), Way::end);
        let top = top.ok_or(Cause::NoPath)?;
        let heights = (0..).map(|step| transit.transit_z.max(transit.hover_z) - LOWER_M * step as f32);
        let goals = heights.take_while(|&z| z >= transit.hover_z - LOWER_M).map(|z| z.max(transit.hover_z));
        let config_of_planner = PlannerConfig::default();
        for (to, end) in goals.flat_map(|z| top.goals(risen, z, transit)) {
            let seed = seed_of(&top.posture, &end.posture);
            let Ok(found) = plan(&top.posture, &end.posture, &around.load, &around.obstacles, &config_of_planner, seed)
            else {
                continue;
            };
            return Ok(up.into_iter().chain(top.along(risen, to, end, &found.postures, config)).collect());
        }
        Err(Cause::NoPath)
    }

    /// The ways from posture to posture.
    fn along(&self, from: Tool, to: Tool, end: Self, postures: &[Posture], config: &SimulationConfig) -> Vec<Way> {
        let mut ways = Vec::new();
        let (mut tool, mut stance) = (from, *self);
        for (number, posture) in postures.iter().enumerate().skip(1) {
            let next = Self { posture: *posture, branch: end.branch };
            let is_last = number + 1 == postures.len();
            let on_the_way = Tool { position: in_world(&forward(posture).position), yaw_rad: next.yaw_rad(), ..tool };
            let goal = if is_last { to } else { on_the_way };
            ways.push(stance.line(tool, goal, next, config));
            (tool, stance) = (goal, next);
        }
        ways
    }
}

/// Of the bits of both ends: the same query is planned the same way, wherever it comes from.
fn seed_of(from: &Posture, to: &Posture) -> Seed {
    let bits: Vec<u64> = from.0.iter().chain(&to.0).map(|angle| angle.to_bits()).collect();
    Seed(0).derive("way", &bits)
}
