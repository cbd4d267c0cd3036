//! Items: every piece of work with an address.
//!
//! An item is a shard of a unit. A stage's items are numbered from 0, unit by unit in the pipeline file's order; so the
//! numbers follow from that file alone, and are known before anything has run.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::{Range, RangeInclusive};
use std::str::FromStr;

use serde::Serialize;

use crate::artifact::{ContractError, Plan, StageDir};
use crate::pipeline::failures::Failure;
use crate::pipeline::unit::{Unit, fresh_plan, plan};
use crate::pipeline::{Pipeline, PipelineError, RunDir, Scope, Stage, runner};
use crate::words::plural;

/// A piece of work.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Item {
    /// Its number in its stage.
    pub item: u64,
    /// Its stage.
    pub stage: Stage,
    /// What it is a part of.
    pub unit: String,
    /// Which part.
    pub shard: u32,
    /// How many parts there are.
    pub shards: u32,
    /// How much work it is, in what [`Item::counted`] says.
    pub amount: u64,
    /// What is counted: `episodes`, `steps`, `tasks`, `experiments`.
    pub counted: String,
    /// One of them.
    #[serde(skip)]
    pub of: &'static str,
    /// What came of it.
    pub state: ItemState,
    /// How it failed the last time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub failure: Option<Failure>,
}

/// What came of an item.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ItemState {
    /// Its receipt is there.
    Done,
    /// It was not done yet.
    Left,
    /// It failed, and was not done since.
    Failed,
}

/// Item numbers as they are written: `0-3,7`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ItemRanges(pub Vec<RangeInclusive<u64>>);

/// The items of a stage of an experiment, with what came of them in a run directory.
///
/// # Errors
///
/// When what lies in the run directory cannot be read.
pub fn items(pipeline: &Pipeline, run: &RunDir, stage: Stage) -> Result<Vec<Item>, PipelineError> {
    let mut items = Vec::new();
    for numbered in number(runner::units(pipeline, stage)) {
        list(run, &numbered, &mut items)?;
    }
    Ok(items)
}

/// The plans of an experiment before anything has run, so without inputs: every unit's, stage by stage.
pub fn plans(pipeline: &Pipeline) -> Vec<Plan> {
    let units = Stage::ALL.into_iter().flat_map(|stage| runner::units(pipeline, stage));
    units.map(|unit| fresh_plan(unit.as_ref(), BTreeMap::new())).collect()
}

fn list(run: &RunDir, numbered: &Numbered<'_>, items: &mut Vec<Item>) -> Result<(), PipelineError> {
    let unit = numbered.unit.as_ref();
    let state = State::of(run, unit)?;
    for (item, shard) in numbered.numbers.clone().zip(0..) {
        let amount = unit.amount(shard);
        let is_done = state.is_done(shard)?;
        let failure = (!is_done).then(|| Failure::of(run, unit.stage(), item)).flatten();
        items.push(Item {
            item,
            stage: unit.stage(),
            unit: unit.name(),
            shard,
            shards: unit.shards(),
            amount: amount.count,
            counted: plural(amount.of),
            of: amount.of,
            state: match (is_done, &failure) {
                (true, _) => ItemState::Done,
                (false, None) => ItemState::Left,
                (false, Some(_)) => ItemState::Failed,
            },
            failure,
        });
    }
    Ok(())
}

/// How far a unit is.
enum State {
    /// Every shard is there.
    Finished,
    /// Nothing is there, or of another plan, or what it reads is not there.
    Open,
    /// Shards of a plan may be there. What has one shard alone is done when it is finished.
    Begun { dir: StageDir, plan_id: String, has_parts: bool },
}

