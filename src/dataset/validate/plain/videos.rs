//! Video files: each episode's pictures are there at the times of its frames, of the declared size, codec and place.

use std::collections::BTreeMap;
use std::path::Path;

use crate::dataset::files::finding::Validation;
use crate::dataset::files::layout::FilePlace;
use crate::dataset::plain::{Declared, PlainEpisode, PlainSource, VideoSpan};
use crate::video::{Mp4Pictures, Mp4Reader, VideoTrackFile};
use crate::words::counted;

/// How far a picture's time may be from its frame's: what LeRobot allows.
const TOLERANCE_SECS: f64 = 1e-4;

pub(super) fn check(source: &PlainSource, validation: &mut Validation) {
    for (at, video) in source.info.videos().enumerate() {
        let mut files: BTreeMap<FilePlace, Vec<(&PlainEpisode, VideoSpan)>> = BTreeMap::new();
        for episode in &source.episodes {
            match episode.videos[at] {
                Some(span) => files.entry(span.file).or_default().push((episode, span)),
                None => {
                    let path = &source.episode_files[episode.own.0];
                    let message = format!("it gives no place of {}", video.name);
                    return validation.error("pictures.place", path, format!("row {}", episode.own.1), message);
                }
            }
        }
        for (place, episodes) in files {
            let path = source.info.video_file(&video.name, place);
            check_file(source.info.fps, video, &path, &episodes, validation);
        }
    }
}

/// Checks the pictures of one episode.
pub(super) fn check_episode(source: &PlainSource, episode: &PlainEpisode, validation: &mut Validation) {
    for (video, span) in source.info.videos().zip(&episode.videos) {
        match span {
            Some(span) => {
                let path = source.info.video_file(&video.name, span.file);
                check_file(source.info.fps, video, &path, &[(episode, *span)], validation);
            }
            None => {
                let path = &source.episode_files[episode.own.0];
                let message = format!("it gives no place of {}", video.name);
                validation.error("pictures.place", path, format!("row {}", episode.own.1), message);
            }
        }
    }
}

fn check_file(
    fps: f64,
    video: &Declared,
    path: &Path,
    episodes: &[(&PlainEpisode, VideoSpan)],
    validation: &mut Validation,
) {
    if !path.exists() {
        let message = format!("it is missing, but {} have their pictures in it", counted(episodes.len(), "episode"));
        return validation.error("pictures.place", path, String::new(), message);
    }
    let track = match VideoTrackFile::open(path) {
        Ok(track) => track,
        Err(error) => {
            let words = error.to_string();
            let message = words.split(&format!(": {}", path.display())).next().unwrap_or_default().to_owned();
            return validation.error("file.unreadable", path, String::new(), message);
        }
    };
    check_format(video, path, &track, validation);
    if track.samples.first().is_some_and(|first| !first.is_key) {
        let message = "its first picture is no key frame, so it cannot be decoded from its beginning".to_owned();
        validation.error("pictures.decode", path, String::new(), message);
    }
    let mut until = 0.0;
    for (episode, span) in episodes {
        let place = || format!("episode {}, {}", episode.index, video.name);
        if span.from_secs < until - TOLERANCE_SECS {
            let message = format!("it begins at {} s, but the one before ends at {until} s", span.from_secs);
            validation.error("pictures.place", path, place(), message);
        }
        until = span.from_secs + episode.length as f64 / fps;
        // Half a picture, since writers round ends in their own ways.
        if let Some(to) = span.to_secs.filter(|to| (to - until).abs() > 0.5 / fps) {
            let message = format!("to_timestamp is {to}, but {} end at {until}", counted(episode.length, "frame"));
            validation.error("pictures.place", path, place(), message);
        }
        if let Some(message) = time_problem(&track, episode, span, fps) {
            validation.error("pictures.time", path, place(), message);
        }
    }
    check_decoding(&track, path, episodes, video, validation);
}

fn check_format(video: &Declared, path: &Path, track: &VideoTrackFile, validation: &mut Validation) {
    let [width, height] = track.size_px;
    if video.size_px().is_some_and(|expected| expected != track.size_px) {
        let message = format!("its pictures are {width}x{height}, but {} has shape {:?}", video.name, video.shape);
        validation.error("pictures.format", path, String::new(), message);
    }
    let codec = video.video("video.codec").and_then(|codec| codec.as_str());
    // Some datasets name the encoder.
    let is_same =
        |codec: &str| codec == track.codec || codec.contains(&track.codec) || track.codec == "h264" && codec == "avc1";
    if let Some(codec) = codec.filter(|codec| !is_same(codec)) {
        let message = format!("it is in {}, but {} is declared as {codec}", track.codec, video.name);
        validation.warn("pictures.format", path, String::new(), message);
    }
}

/// The first frame at whose time there is no picture.
fn time_problem(track: &VideoTrackFile, episode: &PlainEpisode, span: &VideoSpan, fps: f64) -> Option<String> {
    for frame in 0..episode.length {
        let secs = span.from_secs + frame as f64 / fps;
        let nearest = track.nearest(secs).map(|at| track.secs(track.samples[at].pts));
        let is_there = nearest.is_some_and(|found| (found - secs).abs() <= TOLERANCE_SECS);
        if !is_there {
            let nearest =
                nearest.map_or_else(|| "there is none".to_owned(), |found| format!("the nearest is at {found:.6} s"));
            let end = track.end_secs();
            return Some(format!(
                "frame {frame} has no picture at {secs:.6} s: {nearest}; the video ends at {end:.3} s"
            ));
        }
    }
    None
}

/// Decodes the first and the last picture of each episode, where they are in H.264 in the order of being shown.
fn check_decoding(
    track: &VideoTrackFile,
    path: &Path,
    episodes: &[(&PlainEpisode, VideoSpan)],
    video: &Declared,
    validation: &mut Validation,
) {
    let is_in_order = track.samples.windows(2).all(|pair| pair[0].pts <= pair[1].pts);
    if track.codec != "h264" || !is_in_order || track.has_other_tracks {
        return;
    }
    let mut reader = match Mp4Reader::open(path) {
        Ok(reader) => reader,
        Err(error) => return validation.error("pictures.decode", path, String::new(), error.to_string()),
    };
    let (mut n_decoded, mut failed) = (0_u64, Vec::new());
    for (episode, span) in episodes {
        let Some(first) = track.nearest(span.from_secs) else { continue };
        let last = first + usize::try_from(episode.length.saturating_sub(1)).unwrap_or(0);
        for at in [first, last.min(track.samples.len() - 1)] {
            // Each with a decoder of its own, which knows nothing of pictures from elsewhere in the file.
            match Mp4Pictures::new(&mut reader).and_then(|mut pictures| pictures.get(at).map(|_| ())) {
                Ok(()) => n_decoded += 1,
                Err(error) => {
                    let place = format!("episode {}, {}", episode.index, video.name);
                    failed.push((place, format!("picture {}: {error}", at - first)));
                    break;
                }
            }
        }
    }
    // Where no picture at all can be decoded, it may be for want of a decoder that knows this kind of H.264.
    if let (0, Some((place, message))) = (n_decoded, failed.first()) {
        let message = format!("{message}; no picture of this file can be decoded here");
        return validation.warn("pictures.decode", path, place.clone(), message);
    }
    failed.into_iter().for_each(|(place, message)| validation.error("pictures.decode", path, place, message));
}
