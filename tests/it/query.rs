//! SQL over the tables: counts agree with the writer's, examples are true, and nothing panics.

use std::fs::File;
use std::path::Path;
use std::sync::Arc;

use arrow::array::{
    Array as _, ArrayRef, Float32Array, Int8Array, Int16Array, Int32Array, ListArray, RecordBatch, UInt8Array,
    UInt16Array, UInt32Array,
};
use arrow::datatypes::{DataType, Field, Float32Type, Schema};
use ntp::dataset::ConvertConfig;
use ntp::query::{QueryError, Tables, query};
use parquet::arrow::ArrowWriter;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use proptest::prelude::{ProptestConfig, proptest};
use serde_json::{Value, json};

use crate::dataset::{convert_all, episodes};

/// A column of so many rows.
type Column = fn(usize) -> ArrayRef;

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

/// How many calls each pair of caller's and callee's programs has, by the episodes themselves.
fn pairs_of_programs() -> std::collections::BTreeMap<(&'static str, &'static str), usize> {
    let mut pairs = std::collections::BTreeMap::new();
    for episode in episodes() {
        let calls = &episode.calls;
        for call in calls.iter() {
            let Some(caller) = call.caller.and_then(|caller| calls.iter().find(|of| of.id == caller)) else { continue };
            *pairs.entry((caller.program.name(), call.program.name())).or_default() += 1;
        }
    }
    pairs
}

