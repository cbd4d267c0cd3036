//! Stage `convert`: recordings become a dataset, which appears whole or not at all.

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::{Value, json};
use tempfile::TempDir;

use crate::artifact::{FileEntry, IoError, Manifest, PARTIAL_PREFIX, StageDir};
use crate::dataset::{
    self, ConvertConfig, ConvertError, ConvertSummary, FrameChoice, RecordedEpisode, RecordingEpisodes,
};
use crate::pipeline::unit::{Amount, Job, Made, Unit, Worker};
use crate::pipeline::{Pipeline, PipelineError, RunDir, Stage};
use crate::recording::{RecordingError, ShardReader};
use crate::words::counted;

/// Raised when the same settings make another dataset.
const VERSION: u32 = 1;

/// The dataset of an experiment.
pub(super) struct Dataset<'p>(&'p Pipeline);

pub(super) fn units(pipeline: &Pipeline) -> Vec<Dataset<'_>> {
    vec![Dataset(pipeline)]
}

impl Unit for Dataset<'_> {
    fn stage(&self) -> Stage {
        Stage::Convert
    }

    fn stage_version(&self) -> u32 {
        VERSION
    }

    fn name(&self) -> String {
        Stage::Convert.name().to_owned()
    }

    fn dir(&self, run: &RunDir) -> StageDir {
        run.dataset()
    }

    fn amount(&self, _shard: u32) -> Amount {
        let spec = &self.0.spec;
        Amount { count: u64::from(spec.tasks.train) * u64::from(spec.generate.trials_per_task), of: "episode" }
    }

    fn reads(&self, run: &RunDir) -> Vec<StageDir> {
        vec![run.recordings()]
    }

    fn inputs(&self, run: &RunDir) -> Result<BTreeMap<String, String>, PipelineError> {
        Ok(BTreeMap::from([(Stage::Generate.name().to_owned(), run.recordings().version()?)]))
    }

    fn settings(&self) -> Value {
        json!({ "convert": self.0.spec.convert })
    }

    fn appears_whole(&self) -> bool {
        true
    }

    fn open<'j>(&'j self, job: &'j Job<'_>) -> Result<Box<dyn Worker + 'j>, PipelineError> {
        let recordings = job.context.dir.recordings();
        let manifest = recordings.finished()?;
        Ok(Box::new(Converter { config: &self.0.spec.convert, job, recordings, manifest }))
    }
}

/// Converts recordings.
struct Converter<'j> {
    config: &'j ConvertConfig,
    job: &'j Job<'j>,
    recordings: StageDir,
    manifest: Manifest,
}

impl Worker for Converter<'_> {
    fn shard(&self, shard: u32) -> Result<Option<Made>, PipelineError> {
        let job = self.job;
        let staged = Staged::begin(job.context.dir)?;
        let ConvertSummary { episodes, frames, calls, failed_left_out, failed_included, files, .. } =
            self.convert(&staged.dir)?;
        let made = Made {
            episodes,
            failed: failed_left_out + failed_included,
            told: Some(
                [(episodes, "episode"), (frames, "frame"), (calls, "call")].map(|(n, of)| counted(n, of)).join(", "),
            ),
            ..Made::files(&staged.dir, files.iter().map(String::as_str))?
        };
        staged.dir.write_plan(&job.plan)?;
        staged.dir.commit_shard(&job.receipt_of(shard, &made))?;
        staged.dir.commit(&job.plan, &[])?;
        Ok(staged.take_place(job, shard)?.then_some(made))
    }
}

impl Converter<'_> {
    fn convert(&self, into: &StageDir) -> Result<ConvertSummary, PipelineError> {
        let Self { config, job, recordings, manifest } = self;
        let step = || {
            job.progress.inc(1);
            job.context.go_on()
        };
        let source = Source { recordings, files: &manifest.files, config };
        let boundaries = |reader: ShardReader| reader.boundaries().pictured();
        let summary = match config.frames {
            FrameChoice::Boundaries => source.convert(into.path(), boundaries, step),
            FrameChoice::All => source.convert(into.path(), ShardReader::pictured, step),
        };
        job.context.go_on()?;
        Ok(summary?)
    }
}

/// A dataset that is being made beside its place. Dropped, it leaves nothing.
struct Staged {
    dir: StageDir,
    _around: TempDir,
}

impl Staged {
    fn begin(run: &RunDir) -> Result<Self, IoError> {
        let prefix = format!("{PARTIAL_PREFIX}dataset-");
        let around = tempfile::Builder::new().prefix(&prefix).tempdir_in(run.root());
        let around = around.map_err(IoError::system("create a folder in", run.root()))?;
        Ok(Self { dir: StageDir::new(Stage::Convert.name(), around.path().join("dataset")), _around: around })
    }

    /// Moves the dataset to its place, in place of another plan's; false when another process has made it meanwhile.
    fn take_place(&self, job: &Job<'_>, shard: u32) -> Result<bool, IoError> {
        let place = job.dir.path();
        let rename = || std::fs::rename(self.dir.path(), place);
        if !job.is_done(shard)? && rename().is_ok() {
            return Ok(true);
        }
        if job.is_done(shard)? {
            return Ok(false);
        }
        job.dir.clear()?;
        rename().map_err(IoError::system("rename to", place))?;
        Ok(true)
    }
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
