//! A reader that is not ours: Rerun's of `LeRobotDataset` v3.0.

use std::collections::BTreeSet;
use std::path::Path;

use ntp::dataset::{ConvertConfig, FrameChoice, schema};
use re_lerobot::datasetv3::LeRobotDatasetV3;
use re_lerobot::{EpisodeIndex, LeRobotDatasetVersion, SubtaskIndex, TaskIndex};

use crate::dataset::{convert_all, densify, episodes, sorting_episodes};

/// What the foreign reader finds in a dataset.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Opened {
    /// Frames of each episode, in order.
    pub(crate) episode_frames: Vec<usize>,
    /// Task texts in order of their numbers.
    pub(crate) tasks: Vec<String>,
    pub(crate) n_subtasks: usize,
    pub(crate) features: BTreeSet<String>,
}

/// Opens a dataset with the foreign reader, and reads every episode's rows.
pub(crate) fn open(root: &Path) -> Opened {
    assert_eq!(LeRobotDatasetVersion::find_version(root), Some(LeRobotDatasetVersion::V3));
    let dataset = LeRobotDatasetV3::load_from_directory(root).unwrap();
    let metadata = &dataset.metadata;
    let rows = |episode: EpisodeIndex| dataset.read_episode_data(episode).unwrap().num_rows();
    let n_tasks = metadata.tasks.tasks.len();
    let task = |at: usize| dataset.task_by_index(TaskIndex(at)).unwrap().task.clone();
    let n_subtasks = metadata.subtasks.as_ref().map_or(0, |subtasks| subtasks.subtasks.len());
    assert!((0..n_subtasks).all(|at| dataset.subtask_by_index(SubtaskIndex(at)).is_some()));
    let opened = Opened {
        episode_frames: metadata.iter_episode_indices().map(rows).collect(),
        tasks: (0..n_tasks).map(task).collect(),
        n_subtasks,
        features: metadata.info.features.keys().cloned().collect(),
    };
    assert_eq!(metadata.info.total_episodes, opened.episode_frames.len());
    assert_eq!(metadata.info.total_frames, opened.episode_frames.iter().sum::<usize>());
    assert_eq!(metadata.info.total_tasks, opened.tasks.len());
    opened
}

#[test]
fn reruns_reader_finds_the_episodes_tasks_and_features_that_were_written() {
    for episodes in [episodes(), sorting_episodes(), vec![densify(&episodes()[0], 2)]] {
        let folder = tempfile::tempdir().unwrap();
        let config = ConvertConfig { frames: FrameChoice::All, ..ConvertConfig::default() };
        convert_all(&episodes, &config, folder.path()).unwrap();
        let opened = open(folder.path());
        let frames: Vec<usize> = episodes.iter().map(|episode| episode.frames.len()).collect();
        let mut texts: Vec<String> = Vec::new();
        for episode in &episodes {
            if !texts.contains(&episode.provenance.task_text) {
                texts.push(episode.provenance.task_text.clone());
            }
        }
        let columns = schema::FRAMES.columns();
        assert_eq!(opened.episode_frames, frames);
        assert_eq!(opened.tasks, texts);
        assert!(opened.n_subtasks > 1);
        assert_eq!(opened.features, columns.into_iter().map(|(name, _)| name).collect());
    }
}

/// For `tests/foreign/run.sh`, which names a dataset that was made by the program.
#[test]
#[expect(clippy::disallowed_methods, clippy::print_stdout, reason = "the dataset is named from outside, and told of")]
fn reruns_reader_opens_the_dataset_that_is_named() {
    let Ok(root) = std::env::var("NTP_DATASET") else { return };
    let Opened { episode_frames, tasks, .. } = open(Path::new(&root));
    let (n_episodes, n_frames) = (episode_frames.len(), episode_frames.iter().sum::<usize>());
    let summary = ntp::dataset::summarize(Path::new(&root)).unwrap();
    assert_eq!((n_episodes as u64, n_frames as u64), (summary.total_episodes, summary.total_frames));
    println!("re_lerobot: opened, {n_episodes} episodes, {n_frames} frames, {} tasks", tasks.len());
}
