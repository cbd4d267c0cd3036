//! Files that are whole or not there, and the shard contract: plan → shards → receipts → manifest.
//!
//! Every stage writes through this module. A file comes under its final name by rename after fsync; a shard counts
//! only when its receipt is there; a stage counts only when its manifest is there. Readers follow receipts and
//! manifests and never list a folder.
//!
//! # Invariants
//!
//! Nothing here (plan, receipt, manifest) holds a clock, a host or a thread count: the same plan gives the same bytes.

mod atomic;
mod contract;
mod lock;
mod open;
mod plan;
mod record;
mod stage_dir;
mod staging;
mod unfinished;

pub use atomic::{
    AtomicFile, IoError, PARTIAL_PREFIX, create_dir, create_json, hex, read, read_json, remove_partials, sha256_bytes,
    sha256_file, to_json, write, write_json,
};
pub use contract::{ContractError, FileEntry, Manifest, Receipt};
pub use lock::{LockError, RunLock};
pub use open::{is_pointer, open};
pub use plan::Plan;
pub use stage_dir::{Committed, StageDir};
pub use staging::{StagedDir, StagingError};
pub use unfinished::remove_unfinished;
