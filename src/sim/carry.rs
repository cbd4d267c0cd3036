//! Carrying a tray away: the last trial of a stack.

use rapier3d::dynamics::RigidBodyType;
use rapier3d::math::Vector;

use crate::scene::BodyIndex;
use crate::sim::gripper::TIP_M;
use crate::sim::motion::{Motion, Tool};
use crate::sim::mover::{Stance, Transit};
use crate::sim::{Simulation, SimulationConfig};
use crate::task::Layout;

/// How far the tray is lifted, and then carried, in metres.
const LIFT_M: f32 = 0.2;
const CARRY_M: [f32; 2] = [0.3, -0.3];
/// As far, past an arm.
const BENCH_CARRY_M: [f32; 2] = [0.424, 0.0];
/// As fast as a waiter walks. The peaks of the motion's speed and acceleration, in metres per second (squared).
const SPEED_M_PER_S: f32 = 0.8;
const ACCELERATION_M_PER_S2: f32 = 2.0;
/// How far above the lifted stack the gripper waits, in metres.
const ABOVE_M: f32 = 0.05;

impl Simulation {
    /// Moves the gripper out of the way, lifts the tray, carries it across the table and stops; takes simulated time,
    /// records nothing. What is on the tray is held by friction and by the rims of what it lies in.
    pub(super) fn carry_away(&mut self, tray: BodyIndex) {
        let from = Tool { position: self.world.in_world(tray).translation, yaw_rad: 0.0, opening_m: 0.0 };
        let config = self.config.clone();
        self.make_way(&config);
        let handle = self.world.handle(tray);
        self.world.engine.bodies[handle].set_body_type(RigidBodyType::KinematicPositionBased, true);
        let steady = SimulationConfig {
            speed_m_per_s: SPEED_M_PER_S,
            acceleration_m_per_s2: ACCELERATION_M_PER_S2,
            ..config.clone()
        };
        let lifted = Tool { position: from.position + Vector::new(0.0, 0.0, LIFT_M), ..from };
        let [carry_x, carry_y] = match config.layout() {
            Layout::Table => CARRY_M,
            Layout::Bench => BENCH_CARRY_M,
        };
        let carried = Tool { position: lifted.position + Vector::new(carry_x, carry_y, 0.0), ..from };
        let mut drive = |simulation: &mut Simulation, at: Tool| {
            simulation.world.wake_all();
            simulation.world.engine.bodies[handle].set_next_kinematic_translation(at.position);
            simulation.step_engine(simulation.gripper.tool);
        };
        self.follow_unrecorded(from, lifted, &steady, &mut drive);
        self.follow_unrecorded(lifted, carried, &steady, &mut drive);
        self.come_to_rest();
    }

    /// The gripper rises above where the tray will be lifted; an arm goes home.
    fn make_way(&mut self, config: &SimulationConfig) {
        let top_z = self.world.top_z(self.gripper.held_handle());
        let Some(stance) = self.mover.stance() else {
            let hand_z = top_z + LIFT_M + ABOVE_M + TIP_M;
            let hand = self.gripper.tool.at_height(hand_z.max(self.gripper.tool.position.z));
            return self.follow_unrecorded(self.gripper.tool, hand, config, Simulation::drive_gripper);
        };
        let (_, home) = Stance::home(self.gripper.tool.opening_m);
        let transit_z = home.position.z.max(self.gripper.tool.position.z).max(top_z + ABOVE_M + TIP_M);
        let transit = Transit { over: &|_| home.position, transit_z, hover_z: home.position.z };
        // Where no way leads home it stays, and the tray has to pass it.
        let ways = stance.transit(self.gripper.tool, &transit, &self.around(), config).unwrap_or_default();
        for way in ways {
            for step in 1..=way.n_steps() {
                let before = self.mover.stance().copied();
                self.mover.stand(way.stance(step));
                self.step_engine_from(before, way.tool(step));
                self.clock.tick();
            }
        }
    }

    fn drive_gripper(&mut self, tool: Tool) {
        self.step_engine(tool);
    }

    /// Follows a motion step by step.
    fn follow_unrecorded(
        &mut self,
        from: Tool,
        to: Tool,
        config: &SimulationConfig,
        mut drive: impl FnMut(&mut Self, Tool),
    ) {
        let motion = Motion::new(from, to, config);
        for step in 1..=motion.n_steps {
            drive(self, motion.at(step));
            self.clock.tick();
        }
    }
}
