//! The samples of one source, in order of time, and which of them a row takes.

use std::collections::VecDeque;

use super::counts::TopicCounts;
use super::map::{FeatureMap, Matching, nanos};
use super::sample::Content;

/// A message of a source.
struct Sample {
    nanos: i64,
    content: Content,
    /// Whether a row has taken it.
    is_used: bool,
    /// Of a packet: whether it is in the episode's video.
    is_written: bool,
}

/// The samples that rows may still take.
pub(super) struct Track {
    /// How many numbers a sample has; 0 of what is not numbers.
    pub(super) width: usize,
    matching: Matching,
    max_age_nanos: i64,
    samples: VecDeque<Sample>,
    pub(super) counts: TopicCounts,
    /// The sample that the row before took, by its time.
    last_taken: Option<i64>,
    /// Rows up to here have been made.
    decided_nanos: Option<i64>,
}

/// Which samples.
enum Chosen {
    One(usize),
    Between(usize, usize),
}

/// What a row takes.
pub(super) enum Taken {
    One(Content),
    /// Packets of a video, the last of which is shown.
    Packets(Vec<Vec<u8>>),
    /// The picture of the row before again, in a video that is not encoded again.
    Repeated,
    /// No sample is young enough.
    Stale,
}

impl Track {
    pub(super) fn new(feature: &FeatureMap, width: usize) -> Self {
        Self {
            width,
            matching: feature.matching,
            max_age_nanos: nanos(feature.max_age_secs),
            samples: VecDeque::new(),
            counts: TopicCounts::default(),
            last_taken: None,
            decided_nanos: None,
        }
    }

    /// How far behind a row messages may matter to it.
    pub(super) fn lookahead_nanos(&self) -> i64 {
        if self.matching == Matching::Last { 0 } else { self.max_age_nanos }
    }

    /// Time of the last sample.
    pub(super) fn last_nanos(&self) -> Option<i64> {
        self.samples.back().map(|sample| sample.nanos)
    }

    /// Adds a message.
    pub(super) fn push(&mut self, nanos: i64, content: Content) {
        let is_behind = self.samples.back().is_some_and(|last| nanos < last.nanos);
        let sample = Sample { nanos, content, is_used: false, is_written: false };
        if !is_behind {
            self.samples.push_back(sample);
        } else if self.decided_nanos.is_some_and(|decided| nanos <= decided)
            || matches!(sample.content, Content::Packet(..))
        {
            // A video's packets are decoded in the order of the file.
            self.counts.late += 1;
        } else {
            self.counts.out_of_order += 1;
            let at = self.samples.partition_point(|other| other.nanos <= nanos);
            self.samples.insert(at, sample);
        }
    }

    /// The first time from `begin` on at which there is a sample that is young enough.
    pub(super) fn first_from(&self, begin: i64) -> Option<i64> {
        let reach = match self.matching {
            Matching::Linear => 0,
            Matching::Last | Matching::Nearest => self.max_age_nanos,
        };
        let at = self.samples.partition_point(|sample| sample.nanos < begin.saturating_sub(reach));
        let first = self.samples.get(at)?.nanos;
        let is_before = self.samples.get(at).is_some_and(|sample| sample.nanos <= begin);
        Some(if is_before { begin } else { first })
    }

    /// An episode begins: its video has no packet yet.
    pub(super) fn begin_episode(&mut self) {
        self.samples.iter_mut().for_each(|sample| sample.is_written = false);
        self.last_taken = None;
    }

