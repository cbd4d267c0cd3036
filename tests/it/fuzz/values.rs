//! Wrong values in whole tables: what no broken byte tells, the rows must.

use std::path::PathBuf;

use ntp::dataset::validate;
use ntp::table::{self, Column, TableSchema};

use super::{FILES, run, small_dataset};

/// Columns whose values nothing else in a dataset repeats in full: a wrong value is only found by the manifest or by
/// `SHA256SUMS`. Positions are held by the range of all, times by their order, texts by their form.
const UNCHECKED: [(&str, &[&str]); 5] = [
    (
        "frames",
        &[
            "observation.state",
            "subtask_index",
            "ntp.time_secs",
            "ntp.boundary",
            "ntp.recording_frame",
            "ntp.gripper_in_world_m",
        ],
    ),
    (
        "episodes",
        &[
            "seed",
            "family",
            "trial",
            "counts",
            "actor",
            "recording",
            "recording_sha256",
            "recording_index",
            "n_recorded_frames",
            "sim_secs",
            "slots",
        ],
    ),
    ("meta_episodes", &["stats/"]),
    ("subtasks", &["subtask"]),
    ("scopes", &[]),
];

fn is_checked(schema: &TableSchema, column: &str) -> bool {
    let unchecked = UNCHECKED.iter().find(|(table, _)| *table == schema.name()).map_or(&[][..], |(_, names)| names);
    !unchecked.iter().any(|name| *name == column || (name.ends_with('/') && column.starts_with(name)))
}

/// Whatever differs is in a column that nothing else repeats.
#[track_caller]
pub(super) fn assert_same_where_checked(schema: &TableSchema, before: &[(String, Column)], after: &[(String, Column)]) {
    for ((name, before), (_, after)) in before.iter().zip(after) {
        assert!(before == after || !is_checked(schema, name), "{}: a wrong {name} was taken for right", schema.name());
    }
}

const INTEGERS: [i64; 12] = [0, 1, -1, 2, 7, 255, 65_536, 1 << 31, 1 << 32, 1 << 40, i64::MAX, i64::MIN];
const FLOATS: [f64; 8] = [0.0, -0.5, 1.0, 1e9, -1e30, f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
const WORDS: [&str; 8] = ["", "none", "pick", "unseen", "block_A", "success", "block_stacking/pick", "\u{0}\u{202e}🦀"];

/// Puts another value into a row; false when the column has no such row.
fn spoil(column: &mut Column, row: usize, choice: usize) -> bool {
    let integer = INTEGERS[choice % INTEGERS.len()];
    let float = FLOATS[choice % FLOATS.len()];
    let word = || WORDS[choice % WORDS.len()].to_owned();
    if column.is_empty() {
        return false;
    }
    let row = row % column.len();
    match column {
        Column::Int64(rows) => rows[row] = integer,
        Column::OptionalInt64(rows) => rows[row] = Some(integer).filter(|_| !choice.is_multiple_of(5)),
        Column::Float32(rows) => rows[row] = float as f32,
        Column::OptionalFloat32(rows) => rows[row] = Some(float as f32),
        Column::Float64(rows) => rows[row] = float,
        Column::OptionalFloat64(rows) => rows[row] = Some(float),
        Column::Boolean(rows) => rows[row] = !rows[row],
        Column::Text(rows) => rows[row] = word(),
        Column::OptionalText(rows) => rows[row] = Some(word()).filter(|_| !choice.is_multiple_of(5)),
        Column::Int64List(rows) => rows[row].insert(0, integer),
        Column::Float32List(rows) if choice.is_multiple_of(2) => {
            rows[row].iter_mut().for_each(|value| *value = float as f32);
        }
        Column::Float32List(rows) => drop(rows[row].pop()),
        Column::Float64List(rows) => rows[row].push(float),
        Column::TextList(rows) => rows[row].push(word()),
    }
    true
}

#[test]
fn fuzz_values_of_tables() {
    let dataset = small_dataset();
    let root = dataset.path();
    let tables: Vec<(PathBuf, TableSchema, Vec<u8>)> = FILES[..5]
        .iter()
        .filter_map(|(file, schema)| Some((root.join(file), (*schema)?)))
        .map(|(path, schema)| (path.clone(), schema, std::fs::read(path).unwrap()))
        .collect();
    let strategy = (0..tables.len(), 0..1000_usize, 0..1000_usize, 0..1000_usize);
    run(50, &strategy, |(table, column, row, choice)| {
        let (path, schema, whole) = &tables[table];
        let before = table::read(path, schema).unwrap().into_inner();
        let mut after = before.clone();
        let at = column % after.len();
        let (name, changed) = &mut after[at];
        if spoil(changed, row, choice) && *changed != before[at].1 {
            let name = name.clone();
            let columns = after.iter().map(|(name, column)| (name.as_str(), column.clone())).collect();
            table::write(path, schema, columns).unwrap();
            let found = validate(root);
            std::fs::write(path, whole).unwrap();
            let is_found = !found.is_valid();
            assert!(is_found || !is_checked(schema, &name), "{}: a wrong {name} was taken for right", schema.name());
        }
    });
}
