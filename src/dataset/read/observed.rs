//! Demonstrations as they were observed, without a word of what was done: what labels are made from.

use std::path::Path;

use crate::artifact::read_json;
use crate::dataset::DatasetError;
use crate::dataset::files::cursor::Cursor;
use crate::dataset::files::info::{FeatureInfo, Info, NtpInfo};
use crate::dataset::files::layout::{self, FilePlace};
use crate::dataset::tables::frames::feature::POSITION_NAMES;
use crate::dataset::tables::{frames, meta_episodes};
use crate::table::batch;
use crate::trace::{Observation, ObservationRows};
use crate::words::{counted, or_nothing};

/// The feature that holds observations.
const STATE: &str = "observation.state";

/// One demonstration.
#[derive(Clone, Debug, PartialEq)]
pub struct ObservedEpisode {
    /// Its number in the dataset.
    pub episode_index: u64,
    /// Its task in words.
    pub task_text: String,
    /// What was observed in each frame.
    pub observations: ObservationRows,
    /// Where the gripper was in the world in each frame, in metres; nothing where the dataset does not tell.
    pub grippers_m: Vec<[f32; 3]>,
    /// Seconds from the episode's beginning, of each frame.
    pub times_secs: Vec<f64>,
}

impl ObservedEpisode {
    /// How many frames it has.
    pub fn n_frames(&self) -> usize {
        self.times_secs.len()
    }
}

/// Reads the demonstrations of a dataset in order. Labels that it may have are not read.
pub struct ObservedEpisodes {
    slots: Vec<String>,
    has_boundaries_alone: bool,
    n_left: u64,
    next_index: i64,
    next_episode: i64,
    meta: Cursor<MetaBatch>,
    frames: Cursor<StateBatch>,
    times: Option<Cursor<TimeBatch>>,
    grippers: Option<Cursor<GripperBatch>>,
}

batch! {
    /// Where frames are, and what they are of.
    struct MetaBatch of meta_episodes {
        episode_index,
        tasks,
        length,
        data_chunk,
        data_file,
        from_index,
    }
}

batch! {
    /// What every dataset of observations has.
    struct StateBatch of frames {
        state,
        timestamp,
        frame_index,
        episode_index,
        index,
    }
}

batch! {
    struct TimeBatch of frames {
        time_secs,
    }
}

batch! {
    struct GripperBatch of frames {
        gripper,
    }
}

impl ObservedEpisodes {
    /// Opens a dataset.
    ///
    /// # Errors
    ///
    /// When its `observation.state` is not the positions of named slots relative to the gripper.
    pub fn open(root: &Path) -> Result<Self, DatasetError> {
        let info: Info = read_json(&root.join(layout::INFO))?;
        let declared = |name: &str| info.features.0.iter().find(|(feature, _)| feature == name);
        let slots = slot_names(declared(STATE).map(|(_, feature)| feature))
            .map_err(|problem| DatasetError::Count { path: root.join(layout::INFO), problem })?;
        let ntp = root.join(layout::NTP_INFO);
        let has_boundaries_alone = ntp.is_file() && read_json::<NtpInfo>(&ntp)?.frames == "boundaries";
        Ok(Self {
            slots,
            has_boundaries_alone,
            n_left: info.total_episodes,
            next_index: 0,
            next_episode: 0,
            meta: Cursor::new(root, layout::META_EPISODES),
            frames: Cursor::new(root, layout::DATA),
            times: declared("ntp.time_secs").map(|_| Cursor::new(root, layout::DATA)),
            grippers: declared("ntp.gripper_in_world_m").map(|_| Cursor::new(root, layout::DATA)),
        })
    }

    /// Names of the slots, in the order of observations.
    pub fn slots(&self) -> &[String] {
        &self.slots
    }

    /// Whether its rows are the ends of primitives, and none between them.
    pub fn has_boundaries_alone(&self) -> bool {
        self.has_boundaries_alone
    }

    fn read_next(&mut self) -> Result<Option<ObservedEpisode>, DatasetError> {
        if self.n_left == 0 {
            self.meta.finish()?;
            self.frames.finish()?;
            return Ok(None);
        }
        let (meta, at) = self.meta.next_in_order()?;
        let numbers = (meta.episode_index[at], meta.from_index[at], meta.length[at] > 0);
        let (place, length) = (place(meta.data_chunk[at], meta.data_file[at]), meta.length[at]);
        let task_text = meta.tasks[at].first().cloned().unwrap_or_default();
        let expected = (self.next_episode, self.next_index, true);
        if numbers != expected {
            let names = "(episode_index, dataset_from_index, length > 0)";
            return Err(self.meta.problem(format!("{names} are {numbers:?}, but should be {expected:?}")));
        }
        let mut episode = self.frames_of(place, length)?;
        episode.task_text = task_text;
        self.n_left -= 1;
        self.next_episode += 1;
        self.next_index += length;
        Ok(Some(episode))
    }

