//! Colours of a row's samples, from what each shows and how far it is.

use crate::geometry::Vec3;
use crate::render::look::mixed;
use crate::render::mesh::Surface;
use crate::render::raster::{Affine, NOTHING};
use crate::render::shade::{Drawn, FlatLight, INKS, Palette, PrintShading, RoundShading, Shader, Shading, plus, times};
use crate::render::shadow::{MapPlace, ShadowMap};

/// With more texels than this to a sample the nearest one is as good as a mean.
const COARSE: f32 = 0.7;
/// Keeps places on a repeating texture above 0, in texels.
const WRAP: f32 = 4096.0;

/// What shading looks things up in.
pub(in crate::render) struct Prepared<'a> {
    pub(in crate::render) faces: &'a [Drawn],
    pub(in crate::render) palettes: &'a mut [Palette],
    pub(in crate::render) shadows: &'a ShadowMap,
    pub(in crate::render) place: MapPlace,
    /// Of the picture, in samples.
    pub(in crate::render) height: usize,
}

/// Neighbouring samples of a row that show one face.
struct Run<'a> {
    row: usize,
    begin: usize,
    depths: &'a [f32],
}

impl Shader {
    /// Colours of a row's samples, `[column, 3]`.
    pub(in crate::render) fn shade_row(
        &self,
        prepared: &mut Prepared<'_>,
        row: usize,
        owners: &[u32],
        depths: &[f32],
        rgb: &mut [u8],
    ) {
        let mut begin = 0;
        while begin < owners.len() {
            let owner = owners[begin];
            let len = owners[begin..].iter().position(|&other| other != owner).unwrap_or(owners.len() - begin);
            let run = Run { row, begin, depths: &depths[begin..begin + len] };
            let rgb = &mut rgb[3 * begin..3 * (begin + len)];
            begin += len;
            if owner == NOTHING {
                let [top, bottom] = self.background;
                fill(rgb, self.tone(mixed(top, bottom, (row as f32 + 0.5) / prepared.height as f32)));
                continue;
            }
            match &prepared.faces[owner as usize].shading {
                Shading::Flat(light) => self.shade_flat(prepared, light, &run, rgb),
                Shading::Print(print) => self.shade_print(prepared, print, &run, rgb),
                Shading::Round(round) => self.shade_round(prepared, round, &run, rgb),
            }
        }
    }

    fn shade_flat(&self, prepared: &Prepared<'_>, light: &FlatLight, run: &Run<'_>, rgb: &mut [u8]) {
        let dark = self.tone(light.shaded);
        if light.sun == [0.0; 3] {
            return fill(rgb, dark);
        }
        let bright = self.tone(plus(light.shaded, light.sun, 1.0));
        let mut sunlight = prepared.sunlight(run);
        for (pixel, &depth) in rgb.chunks_exact_mut(3).zip(run.depths) {
            let color = match sunlight.next(depth) {
                0.0 => dark,
                1.0 => bright,
                share => self.tone(plus(light.shaded, light.sun, share)),
            };
            pixel.copy_from_slice(&color);
        }
    }

    fn shade_print(&self, prepared: &mut Prepared<'_>, print: &PrintShading, run: &Run<'_>, rgb: &mut [u8]) {
        let mut palette = std::mem::take(&mut prepared.palettes[print.palette]);
        if palette.0.is_empty() {
            self.mix(print, &mut palette);
        }
        let (across, down) = (&print.across, &print.down);
        let slope = |of: &Affine| of.x.abs() + of.y.abs();
        let width = slope(&across.slope).max(slope(&down.slope)) * run.depths[run.depths.len() / 2];
        let level = print.texture.level(width);
        let coarse = width * level.size() > COARSE;
        let brightest = (self.n_sunlights - 1) as f32;
        let mut sunlight = prepared.sunlight(run);
        let (mut x, mut y) = (run.steps(&across.slope), run.steps(&down.slope));
        for (pixel, &depth) in rgb.chunks_exact_mut(3).zip(run.depths) {
            let column = (x.next() * depth + across.constant) * level.size() + WRAP;
            let row = (y.next() * depth + down.constant) * level.size() + WRAP;
            let ink = if coarse { level.nearest(column, row) } else { level.between(column, row) };
            let sun = (sunlight.next(depth) * brightest + 0.5) as u32 as usize;
            let color = sun * INKS + usize::from(ink) * INKS / 256;
            pixel.copy_from_slice(&palette.0[color]);
        }
        prepared.palettes[print.palette] = palette;
    }

    fn shade_round(&self, prepared: &Prepared<'_>, round: &RoundShading, run: &Run<'_>, rgb: &mut [u8]) {
        let mut sunlight = prepared.sunlight(run);
        let mut steps = [0, 1, 2].map(|axis: usize| run.steps(&round.point[axis].slope));
        for (pixel, &depth) in rgb.chunks_exact_mut(3).zip(run.depths) {
            let point = Vec3::from_fn(|axis, _| steps[axis].next() * depth + round.point[axis].constant);
            let normal = match round.surface {
                Surface::Cone { radial, axial } => {
                    let away = radial / (point.x * point.x + point.y * point.y).sqrt().max(1e-6);
                    Vec3::new(point.x * away, point.y * away, axial)
                }
                Surface::Ball | Surface::Flat(_) => point / point.norm().max(1e-6),
            };
            let share = sunlight.next(depth);
            let light = self.flat_light(normal.dot(&round.to_sun), normal.dot(&round.up));
            let lit = times(round.color, plus(light.shaded, light.sun, share));
            let shine = round.gloss * share * thirty_second_power(normal.dot(&round.half).max(0.0));
            pixel.copy_from_slice(&self.tone(plus(lit, self.light.sun, shine)));
        }
    }
}

fn thirty_second_power(value: f32) -> f32 {
    let mut power = value;
    for _ in 0..5 {
        power *= power;
    }
    power
}

fn fill(rgb: &mut [u8], color: [u8; 3]) {
    for pixel in rgb.chunks_exact_mut(3) {
        pixel.copy_from_slice(&color);
    }
}

impl Prepared<'_> {
    fn sunlight(&self, run: &Run<'_>) -> Sunlight<'_> {
        let MapPlace { column, row, height } = self.place;
        let steps = [column, row, height].map(|place| run.steps(&place.slope));
        Sunlight { shadows: self.shadows, steps, constants: [column.constant, row.constant, height.constant] }
    }
}

impl Run<'_> {
    fn steps(&self, slope: &Affine) -> Steps {
        Steps { value: slope.at(self.begin, self.row), step: slope.x }
    }
}

/// An affine function, sample by sample.
struct Steps {
    value: f32,
    step: f32,
}

impl Steps {
    fn next(&mut self) -> f32 {
        let value = self.value;
        self.value += self.step;
        value
    }
}

/// How much of the sun reaches the samples of a run.
struct Sunlight<'a> {
    shadows: &'a ShadowMap,
    steps: [Steps; 3],
    constants: [f32; 3],
}

impl Sunlight<'_> {
    fn next(&mut self, depth: f32) -> f32 {
        let [column, row, height] = [0, 1, 2].map(|axis: usize| self.steps[axis].next() * depth + self.constants[axis]);
        self.shadows.light(column, row, height)
    }
}
