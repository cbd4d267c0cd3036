//! What became of every message.

use std::collections::BTreeMap;

use serde::Serialize;

/// What was written, and what became of every message.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct IngestSummary {
    /// Episodes.
    pub episodes: u64,
    /// Frames of all episodes.
    pub frames: u64,
    /// Distinct task texts.
    pub tasks: u64,
    /// Episodes that ended before their bound because a feature had no value that was young enough.
    pub cut: u64,
    /// Bounds between which no row was complete.
    pub empty: u64,
    /// Each topic that the map names.
    pub topics: BTreeMap<String, TopicCounts>,
}

/// What became of the messages of a topic, for one feature each: a topic that two features read counts twice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct TopicCounts {
    /// Messages.
    pub messages: u64,
    /// Messages that no row uses: there were more than rows, or they lie outside of episodes.
    pub dropped: u64,
    /// Rows that repeat the message of the row before.
    pub repeated: u64,
    /// Messages that came behind a younger one, and were put in order.
    pub out_of_order: u64,
    /// Messages that came when their row had been written, and are dropped.
    pub late: u64,
    /// Messages without the field, of another length, or that cannot be decoded.
    pub unusable: u64,
}

impl TopicCounts {
    pub(super) fn add(&mut self, other: Self) {
        let Self { messages, dropped, repeated, out_of_order, late, unusable } = other;
        self.messages += messages;
        self.dropped += dropped;
        self.repeated += repeated;
        self.out_of_order += out_of_order;
        self.late += late;
        self.unusable += unusable;
    }
}

impl IngestSummary {
    /// A line for each topic.
    pub fn lines(&self) -> Vec<String> {
        let line = |(topic, counts): (&String, &TopicCounts)| {
            let TopicCounts { messages, dropped, repeated, out_of_order, late, unusable } = counts;
            format!(
                "{topic}: {messages} messages, {dropped} dropped, {repeated} repeated, {out_of_order} out of order, \
                 {late} late, {unusable} unusable"
            )
        };
        self.topics.iter().map(line).collect()
    }

    /// Whether something that should have been in the dataset is not.
    pub fn is_lossy(&self) -> bool {
        self.cut > 0 || self.empty > 0 || self.topics.values().any(|counts| counts.late + counts.unusable > 0)
    }
}
