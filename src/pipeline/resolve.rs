//! From a pipeline file to checked settings: nothing is written before everything is known to fit.

use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;

use crate::artifact;
use crate::model::{Decoder, MOST_CAMERAS};
use crate::perception::PerceptionConfig;
use crate::pipeline::trials::DEFAULT_COUNTS;
use crate::pipeline::{CountsSpec, ModelSpec, OrderSpec, PipelineError, PipelineSpec, SuiteSpec};
use crate::render::CameraConfig;
use crate::task::{Family, Layout, Split};
use crate::words::counted;

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

    fn check_counts(&self, key: &str, counts: Option<CountsSpec>, layout: Layout) -> Result<(), PipelineError> {
        let Some(CountsSpec { min, max }) = counts else { return Ok(()) };
        let family = self.spec.tasks.family;
        let Some(most) = family.max_instances(layout) else {
            return Err(self.value(key, format!("{} has no categories; leave it out", family.name())));
        };
        if min < 1 || max > most || min > max {
            let problem = format!(
                "is {min} to {max}; allowed is 1 <= min <= max <= {most}, as many as {} holds of one category",
                place(layout)
            );
            return Err(self.value(key, problem));
        }
        Ok(())
    }

    /// Where a suite does not say how many things there are, it has as many as `generate` demonstrates.
    fn check_room(&self, key: &str, generated: Option<CountsSpec>, layout: Layout) -> Result<(), PipelineError> {
        let most = self.spec.tasks.family.max_instances(layout);
        match (generated, most) {
            (Some(CountsSpec { max, .. }), Some(most)) if max > most => {
                let problem = format!(
                    "is left out, so that up to {max} of one category are there, as in generate.counts; {} holds {most}",
                    place(layout)
                );
                Err(self.value(key, problem))
            }
            _ => Ok(()),
        }
    }

    /// How many things are demonstrated, and how many lie where the robot acts: as many as are demonstrated where nothing
    /// else is said.
    fn check_suite_counts(&self, key: &impl Fn(&str) -> String, suite: &SuiteSpec) -> Result<(), PipelineError> {
        let generate = &self.spec.generate;
        self.check_counts(&key("demonstrated"), suite.demonstrated, generate.simulation.layout())?;
        let acted = suite.simulation(&generate.simulation).layout();
        match (suite.on_table, suite.demonstrated) {
            (Some(on_table), _) => self.check_counts(&key("on_table"), Some(on_table), acted),
            (None, Some(demonstrated)) => self.check_counts(&key("demonstrated"), Some(demonstrated), acted),
            (None, None) => self.check_room(&key("on_table"), generate.counts, acted),
        }
    }

    fn check_models(&self) -> Result<(), PipelineError> {
        let mut names = Vec::new();
        for (idx, model) in self.spec.models.iter().enumerate() {
            if let Some(tag) = &model.tag {
                check_name(&self.path, &format!("models[{idx}].tag"), tag)?;
            }
            if model.seeds.is_empty() {
                return Err(self.value(&format!("models[{idx}].seeds"), "is empty; at least one is needed"));
            }
            if let Some(train_tasks) = model.train_tasks.filter(|&n| n == 0 || n > self.spec.tasks.train) {
                let problem = format!("is {train_tasks}; allowed is 1 to tasks.train = {}", self.spec.tasks.train);
                return Err(self.value(&format!("models[{idx}].train_tasks"), problem));
            }
            for &seed in &model.seeds {
                let name = super::layout::model_name(model, seed);
                if names.contains(&name) {
                    return Err(self.value(&format!("models[{idx}]"), format!("{name} is there twice")));
                }
                names.push(name);
            }
            if let Err(problem) = model.training(model.seeds[0]).check() {
                return Err(self.value(&format!("models[{idx}].training"), problem.to_string()));
            }
            self.check_seeing(idx, model)?;
            self.check_start(idx, model)?;
            self.check_acting(idx, model)?;
        }
        Ok(())
    }

    /// What a model looks with.
    fn check_seeing(&self, idx: usize, model: &ModelSpec) -> Result<(), PipelineError> {
        let refuse = |field: &str, problem: String| Err(self.value(&format!("models[{idx}].{field}"), problem));
        let there = &self.spec.generate.cameras;
        let names = || there.iter().map(|camera| camera.name.as_str()).collect::<Vec<_>>().join(", ");
        if !model.variant.sees() {
            let problem = || format!("{} reads positions and looks with no camera; leave it out", model.variant);
            return if model.cameras.is_none() { Ok(()) } else { refuse("cameras", problem()) };
        }
        if there.is_empty() {
            let problem = "it sees with cameras, and there are none in generate.cameras";
            return refuse("variant", format!("is {}; {problem}", model.variant));
        }
        let asked = model.cameras.as_deref().unwrap_or_default();
        if model.cameras.is_some() && asked.is_empty() {
            return refuse("cameras", format!("is empty; there are {}", names()));
        }
        if let Some(twice) = first_repeated(asked) {
            return refuse("cameras", format!("{twice:?} is there twice"));
        }
        if let Some(unknown) = asked.iter().find(|name| there.iter().all(|camera| camera.name != **name)) {
            return refuse("cameras", format!("{unknown:?} is no camera of generate.cameras; there are {}", names()));
        }
        let (most, whose) = if model.variant.detects() { (1, "a detector") } else { (MOST_CAMERAS, "a model") };
        if asked.len() > most {
            let problem = format!("names {}; {whose} looks with {most} at most", counted(asked.len(), "camera"));
            return refuse("cameras", problem);
        }
        let looks_with = model.looks_with(&self.spec.generate);
        let [width, height] = looks_with[0].size_px;
        match looks_with.iter().find(|camera| camera.size_px != [width; 2]) {
            None => Ok(()),
            Some(_) if width != height => {
                let problem = format!("{} has {width} x {height} pixels", looks_with[0].name);
                refuse("cameras", format!("{problem}; allowed are pictures as wide as high"))
            }
            Some(CameraConfig { name, size_px: [across, down], .. }) => {
                let first = format!("{} has {width} x {height} pixels", looks_with[0].name);
                refuse("cameras", format!("{name} has {across} x {down} pixels, and {first}; allowed is one size"))
            }
        }
    }

    /// Weights of another model of this file fit a network of the same variant that looks with the same cameras.
    fn check_start(&self, idx: usize, model: &ModelSpec) -> Result<(), PipelineError> {
        let Some(start_from) = &model.training.start_from else { return Ok(()) };
        let is_it = |other: &&ModelSpec| {
            other.seeds.iter().any(|&seed| {
                start_from.to_str() == Some(format!("models/{}", super::layout::model_name(other, seed)).as_str())
            })
        };
        let Some(other) = self.spec.models.iter().find(is_it) else { return Ok(()) };
        let cameras = |model: &ModelSpec| model.camera_names(&self.spec.generate).join(", ");
        let key = format!("models[{idx}].training.start_from");
        if other.variant != model.variant {
            let problem =
                format!("is {}, of variant {}; allowed is {}", start_from.display(), other.variant, model.variant);
            return Err(self.value(&key, problem));
        }
        if cameras(other) != cameras(model) {
            let (found, allowed) = (cameras(other), cameras(model));
            let problem = format!("is {}, which looks with {found}; allowed is {allowed}", start_from.display());
            return Err(self.value(&key, problem));
        }
        Ok(())
    }

    /// How a model acts, and what.
    fn check_acting(&self, idx: usize, model: &ModelSpec) -> Result<(), PipelineError> {
        let key = |field: &str| format!("models[{idx}].{field}");
        if !model.experiments.is_empty() {
            let problem = "is of a study's own models; a model of one experiment learns from that one";
            return Err(self.value(&key("experiments"), problem));
        }
        check_decoders(&self.path, idx, model)?;
        let Some(suites) = &model.suites else { return Ok(()) };
        if let Some(twice) = first_repeated(suites) {
            return Err(self.value(&key("suites"), format!("{twice:?} is there twice")));
        }
        let known: Vec<&str> = self.spec.rollout.suites.iter().map(|suite| suite.name.as_str()).collect();
        match suites.iter().find(|name| !known.contains(&name.as_str())) {
            Some(name) => {
                let problem = format!("{name:?} is no suite of this file; there are {}", known.join(", "));
                Err(self.value(&key("suites"), problem))
            }
            None => Ok(()),
        }
    }

    fn check_suite(&self, idx: usize, suite: &SuiteSpec) -> Result<(), PipelineError> {
        let key = |field: &str| format!("rollout.suites[{idx}].{field}");
        check_name(&self.path, &key("name"), &suite.name)?;
        let earlier = &self.spec.rollout.suites[..idx];
        if earlier.iter().any(|other| other.name == suite.name) {
            return Err(self.value(&key("name"), format!("{:?} is there twice", suite.name)));
        }
        if suite.episodes == 0 {
            return Err(self.value(&key("episodes"), "is 0; at least 1 is needed"));
        }
        if suite.split == Split::Unseen && self.spec.tasks.import.is_none() && self.n_unseen() == 0 {
            return Err(self.value(&key("split"), "is unseen, but tasks.unseen is 0"));
        }
        if let Err(problem) = suite.simulation(&self.spec.generate.simulation).check() {
            let field = if suite.jaw_m.is_some() && problem.is_of("jaw_m") { "jaw_m" } else { "layout" };
            return Err(self.value(&key(field), problem.to_string()));
        }
        if let Some(Err(problem)) = suite.perception.as_ref().map(PerceptionConfig::check) {
            return Err(self.value(&key("perception"), problem.to_string()));
        }
        if let Err(problem) = suite.noise.check() {
            return Err(self.value(&key("noise"), problem.to_string()));
        }
        let sees = |model: &&ModelSpec| model.variant.sees() && model.acts(&suite.name);
        let of_positions = [("noise", !suite.noise.is_none()), ("perception", suite.perception.is_some())];
        let asked = of_positions.into_iter().find(|&(_, is_asked)| is_asked);
        if let Some((model, (field, _))) = self.spec.models.iter().find(sees).zip(asked) {
            let problem = format!(
                "is of positions, but {} sees and acts it; allowed are models that read positions",
                model.variant
            );
            return Err(self.value(&key(field), problem));
        }
        self.check_towers(&key, suite)?;
        self.check_suite_counts(&key, suite)?;
        self.check_bowls(&key("bowls"), suite.bowls)
    }

    fn check_bowls(&self, key: &str, bowls: Option<u16>) -> Result<(), PipelineError> {
        let Some(bowls) = bowls else { return Ok(()) };
        let family = self.spec.tasks.family;
        match family.max_bowls() {
            None => Err(self.value(key, format!("{} has no bowls; leave it out", family.name()))),
            Some(most) if !(1..=most).contains(&bowls) => {
                Err(self.value(key, format!("is {bowls}; allowed is 1 to {most}, as many as there are")))
            }
            Some(_) => Ok(()),
        }
    }

    /// What is said of towers is said of a family that builds some.
    fn check_towers(&self, key: &impl Fn(&str) -> String, suite: &SuiteSpec) -> Result<(), PipelineError> {
        if let Some(Err(problem)) = suite.adversary.map(|adversary| adversary.check()) {
            return Err(self.value(&key("adversary"), problem.to_string()));
        }
        let family = self.spec.tasks.family;
        let said = [
            ("adversary", suite.adversary.is_some()),
            ("order", suite.order != OrderSpec::Own),
            ("tallest", suite.tallest.is_some()),
        ];
        match said.into_iter().find(|&(_, is_said)| is_said && !family.builds_towers()) {
            Some((field, _)) => {
                let builders = Family::ALL.into_iter().filter(|family| family.builds_towers()).map(Family::name);
                let allowed = builders.collect::<Vec<_>>().join(", ");
                let problem = format!("{} builds no towers; allowed for {allowed}", family.name());
                Err(self.value(&key(field), problem))
            }
            None => Ok(()),
        }
    }
}

/// Where things lie, in words.
fn place(layout: Layout) -> &'static str {
    match layout {
        Layout::Table => "the table",
        Layout::Bench => "an arm's bench",
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

/// How a model decodes.
pub(super) fn check_decoders(path: &Path, idx: usize, model: &ModelSpec) -> Result<(), PipelineError> {
    let problem = match first_repeated(&model.decoders) {
        _ if model.decoders.is_empty() => format!("is empty; allowed are {}", decoder_names()),
        Some(twice) => format!("{} is there twice", twice.name()),
        None => return Ok(()),
    };
    Err(PipelineError::Value { path: path.to_owned(), key: format!("models[{idx}].decoders"), problem })
}

fn first_repeated<T: PartialEq>(items: &[T]) -> Option<&T> {
    items.iter().enumerate().find_map(|(idx, item)| items[..idx].contains(item).then_some(item))
}

fn decoder_names() -> String {
    Decoder::ALL.map(Decoder::name).join(", ")
}

impl SuiteSpec {
    /// The counts of the demonstration.
    pub(super) fn demonstrated(&self) -> CountsSpec {
        self.demonstrated.unwrap_or(DEFAULT_COUNTS)
    }
}
