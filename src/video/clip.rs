//! Clips of episodes for people: MP4, GIF, or one picture.

use std::path::Path;

use crate::artifact::write;
use crate::render::{CameraConfig, Channel};
use crate::trace::{Episode, Frame};
use crate::video::png::{encode_grey_8, encode_grey_16};
use crate::video::{Film, H264Encoder, Mp4Writer, Rgb, VideoError, encode_gif, encode_png};

const NANOS_PER_SEC: u64 = 1_000_000_000;

/// The frames of an episode at a constant rate: at each time the last one recorded.
fn frames_at_rate(episode: &Episode, fps: u32) -> impl Iterator<Item = &Frame> {
    let end_nanos = episode.frames.last().map_or(0, |frame| frame.time_nanos);
    let fps = u64::from(fps.max(1));
    let n_shown = (end_nanos * fps).div_ceil(NANOS_PER_SEC) + 1;
    let at = move |shown: u64| {
        let time_nanos = shown * NANOS_PER_SEC / fps;
        let behind = episode.frames.partition_point(|frame| frame.time_nanos <= time_nanos);
        &episode.frames[behind.max(1) - 1]
    };
    (0..n_shown).map(at)
}

/// Pictures of an episode at a constant rate.
fn pictures(episode: &Episode, camera: &CameraConfig, fps: u32) -> Result<impl Iterator<Item = Rgb>, VideoError> {
    let mut film = Film::new(camera);
    film.begin_episode(episode)?;
    Ok(frames_at_rate(episode, fps).map(move |frame| {
        let picture = film.draw(&episode.scene, &frame.state);
        Rgb { size_px: [picture.width, picture.height], bytes: picture.rgb.clone() }
    }))
}

/// Writes a video of `fps` pictures a second. Returns how many there are.
///
/// # Errors
///
/// When a codec or the disk refuses; then there is no file.
pub fn write_mp4(path: &Path, episode: &Episode, camera: &CameraConfig, fps: u32) -> Result<u64, VideoError> {
    let mut encoder = H264Encoder::new(camera.size_px, fps)?;
    let mut file = Mp4Writer::create(path, camera.size_px, fps)?;
    let mut packet = Vec::new();
    for picture in pictures(episode, camera, fps)? {
        packet.clear();
        encoder.encode(&picture.bytes, false, &mut packet)?;
        file.write(&packet)?;
    }
    let n_pictures = file.n_samples();
    file.finish()?;
    Ok(n_pictures)
}

/// Writes moving pictures, `fps` a second, that repeat. Returns how many there are.
///
/// # Errors
///
/// As [`write_mp4`].
pub fn write_gif(path: &Path, episode: &Episode, camera: &CameraConfig, fps: u32) -> Result<u64, VideoError> {
    let gif = encode_gif(pictures(episode, camera, fps)?, fps)?;
    write(path, &gif)?;
    Ok(frames_at_rate(episode, fps).count() as u64)
}

/// Writes a picture of one recorded frame: its colours, depths (16 bits of grey, in millimetres, 0 for nothing) or
/// segments (8 bits of grey, [`crate::render::Segment::number`]).
///
/// # Errors
///
/// As [`write_mp4`].
pub fn write_png(
    path: &Path,
    episode: &Episode,
    camera: &CameraConfig,
    frame: &Frame,
    channel: Channel,
) -> Result<(), VideoError> {
    let mut film = Film::new(camera);
    film.begin_episode(episode)?;
    let picture = film.draw(&episode.scene, &frame.state);
    let size_px = [picture.width, picture.height];
    let mut png = Vec::new();
    match channel {
        Channel::Color => encode_png(&picture.rgb, size_px, &mut png)?,
        Channel::Depth => png = encode_grey_16(&picture.depth_mm(), size_px)?,
        Channel::Segments => {
            let numbers: Vec<u8> = picture.segments.iter().map(|&number| number.min(255) as u8).collect();
            png = encode_grey_8(&numbers, size_px)?;
        }
    }
    Ok(write(path, &png)?)
}
