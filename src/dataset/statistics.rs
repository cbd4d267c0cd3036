//! Statistics of the numeric features: of each episode while it is written, and of the whole dataset, exactly.
//!
//! Mean and deviation of the whole are merged from the episodes'. Quantiles cannot be merged: the values are kept in a
//! temporary file and selected from it, see [`quantile`]. `LeRobot` samples and takes an envelope instead.
//!
//! Deviation is that of the population, quantiles are interpolated linearly between the two nearest values.

mod key;
mod quantile;
mod spool;

use std::path::Path;
use std::sync::Arc;

use arrow::array::{ArrayRef, Float64Array, Int64Array, ListArray};
use arrow::buffer::OffsetBuffer;
use arrow::datatypes::Field;
use arrow::error::ArrowError;
use serde::{Deserialize, Serialize};

use crate::artifact::IoError;
use crate::dataset::feature::{FEATURES, Feature};

pub(crate) use key::Numbers;
use key::{key_bytes, value_of};
use quantile::{Place, Selector};
use spool::Spool;

/// The quantiles, each with its name.
const QUANTILES: [(&str, f64); 5] = [("q01", 0.01), ("q10", 0.1), ("q50", 0.5), ("q90", 0.9), ("q99", 0.99)];

/// Statistics of one feature as `meta/stats.json` has them, a value per dimension. `count` is one number in a list.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct FeatureStatistics {
    pub(crate) min: Vec<f64>,
    pub(crate) max: Vec<f64>,
    pub(crate) mean: Vec<f64>,
    pub(crate) std: Vec<f64>,
    pub(crate) count: Vec<i64>,
    pub(crate) q01: Vec<f64>,
    pub(crate) q10: Vec<f64>,
    pub(crate) q50: Vec<f64>,
    pub(crate) q90: Vec<f64>,
    pub(crate) q99: Vec<f64>,
}

/// Count, mean and sum of squared deviations of one dimension, and its range.
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    count: u64,
    mean: f64,
    squares: f64,
    min_key: u64,
    max_key: u64,
}

impl Moments {
    /// Of some values and their sorted keys.
    fn of(values: &[f64], sorted_keys: &[u64]) -> Self {
        let count = values.len();
        let mean = values.iter().sum::<f64>() / count as f64;
        let squares = values.iter().map(|value| (value - mean) * (value - mean)).sum();
        Self { count: count as u64, mean, squares, min_key: sorted_keys[0], max_key: sorted_keys[count - 1] }
    }

    fn std(&self) -> f64 {
        (self.squares / self.count as f64).sqrt()
    }

    /// Chan's pairwise update.
    fn merge(&mut self, other: &Self) {
        if self.count == 0 {
            *self = *other;
            return;
        }
        let count = self.count + other.count;
        let delta = other.mean - self.mean;
        let share = other.count as f64 / count as f64;
        self.squares += other.squares + delta * delta * self.count as f64 * share;
        self.mean += delta * share;
        self.count = count;
        self.min_key = self.min_key.min(other.min_key);
        self.max_key = self.max_key.max(other.max_key);
    }
}

/// Positions in the nine lists of numbers.
const MIN: usize = 0;
const MAX: usize = 1;
const MEAN: usize = 2;
const STD: usize = 3;
const FIRST_QUANTILE: usize = 4;
const N_LISTS: usize = FIRST_QUANTILE + QUANTILES.len();

/// One feature's statistics of the episodes that are not yet written, and of all.
struct Gathered {
    feature: &'static Feature,
    width: usize,
    lists: [Vec<f64>; N_LISTS],
    counts: Vec<i64>,
    whole: Vec<Moments>,
}

/// Gathers the statistics of episodes.
pub(crate) struct Statistics {
    features: Vec<Gathered>,
    spool: Spool,
    values: Vec<f64>,
    keys: Vec<u64>,
}

