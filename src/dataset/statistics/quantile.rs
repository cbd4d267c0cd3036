//! Exact quantiles of columns of any length in bounded memory: radix selection.
//!
//! A value is turned into a whole number of the same order. A pass over the files counts the values by the highest 16
//! bits of that number (less the smallest one) and so finds the bits that each wanted value begins with; the next pass
//! counts the next 16 bits among the values that begin so, until all bits are known. Two passes do for `float32`.
//!
//! # Invariants
//!
//! Memory is 512 kB for each dimension and wanted value at most, whatever the length of the columns.

use std::path::Path;

use arrow::array::{Array, ArrayRef, AsArray as _};
use arrow::datatypes::{DataType, Float32Type, Float64Type, Int64Type};

use crate::dataset::feature::Dtype;
use crate::dataset::schema::FRAMES;
use crate::table::{TableError, TableReader};

const DIGIT_BITS: u32 = 16;
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

/// One wanted value: that of a rank among the sorted values.
struct Wanted {
    rank: u64,
    /// The bits that are known, less the smallest number.
    prefix: u64,
    /// How many values are smaller than any that begins with the prefix.
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
    pub(super) fn new(dtype: Dtype, min: f64, max: f64, count: u64, shares: &[f64]) -> Self {
        let (min_key, max_key) = (key_of(dtype, min), key_of(dtype, max));
        let bits = u64::BITS - (max_key - min_key).leading_zeros();
        let places: Vec<Place> = shares.iter().map(|&share| Place::new(share, count)).collect();
        let mut ranks: Vec<u64> = places.iter().flat_map(|place| [place.below, place.above]).collect();
        ranks.sort_unstable();
        ranks.dedup();
        let wanted = ranks.into_iter().map(|rank| Wanted { rank, prefix: 0, n_smaller: 0 }).collect();
        let mut selector =
            Self { dtype, min_key, digits_left: bits.div_ceil(DIGIT_BITS), places, wanted, counts: Vec::new() };
        selector.begin_pass();
        selector
    }

    fn is_done(&self) -> bool {
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

    fn count(&mut self, key: u64) {
        let number = key.wrapping_sub(self.min_key);
        let low = number >> (DIGIT_BITS * (self.digits_left - 1));
        let prefix = low >> DIGIT_BITS;
        if let Some((_, counts)) = self.counts.iter_mut().find(|(known, _)| *known == prefix) {
            counts[low as usize % N_DIGITS] += 1;
        }
    }

    fn end_pass(&mut self) {
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
            wanted.map_or(f64::NAN, |wanted| value_of(self.dtype, wanted.prefix.wrapping_add(self.min_key)))
        };
        place.interpolate(value(place.below), value(place.above))
    }
}

