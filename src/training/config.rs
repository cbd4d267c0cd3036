//! The settings of one training, as they stand in a pipeline file.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::model::{EncoderKind, ScopingKind, Variant};
use crate::trace::{NoiseError, ObservationNoise, SpecificationForm};
use crate::training::TrainError;
use crate::training::detector_config::DetectorTraining;

/// What is trained, and how.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Training {
    /// The kind of network.
    pub variant: Variant,
    /// What it reads as task specification.
    pub specification: SpecificationForm,
    /// What parameters, batches and augmentations are drawn from.
    pub seed: u64,
    /// How.
    pub config: TrainConfig,
}

impl Training {
    /// Whether the settings make sense together.
    ///
    /// # Errors
    ///
    /// [`TrainError::Config`] for the first that does not, with what is allowed.
    pub fn check(&self) -> Result<(), TrainError> {
        self.config.check()?;
        let refuse = |key, found, allowed| Err(TrainError::Config { key, found, allowed });
        if self.variant.sees() && self.config.curriculum != Curriculum::Equal {
            return refuse("curriculum", "adaptive".to_owned(), "equal with variants that see");
        }
        if let Some(kernel) = self.config.scope_kernel {
            if self.variant.scoping() == ScopingKind::Arguments {
                let found = format!("{kernel} for variant {}", self.variant);
                return refuse("scope_kernel", found, "variants that read a specification");
            }
            if kernel % 2 == 0 {
                return refuse("scope_kernel", kernel.to_string(), "odd numbers");
            }
        }
        let reads_vectors = matches!(self.variant.encoder(), EncoderKind::Flattened | EncoderKind::DetectedFlattened);
        if self.config.relations && (!reads_vectors || self.variant.scoping() == ScopingKind::Arguments) {
            let found = format!("on for variant {}", self.variant);
            return refuse("relations", found, "on with flattened encoders of positions beside a specification");
        }
        if self.variant.sees() && !self.config.noise.is_none() {
            return refuse("noise", format!("set for variant {}", self.variant), "variants that read positions");
        }
        if self.config.shared_root && !self.variant.reads_any_family() {
            let found = format!("on for variant {}", self.variant);
            return refuse("shared_root", found, "on with variants that read positions and a demonstration of them");
        }
        if self.variant.detects() && self.config.start_from.is_some() {
            return refuse("start_from", format!("set for variant {}", self.variant), "variants without a detector");
        }
        if !self.variant.detects() && self.config.detector != DetectorTraining::default() {
            return refuse("detector", format!("set for variant {}", self.variant), "variants with a detector");
        }
        if self.config.detector.heat_maps && self.variant.encoder() != EncoderKind::DetectedFlattened {
            return refuse(
                "detector.heat_maps",
                format!("on for variant {}", self.variant),
                "on with ntp_vid_detector_paper",
            );
        }
        match self.config.colours {
            Some(colours) if !self.variant.encoder().has_colours() => {
                return refuse(
                    "colours",
                    format!("{colours} for variant {}", self.variant),
                    "variants on colour slots",
                );
            }
            Some(colours) if !(2..=64).contains(&colours) => {
                return refuse("colours", colours.to_string(), "2 to 64");
            }
            Some(_) | None => {}
        }
        if self.variant.sees() != (self.specification == SpecificationForm::Video) {
            let found = format!("{} with variant {}", self.specification, self.variant);
            return refuse("specification", found, "video with variants that see, and with no other");
        }
        if self.specification != SpecificationForm::Instructions {
            return Ok(());
        }
        if self.variant != Variant::NTP {
            let found = format!("{} with variant {}", self.specification, self.variant);
            return refuse("specification", found, "instructions with variant ntp alone");
        }
        let shares = [
            ("relabel_slots", self.config.relabel_slots.unwrap_or(0.0)),
            ("merge_containers", self.config.merge_containers),
        ];
        match shares.into_iter().find(|(_, share)| *share > 0.0) {
            Some((key, share)) => refuse(key, share.to_string(), "0 with instructions, whose words name slots"),
            None => Ok(()),
        }
    }

