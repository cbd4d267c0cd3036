//! A Rerun viewer on this machine, found listening or started.

use std::time::Duration;

use rerun::sink::{GrpcSink, LogSink as _};
use rerun::{SpawnError, SpawnOptions};

use crate::visualize::VisualizeError;
use crate::visualize::store::Store;

/// How long a viewer may take to receive all messages.
const FLUSH_TIMEOUT: Duration = Duration::from_secs(60);

/// A viewer that listens.
pub(super) struct Viewer {
    sink: GrpcSink,
}

/// Connects to the viewer that listens at Rerun's usual port, and starts one when none does.
pub(super) fn connect() -> Result<Viewer, VisualizeError> {
    let options = SpawnOptions { wait_for_bind: true, hide_welcome_screen: true, ..SpawnOptions::default() };
    rerun::spawn(&options).map_err(|error| match error {
        SpawnError::ExecutableNotFoundInPath { .. } | SpawnError::ExecutableNotFound { .. } => {
            VisualizeError::NoViewer { version: rerun::build_info().version.to_string() }
        }
        error @ SpawnError::Io(_) => VisualizeError::Viewer { message: error.to_string() },
    })?;
    Ok(Viewer { sink: GrpcSink::default() })
}

impl Viewer {
    /// Sends all messages of a store.
    pub(super) fn send(&self, store: Store) {
        self.sink.send_all(store.into_messages());
    }

    /// Waits until all is sent.
    pub(super) fn flush(&self) -> Result<(), VisualizeError> {
        self.sink.flush_blocking(FLUSH_TIMEOUT).map_err(|error| VisualizeError::Viewer { message: error.to_string() })
    }
}
