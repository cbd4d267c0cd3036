//! Pictures in messages: compressed ones, raw ones, and packets of H.264.

use super::decode::base64;
use super::map::Store;
use super::value::Value;
use crate::dataset::plain::Picture;
use crate::video::{H264Decoder, Rgb, decode_picture, is_key_frame, picture_size};
use crate::words::counted;

/// What a message shows.
#[derive(Clone, Debug)]
pub(super) enum Shown {
    Picture([u32; 2], Picture),
    /// A packet of H.264, and whether it can be shown without those before.
    Packet(Vec<u8>, bool),
}

/// Why a message shows nothing that can be used, in words.
pub(super) type Reason = String;

/// Whether a message has what a picture has.
pub(super) fn is_picture(value: &Value) -> bool {
    let has = |name| value.field(name).is_some();
    has("data") && (has("format") || (has("encoding") && has("width") && has("height")))
}

/// Takes what a message shows.
fn shown(value: &Value) -> Result<Shown, Reason> {
    let data = match value.field("data") {
        Some(Value::Bytes(bytes)) => bytes.clone(),
        // As JSON has them.
        Some(Value::Text(text)) => base64(text).ok_or("its data is no base64")?,
        _ => return Err("it has no data".to_owned()),
    };
    let word = |name: &str| value.field(name).and_then(Value::text).unwrap_or_default().to_lowercase();
    let format = word("format");
    if format.contains("h264") {
        let is_key = is_key_frame(&data);
        return Ok(Shown::Packet(data, is_key));
    }
    if value.field("encoding").is_some() {
        return raw(value, &word("encoding"), &data);
    }
    let size = picture_size(&data);
    let size = size.map_err(|error| format!("format is {format:?}; read are PNG, JPEG and h264 ({error})"))?;
    Ok(Shown::Picture(size, Picture::Encoded(data)))
}

/// A raw picture as red, green and blue.
fn raw(value: &Value, encoding: &str, data: &[u8]) -> Result<Shown, Reason> {
    let number = |name: &str| value.field(name).and_then(Value::whole).and_then(|number| u32::try_from(number).ok());
    let (width, height) = (number("width").unwrap_or_default(), number("height").unwrap_or_default());
    let (n_channels, order): (usize, [usize; 3]) = match encoding {
        "rgb8" | "8uc3" => (3, [0, 1, 2]),
        "bgr8" => (3, [2, 1, 0]),
        "rgba8" => (4, [0, 1, 2]),
        "bgra8" => (4, [2, 1, 0]),
        "mono8" | "8uc1" => (1, [0, 0, 0]),
        other => return Err(format!("encoding is {other:?}; read are rgb8, bgr8, rgba8, bgra8 and mono8")),
    };
    let row_bytes = width as usize * n_channels;
    let step = number("step").filter(|&step| step > 0).map_or(row_bytes, |step| step as usize);
    let n_bytes = step.saturating_mul(height as usize);
    if row_bytes == 0 || step < row_bytes || data.len() < n_bytes {
        return Err(format!("{} for {width}x{height} pixels of {encoding}", counted(data.len(), "byte")));
    }
    let mut rgb = Vec::with_capacity(3 * width as usize * height as usize);
    for row in data[..n_bytes].chunks_exact(step) {
        match order {
            [0, 1, 2] if n_channels == 3 => rgb.extend_from_slice(&row[..row_bytes]),
            _ => rgb.extend(row[..row_bytes].chunks_exact(n_channels).flat_map(|pixel| order.map(|at| pixel[at]))),
        }
    }
    Ok(Shown::Picture([width, height], Picture::Rgb([width, height], rgb)))
}

/// Takes the pictures of one topic, as they shall be stored.
pub(super) struct PictureTaker {
    store: Store,
    /// Of a video that shall be encoded again.
    decoder: Option<H264Decoder>,
    has_key: bool,
}

impl PictureTaker {
    pub(super) fn new(store: Store) -> Self {
        Self { store, decoder: None, has_key: false }
    }

    /// What a message shows: a packet only where packets are stored as they are, a picture in RGB where it shall be
    /// encoded here.
    pub(super) fn take(&mut self, value: &Value) -> Result<Shown, Reason> {
        match (shown(value)?, self.store) {
            (Shown::Packet(packet, is_key), Store::AsIs) => self.packet(packet, is_key),
            (Shown::Packet(packet, _), Store::Png | Store::H264) => self.decoded(&packet),
            (Shown::Picture(_, Picture::Encoded(bytes)), Store::H264) => {
                rgb(decode_picture(&bytes).map_err(|error| error.to_string())?)
            }
            (Shown::Picture(_, Picture::Encoded(bytes)), Store::Png) if bytes.starts_with(&[0xff, 0xd8]) => {
                rgb(decode_picture(&bytes).map_err(|error| error.to_string())?)
            }
            (shown, _) => Ok(shown),
        }
    }

    /// Packets before the first key frame cannot be shown.
    fn packet(&mut self, packet: Vec<u8>, is_key: bool) -> Result<Shown, Reason> {
        self.has_key |= is_key;
        if self.has_key { Ok(Shown::Packet(packet, is_key)) } else { Err("no key frame came before it".to_owned()) }
    }

    fn decoded(&mut self, packet: &[u8]) -> Result<Shown, Reason> {
        let decoder = match &mut self.decoder {
            Some(decoder) => decoder,
            none => none.insert(H264Decoder::new().map_err(|error| error.to_string())?),
        };
        let mut picture = Rgb::default();
        decoder.decode(packet, &mut picture).map_err(|error| error.to_string())?;
        rgb(picture)
    }
}

fn rgb(Rgb { size_px, bytes }: Rgb) -> Result<Shown, Reason> {
    Ok(Shown::Picture(size_px, Picture::Rgb(size_px, bytes)))
}

/// Width and height of a packet's picture; a key frame.
pub(super) fn packet_size(packet: &[u8]) -> Result<[u32; 2], Reason> {
    let mut picture = Rgb::default();
    let decoded = H264Decoder::new().and_then(|mut decoder| decoder.decode(packet, &mut picture));
    decoded.map_err(|error| error.to_string())?;
    Ok(picture.size_px)
}
