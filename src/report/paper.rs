//! What the paper reports in numbers, each under its own conditions, to be set beside results that meet them.
//!
//! # Source
//!
//! Xu et al., "Neural Task Programming: Learning to Generalize Across Hierarchical Tasks", ICRA 2018. Only numbers that
//! its text and tables give; its plots are not read off.

use schemars::JsonSchema;
use serde::Serialize;

use crate::report::facts::{Ask, BLOCK_STACKING, OBJECT_SORTING};
use crate::report::figures::USUAL_PUSH;
use crate::report::kind::{Design, Sight};
use crate::report::summary::Aggregate;

/// A success rate of the paper, and what it was measured under.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct PaperValue {
    /// Of which of the paper's models.
    pub model: &'static str,
    /// How it remembers: see [`ModelParts::core`](crate::report::ModelParts::core).
    pub core: &'static str,
    /// What it decides: see [`ModelParts::scoping`](crate::report::ModelParts::scoping).
    pub scoping: &'static str,
    /// Of which tasks.
    pub tasks: &'static str,
    /// How many tasks it was trained on.
    pub train_tasks: i64,
    /// The share of successes.
    pub success_rate: f64,
    /// Where and how it is said.
    pub source: &'static str,
    /// What results must be of to be set beside it.
    #[serde(skip)]
    conditions: Conditions,
}

/// What a result must be of: a family, a part of the experiments, and as much of it as in the paper.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Conditions {
    family: &'static str,
    ask: Ask,
    /// In words, as [`PaperValue::tasks`] says it.
    words: &'static str,
    train_tasks: i64,
    /// Blocks within reach.
    blocks: Option<i64>,
    /// Chance of a push in percent, and its impulse in millinewton seconds. The paper gives no impulse; ours is the one
    /// that the simulator has unless it is told another.
    push: (i64, i64),
    /// Objects on the table, at least and at most.
    objects: Option<(i64, i64)>,
}

/// Block Stacking with all eight blocks and a thousand training tasks.
const STACKING: Conditions = Conditions {
    family: BLOCK_STACKING,
    ask: Ask::Unseen,
    words: "Block Stacking, 8 blocks, unseen tasks",
    train_tasks: 1000,
    blocks: Some(8),
    push: (0, 0),
    objects: None,
};
const SEEN: Conditions = Conditions { ask: Ask::Seen, words: "Block Stacking, 8 blocks, seen tasks", ..STACKING };
const ADVERSARY: Conditions = Conditions {
    ask: Ask::Adversary,
    words: "Block Stacking, 8 blocks, unseen tasks, an adversary",
    push: USUAL_PUSH,
    ..STACKING
};
/// Object Sorting after four training tasks.
const SORTING: Conditions = Conditions {
    family: OBJECT_SORTING,
    words: "Object Sorting, unseen tasks, 4 to 40 objects",
    train_tasks: 4,
    blocks: None,
    objects: Some((4, 40)),
    ..STACKING
};
const SORTING_4: Conditions =
    Conditions { words: "Object Sorting, unseen tasks, 4 objects", objects: Some((4, 4)), ..SORTING };
const SORTING_40: Conditions =
    Conditions { words: "Object Sorting, unseen tasks, 40 objects", objects: Some((40, 40)), ..SORTING };

const TABLE: &str = "table \u{201c}Adversarial Dynamics\u{201d}, no failure; 1000 training tasks";
const TABLE_PUSHED: &str = "table \u{201c}Adversarial Dynamics\u{201d}, with failures; probability 25 %";
const AROUND_85: &str = "experiment 2, all but Flat \u{201c}around 85 %\u{201d}; 1000 training tasks";
const OVER_90: &str = "experiment 1, \u{201c}over 90 %\u{201d} for 4 to 40 objects";
const FLAT_4: &str = "experiment 1, flat models at 4 objects, \u{201c}around 40 %\u{201d}";
const FLAT_40: &str = "experiment 1, flat models at 40 objects, \u{201c}around 25 %\u{201d}";

/// Model, conditions, success rate, source. The first value that a result meets stands beside it.
const VALUES: [(&str, Design, Conditions, f64, &str); 11] = [
    ("NTP", Design::NTP, STACKING, 0.863, TABLE),
    ("NTP", Design::NTP, SEEN, 0.85, AROUND_85),
    ("NTP", Design::NTP, ADVERSARY, 0.663, TABLE_PUSHED),
    ("NTP", Design::NTP, SORTING, 0.90, OVER_90),
    ("NTP (GRU)", Design::NTP_GRU, STACKING, 0.884, TABLE),
    ("NTP (GRU)", Design::NTP_GRU, SEEN, 0.85, AROUND_85),
    ("NTP (GRU)", Design::NTP_GRU, ADVERSARY, 0.422, TABLE_PUSHED),
    ("NTP (no scope)", Design::NO_SCOPE, SEEN, 0.85, AROUND_85),
    ("Flat (GRU)", Design::FLAT_GRU, SEEN, 0.85, AROUND_85),
    ("Flat", Design::FLAT, SORTING_4, 0.40, FLAT_4),
    ("Flat", Design::FLAT, SORTING_40, 0.25, FLAT_40),
];

/// The standard deviation of the error of the paper's detector, in centimetres: of eight blocks on a table.
pub(super) const DETECTOR_DEVIATION_CM: f64 = 2.0;
/// How many blocks it detects.
pub(super) const DETECTOR_BLOCKS: i64 = 8;

/// The paper's success rates.
pub fn paper_values() -> Vec<PaperValue> {
    let value = |(model, design, conditions, success_rate, source): (_, Design, Conditions, _, _)| PaperValue {
        model,
        core: design.0,
        scoping: design.1,
        tasks: conditions.words,
        train_tasks: conditions.train_tasks,
        success_rate,
        source,
        conditions,
    };
    VALUES.into_iter().map(value).collect()
}

impl PaperValue {
    /// Whether it is to be set beside a result: of the same design on the same tasks after as much training, given
    /// positions (the paper's or an object-centric encoder of them) and a demonstration, and not trained otherwise on
    /// purpose.
    pub(super) fn is_met_by(&self, row: &Aggregate) -> bool {
        let actor = &row.actor;
        actor.is_the_papers()
            && actor.parts.is(Design(self.core, self.scoping))
            && actor.parts.sight() == Some(Sight::Positions)
            && actor.train_tasks == Some(self.train_tasks)
            && self.conditions.are_met_by(row)
    }
}

impl Conditions {
    fn are_met_by(&self, row: &Aggregate) -> bool {
        let facts = &row.facts;
        let push = facts.push_percent().zip(facts.push_mns());
        let objects = facts.objects_min.zip(facts.objects_max);
        let has_objects = |(least, most)| objects.is_some_and(|(fewest, all)| fewest >= least && all <= most);
        facts.asks(self.family, self.ask)
            && facts.blocks == self.blocks
            && push == Some(self.push)
            && facts.shows_what_is_there()
            && self.objects.is_none_or(has_objects)
    }
}
