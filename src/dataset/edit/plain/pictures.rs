//! Statistics of pictures summed up from those of episodes, as `LeRobot` does: nothing is decoded.

use std::collections::BTreeMap;

use arrow::array::{ArrayRef, AsArray as _, RecordBatch};
use arrow::compute::cast;
use arrow::datatypes::{DataType, Float64Type};
use serde_json::{Map, Value, json};

use crate::dataset::edit::plain::json::shaped;
use crate::dataset::plain::list_at;

/// Statistics of one feature of pictures, by their names: a number a channel.
#[derive(Default)]
pub(super) struct PictureSums {
    /// Lists in lists: pictures have three, a channel and two of one.
    depth: usize,
    count: f64,
    /// Least and greatest.
    ends: Option<[Vec<f64>; 2]>,
    mean: Vec<f64>,
    squares: Vec<f64>,
    /// Weighted sums of quantiles; those that an episode lacks are given up.
    quantiles: Option<BTreeMap<String, Vec<f64>>>,
    /// Whether an episode had no statistics.
    is_incomplete: bool,
}

impl PictureSums {
    pub(super) fn new(depth: usize) -> Self {
        Self { depth, ..Self::default() }
    }

    /// Adds an episode by its row.
    pub(super) fn add(&mut self, feature: &str, row: &RecordBatch) {
        let of = |name: &str| row.column_by_name(&format!("stats/{feature}/{name}")).and_then(flat);
        let found = (of("count"), of("min"), of("max"), of("mean"), of("std"));
        let (Some(count), Some(min), Some(max), Some(mean), Some(std)) = found else {
            self.is_incomplete = true;
            return;
        };
        let n = count.first().copied().unwrap_or(0.0);
        let is_like =
            |list: &Vec<f64>| list.len() == mean.len() && (self.count == 0.0 || list.len() == self.mean.len());
        if n <= 0.0 || ![&min, &max, &mean, &std].into_iter().all(is_like) {
            self.is_incomplete = true;
            return;
        }
        let quantiles: BTreeMap<String, Vec<f64>> = row
            .schema_ref()
            .fields()
            .iter()
            .filter_map(|field| {
                let name = field.name().strip_prefix("stats/")?.strip_prefix(feature)?.strip_prefix("/q")?;
                Some((format!("q{name}"), of(&format!("q{name}"))?.iter().map(|value| value * n).collect()))
            })
            .collect();
        if self.count == 0.0 {
            self.mean = vec![0.0; mean.len()];
            self.squares = vec![0.0; mean.len()];
            self.quantiles = Some(quantiles);
        } else if let Some(sums) = &mut self.quantiles {
            sums.retain(|name, _| quantiles.contains_key(name));
            for (name, sum) in sums {
                sum.iter_mut().zip(&quantiles[name]).for_each(|(sum, value)| *sum += value);
            }
        }
        self.merge(n, &mean, &std);
        let [low, high] = self.ends.get_or_insert_with(|| [min.clone(), max.clone()]);
        low.iter_mut().zip(min).for_each(|(low, value)| *low = low.min(value));
        high.iter_mut().zip(max).for_each(|(high, value)| *high = high.max(value));
    }

    /// Chan's pairwise update.
    fn merge(&mut self, n: f64, mean: &[f64], std: &[f64]) {
        let total = self.count + n;
        for at in 0..mean.len() {
            let delta = mean[at] - self.mean[at];
            self.squares[at] += std[at] * std[at] * n + delta * delta * self.count * n / total;
            self.mean[at] += delta * n / total;
        }
        self.count = total;
    }

    /// As `meta/stats.json` has them; `None` where an episode had none.
    pub(super) fn finish(self) -> Option<Value> {
        let [low, high] = self.ends.filter(|_| !self.is_incomplete)?;
        let shape = &[self.mean.len(), 1, 1][..self.depth.clamp(1, 3)];
        let std: Vec<f64> = self.squares.iter().map(|squares| (squares / self.count).sqrt()).collect();
        let mut of = Map::new();
        for (name, numbers) in [("min", &low), ("max", &high), ("mean", &self.mean), ("std", &std)] {
            of.insert(name.to_owned(), shaped(numbers, shape));
        }
        of.insert("count".to_owned(), json!([self.count as u64]));
        for (name, sums) in self.quantiles.unwrap_or_default() {
            let means: Vec<f64> = sums.iter().map(|sum| sum / self.count).collect();
            of.insert(name, shaped(&means, shape));
        }
        Some(Value::Object(of))
    }
}

/// The numbers of a column of one row, below lists of any depth.
fn flat(column: &ArrayRef) -> Option<Vec<f64>> {
    if matches!(column.data_type(), DataType::List(_) | DataType::LargeList(_) | DataType::FixedSizeList(..)) {
        let lists = (0..column.len()).map(|row| flat(&list_at(column, row)?));
        return Some(lists.collect::<Option<Vec<_>>>()?.concat());
    }
    let numbers = cast(column, &DataType::Float64).ok()?;
    (numbers.null_count() == 0).then(|| numbers.as_primitive_opt::<Float64Type>().map(|of| of.values().to_vec()))?
}
