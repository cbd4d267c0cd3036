//! Whether sources fit together: what is refused, by name.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use sha2::{Digest as _, Sha256};

use crate::dataset::edit::EditError;
use crate::dataset::edit::source::{FILES, Source};
use crate::dataset::files::info::Dtype;
use crate::dataset::files::info::{CameraInfo, FeatureInfo, LEROBOT_VERSION, NTP_VERSION};
use crate::dataset::files::layout::{self, FilePlace};
use crate::dataset::tables::episodes::read::EpisodeRow;
use crate::program::KnownPrograms;

/// Whether a dataset is one that this version can edit.
pub(super) fn check_version(source: &Source) -> Result<(), EditError> {
    let (info, ntp) = (&source.info, &source.ntp);
    let refused = |code, file: &str, problem| Err(EditError::refused(code, &source.root().join(file), problem));
    if info.codebase_version != LEROBOT_VERSION {
        let problem = format!("codebase_version is {:?}, but {LEROBOT_VERSION:?} is edited", info.codebase_version);
        return refused("edit.version", layout::INFO, problem);
    }
    if ntp.schema_version != NTP_VERSION {
        let problem = format!("schema_version is {}, but {NTP_VERSION} is edited", ntp.schema_version);
        return refused("edit.version", layout::NTP_INFO, problem);
    }
    if ntp.has_our_programs() && KnownPrograms::of_hash(&ntp.vocabulary_hash).is_none() {
        let problem = "vocabulary_hash: its programs are not those of this version".to_owned();
        return refused("edit.vocabulary", layout::NTP_INFO, problem);
    }
    match info.features.0.iter().find_map(|(name, feature)| feature_problem(name, feature)) {
        Some((code, problem)) => refused(code, layout::INFO, problem),
        None => Ok(()),
    }
}

/// Why a feature cannot be carried over: values of types that are not known, and pictures that cannot be decoded here.
fn feature_problem(name: &str, feature: &FeatureInfo) -> Option<(&'static str, String)> {
    let refused = |code, problem: String| Some((code, format!("feature {name:?} {problem}")));
    match feature.dtype {
        Dtype::Float32 | Dtype::Float64 | Dtype::Int64 | Dtype::Bool | Dtype::String | Dtype::Language => None,
        Dtype::Other => refused("edit.features", "is of a type that cannot be carried over".to_owned()),
        Dtype::Image | Dtype::Video if !matches!(feature.shape[..], [_, _, 3]) => {
            refused("edit.features", format!("has shape {:?}, but pictures are [height, width, 3]", feature.shape))
        }
        Dtype::Image => None,
        Dtype::Video => match feature.info.as_ref().map(CameraInfo::codec) {
            Some("h264") => None,
            codec => {
                refused("edit.video", format!("is a video in {:?}, but h264 alone is copied", codec.unwrap_or("")))
            }
        },
    }
}

/// Whether a dataset can be appended to the first one.
pub(super) fn check_like(first: &Source, other: &Source) -> Result<(), EditError> {
    let of_first = |found: String, expected: String| {
        format!("{found}, but in {} it is {expected}; both must be the same", first.root().display())
    };
    let refused = |code, file: &str, problem| Err(EditError::refused(code, &other.root().join(file), problem));
    let (info, ntp) = (&other.info, &other.ntp);
    if info.fps != first.info.fps {
        let problem = of_first(format!("fps is {}", info.fps), first.info.fps.to_string());
        return refused("edit.fps", layout::INFO, problem);
    }
    if ntp.annotated_by != first.ntp.annotated_by {
        let by = |source: &Source| source.ntp.annotated_by.clone().unwrap_or_else(|| "an expert of ours".to_owned());
        let problem = of_first(format!("its programs are annotated by {}", by(other)), by(first));
        return refused("edit.vocabulary", layout::NTP_INFO, problem);
    }
    if ntp.frames != first.ntp.frames {
        let problem = of_first(format!("frames is {:?}", ntp.frames), format!("{:?}", first.ntp.frames));
        return refused("edit.frames", layout::NTP_INFO, problem);
    }
    if ntp.n_slots != first.ntp.n_slots {
        let problem = of_first(format!("n_slots is {}", ntp.n_slots), first.ntp.n_slots.to_string());
        return refused("edit.slots", layout::NTP_INFO, problem);
    }
    if let Some((name, found, expected)) = other_feature(first, other) {
        let problem = of_first(format!("feature {name:?} is {found}"), expected);
        return refused("edit.features", layout::INFO, problem);
    }
    check_columns(first, other)
}

