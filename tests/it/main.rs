//! The one integration binary. Each module is named for what its tests claim something about.

#[cfg(test)]
mod annotate;
#[cfg(test)]
mod architecture;
#[cfg(test)]
mod arm;
#[cfg(test)]
mod arm_pipeline;
#[cfg(test)]
mod artifact;
#[cfg(test)]
mod cli;
#[cfg(test)]
#[cfg(feature = "cloud")]
mod cloud;
#[cfg(test)]
mod cluster;
#[cfg(test)]
mod damaged_model;
#[cfg(test)]
mod dataset;
#[cfg(test)]
mod dataset_edit;
#[cfg(test)]
mod dataset_loading;
#[cfg(test)]
mod dataset_pictures;
#[cfg(test)]
mod detecting;
#[cfg(test)]
mod device;
#[cfg(test)]
mod documents;
#[cfg(test)]
mod expert;
#[cfg(test)]
mod export;
#[cfg(test)]
mod foreign;
#[cfg(test)]
mod forward;
#[cfg(test)]
mod fuzz;
#[cfg(test)]
mod import;
#[cfg(test)]
mod ingest;
#[cfg(test)]
mod kill;
#[cfg(test)]
mod killing;
#[cfg(test)]
mod kinematic;
#[cfg(test)]
mod kitting;
#[cfg(test)]
mod length;
#[cfg(test)]
mod lerobot;
#[cfg(test)]
mod lineage;
#[cfg(test)]
mod many_objects;
#[cfg(test)]
mod model;
#[cfg(test)]
mod painter;
#[cfg(test)]
mod perception;
#[cfg(test)]
mod pipeline;
#[cfg(test)]
mod pipeline_pictures;
#[cfg(test)]
mod pipeline_suites;
#[cfg(test)]
mod playback;
#[cfg(test)]
mod publish;
#[cfg(test)]
mod query;
#[cfg(test)]
mod recording;
#[cfg(test)]
mod remote;
#[cfg(test)]
mod render;
#[cfg(test)]
mod repair;
#[cfg(test)]
mod report;
#[cfg(test)]
mod rollout;
#[cfg(test)]
mod schemas;
#[cfg(test)]
mod schemas_parquet;
#[cfg(test)]
mod seeing;
#[cfg(test)]
mod several_cameras;
#[cfg(test)]
mod sim;
#[cfg(test)]
mod smoke;
#[cfg(test)]
mod stored;
#[cfg(test)]
mod study;
#[cfg(test)]
mod table;
#[cfg(test)]
mod task;
#[cfg(test)]
mod trace;
#[cfg(test)]
mod training;
#[cfg(test)]
mod tutorial;
#[cfg(test)]
mod variant;
#[cfg(test)]
mod video;
#[cfg(test)]
mod visualize;
#[cfg(test)]
mod your_data;
