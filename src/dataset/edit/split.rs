//! A dataset into several: by what its episodes are, or by shares.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use rand::Rng as _;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use crate::dataset::edit::error::EditError;
use crate::dataset::edit::words::EpisodeWords;
use crate::dataset::plain::{PlainSource, has_programs};
use crate::dataset::tables::episodes::read::EpisodeRows;
use crate::seed::Seed;
use crate::words::counted;

/// Parts that are made at most: each is a pass over the dataset.
const MAX_PARTS: usize = 256;

/// What makes the parts.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SplitBy {
    /// Seen and unseen tasks apart.
    Split,
    /// A part for each task.
    Task,
    /// A part for each family.
    Family,
    /// A part for each outcome.
    Outcome,
    /// Named parts of given shares, drawn at random.
    Shares {
        /// Names and shares, which sum to 1.
        parts: Vec<(String, f64)>,
        /// What is drawn.
        unit: Unit,
        /// Seed of the draw.
        seed: u64,
    },
}

/// What is kept together when parts are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Unit {
    /// All episodes of a task, so that no task is in two parts.
    #[default]
    Task,
    /// Each episode by itself.
    Episode,
}

/// Gives each episode of a dataset in words.
fn each_episode(root: &Path, mut take: impl FnMut(&EpisodeWords<'_>)) -> Result<(), EditError> {
    if has_programs(root) {
        for row in EpisodeRows::open(root)?.1 {
            take(&EpisodeWords::of_row(&row?));
        }
        return Ok(());
    }
    let source = PlainSource::open(root)?;
    source.episodes.iter().for_each(|episode| take(&EpisodeWords::of_plain(episode, &source.info)));
    Ok(())
}

/// The parts that have episodes, in order of their names or as they are given.
pub(super) fn part_names(root: &Path, by: &SplitBy) -> Result<Vec<String>, EditError> {
    if !has_programs(root) && matches!(by, SplitBy::Family | SplitBy::Outcome) {
        let problem =
            "it has no program tables, so that nothing tells families and outcomes; allowed: split, task, shares";
        return Err(EditError::refused("edit.parts", root, problem));
    }
    let mut counts: BTreeMap<String, u64> = BTreeMap::new();
    let mut draw = Draw::new(root, by)?;
    each_episode(root, |episode| {
        let part = draw.part_of(episode);
        // One more than may be is enough to refuse.
        if counts.len() <= MAX_PARTS || counts.contains_key(&part) {
            *counts.entry(part).or_default() += 1;
        }
    })?;
    if counts.len() > MAX_PARTS {
        let problem = format!("it would have more than {MAX_PARTS} parts; filter it, or split it by shares");
        return Err(EditError::refused("edit.parts", root, problem));
    }
    let SplitBy::Shares { parts, unit, .. } = by else { return Ok(counts.into_keys().collect()) };
    if let Some((name, share)) = parts.iter().find(|(name, _)| !counts.contains_key(name)) {
        let problem = match (unit, n_units(root, *unit)?) {
            (Unit::Episode, n) => format!("part {name:?} with a share of {share} would have none of {n} episodes"),
            (Unit::Task, n) => format!(
                "part {name:?} with a share of {share} would have none of {}, which stay whole; --unit episode draws \
                 episodes instead",
                counted(n, "task")
            ),
        };
        return Err(EditError::refused("edit.parts", root, problem));
    }
    Ok(parts.iter().map(|(name, _)| name.clone()).collect())
}

/// Tells the part of one episode after another.
pub(super) enum Draw<'b> {
    Value(for<'e> fn(&EpisodeWords<'e>) -> &'e str),
    Shares(Box<Shares<'b>>),
}

/// Parts being drawn.
pub(super) struct Shares<'b> {
    parts: &'b [(String, f64)],
    unit: Unit,
    /// Units that each part shall still have.
    left: Vec<u64>,
    rng: ChaCha8Rng,
    /// The part of each task.
    tasks: BTreeMap<String, usize>,
}

impl<'b> Draw<'b> {
    pub(super) fn new(root: &Path, by: &'b SplitBy) -> Result<Self, EditError> {
        Ok(match by {
            SplitBy::Split => Self::Value(|of| of.split),
            SplitBy::Task => Self::Value(|of| of.task_id),
            SplitBy::Family => Self::Value(|of| of.family),
            SplitBy::Outcome => Self::Value(|of| of.outcome),
            SplitBy::Shares { parts, unit, seed } => {
                check_shares(root, parts)?;
                let left = quotas(parts, n_units(root, *unit)?);
                let rng = Seed(*seed).derive("dataset split", &[]).rng();
                Self::Shares(Box::new(Shares { parts, unit: *unit, left, rng, tasks: BTreeMap::new() }))
            }
        })
    }

