//! The rows of `meta/episodes/`: an episode each, as `LeRobot` reads them. The statistics in them are made elsewhere.

use crate::dataset::files::layout::FilePlace;
use crate::dataset::tables::frames::feature::FEATURES;
use crate::dataset::tables::view::EpisodePlaces;
use crate::dataset::tables::view::EpisodeView;
use crate::table::{TableRows as _, table};

table! {
    /// `meta/episodes/chunk-*/file-*.parquet`: a row an episode, as LeRobot reads it. A `*` in a name stands for each feature.
    meta_episodes sorted_by("episode_index") {
        /// which episode; rows are in its order, because LeRobot takes them by position
        episode_index: Int64,
        /// the task in words
        tasks: TextList,
        /// frames
        length: Int64,
        /// folder of the file of its frames
        data_chunk("data/chunk_index"): Int64,
        /// that file
        data_file("data/file_index"): Int64,
        /// `index` of its first frame
        from_index("dataset_from_index"): Int64,
        /// one past the last
        to_index("dataset_to_index"): Int64,
        /// folder of the file that this row is in
        own_chunk("meta/episodes/chunk_index"): Int64,
        /// that file
        own_file("meta/episodes/file_index"): Int64,
        /// which task
        task_id("ntp/task_id"): Text,
        /// `seen` or `unseen`
        split("ntp/split"): Text,
        /// whether it succeeded
        success("ntp/success"): Boolean,
    }
    each(features_of_episodes) {
        /// least value of each dimension in the episode
        "stats/*/min": Float64List,
        /// greatest value
        "stats/*/max": Float64List,
        /// mean
        "stats/*/mean": Float64List,
        /// standard deviation, of the whole population
        "stats/*/std": Float64List,
        /// frames counted
        "stats/*/count": Int64List,
    }
}

/// Names of the features that each episode has statistics of.
fn features_of_episodes() -> Vec<String> {
    let features = FEATURES.iter().filter(|feature| feature.has_episode_statistics());
    features.map(|feature| feature.name.to_owned()).collect()
}

impl Rows {
    /// Adds an episode, whose row goes to the file `own`.
    pub(crate) fn append_episode(&mut self, view: &EpisodeView<'_>, places: EpisodePlaces, own: FilePlace) {
        let provenance = &view.episode.provenance;
        self.push(Row {
            episode_index: places.episode_index,
            tasks: vec![provenance.task_text.clone()],
            length: view.n_rows() as i64,
            data_chunk: i64::from(places.data.chunk),
            data_file: i64::from(places.data.file),
            from_index: places.first_index,
            to_index: places.first_index + view.n_rows() as i64,
            own_chunk: i64::from(own.chunk),
            own_file: i64::from(own.file),
            task_id: provenance.task_id.as_str().into(),
            split: provenance.split.name().into(),
            success: view.episode.outcome.is_success(),
        });
    }
}
