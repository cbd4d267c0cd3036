//! A video track of an MP4 file in whatever codec: its samples by the times at which they are shown. Nothing is decoded.
//!
//! # Units
//!
//! Times are whole ticks of `timescale` a second, as readers reckon them: with composition offsets and the edit list.

use std::fs::File;
use std::io::{BufReader, Read as _, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};

use re_mp4::{StsdBoxContent, TrakBox};

use crate::artifact::IoError;
use crate::video::VideoError;
use crate::video::container::read_container;

/// Boxes whose tables are read are no larger than this: the list of a video of a week.
const MAX_BOX_BYTES: u64 = 1 << 30;

/// A picture of a track, encoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrackSample {
    /// When it is decoded, in ticks.
    pub dts: i64,
    /// When it is shown, in ticks.
    pub pts: i64,
    /// For how many ticks.
    pub duration: u64,
    /// Whether it can be decoded without those before.
    pub is_key: bool,
    /// Where in the file its bytes begin.
    pub offset: u64,
    /// How many bytes.
    pub len: u64,
}

/// A file with one video track.
pub struct VideoTrackFile {
    path: PathBuf,
    file: File,
    /// As `meta/info.json` of datasets names it: `h264`, `hevc`, `av1`, `vp9`, or the four letters of the container.
    pub codec: String,
    /// Width and height.
    pub size_px: [u32; 2],
    /// Ticks a second.
    pub timescale: u64,
    /// In the order of decoding.
    pub samples: Vec<TrackSample>,
    /// Positions of the samples, in the order of being shown.
    shown: Vec<usize>,
    /// Whether there are other tracks, such as sound.
    pub has_other_tracks: bool,
    /// What a decoder must know: the box `stsd` as it is.
    pub description: Vec<u8>,
}

impl VideoTrackFile {
    /// Reads the list of samples.
    ///
    /// # Errors
    ///
    /// When the file is no MP4 with exactly one track of video, or its tables contradict each other.
    pub fn open(path: &Path) -> Result<Self, VideoError> {
        let wrong = |message: &dyn std::fmt::Display| VideoError::Container {
            path: path.to_owned(),
            message: message.to_string(),
        };
        let (mp4, file, len) = read_container(path)?;
        let is_video = |trak: &&TrakBox| trak.mdia.hdlr.handler_type.value == *b"vide";
        let mut traks = mp4.moov.traks.iter().filter(is_video);
        let (Some(trak), None) = (traks.next(), traks.next()) else {
            return Err(wrong(&"it has not exactly one track of video"));
        };
        let track = mp4.tracks().get(&trak.tkhd.track_id).ok_or_else(|| wrong(&"its track has no samples"))?;
        let shift = presentation_shift(trak, track, mp4.moov.mvhd.timescale).map_err(|problem| wrong(&problem))?;
        let sample = |of: &re_mp4::Sample| TrackSample {
            dts: of.decode_timestamp.saturating_add(shift),
            pts: of.composition_timestamp.saturating_add(shift),
            duration: of.duration,
            is_key: of.is_sync,
            offset: of.offset,
            len: of.size,
        };
        let samples: Vec<TrackSample> = track.samples.iter().map(sample).collect();
        if samples.iter().any(|sample| sample.offset.checked_add(sample.len).is_none_or(|end| end > len)) {
            return Err(wrong(&"a picture lies behind the end of the file"));
        }
        let mut shown: Vec<usize> = (0..samples.len()).collect();
        shown.sort_by_key(|&at| samples[at].pts);
        Ok(Self {
            path: path.to_owned(),
            codec: codec(trak),
            size_px: [u32::from(track.width), u32::from(track.height)],
            timescale: track.timescale.max(1),
            samples,
            shown,
            has_other_tracks: mp4.moov.traks.len() > 1,
            description: description(&file, len).map_err(IoError::system("read", path))?.unwrap_or_default(),
            file,
        })
    }

    /// Seconds of a number of ticks.
    pub fn secs(&self, ticks: i64) -> f64 {
        ticks as f64 / self.timescale as f64
    }

    /// The sample that is shown nearest to a time, by position in `samples`.
    pub fn nearest(&self, secs: f64) -> Option<usize> {
        let behind = self.shown.partition_point(|&at| self.secs(self.samples[at].pts) < secs);
        let near = [behind.checked_sub(1), Some(behind)].into_iter().flatten().filter_map(|at| self.shown.get(at));
        let distance = |at: usize| (self.secs(self.samples[at].pts) - secs).abs();
        near.copied().min_by(|&a, &b| distance(a).total_cmp(&distance(b)))
    }

    /// When the last picture is no longer shown, in seconds.
    pub fn end_secs(&self) -> f64 {
        let ends = self.samples.iter().map(|of| of.pts.saturating_add(of.duration.min(1 << 40) as i64));
        ends.max().map_or(0.0, |end| self.secs(end))
    }

    /// The bytes of a sample as they lie in the file.
    ///
    /// # Errors
    ///
    /// When the file cannot be read.
    pub fn read(&mut self, sample: TrackSample, bytes: &mut Vec<u8>) -> Result<(), VideoError> {
        bytes.resize(sample.len as usize, 0);
        self.file.seek(SeekFrom::Start(sample.offset)).map_err(IoError::system("read", &self.path))?;
        Ok(self.file.read_exact(bytes).map_err(IoError::system("read", &self.path))?)
    }
}

