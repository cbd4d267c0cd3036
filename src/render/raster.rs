//! Convex polygons into a buffer of nearness, row by row.
//!
//! # Invariants
//!
//! Two polygons that share an edge leave no gap along it and cover no sample twice: an edge's crossing of a row is
//! computed from its upper corner, whichever polygon it belongs to.

/// A sample that shows nothing.
pub(super) const NOTHING: u32 = u32::MAX;

/// An affine function of the sample's column and row: `x * column + y * row + constant`, at sample middles.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Affine {
    pub(super) x: f32,
    pub(super) y: f32,
    pub(super) constant: f32,
}

impl Affine {
    /// The value at the middle of a sample.
    pub(super) fn at(&self, column: usize, row: usize) -> f32 {
        self.x * (column as f32 + 0.5) + self.row(row)
    }

    fn row(&self, row: usize) -> f32 {
        self.y * (row as f32 + 0.5) + self.constant
    }
}

/// Samples that keep what is nearest: the greatest nearness wins.
#[derive(Debug, Default)]
pub(super) struct Raster {
    pub(super) width: usize,
    pub(super) height: usize,
    /// `[height, width]`.
    pub(super) nearness: Vec<f32>,
    /// Who is nearest, `[height, width]`.
    pub(super) owner: Vec<u32>,
    /// Columns where the polygon being filled begins and ends, for each row.
    spans: Vec<[u32; 2]>,
}

impl Raster {
    /// Empties the buffer; `farthest` loses against everything.
    pub(super) fn clear(&mut self, width: usize, height: usize, farthest: f32) {
        (self.width, self.height) = (width, height);
        self.nearness.clear();
        self.nearness.resize(width * height, farthest);
        self.owner.clear();
        self.owner.resize(width * height, NOTHING);
        self.spans.resize(height, [0; 2]);
    }

    /// Fills a convex polygon whose corners run anticlockwise in the picture (y down). Corners are in samples, the
    /// upper left corner of the first sample being (0, 0).
    pub(super) fn fill(&mut self, corners: &[[f32; 2]], nearness: &Affine, owner: u32) {
        let rows = self.trace(corners);
        for row in rows {
            let [begin, end] = self.spans[row];
            if begin >= end {
                continue;
            }
            let samples = row * self.width + begin as usize..row * self.width + end as usize;
            let base = nearness.row(row) + nearness.x * (begin as f32 + 0.5);
            let pairs = self.nearness[samples.clone()].iter_mut().zip(&mut self.owner[samples]);
            for (offset, (nearest, owned)) in pairs.enumerate() {
                let value = base + nearness.x * offset as f32;
                let wins = value > *nearest;
                *nearest = if wins { value } else { *nearest };
                *owned = if wins { owner } else { *owned };
            }
        }
    }

    /// Fills `spans` for the polygon's rows, which it returns.
    fn trace(&mut self, corners: &[[f32; 2]]) -> std::ops::Range<usize> {
        let (top, bottom) =
            corners.iter().fold((f32::MAX, f32::MIN), |(top, bottom), &[_, y]| (top.min(y), bottom.max(y)));
        let rows = self.rows(top, bottom);
        self.spans[rows.clone()].fill([0; 2]);
        let mut from = corners[corners.len() - 1];
        for &to in corners {
            if from[1] < to[1] {
                self.trace_edge(from, to, 0);
            } else if from[1] > to[1] {
                self.trace_edge(to, from, 1);
            }
            from = to;
        }
        rows
    }

    fn trace_edge(&mut self, upper: [f32; 2], lower: [f32; 2], side: usize) {
        let slope = (lower[0] - upper[0]) / (lower[1] - upper[1]);
        let width = self.width as f32;
        let rows = self.rows(upper[1], lower[1]);
        let first_row = rows.start as f32;
        for (offset, span) in self.spans[rows].iter_mut().enumerate() {
            let x = upper[0] + (first_row + offset as f32 + 0.5 - upper[1]) * slope;
            span[side] = (x + 0.5).clamp(0.0, width) as u32;
        }
    }

    /// The rows whose middles lie between two heights.
    fn rows(&self, top: f32, bottom: f32) -> std::ops::Range<usize> {
        let height = self.height as f32;
        let row = |y: f32| (y + 0.5).clamp(0.0, height) as usize;
        let begin = row(top);
        begin..row(bottom).max(begin)
    }
}
