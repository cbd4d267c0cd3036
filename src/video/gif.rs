//! GIF: moving pictures for pages that show no video.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use color_quant::NeuQuant;
use gif::{Encoder, Frame, Repeat};

use crate::video::{Rgb, VideoError};
use crate::words::counted;

/// How carefully 256 colours are chosen: 1 to 30, where 1 is best and slowest.
const SPEED: i32 = 10;
/// Colours of a GIF's picture, one of which is transparent.
const N_COLORS: usize = 256;
/// Where the transparent one stands.
const TRANSPARENT: u8 = 0;
/// The least colours that a palette is chosen for.
const FEWEST_CHOSEN: usize = 64;

/// Pictures as a GIF that repeats, `fps` a second. Of the colours, those of `exact` stay as they are; the others share
/// what is left of a palette, where there are too many of them.
///
/// Of each picture only the rectangle is written in which it differs from the one before, and in it only the pixels
/// that do. A picture that is as the one before lengthens the time of that one.
///
/// # Errors
///
/// When a picture's bytes are not as many as its size says, or its size is not that of the first.
pub fn encode_gif(
    mut pictures: impl Iterator<Item = Rgb>,
    fps: u32,
    exact: &BTreeSet<[u8; 3]>,
) -> Result<Vec<u8>, VideoError> {
    let failed = VideoError::codec("encode", "GIF");
    let mut gif = Vec::new();
    let Some(mut shown) = pictures.next() else { return Err(failed(&"there are no pictures")) };
    let [width, height] = shown.size_px;
    let sides = u16::try_from(width).and_then(|width| Ok([width, u16::try_from(height)?]));
    let [columns, rows] = sides.map_err(|error| failed(&error))?;
    let mut encoder = Encoder::new(&mut gif, columns, rows, &[]).map_err(|error| failed(&error))?;
    encoder.set_repeat(Repeat::Infinite).map_err(|error| failed(&error))?;
    check(&shown, [width, height])?;
    let delay = (100 / fps.clamp(1, 100)) as u16;
    let mut waiting = frame(&shown, None, [0..width, 0..height], delay, exact);
    for picture in pictures {
        check(&picture, [width, height])?;
        match change(&shown, &picture) {
            None => waiting.delay = waiting.delay.saturating_add(delay),
            Some(area) => {
                let next = frame(&picture, Some(&shown), area, delay, exact);
                encoder.write_frame(&std::mem::replace(&mut waiting, next)).map_err(|error| failed(&error))?;
            }
        }
        shown = picture;
    }
    encoder.write_frame(&waiting).map_err(|error| failed(&error))?;
    drop(encoder);
    Ok(gif)
}

fn check(picture: &Rgb, size_px: [u32; 2]) -> Result<(), VideoError> {
    picture.check_size(size_px)?;
    let n_bytes = 3 * size_px[0] as usize * size_px[1] as usize;
    if picture.bytes.len() == n_bytes && n_bytes > 0 {
        return Ok(());
    }
    let message = format!("{} for {}x{} pixels", counted(picture.bytes.len(), "byte"), size_px[0], size_px[1]);
    Err(VideoError::codec("encode", "GIF")(&message))
}

/// The columns and rows in which two pictures differ; `None` where they do not.
fn change(before: &Rgb, after: &Rgb) -> Option<[Range<u32>; 2]> {
    let width = after.size_px[0];
    let pixels = before.bytes.chunks_exact(3).zip(after.bytes.chunks_exact(3));
    let changed = (0..).zip(pixels).filter(|(_, (before, after))| before != after).map(|(at, _)| at);
    changed.fold(None, |area, at: u32| {
        let [column, row] = [at % width, at / width];
        let Some([columns, rows]) = area else { return Some([column..column + 1, row..row + 1]) };
        Some([columns.start.min(column)..columns.end.max(column + 1), rows.start..row + 1])
    })
}

/// A part of a picture; of its pixels those that are as before are transparent.
fn frame(
    picture: &Rgb,
    before: Option<&Rgb>,
    [columns, rows]: [Range<u32>; 2],
    delay: u16,
    exact: &BTreeSet<[u8; 3]>,
) -> Frame<'static> {
    let width = picture.size_px[0];
    let mut pixels = Vec::with_capacity(columns.len() * rows.len());
    for row in rows.clone() {
        for column in columns.clone() {
            let at = 3 * (row * width + column) as usize;
            let pixel = &picture.bytes[at..at + 3];
            let is_as_before = before.is_some_and(|before| &before.bytes[at..at + 3] == pixel);
            pixels.push((!is_as_before).then(|| [pixel[0], pixel[1], pixel[2]]));
        }
    }
    let palette = Palette::of(&pixels, exact);
    let indices: Vec<u8> = pixels.iter().map(|pixel| pixel.map_or(TRANSPARENT, |color| palette.index(color))).collect();
    let size = [columns.len() as u16, rows.len() as u16];
    let mut frame = Frame::from_palette_pixels(size[0], size[1], indices, palette.bytes, Some(TRANSPARENT));
    (frame.left, frame.top, frame.delay) = (columns.start as u16, rows.start as u16, delay);
    frame
}

/// The colours of one picture.
struct Palette {
    /// Three a colour; the first is the transparent one.
    bytes: Vec<u8>,
    kept: BTreeMap<[u8; 3], u8>,
    /// What stands for all others, and where its colours begin.
    chosen: Option<(NeuQuant, usize)>,
}

impl Palette {
    fn of(pixels: &[Option<[u8; 3]>], exact: &BTreeSet<[u8; 3]>) -> Self {
        let found: BTreeSet<[u8; 3]> = pixels.iter().copied().flatten().collect();
        let are_few = found.len() < N_COLORS;
        let most = if are_few { N_COLORS - 1 } else { N_COLORS - 1 - FEWEST_CHOSEN };
        let kept = found.iter().filter(|&color| are_few || exact.contains(color)).take(most);
        let kept: BTreeMap<[u8; 3], u8> = kept.copied().zip(TRANSPARENT + 1..).collect();
        let mut bytes = [0; 3].into_iter().chain(kept.keys().copied().flatten()).collect::<Vec<u8>>();
        let chosen = (!are_few).then(|| {
            let others = pixels.iter().flatten().filter(|color| !kept.contains_key(*color));
            let others: Vec<u8> = others.flat_map(|&[red, green, blue]| [red, green, blue, u8::MAX]).collect();
            NeuQuant::new(SPEED, N_COLORS - 1 - kept.len(), &others)
        });
        let begin = bytes.len() / 3;
        bytes.extend(chosen.iter().flat_map(NeuQuant::color_map_rgb));
        Self { bytes, kept, chosen: chosen.map(|chosen| (chosen, begin)) }
    }

    fn index(&self, color: [u8; 3]) -> u8 {
        let [red, green, blue] = color;
        let chosen = |(chosen, begin): &(NeuQuant, usize)| begin + chosen.index_of(&[red, green, blue, u8::MAX]);
        self.kept.get(&color).copied().or_else(|| self.chosen.as_ref().map(|all| chosen(all) as u8)).unwrap_or_default()
    }
}
