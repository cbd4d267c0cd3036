//! Exact quantiles of any number of values in bounded memory: radix selection.
//!
//! Values come as keys, whole numbers of the same order. A pass over all of them counts the highest 11 bits (of the
//! difference to the smallest) and so finds the bits that each wanted key begins with; the next pass counts the next 11
//! bits among the keys that begin so, until all bits are known. Three passes do for `float32`.
//!
//! # Invariants
//!
//! Memory is 16 kB for each wanted key at most, whatever the number of values.

use crate::dataset::feature::Dtype;
use crate::dataset::statistics::key::value_of;

const DIGIT_BITS: u32 = 11;
const N_DIGITS: usize = 1 << DIGIT_BITS;

/// Between which two of the sorted values a quantile lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    pub(super) below: u64,
    pub(super) above: u64,
    share: f64,
}

impl Place {
    pub(super) fn new(share: f64, count: u64) -> Self {
        let position = share * count.saturating_sub(1) as f64;
        let below = position.floor() as u64;
        Self { below, above: position.ceil() as u64, share: position - below as f64 }
    }

    pub(super) fn interpolate(&self, below: f64, above: f64) -> f64 {
        below + (above - below) * self.share
    }
}

/// One wanted key: that of a rank among the sorted ones.
struct Wanted {
    rank: u64,
    /// The bits that are known of its difference to the smallest.
    prefix: u64,
    /// How many keys are smaller than any that begins so.
    n_smaller: u64,
}

/// Selects the quantiles of one dimension.
pub(super) struct Selector {
    dtype: Dtype,
    min_key: u64,
    digits_left: u32,
    places: Vec<Place>,
    wanted: Vec<Wanted>,
    /// By prefix, in growing order.
    counts: Vec<(u64, Vec<u64>)>,
}

impl Selector {
    /// A selector among `count` keys from `min_key` to `max_key`.
    pub(super) fn new(dtype: Dtype, (min_key, max_key): (u64, u64), count: u64, shares: &[f64]) -> Self {
        let bits = u64::BITS - (max_key - min_key).leading_zeros();
        let places: Vec<Place> = shares.iter().map(|&share| Place::new(share, count)).collect();
        let mut ranks: Vec<u64> = places.iter().flat_map(|place| [place.below, place.above]).collect();
        ranks.sort_unstable();
        ranks.dedup();
        let wanted = ranks.into_iter().map(|rank| Wanted { rank, prefix: 0, n_smaller: 0 }).collect();
        let digits_left = bits.div_ceil(DIGIT_BITS);
        let mut selector = Self { dtype, min_key, digits_left, places, wanted, counts: Vec::new() };
        selector.begin_pass();
        selector
    }

    pub(super) fn is_done(&self) -> bool {
        self.digits_left == 0
    }

    fn begin_pass(&mut self) {
        self.counts.clear();
        if self.is_done() {
            return;
        }
        for wanted in &self.wanted {
            if self.counts.last().is_none_or(|(prefix, _)| *prefix != wanted.prefix) {
                self.counts.push((wanted.prefix, vec![0; N_DIGITS]));
            }
        }
    }

    /// Counts some keys, which are sorted.
    pub(super) fn count(&mut self, sorted_keys: &[u64]) {
        let low_bits = DIGIT_BITS * (self.digits_left - 1);
        let number = |key: &u64| (key - self.min_key) >> low_bits;
        for (prefix, counts) in &mut self.counts {
            let (first, last) = (*prefix << DIGIT_BITS, (*prefix << DIGIT_BITS) + N_DIGITS as u64);
            let begin = sorted_keys.partition_point(|key| number(key) < first);
            for number in sorted_keys[begin..].iter().map(number).take_while(|number| *number < last) {
                counts[(number - first) as usize] += 1;
            }
        }
    }

    pub(super) fn end_pass(&mut self) {
        for wanted in &mut self.wanted {
            let Some((_, counts)) = self.counts.iter().find(|(prefix, _)| *prefix == wanted.prefix) else { continue };
            let mut digit = 0;
            while digit + 1 < N_DIGITS && wanted.n_smaller + counts[digit] <= wanted.rank {
                wanted.n_smaller += counts[digit];
                digit += 1;
            }
            wanted.prefix = (wanted.prefix << DIGIT_BITS) | digit as u64;
        }
        self.digits_left -= 1;
        self.begin_pass();
    }

