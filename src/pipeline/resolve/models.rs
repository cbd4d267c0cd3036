//! Which models a pipeline file may name.

use std::path::Path;

use crate::model::{Decoder, MOST_CAMERAS};
use crate::pipeline::layout::model_name;
use crate::pipeline::resolve::{Pipeline, check_name};
use crate::pipeline::{ModelSpec, PipelineError};
use crate::render::CameraConfig;
use crate::words::counted;

impl Pipeline {
    pub(super) fn check_models(&self) -> Result<(), PipelineError> {
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
                let name = model_name(model, seed);
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
            other
                .seeds
                .iter()
                .any(|&seed| start_from.to_str() == Some(format!("models/{}", model_name(other, seed)).as_str()))
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
}

/// How a model decodes.
pub(in crate::pipeline) fn check_decoders(path: &Path, idx: usize, model: &ModelSpec) -> Result<(), PipelineError> {
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
