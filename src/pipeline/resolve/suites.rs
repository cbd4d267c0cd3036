//! Which suites a pipeline file may name, and how many things they may have.

use crate::perception::PerceptionConfig;
use crate::pipeline::resolve::{Pipeline, check_name};
use crate::pipeline::trials::DEFAULT_COUNTS;
use crate::pipeline::{CountsSpec, ModelSpec, OrderSpec, PipelineError, SuiteSpec};
use crate::task::{Family, Layout, Split};

impl Pipeline {
    pub(super) fn check_suite(&self, idx: usize, suite: &SuiteSpec) -> Result<(), PipelineError> {
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

    pub(super) fn check_counts(
        &self,
        key: &str,
        counts: Option<CountsSpec>,
        layout: Layout,
    ) -> Result<(), PipelineError> {
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
}

/// Where things lie, in words.
fn place(layout: Layout) -> &'static str {
    match layout {
        Layout::Table => "the table",
        Layout::Bench => "an arm's bench",
    }
}

impl SuiteSpec {
    /// The counts of the demonstration.
    pub(in crate::pipeline) fn demonstrated(&self) -> CountsSpec {
        self.demonstrated.unwrap_or(DEFAULT_COUNTS)
    }
}
