//! Statistics of pictures by channel, exact: there are 256 values.

use serde::Serialize;

use crate::table::Values;
use crate::video::Rgb;

/// As `meta/stats.json` has them: `[3][1][1]`, in 0 to 1. `count` is of frames.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct PictureStatistics {
    min: Channels,
    max: Channels,
    mean: Channels,
    std: Channels,
    count: [u64; 1],
    q01: Channels,
    q10: Channels,
    q50: Channels,
    q90: Channels,
    q99: Channels,
}

type Channels = [[[f64; 1]; 1]; 3];

/// Statistics of each episode that is not yet written: columns of `meta/episodes/`, which `LeRobot`'s tools sum up when
/// they merge, split or cut datasets. Quantiles are left out, as of numbers.
pub(super) struct EpisodeStatistics {
    columns: [String; 5],
    /// Minimum, maximum, mean and deviation.
    channels: [Vec<[f64; 3]>; 4],
    counts: Vec<i64>,
}

impl EpisodeStatistics {
    pub(super) fn new(feature: &str) -> Self {
        let columns = ["min", "max", "mean", "std", "count"].map(|name| format!("stats/{feature}/{name}"));
        Self { columns, channels: Default::default(), counts: Vec::new() }
    }

    /// The columns as lines of the schema's text.
    pub(super) fn schema(&self) -> impl Iterator<Item = String> {
        let list = |name: &str, element: String| {
            format!("required group {name} (LIST) {{ repeated group list {{ {element} }} }}")
        };
        let [channels @ .., count] = &self.columns;
        let channels = channels.iter().map(move |name| {
            let inner = list("element", list("element", "required double element;".to_owned()));
            format!("  {}\n", list(name, inner))
        });
        channels.chain([format!("  {}\n", list(count, "required int64 element;".to_owned()))])
    }

    pub(super) fn append(&mut self, episode: PictureStatistics) {
        let PictureStatistics { min, max, mean, std, count, .. } = episode;
        for (column, value) in self.channels.iter_mut().zip([min, max, mean, std]) {
            column.push(value.map(|[[value]]| value));
        }
        self.counts.push(count[0] as i64);
    }

    pub(super) fn columns(&self) -> impl Iterator<Item = (&str, Values<'_>)> {
        let channels = self.channels.iter().map(|rows| Values::Channels(rows));
        self.columns.iter().map(String::as_str).zip(channels.chain([Values::Int64Vector(&self.counts, 1)]))
    }

    pub(super) fn clear(&mut self) {
        self.channels.iter_mut().for_each(Vec::clear);
        self.counts.clear();
    }
}

/// How often each channel has had each value.
#[derive(Debug)]
pub(super) struct Histogram {
    counts: [[u64; 256]; 3],
    n_pictures: u64,
}

impl Default for Histogram {
    fn default() -> Self {
        Self { counts: [[0; 256]; 3], n_pictures: 0 }
    }
}

impl Histogram {
    pub(super) fn add(&mut self, picture: &Rgb) {
        self.n_pictures += 1;
        for pixel in picture.bytes.chunks_exact(3) {
            for (counts, &value) in self.counts.iter_mut().zip(pixel) {
                counts[usize::from(value)] += 1;
            }
        }
    }

    pub(super) fn merge(&mut self, other: &Self) {
        self.n_pictures += other.n_pictures;
        let counts = self.counts.as_flattened_mut().iter_mut().zip(other.counts.as_flattened());
        counts.for_each(|(sum, count)| *sum += count);
    }

    pub(super) fn statistics(&self) -> PictureStatistics {
        let channels = |of: &dyn Fn(&[u64; 256]) -> f64| [0, 1, 2].map(|channel| [[of(&self.counts[channel]) / 255.0]]);
        let quantile = |share: f64| channels(&|counts| quantile(counts, share));
        PictureStatistics {
            min: channels(&|counts| value_at(counts, 0) as f64),
            max: channels(&|counts| value_at(counts, total(counts).saturating_sub(1)) as f64),
            mean: channels(&mean),
            std: channels(&|counts| {
                let mean = mean(counts);
                let square = |value: usize| (value as f64 - mean) * (value as f64 - mean) * counts[value] as f64;
                ((0..256).map(square).sum::<f64>() / total(counts).max(1) as f64).sqrt()
            }),
            count: [self.n_pictures],
            q01: quantile(0.01),
            q10: quantile(0.1),
            q50: quantile(0.5),
            q90: quantile(0.9),
            q99: quantile(0.99),
        }
    }
}

fn total(counts: &[u64; 256]) -> u64 {
    counts.iter().sum()
}

fn mean(counts: &[u64; 256]) -> f64 {
    let sum: f64 = (0..256).map(|value| value as f64 * counts[value] as f64).sum();
    sum / total(counts).max(1) as f64
}

/// The value at a position among all, in order.
fn value_at(counts: &[u64; 256], position: u64) -> usize {
    let mut before = 0;
    let at = |count: &u64| {
        before += count;
        before > position
    };
    counts.iter().position(at).unwrap_or(255)
}

/// Linear between the two nearest values.
fn quantile(counts: &[u64; 256], share: f64) -> f64 {
    let position = share * total(counts).saturating_sub(1) as f64;
    let lower = position.floor();
    let [below, above] = [lower as u64, position.ceil() as u64].map(|position| value_at(counts, position) as f64);
    below + (above - below) * (position - lower)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics_are_those_of_the_values() {
        let mut histogram = Histogram::default();
        histogram.add(&Rgb { size_px: [2, 2], bytes: vec![0, 255, 10, 51, 255, 20, 102, 255, 30, 153, 255, 40] });
        let PictureStatistics { min, max, mean, std, count, q50, .. } = histogram.statistics();
        assert_eq!(count, [1]);
        assert_eq!([min[0], min[1], max[0], max[1]], [[[0.0]], [[1.0]], [[0.6]], [[1.0]]]);
        assert!((mean[0][0][0] - 0.3).abs() < 1e-12 && (q50[0][0][0] - 0.3).abs() < 1e-12);
        assert!((std[0][0][0] - 0.05_f64.sqrt()).abs() < 1e-12 && std[1][0][0].abs() < 1e-12);
    }
}
