//! Wires for tests: that remember, that spoil what a robot says, that say what is written down.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use ntp::remote::{LinkProblem, Wire};
use serde_json::Value;

/// Lines that are remembered, wherever the wire goes.
#[derive(Clone, Default)]
pub(crate) struct Lines(Arc<Mutex<Vec<String>>>);

impl Lines {
    pub(crate) fn lines(&self) -> Vec<String> {
        self.0.lock().unwrap().clone()
    }

    pub(crate) fn push(&self, line: &str) {
        self.0.lock().unwrap().push(line.to_owned());
    }

    /// Something that remembers what it is told.
    pub(crate) fn teller(&self) -> impl FnMut(&str) + Send + 'static {
        let lines = self.clone();
        move |line| lines.push(line)
    }
}

/// The methods that lines ask for.
pub(crate) fn methods(lines: &[String]) -> Vec<String> {
    let method = |line: &String| serde_json::from_str::<Value>(line).unwrap()["method"].as_str().unwrap().to_owned();
    lines.iter().map(method).collect()
}

/// A wire whose `at`-th received line, from 1, is spoiled.
pub(crate) struct Spoiled<W> {
    inner: W,
    at: usize,
    n_received: usize,
    spoil: fn(String) -> Result<String, LinkProblem>,
    sent: Lines,
}

impl<W> Spoiled<W> {
    pub(crate) fn new(inner: W, at: usize, spoil: fn(String) -> Result<String, LinkProblem>, sent: &Lines) -> Self {
        Self { inner, at, n_received: 0, spoil, sent: sent.clone() }
    }
}

impl<W: Wire> Wire for Spoiled<W> {
    fn send(&mut self, line: &str) -> Result<(), LinkProblem> {
        self.sent.push(line);
        self.inner.send(line)
    }

    fn receive(&mut self, within: Duration) -> Result<String, LinkProblem> {
        self.n_received += 1;
        let line = self.inner.receive(within)?;
        if self.n_received == self.at { (self.spoil)(line) } else { Ok(line) }
    }
}

/// A conversation, line by line with who says it.
#[derive(Clone, Default)]
pub(crate) struct Told(Lines);

struct Telling<W>(W, Lines);

fn said(by: &str, line: &str) -> String {
    format!("{{\"from\":\"{by}\",\"message\":{line}}}")
}

impl Told {
    pub(crate) fn around<W: Wire + 'static>(&self, wire: W) -> impl Wire + use<W> {
        Telling(wire, self.0.clone())
    }

    pub(crate) fn lines(&self) -> Vec<String> {
        self.0.lines()
    }

    /// What one of the two has said.
    pub(crate) fn lines_of(&self, by: &str) -> Vec<String> {
        let start = said(by, "").trim_end_matches('}').to_owned();
        let own = |line: &String| Some(line.strip_prefix(&start)?.strip_suffix('}')?.to_owned());
        self.lines().iter().filter_map(own).collect()
    }
}

impl<W: Wire> Wire for Telling<W> {
    fn send(&mut self, line: &str) -> Result<(), LinkProblem> {
        self.1.push(&said("ntp", line));
        self.0.send(line)
    }

    fn receive(&mut self, within: Duration) -> Result<String, LinkProblem> {
        let line = self.0.receive(within)?;
        self.1.push(&said("robot", &line));
        Ok(line)
    }
}

/// A robot that says what is written down, whatever it is asked, and is gone then.
pub(crate) fn scripted(lines: Vec<String>, sent: &Lines) -> impl Wire + use<> {
    Scripted(lines.into(), sent.clone())
}

struct Scripted(VecDeque<String>, Lines);

impl Wire for Scripted {
    fn send(&mut self, line: &str) -> Result<(), LinkProblem> {
        self.1.push(line);
        Ok(())
    }

    fn receive(&mut self, _within: Duration) -> Result<String, LinkProblem> {
        self.0.pop_front().ok_or(LinkProblem::Gone)
    }
}
