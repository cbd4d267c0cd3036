//! GIF: moving pictures for pages that show no video.

use image::codecs::gif::{GifEncoder, Repeat};
use image::{Delay, Frame, RgbaImage};

use crate::video::{Rgb, VideoError};

/// Pictures as a GIF that repeats, `fps` a second.
///
/// # Errors
///
/// When a picture's bytes are not as many as its size says.
pub fn encode_gif(pictures: impl Iterator<Item = Rgb>, fps: u32) -> Result<Vec<u8>, VideoError> {
    let failed = VideoError::codec("encode", "GIF");
    let mut gif = Vec::new();
    let mut encoder = GifEncoder::new_with_speed(&mut gif, 10);
    encoder.set_repeat(Repeat::Infinite).map_err(|error| failed(&error))?;
    for Rgb { size_px: [width, height], bytes } in pictures {
        let rgba = bytes.chunks_exact(3).flat_map(|pixel| [pixel[0], pixel[1], pixel[2], 255]).collect();
        let picture = RgbaImage::from_raw(width, height, rgba).ok_or_else(|| failed(&"wrong number of bytes"))?;
        let delay = Delay::from_numer_denom_ms(1000, fps.max(1));
        encoder.encode_frame(Frame::from_parts(picture, 0, 0, delay)).map_err(|error| failed(&error))?;
    }
    drop(encoder);
    Ok(gif)
}
