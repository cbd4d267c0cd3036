//! GIF: moving pictures for pages that show no video.

use std::ops::Range;

use gif::{Encoder, Frame, Repeat};

use crate::video::{Rgb, VideoError};

/// How carefully 256 colours are chosen: 1 to 30, where 1 is best and slowest.
const SPEED: i32 = 10;

/// Pictures as a GIF that repeats, `fps` a second.
///
/// Of each picture only the rectangle is written in which it differs from the one before, and in it only the pixels
/// that do. A picture that is as the one before lengthens the time of that one.
///
/// # Errors
///
/// When a picture's bytes are not as many as its size says, or its size is not that of the first.
pub fn encode_gif(mut pictures: impl Iterator<Item = Rgb>, fps: u32) -> Result<Vec<u8>, VideoError> {
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
    let mut waiting = frame(&shown, None, [0..width, 0..height], delay);
    for picture in pictures {
        check(&picture, [width, height])?;
        match change(&shown, &picture) {
            None => waiting.delay = waiting.delay.saturating_add(delay),
            Some(area) => {
                let next = frame(&picture, Some(&shown), area, delay);
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
    let message = format!("{} bytes for {}x{} pixels", picture.bytes.len(), size_px[0], size_px[1]);
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
fn frame(picture: &Rgb, before: Option<&Rgb>, [columns, rows]: [Range<u32>; 2], delay: u16) -> Frame<'static> {
    let width = picture.size_px[0];
    let mut rgba = Vec::with_capacity(4 * columns.len() * rows.len());
    for row in rows.clone() {
        for column in columns.clone() {
            let at = 3 * (row * width + column) as usize;
            let pixel = &picture.bytes[at..at + 3];
            let is_as_before = before.is_some_and(|before| &before.bytes[at..at + 3] == pixel);
            rgba.extend(if is_as_before { [0; 4] } else { [pixel[0], pixel[1], pixel[2], 255] });
        }
    }
    let mut frame = Frame::from_rgba_speed(columns.len() as u16, rows.len() as u16, &mut rgba, SPEED);
    (frame.left, frame.top, frame.delay) = (columns.start as u16, rows.start as u16, delay);
    frame
}
