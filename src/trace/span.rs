//! Half-open frame ranges and the scoping labels derived from them.
//!
//! # Source
//!
//! Paper, section IV, "Subsequence Selection (Scoping)".

use std::fmt;

use serde::{Deserialize, Serialize};

/// Frames `begin..end` of a task specification or of an episode; `end` is not included.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Span {
    /// First frame.
    pub begin: u32,
    /// One past the last frame; greater than `begin`.
    pub end: u32,
}

impl fmt::Display for Span {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}..{}", self.begin, self.end)
    }
}

impl Span {
    /// The span `begin..end`; `None` when it would be empty.
    pub fn new(begin: u32, end: u32) -> Option<Self> {
        (begin < end).then_some(Self { begin, end })
    }

    /// How many frames.
    pub fn len(self) -> usize {
        (self.end - self.begin) as usize
    }

    /// Never: a span holds at least one frame.
    pub fn is_empty(self) -> bool {
        self.end <= self.begin
    }

    /// Whether all of `inner` lies in this span.
    pub fn contains(self, inner: Self) -> bool {
        self.begin <= inner.begin && inner.end <= self.end
    }

    /// Whether a frame lies in this span.
    pub fn contains_frame(self, frame: u32) -> bool {
        (self.begin..self.end).contains(&frame)
    }

    /// The last frame.
    pub fn last(self) -> u32 {
        self.end - 1
    }

    /// The label of one frame with respect to this span. A span of one frame is `Start`; where the last frame matters
    /// compare it with [`Span::last`].
    pub fn label(self, frame: u32) -> ScopingLabel {
        if !self.contains_frame(frame) {
            ScopingLabel::Outside
        } else if frame == self.begin {
            ScopingLabel::Start
        } else if frame == self.last() {
            ScopingLabel::End
        } else {
            ScopingLabel::Inside
        }
    }
}

/// What one frame of a specification is to the part that a callee may see.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ScopingLabel {
    /// The first frame of the part.
    Start,
    /// The last frame of the part.
    End,
    /// Strictly between them.
    Inside,
    /// Not in the part.
    Outside,
}

impl ScopingLabel {
    /// Every label, in the order of the model's outputs.
    pub const ALL: [Self; 4] = [Self::Start, Self::End, Self::Inside, Self::Outside];

    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::End => "end",
            Self::Inside => "inside",
            Self::Outside => "outside",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{ScopingLabel, Span};

    #[test]
    fn labels_of_a_span_are_start_inside_end_and_outside_elsewhere() {
        use ScopingLabel::{End, Inside, Outside, Start};
        let span = Span { begin: 1, end: 4 };
        let labels: Vec<_> = (0..5).map(|frame| span.label(frame)).collect();
        assert_eq!(labels, [Outside, Start, Inside, End, Outside]);
    }

    #[test]
    fn a_span_of_one_frame_is_start() {
        assert_eq!(Span { begin: 2, end: 3 }.label(2), ScopingLabel::Start);
    }

    #[test]
    fn an_empty_span_cannot_be_made() {
        assert_eq!(Span::new(3, 3), None);
    }
}
