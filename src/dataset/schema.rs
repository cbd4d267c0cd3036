//! The contracts of a dataset's tables.

use crate::dataset::tables::frames::feature::FEATURES;
use crate::table::{TableSchema, schema};

/// Every table of a dataset.
pub const ALL: [TableSchema; 7] = [FRAMES, META_EPISODES, TASKS, SUBTASKS, CALLS, SCOPES, EPISODES];

schema! {
    /// `data/chunk-*/file-*.parquet` of a dataset: a row a frame, sorted by `index`, LeRobot's own table.
    ///
    /// > Why so many labels in the table of frames, when `calls` has them? A reader of frames alone (LeRobot, Rerun, the hub's viewer) should see which program runs. `calls` is the truth; these are derived from it, and `ntp validate` holds them against it.
    FRAMES = frames sorted_by("episode_index", "frame_index") {
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

schema! {
    /// `ntp/calls/chunk-*/file-*.parquet`: a row a program call, in the order of calling, a caller before its callees. One step of Algorithm 1 of the paper.
    ///
    /// > Why three spans? What the caller saw (`input`), what it handed on (`output`) and when it happened (`frame`) are the same in an expert's episode and differ in a policy's: there `input` and `output` count the demonstration that the policy was given.
    CALLS = calls sorted_by("episode_index", "call_id") {
        /// which episode
        episode_index: Int64 delta,
        /// position in its episode; 0 is the root
        call_id: Int64 delta,
        /// who called; null for the root
        caller_id: OptionalInt64 delta,
        /// 0 for the root, else one more than the caller's
        depth: Int64 delta,
        /// how many calls its caller had made before
        step: Int64 delta,
        /// what was called; `none` only ends its caller
        program: Word,
        /// the slot it was called with; for `move_to` alone
        argument_slot: OptionalInt64 delta,
        /// that slot's name
        argument: OptionalWord,
        /// first frame of the specification that the caller could see when it chose this call
        input_begin: Int64 delta,
        /// one past the last
        input_end: Int64 delta,
        /// first frame that the callee may see, its scope; null for `none`
        output_begin: OptionalInt64 delta,
        /// one past the last
        output_end: OptionalInt64 delta,
        /// the episode's own frame at the call
        frame_begin: Int64 delta,
        /// one past the frame at its return
        frame_end: Int64 delta,
        /// whether the caller ended with this step
        end_of_program: Boolean,
        /// the call in words, for a call that calls primitives: `pick block_D`, `drop into bin_2`
        instruction: OptionalWord,
    }
}

schema! {
    /// `ntp/scopes/chunk-*/file-*.parquet`: a row for each call that has a scope and each frame of its caller's window: what a network learns to put out for each frame.
    ///
    /// > Why so long a table? A frame's label depends on the call: the same frame is Inside for one call and Outside for its sibling. Spans in `calls` are the truth; this table spares a learner the derivation.
    SCOPES = scopes sorted_by("episode_index", "call_id") {
        /// which episode
        episode_index: Int64 delta,
        /// which call
        call_id: Int64 delta,
        /// which frame of the specification
        specification_frame: Int64 delta,
        /// 0 start, 1 end, 2 inside, 3 outside; a span of one frame is start
        label: Int64 delta,
        /// whether the call's scope begins at the frame
        is_start: Boolean,
        /// whether it ends at the frame; true together with `is_start` for a span of one frame
        is_end: Boolean,
    }
}

schema! {
    /// `ntp/episodes.parquet`: a row an episode, in order: where it comes from, how it ended, and where its rows lie.
    ///
    /// > Why beside LeRobot's own table of episodes? LeRobot's tools rewrite theirs; provenance must not depend on that.
    EPISODES = episodes {
        /// which episode
        episode_index: Int64,
        /// the trial's seed: 64 bits without a sign, as text because not every reader has such numbers
        seed: Text,
        /// which task
        task_id: Text,
        /// the task in words
        task_text: Text,
        /// `block_stacking`, `object_sorting` or `table_cleanup`
        family: Text,
        /// `seen` or `unseen`; one for all episodes of a task
        split: Text,
        /// which demonstration of the task
        trial: Int64,
        /// instances of each category on the table; of a block or bowl 1, or 0 when it stands aside; empty for eight blocks
        counts: Int64List,
        /// `expert`, or the model that acted
        actor: Text,
        /// `success`, or the cause of failure
        outcome: Text,
        /// the first cause of failure that was noticed; null for a success
        cause: OptionalText,
        /// whether the actor ended by itself and the goal held at rest
        success: Boolean,
        /// the recording's file, relative to the folder of recordings
        recording: Text,
        /// its hash
        recording_sha256: Text,
        /// the episode's number over all recordings: `ntp replay --episode`
        recording_index: Int64,
        /// rows in `frames`
        n_frames: Int64,
        /// frames in the recording
        n_recorded_frames: Int64,
        /// simulated time of the episode
        sim_secs: Float64,
        /// `episode` when the episode is its own specification, `demonstration` when a policy was given another
        specification: Text,
        /// frames of the specification
        specification_frames: Int64,
        /// names of the slots, in the order of observations
        slots: TextList,
        /// rows in `calls`
        n_calls: Int64,
        /// folder of the file in which they begin
        calls_chunk("calls/chunk_index"): Int64,
        /// that file
        calls_file("calls/file_index"): Int64,
        /// number of the first of them over all files
        calls_from("calls_from_index"): Int64,
        /// rows in `scopes`
        n_scopes: Int64,
        /// folder of the file in which they begin
        scopes_chunk("scopes/chunk_index"): Int64,
        /// that file
        scopes_file("scopes/file_index"): Int64,
        /// number of the first of them over all files
        scopes_from("scopes_from_index"): Int64,
    }
}

schema! {
    /// `meta/episodes/chunk-*/file-*.parquet`: a row an episode, as LeRobot reads it. A `*` in a name stands for each feature.
    META_EPISODES = meta_episodes sorted_by("episode_index") {
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

schema! {
    /// `meta/tasks.parquet`. The key-value metadata `pandas` makes the text the index of the table, because LeRobot takes it from there.
    TASKS = tasks {
        /// position of the row: LeRobot takes rows by position
        task_index: Int64,
        /// the task in words; the name that pandas gives an index without one, which every reader knows
        text("__index_level_0__"): Text,
    }
}

schema! {
    /// `meta/subtasks.parquet`, likewise.
    SUBTASKS = subtasks {
        /// position of the row
        subtask_index: Int64,
        /// a callee of the root with the slots it moves: `pick_and_place block_C block_F`
        text("subtask"): Text,
    }
}

/// Names of the features that each episode has statistics of.
fn features_of_episodes() -> Vec<String> {
    let features = FEATURES.iter().filter(|feature| feature.has_episode_statistics());
    features.map(|feature| feature.name.to_owned()).collect()
}
