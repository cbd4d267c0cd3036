//! Killing programs while they run.

use std::process::Child;
use std::time::Duration;

/// Kills a program after a while, on Unix with SIGKILL; whether it was running still.
pub(crate) fn killed_after(mut child: Child, wait: Duration) -> bool {
    std::thread::sleep(wait);
    let was_running = child.try_wait().unwrap().is_none();
    // It may end by itself in between.
    let _ended = child.kill();
    child.wait().unwrap();
    was_running
}
