//! Statistics of the numeric features: of each episode while it is written, and of the whole dataset, exactly.
//!
//! Mean and deviation of the whole are merged from the episodes'. Quantiles cannot be merged: all numbers are kept, in a
//! temporary file where they are many, and selected from there, see [`quantile`]. `LeRobot` samples and takes an envelope instead.
//!
//! Numbers that are none (NaN, infinite) are left out, dimension by dimension: readers demand statistics that are numbers.
//!
//! Deviation is that of the population, quantiles are interpolated linearly between the two nearest values. Episodes
//! have no quantiles of their own: `LeRobot`'s readers do without, and of some twenty values they would say little.

pub(crate) mod batches;
mod number;
mod quantile;
mod spool;

use std::ops::Range;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::artifact::IoError;
use crate::dataset::config::ActionChoice;
use crate::dataset::files::info::Dtype;
use crate::dataset::tables::frames::feature::{FEATURES, Feature, JOINTS};
use crate::table::Values;

pub(in crate::dataset) use number::copy_values;
use number::{copy_keys, key_of};
use quantile::Selector;
use spool::Spool;

/// Rows of a block of keys: few enough to stay in a processor's cache.
const BLOCK_ROWS: usize = 256;

/// The quantiles of [`FeatureStatistics`].
const QUANTILES: [f64; 5] = [0.01, 0.1, 0.5, 0.9, 0.99];

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

/// Count, range, mean and sum of squared deviations of some rows, by dimension.
#[derive(Clone, Debug)]
struct Moments {
    /// Rows.
    count: u64,
    /// How many of them have a finite number, by dimension. The rest is of these.
    finite: Vec<u64>,
    min: Vec<f64>,
    max: Vec<f64>,
    mean: Vec<f64>,
    squares: Vec<f64>,
}

impl Moments {
    fn new(width: usize) -> Self {
        let zeros = vec![0.0; width];
        let finite = vec![0; width];
        Self { count: 0, finite, min: zeros.clone(), max: zeros.clone(), mean: zeros.clone(), squares: zeros }
    }

    /// Takes those of some rows, given one after another.
    fn measure(&mut self, values: &[f64]) {
        let width = self.mean.len();
        self.count = (values.len() / width) as u64;
        self.finite.fill(self.count);
        self.min.fill(f64::INFINITY);
        self.max.fill(f64::NEG_INFINITY);
        self.mean.fill(0.0);
        self.squares.fill(0.0);
        for row in values.chunks_exact(width) {
            let min_max = self.min.iter_mut().zip(&mut self.max);
            for (((min, max), sum), &value) in min_max.zip(&mut self.mean).zip(row) {
                *min = if value < *min { value } else { *min };
                *max = if value > *max { value } else { *max };
                *sum += value;
            }
        }
        // A sum with a number that is none is none.
        if self.mean.iter().any(|sum| !sum.is_finite()) {
            return (0..width).for_each(|at| self.measure_finite(at, values));
        }
        self.mean.iter_mut().for_each(|mean| *mean /= self.count as f64);
        for row in values.chunks_exact(width) {
            for ((squares, mean), value) in self.squares.iter_mut().zip(&self.mean).zip(row) {
                *squares += (value - mean) * (value - mean);
            }
        }
    }

    /// Takes those of the finite numbers of a dimension; of none at all they are NaN.
    fn measure_finite(&mut self, at: usize, values: &[f64]) {
        let finite = || values.iter().skip(at).step_by(self.mean.len()).copied().filter(|value| value.is_finite());
        let n = finite().count();
        let mean = finite().sum::<f64>() / n as f64;
        let squares = finite().map(|value| (value - mean) * (value - mean)).sum();
        let [min, max] = [f64::min, f64::max].map(|of| finite().reduce(of).unwrap_or(f64::NAN));
        self.finite[at] = n as u64;
        (self.min[at], self.max[at], self.mean[at], self.squares[at]) = (min, max, mean, squares);
    }

