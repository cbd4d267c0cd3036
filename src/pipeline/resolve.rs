//! From a pipeline file to checked settings: nothing is written before everything is known to fit.

mod models;
mod suites;

use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;

use crate::artifact;
use crate::pipeline::{PipelineError, PipelineSpec};

pub(super) use models::check_decoders;

/// So many tasks are held out at most when the pipeline file says nothing.
const MAX_DEFAULT_UNSEEN: u32 = 1000;

/// A checked pipeline.
#[derive(Clone, Debug)]
pub struct Pipeline {
    /// The file it was read from.
    pub path: PathBuf,
    /// Its settings.
    pub spec: PipelineSpec,
}

impl Pipeline {
    /// Reads and checks a pipeline file.
    ///
    /// # Errors
    ///
    /// [`PipelineError::Syntax`] or [`PipelineError::Value`], which name file, key and what is allowed; an I/O error
    /// when the file is not there.
    pub fn load(path: &Path) -> Result<Self, PipelineError> {
        let pipeline = Self { path: path.to_owned(), spec: parse(path)? };
        pipeline.check()?;
        Ok(pipeline)
    }

    /// The imported task file, found beside the pipeline file.
    pub fn import_path(&self) -> Option<PathBuf> {
        let import = self.spec.tasks.import.as_ref()?;
        Some(self.path.parent().unwrap_or(Path::new("")).join(import))
    }

    /// Hash of the imported task file.
    ///
    /// # Errors
    ///
    /// When it cannot be read.
    pub fn import_hash(&self) -> Result<Option<String>, PipelineError> {
        Ok(self.import_path().map(|path| artifact::sha256_file(&path)).transpose()?)
    }

    /// How many tasks are held out when drawn.
    pub fn n_unseen(&self) -> u32 {
        let tasks = &self.spec.tasks;
        tasks.unseen.unwrap_or_else(|| tasks.pool().limits(tasks.train).1.min(MAX_DEFAULT_UNSEEN))
    }

    fn value(&self, key: &str, problem: impl Into<String>) -> PipelineError {
        PipelineError::Value { path: self.path.clone(), key: key.to_owned(), problem: problem.into() }
    }

    fn check(&self) -> Result<(), PipelineError> {
        check_name(&self.path, "name", &self.spec.name)?;
        self.check_tasks()?;
        self.check_generate()?;
        self.check_models()?;
        self.spec.rollout.suites.iter().enumerate().try_for_each(|(idx, suite)| self.check_suite(idx, suite))?;
        let factor = self.spec.rollout.decisions_factor;
        if !(1.0..=100.0).contains(&factor) {
            return Err(self.value("rollout.decisions_factor", format!("is {factor}; allowed is 1 to 100")));
        }
        Ok(())
    }

    fn check_tasks(&self) -> Result<(), PipelineError> {
        let tasks = &self.spec.tasks;
        if tasks.train == 0 {
            return Err(self.value("tasks.train", "is 0; at least 1 task is needed"));
        }
        if let Some(path) = self.import_path().filter(|path| !path.is_file()) {
            return Err(self.value("tasks.import", format!("no such file: {}", path.display())));
        }
        self.check_blocks()?;
        if tasks.import.is_some() {
            return Ok(());
        }
        let (train, unseen) = (tasks.train, self.n_unseen());
        let (train_limit, unseen_limit) = tasks.pool().limits(train);
        if let Some(all) = tasks.family.all_seen().filter(|_| train != train_limit) {
            let problem = format!("is {train}; {} has {train_limit} {all}", tasks.family.name());
            return Err(self.value("tasks.train", problem));
        }
        let blocks = tasks.pool().blocks.map_or_else(String::new, |blocks| format!(" with {blocks} blocks"));
        let name = format!("{}{blocks}", tasks.family.name());
        if train > train_limit {
            let problem = format!("is {train}; {name} has at most {train_limit} training tasks");
            return Err(self.value("tasks.train", problem));
        }
        if unseen > unseen_limit {
            return Err(self.value("tasks.unseen", format!("is {unseen}; {name} has at most {unseen_limit} others")));
        }
        Ok(())
    }

    fn check_blocks(&self) -> Result<(), PipelineError> {
        let tasks = &self.spec.tasks;
        let Some(blocks) = tasks.blocks else { return Ok(()) };
        let problem = match tasks.family.max_blocks() {
            None => format!("{} has no blocks to leave out; leave the key out", tasks.family.name()),
            Some(most) if !(2..=most).contains(&blocks) => format!("is {blocks}; allowed is 2 to {most}"),
            Some(_) if tasks.import.is_some() => {
                "an imported file says itself what its tasks need; leave it out".into()
            }
            Some(_) => return Ok(()),
        };
        Err(self.value("tasks.blocks", problem))
    }

    fn check_generate(&self) -> Result<(), PipelineError> {
        let generate = &self.spec.generate;
        if generate.trials_per_task == 0 {
            return Err(self.value("generate.trials_per_task", "is 0; at least 1 is needed"));
        }
        if generate.trials_per_task.checked_mul(self.spec.tasks.train).is_none() {
            let problem = format!("is {}; allowed are 4294967295 episodes in all", generate.trials_per_task);
            return Err(self.value("generate.trials_per_task", problem));
        }
        if generate.episodes_per_shard == 0 {
            return Err(self.value("generate.episodes_per_shard", "is 0; at least 1 is needed"));
        }
        if let Err(problem) = generate.simulation.check() {
            return Err(self.value("generate.simulation", problem.to_string()));
        }
        for (position, camera) in generate.cameras.iter().enumerate() {
            let key = format!("generate.cameras[{position}]");
            if let Err(problem) = camera.check() {
                return Err(self.value(&key, problem.to_string()));
            }
            if generate.cameras[..position].iter().any(|other| other.name == camera.name) {
                return Err(self.value(&key, format!("camera {} is named twice", camera.name)));
            }
        }
        self.check_counts("generate.counts", generate.counts, generate.simulation.layout())
    }
}

/// The text of a file that people write.
pub(super) fn read_text(path: &Path) -> Result<String, PipelineError> {
    let syntax = |message: String| PipelineError::Syntax { path: path.to_owned(), message };
    let bytes = std::fs::read(path).map_err(|error| syntax(format!("cannot be read: {error}")))?;
    String::from_utf8(bytes).map_err(|error| syntax(format!("is not UTF-8: {error}")))
}

/// Reads a TOML file as what it shall be.
pub(super) fn parse<T: DeserializeOwned>(path: &Path) -> Result<T, PipelineError> {
    let syntax = |error| PipelineError::Syntax { path: path.to_owned(), message: format!("\n{error}") };
    toml::from_str(&read_text(path)?).map_err(syntax)
}

/// Whether a name can be a folder's everywhere.
pub(super) fn check_name(path: &Path, key: &str, name: &str) -> Result<(), PipelineError> {
    let allowed = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if name.is_empty() || name.len() > 64 || !name.chars().all(allowed) {
        let problem = format!("is {name:?}; allowed are 1 to 64 letters, digits, '_' and '-'");
        return Err(PipelineError::Value { path: path.to_owned(), key: key.to_owned(), problem });
    }
    Ok(())
}
