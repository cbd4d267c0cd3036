//! What can be wrong with pictures.

use std::path::PathBuf;

use crate::artifact::IoError;

/// Why pictures cannot be encoded or decoded.
#[derive(Debug, thiserror::Error)]
pub enum VideoError {
    /// A codec refuses.
    #[error("failed to {action} {codec}: {message}")]
    Codec {
        /// What was to be done.
        action: &'static str,
        /// With what.
        codec: &'static str,
        /// What the codec said.
        message: String,
    },
    /// A picture has another size than those before.
    #[error("a picture is {}x{} pixels, expected {}x{}", found[0], found[1], expected[0], expected[1])]
    Size {
        /// Width and height.
        found: [u32; 2],
        /// Width and height.
        expected: [u32; 2],
    },
    /// Bytes are left over or missing.
    #[error("a packet holds no picture that can be shown by itself")]
    NoPicture,
    /// A camera is turned away, or stands in something.
    #[error("none of the things in the scene is in any of its pictures")]
    SeesNothing,
    /// The container is not what it should be.
    #[error("{message}: {}", path.display())]
    Container {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// The file cannot be read or written.
    #[error(transparent)]
    Io(#[from] IoError),
}

impl VideoError {
    pub(super) fn codec(action: &'static str, codec: &'static str) -> impl Fn(&dyn std::fmt::Display) -> Self {
        move |message| Self::Codec { action, codec, message: message.to_string() }
    }
}
