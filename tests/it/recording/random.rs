//! Random small episodes that hold every rule, and little more.

use ntp::geometry::{Pose, Rotation, Vec3};
use ntp::program::Program;
use ntp::scene::{Body, BodyIndex, Bowl, Mobility, Scene, SceneState, Shape, Slot, SlotIndex};
use ntp::task::{Family, Split};
use ntp::trace::{
    Actor, CallId, Cause, Episode, EpisodeParts, Frame, Outcome, Prediction, ProgramCall, Provenance, Push, Span,
};
use proptest::collection::vec;
use proptest::prelude::{Strategy, any};
use rand::seq::IndexedRandom as _;
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

/// One to four episodes of one family.
pub(super) fn episodes() -> impl Strategy<Value = Vec<Episode>> {
    let size = (any::<u64>(), 1..5_usize, 1..9_u32);
    (any::<bool>(), vec(size, 1..5)).prop_map(|(stacks, seeds)| {
        let family = if stacks { Family::BlockStacking } else { Family::ObjectSorting };
        seeds.into_iter().map(|(seed, n_bodies, n_frames)| episode(family, seed, n_bodies, n_frames)).collect()
    })
}

/// The episode of a seed.
pub(super) fn episode(family: Family, seed: u64, n_bodies: usize, n_frames: u32) -> Episode {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let scene = scene(&mut rng, n_bodies);
    let frames = frames(&mut rng, &scene, n_frames);
    let actor = if rng.random() { Actor::Expert } else { Actor::Policy("ntp_gru".to_owned()) };
    let specification_frames = rng.random_range(1..20);
    let (calls, ended) = Tree::new(&mut rng, &scene, family, n_frames, specification_frames).grown();
    let cause = *Cause::ALL.choose(&mut rng).unwrap();
    let outcome = if ended && rng.random() { Outcome::Success } else { Outcome::Failure(cause) };
    let provenance = Provenance {
        index: rng.random(),
        family,
        task_id: format!("task_{seed}"),
        task_text: "put ä on \"b\"\n".to_owned(),
        split: *Split::ALL.choose(&mut rng).unwrap(),
        trial: rng.random(),
        seed: rng.random(),
        counts: (0..rng.random_range(0..5)).map(|_| rng.random()).collect(),
        actor,
    };
    let pushes = pushes(&mut rng, &scene, &frames);
    Episode::new(EpisodeParts { provenance, scene, frames, specification_frames, calls, pushes, outcome }).unwrap()
}

/// About half of the boundaries show what came of a push after the boundary before.
fn pushes(rng: &mut ChaCha8Rng, scene: &Scene, frames: &[Frame]) -> Vec<Push> {
    let mut pushes = Vec::new();
    let mut before = 0;
    for (end, _) in frames.iter().enumerate().skip(1).filter(|(_, frame)| frame.boundary) {
        if rng.random() {
            let begin = rng.random_range(before..end) as u32;
            let body = BodyIndex(rng.random_range(0..scene.bodies.len()) as u16);
            let toppled = scene.body_indices().filter(|_| rng.random()).collect();
            let impulse_ns = rng.random();
            pushes.push(Push { frames: Span { begin, end: end as u32 + 1 }, body, impulse_ns, toppled });
        }
        before = end;
    }
    pushes
}

fn scene(rng: &mut ChaCha8Rng, n_bodies: usize) -> Scene {
    let body = |rng: &mut ChaCha8Rng, position: usize| Body {
        name: format!("body {position}"),
        shape: match rng.random_range(0..5) {
            0 => Shape::Cuboid { half_extents_m: [0.1, 0.25, 0.3] },
            1 => Shape::Cylinder { radius_m: 0.02, half_height_m: rng.random() },
            2 => Shape::Ball { radius_m: rng.random() },
            3 => Shape::Bowl(Bowl {
                floor_radius_m: rng.random(),
                rim_radius_m: 0.07,
                height_m: 0.05,
                wall_m: 0.004,
                foot_radius_m: 0.03,
                foot_height_m: rng.random(),
            }),
            _ => Shape::OpenBox { inner_m: [0.1, 0.2, rng.random()], wall_m: 0.005 },
        },
        mobility: if rng.random() { Mobility::Movable } else { Mobility::Fixed },
        color: rng.random(),
    };
    let bodies: Vec<Body> = (0..n_bodies).map(|position| body(rng, position)).collect();
    let slot = |rng: &mut ChaCha8Rng, position: usize| {
        let first = rng.random_range(0..n_bodies) as u16;
        Slot { name: format!("slot_{position}"), bodies: (first..n_bodies as u16).map(BodyIndex).collect() }
    };
    let slots = (0..rng.random_range(1..4)).map(|position| slot(rng, position)).collect();
    Scene { bodies, slots, table_half_m: [rng.random(), rng.random()] }
}

