//! Where episodes begin and end in a file.

use std::collections::VecDeque;

use super::map::{Episodes, nanos};
use super::value::Value;

/// A bound of an episode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Bound {
    Begin,
    End,
}

/// The bounds of a file that have been met and not yet passed, in order of time.
pub(super) struct Bounds<'m> {
    map: &'m Episodes,
    queue: VecDeque<(i64, Bound)>,
    /// Of the topic whose gaps are bounds.
    last_nanos: Option<i64>,
    has_begun: bool,
}

impl<'m> Bounds<'m> {
    pub(super) fn new(map: &'m Episodes) -> Self {
        Self { map, queue: VecDeque::new(), last_nanos: None, has_begun: false }
    }

    /// The topic that tells bounds, if there is one.
    pub(super) fn topic(&self) -> Option<&'m str> {
        match self.map {
            Episodes::File => None,
            Episodes::Marker { topic, .. } | Episodes::Gap { topic, .. } => Some(topic),
        }
    }

    /// A feature's topic has a message.
    pub(super) fn sample(&mut self, at: i64) {
        if *self.map == Episodes::File && !self.has_begun {
            self.has_begun = true;
            self.queue.push_back((at, Bound::Begin));
        }
    }

    /// The bounds' topic has a message.
    pub(super) fn message(&mut self, at: i64, message: &Value) {
        match self.map {
            Episodes::File => {}
            Episodes::Gap { secs, .. } => {
                let last = self.last_nanos.replace(at);
                match last {
                    Some(last) if at - last <= nanos(*secs) => {}
                    Some(last) => self.queue.extend([(last + 1, Bound::End), (at, Bound::Begin)]),
                    None => self.queue.push_back((at, Bound::Begin)),
                }
            }
            Episodes::Marker { field, start, end, .. } => {
                let Some(value) = field.select(message) else { return };
                if start.is(&value) {
                    self.queue.push_back((at, Bound::Begin));
                } else if end.as_ref().is_some_and(|end| end.is(&value)) {
                    self.queue.push_back((at, Bound::End));
                }
            }
        }
    }

    /// The next bound.
    pub(super) fn next(&self) -> Option<(i64, Bound)> {
        self.queue.front().copied()
    }

    /// Passes the next bound.
    pub(super) fn pass(&mut self) {
        self.queue.pop_front();
    }
}
