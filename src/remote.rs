//! Robots of others behind a protocol: lines of JSON over a child's pipes or TCP.
//!
//! # Input and output
//!
//! [`RemoteRobot`] is any robot as programs see it, a [`RobotApi`](crate::robot::RobotApi): it sends what an action asks
//! for and records what the robot reports. [`SimulatedRobot`] answers the same lines with our own simulation.
//! `schemas/robot.md` has every message.
//!
//! # Units and frames
//!
//! SI units; the table's frame: z up, the table's surface at z = 0, its middle at the origin.
//!
//! # Invariants
//!
//! What comes over the wire is not trusted: a line is bounded, every name, number and answer is checked, and waiting
//! ends. After the first thing that is wrong nothing is sent but one `stop`. No target outside of the announced table
//! is ever sent. This room knows no policy and no file.

mod error;
mod message;
mod robot;
mod server;
mod session;
mod state;
mod wire;

pub use error::{LinkProblem, RemoteError, RemoteProblem};
pub use message::PROTOCOL_VERSION;
pub use robot::RemoteRobot;
pub use server::{InProcess, SimulatedRobot, serve};
pub use session::Session;
pub use wire::{Address, AddressError, Echo, MAX_LINE_BYTES, Wire, connect};
