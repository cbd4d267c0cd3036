//! What a family declares of itself.

use rand_chacha::ChaCha8Rng;

use crate::geometry::Pose;
use crate::program::Program;
use crate::scene::{Scene, SlotIndex};
use crate::seed::Seed;
use crate::task::{Condition, Task, TaskPool};

/// What tells a family from the others. The rest is the same for all of them.
pub(in crate::task) struct FamilySpec {
    /// The name in files.
    pub(in crate::task) name: &'static str,
    /// The start of suite names: the name's last word.
    pub(in crate::task) short_name: &'static str,
    /// The name for people.
    pub(in crate::task) title: &'static str,
    /// The program at the root of its call trees.
    pub(in crate::task) root: Program,
    /// What its scenes show, in the order of slots.
    pub(in crate::task) kinds: &'static [SlotKind],
    /// See [`Family::builds_towers`](crate::task::Family::builds_towers).
    pub(in crate::task) builds_towers: bool,
    /// The slot of what is carried away in the end, if anything is.
    pub(in crate::task) tray: Option<SlotIndex>,
    /// What the authors' task files call its goals, where there are such files.
    pub(in crate::task) imported_as: Option<&'static str>,
    /// With all that its programs reach in the picture.
    pub(in crate::task) front_view: FrontView,
    /// Which tasks there are.
    pub(in crate::task) sampler: Sampler,
    /// What stands on the table, for the counts of a trial: see [`Task::counts`].
    pub(in crate::task) scene: fn(&[u16]) -> Scene,
    /// Random poses of the scene's bodies, without overlap.
    pub(in crate::task) poses: fn(&Scene, &mut ChaCha8Rng) -> Vec<Pose>,
    /// How an arm has them before it.
    pub(in crate::task) bench: Bench,
}

/// The layout before an arm.
pub(in crate::task) struct Bench {
    /// Half of the table's width and depth, in metres.
    pub(in crate::task) table_half_m: [f32; 2],
    /// Random poses of the scene's bodies, without overlap, all within the arm's reach.
    pub(in crate::task) poses: fn(&Scene, &mut ChaCha8Rng) -> Vec<Pose>,
    /// With table and arm in the picture.
    pub(in crate::task) front_view: FrontView,
}

/// Slots that play the same part. What is told of one of them can be told of any other.
pub struct SlotKind {
    /// One of them in words: `block`, `container`.
    pub name: &'static str,
    /// Their names, in order.
    pub slots: &'static [&'static str],
    /// What bringing one of them to a target brings about; nothing where they stay where they are.
    pub brings_about: Option<fn(SlotIndex, SlotIndex) -> Condition>,
    /// What can be brought to one of them.
    pub room: Room,
    /// Which bodies one of them shows.
    pub bodies: Bodies,
}

/// What can be brought to a slot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Room {
    /// Nothing.
    Nothing,
    /// The things of one sub-task.
    One,
    /// The things of any number of sub-tasks, in one container.
    Many {
        /// Half of the container's outer width and depth, in metres.
        half_m: f32,
    },
}

/// Which bodies a slot shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bodies {
    /// One.
    One,
    /// One. Of its kind only the first so many are within reach if the task says so; the others stand aside.
    OneWithinReach,
    /// One, which stands aside unless a goal brings it somewhere.
    OneIfAsked,
    /// The instances of a category: so many as a trial draws.
    Many {
        /// The most that the table holds.
        most: u16,
        /// The most that an arm's bench holds.
        most_on_bench: u16,
    },
}

/// Where a camera in front of the table stands and what it looks at, in the world, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrontView {
    /// The camera.
    pub eye_m: [f32; 3],
    /// The middle of its picture.
    pub target_m: [f32; 3],
}

/// How the tasks of a family are drawn.
pub(in crate::task) struct Sampler {
    /// How many training tasks there are at most, and how many unseen ones beside so many training tasks.
    pub(in crate::task) limits: fn(TaskPool, u32) -> (u32, u32),
    /// What training tasks are called where they teach only together what unseen ones ask for.
    pub(in crate::task) all_seen: Option<&'static str>,
    /// So many training tasks, then so many unseen ones, both within the limits. A task depends on the seed and on its
    /// place in its split alone.
    pub(in crate::task) sample: fn(TaskPool, usize, usize, Seed) -> Vec<Task>,
}