    /// With every default that depends on the variant filled in.
    #[must_use]
    pub fn resolved(&self) -> Self {
        let defaults = self.variant.encoder().training();
        // What a task does to which slot stands in the weights of a model without a specification.
        let may_relabel = self.variant.scoping() != ScopingKind::Arguments;
        let relabel_slots = if may_relabel { defaults.relabel_slots } else { 0.0 };
        let config = TrainConfig {
            steps: self.config.steps.or(Some(defaults.steps)),
            learning_rate: self.config.learning_rate.or(Some(defaults.learning_rate)),
            relabel_slots: self.config.relabel_slots.or(Some(relabel_slots)),
            gripper_jitter: self.config.gripper_jitter.or(Some(defaults.gripper_jitter)),
            recovery_states: self.config.recovery_states.or(Some(defaults.recovery_states)),
            detector: self.config.detector.resolved(self.variant),
            ..self.config.clone()
        };
        Self { config, ..self.clone() }
    }
}

/// How a model is trained, as it stands in a pipeline file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TrainConfig {
    /// Steps of the optimizer; by default 1000 for object-centric and 3000 for flattened networks.
    pub steps: Option<u32>,
    /// Decisions of the root program in a step; programs below it have half as many each.
    pub batch: u32,
    /// Highest learning rate; by default 0.003 for object-centric and 0.002 for flattened networks.
    pub learning_rate: Option<f32>,
    /// Steps in which the learning rate rises from zero.
    pub warmup_steps: u32,
    /// Steps behind those in which the learning rate stays at its highest, before its cosine begins. None by default.
    #[serde(skip_serializing_if = "is_none")]
    pub stable_steps: u32,
    /// The learning rate at the end of its cosine, as a share of the highest.
    pub final_learning_rate: f32,
    /// Largest norm of a step's gradient; a longer one is scaled down to it.
    pub clip_norm: f32,
    /// Which trial the demonstration comes from.
    pub pairing: Pairing,
    /// How a step is shared out among the levels of the hierarchy.
    pub curriculum: Curriculum,
    /// What each decision's parts weigh.
    pub loss: LossWeights,
    /// How often slots are relabelled (0 to 1); by default never for object-centric networks, which it changes nothing
    /// for, and always for flattened ones.
    pub relabel_slots: Option<f32>,
    /// How often an empty gripper is put elsewhere before it moves (0 to 1): a policy's gripper may hang where the
    /// expert's never did. By default 0.2 for object-centric networks and never for flattened ones, which it keeps
    /// from learning in this budget.
    pub gripper_jitter: Option<f32>,
    /// How often slots that the running program has nothing to do with are put elsewhere, in the demonstration and
    /// now (0 to 1): a program learns to look at its own slots alone. Off by default; Object Sorting needs it.
    pub scatter_bystanders: f32,
    /// How often part of what was built lies on the table again, and the root program is to build it anew (0 to 1);
    /// for families that build towers. By default 0.25 for object-centric networks and never for flattened ones.
    pub recovery_states: Option<f32>,
    /// How often whatever goes into one container goes into another (0 to 1), so that several categories share one as
    /// in mappings that no training task shows. Off by default; for Object Sorting.
    pub merge_containers: f32,
    /// How far what goes into another container lies from where it would have lain, across the table and in metres (0 to
    /// 0.1), apart in demonstration and state. Training tasks show the first of a category in its container's middle;
    /// where categories share one it falls beside the others. Off by default.
    #[serde(skip_serializing_if = "is_zero")]
    pub merge_aside_m: f32,
    /// How far the positions that it learns from are off. Not at all by default.
    #[serde(skip_serializing_if = "ObservationNoise::is_none")]
    pub noise: ObservationNoise,
    /// How many colours are told apart by networks on colour slots: one for each thing to be seen, one for the gripper, and
    /// some for letters, shadows and darker sides. By default three more than there are slots and a gripper.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub colours: Option<u32>,
    /// Frames of the demonstration that a scoping label sees around itself; odd, and no more than the longest
    /// demonstration has. By default 5. Object Sorting with flattened networks needs 11: to end a scope a frame must show
    /// which category the segment before was of.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scope_kernel: Option<u32>,
    /// Features of the hidden layers, 1 to 4096. By default 96 in flattened networks and 32 in others. Time and memory of
    /// a step grow with its square.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub width: Option<u32>,
    /// Whether flattened networks read the displacements between slots beside their positions. Off by default, as in the
    /// paper, whose discussion names relationships between objects as future work.
    #[serde(skip_serializing_if = "is_off")]
    pub relations: bool,
    /// Whether the root programs of all families are one to the network, so that it can be asked for a family that it was
    /// not trained on. Off by default; for models of several families.
    #[serde(skip_serializing_if = "is_off")]
    pub shared_root: bool,
    /// Folder of a trained model whose weights this one begins with: of the same variant, widths, slots and programs. A path
    /// from the run's directory, so `models/NAME`, or `../EXPERIMENT/models/NAME` in a study. Left out, weights are drawn.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start_from: Option<PathBuf>,
    /// How a detector is trained before the network behind it; for variants that have one.
    #[serde(skip_serializing_if = "DetectorTraining::is_default")]
    pub detector: DetectorTraining,
    /// Boundary frames of the training trials above which these are streamed from disk through a buffer, in an order that
    /// the seed shuffles; by default 1 500 000. Variants with a detector keep theirs in memory.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub most_frames_in_memory: Option<u64>,
    /// Steps between checkpoints.
    pub checkpoint_every: u32,
    /// Steps between rows of the metrics.
    pub metrics_every: u32,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes fields by reference")]
