//! Parts of the program that a build may leave out.
//!
//! # Invariants
//!
//! What is left out is refused by name, before anything is written, with the feature to ask for.

use std::fmt;

/// A part that a build may leave out: a feature of `Cargo.toml`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Feature {
    /// The stage `report`. In the default build.
    Report,
    /// `ntp query`. In the default build.
    Query,
    /// Episodes shown in Rerun: `ntp replay --save` and `--spawn`. In the default build.
    Viewer,
    /// Buckets.
    Cloud,
    /// Graphics cards behind Vulkan, Metal or DirectX.
    Wgpu,
    /// Cards of NVIDIA's.
    Cuda,
}

impl Feature {
    /// All of them.
    pub const ALL: [Self; 6] = [Self::Report, Self::Query, Self::Viewer, Self::Cloud, Self::Wgpu, Self::Cuda];

    /// Its name in `Cargo.toml`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Report => "report",
            Self::Query => "query",
            Self::Viewer => "viewer",
            Self::Cloud => "cloud",
            Self::Wgpu => "wgpu",
            Self::Cuda => "cuda",
        }
    }

    /// Whether this program was built with it.
    pub fn is_built_in(self) -> bool {
        match self {
            Self::Report => cfg!(feature = "report"),
            Self::Query => cfg!(feature = "query"),
            Self::Viewer => cfg!(feature = "viewer"),
            Self::Cloud => cfg!(feature = "cloud"),
            Self::Wgpu => cfg!(feature = "wgpu"),
            Self::Cuda => cfg!(feature = "cuda"),
        }
    }

    /// Refuses what this program was built without.
    ///
    /// # Errors
    ///
    /// [`NotBuiltIn`].
    pub fn require(self) -> Result<(), NotBuiltIn> {
        if self.is_built_in() { Ok(()) } else { Err(NotBuiltIn(self)) }
    }

    /// What it is for.
    fn purpose(self) -> &'static str {
        match self {
            Self::Report => "reports",
            Self::Query => "SQL",
            Self::Viewer => "the Rerun viewer",
            Self::Cloud => "buckets",
            Self::Wgpu => "wgpu",
            Self::Cuda => "CUDA",
        }
    }
}

impl fmt::Display for Feature {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Something is asked for that this program was built without.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("this program was built without {}; build it with: cargo build --release --features {}", .0.purpose(), .0.name())]
pub struct NotBuiltIn(pub Feature);