    /// Chan's pairwise update.
    fn merge(&mut self, other: &Self) {
        for at in 0..self.mean.len() {
            let (own, others) = (self.finite[at], other.finite[at]);
            let count = own + others;
            if others > 0 && own == 0 {
                (self.min[at], self.max[at]) = (other.min[at], other.max[at]);
                (self.mean[at], self.squares[at]) = (other.mean[at], other.squares[at]);
            } else if others > 0 {
                let share = others as f64 / count as f64;
                let delta = other.mean[at] - self.mean[at];
                self.squares[at] += other.squares[at] + delta * delta * own as f64 * share;
                self.mean[at] += delta * share;
                self.min[at] = self.min[at].min(other.min[at]);
                self.max[at] = self.max[at].max(other.max[at]);
            }
            self.finite[at] = count;
        }
        self.count += other.count;
    }

    fn std(&self) -> impl Iterator<Item = f64> {
        self.squares.iter().zip(&self.finite).map(|(squares, &n)| (squares / n as f64).sqrt())
    }
}

/// A feature that has statistics.
#[derive(Clone, Debug)]
pub(crate) struct NumericFeature {
    pub(crate) name: String,
    pub(crate) dtype: Dtype,
    pub(crate) width: usize,
    /// Whether each episode has statistics of its own.
    pub(crate) is_of_episodes: bool,
}

impl NumericFeature {
    /// Those of a dataset of ours, in the order of the columns.
    pub(crate) fn all(n_slots: usize, action: ActionChoice, has_joints: bool) -> Vec<Self> {
        let numeric = FEATURES.iter().filter(|feature| feature.is_numeric());
        let joints = has_joints.then_some(&JOINTS);
        numeric.chain(joints).map(|feature| Self::of(&feature.of_action(action), n_slots)).collect()
    }

    fn of(feature: &Feature, n_slots: usize) -> Self {
        Self {
            name: feature.name.to_owned(),
            dtype: feature.dtype,
            width: feature.width(n_slots),
            is_of_episodes: feature.has_episode_statistics(),
        }
    }
}

/// One feature's statistics of the episodes that are not yet written, and of all.
struct Gathered {
    feature: NumericFeature,
    columns: [String; 5],
    /// Minimum, maximum, mean and deviation of each episode, dimension by dimension.
    lists: [Vec<f64>; 4],
    counts: Vec<i64>,
    episode: Moments,
    whole: Moments,
}

/// Gathers the statistics of episodes.
pub(crate) struct Statistics {
    features: Vec<Gathered>,
    spool: Spool,
    values: Vec<f64>,
    bytes: Vec<u8>,
}

impl Statistics {
    /// Begins; numbers that are too many for memory are kept in a temporary file in `folder`.
    pub(crate) fn new(folder: &Path, features: Vec<NumericFeature>) -> Self {
        let features = features.into_iter().map(Gathered::new).collect();
        Self { features, spool: Spool::new(folder), values: Vec::new(), bytes: Vec::new() }
    }

