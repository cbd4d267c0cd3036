//! Least, greatest and mean value of every dimension of the numeric features, gathered while frames are read.

use crate::dataset::plain::FlatNumbers;
use crate::table::Values;

/// What is found of one feature.
#[derive(Clone, Debug)]
pub(super) struct Range {
    pub(super) min: Vec<f64>,
    pub(super) max: Vec<f64>,
    sum: Vec<f64>,
    n_rows: u64,
    low: Vec<f32>,
    high: Vec<f32>,
}

impl Range {
    pub(super) fn new(width: usize) -> Self {
        Self {
            min: vec![f64::INFINITY; width],
            max: vec![f64::NEG_INFINITY; width],
            sum: vec![0.0; width],
            n_rows: 0,
            low: vec![f32::INFINITY; width],
            high: vec![f32::NEG_INFINITY; width],
        }
    }

    pub(super) fn mean(&self) -> impl Iterator<Item = f64> {
        self.sum.iter().map(|sum| sum / self.n_rows.max(1) as f64)
    }

    /// Adds the numbers of some rows.
    pub(super) fn add(&mut self, numbers: &FlatNumbers) {
        let width = self.min.len();
        match numbers.values(width) {
            Values::Float32Vector(values, _) => self.add_floats(values),
            Values::Float64Vector(values, _) => self.add_values(values, |value| value),
            Values::Int64Vector(values, _) => self.add_values(values, |value| value as f64),
            Values::Boolean(values) => self.add_values(values, |value| f64::from(u8::from(value))),
            _ => {}
        }
    }

    /// Least and greatest are compared as they are, four bytes each.
    fn add_floats(&mut self, values: &[f32]) {
        let width = self.min.len();
        for row in values.chunks_exact(width) {
            let ends = self.low.iter_mut().zip(&mut self.high).zip(&mut self.sum);
            for (((low, high), sum), &value) in ends.zip(row) {
                *low = if value < *low { value } else { *low };
                *high = if value > *high { value } else { *high };
                *sum += f64::from(value);
            }
        }
        self.n_rows += (values.len() / width) as u64;
        let pairs = self.min.iter_mut().zip(&mut self.max).zip(self.low.iter().zip(&self.high));
        for ((min, max), (low, high)) in pairs {
            (*min, *max) = (f64::from(*low), f64::from(*high));
        }
    }

    fn add_values<T: Copy>(&mut self, values: &[T], of: impl Fn(T) -> f64) {
        let width = self.min.len();
        for row in values.chunks_exact(width) {
            let ends = self.min.iter_mut().zip(&mut self.max).zip(&mut self.sum);
            for (((min, max), sum), &value) in ends.zip(row) {
                let value = of(value);
                *min = if value < *min { value } else { *min };
                *max = if value > *max { value } else { *max };
                *sum += value;
            }
        }
        self.n_rows += (values.len() / width) as u64;
    }
}
