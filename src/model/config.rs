//! What stands beside a model's weights: which network it is, and for what it was made.

use serde::{Deserialize, Serialize};

use crate::model::colour_slots::ColourSlotsConfig;
use crate::model::detector::{PointDetectorConfig, VggDetectorConfig};
use crate::model::device::ComputeDevice;
use crate::model::encoder_kind::EncoderKind;
use crate::model::instructed::InstructedConfig;
use crate::model::keypoints::KeypointsConfig;
use crate::model::limits::{ConfigError, check_sizes};
use crate::model::object_centric::ObjectCentricConfig;
use crate::model::scoping_kind::ScopingKind;
use crate::model::sighted::SightedConfig;
use crate::model::variant::Variant;
use crate::model::vectors::ConvolvedConfig;
use crate::model::vectors::FlattenedConfig;
use crate::program::KnownPrograms;
use crate::task::Family;
use crate::trace::SpecificationForm;

/// Colours for letters, shadows and darker sides.
const SPARE_COLOURS: usize = 3;

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes fields by reference")]
fn is_off(setting: &bool) -> bool {
    !setting
}

/// The widths of a network, by its encoder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NetworkConfig {
    /// Of [`EncoderKind::ObjectCentric`].
    ObjectCentric(ObjectCentricConfig),
    /// Of [`EncoderKind::Flattened`].
    Flattened(FlattenedConfig),
    /// Of [`Variant::NTP`] with instructions for a specification.
    Instructed(InstructedConfig),
    /// Of [`EncoderKind::ColourSlots`].
    ColourSlots(SightedConfig<ColourSlotsConfig>),
    /// Of [`EncoderKind::Convolved`].
    Convolved(ConvolvedConfig),
    /// Of [`EncoderKind::Keypoints`].
    Keypoints(SightedConfig<KeypointsConfig>),
    /// Of [`EncoderKind::Detected`].
    Detected(PointDetectorConfig, ObjectCentricConfig),
    /// Of [`EncoderKind::DetectedFlattened`].
    DetectedFlattened(VggDetectorConfig, FlattenedConfig),
}

impl NetworkConfig {
    /// A variant's default. Instructions are for variant `ntp` alone; for another the widths are not its own.
    pub fn of(variant: Variant, specification: SpecificationForm) -> Self {
        match (specification, variant.encoder()) {
            (SpecificationForm::Instructions, _) => Self::Instructed(InstructedConfig::default()),
            (_, EncoderKind::ObjectCentric) => Self::ObjectCentric(ObjectCentricConfig::default()),
            (_, EncoderKind::Flattened) => Self::Flattened(FlattenedConfig::default()),
            (_, EncoderKind::ColourSlots) => {
                Self::ColourSlots(SightedConfig::of(ColourSlotsConfig { pixels: 64, colours: 0 }))
            }
            (_, EncoderKind::Convolved) => Self::Convolved(ConvolvedConfig::of_pixels(64)),
            (_, EncoderKind::Keypoints) => Self::Keypoints(SightedConfig::of(KeypointsConfig::of(64, 0))),
            (_, EncoderKind::Detected) => Self::Detected(
                PointDetectorConfig::of(ColourSlotsConfig { pixels: 64, colours: 0 }),
                ObjectCentricConfig::default(),
            ),
            (_, EncoderKind::DetectedFlattened) => Self::DetectedFlattened(
                VggDetectorConfig { pixels: 64, narrowed: VggDetectorConfig::NARROWED, heat_maps: false },
                FlattenedConfig::default(),
            ),
        }
    }

    /// The same for pictures of a size, each of so many cameras, with a colour for each of `n_slots` objects, one for the
    /// gripper and some for what else there is to see; widths that see nothing stay as they are. A detector has one camera.
    #[must_use]
    pub fn for_pictures(self, pixels: usize, cameras: usize, n_slots: usize) -> Self {
        let perception = ColourSlotsConfig { pixels, colours: n_slots + 1 + SPARE_COLOURS };
        match self {
            Self::ColourSlots(config) => Self::ColourSlots(SightedConfig { perception, cameras, ..config }),
            Self::Convolved(config) => Self::Convolved(ConvolvedConfig { pixels, cameras, ..config }),
            Self::Keypoints(config) => {
                let perception = KeypointsConfig { pixels, slots: n_slots, ..config.perception };
                Self::Keypoints(SightedConfig { perception, cameras, ..config })
            }
            Self::Detected(_, widths) => Self::Detected(PointDetectorConfig::of(perception), widths),
            Self::DetectedFlattened(config, widths) => {
                Self::DetectedFlattened(VggDetectorConfig { pixels, ..config }, widths)
            }
            other => other,
        }
    }

