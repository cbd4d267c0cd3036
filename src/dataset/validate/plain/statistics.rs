//! `meta/stats.json`: there, of the declared widths, in order, and true of the rows.

use std::collections::BTreeMap;

use serde_json::Value;

use crate::artifact::read_json;
use crate::dataset::files::finding::Validation;
use crate::dataset::files::layout;
use crate::dataset::plain::{Declared, DeclaredKind, EpisodeStatistics, PlainSource, PlainVersion, REQUIRED};
use crate::dataset::validate::plain::ranges::Range;
use crate::words::counted;

/// How far a stated value may be from the rows', as a share of their range: floats are summed up in other orders.
const TOLERANCE: f64 = 1e-3;
/// In rising order.
const IN_ORDER: [&str; 7] = ["min", "q01", "q10", "q50", "q90", "q99", "max"];

pub(super) fn check(source: &PlainSource, ranges: &BTreeMap<String, Range>, n_rows: u64, validation: &mut Validation) {
    let path = source.info.root().join(layout::STATS);
    // The later ones of the older datasets have them by episode.
    let by_episode = source.info.version == PlainVersion::V2_1 && check_by_episode(source, validation);
    if !path.exists() {
        if !by_episode {
            let message = "it is missing: LeRobot trains with it".to_owned();
            validation.warn("stats.missing", &path, String::new(), message);
        }
        return;
    }
    let stated: Value = match read_json(&path) {
        Ok(stated) => stated,
        Err(error) => return validation.failed("stats.value", &error.into()),
    };
    let is_numeric = |feature: &&Declared| matches!(feature.kind, DeclaredKind::Numbers(_));
    for feature in source.info.features.iter().filter(is_numeric) {
        let Some(of) = stated.get(&feature.name).filter(|of| of.is_object()) else {
            if !is_number_of(&feature.name) {
                let message = "it has no statistics: LeRobot cannot normalise it".to_owned();
                validation.warn("stats.missing", &path, feature.name.clone(), message);
            }
            continue;
        };
        let found = value_problem(of, feature, n_rows).map(|problem| ("stats.value", problem));
        let found = found.or_else(|| {
            let range = ranges.get(&feature.name).filter(|_| !is_number_of(&feature.name))?;
            range_problem(of, range).map(|problem| ("stats.range", problem))
        });
        if let Some((code, problem)) = found {
            validation.error(code, &path, feature.name.clone(), problem);
        }
    }
}

/// Each episode's statistics; whether there are any.
fn check_by_episode(source: &PlainSource, validation: &mut Validation) -> bool {
    let mut statistics = match EpisodeStatistics::open(&source.info) {
        Ok(Some(statistics)) => statistics,
        Ok(None) => return false,
        Err(error) => {
            validation.failed("stats.value", &error);
            return true;
        }
    };
    for episode in &source.episodes {
        let stated = match statistics.of(episode.index) {
            Ok(stated) => stated,
            Err(error) => {
                validation.failed("stats.value", &error);
                continue;
            }
        };
        let numeric = source.info.features.iter().filter(|feature| matches!(feature.kind, DeclaredKind::Numbers(_)));
        let found = numeric.filter(|feature| stated[&feature.name].is_object()).find_map(|feature| {
            value_problem(&stated[&feature.name], feature, episode.length)
                .map(|problem| format!("{}: {problem}", feature.name))
        });
        if let Some(problem) = found {
            let place = format!("episode {}", episode.index);
            validation.error("stats.value", statistics.path(), place, problem);
        }
    }
    true
}

/// Whether a feature counts rows or texts, which nobody normalises.
fn is_number_of(name: &str) -> bool {
    REQUIRED.contains(&name) || name == "subtask_index" || name.starts_with("ntp.")
}

/// The numbers of an entry, at whatever depth of lists.
fn flat(of: &Value, key: &str) -> Option<Vec<f64>> {
    fn add(value: &Value, numbers: &mut Vec<f64>) -> Option<()> {
        match value {
            Value::Array(items) => items.iter().try_for_each(|item| add(item, numbers)),
            other => {
                numbers.push(other.as_f64().or_else(|| other.as_bool().map(|flag| f64::from(u8::from(flag))))?);
                Some(())
            }
        }
    }
    let mut numbers = Vec::new();
    add(of.get(key)?, &mut numbers)?;
    Some(numbers)
}

/// Values that statistics should have. LeRobot sums up all but the last side of a feature with several.
fn stated_width(of: &Value, feature: &Declared) -> usize {
    let last = feature.shape.last().copied().unwrap_or(1);
    let is_last = feature.shape.len() > 1 && flat(of, "min").is_some_and(|numbers| numbers.len() == last);
    if is_last { last } else { feature.width() }
}

fn value_problem(of: &Value, feature: &Declared, n_rows: u64) -> Option<String> {
    let width = stated_width(of, feature);
    for key in ["min", "max", "mean", "std"] {
        match flat(of, key) {
            None => return Some(format!("{key} is missing, or not of numbers")),
            Some(numbers) if numbers.len() != width => {
                return Some(format!(
                    "{key} has {}, but the shape is {:?}",
                    counted(numbers.len(), "value"),
                    feature.shape
                ));
            }
            Some(_) => {}
        }
    }
    if let Some(count) = flat(of, "count").filter(|count| count.len() != 1 || count[0] != n_rows as f64) {
        return Some(format!("count is {count:?}, but there are {n_rows}", n_rows = counted(n_rows, "frame")));
    }
    let lists: Vec<(&str, Vec<f64>)> = IN_ORDER
        .into_iter()
        .filter_map(|key| Some((key, flat(of, key).filter(|numbers| numbers.len() == width)?)))
        .collect();
    for pair in lists.windows(2) {
        let [(below, low), (above, high)] = pair else { continue };
        let is_in_order = |at: usize| low[at] <= high[at] + 1e-6 * high[at].abs().max(1.0);
        if let Some(at) = (0..width).find(|&at| !is_in_order(at)) {
            return Some(format!("dimension {at}: {below} is {}, but {above} is {}", low[at], high[at]));
        }
    }
    let std = flat(of, "std")?;
    let at = (0..width).find(|&at| std[at].is_nan() || std[at] < 0.0)?;
    Some(format!("dimension {at}: std is {}", std[at]))
}

/// Whether the stated range and mean are those of the rows.
fn range_problem(of: &Value, range: &Range) -> Option<String> {
    let (low, high, mean) = (flat(of, "min")?, flat(of, "max")?, flat(of, "mean")?);
    if low.len() != range.min.len() {
        return None;
    }
    for (at, found_mean) in range.mean().enumerate() {
        let (found_low, found_high) = (range.min[at], range.max[at]);
        if !(found_low.is_finite() && found_high.is_finite() && found_mean.is_finite()) {
            continue;
        }
        let slack = TOLERANCE * (found_high - found_low) + 1e-6 * found_low.abs().max(found_high.abs());
        if (low[at] - found_low).abs() > slack || (high[at] - found_high).abs() > slack {
            let stated = format!("{} to {}", low[at], high[at]);
            return Some(format!("dimension {at}: it is said to be {stated}, but is {found_low} to {found_high}"));
        }
        if (mean[at] - found_mean).abs() > slack.max(1e-9) {
            return Some(format!("dimension {at}: the mean is said to be {}, but is {found_mean}", mean[at]));
        }
    }
    None
}
