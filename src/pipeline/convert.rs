//! Stage `convert`: recordings become a dataset, which appears whole or not at all.

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::json;

use crate::artifact::{FileEntry, IoError, PARTIAL_PREFIX, Plan, Receipt, StageDir};
use crate::dataset::{
    self, ConvertConfig, ConvertError, ConvertSummary, FrameChoice, RecordedEpisode, RecordingEpisodes,
};
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
    let step = || {
        progress.inc(1);
        context.go_on()
    };
    let source = Source { recordings: &recordings, files: &manifest.files, config: &context.pipeline.spec.convert };
    let boundaries = |reader: ShardReader| reader.boundaries().pictured();
    let summary = match source.config.frames {
        FrameChoice::Boundaries => source.convert(partial.path(), boundaries, step),
        FrameChoice::All => source.convert(partial.path(), ShardReader::pictured, step),
    };
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

/// The recordings to be converted, and how.
struct Source<'a> {
    recordings: &'a StageDir,
    files: &'a [FileEntry],
    config: &'a ConvertConfig,
}

impl Source<'_> {
    /// Converts what `frames` takes of each recording; `step` is called before each episode and may end it.
    fn convert<I, T>(
        &self,
        directory: &Path,
        frames: impl Fn(ShardReader) -> I,
        step: impl Fn() -> Result<(), PipelineError>,
    ) -> Result<ConvertSummary, ConvertError>
    where
        I: Iterator<Item = Result<T, RecordingError>>,
        T: RecordedEpisode,
    {
        let step = &step;
        let read = |file: &FileEntry| -> Result<_, PipelineError> {
            let reader = ShardReader::open(&self.recordings.path().join(&file.path))?;
            let episodes = frames(reader).map(move |episode| {
                step()?;
                Ok(episode?)
            });
            let episodes = episodes.map(|episode: Result<T, PipelineError>| episode.map_err(Box::new));
            Ok(RecordingEpisodes { file: file.path.clone(), sha256: file.sha256.clone(), episodes })
        };
        dataset::convert(self.files.iter().map(|file| read(file).map_err(Box::new)), self.config, directory)
    }
}
