//! What is printed on faces: letters and wood, as shares of ink, at several sizes.

use std::sync::OnceLock;

use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster};

use crate::render::look::Letters;

/// Width and height of the finest level, in texels.
const SIZE: usize = 256;
/// Levels, each half as wide as the one before.
const LEVELS: usize = 7;

/// Shares of ink, 255 for all, on a square that repeats, at sizes from [`SIZE`] down.
#[derive(Debug)]
pub(super) struct Texture {
    levels: Vec<Level>,
}

/// A texture at one size.
#[derive(Debug)]
pub(super) struct Level {
    texels: Vec<u8>,
    size: usize,
}

impl Level {
    /// Width and height in texels.
    pub(super) fn size(&self) -> f32 {
        self.size as f32
    }

    fn texel(&self, column: usize, row: usize) -> u8 {
        let mask = self.size - 1;
        self.texels[(row & mask) * self.size + (column & mask)]
    }

    /// The ink at a place in texels, at least 0.
    pub(super) fn nearest(&self, column: f32, row: f32) -> u8 {
        self.texel(column as u32 as usize, row as u32 as usize)
    }

    /// The ink at a place in texels, at least 1, mixed from the four texels around it.
    #[inline]
    pub(super) fn between(&self, column: f32, row: f32) -> u8 {
        let (column, row) = (column - 0.5, row - 0.5);
        let (left, top) = (column as u32 as usize, row as u32 as usize);
        let (right_share, low_share) = (column - left as f32, row - top as f32);
        let mix = |row: usize| {
            let [left, right] = [left, left + 1].map(|column| f32::from(self.texel(column, row)));
            left + (right - left) * right_share
        };
        let (upper, lower) = (mix(top), mix(top + 1));
        (upper + (lower - upper) * low_share) as u8
    }
}

/// Boards of wood.
pub(super) fn wood() -> &'static Texture {
    static WOOD: OnceLock<Texture> = OnceLock::new();
    WOOD.get_or_init(Texture::wood)
}

/// A block's face with a capital letter; `None` for other characters, and without letters.
pub(super) fn letter(letter: char, letters: Letters) -> Option<&'static Texture> {
    static SMALL: [OnceLock<Texture>; 26] = [const { OnceLock::new() }; 26];
    static LARGE: [OnceLock<Texture>; 26] = [const { OnceLock::new() }; 26];
    let number = letter.is_ascii_uppercase().then(|| letter as usize - 'A' as usize)?;
    match letters {
        Letters::None => None,
        Letters::Small => Some(SMALL[number].get_or_init(|| Texture::small_letter(letter))),
        Letters::Large => Some(LARGE[number].get_or_init(|| Texture::large_letter(letter))),
    }
}

impl Texture {
    /// From the ink in 0..=1 at places in 0..1, x to the right and y down.
    fn new(ink: impl Fn(f32, f32) -> f32) -> Self {
        let middle = |texel: usize| (texel as f32 + 0.5) / SIZE as f32;
        let mut shares: Vec<f32> =
            (0..SIZE * SIZE).map(|texel| ink(middle(texel % SIZE), middle(texel / SIZE))).collect();
        let mut levels = Vec::new();
        for level in 0..LEVELS {
            let size = SIZE >> level;
            let texels = shares.iter().map(|share| (share * 255.0 + 0.5) as u8).collect();
            levels.push(Level { texels, size });
            shares = halved(&shares, size / 2);
        }
        Self { levels }
    }

    /// The level to look at when a sample is `width` of the square wide.
    pub(super) fn level(&self, width: f32) -> &Level {
        let texels = (width * SIZE as f32).max(1.0) as u32;
        &self.levels[(texels.ilog2() as usize).min(LEVELS - 1)]
    }

    /// A block's face: a frame near its edges and a letter in the middle, of the font's own proportions.
    fn small_letter(letter: char) -> Self {
        let glyph = Glyph::new(letter, 0.0);
        let [width, height] = glyph.size();
        Self::new(|x, y| {
            let edge = (x - 0.5).abs().max((y - 0.5).abs());
            let frame = 0.3 * (ramp(edge, 0.405, 0.42) - ramp(edge, 0.44, 0.455));
            glyph.ink((x - 0.5) / SMALL * height / width, (y - 0.5) / SMALL, 0.31).max(frame)
        })
    }

    /// A block's face: a line along its edges and a bold letter that fills it, so that letters still differ where a
    /// face is four or five pixels wide.
    fn large_letter(letter: char) -> Self {
        let glyph = Glyph::new(letter, FAINT);
        Self::new(|x, y| {
            let edge = (x - 0.5).abs().max((y - 0.5).abs());
            glyph.ink((x - 0.5) / LARGE, (y - 0.5) / LARGE, 0.26).max(0.3 * ramp(edge, 0.47, 0.48))
        })
    }

