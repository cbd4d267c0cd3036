//! What the paper claims, judged by our rollouts.
//!
//! # Invariants
//!
//! Every verdict is computed. A claim that one share is above another holds when the difference is in that direction
//! and beyond its 95 % interval, fails when it is beyond it in the other direction, and shows no difference otherwise.
//! Intervals take rollouts as independent.
//!
//! # Source
//!
//! Paper, experiments 1 to 4. Variances after A. Agresti and B. Caffo, "Simple and effective confidence intervals for
//! proportions and differences of proportions result from adding two successes and two failures", The American
//! Statistician 54 (2000).

mod pictures;

pub use pictures::Note;
pub(super) use pictures::{SIGHTED, notes};

use schemars::JsonSchema;
use serde::Serialize;

use crate::report::order;
use crate::report::summary::Aggregate;

/// The normal distribution's two-sided 95 % point.
const Z: f64 = 1.96;

/// A claim of the paper and what became of it.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Claim {
    /// Its name in files.
    pub id: String,
    /// What the paper says.
    pub claim: String,
    /// By which encoder of ours it is judged: `object-centric`, or `flattened` as in the paper; of models that see,
    /// `colour slots`, `the paper's convolutions` or `general`.
    pub encoder: String,
    /// What came of it.
    pub verdict: Verdict,
    /// The figures that the verdict rests on.
    pub ours: String,
}

/// What became of a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Ours shows the same.
    Reproduced,
    /// Ours shows neither that nor the opposite.
    NoDifference,
    /// Ours shows the opposite.
    NotReproduced,
}

impl Verdict {
    /// For people.
    pub(super) fn words(self) -> &'static str {
        match self {
            Self::Reproduced => "reproduced",
            Self::NoDifference => "no difference",
            Self::NotReproduced => "not reproduced",
        }
    }
}

/// Which of a variant's rows in a suite: by how much it was trained on.
#[derive(Clone, Copy)]
enum Tasks {
    Most,
    Fewest,
}

/// A share, to be added or subtracted.
struct Term<'a> {
    sign: f64,
    row: &'a Aggregate,
}

/// What is left of a claim in figures.
enum Check<'a> {
    /// Each sum must be above zero.
    Above(Vec<Vec<Term<'a>>>),
    /// Each share must be at least so high.
    AtLeast(f64, Vec<&'a Aggregate>),
    /// Two shares must not be further apart.
    Within(f64, &'a Aggregate, &'a Aggregate),
}

/// Our rows of one encoder.
struct Ours<'a> {
    aggregates: &'a [Aggregate],
    suffix: &'static str,
}

