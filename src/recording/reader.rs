//! Reads a shard: its episodes one after the other, or one of them.

use std::fs::File;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use super::assembler::{Assembled, Assembler, Keep};
use super::cameras::{CameraPictures, Filmed, Pictured, cameras_of};
use super::decode::check_pictures;
use super::error::RecordingError;
use super::index::Index;
use super::stream::{RawMessage, Stream};
use crate::artifact::{self, Plan};
use crate::render::CameraConfig;
use crate::task::Family;
use crate::trace::{Boundaries, Episode, TraceError};

/// A recording being read. Iterating gives its episodes in the order of writing and ends with the first error.
///
/// # Invariants
///
/// Memory holds one chunk and one episode, never the file. Every checksum is checked: when iteration ends without an
/// error, each byte of the file was as it had been written.
pub struct ShardReader {
    path: PathBuf,
    index: Index,
    /// `None` once it has ended, well or not.
    stream: Option<Stream>,
    assembler: Assembler,
    /// Position of the next episode.
    position: u64,
    /// Start time of each episode, and where it or its chunk begins, when one was asked for by position.
    starts: Option<Vec<(u64, u64)>>,
}

impl ShardReader {
    /// Opens a recording and checks that this version can read it.
    ///
    /// # Errors
    ///
    /// When the file is no recording of this version, is cut off, or its index is damaged.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let mut file = open(path)?;
        let index = Index::read(path, &mut file)?;
        let stream = Stream::whole(path, file)?;
        Ok(Self {
            path: path.to_owned(),
            index,
            stream: Some(stream),
            assembler: Assembler::default(),
            position: 0,
            starts: None,
        })
    }

    /// The plan of the stage that wrote it, as it was given to the writer.
    pub fn plan_json(&self) -> &str {
        &self.index.plan_json
    }

    /// The family of its tasks; `None` when it has no episodes.
    pub fn family(&self) -> Option<Family> {
        self.index.family
    }

    /// How many episodes its index counts.
    pub fn n_episodes(&self) -> u64 {
        self.index.n_episodes()
    }

    /// Reads only the boundary frames of each episode, from the next one on.
    #[must_use]
    pub fn boundaries(self) -> BoundaryReader {
        BoundaryReader(Self { assembler: Assembler::new(Keep::Boundaries), ..self })
    }

    /// Reads also what cameras saw, from the next episode on.
    #[must_use]
    pub fn pictured(self) -> PicturedReader {
        let assembler = self.assembler.with_pictures(self.index.cameras());
        PicturedReader(Self { assembler, ..self })
    }

    /// Checks also what cameras saw, from the next episode on, where there are cameras.
    #[must_use]
    pub fn checked(self) -> CheckedReader {
        let cameras = self.cameras();
        let assembler = if cameras.is_empty() { self.assembler } else { self.assembler.with_pictures(cameras) };
        CheckedReader(Self { assembler, ..self })
    }

    /// The cameras that the file declares, then those that its plan names beside them.
    pub(super) fn cameras(&self) -> Vec<String> {
        let mut cameras = self.index.cameras();
        // The plan of a test, or of another program, is none of ours.
        let plan = serde_json::from_str::<Plan>(self.plan_json()).ok();
        for CameraConfig { name, .. } in plan.as_ref().map(cameras_of).unwrap_or_default() {
            if !cameras.contains(&name) {
                cameras.push(name);
            }
        }
        cameras
    }

    /// One episode, by its position in the file from 0. Iteration is not disturbed.
    ///
    /// # Errors
    ///
    /// [`RecordingError::NoSuchEpisode`] behind the last one; else as in iteration, for the chunks that it lies in.
    pub fn read_episode(&mut self, position: u64) -> Result<Episode, RecordingError> {
        let (start_nanos, offset) = self.start_of(position)?;
        let mut stream = Stream::from_record(&self.path, open(&self.path)?, offset)?;
        let mut assembler = Assembler::default();
        let episode = stream.messages(|message| {
            if message.log_time_nanos < start_nanos {
                return Ok(ControlFlow::Continue(()));
            }
            take(&self.path, &self.index, &mut assembler, position, message)
        })?;
        let whole = episode.ok_or_else(|| RecordingError::Unfinished { path: self.path.clone(), episode: position })?;
        self.check(position, || Episode::new(whole.parts))
    }

    fn start_of(&mut self, position: u64) -> Result<(u64, u64), RecordingError> {
        let starts = match self.starts.take() {
            Some(starts) => starts,
            None => self.index.starts(&self.path, &mut open(&self.path)?)?,
        };
        let start = usize::try_from(position).ok().and_then(|position| starts.get(position)).copied();
        let episodes = starts.len() as u64;
        self.starts = Some(starts);
        start.ok_or_else(|| RecordingError::NoSuchEpisode { path: self.path.clone(), position, episodes })
    }

    /// The next episode's parts, checked by `new`. After an error, and at the end, there are no more.
    fn next_checked<T>(
        &mut self,
        new: impl FnOnce(Assembled) -> Result<T, TraceError>,
    ) -> Option<Result<T, RecordingError>> {
        let episode = self.position;
        let next =
            self.next_assembled().and_then(|next| next.map(|next| self.check(episode, || new(next))).transpose());
        if !matches!(next, Ok(Some(_))) {
            self.stream = None;
        }
        next.transpose()
    }

    fn next_assembled(&mut self) -> Result<Option<Assembled>, RecordingError> {
        let Self { path, index, stream, assembler, position, .. } = self;
        let Some(stream) = stream else { return Ok(None) };
        let assembled = stream.messages(|message| take(path, index, assembler, *position, message))?;
        if assembled.is_none() && assembler.is_building() {
            return Err(RecordingError::Unfinished { path: path.clone(), episode: *position });
        }
        *position += u64::from(assembled.is_some());
        Ok(assembled)
    }

    fn check<T>(&self, episode: u64, new: impl FnOnce() -> Result<T, TraceError>) -> Result<T, RecordingError> {
        new().map_err(|source| RecordingError::Trace { path: self.path.clone(), episode, source })
    }
}

