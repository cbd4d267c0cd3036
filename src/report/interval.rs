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

#[cfg(test)]
mod tests {
    use super::wilson;

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
