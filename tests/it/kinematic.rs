//! A world without physics for tests: motions always succeed, what is set down stays where it is put.

use ntp::geometry::{Vec3, horizontal_distance, upright};
use ntp::robot::{Action, GRASP_M, HOVER_M, RobotApi};
use ntp::scene::{BodyIndex, Mobility, Scene, SceneState, locked_bodies};
use ntp::seed::Seed;
use ntp::task::{Condition, Family, Goal, Split, Task, Trial, initial_state, scene};
use ntp::trace::{Actor, Cause, Episode, Frame, Provenance};
use rand::Rng as _;
use rand_chacha::ChaCha8Rng;

/// Positions jump, in place of motions.
pub(crate) struct KinematicWorld {
    scene: Scene,
    state: SceneState,
    frames: Vec<Frame>,
    rng: ChaCha8Rng,
}

impl KinematicWorld {
    pub(crate) fn new(family: Family, trial: &Trial) -> Self {
        let scene = scene(family, &trial.counts);
        let state = initial_state(family, &scene, trial.seed);
        let slots = locked_bodies(&scene, &state, None);
        let first = Frame { time_nanos: 0, boundary: true, state: state.clone(), slots };
        Self { scene, state, frames: vec![first], rng: trial.seed.derive("kinematic", &[]).rng() }
    }

    fn position(&self, body: BodyIndex) -> Vec3 {
        self.state.body_in_world(body).translation.vector
    }

    fn gripper(&self) -> Vec3 {
        self.state.gripper_in_world.translation.vector
    }

    fn set_gripper(&mut self, position: Vec3) {
        self.state.gripper_in_world = upright(position, 0.0);
        if let Some(held) = self.state.held {
            self.set_body(held, position - Vec3::z() * GRASP_M);
        }
    }

    fn set_body(&mut self, body: BodyIndex, position: Vec3) {
        self.state.bodies_in_world[usize::from(body.0)] = upright(position, 0.0);
    }

    /// The highest body other than the held one whose centre is within `reach` metres of the gripper's axis.
    fn below(&self, reach: f32) -> Option<BodyIndex> {
        let bodies = self.scene.body_indices().filter(|&body| Some(body) != self.state.held);
        bodies
            .filter(|&body| horizontal_distance(&self.position(body), &self.gripper()) < reach)
            .max_by(|&a, &b| self.position(a).z.total_cmp(&self.position(b).z))
    }

    fn grip(&mut self) -> Result<(), Cause> {
        let movable = |&body: &BodyIndex| self.scene.body(body).mobility == Mobility::Movable;
        let Some(body) = self.below(0.02).filter(movable) else {
            let position = self.gripper();
            self.set_gripper(Vec3::new(position.x, position.y, GRASP_M));
            return Err(Cause::MissedGrasp);
        };
        self.set_gripper(self.position(body) + Vec3::z() * GRASP_M);
        self.state.held = Some(body);
        self.state.opening_m = 2.0 * self.scene.body(body).shape.half_extents_m().y;
        Ok(())
    }

    fn release(&mut self) {
        let Some(held) = self.state.held else { return };
        let jitter = |rng: &mut ChaCha8Rng| rng.random_range(-0.003..0.003_f32);
        let xy = self.gripper() + Vec3::new(jitter(&mut self.rng), jitter(&mut self.rng), 0.0);
        let containers = self.scene.body_indices().filter(|&body| {
            let is_container = body != held && self.scene.body(body).shape.rim_m().is_some();
            is_container && horizontal_distance(&self.position(body), &xy) < 0.05
        });
        let container = containers.max_by(|&a, &b| self.position(a).z.total_cmp(&self.position(b).z));
        let seat = |body: BodyIndex| self.position(body).z + self.scene.body(body).shape.seat_m();
        let floor = container.or_else(|| self.below(0.03)).map_or(0.0, seat);
        let foot = self.scene.body(held).shape.foot_m();
        self.set_gripper(Vec3::new(xy.x, xy.y, floor + foot + GRASP_M));
        self.state.held = None;
        self.state.opening_m = 0.07;
    }
}

