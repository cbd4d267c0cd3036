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
mod record;
mod staging;
mod unfinished;

pub use atomic::{
    AtomicFile, IoError, PARTIAL_PREFIX, create_dir, hex, read, read_json, remove_partials, sha256_bytes, sha256_file,
    write, write_json,
};
pub use contract::{ContractError, FileEntry, Manifest, Plan, Receipt, StageDir};
pub use lock::{LockError, RunLock};
pub use staging::{StagedDir, StagingError};
pub use unfinished::remove_unfinished;
