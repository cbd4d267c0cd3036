//! Where each colour slot's thing is: about the densest place of what the slot claims, so that letters, edges and shadows of
//! the same colour elsewhere do not pull it away as they do a mean over the whole picture.

use crate::model::colour_slots::claims::Claims;

/// Numbers of a find.
pub(crate) const FIND_WIDTH: usize = 6;

/// The densest place of a slot's claims in a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Find {
    /// Mean column and row of the claims about it, in pixels from the picture's upper left corner.
    pub(crate) centre: [f32; 2],
    /// How many pixels they amount to.
    pub(crate) mass: f32,
    /// Their standard deviations across and down, in pixels.
    pub(crate) spread: [f32; 2],
    /// How many pixels the slot claims elsewhere.
    pub(crate) elsewhere: f32,
}

/// Finds things in pictures of a size.
pub(crate) struct Finder {
    width: usize,
    height: usize,
    /// Of one slot in one picture: `[height, width]`.
    shares: Vec<f32>,
    /// Sums of the shares above: `[height + 1, width]`.
    above: Vec<f32>,
    neighbours: Neighbours,
}

impl Finder {
    pub(crate) fn new(width: usize, height: usize) -> Self {
        let (shares, above) = (vec![0.0; width * height], vec![0.0; width * (height + 1)]);
        Self { width, height, shares, above, neighbours: Neighbours::default() }
    }

    /// A slot's thing in a picture, looked for with a square window of `side` pixels.
    pub(crate) fn find(&mut self, claims: &Claims, picture: usize, slot: usize, side: usize) -> Find {
        self.shares.fill(0.0);
        for point in &claims.points[picture] {
            self.shares[point.row * self.width + point.column] = claims.shares(point)[slot];
        }
        self.sum_up();
        let [column, row] = self.densest(side);
        self.about(column, row, side)
    }

    fn sum_up(&mut self) {
        for row in 0..self.height {
            let (before, after) = self.above.split_at_mut((row + 1) * self.width);
            let before = &before[row * self.width..];
            let shares = &self.shares[row * self.width..][..self.width];
            for ((sum, above), share) in after.iter_mut().zip(before).zip(shares) {
                *sum = above + share;
            }
        }
    }

    /// The upper left corner of the window with the most in it; of equals the first.
    fn densest(&mut self, side: usize) -> [usize; 2] {
        let (across, down) = (side.min(self.width), side.min(self.height));
        let mut best = (f32::NEG_INFINITY, [0, 0]);
        for row in 0..=self.height - down {
            let above = &self.above[row * self.width..][..self.width];
            let until = &self.above[(row + down) * self.width..][..self.width];
            let columns = until.iter().zip(above).map(|(until, above)| until - above);
            let sums = self.neighbours.sums(columns, across);
            if most(sums) <= best.0 + 1e-4 {
                continue;
            }
            for (column, &sum) in sums.iter().enumerate() {
                if sum > best.0 + 1e-4 {
                    best = (sum, [column, row]);
                }
            }
        }
        best.1
    }

    /// Moments in a window, which is first moved so that its middle is the mean of what is in it.
    fn about(&self, column: usize, row: usize, side: usize) -> Find {
        let window = |column: i64, row: i64| {
            let clamp = |value: i64, size: usize| value.clamp(0, size as i64) as usize;
            let (columns, rows) = (column..column + side as i64, row..row + side as i64);
            let columns = clamp(columns.start, self.width)..clamp(columns.end, self.width);
            (columns, clamp(rows.start, self.height)..clamp(rows.end, self.height))
        };
        let (columns, rows) = window(column as i64, row as i64);
        let first = self.moments(columns, rows);
        let corner = first.centre.map(|middle| (middle - side as f32 / 2.0).round() as i64);
        let (columns, rows) = window(corner[0], corner[1]);
        let found = self.moments(columns, rows);
        let all: f32 = self.above[self.height * self.width..].iter().sum();
        Find { elsewhere: (all - found.mass).max(0.0), ..found }
    }

