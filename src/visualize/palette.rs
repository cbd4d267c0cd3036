//! Colours: each program has one, wherever it is shown.

use rerun::Color;
use sha2::{Digest as _, Sha256};

use crate::program::Program;

/// Behind the scene.
pub(super) const SKY: [u8; 3] = [28, 32, 38];
/// Of the table.
pub(super) const TABLE: [u8; 3] = [122, 112, 100];
/// Of the gripper.
pub(super) const GRIPPER: [u8; 3] = [176, 184, 194];
/// Of an arm.
pub(super) const ARM: [u8; 3] = [150, 48, 52];
/// Of fingers that hold something.
pub(super) const HOLDING: [u8; 3] = [120, 214, 120];
/// Of the mark around what `move_to` goes to.
pub(super) const TARGET: [u8; 3] = [255, 255, 255];
/// Of what is there but not meant.
pub(super) const BACKGROUND: [u8; 3] = [58, 64, 72];
/// Of the probability that a scope starts at a frame.
pub(super) const START: [u8; 3] = [102, 205, 120];
/// Of the probability that a scope ends at a frame.
pub(super) const STOP: [u8; 3] = [240, 98, 98];

/// Of programs that are not of our vocabulary.
const OTHERS: [[u8; 3]; 8] = [
    [84, 110, 168],
    [126, 87, 194],
    [38, 150, 140],
    [205, 133, 63],
    [79, 165, 235],
    [92, 170, 96],
    [214, 84, 120],
    [190, 180, 80],
];

/// Opaque.
pub(super) fn color([red, green, blue]: [u8; 3]) -> Color {
    Color::from_rgb(red, green, blue)
}

/// Mixed with black; `share` of the colour is left.
pub(super) fn dimmed(color: [u8; 3], share: f32) -> Color {
    let [red, green, blue] = color.map(|part| (f32::from(part) * share) as u8);
    Color::from_rgb(red, green, blue)
}

/// The colour of a program of any vocabulary, by its name.
pub(super) fn of_name(name: &str) -> [u8; 3] {
    if let Ok(program) = name.parse::<Program>() {
        return program.color();
    }
    let digest = Sha256::digest(name.as_bytes());
    OTHERS[usize::from(digest[0]) % OTHERS.len()]
}

/// Depths, told apart in plots.
pub(super) fn of_depth(depth: u8) -> Color {
    match depth {
        0 => color([122, 146, 200]),
        1 => color([160, 124, 222]),
        2 => color([64, 190, 176]),
        3 => color([240, 170, 80]),
        _ => color([220, 110, 150]),
    }
}
