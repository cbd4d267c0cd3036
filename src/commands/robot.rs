//! `ntp robot --family FAMILY`: our simulation behind the protocol of robots.

use std::io::BufReader;
use std::net::TcpListener;

use anyhow::Context as _;

use crate::cli::RobotArgs;
use crate::commands::{CommandOutcome, output};
use crate::remote::{SimulatedRobot, serve};
use crate::seed::Seed;
use crate::sim::SimulationConfig;

/// Only this machine can connect, unless another host is named.
const LOOPBACK: &str = "127.0.0.1";

pub(super) fn run(args: &RobotArgs) -> anyhow::Result<CommandOutcome> {
    let config = SimulationConfig { robot: args.robot, ..SimulationConfig::default() };
    let robot = || SimulatedRobot::new(args.family, config.clone(), Seed(args.seed));
    match &args.listen {
        None => serve(&mut robot(), std::io::stdin().lock(), std::io::stdout().lock())?,
        Some(place) => listen(place, robot)?,
    }
    Ok(CommandOutcome::Done)
}

/// Serves one client after the other, each with a table of its own.
fn listen(place: &str, robot: impl Fn() -> SimulatedRobot) -> anyhow::Result<()> {
    let place = if place.contains(':') { place.to_owned() } else { format!("{LOOPBACK}:{place}") };
    let listener = TcpListener::bind(&place).with_context(|| format!("failed to listen on {place}"))?;
    output::note(&format!("listening on tcp://{}", listener.local_addr()?));
    for stream in listener.incoming() {
        let stream = stream?;
        stream.set_nodelay(true)?;
        let input = BufReader::new(stream.try_clone()?);
        if let Err(error) = serve(&mut robot(), input, stream) {
            output::note(&format!("a client was left: {error}"));
        }
    }
    Ok(())
}
