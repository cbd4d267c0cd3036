//! Stage `convert`: recordings become a dataset, which appears whole or not at all.

use std::collections::BTreeMap;

use serde_json::json;

use crate::artifact::{FileEntry, IoError, PARTIAL_PREFIX, Plan, Receipt, StageDir};
use crate::dataset::{self, RecordingEpisodes};
use crate::pipeline::runner::{Context, Part, Unit};
use crate::pipeline::{PipelineError, Stage};
use crate::recording::{RecordingError, ShardReader};

pub(super) fn units(context: &Context<'_>) -> Result<Vec<Unit>, PipelineError> {
    let version = context.dir.recordings().version()?;
    let inputs = BTreeMap::from([(Stage::Generate.name().to_owned(), version)]);
    let plan = Plan::new(Stage::Convert.name(), 1, inputs, json!({ "convert": context.pipeline.spec.convert }));
    Ok(vec![Unit { name: "convert".to_owned(), dir: context.dir.dataset(), plan, part: Part::Whole }])
}

pub(super) fn work(context: &Context<'_>, unit: &Unit) -> Result<(), PipelineError> {
    let recordings = context.dir.recordings();
    let manifest = recordings.finished()?;
    recordings.check_files(&manifest, true)?;
    let partial = StageDir::new(Stage::Convert.name(), context.dir.root().join(format!("{PARTIAL_PREFIX}dataset")));
    partial.clear()?;
    let progress = context.progress(unit, manifest.episodes, "episodes");
    let read = |file: &FileEntry| -> Result<_, RecordingError> {
        let episodes = ShardReader::open(&recordings.path().join(&file.path))?;
        Ok(RecordingEpisodes {
            file: file.path.clone(),
            sha256: file.sha256.clone(),
            episodes: episodes.map(|episode| {
                progress.inc(1);
                context.go_on().map_err(Box::new)?;
                episode.map_err(PipelineError::from).map_err(Box::new)
            }),
        })
    };
    let files = manifest.files.iter().map(|file| read(file).map_err(PipelineError::from).map_err(Box::new));
    let summary = dataset::convert(files, &context.pipeline.spec.convert, partial.path());
    context.go_on()?;
    let summary = summary?;
    let entries: Result<Vec<FileEntry>, IoError> =
        summary.files.iter().map(|file| FileEntry::of(partial.path(), file)).collect();
    partial.write_plan(&unit.plan)?;
    partial.commit_shard(&Receipt {
        plan_id: unit.plan.id(),
        shard: 0,
        episodes: summary.episodes,
        failed: summary.failed_left_out + summary.failed_included,
        files: entries?,
    })?;
    partial.commit(&unit.plan, &[])?;
    unit.dir.clear()?;
    std::fs::rename(partial.path(), unit.dir.path()).map_err(IoError::system("rename to", unit.dir.path()))?;
    progress.finish(&format!("{} episodes, {} frames, {} calls", summary.episodes, summary.frames, summary.calls));
    Ok(())
}
