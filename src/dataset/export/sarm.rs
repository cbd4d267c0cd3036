//! SARM's labels: sub-tasks (`sparse`) and skills (`dense`) as columns of `meta/episodes`, and how much of an episode
//! each takes on average.
//!
//! Ends of frames are included, as SARM reads them; times are `frame_index / fps`.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use arrow::array::{ArrayRef, Float64Array, Int64Array, ListArray, StringArray};
use arrow::buffer::OffsetBuffer;
use arrow::datatypes::{DataType, Field};
use arrow::error::ArrowError;
use serde::{Serialize, Serializer};

use crate::artifact::write_json;
use crate::dataset::edit::EditError;
use crate::dataset::export::ExportSummary;
use crate::dataset::export::labels::{Label, LabelReader, LabelledEpisode};
use crate::dataset::export::plain::{copy_files, with_columns, write_frames};
use crate::dataset::files::layout;
use crate::dataset::schema::META_EPISODES;

/// Gives the labels of one level.
type LabelsOf = fn(&LabelledEpisode) -> Vec<Label>;

/// The two levels and where they come from.
const LEVELS: [(&str, LabelsOf); 2] = [("sparse", LabelledEpisode::subtasks), ("dense", LabelledEpisode::dense)];

/// Writes the dataset with SARM's columns.
pub(super) fn write(root: &Path, to: &Path) -> Result<ExportSummary, EditError> {
    write_frames(root, to, Vec::new(), Ok)?;
    let (info, mut reader) = LabelReader::open(root)?;
    let mut proportions = [Proportions::default(), Proportions::default()];
    let mut summary = ExportSummary::default();
    let files = (layout::META_EPISODES, META_EPISODES.name());
    copy_files(root, to, files, &META_EPISODES.options(), |rows| {
        let mut columns = [Columns::default(), Columns::default()];
        for episode in reader.by_ref().take(rows.num_rows()) {
            let episode = episode?;
            summary.episodes += 1;
            for ((level, columns), (_, labels)) in proportions.iter_mut().zip(&mut columns).zip(LEVELS) {
                let labels = labels(&episode);
                level.add(&labels);
                summary.labels += labels.len() as u64;
                columns.add(&labels, info.fps);
            }
        }
        let named = LEVELS.iter().zip(columns).map(|((level, _), columns)| columns.finish(level));
        let columns = named.collect::<Result<Vec<_>, _>>().map_err(EditError::rows(layout::META_EPISODES))?;
        with_columns(&rows, columns.concat()).map_err(EditError::rows(layout::META_EPISODES))
    })?;
    for ((level, _), proportions) in LEVELS.iter().zip(proportions) {
        write_json(&to.join(format!("meta/temporal_proportions_{level}.json")), &proportions.finish())?;
    }
    Ok(summary)
}

/// The labels of some episodes.
#[derive(Default)]
struct Columns {
    lengths: Vec<usize>,
    names: Vec<String>,
    times: [Vec<f64>; 2],
    frames: [Vec<i64>; 2],
}

impl Columns {
    fn add(&mut self, labels: &[Label], fps: f64) {
        self.lengths.push(labels.len());
        for label in labels {
            self.names.push(label.text.clone());
            for (at, frame) in [label.begin, label.end - 1].into_iter().enumerate() {
                self.times[at].push(f64::from(frame) / fps);
                self.frames[at].push(i64::from(frame));
            }
        }
    }

    fn finish(self, level: &str) -> Result<Vec<(Field, ArrayRef)>, ArrowError> {
        let offsets = OffsetBuffer::<i32>::from_lengths(self.lengths.iter().copied());
        let [start_times, end_times] = self.times.map(|times| Arc::new(Float64Array::from(times)) as ArrayRef);
        let [start_frames, end_frames] = self.frames.map(|frames| Arc::new(Int64Array::from(frames)) as ArrayRef);
        let names = Arc::new(StringArray::from(self.names)) as ArrayRef;
        let columns = [
            ("names", names),
            ("start_times", start_times),
            ("end_times", end_times),
            ("start_frames", start_frames),
            ("end_frames", end_frames),
        ];
        let column = |(name, values): (&str, ArrayRef)| {
            let item = Arc::new(Field::new("element", values.data_type().clone(), false));
            let list = ListArray::try_new(Arc::clone(&item), offsets.clone(), values, None)?;
            let field = Field::new(format!("{level}_subtask_{name}"), DataType::List(item), false);
            Ok((field, Arc::new(list) as ArrayRef))
        };
        columns.into_iter().map(column).collect()
    }
}

/// The mean over episodes of the share of an episode's labelled frames that each label takes (SARM, formula 1).
#[derive(Default)]
struct Proportions {
    shares: BTreeMap<String, Share>,
    n_episodes: u64,
}

#[derive(Default)]
struct Share {
    frames: f64,
    /// Where it begins, and how often.
    begins: f64,
    n_labels: u64,
}

impl Proportions {
    fn add(&mut self, labels: &[Label]) {
        let total: u32 = labels.iter().map(|label| label.end - label.begin).sum();
        for label in labels {
            let share = self.shares.entry(label.text.clone()).or_default();
            share.frames += f64::from(label.end - label.begin) / f64::from(total);
            share.begins += f64::from(label.begin) / f64::from(total);
            share.n_labels += 1;
        }
        self.n_episodes += u64::from(total > 0);
    }

    /// Labels in the order in which they come on average: SARM numbers its stages so.
    fn finish(self) -> InOrder {
        let n_episodes = self.n_episodes.max(1) as f64;
        let mut labels: Vec<(String, Share)> = self.shares.into_iter().collect();
        let mean_begin = |share: &Share| share.begins / share.n_labels.max(1) as f64;
        labels.sort_by(|(_, a), (_, b)| mean_begin(a).total_cmp(&mean_begin(b)));
        InOrder(labels.into_iter().map(|(name, share)| (name, share.frames / n_episodes)).collect())
    }
}

/// A JSON object whose keys keep their order.
struct InOrder(Vec<(String, f64)>);

impl Serialize for InOrder {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, share)| (name, share)))
    }
}
