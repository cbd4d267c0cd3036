//! Statistics of whole numbers that an edit makes anew: of rows, episodes and tasks.

use std::collections::BTreeMap;

/// Numbers of an episode with how often each is there.
#[derive(Clone, Debug, Default)]
pub(super) struct Counted(BTreeMap<i64, u64>);

impl Counted {
    pub(super) fn add(&mut self, number: i64) {
        *self.0.entry(number).or_default() += 1;
    }

    fn count(&self) -> u64 {
        self.0.values().sum()
    }

    fn mean(&self) -> f64 {
        let sum: f64 = self.0.iter().map(|(&number, &n)| number as f64 * n as f64).sum();
        sum / self.count().max(1) as f64
    }

    /// The number at a place among all, in order.
    fn at(&self, place: u64) -> f64 {
        let mut before = 0;
        let found = self.0.iter().find(|(_, n)| {
            before += **n;
            before > place
        });
        found.or(self.0.last_key_value()).map_or(0.0, |(&number, _)| number as f64)
    }

    /// A statistic by its name in `meta/episodes`; `None` for one that is not known.
    pub(super) fn statistic(&self, name: &str) -> Option<f64> {
        let last = self.count().saturating_sub(1);
        match name {
            "min" => Some(self.at(0)),
            "max" => Some(self.at(last)),
            "mean" => Some(self.mean()),
            "std" => {
                let mean = self.mean();
                let square = |(&number, &n): (&i64, &u64)| (number as f64 - mean).powi(2) * n as f64;
                Some((self.0.iter().map(square).sum::<f64>() / self.count().max(1) as f64).sqrt())
            }
            "count" => Some(self.count() as f64),
            quantile => {
                let share = quantile.strip_prefix('q')?.parse::<f64>().ok()? / 100.0;
                let place = share * last as f64;
                let [below, above] = [place.floor(), place.ceil()].map(|place| self.at(place as u64));
                Some(below + (above - below) * place.fract())
            }
        }
    }
}

/// The same of `n` numbers in a row from `first` on.
pub(super) fn statistic_of_row(name: &str, first: i64, n: u64) -> Option<f64> {
    let (first, last) = (first as f64, n.saturating_sub(1) as f64);
    match name {
        "min" => Some(first),
        "max" => Some(first + last),
        "mean" => Some(first + last / 2.0),
        "std" => Some(((n as f64).powi(2) - 1.0).max(0.0).sqrt() / 12.0_f64.sqrt()),
        "count" => Some(n as f64),
        quantile => Some(first + last * quantile.strip_prefix('q')?.parse::<f64>().ok()? / 100.0),
    }
}

#[cfg(test)]
mod tests {
    use super::{Counted, statistic_of_row};

    #[test]
    fn statistics_of_a_row_are_those_of_its_numbers() {
        let mut counted = Counted::default();
        (5..12).for_each(|number| counted.add(number));
        for name in ["min", "max", "mean", "std", "count", "q01", "q10", "q50", "q90", "q99"] {
            let (a, b) = (counted.statistic(name).unwrap(), statistic_of_row(name, 5, 7).unwrap());
            assert!((a - b).abs() < 1e-12, "{name}: {a} {b}");
        }
        // 5, 6, 7, 8, 9, 10, 11: deviations 3, 2, 1, 0, 1, 2, 3.
        assert!((counted.statistic("std").unwrap() - 2.0).abs() < 1e-12);
        assert_eq!(counted.statistic("other"), None);
    }
}
