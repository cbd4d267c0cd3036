//! Groups of processes: what a command starts ends with it.

use std::process::{Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// How often it is looked whether a process has ended.
const GLANCE: Duration = Duration::from_millis(50);
/// How often it is looked whether a group that was told to end has ended: for 15 seconds.
const GLANCES: u32 = 300;

/// Puts a command into a group of its own, so that Ctrl-C reaches it as our `stop` alone.
#[cfg(unix)]
pub fn in_group(command: &mut Command) -> &mut Command {
    use std::os::unix::process::CommandExt as _;
    command.process_group(0)
}

/// Puts a command into a group of its own, where there are groups.
#[cfg(not(unix))]
pub fn in_group(command: &mut Command) -> &mut Command {
    command
}

/// Sends a signal (`TERM`, `KILL`, or `0`, which only asks) to the group of a process; whether there is one.
#[cfg(unix)]
pub fn signal_group(signal: &str, leader: u32) -> bool {
    let group = leader.to_string();
    let mut shell = Command::new("sh");
    shell.args(["-c", "kill -s \"$0\" -- \"-$1\"", signal, &group]).stderr(Stdio::null());
    shell.status().is_ok_and(|status| status.success())
}

/// Sends a signal to the group of a process, where there are groups.
#[cfg(not(unix))]
pub fn signal_group(_signal: &str, _leader: u32) -> bool {
    false
}

/// Runs a command to its end, in a group of its own. When `stop` is set the group is told to end and waited for, and
/// nothing is returned.
///
/// # Errors
///
/// When the command cannot be started.
pub fn run_in_group(command: &mut Command, stop: &AtomicBool) -> std::io::Result<Option<ExitStatus>> {
    let mut child = in_group(command).spawn()?;
    while !stop.load(Ordering::Relaxed) {
        if let Some(ended) = child.try_wait()? {
            return Ok(Some(ended));
        }
        std::thread::sleep(GLANCE);
    }
    signal_group("TERM", child.id());
    child.wait()?;
    // What it started keeps what is done before it ends.
    for _glance in 0..GLANCES {
        if !signal_group("0", child.id()) {
            break;
        }
        std::thread::sleep(GLANCE);
    }
    Ok(None)
}
