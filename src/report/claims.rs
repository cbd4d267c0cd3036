//! What the paper claims, judged by our rollouts.
//!
//! # Invariants
//!
//! Every verdict is computed, within one experiment. A claim that one share is above another holds when the difference
//! is in that direction and beyond its 95 % interval, fails when it is beyond it in the other direction, and shows no
//! difference otherwise. Intervals take rollouts as independent.
//!
//! # Source
//!
//! Paper, experiments 1 to 4.

mod check;
mod pictures;

pub use pictures::Note;
pub(super) use pictures::notes;

use schemars::JsonSchema;
use serde::Serialize;

use crate::report::claims::check::{Check, Judged, Term, difference, different, negated};
use crate::report::facts::{Ask, BLOCK_STACKING, OBJECT_SORTING};
use crate::report::figures::{USUAL_PUSH, bowls_and_forks, experiments};
use crate::report::kind::Design;
use crate::report::summary::Aggregate;

/// A claim of the paper and what became of it.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Claim {
    /// Its name in files.
    pub id: String,
    /// What the paper says.
    pub claim: String,
    /// By whose rollouts it is judged: rows of two experiments are never compared.
    pub experiment: String,
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

/// Which of a model's rows: by how much it was trained on.
#[derive(Clone, Copy)]
enum Tasks {
    Most,
    Fewest,
}

/// Our rows of one experiment and encoder, in order of models.
struct Ours<'a> {
    rows: &'a [&'a Aggregate],
    encoder: &'static str,
}