impl Statistics {
    /// Begins; values are kept in a temporary file in `folder`.
    pub(crate) fn new(folder: &Path, n_slots: usize) -> Result<Self, IoError> {
        let gathered = |feature: &'static Feature| {
            let width = feature.width(n_slots);
            let lists = std::array::from_fn(|_| Vec::new());
            Gathered { feature, width, lists, counts: Vec::new(), whole: vec![Moments::default(); width] }
        };
        let numeric = FEATURES.iter().filter(|feature| feature.is_numeric());
        let features = numeric.map(gathered).collect();
        Ok(Self { features, spool: Spool::create(folder)?, values: Vec::new(), keys: Vec::new() })
    }

    /// Adds an episode: the rows of the numeric columns from `first_row` on.
    pub(crate) fn append(&mut self, columns: &[Numbers<'_>], first_row: usize, n_rows: usize) -> Result<(), IoError> {
        self.spool.begin_block(n_rows)?;
        let places = QUANTILES.map(|(_, share)| Place::new(share, n_rows as u64));
        for (gathered, numbers) in self.features.iter_mut().zip(columns) {
            for dimension in 0..gathered.width {
                numbers.copy_dimension(first_row, (dimension, gathered.width), &mut self.values, &mut self.keys);
                self.keys.sort_unstable();
                gathered.append(dimension, &self.values, &self.keys, &places);
                self.spool.append(&self.keys, key_bytes(gathered.feature.dtype))?;
            }
        }
        Ok(())
    }

    /// Takes the episodes' statistics out as the columns `stats/FEATURE/NAME`.
    pub(crate) fn take(&mut self) -> Result<Vec<(String, ArrayRef)>, ArrowError> {
        let mut columns = Vec::new();
        for gathered in self.features.iter_mut().filter(|of| of.feature.has_episode_statistics()) {
            gathered.take(&mut columns)?;
        }
        Ok(columns)
    }

    /// Statistics of the whole dataset, by feature.
    pub(crate) fn finish(self) -> Result<Vec<(&'static str, FeatureStatistics)>, IoError> {
        let shares = QUANTILES.map(|(_, share)| share);
        let selectors = self.features.iter().flat_map(|of| {
            let dtype = of.feature.dtype;
            let keys = |moments: &Moments| (moments.min_key, moments.max_key);
            of.whole
                .iter()
                .map(move |whole| (Selector::new(dtype, keys(whole), whole.count, &shares), key_bytes(dtype)))
        });
        let mut selectors: Vec<(Selector, usize)> = selectors.collect();
        self.spool.select(&mut selectors)?;
        let mut rest = &selectors[..];
        let whole = |of: &Gathered| {
            let (selectors, others) = rest.split_at(of.width);
            rest = others;
            (of.feature.name, of.whole_statistics(selectors))
        };
        Ok(self.features.iter().map(whole).collect())
    }
}

impl Gathered {
    fn append(&mut self, dimension: usize, values: &[f64], sorted_keys: &[u64], places: &[Place; 5]) {
        let moments = Moments::of(values, sorted_keys);
        self.whole[dimension].merge(&moments);
        if !self.feature.has_episode_statistics() {
            return;
        }
        if dimension == 0 {
            self.counts.push(values.len() as i64);
        }
        let value = |key: u64| value_of(self.feature.dtype, key);
        self.lists[MIN].push(value(moments.min_key));
        self.lists[MAX].push(value(moments.max_key));
        self.lists[MEAN].push(moments.mean);
        self.lists[STD].push(moments.std());
        for (list, place) in self.lists[FIRST_QUANTILE..].iter_mut().zip(places) {
            let nearest = [place.below, place.above].map(|rank| value(sorted_keys[rank as usize]));
            list.push(place.interpolate(nearest[0], nearest[1]));
        }
    }

    fn take(&mut self, columns: &mut Vec<(String, ArrayRef)>) -> Result<(), ArrowError> {
        let names = ["min", "max", "mean", "std"].into_iter().chain(QUANTILES.map(|(name, _)| name));
        let n_rows = self.counts.len();
        let column = |stat: &str| format!("stats/{}/{stat}", self.feature.name);
        for (position, (name, values)) in names.zip(&mut self.lists).enumerate() {
            if position == FIRST_QUANTILE {
                let counts: ArrayRef = Arc::new(Int64Array::from(std::mem::take(&mut self.counts)));
                columns.push((column("count"), lists(counts, 1, n_rows)?));
            }
            let values: ArrayRef = Arc::new(Float64Array::from(std::mem::take(values)));
            columns.push((column(name), lists(values, self.width, n_rows)?));
        }
        Ok(())
    }

    fn whole_statistics(&self, selectors: &[(Selector, usize)]) -> FeatureStatistics {
        let dtype = self.feature.dtype;
        let quantile = |position: usize| selectors.iter().map(|(selector, _)| selector.quantile(position)).collect();
        FeatureStatistics {
            min: self.whole.iter().map(|moments| value_of(dtype, moments.min_key)).collect(),
            max: self.whole.iter().map(|moments| value_of(dtype, moments.max_key)).collect(),
            mean: self.whole.iter().map(|moments| moments.mean).collect(),
            std: self.whole.iter().map(Moments::std).collect(),
            count: vec![self.whole[0].count as i64],
            q01: quantile(0),
            q10: quantile(1),
            q50: quantile(2),
            q90: quantile(3),
            q99: quantile(4),
        }
    }
}

fn lists(values: ArrayRef, width: usize, n_rows: usize) -> Result<ArrayRef, ArrowError> {
    let element = Arc::new(Field::new("element", values.data_type().clone(), false));
    let offsets = OffsetBuffer::from_lengths(std::iter::repeat_n(width, n_rows));
    Ok(Arc::new(ListArray::try_new(element, offsets, values, None)?))
}
