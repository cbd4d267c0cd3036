//! Videos of one feature: the packets of episodes put behind each other. Nothing is decoded where an episode begins at
//! a picture that can be shown by itself.
//!
//! Pictures are matched by time, as readers do, and never counted.

use std::path::{Path, PathBuf};

use crate::dataset::edit::EditError;
use crate::dataset::files::layout::FilePlace;
use crate::dataset::plain::VideoSpan;
use crate::video::{H264Encoder, Mp4Pictures, Mp4Reader, Mp4Remux, Mp4Writer, TrackSample, VideoError, VideoTrackFile};

/// How far a picture's time may be from its frame's: what LeRobot allows.
const TOLERANCE_SECS: f64 = 1e-4;

/// What to do with an episode that does not begin at a picture that can be shown by itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Carry {
    /// Refuse it.
    #[default]
    Packets,
    /// Decode its pictures, where they are in H.264, and encode them again.
    Reencode,
}

/// The files of one feature that are being written.
pub(super) struct VideoCarrier {
    root: PathBuf,
    feature: String,
    file_bytes: u64,
    carry: Carry,
    place: FilePlace,
    writer: Option<Mp4Remux>,
    /// Ticks that are used of the file.
    end: i64,
    files: Vec<String>,
    /// The file that was read last.
    source: Option<(PathBuf, VideoTrackFile)>,
}

/// An episode's pictures: the samples, and when the first is shown.
struct Cut {
    samples: std::ops::RangeInclusive<usize>,
    first_pts: i64,
}

impl VideoCarrier {
    pub(super) fn new(root: &Path, feature: &str, file_bytes: u64, carry: Carry) -> Self {
        Self {
            root: root.to_owned(),
            feature: feature.to_owned(),
            file_bytes,
            carry,
            place: FilePlace::default(),
            writer: None,
            end: 0,
            files: Vec::new(),
            source: None,
        }
    }

    pub(super) fn feature(&self) -> &str {
        &self.feature
    }

    /// Adds an episode of `length` frames; says where it is now.
    pub(super) fn append(
        &mut self,
        path: &Path,
        span: VideoSpan,
        length: u64,
        fps: f64,
    ) -> Result<VideoSpan, EditError> {
        if self.source.as_ref().is_none_or(|(open, _)| open != path) {
            self.source = Some((path.to_owned(), VideoTrackFile::open(path)?));
        }
        let Some((_, mut track)) = self.source.take() else { return Ok(span) };
        if track.has_other_tracks {
            let problem = "it has tracks beside the pictures, such as sound, which would be lost".to_owned();
            return Err(EditError::refused("edit.video", path, problem));
        }
        let placed = match cut(&track, span, length, fps) {
            Ok(cut) => self.write(&mut track, &cut, length, fps)?,
            Err(problem) if problem.is_missing => {
                return Err(EditError::refused("edit.video", path, format!("{}: {}", self.feature, problem.words)));
            }
            Err(problem) if self.carry == Carry::Packets => {
                let words = format!("{}: {}; --reencode encodes such episodes again", self.feature, problem.words);
                return Err(EditError::refused("edit.keyframe", path, words));
            }
            Err(_) => self.encode_again(path, &track, span, length, fps)?,
        };
        self.source = Some((path.to_owned(), track));
        Ok(placed)
    }

    /// Copies the samples of an episode.
    fn write(&mut self, track: &mut VideoTrackFile, cut: &Cut, length: u64, fps: f64) -> Result<VideoSpan, VideoError> {
        let samples = track.samples[cut.samples.clone()].to_vec();
        let earliest = samples.first().map_or(0, |first| first.dts - cut.first_pts);
        let fits = self.writer.as_ref().is_some_and(|writer| {
            writer.is_of(&track.description, track.timescale)
                && writer.n_bytes() < self.file_bytes
                && writer.is_behind(self.end.saturating_add(earliest))
        });
        if !fits {
            self.end_file()?;
        }
        let mut writer = match self.writer.take() {
            Some(writer) => writer,
            None => {
                let file = self.place.video(&self.feature);
                let path = self.root.join(&file);
                self.files.push(file);
                Mp4Remux::create(&path, &track.description, track.size_px, track.timescale)?
            }
        };
        let shift = self.end - cut.first_pts;
        let mut bytes = Vec::new();
        for sample in samples {
            track.read(sample, &mut bytes)?;
            let moved = TrackSample { dts: sample.dts + shift, pts: sample.pts + shift, ..sample };
            writer.write(moved, &bytes)?;
        }
        self.writer = Some(writer);
        let from_secs = track.secs(self.end);
        self.end += (length as f64 / fps * track.timescale as f64).round() as i64;
        Ok(VideoSpan { file: self.place, from_secs, to_secs: Some(track.secs(self.end)) })
    }

