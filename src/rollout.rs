//! Algorithm 1 as an interpreter over a policy, closed loop in physics, many episodes at a time.

mod policy;

pub use policy::{Decision, Policy, Query, Specification};