    /// The same with another number of colours to be told apart; widths without colours stay as they are.
    #[must_use]
    pub fn telling_apart(self, colours: usize) -> Self {
        match self {
            Self::ColourSlots(config) => {
                let perception = ColourSlotsConfig { colours, ..config.perception };
                Self::ColourSlots(SightedConfig { perception, ..config })
            }
            Self::Detected(config, widths) => {
                let perception = ColourSlotsConfig { colours, ..config.perception };
                Self::Detected(PointDetectorConfig { perception, ..config }, widths)
            }
            other => other,
        }
    }

    /// The same with VGG16's widths divided by another number; other widths stay as they are.
    #[must_use]
    pub fn narrowed(self, narrowed: usize) -> Self {
        match self {
            Self::DetectedFlattened(config, widths) => {
                Self::DetectedFlattened(VggDetectorConfig { narrowed, ..config }, widths)
            }
            other => other,
        }
    }

    /// The same with heat maps above VGG16's convolutions; other widths stay as they are.
    #[must_use]
    pub fn with_heat_maps(self) -> Self {
        match self {
            Self::DetectedFlattened(config, widths) => {
                Self::DetectedFlattened(VggDetectorConfig { heat_maps: true, ..config }, widths)
            }
            other => other,
        }
    }

    /// The same with another number of frames that a scoping label sees around itself.
    #[must_use]
    pub fn with_scope_kernel(mut self, scope_kernel: usize) -> Self {
        let kernel = match &mut self {
            Self::ObjectCentric(widths) | Self::Detected(_, widths) => &mut widths.scope_kernel,
            Self::Flattened(widths) | Self::DetectedFlattened(_, widths) => &mut widths.scope_kernel,
            Self::Instructed(widths) => &mut widths.scope_kernel,
            Self::ColourSlots(widths) => &mut widths.scope_kernel,
            Self::Convolved(widths) => &mut widths.flattened.scope_kernel,
            Self::Keypoints(widths) => &mut widths.scope_kernel,
        };
        *kernel = scope_kernel;
        self
    }

    /// The same with hidden layers of another width.
    #[must_use]
    pub fn with_width(mut self, features: usize) -> Self {
        let width = match &mut self {
            Self::ObjectCentric(widths) | Self::Detected(_, widths) => &mut widths.width,
            Self::Flattened(widths) | Self::DetectedFlattened(_, widths) => &mut widths.width,
            Self::Instructed(widths) => &mut widths.width,
            Self::ColourSlots(widths) => &mut widths.width,
            Self::Convolved(widths) => &mut widths.flattened.width,
            Self::Keypoints(widths) => &mut widths.width,
        };
        *width = features;
        self
    }

    /// The same with the displacements between slots beside their positions; widths that read no vector of positions
    /// stay as they are.
    #[must_use]
    pub fn with_relations(mut self) -> Self {
        if let Self::Flattened(widths) | Self::DetectedFlattened(_, widths) = &mut self {
            widths.relations = true;
        }
        self
    }

    /// Width and height of the pictures that the network is made for; `None` where it sees none.
    pub fn pixels(&self) -> Option<usize> {
        match self {
            Self::ObjectCentric(_) | Self::Flattened(_) | Self::Instructed(_) => None,
            Self::ColourSlots(config) => Some(config.perception.pixels),
            Self::Convolved(config) => Some(config.pixels),
            Self::Detected(config, _) => Some(config.perception.pixels),
            Self::Keypoints(config) => Some(config.perception.pixels),
            Self::DetectedFlattened(config, _) => Some(config.pixels),
        }
    }

    /// How many cameras it sees with; 0 where it sees nothing.
    pub fn cameras(&self) -> usize {
        match self {
            Self::ObjectCentric(_) | Self::Flattened(_) | Self::Instructed(_) => 0,
            Self::ColourSlots(config) => config.cameras,
            Self::Convolved(config) => config.cameras,
            Self::Keypoints(config) => config.cameras,
            Self::Detected(..) | Self::DetectedFlattened(..) => 1,
        }
    }

