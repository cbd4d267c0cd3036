//! MP4 with one track of H.264 at a constant frame rate: written packet by packet, read sample by sample.

use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};

use muxide::api::{Muxer, MuxerBuilder, VideoCodec};
use re_mp4::StsdBoxContent;

use crate::artifact::{AtomicFile, IoError};
use crate::video::container::read_container;
use crate::video::{VideoError, is_key_frame};

/// A file on its way. Its pictures are kept in memory until it is finished.
pub struct Mp4Writer {
    muxer: Muxer<AtomicFile>,
    path: PathBuf,
    fps: u32,
    n_samples: u64,
    n_bytes: usize,
}

impl Mp4Writer {
    /// Begins a file.
    ///
    /// # Errors
    ///
    /// When the file cannot be made.
    pub fn create(path: &Path, [width, height]: [u32; 2], fps: u32) -> Result<Self, VideoError> {
        let builder = MuxerBuilder::new(AtomicFile::create(path)?);
        let builder = builder.video(VideoCodec::H264, width, height, f64::from(fps)).with_fast_start(false);
        let muxer = builder.build().map_err(|error| container(path, &error))?;
        Ok(Self { muxer, path: path.to_owned(), fps, n_samples: 0, n_bytes: 0 })
    }

    /// How many pictures there are: the next one is shown at this many over the frame rate.
    pub fn n_samples(&self) -> u64 {
        self.n_samples
    }

    /// Size of the pictures so far.
    pub fn n_bytes(&self) -> usize {
        self.n_bytes
    }

    /// Adds a packet in Annex B. The first one is a key frame.
    ///
    /// # Errors
    ///
    /// When the first one has no parameter sets.
    pub fn write(&mut self, packet: &[u8]) -> Result<(), VideoError> {
        self.write_at(self.n_samples as f64 / f64::from(self.fps), packet)
    }

    /// Adds a packet that is shown at a time of its own, in seconds from the file's beginning, behind those before.
    ///
    /// # Errors
    ///
    /// As [`Mp4Writer::write`], and when the time is not behind.
    pub fn write_at(&mut self, seconds: f64, packet: &[u8]) -> Result<(), VideoError> {
        let written = self.muxer.write_video(seconds, packet, is_key_frame(packet));
        written.map_err(|error| container(&self.path, &error))?;
        self.n_samples += 1;
        self.n_bytes += packet.len();
        Ok(())
    }

    /// Writes the file and gives it its name.
    ///
    /// # Errors
    ///
    /// When the disk is full or the name cannot be taken.
    pub fn finish(mut self) -> Result<(), VideoError> {
        self.muxer.finish_in_place().map_err(|error| container(&self.path, &error))?;
        Ok(self.muxer.into_writer().commit()?)
    }
}

fn container(path: &Path, message: &dyn std::fmt::Display) -> VideoError {
    VideoError::Container { path: path.to_owned(), message: message.to_string() }
}

/// Where a picture is in a file, and when it is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mp4Sample {
    /// In seconds from the file's beginning.
    pub seconds: f64,
    /// Whether it can be shown without those before.
    pub is_key: bool,
    /// Where in the file its bytes begin.
    pub offset: u64,
    len: u64,
}

/// A file being read: its list of samples, and a sample at a time.
pub struct Mp4Reader {
    path: PathBuf,
    file: File,
    samples: Vec<Mp4Sample>,
    size_px: [u32; 2],
    /// In Annex B, before each key frame.
    parameter_sets: Vec<u8>,
}

impl Mp4Reader {
    /// Reads the list of samples.
    ///
    /// # Errors
    ///
    /// When the file has not exactly one track of H.264.
    pub fn open(path: &Path) -> Result<Self, VideoError> {
        let (mp4, file, len) = read_container(path)?;
        let mut tracks = mp4.tracks().values();
        let (Some(track), None) = (tracks.next(), tracks.next()) else {
            return Err(container(path, &format!("{} tracks, expected one of video", mp4.tracks().len())));
        };
        let StsdBoxContent::Avc1(avc1) = &track.trak(&mp4).mdia.minf.stbl.stsd.contents else {
            return Err(container(path, &"the video is not H.264"));
        };
        let sets = avc1.avcc.sequence_parameter_sets.iter().chain(&avc1.avcc.picture_parameter_sets);
        let parameter_sets = sets.flat_map(|set| START_CODE.iter().copied().chain(set.bytes.iter().copied())).collect();
        let sample = |sample: &re_mp4::Sample| Mp4Sample {
            seconds: sample.composition_timestamp as f64 / sample.timescale.max(1) as f64,
            is_key: sample.is_sync,
            offset: sample.offset,
            len: sample.size,
        };
        let samples: Vec<Mp4Sample> = track.samples.iter().map(sample).collect();
        if samples.iter().any(|sample| sample.offset.checked_add(sample.len).is_none_or(|end| end > len)) {
            return Err(container(path, &"a picture lies behind the end of the file"));
        }
        let size_px = [u32::from(track.width), u32::from(track.height)];
        Ok(Self { path: path.to_owned(), file, samples, size_px, parameter_sets })
    }

    /// All samples in order.
    pub fn samples(&self) -> &[Mp4Sample] {
        &self.samples
    }

    /// One of them.
    ///
    /// # Errors
    ///
    /// When there are not so many.
    pub fn sample(&self, position: usize) -> Result<Mp4Sample, VideoError> {
        let count = self.samples.len();
        let sample = self.samples.get(position);
        sample.copied().ok_or_else(|| container(&self.path, &format!("no picture {position} of {count}")))
    }

    /// Width and height of the pictures.
    pub fn size_px(&self) -> [u32; 2] {
        self.size_px
    }

    /// What a decoder must know before the first picture, in Annex B.
    pub fn parameter_sets(&self) -> &[u8] {
        &self.parameter_sets
    }

    /// A sample as a packet in Annex B, which takes the place of what is in `packet`.
    ///
    /// # Errors
    ///
    /// When there is no such sample, or it is damaged.
    pub fn read(&mut self, position: usize, packet: &mut Vec<u8>) -> Result<(), VideoError> {
        let sample = self.sample(position)?;
        let mut bytes = vec![0; sample.len as usize];
        let io = |action| IoError::system(action, &self.path);
        self.file.seek(SeekFrom::Start(sample.offset)).map_err(io("read"))?;
        self.file.read_exact(&mut bytes).map_err(io("read"))?;
        packet.clear();
        // Some writers keep them in the pictures too.
        let has_sets = bytes.get(4).is_some_and(|header| header & 0x1f == PARAMETER_SET);
        if sample.is_key && !has_sets {
            packet.extend_from_slice(&self.parameter_sets);
        }
        let mut rest = bytes.as_slice();
        while let Some((length, behind)) = rest.split_first_chunk::<4>() {
            let unit = behind.get(..u32::from_be_bytes(*length) as usize);
            let unit = unit.ok_or_else(|| container(&self.path, &format!("picture {position} is cut off")))?;
            packet.extend_from_slice(&START_CODE);
            packet.extend_from_slice(unit);
            rest = &behind[unit.len()..];
        }
        Ok(())
    }
}

/// The kind of unit that is a sequence's parameter set.
const PARAMETER_SET: u8 = 7;
/// Before each unit of Annex B.
const START_CODE: [u8; 4] = [0, 0, 0, 1];
