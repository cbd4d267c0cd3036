//! What differs between two datasets.
//!
//! Episodes are the same when they come from the same place of the same recording. They are compared by hashes of
//! their rows, without what counts only where they lie; those that differ are then read again and told apart. Where
//! there are no program tables, nothing tells where an episode comes from: then it is known by what is in it.

mod detail;
mod digest;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use serde::Serialize;

use crate::dataset::edit::EditError;
use crate::dataset::edit::plain::diff::{self as plain, Contents, Digest};
use crate::dataset::edit::source::Source;
use crate::dataset::plain::has_programs;
use detail::details;
use digest::{EpisodeDigest, digests};

/// Differing episodes that are told in detail, and of episodes in one dataset alone.
const MAX_TOLD: usize = 100;

/// An episode by where it lies and where it comes from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct EpisodeName {
    /// Its number in its dataset.
    pub episode_index: i64,
    /// Its task.
    pub task_id: String,
    /// The recording that it comes from.
    pub recording: String,
    /// Its place there.
    pub recording_index: i64,
}

/// An episode that is in both, but not the same.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ChangedEpisode {
    /// As it is in the first dataset.
    pub before: EpisodeName,
    /// Its number in the second.
    pub after_index: i64,
    /// Names of the columns of `ntp/episodes.parquet` that differ.
    pub episode_columns: Vec<String>,
    /// Ids of the calls that differ, or are in one alone.
    pub calls: Vec<i64>,
    /// How many scoping labels differ, or are in one alone.
    pub scopes: u64,
    /// By column of `data/` and video, in how many frames it differs. `rows` counts frames that are in one alone.
    pub frames: BTreeMap<String, u64>,
}

/// What differs between two datasets.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// Episodes that are the same in both.
    pub same: u64,
    /// How many of these have another number.
    pub moved: u64,
    /// Episodes that are in the first one alone.
    pub removed: u64,
    /// Episodes that are in the second one alone.
    pub added: u64,
    /// Episodes that are in both and differ.
    pub changed: u64,
    /// The first hundred of each.
    pub removed_episodes: Vec<EpisodeName>,
    /// The same of those added.
    pub added_episodes: Vec<EpisodeName>,
    /// The same of those changed.
    pub changed_episodes: Vec<ChangedEpisode>,
    /// What else differs: rows per second, features, slots.
    pub settings: Vec<String>,
}

impl Difference {
    /// Whether nothing differs. Episodes may lie in another order.
    pub fn is_none(&self) -> bool {
        self.removed + self.added + self.changed == 0 && self.settings.is_empty()
    }
}

/// Compares two datasets.
///
/// Memory grows with the number of episodes: some 80 bytes each.
///
/// # Errors
///
/// When one of them cannot be read.
pub fn diff(before: &Path, after: &Path) -> Result<Difference, EditError> {
    if !(has_programs(before) && has_programs(after)) {
        return diff_plain(before, after);
    }
    let settings = other_settings(&Source::open(before)?, &Source::open(after)?);
    let (first, second) = (digests(before)?, digests(after)?);
    let index = |digests: &[EpisodeDigest]| -> BTreeMap<[u64; 2], usize> {
        digests.iter().enumerate().map(|(at, digest)| (digest.identity, at)).collect()
    };
    let (in_first, in_second) = (index(&first), index(&second));
    let alone = |digests: &[EpisodeDigest], others: &BTreeMap<[u64; 2], usize>| -> Vec<usize> {
        (0..digests.len()).filter(|&at| !others.contains_key(&digests[at].identity)).collect()
    };
    let (removed, added) = (alone(&first, &in_second), alone(&second, &in_first));
    let pairs: Vec<(usize, usize)> =
        first.iter().enumerate().filter_map(|(at, digest)| Some((at, *in_second.get(&digest.identity)?))).collect();
    let changed: Vec<(usize, usize)> =
        pairs.iter().copied().filter(|&(a, b)| first[a].content != second[b].content).collect();
    let moved = pairs.iter().filter(|(a, b)| a != b && first[*a].content == second[*b].content).count() as u64;
    let told: Vec<(usize, usize)> = changed.iter().copied().take(MAX_TOLD).collect();
    Ok(Difference {
        same: (pairs.len() - changed.len()) as u64,
        moved,
        removed: removed.len() as u64,
        added: added.len() as u64,
        changed: changed.len() as u64,
        removed_episodes: detail::names(before, &removed[..removed.len().min(MAX_TOLD)])?,
        added_episodes: detail::names(after, &added[..added.len().min(MAX_TOLD)])?,
        changed_episodes: details(before, after, &told)?,
        settings,
    })
}

