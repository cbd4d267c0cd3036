//! The order in which variants, suites and levels are told: always the same, whatever the order of files and rows.

use std::cmp::Reverse;

use crate::program::Program;
use crate::report::summary::{Actor, Aggregate};
use crate::task::Family;
use crate::trace::SpecificationForm;

/// Variants from the paper's model to its ancestor; the oracle stands last.
const VARIANTS: [&str; 10] = [
    "ntp",
    "ntp_gru",
    "ntp_no_scope",
    "flat",
    "flat_gru",
    "npi",
    "ntp_vid_e2e",
    "ntp_vid_e2e_general",
    "ntp_vid_detector",
    "oracle",
];

/// Decoders, the one that stands for its model where only one can be shown first.
pub(super) const DECODERS: [&str; 3] = ["mss", "am", "argmax"];

/// Of the rows of one variant, told in one way what to do, in a suite of an experiment the one that stands for it: the most training tasks, the
/// first decoder. Rows stand sorted by [`suite`] and [`actor`], so it is the first.
pub(super) fn leading(aggregates: &[Aggregate]) -> Vec<Aggregate> {
    let mut leading: Vec<Aggregate> = Vec::new();
    for row in aggregates {
        let is_same = |other: &Aggregate| {
            let (own, other_actor) = (&row.actor, &other.actor);
            other.suite == row.suite && (&own.experiment, own.model()) == (&other_actor.experiment, other_actor.model())
        };
        if !leading.iter().any(is_same) {
            leading.push(row.clone());
        }
    }
    leading
}

/// What a suite asks of a family.
const PARTS: [&str; 4] = ["unseen", "seen", "topology", "adversary"];

/// A word of a name: letters or a number.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Word {
    Number(u64),
    Letters(String),
}

/// Sorts `sorting_4` before `sorting_40` and both after `sorting`.
fn natural(name: &str) -> Vec<Word> {
    let words = name.split('_').map(|word| word.parse().map_or_else(|_| Word::Letters(word.to_owned()), Word::Number));
    words.collect()
}

/// The place of a variant's kind, whichever its encoder.
pub(super) fn variant_rank(name: &str) -> usize {
    let base = name.strip_suffix("_paper").unwrap_or(name);
    VARIANTS.iter().position(|&known| known == base).unwrap_or(VARIANTS.len())
}

/// Known variants first, each before its form with the paper's encoder; others behind.
pub(super) fn variant(name: &str) -> (usize, Vec<Word>) {
    (variant_rank(name), natural(name))
}

/// By variant, the untagged first, then by how much it was trained on, the most first, then by decoder; experiments stand together.
pub(super) fn actor(actor: &Actor) -> impl Ord + use<> {
    let Actor { experiment, variant: name, tag, train_tasks, specification, decoder } = actor.clone();
    let decoder_rank = decoder.as_ref().and_then(|name| DECODERS.iter().position(|&known| known == name));
    // What the paper's models are told by comes first.
    let form = SpecificationForm::ALL.iter().position(|form| Some(form.name()) == specification.as_deref());
    (experiment, variant(&name), form, tag, Reverse(train_tasks), specification, decoder_rank, decoder)
}

/// Families in their order; within one the held-out tasks first, since they are what counts.
pub(super) fn suite(name: &str) -> (usize, usize, Vec<Word>) {
    let (family, part) = name.split_once('_').unwrap_or((name, ""));
    let family = Family::ALL.iter().position(|known| known.short_name() == family).unwrap_or(Family::ALL.len());
    let part = part.split('_').next().unwrap_or_default();
    let part = PARTS.iter().position(|&known| known == part).unwrap_or(PARTS.len());
    (family, part, natural(name))
}

/// Programs from the root down; other names behind.
pub(super) fn level(name: &str) -> (usize, Vec<Word>) {
    let rank = Program::ALL.iter().position(|program| program.name() == name).unwrap_or(Program::ALL.len());
    (rank, natural(name))
}
