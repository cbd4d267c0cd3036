//! What the command line chooses.

use std::ops::RangeInclusive;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::model::ComputeDevice;
use crate::pipeline::Stage;
use crate::store::Store;

/// What the command line chooses.
#[derive(Clone, Debug)]
pub struct Options {
    /// First stage.
    pub from: Stage,
    /// Last stage.
    pub to: Stage,
    /// How much of the stages; anything but [`Scope::Whole`] is of one stage.
    pub scope: Scope,
    /// Threads.
    pub jobs: usize,
    /// What networks learn and decide on. No part of any plan: weights differ in their last bits, as between processors.
    pub device: ComputeDevice,
    /// Only say what would be done.
    pub dry_run: bool,
    /// Do again what is up to date.
    pub force: bool,
    /// Go on where the file system has no locks.
    pub no_lock: bool,
    /// Where the run is, if it is in a store: what lies in the run directory is then this machine's copy of a part of it.
    pub store: Option<Arc<dyn Store>>,
    /// Whether progress is shown on stderr.
    pub progress: bool,
    /// Of which commit the pipeline file is, for the costs; asked when something was done.
    pub commit: fn(&std::path::Path) -> Option<String>,
    /// Which experiment of a study is run; `None` for one by itself.
    pub experiment: Option<String>,
    /// Set when the user presses Ctrl-C.
    pub stop: Arc<AtomicBool>,
}

/// How much of a stage is done by this process.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Scope {
    /// All of it: begun, done and committed.
    Whole,
    /// Nothing but its plans.
    Begin,
    /// Shard `I` of every unit that has so many.
    Shard(u32),
    /// Items by their numbers.
    Items(Vec<RangeInclusive<u64>>),
    /// One of equal parts of all items.
    Part {
        /// Which, from 0. One beyond the last is nothing.
        part: u64,
        /// Of how many.
        of: u64,
    },
    /// What others have done is committed.
    Commit {
        /// For so many seconds it is waited for what is missing.
        wait_secs: u64,
    },
    /// What is finished in the store is brought here, of several stages too.
    Fetch,
}

impl Options {
    /// Whether other processes may do the same at the same time.
    pub(super) fn is_shared(&self) -> bool {
        self.store.is_some() || !matches!(self.scope, Scope::Whole | Scope::Begin)
    }
}

impl Scope {
    /// The option of the command line that chose it.
    pub(super) fn option(&self) -> &'static str {
        match self {
            Self::Whole => "",
            Self::Begin => "--begin",
            Self::Shard(_) => "--shard",
            Self::Items(_) => "--items",
            Self::Part { .. } => "--part",
            Self::Commit { .. } => "--commit",
            Self::Fetch => "--fetch",
        }
    }
}