    /// Each unit goes to a part by chance, in proportion to the places that the parts have left: all orders of the
    /// units are equally likely, and the parts are as large as they shall be.
    pub(super) fn part_of(&mut self, episode: &EpisodeWords<'_>) -> String {
        match self {
            Self::Value(of) => file_name(of(episode)),
            Self::Shares(shares) => {
                let Shares { parts, unit, left, rng, tasks } = &mut **shares;
                let known = tasks.get(episode.task_id).copied();
                let part = known.unwrap_or_else(|| next_part(left, rng));
                if *unit == Unit::Task && known.is_none() {
                    tasks.insert(episode.task_id.to_owned(), part);
                }
                parts[part].0.clone()
            }
        }
    }
}

fn next_part(left: &mut [u64], rng: &mut ChaCha8Rng) -> usize {
    let mut place = rng.random_range(0..left.iter().sum::<u64>().max(1));
    for (part, left) in left.iter_mut().enumerate() {
        if place < *left {
            *left -= 1;
            return part;
        }
        place -= *left;
    }
    0
}

fn check_shares(root: &Path, parts: &[(String, f64)]) -> Result<(), EditError> {
    let refused = |problem: String| Err(EditError::refused("edit.parts", root, problem));
    let is_name = |name: &str| !name.is_empty() && file_name(name) == name;
    if let Some((name, _)) = parts.iter().find(|(name, _)| !is_name(name)) {
        return refused(format!("part {name:?}: a name has letters, digits, '-', '_' and '.'"));
    }
    if let Some((name, share)) = parts.iter().find(|(_, share)| !(0.0..=1.0).contains(share) || *share == 0.0) {
        return refused(format!("part {name:?} has a share of {share}, but shares are above 0 and at most 1"));
    }
    let sum: f64 = parts.iter().map(|(_, share)| share).sum();
    if (sum - 1.0).abs() > 1e-6 {
        return refused(format!("the shares sum to {sum}, not to 1"));
    }
    let names: BTreeSet<_> = parts.iter().map(|(name, _)| name).collect();
    if names.len() < parts.len() {
        return refused("two parts have the same name".to_owned());
    }
    Ok(())
}

fn n_units(root: &Path, unit: Unit) -> Result<u64, EditError> {
    let (mut tasks, mut n_episodes) = (BTreeSet::new(), 0);
    each_episode(root, |episode| {
        n_episodes += 1;
        if unit == Unit::Task {
            tasks.insert(episode.task_id.to_owned());
        }
    })?;
    Ok(if unit == Unit::Task { tasks.len() as u64 } else { n_episodes })
}

/// How many units each part has: by its share, rounded so that the sum is right.
fn quotas(parts: &[(String, f64)], n_units: u64) -> Vec<u64> {
    let exact: Vec<f64> = parts.iter().map(|(_, share)| share * n_units as f64).collect();
    let mut quotas: Vec<u64> = exact.iter().map(|exact| exact.floor() as u64).collect();
    let mut by_rest: Vec<usize> = (0..parts.len()).collect();
    by_rest.sort_by(|&a, &b| exact[b].fract().total_cmp(&exact[a].fract()));
    let n_left = n_units.saturating_sub(quotas.iter().sum());
    by_rest.into_iter().cycle().take(n_left as usize).for_each(|part| quotas[part] += 1);
    quotas
}

/// A text as the name of a folder.
fn file_name(text: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || ['-', '_', '.'].contains(&c);
    let name: String = text.chars().map(|c| if is_plain(c) { c } else { '-' }).collect();
    name.trim_start_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::{file_name, quotas};

    #[test]
    fn quotas_sum_to_the_whole_and_go_to_the_largest_rests() {
        let parts = |shares: &[f64]| shares.iter().map(|&share| (String::new(), share)).collect::<Vec<_>>();
        assert_eq!(quotas(&parts(&[0.8, 0.2]), 10), [8, 2]);
        assert_eq!(quotas(&parts(&[0.5, 0.3, 0.2]), 7), [4, 2, 1]);
        assert_eq!(quotas(&parts(&[0.5, 0.5]), 3).iter().sum::<u64>(), 3);
        assert_eq!(quotas(&parts(&[0.1, 0.9]), 1), [0, 1]);
    }

    #[test]
    fn names_of_parts_are_names_of_folders() {
        assert_eq!(file_name("../a/b c"), "-a-b-c");
    }
}
