//! Pictures of a feature: encoded ones as they are, others as PNG.

use crate::dataset::pictures::{PictureMeasure, PictureStatistics};
use crate::video::{VideoError, encode_png, picture_size};

/// Of so many pictures one is decoded for the statistics, beginning with the first.
pub(super) const SAMPLED: u64 = 16;

/// One picture.
#[derive(Clone, Debug)]
pub(crate) enum Picture {
    /// PNG or JPEG.
    Encoded(Vec<u8>),
    /// Red, green, blue of each pixel, with width and height.
    Rgb([u32; 2], Vec<u8>),
}

impl Picture {
    pub(super) fn n_bytes(&self) -> usize {
        match self {
            Self::Encoded(bytes) | Self::Rgb(_, bytes) => bytes.len(),
        }
    }

    pub(super) fn encoded(&self) -> Result<Vec<u8>, VideoError> {
        match self {
            Self::Encoded(bytes) => Ok(bytes.clone()),
            Self::Rgb(size_px, bytes) => {
                let mut png = Vec::new();
                encode_png(bytes, *size_px, &mut png)?;
                Ok(png)
            }
        }
    }
}

/// Looks at every picture, and into some.
pub(super) struct PictureSample {
    size_px: [u32; 2],
    n_seen: u64,
    measure: PictureMeasure,
}

impl PictureSample {
    pub(super) fn new(size_px: [u32; 2]) -> Self {
        Self { size_px, n_seen: 0, measure: PictureMeasure::new(size_px) }
    }

    /// Holds a picture's size against the feature's.
    pub(super) fn look(&mut self, picture: &Picture) -> Result<(), VideoError> {
        let found = match picture {
            Picture::Encoded(bytes) => picture_size(bytes)?,
            Picture::Rgb(size_px, _) => *size_px,
        };
        let expected = self.size_px;
        if found != expected {
            return Err(VideoError::Size { found, expected });
        }
        let is_sampled = self.n_seen.is_multiple_of(SAMPLED);
        self.n_seen += 1;
        match picture {
            Picture::Encoded(bytes) if is_sampled => self.measure.add_encoded(bytes),
            Picture::Rgb(size_px, bytes) if is_sampled => self.measure.add_rgb(*size_px, bytes),
            _ => Ok(()),
        }
    }

    pub(super) fn statistics(&self) -> PictureStatistics {
        self.measure.statistics()
    }
}
