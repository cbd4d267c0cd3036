//! Cluster centres of colours, to begin with (k-means, started by k-means++).

use rand::Rng;

use crate::model::colour_slots::foreground::{COLOUR_WIDTH, Foreground};
use crate::seed::Seed;

type Colour = [f32; COLOUR_WIDTH];

/// Colours that clusters are made of at most.
const MAX_COLOURS: usize = 4000;
/// Rounds of assignment and averaging.
const ROUNDS: usize = 20;
/// Of so many beginnings the best is taken.
const BEGINNINGS: u64 = 8;

/// The centres of `n_clusters` clusters of the points' colours.
pub(super) fn centres(seen: &Foreground, n_clusters: usize, seed: Seed) -> Vec<Colour> {
    let all: Vec<Colour> = seen.pictures().flatten().map(|(colour, _)| *colour).collect();
    let every = all.len().div_ceil(MAX_COLOURS).max(1);
    let colours: Vec<Colour> = all.into_iter().step_by(every).collect();
    let beginnings = (0..BEGINNINGS).map(|beginning| {
        let mut centres = spread_out(&colours, n_clusters, &mut seed.derive("clusters", &[beginning]).rng());
        (0..ROUNDS).for_each(|_| centres = averaged(&colours, &centres));
        let cost: f64 = colours.iter().map(|colour| f64::from(nearest(&centres, colour).1)).sum();
        (cost, centres)
    });
    let best = beginnings.reduce(|best, other| if other.0 < best.0 { other } else { best });
    best.map(|(_, centres)| centres).unwrap_or_default()
}

/// Which cluster moves most between pictures that follow each other: the robot.
pub(super) fn most_mobile(seen: &Foreground, centres: &[Colour], lengths: &[usize]) -> usize {
    let places: Vec<Vec<Option<[f32; 2]>>> = seen.pictures().map(|points| mean_places(&points, centres)).collect();
    let mut moved = vec![(0.0_f32, 0_u32); centres.len()];
    let mut begin = 0;
    for &length in lengths {
        for pair in places[begin..begin + length].windows(2) {
            for (cluster, sum) in moved.iter_mut().enumerate() {
                if let (Some(before), Some(after)) = (pair[0][cluster], pair[1][cluster]) {
                    *sum = (sum.0 + (after[0] - before[0]).hypot(after[1] - before[1]), sum.1 + 1);
                }
            }
        }
        begin += length;
    }
    // What is seen in few pictures says little.
    let n_pairs: usize = lengths.iter().map(|length| length.saturating_sub(1)).sum();
    let speed = |(sum, n): (f32, u32)| if (n as usize) * 2 > n_pairs { sum / n as f32 } else { 0.0 };
    let fastest = (0..centres.len()).reduce(|a, b| if speed(moved[b]) > speed(moved[a]) { b } else { a });
    fastest.unwrap_or_default()
}

/// The mean place of each cluster's points, where it has any.
fn mean_places(points: &[(&Colour, [f32; 2])], centres: &[Colour]) -> Vec<Option<[f32; 2]>> {
    let mut sums = vec![([0.0_f32; 2], 0_u32); centres.len()];
    for (colour, xy) in points {
        let (sum, n) = &mut sums[nearest(centres, colour).0];
        sum.iter_mut().zip(xy).for_each(|(sum, value)| *sum += value);
        *n += 1;
    }
    sums.into_iter().map(|(sum, n)| (n > 0).then(|| sum.map(|value| value / n as f32))).collect()
}

/// k-means++: each centre is drawn from the colours, far ones more often.
fn spread_out(colours: &[Colour], n_clusters: usize, rng: &mut impl Rng) -> Vec<Colour> {
    let first = colours.get(rng.random_range(0..colours.len().max(1))).copied().unwrap_or_default();
    let mut centres = vec![first];
    while centres.len() < n_clusters {
        let distances: Vec<f32> = colours.iter().map(|colour| nearest(&centres, colour).1).collect();
        let total: f32 = distances.iter().sum();
        let mut left = rng.random::<f32>() * total;
        let drawn = distances.iter().position(|distance| {
            left -= distance;
            left < 0.0
        });
        centres.push(drawn.and_then(|idx| colours.get(idx)).copied().unwrap_or(first));
    }
    centres
}

fn averaged(colours: &[Colour], centres: &[Colour]) -> Vec<Colour> {
    let mut sums = vec![([0.0_f32; COLOUR_WIDTH], 0_u32); centres.len()];
    for colour in colours {
        let (sum, n) = &mut sums[nearest(centres, colour).0];
        sum.iter_mut().zip(colour).for_each(|(sum, value)| *sum += value);
        *n += 1;
    }
    let mean = |((sum, n), before): (([f32; COLOUR_WIDTH], u32), &Colour)| {
        if n == 0 { *before } else { sum.map(|value| value / n as f32) }
    };
    sums.into_iter().zip(centres).map(mean).collect()
}

/// The nearest centre and its squared distance.
fn nearest(centres: &[Colour], colour: &Colour) -> (usize, f32) {
    let distance = |centre: &Colour| centre.iter().zip(colour).map(|(a, b)| (a - b).powi(2)).sum::<f32>();
    let distances = centres.iter().map(distance).enumerate();
    distances.reduce(|best, other| if other.1 < best.1 { other } else { best }).unwrap_or((0, 0.0))
}