    /// Wood: boards along x with their grain; repeats.
    fn wood() -> Self {
        let wave = |turns: f32, phase: f32| (std::f32::consts::TAU * (turns + phase)).sin();
        Self::new(|x, y| {
            let board = (y * N_BOARDS).floor();
            let along = x + 0.37 * board;
            let bend = 0.012 * wave(along, 0.13 * board) + 0.006 * wave(2.0 * along, 0.4);
            let rings = 0.5 + 0.5 * wave(11.0 * (y + bend), 0.2 * wave(along, 0.3 * board));
            let fine = 0.5 + 0.5 * wave(31.0 * (y + 0.5 * bend), 0.2 * wave(2.0 * along, 0.1));
            let edge = (y * N_BOARDS - board - 0.5).abs();
            let tint = 0.5 + 0.5 * wave(0.31 * board, 0.1);
            (0.38 * tint + 0.24 * rings * rings + 0.12 * fine).max(ramp(edge, 0.475, 0.492))
        })
    }
}

/// Boards on the width of the texture.
const N_BOARDS: f32 = 5.0;

/// Means of four: a square of `size` shares from one of twice that.
fn halved(finer: &[f32], size: usize) -> Vec<f32> {
    let mean = |texel: usize| {
        let first = 4 * size * (texel / size) + 2 * (texel % size);
        let below = first + 2 * size;
        (finer[first] + finer[first + 1] + finer[below] + finer[below + 1]) / 4.0
    };
    (0..size * size).map(mean).collect()
}

/// Height of a small letter over a face's edge.
const SMALL: f32 = 0.62;
/// Height and width of a large letter over a face's edge.
const LARGE: f32 = 0.86;
/// Ink that is no more than a stroke's rim.
const FAINT: f32 = 0.25;

/// A letter of the bitmap font, cut out of its box.
struct Glyph {
    rows: Vec<Vec<f32>>,
}

impl Glyph {
    /// Cut off are rows and columns with nothing but ink up to `faint`; where that is 0, rows alone.
    fn new(letter: char, faint: f32) -> Self {
        let raster = get_raster(letter, FontWeight::Regular, RasterHeight::Size16);
        let rows: Vec<Vec<f32>> = raster.map_or_else(Vec::new, |raster| {
            raster.rows().map(|row| row.iter().map(|&ink| f32::from(ink) / 255.0).collect()).collect()
        });
        let width = rows.first().map_or(0, Vec::len);
        let down = extent(rows.len(), |row| rows[row].iter().any(|&ink| ink > faint));
        let is_inked = |column: usize| faint == 0.0 || rows.iter().any(|row| row[column] > faint);
        let across = extent(width, is_inked);
        Self { rows: rows[down].iter().map(|row| row[across.clone()].to_vec()).collect() }
    }

    /// Columns and rows.
    fn size(&self) -> [f32; 2] {
        [self.rows.first().map_or(0.0, |row| row.len() as f32), self.rows.len() as f32]
    }

    /// The ink at a place: from -0.5 to 0.5 from left to right and from top to bottom. Bolder than the font, the more
    /// the lower the threshold: a stroke is as wide as its rim is above it.
    fn ink(&self, x: f32, y: f32, threshold: f32) -> f32 {
        let [width, height] = self.size();
        let (column, row) = ((x + 0.5) * width - 0.5, (y + 0.5) * height - 0.5);
        ramp(self.between(column, row), threshold, threshold + 0.12)
    }

    /// Smoothly between texels: a cubic B-spline, which rounds off the steps of the bitmap.
    fn between(&self, column: f32, row: f32) -> f32 {
        let [first_column, first_row] = [column.floor(), row.floor()];
        let (across, down) = (spline(column - first_column), spline(row - first_row));
        let mut sum = 0.0;
        for (y, down) in down.into_iter().enumerate() {
            for (x, across) in across.into_iter().enumerate() {
                let texel = self.texel(first_column as i32 + x as i32 - 1, first_row as i32 + y as i32 - 1);
                sum += across * down * texel;
            }
        }
        sum
    }

    fn texel(&self, column: i32, row: i32) -> f32 {
        let row = usize::try_from(row).ok().and_then(|row| self.rows.get(row));
        row.and_then(|row| row.get(usize::try_from(column).ok()?)).copied().unwrap_or(0.0)
    }
}

/// From the first position that is inked to the last.
fn extent(n: usize, is_inked: impl Fn(usize) -> bool) -> std::ops::Range<usize> {
    let first = (0..n).find(|&at| is_inked(at)).unwrap_or(0);
    first..(0..n).rfind(|&at| is_inked(at)).map_or(first, |last| last + 1)
}

/// Weights of the four texels around a place, given by its distance from the second.
fn spline(offset: f32) -> [f32; 4] {
    let (square, cube) = (offset * offset, offset * offset * offset);
    let first = 1.0 - 3.0 * offset + 3.0 * square - cube;
    let third = 1.0 + 3.0 * offset + 3.0 * square - 3.0 * cube;
    [first, 4.0 - 6.0 * square + 3.0 * cube, third, cube].map(|weight| weight / 6.0)
}

/// From 0 at `begin` smoothly to 1 at `end`.
fn ramp(value: f32, begin: f32, end: f32) -> f32 {
    let share = ((value - begin) / (end - begin)).clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}