/// The same where there are no program tables in both: an episode is known by what is in it, else by its number.
fn diff_plain(before: &Path, after: &Path) -> Result<Difference, EditError> {
    let (first, second) = (plain::digests(before)?, plain::digests(after)?);
    let (mut a, mut b) = (Contents::open(before)?, Contents::open(after)?);
    let mut left: BTreeSet<usize> = (0..second.len()).collect();
    let mut places: BTreeMap<&Digest, Vec<usize>> = BTreeMap::new();
    second.iter().enumerate().rev().for_each(|(at, content)| places.entry(content).or_default().push(at));
    let mut found = Difference { settings: plain_settings(&a, &b), ..Difference::default() };
    let mut others = Vec::new();
    for (at, content) in first.iter().enumerate() {
        let same = match second.get(at) {
            Some(other) if other == content && left.contains(&at) => Some(at),
            _ => places.get(content).and_then(|places| places.iter().rev().find(|at| left.contains(at)).copied()),
        };
        match same {
            Some(place) => {
                left.remove(&place);
                found.same += 1;
                found.moved += u64::from(place != at);
            }
            None => others.push(at),
        }
    }
    let name = |contents: &Contents, at: usize| plain_name(contents, at);
    for at in others {
        if left.remove(&at) {
            found.changed += 1;
            if found.changed_episodes.len() < MAX_TOLD {
                let frames = plain::differing(&mut a, &mut b, [at, at])?;
                let before = name(&a, at);
                let (after_index, nothing) = (at as i64, Vec::new());
                let (episode_columns, calls, scopes) = (Vec::new(), nothing, 0);
                found.changed_episodes.push(ChangedEpisode {
                    before,
                    after_index,
                    episode_columns,
                    calls,
                    scopes,
                    frames,
                });
            }
        } else {
            found.removed += 1;
            if found.removed_episodes.len() < MAX_TOLD {
                found.removed_episodes.push(name(&a, at));
            }
        }
    }
    found.added = left.len() as u64;
    found.added_episodes = left.into_iter().take(MAX_TOLD).map(|at| name(&b, at)).collect();
    Ok(found)
}

fn plain_name(contents: &Contents, at: usize) -> EpisodeName {
    let episode = &contents.source.episodes[at];
    EpisodeName {
        episode_index: episode.index,
        task_id: episode.tasks.join(", "),
        recording: String::new(),
        recording_index: episode.index,
    }
}

/// What a feature is.
fn feature_words(dtype: &str, shape: &impl std::fmt::Debug) -> String {
    format!("{dtype} {shape:?}")
}

/// Features with what each is.
fn listed<'a>(features: impl IntoIterator<Item = (&'a String, String)>) -> String {
    features.into_iter().map(|(name, words)| format!("{name} {words}")).collect::<Vec<_>>().join(", ")
}

fn plain_settings(before: &Contents, after: &Contents) -> Vec<String> {
    let of = |contents: &Contents| {
        let info = &contents.source.info;
        let features: BTreeMap<_, _> = info
            .features
            .iter()
            .map(|feature| (&feature.name, feature_words(&feature.dtype, &feature.shape)))
            .collect();
        [
            ("fps", info.fps.to_string()),
            (
                "splits",
                info.splits.iter().map(|(name, range)| format!("{name} {range:?}")).collect::<Vec<_>>().join(", "),
            ),
            ("features", listed(features)),
        ]
    };
    let pairs = of(before).into_iter().zip(of(after));
    let named = |contents: &Contents| -> BTreeMap<String, String> {
        let features = contents.source.info.features.iter();
        features.map(|feature| (feature.name.clone(), feature.json["names"].to_string())).collect()
    };
    let names = other_names(&named(before), &named(after));
    pairs.filter(|(a, b)| a != b).map(|((name, a), (_, b))| format!("{name}: {a} → {b}")).chain(names).collect()
}

/// Features of both whose values have other names, or the same in another order.
fn other_names(before: &BTreeMap<String, String>, after: &BTreeMap<String, String>) -> Vec<String> {
    let other = |(feature, a): (&String, &String)| {
        let b = after.get(feature).filter(|b| *b != a)?;
        Some(format!("names of {feature}: {a} → {b}"))
    };
    before.iter().filter_map(other).collect()
}

fn other_settings(before: &Source, after: &Source) -> Vec<String> {
    let of = |source: &Source| {
        let features: BTreeMap<_, _> = source.info.features.0.iter().cloned().collect();
        [
            ("fps", format!("{}", source.info.fps)),
            ("frames", source.ntp.frames.clone()),
            ("n_slots", format!("{}", source.ntp.n_slots)),
            ("vocabulary_hash", source.ntp.vocabulary_hash.clone()),
            ("features", listed(features.iter().map(|(name, of)| (name, feature_words(of.dtype.name(), &of.shape))))),
        ]
    };
    let pairs = of(before).into_iter().zip(of(after));
    let named = |source: &Source| -> BTreeMap<String, String> {
        let features = source.info.features.0.iter();
        features.map(|(name, of)| (name.clone(), format!("{:?}", of.names.as_deref().unwrap_or_default()))).collect()
    };
    let names = other_names(&named(before), &named(after));
    pairs.filter(|(a, b)| a != b).map(|((name, a), (_, b))| format!("{name}: {a} → {b}")).chain(names).collect()
}
