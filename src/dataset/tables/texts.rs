//! The tables of texts that `LeRobot` counts tasks and sub-tasks by.

pub(crate) mod subtask;
pub(crate) mod write;