/// Passes over the files until every selector is done. Selectors are by column, one for each dimension.
pub(super) fn select(
    root: &Path,
    files: &[String],
    columns: &mut [(&'static str, Vec<Selector>)],
) -> Result<(), TableError> {
    loop {
        let mut open: Vec<_> =
            columns.iter_mut().filter(|(_, selectors)| selectors.iter().any(|one| !one.is_done())).collect();
        if open.is_empty() {
            return Ok(());
        }
        let names: Vec<&str> = open.iter().map(|(name, _)| *name).collect();
        for file in files {
            let mut reader = TableReader::open_columns(&root.join(file), &FRAMES, &names)?;
            while let Some(batch) = reader.next_batch()? {
                for (name, selectors) in &mut open {
                    if let Some(array) = batch.column_by_name(name) {
                        count_array(array, selectors);
                    }
                }
            }
        }
        let unfinished = open.iter_mut().flat_map(|(_, selectors)| selectors.iter_mut());
        unfinished.filter(|selector| !selector.is_done()).for_each(Selector::end_pass);
    }
}

fn count_array(array: &ArrayRef, selectors: &mut [Selector]) {
    let width = selectors.len();
    let values = array.as_list_opt::<i32>().map_or(array, |list| list.values());
    for (dimension, selector) in selectors.iter_mut().enumerate() {
        if selector.is_done() {
            continue;
        }
        match values.data_type() {
            DataType::Float32 => {
                let all = values.as_primitive::<Float32Type>().values().iter();
                all.skip(dimension).step_by(width).for_each(|&value| selector.count(key_of_f32(value)));
            }
            DataType::Float64 => {
                let all = values.as_primitive::<Float64Type>().values().iter();
                all.skip(dimension).step_by(width).for_each(|&value| selector.count(key_of_f64(value)));
            }
            DataType::Int64 => {
                let all = values.as_primitive::<Int64Type>().values().iter();
                all.for_each(|&value| selector.count(key_of_i64(value)));
            }
            _ => values.as_boolean().values().iter().for_each(|value| selector.count(u64::from(value))),
        }
    }
}

fn key_of_f32(value: f32) -> u64 {
    let bits = (value + 0.0).to_bits();
    u64::from(if bits >> 31 == 0 { bits | 1 << 31 } else { !bits })
}

fn key_of_f64(value: f64) -> u64 {
    let bits = (value + 0.0).to_bits();
    if bits >> 63 == 0 { bits | 1 << 63 } else { !bits }
}

fn key_of_i64(value: i64) -> u64 {
    value as u64 ^ 1 << 63
}

fn key_of(dtype: Dtype, value: f64) -> u64 {
    match dtype {
        Dtype::Float32 => key_of_f32(value as f32),
        Dtype::Float64 => key_of_f64(value),
        Dtype::Int64 => key_of_i64(value as i64),
        Dtype::Bool | Dtype::String => u64::from(value > 0.0),
    }
}

fn value_of(dtype: Dtype, key: u64) -> f64 {
    match dtype {
        Dtype::Float32 => {
            let bits = key as u32;
            f64::from(f32::from_bits(if bits >> 31 == 1 { bits & !(1 << 31) } else { !bits }))
        }
        Dtype::Float64 => f64::from_bits(if key >> 63 == 1 { key & !(1 << 63) } else { !key }),
        Dtype::Int64 => (key ^ 1 << 63) as i64 as f64,
        Dtype::Bool | Dtype::String => key as f64,
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::{any, prop_assert_eq, proptest};

    use super::{Dtype, Place, Selector, key_of};

    const SHARES: [f64; 4] = [0.0, 0.1, 0.5, 1.0];

    fn selected(dtype: Dtype, values: &[f64]) -> Vec<f64> {
        let mut sorted = values.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let (min, max) = (sorted[0], sorted[sorted.len() - 1]);
        let mut selector = Selector::new(dtype, min, max, values.len() as u64, &SHARES);
        while !selector.is_done() {
            values.iter().for_each(|&value| selector.count(key_of(dtype, value)));
            selector.end_pass();
        }
        (0..SHARES.len()).map(|position| selector.quantile(position)).collect()
    }

    fn by_sorting(values: &[f64]) -> Vec<f64> {
        let mut sorted = values.to_vec();
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
            doubles in proptest::collection::vec(-1.0e9_f64..1.0e9, 1..100),
            whole in proptest::collection::vec(-1_000_000_i64..1_000_000, 1..100),
            flags in proptest::collection::vec(any::<bool>(), 1..50),
        ) {
            let floats: Vec<f64> = floats.into_iter().map(|value| f64::from(value) + 0.0).collect();
            prop_assert_eq!(selected(Dtype::Float32, &floats), by_sorting(&floats));
            let doubles: Vec<f64> = doubles.into_iter().map(|value| value + 0.0).collect();
            prop_assert_eq!(selected(Dtype::Float64, &doubles), by_sorting(&doubles));
            let whole: Vec<f64> = whole.into_iter().map(|value| value as f64).collect();
            prop_assert_eq!(selected(Dtype::Int64, &whole), by_sorting(&whole));
            let flags: Vec<f64> = flags.into_iter().map(|flag| f64::from(u8::from(flag))).collect();
            prop_assert_eq!(selected(Dtype::Bool, &flags), by_sorting(&flags));
        }
    }

    #[test]
    fn quantiles_of_one_two_three_four_are_interpolated() {
        assert_eq!(selected(Dtype::Float32, &[4.0, 1.0, 3.0, 2.0]), [1.0, 1.3, 2.5, 4.0]);
    }
}
