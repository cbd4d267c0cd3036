//! Lines to and from a robot: through the pipes of a child process, or TCP.

use std::fmt;
use std::io::{BufRead as _, BufReader, Read, Write};
use std::net::{Shutdown, TcpStream, ToSocketAddrs as _};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::str::FromStr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::Duration;

use crate::process;
use crate::remote::error::LinkProblem;

/// The longest line of either side.
pub const MAX_LINE_BYTES: usize = 1 << 20;
/// Lines that may wait to be read.
const MAX_WAITING: usize = 16;
/// How often waiting looks whether it shall end.
const GLANCE: Duration = Duration::from_millis(50);
/// How long a child may take to end by itself, in glances.
const FAREWELL_GLANCES: u32 = 40;
/// How long a connection may take.
const CONNECT: Duration = Duration::from_secs(10);

/// A way to send lines to a robot and to receive its own.
pub trait Wire: Send {
    /// Sends one line, which holds no line end.
    ///
    /// # Errors
    ///
    /// When the robot has gone.
    fn send(&mut self, line: &str) -> Result<(), LinkProblem>;

    /// The robot's next line, without its end.
    ///
    /// # Errors
    ///
    /// When none comes in time, it is too long or no text, the robot has gone, or the user ended the command.
    fn receive(&mut self, within: Duration) -> Result<String, LinkProblem>;
}

/// Where a robot is: a command that is it, or `tcp://HOST:PORT`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Address {
    /// A command for the shell; the robot reads and writes its standard streams.
    Command(String),
    /// Host and port.
    Tcp(String),
}

/// A robot's address that is none.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{found:?} is no robot; allowed: a command, or tcp://HOST:PORT")]
pub struct AddressError {
    found: String,
}

impl FromStr for Address {
    type Err = AddressError;

    fn from_str(word: &str) -> Result<Self, AddressError> {
        let wrong = || AddressError { found: word.to_owned() };
        match word.strip_prefix("tcp://") {
            Some(place) => {
                let port = place.rsplit_once(':').and_then(|(host, port)| port.parse::<u16>().ok().zip(Some(host)));
                port.filter(|(_, host)| !host.is_empty()).map(|_| Self::Tcp(place.to_owned())).ok_or_else(wrong)
            }
            None if word.trim().is_empty() || word.contains("://") => Err(wrong()),
            None => Ok(Self::Command(word.to_owned())),
        }
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Command(command) => write!(f, "`{command}`"),
            Self::Tcp(place) => write!(f, "tcp://{place}"),
        }
    }
}

/// Starts the robot's program or connects to it. Waiting for it ends when `stop` is set.
///
/// # Errors
///
/// When the program does not start or nobody listens.
pub fn connect(address: &Address, stop: Arc<AtomicBool>) -> Result<Box<dyn Wire>, LinkProblem> {
    let unreachable = |error: std::io::Error| LinkProblem::Unreachable(error.to_string());
    Ok(match address {
        Address::Command(command) => Box::new(Process::start(command, stop).map_err(unreachable)?),
        Address::Tcp(place) => Box::new(Tcp::connect(place, stop).map_err(unreachable)?),
    })
}

/// Lines that a thread reads, so that waiting for one can end.
struct Lines {
    receiver: Receiver<Result<String, LinkProblem>>,
    stop: Arc<AtomicBool>,
}

impl Lines {
    fn of(source: impl Read + Send + 'static, stop: Arc<AtomicBool>) -> Self {
        let (sender, receiver) = sync_channel(MAX_WAITING);
        std::thread::spawn(move || {
            let mut source = BufReader::new(source);
            loop {
                let line = read_line(&mut source);
                let is_last = line.is_err();
                if sender.send(line).is_err() || is_last {
                    return;
                }
            }
        });
        Self { receiver, stop }
    }

    fn next(&self, within: Duration) -> Result<String, LinkProblem> {
        let mut left = within;
        loop {
            if self.stop.load(Ordering::Relaxed) {
                return Err(LinkProblem::Interrupted);
            }
            let glance = left.min(GLANCE);
            match self.receiver.recv_timeout(glance) {
                Ok(line) => return line,
                Err(RecvTimeoutError::Disconnected) => return Err(LinkProblem::Gone),
                Err(RecvTimeoutError::Timeout) => left -= glance,
            }
            if left.is_zero() {
                return Err(LinkProblem::Late(within.as_secs()));
            }
        }
    }
}