    /// Adds an episode: some rows of the features' columns.
    pub(crate) fn append(&mut self, columns: &[(&str, Values<'_>)], rows: &Range<usize>) {
        for (gathered, (_, column)) in self.features.iter_mut().zip(columns) {
            copy_values(*column, rows.clone(), &mut self.values);
            gathered.append(&self.values);
        }
    }

    /// Adds some rows of an episode that comes in parts.
    pub(crate) fn append_part(&mut self, columns: &[(&str, Values<'_>)], rows: &Range<usize>) {
        for (gathered, (_, column)) in self.features.iter_mut().zip(columns) {
            copy_values(*column, rows.clone(), &mut self.values);
            gathered.episode.measure(&self.values);
            gathered.whole.merge(&gathered.episode);
        }
    }

    /// Keeps the first rows of the features' columns for the quantiles of the whole.
    pub(crate) fn keep(&mut self, columns: &[(&str, Values<'_>)], n_rows: usize) -> Result<(), IoError> {
        for begin in (0..n_rows).step_by(BLOCK_ROWS) {
            let rows = begin..n_rows.min(begin + BLOCK_ROWS);
            self.spool.begin_block(rows.len())?;
            for (_, (_, column)) in self.features.iter().zip(columns) {
                copy_keys(*column, rows.clone(), &mut self.bytes);
                self.spool.append(&self.bytes)?;
            }
        }
        Ok(())
    }

    /// The episodes' statistics as the columns `stats/FEATURE/NAME`.
    pub(crate) fn columns(&self) -> impl Iterator<Item = (&str, Values<'_>)> {
        self.features.iter().filter(|of| of.feature.is_of_episodes).flat_map(Gathered::columns)
    }

    /// Forgets the episodes' statistics, but not that of the whole.
    pub(crate) fn clear(&mut self) {
        for gathered in &mut self.features {
            gathered.lists.iter_mut().for_each(Vec::clear);
            gathered.counts.clear();
        }
    }

    /// Statistics of the whole dataset, by feature. One with a dimension that has no finite number has none.
    pub(crate) fn finish(self) -> Result<Vec<(String, FeatureStatistics)>, IoError> {
        let mut selectors: Vec<Vec<Selector>> = self.features.iter().map(Gathered::selectors).collect();
        self.spool.select(&mut selectors)?;
        let is_whole = |(of, _): &(&Gathered, &Vec<Selector>)| of.whole.finite.iter().all(|&n| n > 0);
        let pairs = self.features.iter().zip(&selectors).filter(is_whole);
        Ok(pairs.map(|(of, selectors)| (of.feature.name.clone(), of.whole_statistics(selectors))).collect())
    }
}

impl Gathered {
    fn new(feature: NumericFeature) -> Self {
        Self {
            columns: ["min", "max", "mean", "std", "count"].map(|name| format!("stats/{}/{name}", feature.name)),
            lists: Default::default(),
            counts: Vec::new(),
            episode: Moments::new(feature.width),
            whole: Moments::new(feature.width),
            feature,
        }
    }

    /// Adds an episode's values.
    fn append(&mut self, values: &[f64]) {
        self.episode.measure(values);
        self.whole.merge(&self.episode);
        if self.feature.is_of_episodes {
            let [min, max, mean, std] = &mut self.lists;
            min.extend_from_slice(&self.episode.min);
            max.extend_from_slice(&self.episode.max);
            mean.extend_from_slice(&self.episode.mean);
            std.extend(self.episode.std());
            self.counts.push(self.episode.count as i64);
        }
    }

    fn columns(&self) -> impl Iterator<Item = (&str, Values<'_>)> {
        let width = self.whole.mean.len();
        let lists = self.lists.iter().map(move |list| Values::Float64Vector(list, width));
        let counts = std::iter::once(Values::Int64Vector(&self.counts, 1));
        self.columns.iter().map(String::as_str).zip(lists.chain(counts))
    }

    fn selectors(&self) -> Vec<Selector> {
        let (dtype, whole) = (self.feature.dtype, &self.whole);
        let selector = |at: usize| {
            let ends = (key_of(dtype, whole.min[at]), key_of(dtype, whole.max[at]));
            Selector::new(dtype, ends, (whole.finite[at], whole.count), &QUANTILES)
        };
        (0..self.feature.width).map(selector).collect()
    }

    fn whole_statistics(&self, selectors: &[Selector]) -> FeatureStatistics {
        let quantile = |position: usize| selectors.iter().map(|selector| selector.quantile(position)).collect();
        FeatureStatistics {
            min: self.whole.min.clone(),
            max: self.whole.max.clone(),
            mean: self.whole.mean.clone(),
            std: self.whole.std().collect(),
            count: vec![self.whole.count as i64],
            q01: quantile(0),
            q10: quantile(1),
            q50: quantile(2),
            q90: quantile(3),
            q99: quantile(4),
        }
    }
}
