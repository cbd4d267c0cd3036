//! `ntp query PATH ["SELECT …"]`: SQL over the tables of a dataset, a run, rollouts or a model.

use std::path::Path;

use crate::cli::QueryArgs;
use crate::commands::kind::{self, Kind};
use crate::commands::{CommandOutcome, output};
use crate::query::{TableInfo, Tables, query};
use crate::words::counted;

pub(super) fn run(args: &QueryArgs) -> anyhow::Result<CommandOutcome> {
    let tables = tables(&args.path)?;
    let Some(sql) = &args.sql else {
        describe(&tables.describe()?, args.json)?;
        return Ok(CommandOutcome::Done);
    };
    if let Some(path) = &args.parquet {
        output::refuse_replacing(&args.path, "--parquet", path)?;
    }
    let answer = query(&tables, sql)?;
    if let Some(path) = &args.parquet {
        answer.write_parquet(path)?;
        output::note(&format!("{} in {}", counted(answer.n_rows(), "row"), path.display()));
    } else if args.json {
        output::print_json(&answer.rows())?;
    } else if args.csv {
        output::print(&answer.to_csv()?)?;
    } else {
        output::print(&answer.to_text())?;
    }
    Ok(CommandOutcome::Done)
}

/// The tables of whatever the path is.
fn tables(path: &Path) -> anyhow::Result<Tables> {
    let mut tables = Tables::default();
    let kind = Kind::of(path)?;
    if kind == Kind::Run {
        for part in kind::parts_of_run(path)? {
            add(&part, Kind::of(&part)?, &mut tables)?;
        }
    } else {
        add(path, kind, &mut tables)?;
    }
    if tables.names().is_empty() {
        anyhow::bail!("{} has no tables; a dataset, a run, rollouts and models have", path.display());
    }
    Ok(tables)
}

fn add(path: &Path, kind: Kind, tables: &mut Tables) -> anyhow::Result<()> {
    let there = |file: &str| Some(path.join(file)).filter(|path| path.exists());
    match kind {
        Kind::Dataset => tables.add_dataset(path)?,
        Kind::Rollouts => {
            tables.add_rollouts(&path.join("rollouts.parquet"));
            if let Some(path) = there("detections.parquet") {
                tables.add_detections(&path);
            }
        }
        Kind::Model => {
            let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
            if let Some(path) = there("metrics.parquet") {
                tables.add_metrics(&path, &name);
            }
            if let Some(path) = there("detector_metrics.parquet") {
                tables.add_detector_metrics(&path, &name);
            }
        }
        _ => {}
    }
    Ok(())
}

fn describe(tables: &[TableInfo], as_json: bool) -> anyhow::Result<()> {
    if as_json {
        return output::print_json(&tables);
    }
    let mut lines = Vec::new();
    for TableInfo { table, columns, .. } in tables {
        lines.push((*table).to_owned());
        lines.extend(columns.iter().map(|(name, kind)| format!("  {name:<40}  {kind}")));
    }
    output::print(&lines.join("\n"))
}
