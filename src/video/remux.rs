//! MP4 written sample by sample, in whatever codec: nothing is encoded, and the description of the codec is taken over.
//!
//! # Source
//!
//! ISO/IEC 14496-12: the boxes that a file with one track of video needs, in the order in which ffmpeg writes them.

use std::io::{BufWriter, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

use crate::artifact::{AtomicFile, IoError};
use crate::video::{TrackSample, VideoError};

/// Where the pictures begin: behind `ftyp` (32 bytes) and the long head of `mdat`.
const DATA_BEGIN: u64 = 48;
const FILE_TYPE: &[u8; 32] = b"\0\0\0\x20ftypisom\0\0\x02\0isomiso2avc1mp41";
/// The unity matrix of `mvhd` and `tkhd`.
const MATRIX: [u32; 9] = [1 << 16, 0, 0, 0, 1 << 16, 0, 0, 0, 1 << 30];

/// A file on its way. Pictures go to the disk, memory holds the list of samples.
pub struct Mp4Remux {
    path: PathBuf,
    file: BufWriter<AtomicFile>,
    description: Vec<u8>,
    size_px: [u32; 2],
    timescale: u64,
    /// With times of the new file.
    samples: Vec<TrackSample>,
    n_bytes: u64,
}

impl Mp4Remux {
    /// Begins a file of a codec's description (the box `stsd`), size and ticks a second.
    ///
    /// # Errors
    ///
    /// When the file cannot be made.
    pub fn create(path: &Path, description: &[u8], size_px: [u32; 2], timescale: u64) -> Result<Self, VideoError> {
        let mut file = BufWriter::with_capacity(1 << 20, AtomicFile::create(path)?);
        let head = [FILE_TYPE.as_slice(), b"\0\0\0\x01mdat", &[0; 8]].concat();
        file.write_all(&head).map_err(IoError::system("write", path))?;
        let (path, description) = (path.to_owned(), description.to_vec());
        Ok(Self { path, file, description, size_px, timescale, samples: Vec::new(), n_bytes: 0 })
    }

    /// What was given to [`Mp4Remux::create`].
    pub fn is_of(&self, description: &[u8], timescale: u64) -> bool {
        self.description == description && self.timescale == timescale
    }

    /// Size of the pictures so far.
    pub fn n_bytes(&self) -> u64 {
        self.n_bytes
    }

    /// Whether a sample to be decoded at this tick comes behind those before.
    pub fn is_behind(&self, dts: i64) -> bool {
        self.samples.last().is_none_or(|last| dts > last.dts)
    }

    /// Adds a sample; its offset is where it comes to lie.
    ///
    /// # Errors
    ///
    /// When the disk is full.
    pub fn write(&mut self, sample: TrackSample, bytes: &[u8]) -> Result<(), VideoError> {
        self.file.write_all(bytes).map_err(IoError::system("write", &self.path))?;
        self.samples.push(TrackSample { offset: DATA_BEGIN + self.n_bytes, len: bytes.len() as u64, ..sample });
        self.n_bytes += bytes.len() as u64;
        Ok(())
    }

    /// Writes the tables and gives the file its name. The last picture is shown until `end`, in ticks.
    ///
    /// # Errors
    ///
    /// When the disk is full or the name cannot be taken.
    pub fn finish(mut self, end: i64) -> Result<(), VideoError> {
        let moov = self.movie(end);
        let failed = || IoError::system("write", &self.path);
        self.file.write_all(&moov).map_err(failed())?;
        self.file.seek(SeekFrom::Start(40)).map_err(failed())?;
        self.file.write_all(&(self.n_bytes + 16).to_be_bytes()).map_err(failed())?;
        let file = self.file.into_inner();
        let file = file.map_err(|error| IoError::system("write", &self.path)(error.into_error()))?;
        Ok(file.commit()?)
    }

    fn movie(&self, end: i64) -> Vec<u8> {
        let first_dts = self.samples.first().map_or(0, |first| first.dts);
        let duration = end.max(0) as u64;
        let [width, height] = self.size_px;
        let movie = full(
            1,
            0,
            &[
                &[0; 16],
                &be32(self.timescale),
                &duration.to_be_bytes(),
                &be32(1 << 16),
                &[1, 0],
                &[0; 10],
                &matrix(),
                &[0; 24],
                &be32(2),
            ],
        );
        let track = full(
            1,
            3,
            &[
                &[0; 16],
                &be32(1),
                &[0; 4],
                &duration.to_be_bytes(),
                &[0; 8],
                &[0; 8],
                &matrix(),
                &be32(u64::from(width) << 16),
                &be32(u64::from(height) << 16),
            ],
        );
        // The first picture is shown at tick 0 of the movie, however long before it is decoded.
        let edit = full(
            1,
            0,
            &[&be32(1), &duration.to_be_bytes(), &first_dts.saturating_neg().max(0).to_be_bytes(), &be32(1 << 16)],
        );
        let media = full(1, 0, &[&[0; 16], &be32(self.timescale), &duration.to_be_bytes(), b"\x55\xc4\0\0"]);
        let handler = full(0, 0, &[&[0; 4], b"vide", &[0; 12], b"VideoHandler\0"]);
        let data =
            boxed(b"dinf", &[&boxed(b"dref", &[&full(0, 0, &[&be32(1), &boxed(b"url ", &[&full(0, 1, &[])])])])]);
        let tables = self.tables(end);
        let information =
            boxed(b"minf", &[&boxed(b"vmhd", &[&full(0, 1, &[&[0; 8]])]), &data, &boxed(b"stbl", &[&tables])]);
        let media = boxed(b"mdia", &[&boxed(b"mdhd", &[&media]), &boxed(b"hdlr", &[&handler]), &information]);
        let edits = boxed(b"edts", &[&boxed(b"elst", &[&edit])]);
        let trak = boxed(b"trak", &[&boxed(b"tkhd", &[&track]), &edits, &media]);
        boxed(b"moov", &[&boxed(b"mvhd", &[&movie]), &trak])
    }

    /// The tables of samples.
    fn tables(&self, end: i64) -> Vec<u8> {
        let samples = &self.samples;
        let next = |at: usize| samples.get(at + 1).map_or(end.max(samples[at].dts + 1), |next| next.dts);
        let durations = runs((0..samples.len()).map(|at| (next(at) - samples[at].dts).max(0) as u32));
        let offsets = runs(samples.iter().map(|sample| (sample.pts - sample.dts) as i32 as u32));
        let keys: Vec<u32> = (1..).zip(samples).filter(|(_, sample)| sample.is_key).map(|(number, _)| number).collect();
        let numbers = |numbers: &[u32]| numbers.iter().flat_map(|number| number.to_be_bytes()).collect::<Vec<u8>>();
        let pairs = |runs: &[(u32, u32)]| numbers(&runs.iter().flat_map(|&(n, value)| [n, value]).collect::<Vec<_>>());
        let count = |n: usize| be32(n as u64);
        let mut tables = boxed(b"stsd", &[&self.description]);
        tables.extend(boxed(b"stts", &[&full(0, 0, &[&count(durations.len()), &pairs(&durations)])]));
        if offsets.iter().any(|&(_, offset)| offset > 0) {
            let is_signed = samples.iter().any(|sample| sample.pts < sample.dts);
            tables.extend(boxed(b"ctts", &[&full(u8::from(is_signed), 0, &[&count(offsets.len()), &pairs(&offsets)])]));
        }
        if keys.len() < samples.len() {
            tables.extend(boxed(b"stss", &[&full(0, 0, &[&count(keys.len()), &numbers(&keys)])]));
        }
        // All samples lie in one chunk, one behind the other.
        let chunk = numbers(&[1, 1, samples.len() as u32, 1]);
        tables.extend(boxed(b"stsc", &[&full(0, 0, &[&chunk])]));
        let sizes = numbers(&samples.iter().map(|sample| sample.len as u32).collect::<Vec<_>>());
        tables.extend(boxed(b"stsz", &[&full(0, 0, &[&[0; 4], &count(samples.len()), &sizes])]));
        tables.extend(boxed(b"co64", &[&full(0, 0, &[&be32(1), &DATA_BEGIN.to_be_bytes()])]));
        tables
    }
}

fn be32(number: u64) -> [u8; 4] {
    (number as u32).to_be_bytes()
}

fn matrix() -> Vec<u8> {
    MATRIX.iter().flat_map(|number| number.to_be_bytes()).collect()
}

/// Version, flags and parts of a box.
fn full(version: u8, flags: u8, parts: &[&[u8]]) -> Vec<u8> {
    [&[version, 0, 0, flags], parts.concat().as_slice()].concat()
}

fn boxed(kind: &[u8; 4], parts: &[&[u8]]) -> Vec<u8> {
    let content = parts.concat();
    [be32(content.len() as u64 + 8).as_slice(), kind, &content].concat()
}

/// Numbers as runs: how often, and which.
fn runs(numbers: impl Iterator<Item = u32>) -> Vec<(u32, u32)> {
    let mut runs: Vec<(u32, u32)> = Vec::new();
    for number in numbers {
        match runs.last_mut() {
            Some((n, last)) if *last == number => *n += 1,
            _ => runs.push((1, number)),
        }
    }
    runs
}
