//! H.264 by openh264, in Annex B: a packet a picture.

use openh264::OpenH264API;
use openh264::Timestamp;
use openh264::decoder::Decoder;
use openh264::encoder::{BitRate, Encoder, EncoderConfig, FrameRate, IntraFramePeriod, QpRange, RateControlMode};
use openh264::formats::{RgbSliceU8, YUVBuffer, YUVSource as _};

use crate::video::{Rgb, VideoError};
use crate::words::counted;

/// The steps of quantisation that the encoder may choose from: small, so that letters stay sharp.
const DRAWN: [u8; 2] = [16, 24];
/// The same of what a camera has seen, which is grain below this: about what x264 chooses by itself.
const FILMED: [u8; 2] = [24, 32];
/// More than any picture needs, so that the quality is what is held constant.
const MAX_BITS_PER_SEC: u32 = 50_000_000;
/// The most pictures from one key frame to the next.
const MAX_GROUP: u32 = 60;

/// Encodes the pictures of one video, all of one size.
pub struct H264Encoder {
    encoder: Encoder,
    yuv: YUVBuffer,
    size_px: [u32; 2],
    fps: u32,
    n_encoded: u64,
}

impl H264Encoder {
    /// Begins a video of drawn pictures; width and height are even.
    ///
    /// # Errors
    ///
    /// When the encoder cannot be made.
    pub fn new(size_px: [u32; 2], fps: u32) -> Result<Self, VideoError> {
        Self::with_steps(size_px, fps, DRAWN)
    }

    /// The same of pictures of a real camera, in less time and half the bytes.
    ///
    /// # Errors
    ///
    /// When the encoder cannot be made.
    pub fn of_camera(size_px: [u32; 2], fps: u32) -> Result<Self, VideoError> {
        Self::with_steps(size_px, fps, FILMED)
    }

    fn with_steps(size_px: [u32; 2], fps: u32, [least, most]: [u8; 2]) -> Result<Self, VideoError> {
        let config = EncoderConfig::new()
            .bitrate(BitRate::from_bps(MAX_BITS_PER_SEC))
            .max_frame_rate(FrameRate::from_hz(fps as f32))
            .rate_control_mode(RateControlMode::Quality)
            .qp(QpRange::new(least, most))
            // Never with so many bits; without it the encoder complains on stderr.
            .skip_frames(true)
            .scene_change_detect(false)
            .adaptive_quantization(false)
            .background_detection(false)
            .intra_frame_period(IntraFramePeriod::from_num_frames(MAX_GROUP))
            .num_threads(1);
        let encoder = Encoder::with_api_config(OpenH264API::from_source(), config);
        let encoder = encoder.map_err(|error| VideoError::codec("begin", "H.264")(&error))?;
        let [width, height] = size_px.map(|side| (side as usize).next_multiple_of(2));
        Ok(Self { encoder, yuv: YUVBuffer::new(width, height), size_px, fps, n_encoded: 0 })
    }

    /// The next picture's packet, appended to `packet`. A key frame can be shown without those before.
    ///
    /// # Errors
    ///
    /// When the bytes are not as many as the size says, or the encoder fails.
    pub fn encode(&mut self, rgb: &[u8], is_key: bool, packet: &mut Vec<u8>) -> Result<(), VideoError> {
        let failed = VideoError::codec("encode", "H.264");
        let [width, height] = self.size_px.map(|side| side as usize);
        if rgb.len() != 3 * width * height || width % 2 + height % 2 > 0 {
            return Err(failed(&format!("{} for {width}x{height} pixels", counted(rgb.len(), "byte"))));
        }
        self.yuv.read_rgb8(RgbSliceU8::new(rgb, (width, height)));
        if is_key && self.n_encoded > 0 {
            self.encoder.force_intra_frame();
        }
        let millis = self.n_encoded * 1000 / u64::from(self.fps.max(1));
        let encoded = self.encoder.encode_at(&self.yuv, Timestamp::from_millis(millis));
        let before = packet.len();
        encoded.map_err(|error| failed(&error))?.write_vec(packet);
        if packet.len() == before {
            return Err(failed(&"the encoder skipped a picture"));
        }
        self.n_encoded += 1;
        Ok(())
    }
}

/// Decodes the packets of one video.
pub struct H264Decoder {
    decoder: Decoder,
}

impl H264Decoder {
    /// Begins; the first packet must be a key frame.
    ///
    /// # Errors
    ///
    /// When the decoder cannot be made.
    pub fn new() -> Result<Self, VideoError> {
        let decoder = Decoder::new().map_err(|error| VideoError::codec("begin decoding", "H.264")(&error))?;
        Ok(Self { decoder })
    }

    /// The picture of the next packet, into `picture`.
    ///
    /// # Errors
    ///
    /// When the packet is damaged, or holds no whole picture.
    pub fn decode(&mut self, packet: &[u8], picture: &mut Rgb) -> Result<(), VideoError> {
        let decoded = self.decoder.decode(packet).map_err(|error| VideoError::codec("decode", "H.264")(&error))?;
        let yuv = decoded.ok_or(VideoError::NoPicture)?;
        let (width, height) = yuv.dimensions();
        picture.size_px = [width as u32, height as u32];
        picture.bytes.resize(3 * width * height, 0);
        yuv.write_rgb8(&mut picture.bytes);
        Ok(())
    }
}

/// Whether a packet in Annex B holds a key frame.
pub fn is_key_frame(packet: &[u8]) -> bool {
    packet.windows(4).any(|bytes| bytes[..3] == [0, 0, 1] && bytes[3] & 0x1f == 5)
}
