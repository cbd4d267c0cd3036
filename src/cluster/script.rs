//! The scripts of a submission, in plain bash.

use serde::Serialize;

use crate::cluster::submission::{About, Chain, ClusterError, Engine, SubmitOptions};
use crate::pipeline::{PipelineFile, Stage};
use crate::words::shell_word;

/// Does a line of a list of items; the same for every engine.
pub(super) const TASK: &str = include_str!("task.sh");

const TEMPLATE: &str = include_str!("submit.sh.j2");

#[derive(Serialize)]
struct Context {
    slurm: bool,
    /// Tasks at a time; empty for as many as the scheduler likes.
    max_running: String,
    sbatch_args: Vec<String>,
    chains: Vec<ChainContext>,
    /// The study's own pipeline file, quoted; empty for an experiment by itself.
    study: String,
    /// Where the run is, quoted; empty for the run directory.
    store: String,
}

/// What is left of an experiment. Words are quoted for bash.
#[derive(Serialize)]
struct ChainContext {
    folder: String,
    pipeline: String,
    tasks: usize,
    generate: usize,
    convert: usize,
    train: usize,
    rollout: usize,
    report: usize,
}

/// The script that hands over what is left.
pub(super) fn submit(
    file: &PipelineFile,
    about: &About,
    chains: &[Chain],
    options: &SubmitOptions,
) -> Result<String, ClusterError> {
    let place = |pipeline: &std::path::Path| shell_word(&format!("submit/pipeline/{}", pipeline.display()));
    let chain = |chain: &Chain| {
        let left = |stage| chain.stages.iter().find(|own| own.stage == stage).map_or(0, |own| own.items);
        ChainContext {
            folder: shell_word(&chain.folder),
            pipeline: place(&chain.pipeline),
            tasks: left(Stage::Tasks),
            generate: left(Stage::Generate),
            convert: left(Stage::Convert),
            train: left(Stage::Train),
            rollout: left(Stage::Rollout),
            report: left(Stage::Report),
        }
    };
    let context = Context {
        slurm: options.engine == Engine::Slurm,
        max_running: options.max_running.map(|most| most.to_string()).unwrap_or_default(),
        sbatch_args: options.sbatch_args.iter().map(|argument| shell_word(argument)).collect(),
        chains: chains.iter().map(chain).collect(),
        store: about.store.as_deref().map(shell_word).unwrap_or_default(),
        study: match file {
            PipelineFile::Experiment(_) => String::new(),
            PipelineFile::Study(_) => place(&about.pipeline),
        },
    };
    let mut templates = minijinja::Environment::new();
    templates.set_trim_blocks(true);
    templates.set_lstrip_blocks(true);
    templates.set_keep_trailing_newline(true);
    Ok(templates.render_named_str("submit.sh", TEMPLATE, context)?)
}
