//! Sun and sky on the faces of a picture.

mod row;

pub(super) use row::Prepared;

use crate::geometry::{Pose, Vec3};
use crate::render::look::{Light, Look, Shadows, linear, mixed};
use crate::render::mesh::{Face, Print, Surface};
use crate::render::texture::Texture;
use crate::render::view::{Linear, Sight, View};

/// Steps of linear light that have a byte of their own.
const TONES: usize = 4096;
const LAST_TONE: f32 = (TONES - 1) as f32;
const TWO_TO_23: f32 = 8_388_608.0;
/// Shares of ink that are told apart.
const INKS: usize = 32;
/// Shares of sunlight that are told apart where edges of shadows are soft.
const SUNLIGHTS: usize = 17;

/// A face that some sample may show.
#[derive(Clone, Copy, Debug)]
pub(super) struct Drawn {
    pub(super) segment: u16,
    shading: Shading,
}

#[derive(Clone, Copy, Debug)]
enum Shading {
    /// The same everywhere but for shadow.
    Flat(FlatLight),
    Print(PrintShading),
    Round(RoundShading),
}

/// Light on a flat face, or what comes back from it.
#[derive(Clone, Copy, Debug)]
struct FlatLight {
    /// In shadow.
    shaded: [f32; 3],
    /// What the sun adds.
    sun: [f32; 3],
}

#[derive(Clone, Copy, Debug)]
struct PrintShading {
    light: FlatLight,
    color: [f32; 3],
    ink: [f32; 3],
    texture: &'static Texture,
    across: Linear,
    down: Linear,
    /// Number of the colours of this face.
    palette: usize,
}

#[derive(Clone, Copy, Debug)]
struct RoundShading {
    surface: Surface,
    color: [f32; 3],
    gloss: f32,
    /// The point in the thing's frame.
    point: [Linear; 3],
    to_sun: Vec3,
    up: Vec3,
    /// Half-way between sun and camera.
    half: Vec3,
}

/// The colours that a printed face can have: `[share of sunlight, share of ink]`. Empty until a sample shows the face.
#[derive(Clone, Debug, Default)]
pub(super) struct Palette(Vec<[u8; 3]>);

/// The light of one look.
#[derive(Debug)]
pub(super) struct Shader {
    light: Light,
    to_sun: Vec3,
    background: [[f32; 3]; 2],
    n_sunlights: usize,
    tones: Vec<u8>,
}

impl Shader {
    pub(super) fn new(look: &Look) -> Self {
        let tone = |step: usize| {
            let value = step as f32 / LAST_TONE;
            let encoded = if value <= 0.003_130_8 { value * 12.92 } else { 1.055 * value.powf(1.0 / 2.4) - 0.055 };
            (encoded * 255.0 + 0.5) as u8
        };
        Self {
            light: look.light,
            to_sun: look.light.to_sun.try_normalize(1e-6).unwrap_or(Vec3::z()),
            background: look.background.map(linear),
            n_sunlights: if look.shadows == Shadows::Soft { SUNLIGHTS } else { 2 },
            tones: (0..TONES).map(tone).collect(),
        }
    }

    /// Unit vector towards the sun.
    pub(super) fn to_sun(&self) -> &Vec3 {
        &self.to_sun
    }

    /// As a picture has it.
    fn tone(&self, color: [f32; 3]) -> [u8; 3] {
        // Adding 2^23 leaves the whole number in the low bits, without the checks of a conversion.
        color.map(|value| self.tones[((value.min(1.0) * LAST_TONE + TWO_TO_23).to_bits() as usize) & (TONES - 1)])
    }

    /// Prepares a face that the camera sees; `n_palettes` counts those of printed faces.
    pub(super) fn prepare(
        &self,
        view: &View,
        sight: &Sight,
        in_world: &Pose,
        face: &Face,
        n_palettes: &mut usize,
    ) -> Shaded {
        let to_sun = in_world.rotation.inverse_transform_vector(&self.to_sun);
        let up = in_world.rotation.inverse_transform_vector(&Vec3::z());
        let shading = match face.surface {
            Surface::Flat(print) => {
                let light = self.flat_light(face.normal.dot(&to_sun), face.normal.dot(&up));
                match print {
                    None => Shading::Flat(light.on(face.color)),
                    Some(print) => {
                        *n_palettes += 1;
                        Shading::Print(PrintShading::new(view, sight, face.color, &print, light, *n_palettes - 1))
                    }
                }
            }
            surface @ (Surface::Ball | Surface::Cone { .. }) => {
                let point = [Vec3::x(), Vec3::y(), Vec3::z()].map(|axis| view.linear(sight, &axis, 0.0));
                let half = (to_sun + sight.eye.normalize()).normalize();
                Shading::Round(RoundShading { surface, color: face.color, gloss: face.gloss, point, to_sun, up, half })
            }
        };
        Shaded(shading)
    }

    fn flat_light(&self, facing_sun: f32, upward: f32) -> FlatLight {
        let sky = mixed(self.light.ground, self.light.sky, 0.5 + 0.5 * upward);
        FlatLight { shaded: sky, sun: self.light.sun.map(|sun| sun * facing_sun.max(0.0)) }
    }

    /// Fills the palette of a printed face.
    fn mix(&self, print: &PrintShading, palette: &mut Palette) {
        let PrintShading { light, color, ink, .. } = print;
        for sunlight in 0..self.n_sunlights {
            let lit = plus(light.shaded, light.sun, sunlight as f32 / (self.n_sunlights - 1) as f32);
            for share in 0..INKS {
                let color = mixed(*color, *ink, share as f32 / (INKS - 1) as f32);
                palette.0.push(self.tone(times(color, lit)));
            }
        }
    }
}

/// How a face is shaded.
pub(super) struct Shaded(Shading);

impl Shaded {
    /// On something.
    pub(super) fn of(self, segment: u16) -> Drawn {
        Drawn { segment, shading: self.0 }
    }
}

impl Palette {
    /// Forgets its colours.
    pub(super) fn clear(&mut self) {
        self.0.clear();
    }
}

impl FlatLight {
    fn on(self, color: [f32; 3]) -> Self {
        Self { shaded: times(color, self.shaded), sun: times(color, self.sun) }
    }
}

impl PrintShading {
    fn new(view: &View, sight: &Sight, color: [f32; 3], print: &Print, light: FlatLight, palette: usize) -> Self {
        let place = |(axis, constant): &(Vec3, f32)| view.linear(sight, axis, *constant);
        let (across, down) = (place(&print.across), place(&print.down));
        Self { light, color, ink: print.ink, texture: print.texture, across, down, palette }
    }
}

fn times(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] * b[0], a[1] * b[1], a[2] * b[2]]
}

fn plus(base: [f32; 3], more: [f32; 3], share: f32) -> [f32; 3] {
    [base[0] + more[0] * share, base[1] + more[1] * share, base[2] + more[2] * share]
}
