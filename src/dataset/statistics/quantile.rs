//! Exact quantiles of any number of values in bounded memory: radix selection.
//!
//! Values come as keys, whole numbers of the same order. A pass over all of them counts the highest 11 bits (of the
//! difference to the smallest) and so finds the bits that each wanted key begins with; the next pass counts the next 11
//! bits among the keys that begin so, until all bits are known. Three passes do for `float32`.
//!
//! # Invariants
//!
//! Memory is 16 kB for each wanted key at most, whatever the number of values.

use crate::dataset::files::info::Dtype;
use crate::dataset::statistics::number::value_of;

const DIGIT_BITS: u32 = 11;
const N_DIGITS: usize = 1 << DIGIT_BITS;

/// Between which two of the sorted values a quantile lies.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Place {
    below: u64,
    above: u64,
    share: f64,
}

impl Place {
    fn new(share: f64, count: u64) -> Self {
        let position = share * count.saturating_sub(1) as f64;
        let below = position.floor() as u64;
        Self { below, above: position.ceil() as u64, share: position - below as f64 }
    }

    fn interpolate(&self, below: f64, above: f64) -> f64 {
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
    max_key: u64,
    /// Whether keys come that are not to be counted: they lie outside of the ends.
    has_others: bool,
    n_digits: u32,
    digits_left: u32,
    places: Vec<Place>,
    wanted: Vec<Wanted>,
    /// By prefix, in growing order.
    counts: Vec<(u64, Box<[u64; N_DIGITS]>)>,
    /// Whether a wanted key may begin with a digit: most keys are seen at once to begin otherwise.
    may_begin_with: Box<[bool; N_DIGITS]>,
}

impl Selector {
    /// A selector among `count` keys from `min_key` to `max_key`; those that come are so many in `all`.
    pub(super) fn new(dtype: Dtype, (min_key, max_key): (u64, u64), (count, all): (u64, u64), shares: &[f64]) -> Self {
        // Among no keys there is nothing to select.
        let (min_key, max_key) = if count == 0 { (0, 0) } else { (min_key, max_key) };
        let bits = u64::BITS - (max_key - min_key).leading_zeros();
        let places: Vec<Place> = shares.iter().map(|&share| Place::new(share, count)).collect();
        let mut ranks: Vec<u64> = places.iter().flat_map(|place| [place.below, place.above]).collect();
        ranks.sort_unstable();
        ranks.dedup();
        let wanted = ranks.into_iter().map(|rank| Wanted { rank, prefix: 0, n_smaller: 0 }).collect();
        let n_digits = bits.div_ceil(DIGIT_BITS);
        let (counts, may_begin_with) = (Vec::new(), Box::new([true; N_DIGITS]));
        let mut selector = Self {
            dtype,
            min_key,
            max_key,
            has_others: count < all,
            n_digits,
            digits_left: n_digits,
            places,
            wanted,
            counts,
            may_begin_with,
        };
        selector.begin_pass();
        selector
    }

    pub(super) fn dtype(&self) -> Dtype {
        self.dtype
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
                self.counts.push((wanted.prefix, Box::new([0; N_DIGITS])));
            }
        }
    }

    /// Counts some keys.
    pub(super) fn count(&mut self, keys: &[u64]) {
        if self.has_others {
            let ends = self.min_key..=self.max_key;
            let own: Vec<u64> = keys.iter().copied().filter(|key| ends.contains(key)).collect();
            self.count_own(&own);
        } else {
            self.count_own(keys);
        }
    }

    fn count_own(&mut self, keys: &[u64]) {
        let first_shift = DIGIT_BITS * (self.n_digits - 1);
        let shift = DIGIT_BITS * (self.digits_left - 1);
        let digit = |number: u64, shift: u32| (number >> shift) as usize % N_DIGITS;
        if let [(_, counts)] = &mut self.counts[..]
            && self.digits_left == self.n_digits
        {
            keys.iter().for_each(|key| counts[digit(key - self.min_key, shift)] += 1);
            return;
        }
        for number in keys.iter().map(|key| key - self.min_key) {
            if self.may_begin_with[digit(number, first_shift)] {
                let prefix = number >> shift >> DIGIT_BITS;
                if let Some((_, counts)) = self.counts.iter_mut().find(|(known, _)| *known == prefix) {
                    counts[digit(number, shift)] += 1;
                }
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
        if self.digits_left == self.n_digits {
            self.may_begin_with.fill(false);
            self.wanted.iter().for_each(|wanted| self.may_begin_with[wanted.prefix as usize % N_DIGITS] = true);
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

    use super::super::number::key_of;
    use super::{Dtype, Place, Selector, value_of};

    const SHARES: [f64; 4] = [0.0, 0.1, 0.5, 1.0];

    fn selected(dtype: Dtype, values: &[f64]) -> Vec<f64> {
        let keys: Vec<u64> = values.iter().map(|&value| key_of(dtype, value)).collect();
        let ends = (*keys.iter().min().unwrap(), *keys.iter().max().unwrap());
        let mut selector = Selector::new(dtype, ends, (keys.len() as u64, keys.len() as u64), &SHARES);
        while !selector.is_done() {
            keys.chunks(7).for_each(|keys| selector.count(keys));
            selector.end_pass();
        }
        (0..SHARES.len()).map(|position| selector.quantile(position)).collect()
    }

    fn by_sorting(values: &[f64]) -> Vec<f64> {
        let mut sorted: Vec<f64> = values.iter().map(|value| value + 0.0).collect();
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
            let floats: Vec<f64> = floats.into_iter().map(f64::from).collect();
            prop_assert_eq!(selected(Dtype::Float32, &floats), by_sorting(&floats));
            prop_assert_eq!(selected(Dtype::Float64, &doubles), by_sorting(&doubles));
            let whole: Vec<f64> = whole.into_iter().map(|value| value as f64).collect();
            prop_assert_eq!(selected(Dtype::Int64, &whole), by_sorting(&whole));
            let flags: Vec<f64> = flags.into_iter().map(|flag| f64::from(u8::from(flag))).collect();
            prop_assert_eq!(selected(Dtype::Bool, &flags), by_sorting(&flags));
        }

        #[test]
        fn keys_have_the_order_of_their_values(a in any::<f32>(), b in any::<f32>()) {
            let [key_a, key_b] = [a, b].map(|value| key_of(Dtype::Float32, f64::from(value)));
            if !a.is_nan() && !b.is_nan() {
                prop_assert_eq!(Some(key_a.cmp(&key_b)), a.partial_cmp(&b));
                prop_assert_eq!(value_of(Dtype::Float32, key_a), f64::from(a));
            }
        }
    }

    #[test]
    fn keys_beside_the_ends_are_not_counted() {
        let keys: Vec<u64> =
            [4.0, f64::NAN, 1.0, -f64::NAN, 3.0, f64::INFINITY, 2.0].map(|value| key_of(Dtype::Float32, value)).into();
        let ends = (key_of(Dtype::Float32, 1.0), key_of(Dtype::Float32, 4.0));
        let mut selector = Selector::new(Dtype::Float32, ends, (4, 7), &SHARES);
        while !selector.is_done() {
            selector.count(&keys);
            selector.end_pass();
        }
        assert_eq!([0, 1, 2, 3].map(|position| selector.quantile(position)), [1.0, 1.3, 2.5, 4.0]);
    }

    #[test]
    fn quantiles_of_one_two_three_four_are_interpolated() {
        assert_eq!(selected(Dtype::Float32, &[4.0, 1.0, 3.0, 2.0]), [1.0, 1.3, 2.5, 4.0]);
    }
}
