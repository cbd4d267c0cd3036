//! The one integration binary. Each module is named for what its tests claim something about.

mod architecture;
mod artifact;
mod cli;
mod dataset;
mod expert;
mod kinematic;
mod model;
mod pipeline;
mod recording;
mod report;
mod rollout;
mod schemas;
mod sim;
mod table;
mod task;
mod trace;
mod training;
mod visualize;
