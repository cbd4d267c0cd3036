//! Pictures of others: PNG or JPEG, told by their first bytes.

use std::io::Cursor;

use image::codecs::jpeg::JpegDecoder;
use image::codecs::png::PngDecoder;
use image::{DynamicImage, ImageDecoder, ImageResult};

use crate::video::{Rgb, VideoError};

const PNG: [u8; 8] = *b"\x89PNG\r\n\x1a\n";
const JPEG: [u8; 2] = [0xff, 0xd8];
/// The widest and highest picture that is decoded.
const MAX_SIDE_PX: u32 = 1 << 14;

/// Width and height of a picture in PNG or JPEG. Only its head is read.
///
/// # Errors
///
/// When it is neither, or its head is damaged.
pub fn picture_size(bytes: &[u8]) -> Result<[u32; 2], VideoError> {
    let failed = |error: &dyn std::fmt::Display| VideoError::codec("read the head of", "a picture")(error);
    let size = |(width, height): (u32, u32)| [width, height];
    if bytes.starts_with(&PNG) {
        PngDecoder::new(Cursor::new(bytes)).map(|decoder| size(decoder.dimensions())).map_err(|error| failed(&error))
    } else if bytes.starts_with(&JPEG) {
        JpegDecoder::new(Cursor::new(bytes)).map(|decoder| size(decoder.dimensions())).map_err(|error| failed(&error))
    } else {
        Err(failed(&"it is neither PNG nor JPEG"))
    }
}

/// Whether bytes begin as a picture of any form, of which PNG and JPEG alone are decoded here.
pub fn is_picture(bytes: &[u8]) -> bool {
    image::guess_format(bytes).is_ok()
}

/// A picture in PNG or JPEG, of whatever colours, as red, green and blue.
///
/// # Errors
///
/// When it is neither, too large, or damaged.
pub fn decode_picture(bytes: &[u8]) -> Result<Rgb, VideoError> {
    let failed = |error: &dyn std::fmt::Display| VideoError::codec("decode", "a picture")(error);
    let [width, height] = picture_size(bytes)?;
    if width.max(height) > MAX_SIDE_PX {
        return Err(failed(&format!("{width}x{height} pixels are too many")));
    }
    let decoded = match bytes.starts_with(&PNG) {
        true => decode(PngDecoder::new(Cursor::new(bytes))),
        false => decode(JpegDecoder::new(Cursor::new(bytes))),
    };
    let rgb = decoded.map_err(|error| failed(&error))?.into_rgb8();
    Ok(Rgb { size_px: [width, height], bytes: rgb.into_raw() })
}

fn decode(decoder: ImageResult<impl ImageDecoder>) -> ImageResult<DynamicImage> {
    DynamicImage::from_decoder(decoder?)
}