impl State {
    fn of(run: &RunDir, unit: &dyn Unit) -> Result<Self, PipelineError> {
        let plan = match plan(unit, run) {
            Err(PipelineError::Contract(ContractError::Unfinished { .. })) => return Ok(Self::Open),
            plan => plan?,
        };
        let dir = unit.dir(run);
        if dir.plan()?.as_ref() != Some(&plan) {
            return Ok(Self::Open);
        }
        let is_finished = dir.manifest()?.is_some_and(|manifest| dir.check_files(&manifest, false).is_ok());
        Ok(if is_finished {
            Self::Finished
        } else {
            Self::Begun { dir, plan_id: plan.id(), has_parts: plan.shards > 1 }
        })
    }

    fn is_done(&self, shard: u32) -> Result<bool, PipelineError> {
        match self {
            Self::Finished => Ok(true),
            Self::Open => Ok(false),
            Self::Begun { dir, plan_id, has_parts } => Ok(*has_parts && dir.receipt(plan_id, shard)?.is_some()),
        }
    }
}

/// A unit with the numbers of its items.
pub(super) struct Numbered<'p> {
    pub(super) unit: Box<dyn Unit + 'p>,
    pub(super) numbers: Range<u64>,
}

/// Numbers the items of a stage's units.
pub(super) fn number(units: Vec<Box<dyn Unit + '_>>) -> Vec<Numbered<'_>> {
    let mut next = 0;
    let numbered = units.into_iter().map(|unit| {
        let begin = next;
        next += u64::from(unit.shards());
        Numbered { unit, numbers: begin..next }
    });
    numbered.collect()
}

impl Numbered<'_> {
    /// The shards of this unit that a process is asked for.
    pub(super) fn asked(&self, scope: &Scope, n_items: u64) -> Vec<u32> {
        let is_asked = |item: u64, shard: u32| match scope {
            Scope::Whole | Scope::Begin | Scope::Commit { .. } | Scope::Fetch => true,
            Scope::Shard(asked) => *asked == shard,
            Scope::Items(ranges) => ranges.iter().any(|range| range.contains(&item)),
            Scope::Part { part, of } => part_of(*part, *of, n_items).contains(&item),
        };
        self.numbers.clone().zip(0..).filter(|&(item, shard)| is_asked(item, shard)).map(|(_, shard)| shard).collect()
    }
}

/// The items of one of equal parts.
fn part_of(part: u64, of: u64, n_items: u64) -> Range<u64> {
    let begin = |part: u64| (u128::from(part.min(of)) * u128::from(n_items) / u128::from(of.max(1))) as u64;
    begin(part)..begin(part.saturating_add(1))
}

/// Words that are no item numbers.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{word:?} is no list of items; written as 7 or 0-3,7")]
pub struct NoItems {
    /// As typed.
    pub word: String,
}

impl FromStr for ItemRanges {
    type Err = NoItems;

    fn from_str(word: &str) -> Result<Self, NoItems> {
        let range = |part: &str| {
            let (first, last) = part.split_once('-').unwrap_or((part, part));
            let (first, last): (u64, u64) = (first.parse().ok()?, last.parse().ok()?);
            (first <= last).then_some(first..=last)
        };
        let ranges: Option<Vec<_>> = word.split(',').map(range).collect();
        ranges.map(Self).ok_or_else(|| NoItems { word: word.to_owned() })
    }
}

impl FromIterator<u64> for ItemRanges {
    /// Of numbers in order.
    fn from_iter<I: IntoIterator<Item = u64>>(numbers: I) -> Self {
        let mut ranges: Vec<RangeInclusive<u64>> = Vec::new();
        for number in numbers {
            match ranges.last_mut() {
                Some(range) if range.end().checked_add(1) == Some(number) => *range = *range.start()..=number,
                _ => ranges.push(number..=number),
            }
        }
        Self(ranges)
    }
}

impl fmt::Display for ItemRanges {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let range = |range: &RangeInclusive<u64>| match (range.start(), range.end()) {
            (first, last) if first == last => first.to_string(),
            (first, last) => format!("{first}-{last}"),
        };
        f.write_str(&self.0.iter().map(range).collect::<Vec<_>>().join(","))
    }
}