    fn has_relations(&self) -> bool {
        match self {
            Self::Flattened(widths) | Self::DetectedFlattened(_, widths) => widths.relations,
            Self::Convolved(widths) => widths.flattened.relations,
            Self::ObjectCentric(_) | Self::Instructed(_) | Self::ColourSlots(_) | Self::Keypoints(_) => false,
            Self::Detected(..) => false,
        }
    }

    /// The name in files.
    fn name(&self) -> &'static str {
        self.encoder().map_or("instructed", EncoderKind::name)
    }

    /// What the network reads as task specification.
    pub fn specification(&self) -> SpecificationForm {
        match self {
            Self::ObjectCentric(_) | Self::Flattened(_) => SpecificationForm::Trajectories,
            Self::Instructed(_) => SpecificationForm::Instructions,
            Self::ColourSlots(_)
            | Self::Convolved(_)
            | Self::Keypoints(_)
            | Self::Detected(..)
            | Self::DetectedFlattened(..) => SpecificationForm::Video,
        }
    }

    /// Whether they are a variant's.
    pub fn is_for(&self, variant: Variant) -> bool {
        self.encoder().map_or(variant == Variant::NTP, |encoder| encoder == variant.encoder())
    }

    /// The encoder that they are of; `None` for that of instructions.
    fn encoder(&self) -> Option<EncoderKind> {
        Some(match self {
            Self::Instructed(_) => return None,
            Self::ObjectCentric(_) => EncoderKind::ObjectCentric,
            Self::Flattened(_) => EncoderKind::Flattened,
            Self::ColourSlots(_) => EncoderKind::ColourSlots,
            Self::Convolved(_) => EncoderKind::Convolved,
            Self::Keypoints(_) => EncoderKind::Keypoints,
            Self::Detected(..) => EncoderKind::Detected,
            Self::DetectedFlattened(..) => EncoderKind::DetectedFlattened,
        })
    }

    /// Whether a network of `n_slots` slots can have these sizes.
    fn check(&self, n_slots: usize) -> Result<(), ConfigError> {
        match self {
            Self::ObjectCentric(widths) => widths.check(),
            Self::Flattened(widths) => widths.check(),
            Self::Instructed(widths) => widths.check(),
            Self::ColourSlots(widths) => widths.perception.check().and_then(|()| widths.check()),
            Self::Convolved(widths) => widths.check(),
            Self::Keypoints(widths) => widths.perception.check(n_slots).and_then(|()| widths.check()),
            Self::Detected(detector, widths) => detector.check(n_slots).and_then(|()| widths.check()),
            Self::DetectedFlattened(detector, widths) => detector.check().and_then(|()| widths.check()),
        }
    }
}

/// What stands in a model's `config.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelConfig {
    /// Version of this file; [`ModelConfig::VERSION`].
    pub version: u32,
    /// The kind of network.
    pub variant: Variant,
    /// The family of tasks that it was trained on; of several the first.
    pub family: Family,
    /// The families that it was trained on besides.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub other_families: Vec<Family>,
    /// Slots of the scenes that it was trained on; of several families the most.
    pub n_slots: usize,
    /// Hash of the programs that it knows: those of its families.
    pub vocabulary: String,
    /// Whether the roots of all families are one program to it, so that it can be asked for a family that it has not seen.
    #[serde(default, skip_serializing_if = "is_off")]
    pub shared_root: bool,
    /// The tasks that it knows by name, where it knows any: those of [`ScopingKind::Arguments`], in order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tasks: Vec<String>,
    /// The names of the cameras that it looks with, the first one first; none where it sees nothing, or where nobody named
    /// them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cameras: Vec<String>,
    /// Widths.
    pub network: NetworkConfig,
    /// How it was trained, for people; loading does not read it.
    pub training: serde_json::Value,
    /// On which device, for people; `None` for the processor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trained_on: Option<String>,
}

impl ModelConfig {
    /// Version of `config.json`.
    pub const VERSION: u32 = 2;

    /// The programs that it knows: a row of its memory each.
    pub fn programs(&self) -> KnownPrograms {
        KnownPrograms::of_hash(&self.vocabulary).unwrap_or(KnownPrograms::FIRST)
    }

