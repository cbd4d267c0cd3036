//! The order in which models, suites and levels are told: by what they are, then by name; always the same, whatever the
//! order of files and rows.

use std::cmp::Reverse;

use crate::program::Program;
use crate::report::actor::{Actor, ModelParts};
use crate::report::facts::SuiteFacts;
use crate::report::summary::Aggregate;
use crate::task::Family;
use crate::trace::SpecificationForm;

/// Decoders, the one that stands for its model where only one can be shown first.
pub(super) const DECODERS: [&str; 3] = ["mss", "am", "argmax"];

/// Of the rows of one model in a suite the one that stands for it: the most training tasks, the first decoder. Rows
/// stand sorted by [`suite`] and [`actor`], so it is the first.
pub(super) fn leading(aggregates: &[Aggregate]) -> Vec<Aggregate> {
    let mut leading: Vec<Aggregate> = Vec::new();
    for row in aggregates {
        let is_same = |other: &Aggregate| other.suite == row.suite && other.actor.is_same_model(&row.actor);
        if !leading.iter().any(is_same) {
            leading.push(row.clone());
        }
    }
    leading
}

/// A word of a name: letters or a number.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Word {
    Number(u64),
    Letters(String),
}

/// Sorts `sorting_4` before `sorting_40` and both after `sorting`. It is for people who look for a name: nothing is
/// taken from it.
fn natural(name: &str) -> Vec<Word> {
    let words = name.split('_').map(|word| word.parse().map_or_else(|_| Word::Letters(word.to_owned()), Word::Number));
    words.collect()
}

/// Models by their kind, each before its form with the paper's encoder; unknown ones behind.
pub(super) fn model(name: &str, parts: &ModelParts, is_oracle: bool) -> impl Ord + use<> {
    (parts.rank(is_oracle), parts.has_papers_encoder(), natural(name))
}

/// By model, the untagged first, then by how much it was trained on, the most first, then by decoder; experiments stand
/// together.
pub(super) fn actor(actor: &Actor) -> impl Ord + use<> {
    let model = model(&actor.variant, &actor.parts, actor.is_oracle());
    let Actor { experiment, variant: _, parts: _, tag, train_tasks, specification, decoder } = actor.clone();
    let decoder_rank = decoder.as_ref().and_then(|name| DECODERS.iter().position(|&known| known == name));
    // What the paper's models are told by comes first.
    let form = SpecificationForm::ALL.iter().position(|form| Some(form.name()) == specification.as_deref());
    (experiment, model, form, tag, Reverse(train_tasks), specification, decoder_rank, decoder)
}

/// Families in their order; within one the held-out tasks first, since they are what counts, then what is asked for
/// otherwise, from little to much; unknown suites behind, by name.
pub(super) fn suite(name: &str, facts: &SuiteFacts) -> impl Ord + use<> {
    let known = Family::ALL.iter().position(|known| Some(known.name()) == facts.family.as_deref());
    let family = known.unwrap_or(Family::ALL.len());
    let push = (facts.push_percent(), facts.push_mns());
    let instances = (!facts.shows_what_is_there(), facts.bowls, facts.on_table_min, facts.on_table_max);
    let ask = facts.ask().map_or((true, None), |ask| (false, Some(ask)));
    (family, ask, facts.noise_mm(), push, instances, natural(name))
}

/// Programs from the root down; other names behind.
pub(super) fn level(name: &str) -> (usize, Vec<Word>) {
    let rank = Program::ALL.iter().position(|program| program.name() == name).unwrap_or(Program::ALL.len());
    (rank, natural(name))
}
