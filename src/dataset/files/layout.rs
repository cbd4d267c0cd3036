//! Where each file of a dataset is, relative to its root.

use std::path::{Path, PathBuf};

use crate::artifact::IoError;

/// Totals, features and path templates, as `LeRobot` reads them.
pub(crate) const INFO: &str = "meta/info.json";
/// Statistics of each numeric feature over the whole dataset.
pub(crate) const STATS: &str = "meta/stats.json";
/// Task texts.
pub(crate) const TASKS: &str = "meta/tasks.parquet";
/// Texts of the sub-tasks that `subtask_index` counts.
pub(crate) const SUBTASKS: &str = "meta/subtasks.parquet";
/// What the program tables are made of.
pub(crate) const NTP_INFO: &str = "ntp/info.json";
/// How labels were made that models made.
pub(crate) const ANNOTATION: &str = "ntp/annotation.json";
/// Provenance of each episode.
pub(crate) const EPISODES: &str = "ntp/episodes.parquet";
/// The card of a published dataset.
pub(crate) const CARD: &str = "README.md";
/// Folder of the frames.
pub(crate) const DATA: &str = "data";
/// Folder of the videos.
pub(crate) const VIDEOS: &str = "videos";
/// Folder of `LeRobot`'s rows per episode.
pub(crate) const META_EPISODES: &str = "meta/episodes";
/// Folder of the program calls.
pub(crate) const CALLS: &str = "ntp/calls";
/// Folder of the scoping labels.
pub(crate) const SCOPES: &str = "ntp/scopes";
/// Most files of one chunk folder.
pub(crate) const CHUNK_FILES: u32 = 1000;

/// Which file of a folder: `FOLDER/chunk-000/file-000.parquet`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct FilePlace {
    pub(crate) chunk: u32,
    pub(crate) file: u32,
}

impl FilePlace {
    pub(crate) fn relative(self, folder: &str) -> String {
        format!("{folder}/chunk-{:03}/file-{:03}.parquet", self.chunk, self.file)
    }

    pub(crate) fn in_dataset(self, root: &Path, folder: &str) -> PathBuf {
        root.join(self.relative(folder))
    }

    /// Whether the file is there.
    pub(crate) fn is_there(self, root: &Path, folder: &str) -> Result<bool, IoError> {
        let path = self.in_dataset(root, folder);
        path.try_exists().map_err(IoError::system("read", &path))
    }

    /// The video file of a feature.
    pub(crate) fn video(self, feature: &str) -> String {
        format!("{VIDEOS}/{feature}/chunk-{:03}/file-{:03}.mp4", self.chunk, self.file)
    }

    pub(crate) fn next(self) -> Self {
        if self.file + 1 < CHUNK_FILES {
            Self { chunk: self.chunk, file: self.file + 1 }
        } else {
            Self { chunk: self.chunk + 1, file: 0 }
        }
    }
}
