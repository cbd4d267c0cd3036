//! Pictures and videos in the forms that files have: PNG, H.264, MP4, GIF.
//!
//! # Input and output
//!
//! RGB bytes, row by row, and a codec's bytes. [`Film`] draws an episode's frames with a camera and encodes them.
//! [`write_mp4`] and [`write_gif`] make clips for people, with the running programs below where [`ClipConfig`] asks.
//!
//! # Invariants
//!
//! The same pictures give the same bytes: encoders have no thread and no clock, and each episode begins with a fresh
//! one. H.264 is in Annex B, without B-frames, with parameter sets before each key frame; MP4 has constant frame rate.
//! No panic on any input.

mod clip;
mod container;
mod error;
mod film;
mod gif;
mod h264;
mod jpeg;
mod lanes;
mod mp4;
mod picture;
mod png;
mod remux;
mod seek;
mod track;

pub use clip::{Clip, ClipConfig, write_gif, write_mp4, write_png};
pub use error::VideoError;
pub use film::Film;
pub use gif::encode_gif;
pub use h264::{H264Decoder, H264Encoder, is_key_frame};
pub use jpeg::encode_jpeg;
pub use mp4::{Mp4Reader, Mp4Sample, Mp4Writer};
pub use picture::{decode_picture, is_picture, picture_size};
pub use png::{Rgb, decode_png, encode_png};
pub use remux::Mp4Remux;
pub use seek::Mp4Pictures;
pub use track::{TrackSample, VideoTrackFile};
