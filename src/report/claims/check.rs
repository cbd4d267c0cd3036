//! What is left of a claim in figures, and what becomes of it.
//!
//! # Source
//!
//! Variances after A. Agresti and B. Caffo, "Simple and effective confidence intervals for proportions and differences of
//! proportions result from adding two successes and two failures", The American Statistician 54 (2000).

use crate::report::claims::Verdict;
use crate::report::summary::Aggregate;
use crate::words::counted;

/// The normal distribution's two-sided 95 % point.
const Z: f64 = 1.96;

/// What became of a claim, and the figures that this rests on.
pub(super) type Judged = (Verdict, String);

/// A share, to be added or subtracted.
pub(super) struct Term<'a> {
    pub(super) sign: f64,
    pub(super) row: &'a Aggregate,
}

/// What is left of a claim in figures.
pub(super) enum Check<'a> {
    /// Each sum must be above zero.
    Above(Vec<Vec<Term<'a>>>),
    /// Each share must be at least so high.
    AtLeast(f64, Vec<&'a Aggregate>),
    /// Two shares must not be further apart.
    Within(f64, &'a Aggregate, &'a Aggregate),
}

pub(super) fn difference<'a>(plus: &'a Aggregate, minus: &'a Aggregate) -> Vec<Term<'a>> {
    vec![Term { sign: 1.0, row: plus }, Term { sign: -1.0, row: minus }]
}

/// A difference of two rows; `None` of a row and itself.
pub(super) fn different<'a>(plus: &'a Aggregate, minus: &'a Aggregate) -> Option<Vec<Term<'a>>> {
    (!std::ptr::eq(plus, minus)).then(|| difference(plus, minus))
}

pub(super) fn negated<'a>(terms: Vec<Term<'a>>) -> impl Iterator<Item = Term<'a>> {
    terms.into_iter().map(|Term { sign, row }| Term { sign: -sign, row })
}

impl Check<'_> {
    /// `None` without figures.
    pub(super) fn judge(&self) -> Option<Judged> {
        match self {
            Self::Above(sums) => {
                let verdict = sums.iter().map(|terms| direction(terms)).max()?;
                let told: Vec<String> = sums.iter().map(|terms| tell(terms.iter().map(|term| term.row))).collect();
                Some((verdict, told.join("; ")))
            }
            Self::AtLeast(least, rows) => {
                let lowest = rows.iter().map(|row| row.mean_success_rate).reduce(f64::min)?;
                let verdict = if lowest >= *least { Verdict::Reproduced } else { Verdict::NotReproduced };
                Some((verdict, tell(rows.iter().copied())))
            }
            Self::Within(most, a, b) => {
                // That neither ever succeeds is not what the paper tells of.
                if a.successes + b.successes == 0 {
                    return None;
                }
                let apart = (a.mean_success_rate - b.mean_success_rate).abs();
                let verdict = if apart <= *most { Verdict::Reproduced } else { Verdict::NotReproduced };
                Some((verdict, tell([*a, *b].into_iter())))
            }
        }
    }
}

/// On which side of zero a sum of shares lies, if its interval is on one.
fn direction(terms: &[Term<'_>]) -> Verdict {
    let sum: f64 = terms.iter().map(|term| term.sign * term.row.mean_success_rate).sum();
    let variance = |row: &Aggregate| {
        let n = row.episodes as f64 + 2.0;
        let share = (row.successes as f64 + 1.0) / n;
        share * (1.0 - share) / n
    };
    let half_width = Z * terms.iter().map(|term| variance(term.row)).sum::<f64>().sqrt();
    match sum {
        sum if sum > half_width => Verdict::Reproduced,
        sum if sum < -half_width => Verdict::NotReproduced,
        _ => Verdict::NoDifference,
    }
}

/// Shares with what tells them apart.
fn tell<'a>(rows: impl Iterator<Item = &'a Aggregate>) -> String {
    let one = |row: &Aggregate| {
        let tasks =
            row.actor.train_tasks.map(|tasks| format!(", {tasks}", tasks = counted(tasks, "task"))).unwrap_or_default();
        format!("{} {:.3} ({}{tasks})", row.actor.variant, row.mean_success_rate, row.suite)
    };
    rows.map(one).collect::<Vec<_>>().join(", ")
}