fn is_off(setting: &bool) -> bool {
    !setting
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes fields by reference")]
fn is_none(steps: &u32) -> bool {
    *steps == 0
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes fields by reference")]
fn is_zero(setting: &f32) -> bool {
    *setting == 0.0
}

impl Default for TrainConfig {
    fn default() -> Self {
        Self {
            steps: None,
            batch: 32,
            learning_rate: None,
            warmup_steps: 100,
            stable_steps: 0,
            final_learning_rate: 0.02,
            clip_norm: 5.0,
            pairing: Pairing::default(),
            curriculum: Curriculum::default(),
            loss: LossWeights::default(),
            relabel_slots: None,
            gripper_jitter: None,
            scatter_bystanders: 0.0,
            recovery_states: None,
            merge_containers: 0.0,
            merge_aside_m: 0.0,
            noise: ObservationNoise::default(),
            colours: None,
            scope_kernel: None,
            width: None,
            relations: false,
            shared_root: false,
            start_from: None,
            detector: DetectorTraining::default(),
            most_frames_in_memory: None,
            checkpoint_every: 100,
            metrics_every: 10,
        }
    }
}

/// Which trial of the task a demonstration comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Pairing {
    /// Another trial than the state: the network must compare, it cannot look positions up.
    #[default]
    Cross,
    /// The same trial.
    Own,
}

/// How a step is shared out among the levels of the hierarchy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Curriculum {
    /// Every level once in each step.
    #[default]
    Equal,
    /// As many mini-batches as there are levels, drawn in proportion to the levels' errors (the paper's).
    Adaptive,
}

/// What the parts of a decision weigh in the loss.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LossWeights {
    /// Cross-entropy of the next program.
    pub program: f32,
    /// Binary cross-entropy of the end of the running program.
    pub end: f32,
    /// Mean cross-entropy of the frames' scoping labels.
    pub scope: f32,
    /// Cross-entropy of the argument.
    pub argument: f32,
}

impl Default for LossWeights {
    fn default() -> Self {
        Self { program: 1.0, end: 1.0, scope: 5.0, argument: 1.0 }
    }
}