    fn moments(&self, columns: std::ops::Range<usize>, rows: std::ops::Range<usize>) -> Find {
        let middle = |range: &std::ops::Range<usize>| (range.start + range.end) as f32 / 2.0;
        let origin = [middle(&columns), middle(&rows)];
        let (mut mass, mut sums, mut squares) = (0.0_f32, [0.0_f32; 2], [0.0_f32; 2]);
        for row in rows {
            for column in columns.clone() {
                let share = self.shares[row * self.width + column];
                mass += share;
                for (axis, place) in [column, row].into_iter().enumerate() {
                    let offset = place as f32 + 0.5 - origin[axis];
                    sums[axis] += share * offset;
                    squares[axis] += share * offset * offset;
                }
            }
        }
        if mass < 1e-3 {
            return Find { centre: origin, ..Find::default() };
        }
        let mean = sums.map(|sum| sum / mass);
        let deviation = |axis: usize| (squares[axis] / mass - mean[axis] * mean[axis]).max(0.0).sqrt();
        let centre = [origin[0] + mean[0], origin[1] + mean[1]];
        Find { centre, mass, spread: [deviation(0), deviation(1)], elsewhere: 0.0 }
    }
}

/// The greatest of some numbers, eight at a time.
fn most(numbers: &[f32]) -> f32 {
    let (eights, rest) = numbers.as_chunks::<8>();
    let greater = |one: f32, other: f32| if one > other { one } else { other };
    let of_eights = eights
        .iter()
        .fold([f32::NEG_INFINITY; 8], |most, eight| std::array::from_fn(|lane| greater(eight[lane], most[lane])));
    of_eights.iter().chain(rest).copied().fold(f32::NEG_INFINITY, greater)
}

/// Sums of neighbours in a line. Those of twice as many follow from those of half as many, all along the line at once.
#[derive(Default)]
struct Neighbours {
    /// Sums of a power of two neighbours.
    spans: Vec<f32>,
    doubled: Vec<f32>,
    sums: Vec<f32>,
}

impl Neighbours {
    /// The sum of each `n` values that follow one another in `line`.
    fn sums(&mut self, line: impl Iterator<Item = f32>, n: usize) -> &[f32] {
        self.spans.clear();
        self.spans.extend(line);
        self.sums.clear();
        self.sums.resize((self.spans.len() + 1).saturating_sub(n), 0.0);
        let (mut span, mut n_summed) = (1, 0);
        while n_summed < n {
            if n & span != 0 {
                let further = self.spans.iter().skip(n_summed);
                self.sums.iter_mut().zip(further).for_each(|(sum, further)| *sum += further);
                n_summed += span;
            }
            self.doubled.clear();
            self.doubled.extend(self.spans.iter().zip(self.spans.iter().skip(span)).map(|(left, right)| left + right));
            std::mem::swap(&mut self.spans, &mut self.doubled);
            span *= 2;
        }
        &self.sums
    }
}

#[cfg(test)]
mod tests {
    use super::{Finder, Neighbours};
    use crate::model::colour_slots::Claims;

    #[test]
    fn a_thing_is_found_where_most_of_it_lies_whatever_there_is_elsewhere() {
        // A square of four pixels about (3, 3), and one pixel far away.
        let place = |column: usize, row: usize| (column, row, [1.0, 0.0]);
        let points = vec![place(2, 2), place(3, 2), place(2, 3), place(3, 3), place(11, 11)];
        let claims = Claims::made(2, points, Vec::new());
        let mut finder = Finder::new(12, 12);
        let find = finder.find(&claims, 0, 0, 4);
        assert_eq!((find.centre, find.mass, find.elsewhere), ([3.0, 3.0], 4.0, 1.0));
        assert_eq!(find.spread, [0.5, 0.5]);
        let nothing = finder.find(&claims, 0, 1, 4);
        assert_eq!((nothing.mass, nothing.elsewhere), (0.0, 0.0));
    }

    #[test]
    fn neighbours_are_summed_as_one_by_one() {
        let line = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0];
        for n in 1..=line.len() {
            let sums: Vec<f32> = line.windows(n).map(|window| window.iter().sum()).collect();
            assert_eq!(Neighbours::default().sums(line.into_iter(), n), sums, "{n}");
        }
        assert_eq!(Neighbours::default().sums(line.into_iter(), 8), [0.0; 0]);
    }
}