/// A feature that is declared otherwise. Names of values may differ, as names of slots do.
fn other_feature(first: &Source, other: &Source) -> Option<(String, String, String)> {
    let of = |source: &Source| -> BTreeMap<String, String> {
        let features = source.info.features.0.iter();
        let text = |feature: &FeatureInfo| {
            let codec = feature.info.as_ref().map_or("", CameraInfo::codec);
            format!("{} {:?} {codec}", feature.dtype.name(), feature.shape).trim_end().to_owned()
        };
        features.map(|(name, feature)| (name.clone(), text(feature))).collect()
    };
    let (expected, found) = (of(first), of(other));
    let names: BTreeSet<&String> = expected.keys().chain(found.keys()).collect();
    let name = names.into_iter().find(|name| expected.get(*name) != found.get(*name))?;
    let text = |features: &BTreeMap<String, String>| features.get(name).cloned().unwrap_or("not there".to_owned());
    Some((name.clone(), text(&found), text(&expected)))
}

fn check_columns(first: &Source, other: &Source) -> Result<(), EditError> {
    let (a, b) = (&first.cursors, &other.cursors);
    let tables = [
        (FILES.frames, a.frames.schema(), b.frames.schema()),
        (FILES.calls, a.calls.schema(), b.calls.schema()),
        (FILES.scopes, a.scopes.schema(), b.scopes.schema()),
        (FILES.meta, a.meta.schema(), b.meta.schema()),
        (FILES.provenance, a.provenance.schema(), b.provenance.schema()),
    ];
    for (files, expected, found) in tables {
        if expected.fields() != found.fields() {
            let names =
                |fields: &arrow::datatypes::Fields| fields.iter().map(ToString::to_string).collect::<BTreeSet<_>>();
            let (expected, found) = (names(expected.fields()), names(found.fields()));
            let differing = expected.symmetric_difference(&found).next().cloned().unwrap_or("their order".to_owned());
            let path = files.path(other.root(), FilePlace::default());
            let problem = format!("its columns are not those of {}: {differing}", first.root().display());
            return Err(EditError::refused("edit.columns", &path, problem));
        }
    }
    Ok(())
}

/// What the episodes so far were, so that none comes twice and no task in two splits.
///
/// Memory grows with recordings and distinct tasks: an entry for each recording and 64 of its episodes.
#[derive(Default)]
pub(super) struct Seen {
    /// By recording and number of 64 episodes, which of them.
    episodes: BTreeMap<([u8; 16], i64), u64>,
    last: Option<(String, [u8; 16])>,
    /// By task id: split and text.
    tasks: BTreeMap<String, (String, String)>,
}

impl Seen {
    /// Takes an episode down, if it is none of those before.
    pub(super) fn note(&mut self, root: &Path, row: &EpisodeRow) -> Result<(), EditError> {
        self.note_episode(root, row)?;
        self.note_task(&root.join(layout::EPISODES), row)
    }

    /// The same, whatever its task: of tasks of others nothing says that they are of one split.
    pub(super) fn note_episode(&mut self, root: &Path, row: &EpisodeRow) -> Result<(), EditError> {
        let path = root.join(layout::EPISODES);
        let recording = self.recording(row);
        let flag = 1_u64 << row.recording_index.rem_euclid(64);
        let flags = self.episodes.entry((recording, row.recording_index.div_euclid(64))).or_default();
        if *flags & flag != 0 {
            let problem = format!(
                "episode {} is there twice: it is episode {} of the recording {} (SHA-256 {:?})",
                row.episode_index, row.recording_index, row.recording, row.recording_sha256
            );
            return Err(EditError::refused("edit.episode", &path, problem));
        }
        *flags |= flag;
        Ok(())
    }

    /// Names the recording by its hash, or where it has none by its name.
    fn recording(&mut self, row: &EpisodeRow) -> [u8; 16] {
        let name = if row.recording_sha256.is_empty() { &row.recording } else { &row.recording_sha256 };
        if let Some((_, hash)) = self.last.as_ref().filter(|(last, _)| last == name) {
            return *hash;
        }
        let mut hash = [0; 16];
        hash.copy_from_slice(&Sha256::digest(name.as_bytes())[..16]);
        self.last = Some((name.clone(), hash));
        hash
    }

    fn note_task(&mut self, path: &Path, row: &EpisodeRow) -> Result<(), EditError> {
        let Some((split, text)) = self.tasks.get(&row.task_id) else {
            self.tasks.insert(row.task_id.clone(), (row.split.clone(), row.task_text.clone()));
            return Ok(());
        };
        if *split == row.split && *text == row.task_text {
            return Ok(());
        }
        let problem = format!(
            "episode {}: task {:?} is {} and {:?} here, but {split} and {text:?} before",
            row.episode_index, row.task_id, row.split, row.task_text
        );
        Err(EditError::refused("edit.task", path, problem))
    }
}
