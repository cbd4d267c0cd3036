//! The contracts of a dataset's tables.

pub use crate::dataset::tables::calls::SCHEMA as CALLS;
pub use crate::dataset::tables::episodes::SCHEMA as EPISODES;
pub use crate::dataset::tables::frames::SCHEMA as FRAMES;
pub use crate::dataset::tables::meta_episodes::SCHEMA as META_EPISODES;
pub use crate::dataset::tables::scopes::SCHEMA as SCOPES;
pub use crate::dataset::tables::texts::subtasks::SCHEMA as SUBTASKS;
pub use crate::dataset::tables::texts::tasks::SCHEMA as TASKS;
use crate::table::TableSchema;

/// Every table of a dataset.
pub const ALL: [TableSchema; 7] = [FRAMES, META_EPISODES, TASKS, SUBTASKS, CALLS, SCOPES, EPISODES];