/// The name of the codec.
fn codec(trak: &TrakBox) -> String {
    match &trak.mdia.minf.stbl.stsd.contents {
        StsdBoxContent::Av01(_) => "av1".to_owned(),
        StsdBoxContent::Avc1(_) => "h264".to_owned(),
        StsdBoxContent::Hvc1(_) | StsdBoxContent::Hev1(_) => "hevc".to_owned(),
        StsdBoxContent::Vp08(_) => "vp8".to_owned(),
        StsdBoxContent::Vp09(_) => "vp9".to_owned(),
        StsdBoxContent::Unknown(letters) => String::from_utf8_lossy(&letters.value).into_owned(),
        _ => "no video".to_owned(),
    }
}

/// Ticks from the library's times, of which the least is 0, to those that readers have: raw times less the beginning of
/// the edit, later by what is empty before it.
fn presentation_shift(trak: &TrakBox, track: &re_mp4::Track, movie_timescale: u32) -> Result<i64, String> {
    let raw_min = track.samples.first().map_or(0, |first| first.decode_timestamp.saturating_neg()).max(0);
    let Some(list) = trak.edts.as_ref().and_then(|edts| edts.elst.as_ref()) else { return Ok(raw_min) };
    let is_empty = |media_time: u64| media_time == u64::MAX || media_time == u64::from(u32::MAX);
    let (mut empty, mut begin) = (0_i64, None);
    for entry in &list.entries {
        if is_empty(entry.media_time) && begin.is_none() {
            let ticks = i128::from(entry.segment_duration) * i128::from(track.timescale);
            let ticks = i64::try_from(ticks / i128::from(movie_timescale.max(1)));
            empty = empty.saturating_add(ticks.map_err(|_error| "its edit list has a gap without end".to_owned())?);
        } else if begin.is_none() {
            begin = Some(i64::try_from(entry.media_time).map_err(|_error| "its edit begins behind all".to_owned())?);
        } else {
            return Err("its edit list has several parts: such a video is put together when it is played".to_owned());
        }
    }
    Ok(raw_min.saturating_sub(begin.unwrap_or(0)).saturating_add(empty))
}

/// The box `stsd` of the video track, without what stands before it.
fn description(file: &File, len: u64) -> std::io::Result<Option<Vec<u8>>> {
    let mut reader = BufReader::new(file);
    let mut at = 0;
    while at + 8 <= len {
        let (kind, head, size) = box_head(&mut reader, at, len)?;
        if kind == *b"moov" && size <= MAX_BOX_BYTES {
            let mut moov = vec![0; (size - head) as usize];
            reader.seek(SeekFrom::Start(at + head))?;
            reader.read_exact(&mut moov)?;
            return Ok(video_description(&moov).map(<[u8]>::to_vec));
        }
        at += size;
    }
    Ok(None)
}

/// Kind, length of the head, and length of a box in a file.
fn box_head(reader: &mut BufReader<&File>, at: u64, len: u64) -> std::io::Result<([u8; 4], u64, u64)> {
    let mut head = [0; 16];
    reader.seek(SeekFrom::Start(at))?;
    let n_read = (len - at).min(16) as usize;
    reader.read_exact(&mut head[..n_read])?;
    let [a, b, c, d, kind @ ..] = *head.first_chunk::<8>().unwrap_or(&[0; 8]);
    let long = head[8..].first_chunk::<8>().map_or(0, |bytes| u64::from_be_bytes(*bytes));
    let (head_len, size) = match u32::from_be_bytes([a, b, c, d]) {
        0 => (8, len - at),
        1 => (16, long),
        size => (8, u64::from(size)),
    };
    Ok((kind, head_len, size.clamp(head_len, len - at)))
}

/// The `stsd` of the track whose handler is of video.
fn video_description(moov: &[u8]) -> Option<&[u8]> {
    boxes(moov).filter(|(kind, _)| kind == b"trak").find_map(|(_, trak)| {
        let mdia = inside(trak, b"mdia")?;
        let handler = inside(mdia, b"hdlr")?;
        (handler.get(8..12)? == b"vide").then_some(())?;
        inside(inside(inside(mdia, b"minf")?, b"stbl")?, b"stsd")
    })
}

fn inside<'b>(of: &'b [u8], wanted: &[u8; 4]) -> Option<&'b [u8]> {
    boxes(of).find(|(kind, _)| kind == wanted).map(|(_, content)| content)
}

/// The boxes one after another: kind and content.
fn boxes(bytes: &[u8]) -> impl Iterator<Item = ([u8; 4], &[u8])> {
    let mut rest = bytes;
    std::iter::from_fn(move || {
        let size = u32::from_be_bytes(*rest.first_chunk::<4>()?) as usize;
        let kind = *rest.get(4..8)?.first_chunk::<4>()?;
        let content = rest.get(8..size.max(8).min(rest.len()))?;
        rest = rest.get(size.max(8)..).unwrap_or(&[]);
        Some((kind, content))
    })
}
