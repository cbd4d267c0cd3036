//! Toy pictures of a tabletop for tests: flat coloured squares, seen from the front and above.

use ntp::dataset::Wanted;
use ntp::geometry::Vec3;
use ntp::model::Pictures;
use ntp::rollout::{Eye, Sight};
use ntp::scene::Scene;
use ntp::trace::{Episode, Frame};
use ntp::training::Gallery;

const PIXELS: usize = 64;
const PIXELS_PER_M: f32 = 75.0;
const TABLE: [u8; 3] = [150, 140, 130];
const GRIPPER: [u8; 3] = [70, 70, 75];
const BLOCKS: [[u8; 3]; 8] = [
    [220, 40, 40],
    [40, 180, 60],
    [50, 80, 220],
    [230, 200, 40],
    [200, 60, 200],
    [50, 200, 210],
    [240, 130, 30],
    [240, 240, 240],
];

/// Paints frames.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Painter;

impl Painter {
    /// Where a point is seen, from -1 to 1 across and down.
    pub(crate) fn place(at: &Vec3) -> [f32; 2] {
        let pixels = [32.0 + at.x * PIXELS_PER_M, 44.0 - (0.45 * at.y + at.z) * PIXELS_PER_M];
        pixels.map(|value| value / PIXELS as f32 * 2.0 - 1.0)
    }

    pub(crate) fn paint(self, scene: &Scene, frame: &Frame) -> Vec<u8> {
        let mut rgb: Vec<u8> = TABLE.repeat(PIXELS * PIXELS);
        let mut things: Vec<(Vec3, [u8; 3], [f32; 2])> = scene
            .body_indices()
            .map(|body| {
                (frame.state.body_in_world(body).translation.vector, BLOCKS[usize::from(body.0) % 8], [2.0, 2.0])
            })
            .collect();
        let gripper = frame.state.gripper_in_world.translation.vector;
        for side in [-1.0, 1.0] {
            let finger = gripper + Vec3::new(side * (frame.state.opening_m / 2.0 + 0.015), -0.001, 0.06);
            things.push((finger, GRIPPER, [1.0, 4.0]));
        }
        // The farthest first, and of what lies behind one another the lowest.
        things.sort_by(|a, b| b.0.y.total_cmp(&a.0.y).then(a.0.z.total_cmp(&b.0.z)));
        for (at, colour, half) in things {
            fill(&mut rgb, Self::place(&at).map(|value| (value + 1.0) * PIXELS as f32 / 2.0), half, colour);
        }
        rgb
    }
}

fn fill(rgb: &mut [u8], centre: [f32; 2], half: [f32; 2], colour: [u8; 3]) {
    let range = |axis: usize| {
        let bound = |value: f32| value.round().clamp(0.0, PIXELS as f32) as usize;
        bound(centre[axis] - half[axis])..bound(centre[axis] + half[axis])
    };
    for row in range(1) {
        for column in range(0) {
            rgb[3 * (row * PIXELS + column)..][..3].copy_from_slice(&colour);
        }
    }
}

impl Eye for Painter {
    fn look(&mut self, scene: &Scene, frame: &Frame) -> Pictures {
        let mut picture = Self::nothing();
        picture.push(&self.paint(scene, frame), frame.gripper());
        picture
    }
}

impl Painter {
    /// No picture yet.
    pub(crate) fn nothing() -> Pictures {
        Pictures::of_size(PIXELS, PIXELS)
    }

    /// What a policy is given of a demonstration.
    pub(crate) fn sight(demonstration: &Episode) -> Sight {
        let mut video = Self::nothing();
        demonstration
            .boundary_frames()
            .for_each(|(_, frame)| video.push(&Self.paint(&demonstration.scene, frame), frame.gripper()));
        Sight { video, eye: Box::new(Self) }
    }
}

/// Pictures of the boundary frames of episodes.
pub(crate) struct Paintings(pub(crate) Vec<Episode>);

impl Paintings {
    pub(crate) fn show(&self, trial: usize, frames: &[usize], into: &mut Pictures) {
        let episode = &self.0[trial];
        let boundaries: Vec<&Frame> = episode.boundary_frames().map(|(_, frame)| frame).collect();
        for frame in frames.iter().map(|&frame| boundaries[frame]) {
            into.push(&Painter.paint(&episode.scene, frame), frame.gripper());
        }
    }
}

impl Gallery for Paintings {
    fn size(&self) -> (usize, usize) {
        (PIXELS, PIXELS)
    }

    fn fetch(&self, wanted: &Wanted, into: &mut Pictures) -> Result<(), String> {
        self.show(wanted.position, &wanted.frames, into);
        Ok(())
    }
}
