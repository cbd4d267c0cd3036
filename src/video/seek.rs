//! Pictures of a video file by their numbers.

use crate::video::{H264Decoder, Mp4Reader, Rgb, VideoError};

/// Decodes any sample of a file. Going forward costs nothing that is not needed: from the sample before on, or from the
/// last key frame when that is nearer.
pub struct Mp4Pictures<'f> {
    file: &'f mut Mp4Reader,
    decoder: H264Decoder,
    /// The sample that the decoder can take next; `None` when only a key frame.
    next: Option<usize>,
    packet: Vec<u8>,
    picture: Rgb,
}

impl<'f> Mp4Pictures<'f> {
    /// Nothing is decoded yet.
    ///
    /// # Errors
    ///
    /// When the decoder cannot be made.
    pub fn new(file: &'f mut Mp4Reader) -> Result<Self, VideoError> {
        Ok(Self { file, decoder: H264Decoder::new()?, next: None, packet: Vec::new(), picture: Rgb::default() })
    }

    /// The picture of a sample.
    ///
    /// # Errors
    ///
    /// When there is no such sample, no key frame stands before it, or one from there on is damaged.
    pub fn get(&mut self, position: usize) -> Result<&Rgb, VideoError> {
        let from = self.decodable_from(position)?;
        // After an error only a key frame can be decoded.
        self.next = None;
        for sample in from..=position {
            self.file.read(sample, &mut self.packet)?;
            self.decoder.decode(&self.packet, &mut self.picture)?;
        }
        self.next = Some(position + 1);
        Ok(&self.picture)
    }

    /// The nearest sample from which the decoder gets to another.
    fn decodable_from(&self, position: usize) -> Result<usize, VideoError> {
        self.file.sample(position)?;
        let key = self.file.samples()[..=position].iter().rposition(|sample| sample.is_key);
        key.max(self.next.filter(|&next| next <= position)).ok_or(VideoError::NoPicture)
    }
}