/// Identifier, claim, and the figures that it takes; `None` where they were not measured.
type Rule = (&'static str, &'static str, fn(&Ours<'_>) -> Option<Judged>);

const RULES: [Rule; 13] = [
    ("sorting_long_tasks", "NTP sorts 4 to 40 objects at over 90 %", |ours| {
        let lengths = ours.lengths(Design::NTP);
        let reaches = |wanted: i64| lengths.iter().any(|row| row.facts.objects() == Some(wanted));
        Check::AtLeast(0.9, lengths.clone()).judge().filter(|_| reaches(4) && reaches(40))
    }),
    ("sorting_ntp_above_flat", "NTP sorts better than the flat models, at every length", |ours| {
        let flat = [Design::FLAT, Design::FLAT_GRU];
        Check::Above(flat.into_iter().flat_map(|flat| ours.pairs(Design::NTP, flat)).collect()).judge()
    }),
    ("sorting_flat_falls", "The flat model sorts fewer objects better than many", |ours| {
        Check::Above(ours.fall(Design::FLAT).into_iter().collect()).judge()
    }),
    ("sorting_gru_falls_faster", "With a recurrent core, NTP loses more from 4 to 40 objects", |ours| {
        let (gru, ntp) = (ours.fall(Design::NTP_GRU)?, ours.fall(Design::NTP)?);
        Check::Above(vec![gru.into_iter().chain(negated(ntp)).collect()]).judge()
    }),
    ("stacking_unseen_as_seen", "NTP stacks unseen end configurations about as well as seen ones", |ours| {
        let row = |ask| ours.stacking(Design::NTP, ask, Tasks::Most);
        Check::Within(0.05, row(Ask::Seen)?, row(Ask::Unseen)?).judge()
    }),
    ("stacking_more_tasks", "More training tasks help NTP with unseen ones", |ours| {
        ours.more_tasks(Design::NTP, Ask::Unseen)
    }),
    ("stacking_scope", "NTP stacks unseen configurations better than without scopes", |ours| {
        ours.above(Design::NTP, Design::NO_SCOPE)
    }),
    ("stacking_flat", "NTP stacks unseen configurations better than Flat", |ours| {
        ours.above(Design::NTP, Design::FLAT)
    }),
    ("stacking_flat_gru", "Flat (GRU) stacks what it has seen better than what it has not", |ours| {
        let row = |ask| ours.stacking(Design::FLAT_GRU, ask, Tasks::Most);
        Check::Above(vec![difference(row(Ask::Seen)?, row(Ask::Unseen)?)]).judge()
    }),
    ("stacking_flat_many_tasks", "Flat loses seen tasks when it trains on many", |ours| {
        let row = |tasks| ours.stacking(Design::FLAT, Ask::Seen, tasks);
        Check::Above(vec![different(row(Tasks::Fewest)?, row(Tasks::Most)?)?]).judge()
    }),
    ("stacking_topology", "More training tasks help NTP to build towers in another order", |ours| {
        ours.more_tasks(Design::NTP, Ask::Topology)
    }),
    ("adversary_reactive", "Under the adversary NTP loses less than with a recurrent core", |ours| {
        let (gru, ntp) = (ours.loss(Design::NTP_GRU)?, ours.loss(Design::NTP)?);
        Check::Above(vec![gru.into_iter().chain(negated(ntp)).collect()]).judge()
    }),
    ("cleanup_grid", "NTP cleans up at 55 % to 100 %, up to 4 bowls and 20 forks", |ours| {
        let cells = ours.most_trained(Design::NTP, bowls_and_forks);
        let reaches = cells.iter().any(|row| bowls_and_forks(row) == Some((4, 20)));
        Check::AtLeast(0.55, cells).judge().filter(|_| reaches)
    }),
];

/// Every claim that our rollouts can say something about: within one experiment, for each encoder.
pub(super) fn claims(aggregates: &[Aggregate]) -> Vec<Claim> {
    let encoders = [("object-centric", "object_centric"), ("flattened", "flattened")];
    let experiments = experiments(aggregates);
    let judge = |(id, claim, check): &Rule| {
        let groups = experiments.iter().flat_map(|rows| encoders.map(|encoder| (rows, encoder)));
        let judged = groups.filter_map(|(rows, (name, encoder))| {
            let (verdict, ours) = check(&Ours { rows, encoder })?;
            let (id, claim, experiment) = ((*id).to_owned(), (*claim).to_owned(), experiment_of(rows));
            Some(Claim { id, claim, experiment, encoder: name.to_owned(), verdict, ours })
        });
        judged.collect::<Vec<_>>()
    };
    RULES.iter().flat_map(judge).chain(pictures::claims(&experiments)).collect()
}

/// The experiment of rows of one.
fn experiment_of(rows: &[&Aggregate]) -> String {
    rows.first().map(|row| row.actor.experiment.clone()).unwrap_or_default()
}

impl<'a> Ours<'a> {
    /// A design's rows, of each number of training tasks and suite the decoder that stands for it; the most training
    /// tasks first.
    fn rows(&self, design: Design) -> impl Iterator<Item = &'a Aggregate> {
        let encoder = self.encoder;
        let is_own = move |row: &&Aggregate| row.actor.parts.is(design) && row.actor.parts.reads_by(encoder);
        self.rows.iter().copied().filter(is_own)
    }

    fn stacking(&self, design: Design, ask: Ask, tasks: Tasks) -> Option<&'a Aggregate> {
        let rows = self.rows(design).filter(|row| row.facts.asks(BLOCK_STACKING, ask));
        let mut rows: Vec<&Aggregate> = rows.filter(|row| is_usual(row)).collect();
        rows.dedup_by_key(|row| row.actor.train_tasks);
        match tasks {
            Tasks::Most => rows.first().copied(),
            Tasks::Fewest => rows.last().copied(),
        }
    }

    /// The rows after the most training tasks that have a place, one for each place.
    fn most_trained<P: Ord>(&self, design: Design, place: fn(&Aggregate) -> Option<P>) -> Vec<&'a Aggregate> {
        let mut rows: Vec<&Aggregate> = self.rows(design).filter(|row| place(row).is_some()).collect();
        let most = rows.first().map(|row| row.actor.train_tasks);
        rows.retain(|row| Some(row.actor.train_tasks) == most);
        rows.sort_by_key(|row| place(row));
        rows.dedup_by_key(|row| place(row));
        rows
    }

    /// A design's rows by rising length.
    fn lengths(&self, design: Design) -> Vec<&'a Aggregate> {
        self.most_trained(design, length)
    }

    /// One design less another, at each length that both have.
    fn pairs(&self, above: Design, below: Design) -> Vec<Vec<Term<'a>>> {
        let lower = self.lengths(below);
        let pair = |row: &'a Aggregate| Some(difference(row, lower.iter().find(|other| length(other) == length(row))?));
        self.lengths(above).into_iter().filter_map(pair).collect()
    }

    /// What a design loses from the fewest objects to the most.
    fn fall(&self, design: Design) -> Option<Vec<Term<'a>>> {
        let lengths = self.lengths(design);
        different(lengths.first()?, lengths.last()?)
    }

    /// What a design loses under the adversary, after as many training tasks.
    fn loss(&self, design: Design) -> Option<Vec<Term<'a>>> {
        let with = self.stacking(design, Ask::Adversary, Tasks::Most)?;
        let is_same = |row: &&Aggregate| {
            row.actor.train_tasks == with.actor.train_tasks && row.facts.asks(BLOCK_STACKING, Ask::Unseen)
        };
        Some(difference(self.rows(design).find(is_same)?, with))
    }

    /// One design above another in unseen tasks, each after the most training tasks.
    fn above(&self, above: Design, below: Design) -> Option<Judged> {
        let row = |design| self.stacking(design, Ask::Unseen, Tasks::Most);
        Check::Above(vec![difference(row(above)?, row(below)?)]).judge()
    }

    fn more_tasks(&self, design: Design, ask: Ask) -> Option<Judged> {
        let row = |tasks| self.stacking(design, ask, tasks);
        Check::Above(vec![different(row(Tasks::Most)?, row(Tasks::Fewest)?)?]).judge()
    }
}

/// Whether an adversary, if there is one, pushes as often as the paper's and as hard as it usually does.
fn is_usual(row: &Aggregate) -> bool {
    row.facts.ask() != Some(Ask::Adversary) || row.facts.push_percent().zip(row.facts.push_mns()) == Some(USUAL_PUSH)
}

/// The objects of a suite of Object Sorting.
fn length(row: &Aggregate) -> Option<i64> {
    let is_length = row.facts.asks(OBJECT_SORTING, Ask::Unseen) && row.facts.shows_what_is_there();
    row.facts.objects().filter(|_| is_length)
}