    /// Decodes an episode's pictures and encodes them as a video of their own, which is then copied.
    fn encode_again(
        &mut self,
        path: &Path,
        track: &VideoTrackFile,
        span: VideoSpan,
        length: u64,
        fps: f64,
    ) -> Result<VideoSpan, EditError> {
        let is_in_order = track.samples.windows(2).all(|pair| pair[0].pts <= pair[1].pts);
        if track.codec != "h264" || !is_in_order || fps.fract() != 0.0 {
            let problem = format!(
                "{}: only H.264 without pictures that are decoded out of turn, at a whole rate, is encoded again; it is {} at {fps}",
                self.feature, track.codec
            );
            return Err(EditError::refused("edit.video", path, problem));
        }
        let temporary = self.root.join(format!(".partial-{}.mp4", self.feature));
        let encoded = encode(path, track, span, length, fps, &temporary);
        let copied = encoded.and_then(|()| {
            let mut again = VideoTrackFile::open(&temporary)?;
            let all = Cut { samples: 0..=again.samples.len().saturating_sub(1), first_pts: 0 };
            self.write(&mut again, &all, length, fps)
        });
        // The error of what came before says more.
        let removed = std::fs::remove_file(&temporary);
        let placed = copied?;
        removed.map_err(crate::artifact::IoError::system("remove", &temporary))?;
        Ok(placed)
    }

    fn end_file(&mut self) -> Result<(), VideoError> {
        let end = std::mem::take(&mut self.end);
        let Some(writer) = self.writer.take() else { return Ok(()) };
        self.place = self.place.next();
        writer.finish(end)
    }

    /// Ends the last file. Returns all of them.
    pub(super) fn finish(mut self) -> Result<Vec<String>, VideoError> {
        self.end_file()?;
        Ok(self.files)
    }
}

/// Why an episode's pictures cannot be copied.
struct NoCut {
    words: String,
    /// A picture is not there at all.
    is_missing: bool,
}

/// The samples that an episode's frames need, if these can be decoded without others and show nothing else.
fn cut(track: &VideoTrackFile, span: VideoSpan, length: u64, fps: f64) -> Result<Cut, NoCut> {
    let (mut first, mut last) = (usize::MAX, 0);
    let mut first_pts = 0;
    for frame in 0..length {
        let secs = span.from_secs + frame as f64 / fps;
        let at = track.nearest(secs).filter(|&at| (track.secs(track.samples[at].pts) - secs).abs() <= TOLERANCE_SECS);
        let Some(at) = at else {
            let words = format!("frame {frame} has no picture at {secs:.6} s");
            return Err(NoCut { words, is_missing: true });
        };
        if frame == 0 {
            first_pts = track.samples[at].pts;
        }
        (first, last) = (first.min(at), last.max(at));
    }
    let samples = first..=last;
    let end = span.from_secs + length as f64 / fps - TOLERANCE_SECS;
    let is_inside = |sample: &TrackSample| sample.pts >= first_pts && track.secs(sample.pts) < end;
    let of_episode = track.samples.get(samples.clone()).unwrap_or_default();
    let begins_alone = of_episode.first().is_some_and(|sample| sample.is_key);
    if begins_alone && of_episode.iter().all(is_inside) {
        return Ok(Cut { samples, first_pts });
    }
    let words = if begins_alone {
        format!("pictures of another episode lie between those from {:.3} s on", span.from_secs)
    } else {
        format!("no key frame begins the episode at {:.3} s: its first picture needs those before", span.from_secs)
    };
    Err(NoCut { words, is_missing: false })
}

fn encode(
    path: &Path,
    track: &VideoTrackFile,
    span: VideoSpan,
    length: u64,
    fps: f64,
    to: &Path,
) -> Result<(), VideoError> {
    let mut reader = Mp4Reader::open(path)?;
    let size_px = reader.size_px();
    let mut pictures = Mp4Pictures::new(&mut reader)?;
    let mut encoder = H264Encoder::new(size_px, fps as u32)?;
    let mut writer = Mp4Writer::create(to, size_px, fps as u32)?;
    let mut packet = Vec::new();
    for frame in 0..length {
        let at = track.nearest(span.from_secs + frame as f64 / fps).unwrap_or(0);
        let picture = pictures.get(at)?;
        packet.clear();
        encoder.encode(&picture.bytes, frame == 0, &mut packet)?;
        writer.write(&packet)?;
    }
    writer.finish()
}
