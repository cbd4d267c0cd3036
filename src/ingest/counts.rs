//! What became of every message.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::words::counted;

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
    /// With `clock = "header"`: how many messages of a topic have no stamp. They were taken at the time at which they
    /// were recorded.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub without_stamp: BTreeMap<String, u64>,
    /// Of topics with messages that cannot be used: when the first one came, and why it cannot.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub why_unusable: BTreeMap<String, String>,
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
    /// A line for each topic, and one for each whose messages have no stamp where the clock is that of stamps.
    pub fn lines(&self) -> Vec<String> {
        let unstamped = |(topic, n): (&String, &u64)| {
            let messages = counted(*n, "message");
            format!(
                "{topic}: {messages} without a stamp, taken when recorded: clock = \"header\" holds for none of them"
            )
        };
        let line = |(topic, counts): (&String, &TopicCounts)| {
            let TopicCounts { messages, dropped, repeated, out_of_order, late, unusable } = counts;
            let messages = counted(*messages, "message");
            format!(
                "{topic}: {messages}, {dropped} dropped, {repeated} repeated, {out_of_order} out of order, \
                 {late} late, {unusable} unusable{}",
                self.why_unusable.get(topic).map(|why| format!(" ({why})")).unwrap_or_default()
            )
        };
        self.topics.iter().map(line).chain(self.without_stamp.iter().map(unstamped)).collect()
    }

    /// Whether something that should have been in the dataset is not.
    pub fn is_lossy(&self) -> bool {
        self.cut > 0 || self.empty > 0 || self.topics.values().any(|counts| counts.late + counts.unusable > 0)
    }
}
