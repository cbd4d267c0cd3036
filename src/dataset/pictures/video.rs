//! Videos of one feature: episodes back to back in MP4 files, and where each one is.

use std::path::{Path, PathBuf};

use crate::dataset::files::layout::FilePlace;
use crate::dataset::pictures::video_columns;
use crate::table::Values;
use crate::video::{Mp4Writer, VideoError};

/// Files of videos, the last of which is being written. Its pictures are in memory.
pub(in crate::dataset) struct VideoFiles {
    root: PathBuf,
    feature: String,
    size_px: [u32; 2],
    fps: u32,
    file_bytes: usize,
    place: FilePlace,
    writer: Option<Mp4Writer>,
    files: Vec<String>,
    names: [String; 4],
    chunks: Vec<i64>,
    numbers: Vec<i64>,
    from_secs: Vec<f64>,
    to_secs: Vec<f64>,
}

impl VideoFiles {
    pub(in crate::dataset) fn new(root: &Path, feature: &str, size_px: [u32; 2], fps: u32, file_bytes: usize) -> Self {
        Self {
            root: root.to_owned(),
            feature: feature.to_owned(),
            size_px,
            fps,
            file_bytes,
            place: FilePlace::default(),
            writer: None,
            files: Vec::new(),
            names: video_columns(feature).map(|(name, _)| name),
            chunks: Vec::new(),
            numbers: Vec::new(),
            from_secs: Vec::new(),
            to_secs: Vec::new(),
        }
    }

    /// Adds an episode's packets, the first of which is a key frame.
    pub(in crate::dataset) fn append(&mut self, packets: &[&Vec<u8>]) -> Result<(), VideoError> {
        let mut writer = match self.writer.take() {
            Some(writer) => writer,
            None => {
                let file = self.place.video(&self.feature);
                let writer = Mp4Writer::create(&self.root.join(&file), self.size_px, self.fps)?;
                self.files.push(file);
                writer
            }
        };
        let from = writer.n_samples();
        packets.iter().try_for_each(|packet| writer.write(packet))?;
        let seconds = |sample: u64| sample as f64 / f64::from(self.fps);
        self.chunks.push(i64::from(self.place.chunk));
        self.numbers.push(i64::from(self.place.file));
        self.from_secs.push(seconds(from));
        self.to_secs.push(seconds(writer.n_samples()));
        let is_full = writer.n_bytes() >= self.file_bytes;
        self.writer = Some(writer);
        if is_full { self.end_file() } else { Ok(()) }
    }

    /// Ends the file that is being written, if there is one: the next episode begins another.
    pub(in crate::dataset) fn end_file(&mut self) -> Result<(), VideoError> {
        let Some(writer) = self.writer.take() else { return Ok(()) };
        self.place = self.place.next();
        writer.finish()
    }

    /// The columns of episodes that are not yet written.
    pub(in crate::dataset) fn columns(&self) -> [(&str, Values<'_>); 4] {
        let [chunk, file, from, to] = &self.names;
        [
            (chunk, Values::Int64(&self.chunks)),
            (file, Values::Int64(&self.numbers)),
            (from, Values::Float64(&self.from_secs)),
            (to, Values::Float64(&self.to_secs)),
        ]
    }

    /// Forgets the rows of episodes.
    pub(in crate::dataset) fn clear(&mut self) {
        [&mut self.chunks, &mut self.numbers].into_iter().for_each(Vec::clear);
        [&mut self.from_secs, &mut self.to_secs].into_iter().for_each(Vec::clear);
    }

    /// Ends the last file. Returns all of them.
    pub(in crate::dataset) fn finish(self) -> Result<Vec<String>, VideoError> {
        self.writer.map_or(Ok(()), Mp4Writer::finish)?;
        Ok(self.files)
    }
}
