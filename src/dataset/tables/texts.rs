//! The tables of texts that `LeRobot` counts tasks and sub-tasks by.

pub(crate) mod read;
pub(crate) mod subtask;
pub(crate) mod write;

pub(crate) mod tasks {
    //! `meta/tasks.parquet`.

    use crate::table::table;

    table! {
        /// `meta/tasks.parquet`. The key-value metadata `pandas` makes the text the index of the table, because LeRobot takes it from there.
        tasks {
            /// position of the row: LeRobot takes rows by position
            task_index: Int64,
            /// the task in words; the name that pandas gives an index without one, which every reader knows
            text("__index_level_0__"): Text,
        }
    }
}

pub(crate) mod subtasks {
    //! `meta/subtasks.parquet`.

    use crate::table::table;

    table! {
        /// `meta/subtasks.parquet`, likewise.
        subtasks {
            /// position of the row
            subtask_index: Int64,
            /// a callee of the root with the slots it moves: `pick_and_place block_C block_F`
            text("subtask"): Text,
        }
    }
}
