//! Videos of a feature: packets as they come, at the times of their frames.

use std::path::{Path, PathBuf};

use crate::dataset::files::layout::FilePlace;
use crate::dataset::pictures::{PictureMeasure, PictureStatistics};
use crate::video::{Mp4Writer, VideoError, is_key_frame};

/// A packet of H.264 in Annex B.
pub(crate) type Packet = Vec<u8>;

/// Where an episode's frames are: the file, and seconds in it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct VideoPlace {
    pub(super) file: FilePlace,
    pub(super) from_secs: f64,
    pub(super) to_secs: f64,
}

/// The file that is being written, and the times in it. Packets that no frame shows lie between the frames.
pub(super) struct VideoTrack {
    root: PathBuf,
    feature: String,
    size_px: [u32; 2],
    fps: u32,
    file_bytes: usize,
    place: FilePlace,
    writer: Option<Mp4Writer>,
    /// Frame times of the file that have been used, of `1 / fps` each.
    n_ticks: u64,
    /// Tick of the episode's first frame.
    first_tick: Option<u64>,
    measure: PictureMeasure,
}

impl VideoTrack {
    pub(super) fn new(root: &Path, feature: &str, size_px: [u32; 2], fps: u32, file_bytes: usize) -> Self {
        Self {
            root: root.to_owned(),
            feature: feature.to_owned(),
            size_px,
            fps,
            file_bytes,
            place: FilePlace::default(),
            writer: None,
            n_ticks: 0,
            first_tick: None,
            measure: PictureMeasure::new(size_px),
        }
    }

    /// Adds a frame with the packets that it needs. The first frame's others take ticks before it; those of later ones
    /// share the time since the frame before.
    pub(super) fn push(&mut self, packets: Vec<Packet>, number: u64) -> Result<(), VideoError> {
        let mut writer = match self.writer.take() {
            Some(writer) => writer,
            None => Mp4Writer::create(&self.root.join(self.place.video(&self.feature)), self.size_px, self.fps)?,
        };
        let n_hidden = packets.len().saturating_sub(1) as u64;
        let (begin, step) = match self.first_tick {
            Some(first) => ((first + number) as f64 - 1.0, 1.0 / (n_hidden + 1) as f64),
            None => (self.n_ticks as f64 - 1.0, 1.0),
        };
        for (position, packet) in packets.iter().enumerate() {
            let tick = begin + step * (position + 1) as f64;
            writer.write_at(tick / f64::from(self.fps), packet)?;
            if is_key_frame(packet) {
                self.measure.add_video([packet])?;
            }
        }
        let first = *self.first_tick.get_or_insert(self.n_ticks + n_hidden);
        self.n_ticks = first + number + 1;
        self.writer = Some(writer);
        Ok(())
    }

    /// Where the episode is. A file that is full is ended.
    pub(super) fn end_episode(&mut self) -> Result<VideoPlace, VideoError> {
        let secs = |ticks: u64| ticks as f64 / f64::from(self.fps);
        let first = self.first_tick.take().unwrap_or(self.n_ticks);
        let place = VideoPlace { file: self.place, from_secs: secs(first), to_secs: secs(self.n_ticks) };
        if self.writer.as_ref().is_some_and(|writer| writer.n_bytes() >= self.file_bytes)
            && let Some(writer) = self.writer.take()
        {
            writer.finish()?;
            self.place = self.place.next();
            self.n_ticks = 0;
        }
        Ok(place)
    }

    pub(super) fn finish(self) -> Result<PictureStatistics, VideoError> {
        self.writer.map_or(Ok(()), Mp4Writer::finish)?;
        Ok(self.measure.statistics())
    }
}