    /// Which samples the row at a time takes; `None` when none is young enough.
    fn choose(&self, at: i64) -> Option<Chosen> {
        let behind = self.samples.partition_point(|sample| sample.nanos <= at);
        let age = |position: usize| (at - self.samples[position].nanos).abs();
        let is_young = |position: &usize| age(*position) <= self.max_age_nanos;
        let before = behind.checked_sub(1).filter(is_young);
        let next = (behind < self.samples.len()).then_some(behind).filter(is_young);
        let chosen = match (self.matching, before, next) {
            (Matching::Last, before, _) => before?,
            (Matching::Nearest, Some(before), Some(next)) => {
                if age(before) <= age(next) {
                    before
                } else {
                    next
                }
            }
            (Matching::Nearest, before, next) => before.or(next)?,
            (Matching::Linear, Some(before), _) if age(before) == 0 => before,
            (Matching::Linear, before, next) => return Some(Chosen::Between(before?, next?)),
        };
        Some(Chosen::One(chosen))
    }

    /// Whether the row at a time can take something.
    pub(super) fn is_fresh(&self, at: i64) -> bool {
        match self.choose(at) {
            Some(Chosen::One(position) | Chosen::Between(position, _)) => match self.samples[position].content {
                Content::Packet(..) => self.key_before(position).is_some(),
                _ => true,
            },
            None => false,
        }
    }

    /// What the row at a time takes.
    pub(super) fn take(&mut self, at: i64) -> Taken {
        self.decided_nanos = Some(at);
        match self.choose(at) {
            Some(Chosen::One(position)) => self.one(position),
            Some(Chosen::Between(before, next)) => self.between(at, before, next),
            None => Taken::Stale,
        }
    }

    fn key_before(&self, position: usize) -> Option<usize> {
        (0..=position).rev().find(|&at| matches!(self.samples[at].content, Content::Packet(_, true)))
    }

    fn one(&mut self, position: usize) -> Taken {
        let sample = &mut self.samples[position];
        let is_repeated = self.last_taken.replace(sample.nanos) == Some(sample.nanos) && sample.is_used;
        sample.is_used = true;
        self.counts.repeated += u64::from(is_repeated);
        match &sample.content {
            Content::Packet(..) => self.packets(position),
            content => Taken::One(content.clone()),
        }
    }

    /// The packets from the last one in the video, or from the last key frame, up to a position.
    fn packets(&mut self, position: usize) -> Taken {
        let Some(key) = self.key_before(position) else { return Taken::Stale };
        let Some(first) = (key..=position).find(|&at| !self.samples[at].is_written) else { return Taken::Repeated };
        let packets = self.samples.range_mut(first..=position).filter_map(|sample| {
            sample.is_written = true;
            match &sample.content {
                Content::Packet(packet, _) => Some(packet.clone()),
                _ => None,
            }
        });
        Taken::Packets(packets.collect())
    }

    /// Numbers on the line between two samples; others are those before.
    fn between(&mut self, at: i64, before: usize, next: usize) -> Taken {
        let (begin, end) = (self.samples[before].nanos, self.samples[next].nanos);
        let (Content::Numbers(from), Content::Numbers(to)) =
            (&self.samples[before].content, &self.samples[next].content)
        else {
            return self.one(before);
        };
        let share = (at - begin) as f64 / (end - begin).max(1) as f64;
        let mixed = from.iter().zip(to).map(|(from, to)| from + (to - from) * share).collect();
        self.samples[before].is_used = true;
        self.samples[next].is_used |= share > 0.0;
        Taken::One(Content::Numbers(mixed))
    }

    /// Forgets what no row from a time on can take: of samples all before the last one that is not younger, of packets
    /// all before its key frame.
    pub(super) fn forget(&mut self, before: i64) {
        let old = self.samples.partition_point(|sample| sample.nanos <= before);
        let Some(mut keep) = old.checked_sub(1) else { return };
        if matches!(self.samples[keep].content, Content::Packet(..)) {
            keep = self.key_before(keep).unwrap_or(0);
        }
        for sample in self.samples.drain(..keep) {
            self.counts.dropped += u64::from(!sample.is_used);
        }
    }

    /// Forgets everything: the file is over.
    pub(super) fn end(&mut self) {
        self.counts.dropped += self.samples.iter().filter(|sample| !sample.is_used).count() as u64;
        self.samples.clear();
        (self.last_taken, self.decided_nanos) = (None, None);
    }
}
