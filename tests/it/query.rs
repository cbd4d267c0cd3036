//! SQL over the tables: counts agree with the writer's, examples are true, and nothing panics.

use std::path::Path;

use ntp::dataset::ConvertConfig;
use ntp::query::{QueryError, Tables, query};
use proptest::prelude::{ProptestConfig, proptest};
use serde_json::{Value, json};

use crate::dataset::{convert_all, episodes};

/// A dataset in a folder, with its tables.
fn small_dataset() -> (tempfile::TempDir, Tables) {
    let folder = tempfile::tempdir().unwrap();
    convert_all(&episodes(), &ConvertConfig::default(), folder.path()).unwrap();
    let mut tables = Tables::default();
    tables.add_dataset(folder.path()).unwrap();
    (folder, tables)
}

fn rows(tables: &Tables, sql: &str) -> Vec<Value> {
    query(tables, sql).unwrap().to_json()
}

#[test]
fn counts_are_those_that_were_written() {
    let folder = tempfile::tempdir().unwrap();
    let written = convert_all(&episodes(), &ConvertConfig::default(), folder.path()).unwrap();
    let mut tables = Tables::default();
    tables.add_dataset(folder.path()).unwrap();
    let counts = [
        ("frames", written.frames),
        ("calls", written.calls),
        ("scopes", written.scopes),
        ("episodes", written.episodes),
        ("tasks", written.tasks),
    ];
    for (table, expected) in counts {
        assert_eq!(rows(&tables, &format!("SELECT COUNT(*) AS n FROM {table}")), [json!({ "n": expected })], "{table}");
    }
    assert_eq!(tables.names(), ["calls", "episodes", "frames", "scopes", "subtasks", "tasks"]);
}

#[test]
fn spans_by_program_are_those_of_the_episodes() {
    let (_folder, tables) = small_dataset();
    let sql = "SELECT COUNT(*) AS n, SUM(output_end - output_begin) AS frames FROM calls WHERE program = 'pick'";
    let calls = episodes().into_iter().flat_map(|episode| episode.into_parts().calls);
    let picks: Vec<usize> =
        calls.filter(|call| call.program.name() == "pick").map(|call| call.output.unwrap().len()).collect();
    assert_eq!(rows(&tables, sql), [json!({ "n": picks.len(), "frames": picks.iter().sum::<usize>() })]);
}

#[test]
fn text_csv_and_parquet_hold_the_same_rows() {
    let (folder, tables) = small_dataset();
    let sql = "SELECT call_id, program, argument, end_of_program FROM calls WHERE episode_index = 0 ORDER BY call_id \
               LIMIT 3";
    let answer = query(&tables, sql).unwrap();
    let csv = answer.to_csv().unwrap();
    assert_eq!(csv.lines().next(), Some("call_id,program,argument,end_of_program"));
    assert_eq!(csv.lines().nth(1), Some("0,block_stacking,,false"));
    assert_eq!(answer.n_rows(), csv.lines().count() - 1);
    let text = answer.to_text();
    assert_eq!(text.lines().next(), Some("call_id  program         argument  end_of_program"));
    assert_eq!(text.lines().last(), Some("3 rows"));
    let path = folder.path().join("answer.parquet");
    answer.write_parquet(&path).unwrap();
    let again = polars::prelude::LazyFrame::scan_parquet(
        polars::prelude::PlRefPath::try_from_path(&path).unwrap(),
        polars::prelude::ScanArgsParquet::default(),
    );
    assert_eq!(again.unwrap().collect().unwrap().height(), 3);
}

#[test]
fn groups_come_in_an_order_of_their_own_where_none_is_asked_for() {
    let (_folder, tables) = small_dataset();
    let programs = |sql: &str| -> Vec<String> {
        rows(&tables, sql).iter().map(|row| row["program"].as_str().unwrap().to_owned()).collect()
    };
    let found = programs("SELECT program, COUNT(*) AS calls FROM calls GROUP BY program");
    assert!(found.len() > 4 && found.is_sorted(), "{found:?}");
    let found = programs("SELECT DISTINCT program FROM calls");
    assert!(found.is_sorted(), "{found:?}");
    let found = programs("SELECT program FROM calls WHERE episode_index = 0");
    assert_eq!(found[..3], ["block_stacking", "pick_and_place", "pick"]);
}

#[test]
fn floats_are_printed_as_short_as_they_were_meant() {
    let (_folder, tables) = small_dataset();
    let found = rows(&tables, "SELECT timestamp FROM frames WHERE frame_index = 1 LIMIT 1");
    assert_eq!(found, [json!({ "timestamp": 0.1 })]);
}

