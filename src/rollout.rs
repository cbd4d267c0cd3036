//! Algorithm 1 as an interpreter over a policy, closed loop in physics, many episodes at a time.
//!
//! # Input and output
//!
//! A [`Policy`] and [`Start`]s (a world and a demonstration each) give [`RolloutEpisode`]s: the same [`Episode`] value
//! that an expert yields, and how its decisions compare with the expert's.
//!
//! [`Episode`]: crate::trace::Episode

mod detections;
mod divergence;
mod expectation;
mod facts;
mod failure;
mod interpreter;
mod learned;
mod noisy;
mod oracle;
mod policy;
mod rows;

pub use detections::{Detected, DetectionRows, SCHEMA as DETECTIONS};
pub use divergence::{Divergence, DivergenceKind, expected_calls};
pub use expectation::Expectation;
pub use facts::{ModelFacts, SuiteFacts};
pub use failure::Failure;
pub use interpreter::{Eye, Limits, RolloutEpisode, RolloutError, Sight, Start, run};
pub use learned::{LearnedPolicy, load_policy, load_policy_on};
pub use noisy::Noisy;
pub use oracle::Oracle;
pub use policy::{Allowed, Decision, Policy, PolicyError, Query, Specification};
pub use rows::{Acted, RolloutRows, SCHEMA as ROLLOUTS};