impl TrainConfig {
    /// Whether the settings make sense.
    ///
    /// # Errors
    ///
    /// [`TrainError::Config`] for the first that does not, with what is allowed.
    pub fn check(&self) -> Result<(), TrainError> {
        let Self { pairing: _, curriculum: _, warmup_steps: _, loss, .. } = self;
        self.detector.check()?;
        if let Err(NoiseError { key, found }) = self.noise.check() {
            let key = if key == "offset_m" { "noise.offset_m" } else { "noise.frame_m" };
            return Err(TrainError::Config { key, found: found.to_string(), allowed: "from 0 to 0.1" });
        }
        let at_least_one = [
            ("steps", self.steps.unwrap_or(1)),
            ("batch", self.batch),
            ("checkpoint_every", self.checkpoint_every),
            ("metrics_every", self.metrics_every),
        ];
        let positive = [("learning_rate", self.learning_rate.unwrap_or(1.0)), ("clip_norm", self.clip_norm)];
        let shares = [
            ("final_learning_rate", self.final_learning_rate),
            ("relabel_slots", self.relabel_slots.unwrap_or(0.0)),
            ("gripper_jitter", self.gripper_jitter.unwrap_or(0.0)),
            ("scatter_bystanders", self.scatter_bystanders),
            ("recovery_states", self.recovery_states.unwrap_or(0.0)),
            ("merge_containers", self.merge_containers),
        ];
        let weights = [
            ("loss.program", loss.program),
            ("loss.end", loss.end),
            ("loss.scope", loss.scope),
            ("loss.argument", loss.argument),
        ];
        let refuse =
            |key: &'static str, found: String, allowed: &'static str| TrainError::Config { key, found, allowed };
        let counts = at_least_one.into_iter().filter(|(_, value)| *value == 0);
        let mut wrong = counts.map(|(key, value)| refuse(key, value.to_string(), "at least 1"));
        if let Some(error) = wrong.next() {
            return Err(error);
        }
        match self.width {
            Some(width) if !(1..=4096).contains(&width) => {
                return Err(refuse("width", width.to_string(), "1 to 4096"));
            }
            Some(_) | None => {}
        }
        let numbers = (positive.into_iter().map(|(key, value)| (key, value, value > 0.0, "greater than 0")))
            .chain(shares.map(|(key, value)| (key, value, (0.0..=1.0).contains(&value), "from 0 to 1")))
            .chain(std::iter::once((
                "merge_aside_m",
                self.merge_aside_m,
                (0.0..=0.1).contains(&self.merge_aside_m),
                "from 0 to 0.1",
            )))
            .chain(weights.map(|(key, value)| (key, value, value >= 0.0, "at least 0")));
        match numbers.into_iter().find(|(_, value, fits, _)| !fits || !value.is_finite()) {
            Some((key, value, _, allowed)) => Err(refuse(key, value.to_string(), allowed)),
            None => Ok(()),
        }
    }

    /// Steps of the optimizer. Zero where none are set or filled in.
    pub fn n_steps(&self) -> u32 {
        self.steps.unwrap_or_default()
    }

    /// Steps of detector and network together.
    pub fn n_steps_in_all(&self) -> u32 {
        self.detector.n_steps() + self.n_steps()
    }

    /// The learning rate of a step: a straight rise, its height for a while, then a cosine. Zero where none is set or
    /// filled in.
    pub fn learning_rate_at(&self, step: u32) -> f64 {
        self.annealed(f64::from(self.learning_rate.unwrap_or_default()), step, self.n_steps(), self.stable_steps)
    }

    /// The same for a step of the detector.
    pub(super) fn detector_learning_rate_at(&self, step: u32) -> f64 {
        let highest = f64::from(self.detector.learning_rate.unwrap_or_default());
        self.annealed(highest, step, self.detector.n_steps(), 0)
    }

    fn annealed(&self, highest: f64, step: u32, n_steps: u32, n_stable: u32) -> f64 {
        if step < self.warmup_steps {
            return highest * f64::from(step + 1) / f64::from(self.warmup_steps);
        }
        let falls_from = self.warmup_steps.saturating_add(n_stable);
        let span = n_steps.saturating_sub(falls_from).max(1);
        let done = f64::from(step.saturating_sub(falls_from)) / f64::from(span);
        let last = f64::from(self.final_learning_rate);
        highest * (last + (1.0 - last) * 0.5 * (1.0 + (std::f64::consts::PI * done).cos()))
    }
}