#[test]
fn lists_are_json_but_not_csv() {
    let (_folder, tables) = small_dataset();
    let answer = query(&tables, "SELECT action FROM frames WHERE \"index\" = 0").unwrap();
    assert_eq!(answer.to_json()[0]["action"].as_array().unwrap().len(), 4);
    let error = answer.to_csv().unwrap_err();
    assert!(matches!(&error, QueryError::NoForm { column, .. } if column == "action"), "{error}");
}

#[test]
fn an_unknown_table_is_refused_with_those_there_are() {
    let (_folder, tables) = small_dataset();
    let error = query(&tables, "SELECT * FROM rollouts").err().unwrap();
    assert!(error.to_string().ends_with("tables are calls, episodes, frames, scopes, subtasks, tasks"), "{error}");
}

#[test]
fn a_dataset_without_one_of_its_files_is_refused() {
    let (folder, _) = small_dataset();
    std::fs::remove_file(folder.path().join("ntp/calls/chunk-000/file-000.parquet")).unwrap();
    let error = Tables::default().add_dataset(folder.path()).unwrap_err();
    assert!(error.to_string().contains("ntp/calls/chunk-000/file-000.parquet"), "{error}");
    let (folder, _) = small_dataset();
    let info = folder.path().join("meta/info.json");
    let text = std::fs::read_to_string(&info).unwrap().replace("\"total_frames\": ", "\"total_frames\": 9");
    std::fs::write(&info, text).unwrap();
    let error = Tables::default().add_dataset(folder.path()).unwrap_err();
    assert!(error.to_string().contains("but the dataset counts 9"), "{error}");
}

/// The statements of the page of examples.
fn examples() -> Vec<String> {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("schemas/queries.md");
    let page = std::fs::read_to_string(page).unwrap();
    page.split("```sql\n").skip(1).map(|rest| rest.split("```").next().unwrap().to_owned()).collect()
}

fn ntp(arguments: &[&str], run: &Path) -> std::process::Output {
    let (command, rest) = arguments.split_first().unwrap();
    let mut ntp = assert_cmd::Command::new(env!("CARGO_BIN_EXE_ntp"));
    ntp.current_dir(env!("CARGO_MANIFEST_DIR")).arg(command);
    match *command {
        "query" => ntp.arg(run).args(rest),
        _ => ntp.args(rest).arg("--out").arg(run),
    };
    ntp.output().unwrap()
}

#[test]
fn every_example_of_the_page_is_answered_with_rows() {
    let run = crate::smoke::whole();
    let examples = examples();
    assert!(examples.len() >= 7);
    for sql in &examples {
        let output = ntp(&["query", sql, "--json"], run);
        let complaint = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{sql}\n{complaint}");
        let rows: Vec<Value> = serde_json::from_slice(&output.stdout).unwrap();
        assert!(!rows.is_empty() || sql.contains("first_divergence IS NOT NULL"), "{sql}");
    }
    let count = ntp(&["query", "SELECT COUNT(*) AS n, COUNT(DISTINCT model) AS models FROM metrics", "--csv"], run);
    assert!(String::from_utf8(count.stdout).unwrap().starts_with("n,models\n"));
    let listed = String::from_utf8(ntp(&["query"], run).stdout).unwrap();
    let tables: Vec<&str> = listed.lines().filter(|line| !line.starts_with(' ')).collect();
    assert_eq!(tables, ["calls", "episodes", "frames", "metrics", "rollouts", "scopes", "subtasks", "tasks"]);
    let refused = ntp(&["query", "SELECT nothing FROM frames"], run);
    assert_eq!(refused.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("nothing"));
}

const WORDS: [&str; 24] = [
    "SELECT", "*", "FROM", "calls", "frames", "WHERE", "(", ")", ",", "program", "'pick'", "=", "GROUP BY", "COUNT(*)",
    "ORDER BY", "depth", "LIMIT", "0", "-1", "JOIN", "ON", "AS", "x", "\"",
];

#[test]
fn no_statement_panics() {
    let (_folder, tables) = small_dataset();
    proptest!(ProptestConfig::with_cases(128), |(words in proptest::collection::vec(0..WORDS.len(), 0..14))| {
        let sql = words.into_iter().map(|word| WORDS[word]).collect::<Vec<_>>().join(" ");
        if let Ok(answer) = query(&tables, &sql) {
            assert!(answer.to_text().contains("row"));
        }
    });
}
