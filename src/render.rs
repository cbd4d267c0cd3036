//! Scene states into pictures: colours, depths and segments, in software.
//!
//! # Input and output
//!
//! A [`Scene`](crate::scene::Scene) with its [`SceneState`](crate::scene::SceneState), of a recorded frame or of a
//! running world, and a [`Camera`]; a [`Picture`] out. [`Renderer::draw`] is all of it.
//!
//! # Units and frames
//!
//! Metres in the world's frame (z up); pixels as `foxglove.CameraCalibration` has them. See [`Camera`].
//!
//! # Invariants
//!
//! No physics, no graphics card, no display, no thread and no clock. The same arguments give the same bytes, whatever was
//! drawn before. Everything that is there is drawn, also bodies that no slot shows.

mod camera;
mod config;
mod look;
mod mesh;
mod model;
mod picture;
mod randomize;
mod raster;
mod renderer;
mod shade;
mod shadow;
mod texture;
mod view;
mod visibility;

pub use camera::{Camera, Mount, looking_at};
pub use config::{CameraConfig, CameraError, PictureFormat, PictureQuality, Viewpoint};
pub use look::{Letters, Light, Look, Shadows};
pub use picture::{Channel, Picture, Segment};
pub use randomize::Randomization;
pub use renderer::Renderer;
pub use visibility::Visibility;