/// Identifier, claim, and the figures that it takes; `None` where they were not measured.
type Rule = (&'static str, &'static str, fn(&Ours<'_>) -> Option<Judged>);
type Judged = (Verdict, String);

const RULES: [Rule; 13] = [
    ("sorting_long_tasks", "NTP sorts 4 to 40 objects at over 90 %", |ours| {
        Check::AtLeast(0.9, ours.lengths("ntp")).judge()
    }),
    ("sorting_ntp_above_flat", "NTP sorts better than the flat models, at every length", |ours| {
        Check::Above(["flat", "flat_gru"].into_iter().flat_map(|flat| ours.pairs("ntp", flat)).collect()).judge()
    }),
    ("sorting_flat_falls", "The flat model sorts fewer objects better than many", |ours| {
        Check::Above(ours.fall("flat").into_iter().collect()).judge()
    }),
    ("sorting_gru_falls_faster", "With a recurrent core, NTP loses more from 4 to 40 objects", |ours| {
        let (gru, ntp) = (ours.fall("ntp_gru")?, ours.fall("ntp")?);
        Check::Above(vec![gru.into_iter().chain(negated(ntp)).collect()]).judge()
    }),
    ("stacking_unseen_as_seen", "NTP stacks unseen end configurations about as well as seen ones", |ours| {
        let row = |suite| ours.row("ntp", suite, Tasks::Most);
        Check::Within(0.05, row("stacking_seen")?, row("stacking_unseen")?).judge()
    }),
    ("stacking_more_tasks", "More training tasks help NTP with unseen ones", |ours| {
        ours.more_tasks("ntp", "stacking_unseen")
    }),
    ("stacking_scope", "NTP stacks unseen configurations better than without scopes", |ours| {
        ours.above("ntp", "ntp_no_scope", "stacking_unseen")
    }),
    ("stacking_flat", "NTP stacks unseen configurations better than Flat", |ours| {
        ours.above("ntp", "flat", "stacking_unseen")
    }),
    ("stacking_flat_gru", "Flat (GRU) stacks what it has seen better than what it has not", |ours| {
        let row = |suite| ours.row("flat_gru", suite, Tasks::Most);
        Check::Above(vec![difference(row("stacking_seen")?, row("stacking_unseen")?)]).judge()
    }),
    ("stacking_flat_many_tasks", "Flat loses seen tasks when it trains on many", |ours| {
        let row = |tasks| ours.row("flat", "stacking_seen", tasks);
        Check::Above(vec![different(row(Tasks::Fewest)?, row(Tasks::Most)?)?]).judge()
    }),
    ("stacking_topology", "More training tasks help NTP to build towers in another order", |ours| {
        ours.more_tasks("ntp", "stacking_topology")
    }),
    ("adversary_reactive", "Under the adversary NTP loses less than with a recurrent core", |ours| {
        let (gru, ntp) = (ours.loss("ntp_gru")?, ours.loss("ntp")?);
        Check::Above(vec![gru.into_iter().chain(negated(ntp)).collect()]).judge()
    }),
    ("cleanup_grid", "NTP cleans up at 55 % to 100 %, up to 4 bowls and 20 forks", |ours| {
        Check::AtLeast(0.55, ours.suites("ntp", "cleanup_unseen_")).judge()
    }),
];

/// Every claim that our rollouts can say something about, for each encoder.
pub(super) fn claims(aggregates: &[Aggregate]) -> Vec<Claim> {
    let encoders = [("object-centric", ""), ("flattened", "_paper")];
    let judge = |(id, claim, check): &Rule| {
        let judged = encoders.iter().filter_map(|&(encoder, suffix)| {
            let (verdict, ours) = check(&Ours { aggregates, suffix })?;
            let (id, claim) = ((*id).to_owned(), (*claim).to_owned());
            Some(Claim { id, claim, encoder: encoder.to_owned(), verdict, ours })
        });
        judged.collect::<Vec<_>>()
    };
    RULES.iter().flat_map(judge).chain(pictures::claims(aggregates)).collect()
}

impl<'a> Ours<'a> {
    /// A variant's rows in a suite, by the decoder that stands for it, the most training tasks first.
    fn rows(&self, variant: &str, suite: &str) -> Vec<&'a Aggregate> {
        let name = format!("{variant}{}", self.suffix);
        let is_own = |row: &&Aggregate| row.actor.variant == name && row.actor.is_the_papers() && row.suite == suite;
        let own = self.aggregates.iter().filter(is_own);
        let mut own: Vec<&Aggregate> = own.collect();
        own.sort_by_cached_key(|row| order::actor(&row.actor));
        own.dedup_by_key(|row| row.actor.train_tasks);
        own
    }

    fn row(&self, variant: &str, suite: &str, tasks: Tasks) -> Option<&'a Aggregate> {
        let rows = self.rows(variant, suite);
        match tasks {
            Tasks::Most => rows.iter().copied().max_by_key(|row| row.actor.train_tasks),
            Tasks::Fewest => rows.iter().copied().min_by_key(|row| row.actor.train_tasks),
        }
    }

    /// A variant's best trained row in each suite whose name begins so and ends in numbers.
    fn suites(&self, variant: &str, start: &str) -> Vec<&'a Aggregate> {
        let mut names: Vec<&String> = self.aggregates.iter().map(|row| &row.suite).collect();
        names.retain(|name| name.strip_prefix(start).is_some_and(is_numbers));
        names.sort_by_cached_key(|name| order::suite(name));
        names.dedup();
        names.into_iter().filter_map(|suite| self.row(variant, suite, Tasks::Most)).collect()
    }

    fn lengths(&self, variant: &str) -> Vec<&'a Aggregate> {
        self.suites(variant, "sorting_unseen_")
    }

    /// One variant less another, at each length that both have.
    fn pairs(&self, above: &str, below: &str) -> Vec<Vec<Term<'a>>> {
        let lower = self.lengths(below);
        let pair = |row: &'a Aggregate| Some(difference(row, lower.iter().find(|other| other.suite == row.suite)?));
        self.lengths(above).into_iter().filter_map(pair).collect()
    }

    /// What a variant loses from the fewest objects to the most.
    fn fall(&self, variant: &str) -> Option<Vec<Term<'a>>> {
        let lengths = self.lengths(variant);
        different(lengths.first()?, lengths.last()?)
    }

    /// What a variant loses under the adversary.
    fn loss(&self, variant: &str) -> Option<Vec<Term<'a>>> {
        let with = self.row(variant, "stacking_adversary", Tasks::Most)?;
        let without = self.rows(variant, "stacking_unseen");
        let same = without.into_iter().find(|row| row.actor.train_tasks == with.actor.train_tasks)?;
        Some(difference(same, with))
    }

    fn above(&self, above: &str, below: &str, suite: &str) -> Option<Judged> {
        let row = |variant| self.row(variant, suite, Tasks::Most);
        Check::Above(vec![difference(row(above)?, row(below)?)]).judge()
    }

    fn more_tasks(&self, variant: &str, suite: &str) -> Option<Judged> {
        let row = |tasks| self.row(variant, suite, tasks);
        Check::Above(vec![different(row(Tasks::Most)?, row(Tasks::Fewest)?)?]).judge()
    }
}

fn is_numbers(name: &str) -> bool {
    name.split('_').all(|word| !word.is_empty() && word.bytes().all(|byte| byte.is_ascii_digit()))
}

fn difference<'a>(plus: &'a Aggregate, minus: &'a Aggregate) -> Vec<Term<'a>> {
    vec![Term { sign: 1.0, row: plus }, Term { sign: -1.0, row: minus }]
}

/// A difference of two rows; `None` of a row and itself.
fn different<'a>(plus: &'a Aggregate, minus: &'a Aggregate) -> Option<Vec<Term<'a>>> {
    (!std::ptr::eq(plus, minus)).then(|| difference(plus, minus))
}

fn negated<'a>(terms: Vec<Term<'a>>) -> impl Iterator<Item = Term<'a>> {
    terms.into_iter().map(|Term { sign, row }| Term { sign: -sign, row })
}

impl Check<'_> {
    /// `None` without figures.
    fn judge(&self) -> Option<Judged> {
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
        let tasks = row.actor.train_tasks.map(|tasks| format!(", {tasks} tasks")).unwrap_or_default();
        format!("{} {:.3} ({}{tasks})", row.actor.variant, row.mean_success_rate, row.suite)
    };
    rows.map(one).collect::<Vec<_>>().join(", ")
}