    /// The quantile of a position among the shares; right once the selector is done.
    pub(super) fn quantile(&self, position: usize) -> f64 {
        let place = self.places[position];
        let value = |rank: u64| {
            let wanted = self.wanted.iter().find(|wanted| wanted.rank == rank);
            wanted.map_or(f64::NAN, |wanted| value_of(self.dtype, wanted.prefix + self.min_key))
        };
        place.interpolate(value(place.below), value(place.above))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::{Strategy as _, any, prop_assert_eq, proptest};

    use super::super::key::{Numbers, value_of};
    use super::{Dtype, Place, Selector};

    const SHARES: [f64; 4] = [0.0, 0.1, 0.5, 1.0];

    fn selected(dtype: Dtype, numbers: Numbers<'_>) -> Vec<f64> {
        let (mut values, mut keys) = (Vec::new(), Vec::new());
        numbers.copy_dimension(0, (0, 1), &mut values, &mut keys);
        let chunks = keys.chunks_mut(7).map(|chunk| {
            chunk.sort_unstable();
            chunk.to_vec()
        });
        let chunks: Vec<Vec<u64>> = chunks.collect();
        keys.sort_unstable();
        let mut selector = Selector::new(dtype, (keys[0], keys[keys.len() - 1]), keys.len() as u64, &SHARES);
        while !selector.is_done() {
            chunks.iter().for_each(|chunk| selector.count(chunk));
            selector.end_pass();
        }
        (0..SHARES.len()).map(|position| selector.quantile(position)).collect()
    }

    fn by_sorting(values: impl Iterator<Item = f64>) -> Vec<f64> {
        let mut sorted: Vec<f64> = values.map(|value| value + 0.0).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let quantile = |&share: &f64| {
            let place = Place::new(share, sorted.len() as u64);
            place.interpolate(sorted[place.below as usize], sorted[place.above as usize])
        };
        SHARES.iter().map(quantile).collect()
    }

    proptest! {
        #[test]
        fn selection_finds_what_sorting_finds(
            floats in proptest::collection::vec(-1.0e3_f32..1.0e3, 1..200),
            doubles in proptest::collection::vec(any::<f64>().prop_filter("finite", |value| value.is_finite()), 1..100),
            whole in proptest::collection::vec(-1_000_000_i64..1_000_000, 1..100),
            flags in proptest::collection::vec(any::<bool>(), 1..50),
        ) {
            let expected = by_sorting(floats.iter().copied().map(f64::from));
            prop_assert_eq!(selected(Dtype::Float32, Numbers::Float32(&floats)), expected);
            let expected = by_sorting(doubles.iter().copied());
            prop_assert_eq!(selected(Dtype::Float64, Numbers::Float64(&doubles)), expected);
            let expected = by_sorting(whole.iter().map(|&value| value as f64));
            prop_assert_eq!(selected(Dtype::Int64, Numbers::Int64(&whole)), expected);
            let expected = by_sorting(flags.iter().map(|&flag| f64::from(u8::from(flag))));
            prop_assert_eq!(selected(Dtype::Bool, Numbers::Boolean(&flags)), expected);
        }

        #[test]
        fn keys_have_the_order_of_their_values(a in any::<f32>(), b in any::<f32>()) {
            let (mut values, mut keys) = (Vec::new(), Vec::new());
            Numbers::Float32(&[a, b]).copy_dimension(0, (0, 1), &mut values, &mut keys);
            if !a.is_nan() && !b.is_nan() {
                prop_assert_eq!(Some(keys[0].cmp(&keys[1])), a.partial_cmp(&b));
                prop_assert_eq!(value_of(Dtype::Float32, keys[0]), f64::from(a));
            }
        }
    }

    #[test]
    fn quantiles_of_one_two_three_four_are_interpolated() {
        assert_eq!(selected(Dtype::Float32, Numbers::Float32(&[4.0, 1.0, 3.0, 2.0])), [1.0, 1.3, 2.5, 4.0]);
    }
}