impl RobotApi for KinematicWorld {
    fn scene(&self) -> &Scene {
        &self.scene
    }

    fn state(&self) -> SceneState {
        self.state.clone()
    }

    fn frames(&self) -> &[Frame] {
        &self.frames
    }

    fn act(&mut self, action: Action) -> Result<(), Cause> {
        let acted = match action {
            Action::MoveTo(slot) => {
                let body = self.now().slots[usize::from(slot.0)];
                let target = self.position(body) + Vec3::z() * HOVER_M;
                self.set_gripper(target);
                Ok(())
            }
            Action::Grip => self.grip(),
            Action::Release => {
                self.release();
                Ok(())
            }
        };
        let last = self.now();
        let slots = locked_bodies(&self.scene, &self.state, Some(&last.slots));
        let time_nanos = last.time_nanos + 500_000_000;
        self.frames.push(Frame { time_nanos, boundary: true, state: self.state.clone(), slots });
        acted
    }

    fn settle(&mut self) -> Result<SceneState, Cause> {
        Ok(self.state())
    }

    fn carry(&mut self, _tray: BodyIndex) -> Result<SceneState, Cause> {
        Ok(self.state())
    }
}

/// A stacking task that builds one tower of the given blocks, lowest first.
pub(crate) fn tower(id: &str, blocks: &[u16], split: Split) -> Task {
    use ntp::scene::SlotIndex;
    let goals: Vec<Goal> =
        blocks.windows(2).map(|pair| Goal { source: SlotIndex(pair[1]), target: SlotIndex(pair[0]) }).collect();
    let conditions = goals.iter().map(|goal| Condition::OnTop { upper: goal.source, lower: goal.target }).collect();
    Task { id: id.to_owned(), family: Family::BlockStacking, goals, conditions, split, blocks: None }
}

/// A sorting task that puts category `i` into container `mapping[i]`.
pub(crate) fn sorting(id: &str, mapping: [u16; 4], split: Split) -> Task {
    use ntp::scene::SlotIndex;
    let pairs = (0..4_u16).zip(mapping);
    let goals: Vec<Goal> =
        pairs.map(|(category, bin)| Goal { source: SlotIndex(category), target: SlotIndex(4 + bin) }).collect();
    let conditions =
        goals.iter().map(|goal| Condition::Inside { category: goal.source, container: goal.target }).collect();
    Task { id: id.to_owned(), family: Family::ObjectSorting, goals, conditions, split, blocks: None }
}

/// A clean-up task that stacks the given bowls, lowest first.
pub(crate) fn cleanup(id: &str, bowls: &[u16], split: Split) -> Task {
    use ntp::scene::SlotIndex;
    let [fork, tray] = [SlotIndex(4), SlotIndex(5)];
    let bowls = bowls.iter().copied().map(SlotIndex);
    let below = std::iter::once(tray).chain(bowls.clone());
    let goals: Vec<Goal> = bowls.chain([fork]).zip(below).map(|(source, target)| Goal { source, target }).collect();
    let conditions = goals.iter().map(|goal| goal.brings_about(Family::TableCleanup)).collect();
    Task { id: id.to_owned(), family: Family::TableCleanup, goals, conditions, split, blocks: None }
}

/// A trial of a task with the given number of each category.
pub(crate) fn trial(task: &Task, index: u32, count: u16) -> Trial {
    let counts = task.counts(|| count);
    Trial { index, counts, seed: Seed(7).derive(&task.id, &[u64::from(index)]) }
}

/// The expert's episode of a trial.
pub(crate) fn demonstration(task: &Task, trial: &Trial, index: u64) -> Episode {
    let mut world = KinematicWorld::new(task.family, trial);
    let provenance = Provenance::new(task, trial, Actor::Expert, index);
    ntp::expert::demonstrate(task, &mut world, provenance).unwrap()
}
