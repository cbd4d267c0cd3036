//! Which recorded frames become rows, and spans counted in rows.

use crate::trace::Span;

/// Marks a frame that is no row.
const NO_ROW: u32 = u32::MAX;

/// Maps recorded frames to rows of an episode. Its buffers are used again for the next episode.
#[derive(Clone, Debug, Default)]
pub(crate) struct FrameMap {
    recorded: Vec<u32>,
    rows: Vec<u32>,
}

impl FrameMap {
    /// A map that keeps the frames for which `is_kept` is true.
    pub(crate) fn new(is_kept: impl IntoIterator<Item = bool>) -> Self {
        let mut map = Self::default();
        map.refill(is_kept);
        map
    }

    /// Begins anew with another episode's frames.
    pub(crate) fn refill(&mut self, is_kept: impl IntoIterator<Item = bool>) {
        self.recorded.clear();
        self.rows.clear();
        for (frame, kept) in is_kept.into_iter().enumerate() {
            if kept {
                self.rows.push(self.recorded.len() as u32);
                self.recorded.push(frame as u32);
            } else {
                self.rows.push(NO_ROW);
            }
        }
    }

    /// The recorded frames that are rows, in order.
    pub(crate) fn recorded(&self) -> &[u32] {
        &self.recorded
    }

    /// A span of recorded frames counted in rows; `None` when its first or last frame is no row.
    pub(crate) fn span(&self, recorded: Span) -> Option<Span> {
        let row = |frame: u32| self.rows.get(frame as usize).copied().filter(|&row| row != NO_ROW);
        Some(Span { begin: row(recorded.begin)?, end: row(recorded.end.checked_sub(1)?)? + 1 })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::{Strategy as _, prop_assert, prop_assert_eq, proptest};

    use super::{FrameMap, Span};

    proptest! {
        #[test]
        fn a_span_between_kept_frames_holds_the_same_frames_as_rows(
            kept in proptest::collection::vec(proptest::bool::ANY, 1..60).prop_filter("none kept", |kept| kept.contains(&true)),
            ends in (0_usize..60, 0_usize..60),
        ) {
            let map = FrameMap::new(kept.iter().copied());
            let n_rows = map.recorded().len();
            let (first, last) = (ends.0 % n_rows, ends.1 % n_rows);
            let (first, last) = (first.min(last), first.max(last));
            let recorded = Span { begin: map.recorded()[first], end: map.recorded()[last] + 1 };
            let rows = map.span(recorded).unwrap();
            prop_assert_eq!((rows.begin as usize, rows.end as usize), (first, last + 1));
            let inside = |frame: &u32| recorded.contains_frame(*frame);
            prop_assert_eq!(map.recorded().iter().filter(|frame| inside(frame)).count(), rows.len());
        }

        #[test]
        fn a_span_that_begins_or_ends_elsewhere_has_no_rows(
            kept in proptest::collection::vec(proptest::bool::ANY, 1..40),
            begin in 0_u32..45,
            length in 1_u32..45,
        ) {
            let map = FrameMap::new(kept.iter().copied());
            let span = Span { begin, end: begin + length };
            let is_kept = |frame: u32| kept.get(frame as usize).copied().unwrap_or(false);
            prop_assert_eq!(map.span(span).is_some(), is_kept(begin) && is_kept(begin + length - 1));
            prop_assert!(FrameMap::default().span(span).is_none());
        }
    }
}
