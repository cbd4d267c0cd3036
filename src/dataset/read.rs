//! A dataset back into memory: what a learner, a viewer or a question needs of it.

pub(crate) mod lookup;
pub(crate) mod observed;
pub(crate) mod playback;
pub(crate) mod summary;
pub(crate) mod table_files;
pub(crate) mod trial_data;
pub(crate) mod trial_spool;
pub(crate) mod trials;
