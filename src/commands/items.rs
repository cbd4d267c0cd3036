//! `ntp items PIPELINE`: the work that processes can share.

use std::path::Path;

use serde_json::{Value, json};

use crate::cli::ItemsArgs;
use crate::commands::stages::run_directory;
use crate::commands::{CommandOutcome, UsageError, output};
use crate::pipeline::{self, Item, ItemRanges, ItemState, PipelineFile, RunDir, Stage};
use crate::store::StoreAddress;
use crate::words::counted;

pub(super) fn run(args: &ItemsArgs) -> anyhow::Result<CommandOutcome> {
    let file = PipelineFile::load(&args.pipeline)?;
    let is_study = matches!(file, PipelineFile::Study(_));
    let copy = tempfile::tempdir()?;
    let run = match &args.store {
        None => RunDir::new(run_directory(args.out.as_deref(), &file)),
        Some(_) if is_study => return Err(UsageError("--store is of one experiment: give its own file".into()).into()),
        Some(store) => records(store, copy.path())?,
    };
    if is_study && args.array {
        return Err(
            UsageError("--array is of one experiment: give its own file, and --out DIR/EXPERIMENT".into()).into()
        );
    }
    let mut all: Vec<(Option<&str>, Item)> = Vec::new();
    for (pipeline, run) in file.experiments(&run) {
        for stage in Stage::ALL.into_iter().filter(|stage| args.stage.is_none_or(|asked| asked == *stage)) {
            let items = pipeline::items(pipeline, &run, stage)?.into_iter();
            let items = items.filter(|item| !args.left || item.state != ItemState::Done);
            all.extend(items.map(|item| (is_study.then_some(pipeline.spec.name.as_str()), item)));
        }
    }
    if args.store.is_none() {
        let stale = pipeline::stale(&file, &run, Stage::Report);
        stale.iter().for_each(|stale| output::note(&format!("of another plan: {stale}")));
    }
    if let PipelineFile::Study(study) = &file
        && !study.spec.models.is_empty()
    {
        let n = counted(study.spec.models.len(), "entry");
        output::note(&format!("without the study's own models ({n} of [[models]]), which ntp run alone makes"));
    }
    if args.array {
        let numbers: ItemRanges = all.iter().map(|(_, item)| item.item).collect();
        output::print(&numbers.to_string())?;
    } else if args.json {
        output::print_json(&all.iter().map(to_json).collect::<Result<Vec<Value>, _>>()?)?;
    } else {
        output::print(&all.iter().map(to_line).collect::<Vec<String>>().join("\n"))?;
    }
    Ok(CommandOutcome::Done)
}

/// What a store tells of a run, in a folder of its own.
fn records(store: &StoreAddress, copy: &Path) -> anyhow::Result<RunDir> {
    let run = RunDir::new(copy).with_files_elsewhere();
    pipeline::bring_records(store.open()?.as_ref(), &run)?;
    Ok(run)
}

fn to_json((experiment, item): &(Option<&str>, Item)) -> anyhow::Result<Value> {
    let mut value = json!(item);
    if let (Some(experiment), Some(fields)) = (experiment, value.as_object_mut()) {
        fields.insert("experiment".to_owned(), json!(experiment));
    }
    Ok(value)
}

/// `generate 3  generate shard 3 of 8  100 episodes  done`.
fn to_line((experiment, item): &(Option<&str>, Item)) -> String {
    let Item { item: number, stage, unit, shard, shards, amount, counted: _, of, state, failure } = item;
    let experiment = experiment.map(|name| format!("{name}: ")).unwrap_or_default();
    let state = match (state, failure) {
        (ItemState::Done, _) => "done".to_owned(),
        (ItemState::Left, _) | (ItemState::Failed, None) => "left".to_owned(),
        (ItemState::Failed, Some(failure)) => format!("failed: {}", failure.message),
    };
    format!("{experiment}{stage} {number}  {unit} shard {shard} of {shards}  {}  {state}", counted(*amount, of))
}
