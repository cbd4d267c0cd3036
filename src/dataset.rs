//! Recordings to a LeRobotDataset v3.0 with program tables beside it, and back into memory.

mod trial_data;

pub use trial_data::{DatasetTrials, TrialData};