    /// A model of a variant's default widths and its family's programs, which knows no task by name.
    pub fn new(
        variant: Variant,
        specification: SpecificationForm,
        family: Family,
        n_slots: usize,
        training: serde_json::Value,
    ) -> Self {
        Self {
            version: Self::VERSION,
            variant,
            family,
            other_families: Vec::new(),
            n_slots,
            vocabulary: family.programs().hash(),
            shared_root: false,
            tasks: Vec::new(),
            cameras: Vec::new(),
            network: NetworkConfig::of(variant, specification),
            training,
            trained_on: None,
        }
    }

    /// The same, saying where it was trained.
    #[must_use]
    pub(crate) fn trained_on(self, device: ComputeDevice) -> Self {
        Self { trained_on: (!device.is_cpu()).then(|| device.to_string()), ..self }
    }

    /// The same for other families besides.
    #[must_use]
    pub fn beside(self, other_families: Vec<Family>) -> Self {
        let known = other_families.iter().map(|family| family.programs()).fold(self.programs(), KnownPrograms::max);
        Self { vocabulary: known.hash(), other_families, ..self }
    }

    /// The families that it was trained on.
    pub fn families(&self) -> impl Iterator<Item = Family> {
        std::iter::once(self.family).chain(self.other_families.iter().copied())
    }

    /// The same by name.
    pub(crate) fn family_names(&self) -> String {
        self.families().map(Family::name).collect::<Vec<_>>().join(", ")
    }

    /// The cameras that it looks with; another model's where nobody named its own.
    pub(crate) fn cameras_beside(&self, other: &Self) -> String {
        let names = if self.cameras.is_empty() { &other.cameras } else { &self.cameras };
        names.join(", ")
    }

    /// Whether it can be asked for tasks of a family: it knows the root program, or takes all roots for one.
    pub fn acts(&self, family: Family) -> bool {
        self.shared_root || self.families().any(|own| own.root_program() == family.root_program())
    }

    /// Whether it reads scenes of so many slots: as many as it was trained on; fewer where it was trained on fewer, too; any
    /// number where slots are read one by one.
    pub fn reads_slots(&self, n_slots: usize) -> bool {
        match self.network {
            NetworkConfig::ObjectCentric(_) => {
                self.variant.scoping() != ScopingKind::Arguments || n_slots == self.n_slots
            }
            NetworkConfig::Flattened(_) if self.families().count() > 1 => {
                n_slots <= self.n_slots && self.families().any(|own| own.n_slots() == n_slots)
            }
            _ => n_slots == self.n_slots,
        }
    }

    /// Whether a network can be made of it.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] for the first key that makes no sense, with what is allowed.
    pub fn check(&self) -> Result<(), ConfigError> {
        let Self { version: _, variant, family: _, other_families, n_slots, vocabulary: _, shared_root, tasks, .. } =
            self;
        let Self { network, cameras, training: _, trained_on: _, .. } = self;
        check_sizes(&[("n_slots", *n_slots)])?;
        ConfigError::unless(network.is_for(*variant), "network", network.name(), "widths of the variant's encoder")?;
        let knows_tasks = variant.scoping() == ScopingKind::Arguments;
        let allowed = "none but for scoping arguments, which knows tasks by name";
        ConfigError::unless(knows_tasks || tasks.is_empty(), "tasks", tasks.len(), allowed)?;
        let are_all = cameras.is_empty() || cameras.len() == network.cameras();
        let allowed = "as many names as the network has cameras, or none";
        ConfigError::unless(are_all, "cameras", format!("{cameras:?}"), allowed)?;
        let reads_any =
            matches!(network, NetworkConfig::ObjectCentric(_) | NetworkConfig::Flattened(_)) && !knows_tasks;
        let allowed = "none but for networks that read positions and a specification";
        ConfigError::unless(reads_any || other_families.is_empty(), "other_families", other_families.len(), allowed)?;
        ConfigError::unless(reads_any || !shared_root, "shared_root", "on", allowed)?;
        let reads_vectors =
            variant.scoping() != ScopingKind::Arguments && !matches!(network, NetworkConfig::Convolved(_));
        let allowed = "off but for vectors of positions beside a specification";
        ConfigError::unless(reads_vectors || !network.has_relations(), "relations", "on", allowed)?;
        network.check(*n_slots)
    }
}
