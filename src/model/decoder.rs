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
    /// The span whose labelling is the likeliest, all frames counted: a maximum contiguous subsequence.
    #[default]
    Mss,
    /// The likeliest Start, then the End that makes the likeliest labelling with it.
    Am,
}

impl Decoder {
    /// Every decoder.
    pub const ALL: [Self; 3] = [Self::Argmax, Self::Mss, Self::Am];

    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Argmax => "argmax",
            Self::Mss => "mss",
            Self::Am => "am",
        }
    }

    /// The span within a window; `None` for a window without frames. Of several equally good ones the first.
    pub fn decode(self, frames: &[LabelScores]) -> Option<Span> {
        let start = || first_max(frames.iter().map(|scores| scores[ScopingLabel::Start as usize]));
        let (begin, last) = match self {
            Self::Argmax => {
                let begin = start()?;
                let ends = frames[begin..].iter().map(|scores| scores[ScopingLabel::End as usize]);
                (begin, begin + first_max(ends)?)
            }
            Self::Mss => likeliest_span(frames)?,
            Self::Am => {
                let begin = start()?;
                (begin, begin + likeliest_end(&frames[begin..])?)
            }
        };
        Span::new(begin as u32, last as u32 + 1)
    }
}

/// Log odds of a label against Outside, which the frame would have beyond the span.
fn odds(scores: &LabelScores, label: ScopingLabel) -> f32 {
    scores[label as usize] - scores[ScopingLabel::Outside as usize]
}

/// By how much a span's labelling (Start, Inside, …, Inside, End) is likelier than all frames Outside. A span of one
/// frame is Start.
pub fn span_score(frames: &[LabelScores], span: Span) -> f32 {
    (span.begin..span.end).map(|frame| odds(&frames[frame as usize], span.label(frame))).sum()
}

/// The likeliest span that begins at a frame and ends at one of `lasts`, or at any where there is none; nothing beyond
/// the frames.
pub fn span_from(frames: &[LabelScores], begin: u32, lasts: &[u32]) -> Option<Span> {
    let any: Vec<u32> = if lasts.is_empty() { (begin..frames.len() as u32).collect() } else { lasts.to_vec() };
    let spans = any.into_iter().filter_map(|last| Span::new(begin, last + 1));
    let within: Vec<Span> = spans.filter(|span| span.end as usize <= frames.len()).collect();
    let best = first_max(within.iter().map(|span| span_score(frames, *span)))?;
    within.get(best).copied()
}

/// The first and last frame of the span with the highest [`span_score`], in one pass: up to each frame it is enough to
/// know the best span that is still open there.
fn likeliest_span(frames: &[LabelScores]) -> Option<(usize, usize)> {
    let mut best: Option<(f32, usize, usize)> = None;
    let mut open: Option<(f32, usize)> = None;
    for (frame, scores) in frames.iter().enumerate() {
        let start = odds(scores, ScopingLabel::Start);
        let closed = open.map(|(score, begin)| (score + odds(scores, ScopingLabel::End), begin));
        for (score, begin) in [closed, Some((start, frame))].into_iter().flatten() {
            if best.is_none_or(|(highest, ..)| score > highest) {
                best = Some((score, begin, frame));
            }
        }
        let going_on = open.map(|(score, begin)| (score + odds(scores, ScopingLabel::Inside), begin));
        open = Some(going_on.filter(|(score, _)| *score >= start).unwrap_or((start, frame)));
    }
    best.map(|(_, begin, last)| (begin, last))
}

/// The last frame of the best span that starts at the first.
fn likeliest_end(frames: &[LabelScores]) -> Option<usize> {
    let mut inside = 0.0;
    let scores = frames.iter().enumerate().map(|(frame, scores)| match frame {
        0 => 0.0,
        _ => {
            let score = inside + odds(scores, ScopingLabel::End);
            inside += odds(scores, ScopingLabel::Inside);
            score
        }
    });
    first_max(scores)
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