    fn frames_of(&mut self, place: FilePlace, length: i64) -> Result<ObservedEpisode, DatasetError> {
        let width = Observation::width(self.slots.len());
        let (mut values, mut times_secs, mut grippers_m) = (Vec::new(), Vec::new(), Vec::new());
        for frame in 0..length {
            let (batch, at) = self.frames.next(place)?;
            let found = [batch.episode_index[at], batch.frame_index[at], batch.index[at]];
            let expected = [self.next_episode, frame, self.next_index + frame];
            let state = batch.state.row(at);
            let timestamp = f64::from(batch.timestamp[at]);
            if found != expected {
                let names = "(episode_index, frame_index, index)";
                return Err(self.frames.problem(format!("{names} are {found:?}, but should be {expected:?}")));
            }
            if state.len() != width || !state.iter().all(|value| value.is_finite()) {
                let problem = format!("{STATE} is {}, or not finite; expected {width}", counted(state.len(), "number"));
                return Err(self.frames.problem(problem));
            }
            values.extend_from_slice(state);
            times_secs.push(match &mut self.times {
                None => timestamp,
                Some(times) => {
                    let (batch, at) = times.next(place)?;
                    batch.time_secs[at]
                }
            });
            if let Some(grippers) = &mut self.grippers {
                let (batch, at) = grippers.next(place)?;
                let found = batch.gripper.row(at);
                let position = match *found {
                    [x, y, z] if found.iter().all(|value| value.is_finite()) => Ok([x, y, z]),
                    _ => Err(format!("ntp.gripper_in_world_m is {found:?}, but should be three finite numbers")),
                };
                grippers_m.push(position.map_err(|problem| grippers.problem(problem))?);
            }
        }
        let observations = ObservationRows::new(self.slots.len(), values);
        let episode_index = self.next_episode.unsigned_abs();
        Ok(ObservedEpisode { episode_index, task_text: String::new(), observations, grippers_m, times_secs })
    }
}

impl Iterator for ObservedEpisodes {
    type Item = Result<ObservedEpisode, DatasetError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.read_next().transpose()
    }
}

fn place(chunk: i64, file: i64) -> FilePlace {
    FilePlace { chunk: u32::try_from(chunk).unwrap_or(u32::MAX), file: u32::try_from(file).unwrap_or(u32::MAX) }
}

/// The slots of an observation, by the names of its numbers: x, y and z of each, then the gripper.
fn slot_names(state: Option<&FeatureInfo>) -> Result<Vec<String>, String> {
    let wrong = |found: &str| {
        format!(
            "{STATE} {found}; allowed: SLOT.x_m, SLOT.y_m, SLOT.z_m of each object relative to the gripper, then \
             gripper.open and gripper.closed"
        )
    };
    let names = state.ok_or_else(|| wrong("is not declared"))?.names.clone();
    let names = names.ok_or_else(|| wrong("has no names"))?;
    let Some((slots, ["gripper.open", "gripper.closed"])) = split_gripper(&names) else {
        return Err(wrong(&format!("ends with {}", or_nothing(names.last()))));
    };
    let slot = |of_slot: &[String]| {
        let slot = of_slot.first().and_then(|name| name.strip_suffix(".x_m"));
        let slot = slot.filter(|slot| {
            let expected = POSITION_NAMES.map(|axis| format!("{slot}.{axis}_m"));
            of_slot == expected
        });
        slot.map(ToOwned::to_owned).ok_or_else(|| wrong(&format!("has the names {}", of_slot.join(", "))))
    };
    let slots: Vec<String> = slots.chunks(POSITION_NAMES.len()).map(slot).collect::<Result<_, _>>()?;
    if slots.is_empty() { Err(wrong("has no object")) } else { Ok(slots) }
}

/// The names of objects' positions, and the last two.
fn split_gripper(names: &[String]) -> Option<(&[String], [&str; 2])> {
    let (slots, gripper) = names.split_at_checked(names.len().checked_sub(2)?)?;
    Some((slots, [gripper[0].as_str(), gripper[1].as_str()]))
}
