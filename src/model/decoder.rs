//! From scoping labels to a span: which part of its window a program hands to its callee.
//!
//! # Source
//!
//! Paper, section IV, "Subsequence Selection": the span is a maximum contiguous subsequence sum, which is linear in
//! time; in practice the paper takes the likeliest Start and End.

use serde::{Deserialize, Serialize};

use crate::trace::{ScopingLabel, Span};

/// Log-probabilities of a frame's four labels, in the order of [`ScopingLabel::ALL`].
pub type LabelScores = [f32; ScopingLabel::ALL.len()];

/// How a span is chosen from the labels of a window's frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Decoder {
    /// The likeliest Start, and the likeliest End not before it: the paper's choice.
    Argmax,
    /// The maximum contiguous subsequence of the log odds of being in the part.
    #[default]
    Mss,
    /// The likeliest Start, then the End with the largest sum of those log odds.
    Am,
}

impl Decoder {
    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Argmax => "argmax",
            Self::Mss => "mss",
            Self::Am => "am",
        }
    }

    /// The span within a window; `None` for a window without frames. Of several best ones the first.
    pub fn decode(self, frames: &[LabelScores]) -> Option<Span> {
        let (begin, last) = match self {
            Self::Argmax => {
                let begin = first_max(frames.iter().map(|scores| scores[ScopingLabel::Start as usize]))?;
                let ends = frames[begin..].iter().map(|scores| scores[ScopingLabel::End as usize]);
                (begin, begin + first_max(ends)?)
            }
            Self::Mss => maximum_subsequence(frames.iter().map(log_odds))?,
            Self::Am => {
                let begin = first_max(frames.iter().map(|scores| scores[ScopingLabel::Start as usize]))?;
                let sums = frames[begin..].iter().scan(0.0, |sum, scores| {
                    *sum += log_odds(scores);
                    Some(*sum)
                });
                (begin, begin + first_max(sums)?)
            }
        };
        Span::new(begin as u32, last as u32 + 1)
    }
}

/// Of being in the part (Start, Inside or End) against outside it.
fn log_odds(scores: &LabelScores) -> f32 {
    let [start, end, inside, outside] = *scores;
    let largest = start.max(end).max(inside);
    let within = [start, end, inside].iter().map(|score| (score - largest).exp()).sum::<f32>().ln() + largest;
    within - outside
}

/// Position of the largest value, the first of several.
fn first_max(values: impl Iterator<Item = f32>) -> Option<usize> {
    let mut best: Option<(usize, f32)> = None;
    for (position, value) in values.enumerate() {
        if best.is_none_or(|(_, largest)| value > largest) {
            best = Some((position, value));
        }
    }
    best.map(|(position, _)| position)
}

/// First and last position of the contiguous part with the largest sum, at least one long, in one pass (Kadane).
pub fn maximum_subsequence(values: impl Iterator<Item = f32>) -> Option<(usize, usize)> {
    let mut best: Option<(f32, usize, usize)> = None;
    let (mut sum, mut begin) = (0.0_f32, 0);
    for (position, value) in values.enumerate() {
        if sum <= 0.0 {
            (sum, begin) = (0.0, position);
        }
        sum += value;
        if best.is_none_or(|(largest, ..)| sum > largest) {
            best = Some((sum, begin, position));
        }
    }
    best.map(|(_, begin, last)| (begin, last))
}
