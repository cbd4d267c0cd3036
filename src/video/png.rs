//! PNG: fast to write, without loss.

use image::codecs::png::{CompressionType, FilterType, PngDecoder, PngEncoder};
use image::{ColorType, ExtendedColorType, ImageDecoder as _, ImageEncoder as _};

use crate::video::VideoError;
use crate::words::counted;

/// A picture: red, green, blue of each pixel, `[height, width, 3]`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Rgb {
    /// Width and height in pixels.
    pub size_px: [u32; 2],
    /// The bytes.
    pub bytes: Vec<u8>,
}

impl Rgb {
    /// Refuses a picture of another size.
    pub(crate) fn check_size(&self, expected: [u32; 2]) -> Result<(), VideoError> {
        let found = self.size_px;
        if found == expected { Ok(()) } else { Err(VideoError::Size { found, expected }) }
    }
}

/// The widest and highest picture that is decoded.
const MAX_SIDE_PX: u32 = 1 << 14;

/// A picture as PNG, appended to `png`.
///
/// # Errors
///
/// When the bytes are not as many as the size says.
pub fn encode_png(rgb: &[u8], [width, height]: [u32; 2], png: &mut Vec<u8>) -> Result<(), VideoError> {
    if rgb.len() != width as usize * height as usize * 3 {
        let message = format!("{} for {width}x{height} pixels", counted(rgb.len(), "byte"));
        return Err(VideoError::codec("encode", "PNG")(&message));
    }
    let encoder = PngEncoder::new_with_quality(png, CompressionType::Fast, FilterType::Up);
    let written = encoder.write_image(rgb, width, height, ExtendedColorType::Rgb8);
    written.map_err(|error| VideoError::codec("encode", "PNG")(&error))
}

/// Grey of 8 bits.
///
/// # Errors
///
/// When the values are not as many as the size says.
pub(super) fn encode_grey_8(values: &[u8], size_px: [u32; 2]) -> Result<Vec<u8>, VideoError> {
    encode_grey(values, size_px, ExtendedColorType::L8)
}

/// Grey of 16 bits.
///
/// # Errors
///
/// As [`encode_grey_8`].
pub(super) fn encode_grey_16(values: &[u16], size_px: [u32; 2]) -> Result<Vec<u8>, VideoError> {
    let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_ne_bytes()).collect();
    encode_grey(&bytes, size_px, ExtendedColorType::L16)
}

fn encode_grey(bytes: &[u8], [width, height]: [u32; 2], color: ExtendedColorType) -> Result<Vec<u8>, VideoError> {
    let failed = VideoError::codec("encode", "PNG");
    let expected = u64::from(width) * u64::from(height) * u64::from(color.bits_per_pixel() / 8);
    if bytes.len() as u64 != expected {
        return Err(failed(&format!("{} for {width}x{height} pixels of {color:?}", counted(bytes.len(), "byte"))));
    }
    let mut png = Vec::new();
    let encoder = PngEncoder::new_with_quality(&mut png, CompressionType::Fast, FilterType::Up);
    encoder.write_image(bytes, width, height, color).map_err(|error| failed(&error))?;
    Ok(png)
}

/// A picture from PNG.
///
/// # Errors
///
/// When it is no PNG of red, green and blue bytes.
pub fn decode_png(png: &[u8]) -> Result<Rgb, VideoError> {
    let failed = VideoError::codec("decode", "PNG");
    let decoder = PngDecoder::new(std::io::Cursor::new(png)).map_err(|error| failed(&error))?;
    let (width, height) = decoder.dimensions();
    if decoder.color_type() != ColorType::Rgb8 || width.max(height) > MAX_SIDE_PX {
        return Err(failed(&format!("{:?} of {width}x{height} pixels, expected Rgb8", decoder.color_type())));
    }
    let mut bytes = vec![0; width as usize * height as usize * 3];
    decoder.read_image(&mut bytes).map_err(|error| failed(&error))?;
    Ok(Rgb { size_px: [width, height], bytes })
}