impl Iterator for ShardReader {
    type Item = Result<Episode, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.next_checked(|Assembled { parts, .. }| Episode::new(parts))
    }
}

/// A recording of which only boundary frames are read. Iterating goes on as that of [`ShardReader`] does; of the frames
/// that are passed over, the poses and slots are not held to the rules of the trace.
pub struct BoundaryReader(ShardReader);

impl Iterator for BoundaryReader {
    type Item = Result<Boundaries, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.0.next_checked(|Assembled { parts, recorded, .. }| Boundaries::new(parts, recorded))
    }
}

impl BoundaryReader {
    /// Reads also what cameras saw at the boundaries, from the next episode on.
    #[must_use]
    pub fn pictured(self) -> PicturedBoundaryReader {
        let Self(reader) = self;
        let assembler = reader.assembler.with_pictures(reader.index.cameras());
        PicturedBoundaryReader(ShardReader { assembler, ..reader })
    }
}

/// A recording whose pictures are read too.
pub struct PicturedReader(ShardReader);

impl Iterator for PicturedReader {
    type Item = Result<Pictured<Episode>, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.0.next_checked(|Assembled { parts, cameras, .. }| {
            Ok(Pictured { episode: Episode::new(parts)?, cameras: pictures(cameras) })
        })
    }
}

/// A recording of which boundary frames are read with their pictures.
pub struct PicturedBoundaryReader(ShardReader);

impl Iterator for PicturedBoundaryReader {
    type Item = Result<Pictured<Boundaries>, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.0.next_checked(|Assembled { parts, recorded, cameras }| {
            Ok(Pictured { episode: Boundaries::new(parts, recorded)?, cameras: pictures(cameras) })
        })
    }
}

/// A recording that is checked: each episode has what every camera of the file and of its plan saw, and each picture
/// can be decoded and has its camera's size. Pictures that cannot be decoded are an error in place of their episode,
/// which does not end the iteration; any other error does.
pub struct CheckedReader(ShardReader);

impl Iterator for CheckedReader {
    type Item = Result<Episode, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        let Self(reader) = self;
        let position = reader.position;
        let next = reader.next_checked(|Assembled { parts, cameras, .. }| Ok((Episode::new(parts)?, cameras)))?;
        Some(next.and_then(|(episode, cameras)| {
            check_pictures(&reader.path, position, &cameras)?;
            Ok(episode)
        }))
    }
}

fn pictures(cameras: Vec<Filmed>) -> Vec<CameraPictures> {
    cameras.into_iter().map(|filmed| filmed.seen).collect()
}

fn open(path: &Path) -> Result<File, RecordingError> {
    Ok(artifact::open(path)?)
}

/// Gives a message to the assembler, and an error its place.
fn take(
    path: &Path,
    index: &Index,
    assembler: &mut Assembler,
    episode: u64,
    message: &RawMessage<'_>,
) -> Result<ControlFlow<Assembled>, RecordingError> {
    let &RawMessage { channel, sequence, log_time_nanos, data, offset, .. } = message;
    let topic = index.topic(channel, sequence).map_err(|source| RecordingError::Damaged {
        path: path.to_owned(),
        offset,
        source,
    })?;
    let taken = match topic {
        Some(topic) => {
            assembler.message(topic, log_time_nanos, data).map_err(|problem| (topic.name().to_owned(), problem))
        }
        None => {
            let camera = index.camera_topic(channel).filter(|_| assembler.wants_pictures());
            let Some((camera, topic)) = camera else { return Ok(ControlFlow::Continue(())) };
            let taken = assembler.camera_message(camera, topic, data);
            taken.map(|()| None).map_err(|problem| (topic.name(camera), problem))
        }
    };
    match taken {
        Ok(Some(assembled)) => Ok(ControlFlow::Break(assembled)),
        Ok(None) => Ok(ControlFlow::Continue(())),
        Err((topic, problem)) => {
            let path = path.to_owned();
            Err(RecordingError::Message { path, topic, episode, sequence, log_time_nanos, problem })
        }
    }
}
