//! Statistics of the numeric features: of each episode while it is written, and of the whole dataset, exactly.
//!
//! Minimum, maximum, mean and deviation of the whole are merged from the episodes'. Quantiles cannot be merged: they are
//! selected from the written files, see [`quantile`]. `LeRobot` samples and takes an envelope instead; ours are exact.
//!
//! Deviation is that of the population, quantiles are interpolated linearly between the two nearest values.

mod quantile;

use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use arrow::array::{ArrayRef, Float64Array, Int64Array, ListArray};
use arrow::buffer::OffsetBuffer;
use arrow::datatypes::Field;
use arrow::error::ArrowError;
use serde::{Deserialize, Serialize};

use crate::dataset::feature::{FEATURES, Feature};
use crate::table::TableError;

use quantile::Selector;

/// The quantiles, each with its name.
pub(crate) const QUANTILES: [(&str, f64); 5] = [("q01", 0.01), ("q10", 0.1), ("q50", 0.5), ("q90", 0.9), ("q99", 0.99)];

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

/// The values of a numeric column, those of one row after another.
#[derive(Clone, Copy)]
pub(crate) enum Numbers<'a> {
    Float32(&'a [f32]),
    Float64(&'a [f64]),
    Int64(&'a [i64]),
    Boolean(&'a [bool]),
}

impl Numbers<'_> {
    /// One dimension of some rows. Zeros lose their sign, so that order and equality agree.
    fn copy_dimension(self, rows: Range<usize>, dimension: usize, width: usize, values: &mut Vec<f64>) {
        values.clear();
        let at = rows.map(|row| row * width + dimension);
        match self {
            Self::Float32(all) => values.extend(at.map(|at| f64::from(all[at]) + 0.0)),
            Self::Float64(all) => values.extend(at.map(|at| all[at] + 0.0)),
            Self::Int64(all) => values.extend(at.map(|at| all[at] as f64)),
            Self::Boolean(all) => values.extend(at.map(|at| f64::from(u8::from(all[at])))),
        }
    }
}

/// Count, mean and sum of squared deviations of one dimension, and its range.
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    count: u64,
    mean: f64,
    squares: f64,
    min: f64,
    max: f64,
}

impl Moments {
    /// Of some values, which are sorted.
    fn of(sorted: &[f64]) -> Self {
        let count = sorted.len();
        let mean = sorted.iter().sum::<f64>() / count as f64;
        let squares = sorted.iter().map(|value| (value - mean) * (value - mean)).sum();
        Self { count: count as u64, mean, squares, min: sorted[0], max: sorted[count - 1] }
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
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
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
    values: Vec<f64>,
}

impl Statistics {
    pub(crate) fn new(n_slots: usize) -> Self {
        let gathered = |feature: &'static Feature| {
            let width = feature.width(n_slots);
            let lists = std::array::from_fn(|_| Vec::new());
            Gathered { feature, width, lists, counts: Vec::new(), whole: vec![Moments::default(); width] }
        };
        let numeric = FEATURES.iter().filter(|feature| feature.is_numeric());
        Self { features: numeric.map(gathered).collect(), values: Vec::new() }
    }

    /// Adds an episode, whose values are in some rows of the numeric columns.
    pub(crate) fn append(&mut self, numbers: &[Numbers<'_>], rows: &Range<usize>) {
        for (gathered, numbers) in self.features.iter_mut().zip(numbers) {
            gathered.counts.push(rows.len() as i64);
            for dimension in 0..gathered.width {
                numbers.copy_dimension(rows.clone(), dimension, gathered.width, &mut self.values);
                self.values.sort_unstable_by(f64::total_cmp);
                gathered.append(dimension, &self.values);
            }
        }
    }

    /// Takes the episodes' statistics out as the columns `stats/FEATURE/NAME`.
    pub(crate) fn take(&mut self) -> Result<Vec<(String, ArrayRef)>, ArrowError> {
        let mut columns = Vec::new();
        for gathered in &mut self.features {
            gathered.take(&mut columns)?;
        }
        Ok(columns)
    }

    /// Statistics of the whole dataset, by feature: the quantiles are selected from the files of frames.
    pub(crate) fn finish(
        &self,
        root: &Path,
        files: &[String],
    ) -> Result<Vec<(&'static str, FeatureStatistics)>, TableError> {
        let selector = |moments: &Moments, feature: &Feature| {
            Selector::new(feature.dtype, moments.min, moments.max, moments.count, &QUANTILES.map(|(_, share)| share))
        };
        let features = self.features.iter();
        let mut selectors: Vec<(&'static str, Vec<Selector>)> = features
            .map(|of| (of.feature.name, of.whole.iter().map(|moments| selector(moments, of.feature)).collect()))
            .collect();
        quantile::select(root, files, &mut selectors)?;
        let pairs = self.features.iter().zip(&selectors);
        Ok(pairs.map(|(of, (name, selectors))| (*name, of.whole_statistics(selectors))).collect())
    }
}

impl Gathered {
    fn append(&mut self, dimension: usize, sorted: &[f64]) {
        let moments = Moments::of(sorted);
        self.lists[MIN].push(moments.min);
        self.lists[MAX].push(moments.max);
        self.lists[MEAN].push(moments.mean);
        self.lists[STD].push(moments.std());
        for (list, (_, share)) in self.lists[FIRST_QUANTILE..].iter_mut().zip(QUANTILES) {
            let place = quantile::Place::new(share, sorted.len() as u64);
            list.push(place.interpolate(sorted[place.below as usize], sorted[place.above as usize]));
        }
        self.whole[dimension].merge(&moments);
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

    fn whole_statistics(&self, selectors: &[Selector]) -> FeatureStatistics {
        let of_all = |value: fn(&Moments) -> f64| self.whole.iter().map(value).collect();
        let quantile = |position: usize| selectors.iter().map(|selector| selector.quantile(position)).collect();
        FeatureStatistics {
            min: of_all(|moments| moments.min),
            max: of_all(|moments| moments.max),
            mean: of_all(|moments| moments.mean),
            std: of_all(Moments::std),
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