/// One line without its end; never more than [`MAX_LINE_BYTES`] are held.
pub(super) fn read_line(source: &mut impl std::io::BufRead) -> Result<String, LinkProblem> {
    let mut line = Vec::new();
    let most = MAX_LINE_BYTES as u64 + 1;
    source.take(most).read_until(b'\n', &mut line).map_err(|_error| LinkProblem::Gone)?;
    let has_end = line.pop_if(|last| *last == b'\n').is_some();
    match has_end {
        false if line.len() > MAX_LINE_BYTES => Err(LinkProblem::TooLong),
        false => Err(LinkProblem::Gone),
        true => String::from_utf8(line).map_err(|_error| LinkProblem::NotText),
    }
}

fn send_line(target: &mut impl Write, line: &str) -> Result<(), LinkProblem> {
    let line = format!("{line}\n");
    target.write_all(line.as_bytes()).and_then(|()| target.flush()).map_err(|_error| LinkProblem::Gone)
}

/// A robot's program. When it is dropped, its input is closed; a program that stays is ended.
struct Process {
    child: Child,
    input: Option<ChildStdin>,
    lines: Lines,
}

impl Process {
    fn start(command: &str, stop: Arc<AtomicBool>) -> std::io::Result<Self> {
        let mut shell = shell(command);
        let mut child = process::in_group(&mut shell).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
        let missing = || std::io::Error::other("it has no standard streams");
        let input = child.stdin.take().ok_or_else(missing)?;
        let output = child.stdout.take().ok_or_else(missing)?;
        Ok(Self { child, input: Some(input), lines: Lines::of(output, stop) })
    }
}

#[cfg(unix)]
fn shell(command: &str) -> Command {
    let mut shell = Command::new("sh");
    shell.args(["-c", command]);
    shell
}

#[cfg(not(unix))]
fn shell(command: &str) -> Command {
    let mut shell = Command::new("cmd");
    shell.args(["/C", command]);
    shell
}

impl Wire for Process {
    fn send(&mut self, line: &str) -> Result<(), LinkProblem> {
        self.input.as_mut().ok_or(LinkProblem::Gone).and_then(|input| send_line(input, line))
    }

    fn receive(&mut self, within: Duration) -> Result<String, LinkProblem> {
        self.lines.next(within)
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.input = None;
        for _ in 0..FAREWELL_GLANCES {
            if !matches!(self.child.try_wait(), Ok(None)) {
                return;
            }
            std::thread::sleep(GLANCE);
        }
        // Also what the shell has started: a robot that hangs must not outlive us.
        process::signal_group("KILL", self.child.id());
        let _gone = self.child.kill().and_then(|()| self.child.wait());
    }
}

/// A robot that listens.
struct Tcp {
    stream: TcpStream,
    lines: Lines,
}

impl Tcp {
    fn connect(place: &str, stop: Arc<AtomicBool>) -> std::io::Result<Self> {
        let mut result = Err(std::io::Error::other("the host has no address"));
        for address in place.to_socket_addrs()? {
            result = TcpStream::connect_timeout(&address, CONNECT);
            if result.is_ok() {
                break;
            }
        }
        let stream = result?;
        stream.set_nodelay(true)?;
        stream.set_write_timeout(Some(CONNECT))?;
        let lines = Lines::of(stream.try_clone()?, stop);
        Ok(Self { stream, lines })
    }
}

impl Wire for Tcp {
    fn send(&mut self, line: &str) -> Result<(), LinkProblem> {
        send_line(&mut self.stream, line)
    }

    fn receive(&mut self, within: Duration) -> Result<String, LinkProblem> {
        self.lines.next(within)
    }
}

impl Drop for Tcp {
    fn drop(&mut self) {
        let _gone = self.stream.shutdown(Shutdown::Both);
    }
}

/// A wire whose sent lines are told before they are sent.
pub struct Echo<W, F> {
    inner: W,
    tell: F,
}

impl<W: Wire, F: FnMut(&str) + Send> Echo<W, F> {
    /// Around another wire.
    pub fn new(inner: W, tell: F) -> Self {
        Self { inner, tell }
    }
}

impl<W: Wire, F: FnMut(&str) + Send> Wire for Echo<W, F> {
    fn send(&mut self, line: &str) -> Result<(), LinkProblem> {
        (self.tell)(line);
        self.inner.send(line)
    }

    fn receive(&mut self, within: Duration) -> Result<String, LinkProblem> {
        self.inner.receive(within)
    }
}
