//! How sure a share of successes is.
//!
//! # Source
//!
//! E. B. Wilson, "Probable inference, the law of succession, and statistical inference", JASA 22 (1927). Unlike the
//! usual normal interval it stays within 0 to 1 and is sound when every episode succeeds.

/// The normal distribution's two-sided 95 % point.
const Z: f64 = 1.959_963_984_540_054;

/// The 95 % interval around `successes` of `episodes`, as shares. Without episodes nothing is known: 0 to 1.
pub fn wilson(successes: u64, episodes: u64) -> (f64, f64) {
    if episodes == 0 {
        return (0.0, 1.0);
    }
    let n = episodes as f64;
    let share = successes as f64 / n;
    let shrink = 1.0 + Z * Z / n;
    let center = (share + Z * Z / (2.0 * n)) / shrink;
    let half_width = Z / shrink * (share * (1.0 - share) / n + Z * Z / (4.0 * n * n)).sqrt();
    let low = if successes == 0 { 0.0 } else { center - half_width };
    let high = if successes >= episodes { 1.0 } else { center + half_width };
    (low, high)
}

/// Student's two-sided 95 % points for 1 to 30 degrees of freedom; beyond, the normal distribution's is near enough.
const T: [f64; 30] = [
    12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160, 2.145, 2.131, 2.120,
    2.110, 2.101, 2.093, 2.086, 2.080, 2.074, 2.069, 2.064, 2.060, 2.056, 2.052, 2.048, 2.045, 2.042,
];

/// The 95 % interval of the mean of some shares, each of a training of its own, within 0 to 1; `None` with fewer than
/// two. It takes them as drawn from a normal distribution, so it says how much trainings differ; what a finite number
/// of rollouts hides, [`wilson`] says.
///
/// # Source
///
/// "Student", "The probable error of a mean", Biometrika 6 (1908).
pub fn student(shares: &[f64]) -> Option<(f64, f64)> {
    let n_freedoms = shares.len().checked_sub(1).filter(|&n| n > 0)?;
    let n = shares.len() as f64;
    let mean = shares.iter().sum::<f64>() / n;
    let variance = shares.iter().map(|share| (share - mean).powi(2)).sum::<f64>() / n_freedoms as f64;
    let half_width = T.get(n_freedoms - 1).copied().unwrap_or(Z) * (variance / n).sqrt();
    Some(((mean - half_width).max(0.0), (mean + half_width).min(1.0)))
}

#[cfg(test)]
mod tests {
    use super::{student, wilson};

    #[test]
    fn students_interval_is_that_of_three_seeds_by_hand() {
        // Mean 0.8, deviation 0.1: 4.303 * 0.1 / sqrt(3) = 0.2484.
        let (low, high) = student(&[0.7, 0.8, 0.9]).unwrap();
        assert!((low - 0.5516).abs() < 5e-5 && (high - 1.0).abs() < 1e-12, "{low} {high}");
        let (low, high) = student(&[0.5, 0.5, 0.5]).unwrap();
        assert!((low - 0.5).abs() < 1e-12 && (high - 0.5).abs() < 1e-12, "alike seeds leave no doubt");
        // Mean 0.5, deviation 0.1414: 12.706 * 0.1414 / sqrt(2) is more than there is.
        assert_eq!(student(&[0.4, 0.6]), Some((0.0, 1.0)));
        assert_eq!((student(&[0.5]), student(&[])), (None, None));
    }

    #[track_caller]
    fn check(successes: u64, episodes: u64, expected: (f64, f64)) {
        let (low, high) = wilson(successes, episodes);
        assert!((low - expected.0).abs() < 5e-5 && (high - expected.1).abs() < 5e-5, "{low} {high}");
    }

    #[test]
    fn wilson_gives_the_published_values() {
        // Newcombe, "Two-sided confidence intervals for the single proportion" (1998), table I, method 3.
        check(81, 263, (0.2553, 0.3662));
        check(15, 148, (0.0624, 0.1605));
        check(0, 20, (0.0, 0.1611));
        check(1, 29, (0.0061, 0.1718));
    }

    #[test]
    fn all_or_nothing_touches_the_end_and_no_episode_says_nothing() {
        check(20, 20, (1.0 - 0.1611, 1.0));
        check(0, 0, (0.0, 1.0));
        check(200, 200, (0.9812, 1.0));
    }
}
