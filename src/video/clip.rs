//! Clips of episodes for people: MP4, GIF, or one picture.

use std::collections::BTreeSet;
use std::path::Path;

use crate::artifact::write;
use crate::render::{CameraConfig, Channel};
use crate::trace::{Episode, Frame};
use crate::video::lanes::Lanes;
use crate::video::png::{encode_grey_8, encode_grey_16};
use crate::video::{Film, H264Encoder, Mp4Writer, Rgb, VideoError, encode_gif, encode_png};

const NANOS_PER_SEC: f64 = 1e9;

/// How an episode becomes moving pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClipConfig {
    /// Pictures a second, at least 1.
    pub fps: u32,
    /// Simulated seconds that pass in a second, above 0.
    pub speed: f32,
    /// Whether the running programs are shown below, a lane a depth.
    pub programs: bool,
}

impl Default for ClipConfig {
    /// Ten pictures a second, as fast as it was, without programs.
    fn default() -> Self {
        Self { fps: 10, speed: 1.0, programs: false }
    }
}

/// What was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Clip {
    /// Width and height in pixels, with the lanes of programs.
    pub size_px: [u32; 2],
    /// How many pictures.
    pub n_pictures: u64,
}

impl ClipConfig {
    /// Width and height of the pictures.
    fn size_px(&self, episode: &Episode, camera: &CameraConfig) -> [u32; 2] {
        let [width, height] = camera.size_px;
        let lanes = if self.programs { Lanes::new(episode, width).height() } else { 0 };
        [width, height + lanes]
    }

    /// The times of the pictures: from the first to one at or behind the last frame.
    fn times(&self, episode: &Episode) -> impl Iterator<Item = u64> + use<> {
        let step_nanos = (f64::from(self.speed) * NANOS_PER_SEC / f64::from(self.fps.max(1))).max(1.0);
        let end_nanos = episode.frames.last().map_or(0, |frame| frame.time_nanos);
        let n_steps = (end_nanos as f64 / step_nanos).ceil() as u64;
        (0..=n_steps).map(move |step| (step as f64 * step_nanos).round() as u64)
    }
}

/// Pictures of an episode: at each time the last frame recorded.
fn pictures<'e>(
    episode: &'e Episode,
    camera: &CameraConfig,
    clip: &ClipConfig,
) -> Result<impl Iterator<Item = Rgb> + use<'e>, VideoError> {
    let mut film = Film::new(camera);
    film.begin_episode(episode)?;
    let lanes = clip.programs.then(|| Lanes::new(episode, camera.size_px[0]));
    Ok(clip.times(episode).map(move |time_nanos| {
        let behind = episode.frames.partition_point(|frame| frame.time_nanos <= time_nanos);
        let drawn = film.draw(&episode.scene, &episode.frames[behind.max(1) - 1].state);
        let picture = Rgb { size_px: [drawn.width, drawn.height], bytes: drawn.rgb.clone() };
        match &lanes {
            Some(lanes) => lanes.below(picture, time_nanos),
            None => picture,
        }
    }))
}

/// Writes a video. Returns how many pictures there are, and their size.
///
/// # Errors
///
/// When a codec or the disk refuses; then there is no file.
pub fn write_mp4(path: &Path, episode: &Episode, camera: &CameraConfig, clip: &ClipConfig) -> Result<Clip, VideoError> {
    let size_px = clip.size_px(episode, camera);
    let mut encoder = H264Encoder::new(size_px, clip.fps)?;
    let mut file = Mp4Writer::create(path, size_px, clip.fps)?;
    let mut packet = Vec::new();
    for picture in pictures(episode, camera, clip)? {
        packet.clear();
        encoder.encode(&picture.bytes, false, &mut packet)?;
        file.write(&packet)?;
    }
    let n_pictures = file.n_samples();
    file.finish()?;
    Ok(Clip { size_px, n_pictures })
}

/// Writes moving pictures that repeat. Returns how many there are, and their size.
///
/// # Errors
///
/// As [`write_mp4`].
pub fn write_gif(path: &Path, episode: &Episode, camera: &CameraConfig, clip: &ClipConfig) -> Result<Clip, VideoError> {
    // The lanes' colours say which program it is.
    let exact = if clip.programs { Lanes::new(episode, camera.size_px[0]).colors() } else { BTreeSet::new() };
    let gif = encode_gif(pictures(episode, camera, clip)?, clip.fps, &exact)?;
    write(path, &gif)?;
    Ok(Clip { size_px: clip.size_px(episode, camera), n_pictures: clip.times(episode).count() as u64 })
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
