//! What a stage is about to do, written before it does it.
//!
//! # Invariants
//!
//! A plan survives its own JSON: what is read back is equal to what was written and has the same [`Plan::id`]. Numbers
//! in settings are integers and `f32`, which JSON writes as the `f64` that they are; reading JSON may miss that `f64`
//! by its last bit, so a number beside an `f32` is read as that `f32`.

use std::collections::BTreeMap;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::Value;

use crate::artifact::sha256_bytes;
use crate::words::counted;

/// Version of plans, receipts and manifests.
pub(super) const CONTRACT_VERSION: u32 = 1;

/// The version of a stage whose plans do not name one.
const FIRST_STAGE_VERSION: u32 = 1;

/// The distance, in last bits of an `f64`, by which reading JSON may miss a number.
const MOST_MISSED_BITS: u64 = 4;

/// What a stage is about to do.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    /// Version of plans, receipts and manifests.
    pub version: u32,
    /// The stage's name.
    pub stage: String,
    /// Version of the stage: another one makes other files of the same settings and inputs.
    #[serde(default = "first_stage_version", skip_serializing_if = "is_first_stage_version")]
    pub stage_version: u32,
    /// Version of the program that planned. It is told, but does not tell two plans apart: that is what
    /// [`Plan::stage_version`] does.
    pub ntp_version: String,
    /// How many shards there are.
    pub shards: u32,
    /// Hash of the manifest of what is read, by the stage's name; empty for the first stage.
    pub inputs: BTreeMap<String, String>,
    /// The stage's resolved settings.
    #[serde(deserialize_with = "as_written")]
    pub config: Value,
}

impl Plan {
    /// A plan of this program, by the first version of a stage.
    pub fn new(stage: &str, shards: u32, inputs: BTreeMap<String, String>, config: Value) -> Self {
        Self {
            version: CONTRACT_VERSION,
            stage: stage.to_owned(),
            stage_version: FIRST_STAGE_VERSION,
            ntp_version: env!("CARGO_PKG_VERSION").to_owned(),
            shards,
            inputs,
            config,
        }
    }

    /// The same by another version of its stage.
    #[must_use]
    pub fn of_stage_version(self, stage_version: u32) -> Self {
        Self { stage_version, ..self }
    }

    /// Hash of everything in it. A receipt of another plan is not taken.
    pub fn id(&self) -> String {
        sha256_bytes(&serde_json::to_vec(self).unwrap_or_default())
    }

    /// A setting by its path through the settings' tables; `None` when it is not there or of another form.
    pub fn setting<T: DeserializeOwned>(&self, path: &[&str]) -> Option<T> {
        let found = path.iter().try_fold(&self.config, |table, key| table.get(key))?;
        T::deserialize(found).ok()
    }

    /// In what another plan is for other work than this one, in words; `None` when both make the same files.
    pub fn difference(&self, new: &Self) -> Option<String> {
        let Self { version, stage, stage_version, ntp_version: _, shards, inputs, config } = self;
        if (version, stage) != (&new.version, &new.stage) {
            return Some(format!("it is a plan of {stage}, not of {}", new.stage));
        }
        if *stage_version != new.stage_version {
            return Some(format!("made by version {stage_version} of {stage}, this is {}", new.stage_version));
        }
        if let Some(input) = changed_key(inputs, &new.inputs) {
            return Some(format!("its input {input} changed"));
        }
        if config != &new.config {
            return Some(match changed_setting(config, &new.config) {
                Some(key) => format!("its setting {key} changed"),
                None => "its settings changed".to_owned(),
            });
        }
        (*shards != new.shards).then(|| format!("it had {}, now it has {}", counted(*shards, "shard"), new.shards))
    }
}

fn first_stage_version() -> u32 {
    FIRST_STAGE_VERSION
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde gives a reference")]
fn is_first_stage_version(version: &u32) -> bool {
    *version == FIRST_STAGE_VERSION
}

fn changed_setting(old: &Value, new: &Value) -> Option<String> {
    let text = |table: &Value| -> Option<BTreeMap<String, String>> {
        Some(table.as_object()?.iter().map(|(key, value)| (key.clone(), value.to_string())).collect())
    };
    changed_key(&text(old)?, &text(new)?)
}

fn changed_key(old: &BTreeMap<String, String>, new: &BTreeMap<String, String>) -> Option<String> {
    let keys = old.keys().chain(new.keys().filter(|key| !old.contains_key(*key)));
    keys.into_iter().find(|key| old.get(*key) != new.get(*key)).cloned()
}

/// Reads settings with the very numbers that were written.
fn as_written<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Value, D::Error> {
    Value::deserialize(deserializer).map(settle)
}

fn settle(value: Value) -> Value {
    match value {
        Value::Object(table) => Value::Object(table.into_iter().map(|(key, value)| (key, settle(value))).collect()),
        Value::Array(items) => Value::Array(items.into_iter().map(settle).collect()),
        Value::Number(number) if number.is_f64() => number.as_f64().map_or(Value::Null, |read| nearby_f32(read).into()),
        other => other,
    }
}

/// The `f32` that a number was before it went through JSON; the number itself when it was none.
fn nearby_f32(read: f64) -> f64 {
    let nearest = f64::from(read as f32);
    let is_beside = nearest.to_bits().abs_diff(read.to_bits()) <= MOST_MISSED_BITS;
    if is_beside { nearest } else { read }
}