fn frames(rng: &mut ChaCha8Rng, scene: &Scene, n_frames: u32) -> Vec<Frame> {
    let mut time_nanos = if rng.random() { 0 } else { rng.random_range(0..5_000_000_000) };
    let mut poses: Vec<Pose> = scene.bodies.iter().map(|_| pose(rng)).collect();
    (0..n_frames)
        .map(|position| {
            time_nanos += rng.random_range(1..2_000_000_000);
            // Some bodies move, some stay where they are.
            for pose_of_body in &mut poses {
                if rng.random_bool(0.4) {
                    *pose_of_body = pose(rng);
                }
            }
            Frame {
                time_nanos,
                boundary: position == 0 || rng.random(),
                state: SceneState {
                    gripper_in_world: pose(rng),
                    opening_m: rng.random(),
                    held: rng.random_bool(0.5).then(|| BodyIndex(rng.random_range(0..poses.len()) as u16)),
                    bodies_in_world: poses.clone(),
                    joints_rad: None,
                },
                slots: scene.slots.iter().map(|slot| *slot.bodies.choose(rng).unwrap()).collect(),
            }
        })
        .collect()
}

fn pose(rng: &mut ChaCha8Rng) -> Pose {
    let mut number = || if rng.random_bool(0.2) { -0.0 } else { rng.random_range(-1.0..1.0_f32) };
    let translation = Vec3::new(number(), number(), number());
    Pose::from_parts(translation.into(), Rotation::from_euler_angles(number(), number(), number()))
}

/// A call tree being grown.
struct Tree<'a> {
    rng: &'a mut ChaCha8Rng,
    scene: &'a Scene,
    calls: Vec<ProgramCall>,
    ended: bool,
}

impl<'a> Tree<'a> {
    fn new(rng: &'a mut ChaCha8Rng, scene: &'a Scene, family: Family, n_frames: u32, specification: u32) -> Self {
        let whole = Span { begin: 0, end: specification };
        let root = ProgramCall {
            id: CallId(0),
            caller: None,
            depth: 0,
            step: 0,
            program: family.root_program(),
            argument: None,
            input: whole,
            output: Some(whole),
            frames: Span { begin: 0, end: n_frames },
            end_of_program: false,
            prediction: None,
        };
        Self { rng, scene, calls: vec![root], ended: true }
    }

    fn grown(mut self) -> (Vec<ProgramCall>, bool) {
        self.grow(0);
        (self.calls, self.ended)
    }

    fn grow(&mut self, caller: usize) {
        let ProgramCall { frames, output: Some(window), depth, .. } = self.calls[caller].clone() else { return };
        let n_steps = self.rng.random_range(1..4);
        let mut at = frames.begin;
        for step in 0..n_steps {
            let is_last = step + 1 == n_steps;
            let program = self.program(depth, is_last);
            let end_of_program = program == Program::None || (is_last && self.rng.random_bool(0.9));
            let begin = self.rng.random_range(at..frames.end);
            at = self.rng.random_range(begin..frames.end);
            let output = (program != Program::None).then(|| self.span_in(window));
            let argument =
                program.takes_argument().then(|| SlotIndex(self.rng.random_range(0..self.scene.slots.len()) as u16));
            self.calls.push(ProgramCall {
                id: CallId(self.calls.len() as u32),
                caller: Some(CallId(caller as u32)),
                depth: depth + 1,
                step,
                program,
                argument,
                input: window,
                output,
                frames: Span { begin, end: at + 1 },
                end_of_program,
                prediction: None,
            });
            self.ended &= !is_last || end_of_program;
            let position = self.calls.len() - 1;
            self.calls[position].prediction = self.prediction(window);
            if program.is_composite() {
                self.grow(position);
            }
        }
    }

    fn program(&mut self, depth: u8, is_last: bool) -> Program {
        match self.rng.random_range(0..5) {
            0 if is_last => Program::None,
            1 | 2 if depth < 4 => *[Program::Pick, Program::PickAndDrop, Program::Place].choose(self.rng).unwrap(),
            _ => *[Program::MoveTo, Program::Grip, Program::Release].choose(self.rng).unwrap(),
        }
    }

    fn span_in(&mut self, window: Span) -> Span {
        let begin = self.rng.random_range(window.begin..window.end);
        Span { begin, end: self.rng.random_range(begin..window.end) + 1 }
    }

    fn prediction(&mut self, window: Span) -> Option<Prediction> {
        if self.rng.random() {
            return None;
        }
        let n = if self.rng.random() { window.len() } else { 0 };
        Some(Prediction {
            program_probability: self.rng.random(),
            end_probability: self.rng.random(),
            start_probabilities: (0..n).map(|_| self.rng.random()).collect(),
            stop_probabilities: (0..n).map(|_| self.rng.random()).collect(),
        })
    }
}
