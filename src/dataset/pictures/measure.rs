//! Decodes pictures for their statistics, and so that none is written that is damaged.

use crate::dataset::pictures::PictureStatistics;
use crate::dataset::pictures::statistics::Histogram;
use crate::video::{H264Decoder, Rgb, VideoError, decode_picture, decode_png};

/// What is known of pictures of one size.
#[derive(Debug, Default)]
pub(in crate::dataset) struct PictureMeasure {
    size_px: [u32; 2],
    histogram: Histogram,
    decoded: Rgb,
}

impl PictureMeasure {
    /// Of none yet; all must be of this width and height.
    pub(in crate::dataset) fn new(size_px: [u32; 2]) -> Self {
        Self { size_px, ..Self::default() }
    }

    /// Adds a picture in PNG.
    pub(in crate::dataset) fn add_png(&mut self, png: &[u8]) -> Result<(), VideoError> {
        self.decoded = decode_png(png)?;
        self.add_decoded()
    }

    /// Adds a picture in PNG or JPEG, of whatever colours.
    pub(in crate::dataset) fn add_encoded(&mut self, bytes: &[u8]) -> Result<(), VideoError> {
        self.decoded = decode_picture(bytes)?;
        self.add_decoded()
    }

    /// Adds a picture as it is: red, green, blue of each pixel.
    pub(in crate::dataset) fn add_rgb(&mut self, size_px: [u32; 2], bytes: &[u8]) -> Result<(), VideoError> {
        self.decoded.size_px = size_px;
        self.decoded.bytes.clear();
        self.decoded.bytes.extend_from_slice(bytes);
        self.add_decoded()
    }

    /// Adds the pictures of a video, a packet each, the first of which is a key frame.
    pub(in crate::dataset) fn add_video<'p>(
        &mut self,
        packets: impl IntoIterator<Item = &'p Vec<u8>>,
    ) -> Result<(), VideoError> {
        let mut decoder = H264Decoder::new()?;
        packets.into_iter().try_for_each(|packet| {
            decoder.decode(packet, &mut self.decoded)?;
            self.add_decoded()
        })
    }

    /// Adds what is known of others.
    pub(in crate::dataset) fn merge(&mut self, others: &Self) {
        self.histogram.merge(&others.histogram);
    }

    pub(in crate::dataset) fn statistics(&self) -> PictureStatistics {
        self.histogram.statistics()
    }

    fn add_decoded(&mut self) -> Result<(), VideoError> {
        let (found, expected) = (self.decoded.size_px, self.size_px);
        if found != expected {
            return Err(VideoError::Size { found, expected });
        }
        self.histogram.add(&self.decoded);
        Ok(())
    }
}
