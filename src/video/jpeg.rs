//! JPEG: small pictures for pages. They lose a little; nothing is learned from them.

use image::ExtendedColorType;
use image::codecs::jpeg::JpegEncoder;

use crate::video::{Rgb, VideoError};
use crate::words::counted;

/// From 1 to 100. At 82 no blocks show in flat colours.
const QUALITY: u8 = 82;

/// A picture as JPEG.
///
/// # Errors
///
/// When the bytes are not as many as the size says, or a side is longer than JPEG's 65535 pixels.
pub fn encode_jpeg(picture: &Rgb) -> Result<Vec<u8>, VideoError> {
    let failed = VideoError::codec("encode", "JPEG");
    let [width, height] = picture.size_px;
    if picture.bytes.len() as u64 != 3 * u64::from(width) * u64::from(height) {
        return Err(failed(&format!("{} for {width}x{height} pixels", counted(picture.bytes.len(), "byte"))));
    }
    let mut jpeg = Vec::new();
    let mut encoder = JpegEncoder::new_with_quality(&mut jpeg, QUALITY);
    encoder.encode(&picture.bytes, width, height, ExtendedColorType::Rgb8).map_err(|error| failed(&error))?;
    Ok(jpeg)
}
