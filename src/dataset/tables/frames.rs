//! The rows of `data/`: one per frame, a column per feature.
//!
//! Rows of several episodes are gathered until they are worth a row group; then the buffers begin anew.

pub(crate) mod check;
pub(crate) mod expected;
pub(crate) mod feature;
pub(crate) mod paths;
pub(crate) mod read;
pub(crate) mod run;
pub(crate) mod write;

use crate::table::table;

table! {
    /// `data/chunk-*/file-*.parquet` of a dataset: a row a frame, sorted by `index`, LeRobot's own table.
    ///
    /// > Why so many labels in the table of frames, when `calls` has them? A reader of frames alone (LeRobot, Rerun, the hub's viewer) should see which program runs. `calls` is the truth; these are derived from it, and `ntp validate` holds them against it.
    frames sorted_by("episode_index", "frame_index") {
        /// `3 N + 2` values: x, y, z of each of the N slots' bodies minus the gripper's position, in metres along the world's axes; then one-hot (open, closed)
        state("observation.state"): Float32Vector,
        /// what leads to the next row: x, y, z that the gripper moves, in metres, and whether it holds something then; the last row moves nowhere
        action: Float32Vector,
        /// `frame_index / fps`, in seconds: regular, because LeRobot looks frames up by it
        timestamp: Float32 plain,
        /// position in its episode
        frame_index: Int64 delta,
        /// which episode
        episode_index: Int64 delta,
        /// position in the dataset, without gaps over all files
        index: Int64 delta,
        /// row of `meta/tasks.parquet`
        task_index: Int64 delta,
        /// row of `meta/subtasks.parquet`: the root's callee that goes on from this frame, with its arguments
        subtask_index: Int64 delta,
        /// whether it is the episode's last frame
        done("next.done"): Boolean,
        /// whether it is the last frame of an episode that succeeded
        success("next.success"): Boolean,
        /// simulated time since the episode's beginning
        time_secs("ntp.time_secs"): Float64 plain,
        /// whether a primitive has just ended (or the episode begins): what programs see
        boundary("ntp.boundary"): Boolean,
        /// position among the recorded frames of the episode
        recording_frame("ntp.recording_frame"): Int64 delta,
        /// x, y, z of the gripper's reference point
        gripper("ntp.gripper_in_world_m"): Float32Vector,
        /// the deepest call that goes on from this frame to the next
        call_id("ntp.call_id"): Int64 delta,
        /// the path of running programs, `block_stacking/pick_and_place/pick`
        program("ntp.program"): Word,
    }
}