#[test]
fn columns_of_one_name_get_names_of_their_own_in_the_order_asked_for() {
    let (_folder, tables) = small_dataset();
    let lengths = || episodes().into_iter().map(|episode| episode.boundary_frames().count());
    let answer = query(&tables, "SELECT MIN(n_frames), MAX(n_frames) FROM episodes").unwrap();
    let expected = format!("MIN(n_frames),MAX(n_frames)\n{},{}\n", lengths().min().unwrap(), lengths().max().unwrap());
    assert_eq!(answer.to_csv().unwrap(), expected);
    let answer = query(&tables, "SELECT program, call_id, depth FROM calls WHERE episode_index = 0 LIMIT 1").unwrap();
    let json = serde_json::to_string(&answer.rows()).unwrap();
    assert_eq!(json, r#"[{"program":"block_stacking","call_id":0,"depth":0}]"#);
}

#[test]
fn groups_are_ordered_by_what_is_counted_in_them() {
    let (_folder, tables) = small_dataset();
    let mut counts = std::collections::BTreeMap::<&str, usize>::new();
    for episode in episodes() {
        episode.calls.iter().for_each(|call| *counts.entry(call.program.name()).or_default() += 1);
    }
    let mut expected: Vec<(&str, usize)> = counts.into_iter().collect();
    expected.sort_by_key(|&(program, count)| (std::cmp::Reverse(count), program));
    let sql = "SELECT program, COUNT(*) FROM calls GROUP BY program ORDER BY COUNT(*) DESC, program";
    let found = rows(&tables, sql);
    let expected_rows: Vec<Value> =
        expected.iter().map(|(program, count)| json!({ "program": program, "COUNT(*)": count })).collect();
    assert_eq!(found, expected_rows);
    let sql = "SELECT program FROM calls GROUP BY program ORDER BY COUNT(*) DESC, program LIMIT 2";
    let expected: Vec<Value> = expected.iter().take(2).map(|(program, _)| json!({ "program": program })).collect();
    assert_eq!(rows(&tables, sql), expected);
}

#[test]
fn a_join_of_a_table_with_itself_is_grouped_by_columns_of_both_sides() {
    let (_folder, tables) = small_dataset();
    let pairs: Vec<Value> = pairs_of_programs()
        .into_iter()
        .map(|((caller, callee), n)| json!({ "p": caller, "q": callee, "n": n }))
        .collect();
    let join = "FROM calls a JOIN calls b ON a.episode_index = b.episode_index AND a.call_id = b.caller_id";
    let aliased = format!(
        "SELECT a.program AS p, b.program AS q, COUNT(*) AS n {join} GROUP BY a.program, b.program ORDER BY p, q"
    );
    assert_eq!(rows(&tables, &aliased), pairs);
    let plain = format!(
        "SELECT a.program, b.program, COUNT(*) {join} GROUP BY a.program, b.program ORDER BY a.program, b.program"
    );
    let answer = query(&tables, &plain).unwrap();
    assert_eq!(answer.n_rows(), pairs.len());
    assert_eq!(answer.to_csv().unwrap().lines().next(), Some("program,b.program,COUNT(*)"));
    for ((caller, callee), row) in pairs_of_programs().into_keys().zip(answer.to_json()) {
        assert_eq!((&row["program"], &row["b.program"]), (&json!(caller), &json!(callee)));
    }
}

#[test]
fn elements_of_lists_are_counted_from_one() {
    let (_folder, tables) = small_dataset();
    let whole = rows(&tables, "SELECT action FROM frames WHERE \"index\" = 1");
    for (position, sql) in [(0, "\"action\"[1]"), (3, "action[4]"), (2, "ARRAY_GET(action, 3)")] {
        let found = query(&tables, &format!("SELECT {sql} AS x FROM frames WHERE \"index\" = 1")).unwrap();
        assert_eq!(found.to_json()[0]["x"], whole[0]["action"][position], "{sql}");
    }
    let named = query(&tables, "SELECT \"action\"[1] FROM frames LIMIT 1").unwrap();
    assert_eq!(named.to_csv().unwrap().lines().next(), Some("action[1]"));
    assert_eq!(rows(&tables, "SELECT action[5] AS x FROM frames LIMIT 1"), [json!({ "x": null })]);
}

#[test]
fn a_table_is_described_by_its_columns() {
    let (_folder, tables) = small_dataset();
    for sql in ["DESCRIBE tasks", "DESC tasks", "SHOW COLUMNS FROM tasks"] {
        let found = rows(&tables, sql);
        assert!(found.contains(&json!({ "column": "task_index", "type": "i64" })), "{sql}: {found:?}");
        assert_eq!(found.len(), 2, "{sql}");
    }
    let error = query(&tables, "DESCRIBE rollouts").err().unwrap().to_string();
    assert_eq!(error, "no table \"rollouts\"; tables are calls, episodes, frames, scopes, subtasks, tasks");
    assert_eq!(rows(&tables, "SHOW TABLES")[0], json!({ "table": "calls" }));
}

#[test]
fn what_is_not_answered_is_refused_with_what_to_write_instead() {
    let (_folder, tables) = small_dataset();
    let refused = |sql: &str| query(&tables, sql).err().unwrap_or_else(|| panic!("{sql} is answered")).to_string();
    let exists = "SELECT COUNT(*) AS n FROM episodes e WHERE EXISTS (SELECT 1 FROM calls c WHERE c.episode_index = e.episode_index)";
    assert!(refused(exists).starts_with("EXISTS is not answered; write x IN (SELECT y"), "{}", refused(exists));
    let instead = "SELECT COUNT(*) AS n FROM episodes WHERE episode_index IN (SELECT episode_index FROM calls)";
    assert_eq!(rows(&tables, instead), [json!({ "n": episodes().len() })]);
    for sql in [
        "DROP TABLE calls",
        "DELETE FROM calls",
        "TRUNCATE TABLE calls",
        "CREATE TABLE x AS SELECT * FROM calls",
        "INSERT INTO calls VALUES (1)",
        "UPDATE calls SET depth = 0",
        "SELECT * INTO x FROM calls",
    ] {
        assert!(refused(sql).contains("tables are only read"), "{sql}: {}", refused(sql));
    }
    for sql in ["SELECT * FROM read_csv('/etc/passwd')", "SELECT 1 AS x FROM calls JOIN read_parquet('x') p ON true"] {
        assert!(refused(sql).contains("in place of a table is not answered"), "{sql}: {}", refused(sql));
    }
    for sql in [
        "SELECT program, COUNT(*) FROM calls",
        "SELECT MAX(depth), depth + 1 FROM calls",
        "SELECT *, COUNT(*) FROM calls",
    ] {
        assert!(refused(sql).contains("beside an aggregate"), "{sql}: {}", refused(sql));
    }
    assert_eq!(
        rows(&tables, "SELECT 1 + COUNT(*) AS n, 'x' AS x FROM episodes"),
        [json!({ "n": episodes().len() + 1, "x": "x" })]
    );
    assert!(refused("SELECT 1; SELECT 2").starts_with("more than one statement"));
    assert!(refused("").starts_with("an empty statement"));
}

#[test]
fn a_column_of_a_type_that_is_not_read_is_named_and_other_tables_are_answered() {
    let (folder, _) = small_dataset();
    let path = folder.path().join("data/chunk-000/file-000.parquet");
    let reader = ParquetRecordBatchReaderBuilder::try_new(File::open(&path).unwrap()).unwrap().build().unwrap();
    let batches: Vec<RecordBatch> = reader.map(Result::unwrap).collect();
    let with = |name: &str, column: Column| {
        let widened = |batch: &RecordBatch| {
            let added = (name.to_owned(), column(batch.num_rows()));
            let own = batch.schema().fields().iter().map(|field| field.name().clone()).collect::<Vec<_>>();
            RecordBatch::try_from_iter(own.into_iter().zip(batch.columns().to_vec()).chain([added])).unwrap()
        };
        let widened: Vec<RecordBatch> = batches.iter().map(widened).collect();
        let mut writer = ArrowWriter::try_new(File::create(&path).unwrap(), widened[0].schema(), None).unwrap();
        widened.iter().for_each(|batch| writer.write(batch).unwrap());
        writer.close().unwrap();
        let mut tables = Tables::default();
        tables.add_dataset(folder.path()).unwrap();
        tables
    };
    let n_frames = batches.iter().map(RecordBatch::num_rows).sum::<usize>();
    let unread: [(&str, Column); 3] = [
        ("float16", |n| arrow::compute::cast(&Float32Array::from(vec![1.0; n]), &DataType::Float16).unwrap()),
        ("uint8", |n| Arc::new(UInt8Array::from(vec![1; n]))),
        ("uint16", |n| Arc::new(UInt16Array::from(vec![1; n]))),
    ];
    for (kind, column) in unread {
        let tables = with("extra", column);
        assert_eq!(rows(&tables, "SELECT COUNT(*) AS n FROM episodes"), [json!({ "n": episodes().len() })]);
        let error = query(&tables, "SELECT COUNT(*) AS n FROM frames").err().unwrap().to_string();
        assert!(error.starts_with(&format!("column \"extra\" is {kind}, which queries do not read")), "{error}");
        let described = rows(&tables, "DESCRIBE frames");
        assert!(described.contains(&json!({ "column": "extra", "type": kind })), "{described:?}");
        assert_eq!(tables.describe().unwrap().len(), 6);
    }
    let read: [Column; 4] = [
        |n| Arc::new(Int8Array::from(vec![1; n])),
        |n| Arc::new(Int16Array::from(vec![1; n])),
        |n| Arc::new(Int32Array::from(vec![1; n])),
        |n| Arc::new(UInt32Array::from(vec![1; n])),
    ];
    for column in read {
        let tables = with("extra", column);
        let sql = "SELECT SUM(extra) AS s, MAX(extra + 1) AS m FROM frames WHERE extra > 0";
        assert_eq!(rows(&tables, sql), [json!({ "s": n_frames, "m": 2 })]);
        assert_eq!(rows(&tables, "SELECT extra, COUNT(*) AS n FROM frames GROUP BY extra").len(), 1);
    }
}

/// The statements of the page of examples.
/// LeRobot declares arrays of several dimensions so.
#[test]
fn a_column_with_an_extension_type_of_arrow_is_read_as_the_lists_that_it_is() {
    let (folder, _) = small_dataset();
    let path = folder.path().join("data/chunk-000/file-000.parquet");
    let reader = ParquetRecordBatchReaderBuilder::try_new(File::open(&path).unwrap()).unwrap().build().unwrap();
    let batches: Vec<RecordBatch> = reader.map(Result::unwrap).collect();
    let told = [("ARROW:extension:name", "datasets.features.features.Array2DExtensionType")];
    let told = told.map(|(key, value)| (key.to_owned(), value.to_owned()));
    let extended: Vec<RecordBatch> = (batches.iter())
        .map(|batch| {
            let lists = (0..batch.num_rows()).map(|row| Some(vec![Some(row as f32), Some(0.5)]));
            let lists: ArrayRef = Arc::new(ListArray::from_iter_primitive::<Float32Type, _, _>(lists));
            let field = Field::new("grid", lists.data_type().clone(), true).with_metadata(told.clone().into());
            let fields = batch.schema().fields().iter().cloned().chain([Arc::new(field)]).collect::<Vec<_>>();
            let columns = batch.columns().iter().cloned().chain([lists]).collect();
            RecordBatch::try_new(Arc::new(Schema::new(fields)), columns).unwrap()
        })
        .collect();
    let mut writer = ArrowWriter::try_new(File::create(&path).unwrap(), extended[0].schema(), None).unwrap();
    extended.iter().for_each(|batch| writer.write(batch).unwrap());
    writer.close().unwrap();
    let mut tables = Tables::default();
    tables.add_dataset(folder.path()).unwrap();
    let n_frames = batches.iter().map(RecordBatch::num_rows).sum::<usize>();
    let found = rows(&tables, "SELECT COUNT(*) AS n, SUM(grid[2]) AS s FROM frames");
    assert_eq!(found, [json!({ "n": n_frames, "s": n_frames as f64 / 2.0 })]);
}

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

const WORDS: [&str; 32] = [
    "SELECT",
    "*",
    "FROM",
    "calls",
    "frames",
    "WHERE",
    "(",
    ")",
    ",",
    "program",
    "'pick'",
    "=",
    "GROUP BY",
    "COUNT(*)",
    "ORDER BY",
    "depth",
    "LIMIT",
    "0",
    "-1",
    "JOIN",
    "ON",
    "AS",
    "x",
    "\"",
    "x.program",
    "[1]",
    "DESCRIBE",
    "EXISTS",
    "SUM(depth)",
    "HAVING",
    "UNION",
    ";",
];

#[test]
fn no_statement_panics() {
    let (_folder, tables) = small_dataset();
    proptest!(ProptestConfig::with_cases(128), |(words in proptest::collection::vec(0..WORDS.len(), 0..14))| {
        let sql = words.into_iter().map(|word| WORDS[word]).collect::<Vec<_>>().join(" ");
        if let Ok(answer) = query(&tables, &sql) {
            assert!(answer.to_text().contains("row"), "{sql}");
        }
    });
}
