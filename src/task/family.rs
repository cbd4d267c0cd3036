//! The families of tasks: what tells one from another stands in a file of its own.
//!
//! A new family is a file beside these with its `SPEC`, and a line in `families!`. Nothing outside of this folder asks
//! which family it has before it: it asks for what the [`FamilySpec`] declares.

mod blocks;
mod building;
mod cleanup;
mod kitting;
mod sorting;
mod spec;
mod stacking;

pub(super) use spec::FamilySpec;
pub use spec::{Bodies, FrontView, Room, SlotKind};

use std::ops::Range;

use crate::program::{KnownPrograms, Program};
use crate::scene::{Scene, SlotIndex};
use crate::task::Layout;

/// The enum, and the file of each family.
macro_rules! families {
    ($($(#[$doc:meta])* $family:ident => $file:ident,)+) => {
        /// A kind of task: its objects, its programs, its goal conditions.
        #[derive(
            Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord,
            serde::Serialize, serde::Deserialize, schemars::JsonSchema,
        )]
        #[serde(rename_all = "snake_case")]
        pub enum Family {
            $($(#[$doc])* $family,)+
        }

        impl Family {
            /// Every family.
            pub const ALL: [Self; [$(stringify!($family)),+].len()] = [$(Self::$family),+];

            /// What tells it from the others.
            pub(super) fn spec(self) -> &'static FamilySpec {
                match self {
                    $(Self::$family => &$file::SPEC,)+
                }
            }
        }
    };
}

families! {
    /// Eight lettered blocks are stacked into towers.
    BlockStacking => stacking,
    /// Objects of four categories are put into four containers.
    ObjectSorting => sorting,
    /// Bowls are stacked on a tray and forks put into the topmost; the tray is carried away.
    TableCleanup => cleanup,
    /// Parts are put on the marked places of trays, as a kit asks for; some parts are alike.
    Kitting => kitting,
    /// Sixteen lettered blocks are stacked into towers of up to six, by the root program of Block Stacking.
    TowerBuilding => building,
}

impl Family {
    /// The name in files.
    pub fn name(self) -> &'static str {
        self.spec().name
    }

    /// The start of suite names: `stacking_unseen`, `sorting_unseen`, `cleanup_unseen`.
    pub fn short_name(self) -> &'static str {
        self.spec().short_name
    }

    /// The name for people, e.g. `Block Stacking`.
    pub fn title(self) -> &'static str {
        self.spec().title
    }

    /// The program at the root of its call trees.
    pub fn root_program(self) -> Program {
        self.spec().root
    }

    /// The programs that its recordings, datasets and models know.
    pub fn programs(self) -> KnownPrograms {
        KnownPrograms::up_to(self.root_program())
    }

    /// What its scenes show, in the order of slots.
    pub fn kinds(self) -> &'static [SlotKind] {
        self.spec().kinds
    }

    /// Its kinds of slots, each with the slots that it stands for.
    pub fn kinds_with_slots(self) -> impl Iterator<Item = (&'static SlotKind, Range<usize>)> {
        self.kinds().iter().scan(0, |next, kind| {
            let first = *next;
            *next += kind.slots.len();
            Some((kind, first..*next))
        })
    }

    /// How many slots its scenes have.
    pub fn n_slots(self) -> usize {
        self.kinds().iter().map(|kind| kind.slots.len()).sum()
    }

    /// The kind of a slot, if its scenes have it.
    pub(super) fn kind(self, slot: SlotIndex) -> Option<&'static SlotKind> {
        let of_slot = |(kind, slots): (_, Range<usize>)| slots.contains(&usize::from(slot.0)).then_some(kind);
        self.kinds_with_slots().find_map(of_slot)
    }

    /// The name of a slot, which does not depend on the trial.
    pub(crate) fn slot_name(self, slot: SlotIndex) -> &'static str {
        self.kinds().iter().flat_map(|kind| kind.slots).nth(usize::from(slot.0)).copied().unwrap_or("no slot")
    }

    /// Whether some of its slots are categories, of which there may be any number of instances.
    pub fn has_categories(self) -> bool {
        self.max_instances(Layout::Table).is_some()
    }

    /// The most instances of one category that a layout holds; nothing for a family without categories.
    pub fn max_instances(self, layout: Layout) -> Option<u16> {
        let most = |kind: &SlotKind| match (kind.bodies, layout) {
            (Bodies::Many { most, .. }, Layout::Table) => Some(most),
            (Bodies::Many { most_on_bench, .. }, Layout::Bench) => Some(most_on_bench),
            _ => None,
        };
        self.kinds().iter().filter_map(most).max()
    }

    /// The most blocks that a task can have within reach; nothing for a family that leaves none out.
    pub fn max_blocks(self) -> Option<u16> {
        self.count_of(Bodies::OneWithinReach)
    }

    /// The most bowls that a task can ask for; nothing for a family without bowls.
    pub fn max_bowls(self) -> Option<u16> {
        self.count_of(Bodies::OneIfAsked)
    }

    /// The slots whose bodies come to the table in this way; nothing where there are none.
    fn count_of(self, bodies: Bodies) -> Option<u16> {
        let n_slots: usize =
            self.kinds().iter().filter(|kind| kind.bodies == bodies).map(|kind| kind.slots.len()).sum();
        (n_slots > 0).then_some(n_slots as u16)
    }

    /// The slot of what is carried away in the end, if anything is.
    pub fn tray(self) -> Option<SlotIndex> {
        self.spec().tray
    }

    /// Whether its sub-tasks build towers: what is knocked over is built again, and towers may be built in any order.
    pub fn builds_towers(self) -> bool {
        self.spec().builds_towers
    }

    /// The containers that take the things of many sub-tasks, and half of a container's outer width in metres; nothing
    /// for a family without.
    pub fn shared_containers(self) -> Option<(Range<usize>, f32)> {
        self.kinds_with_slots().find_map(|(kind, slots)| match kind.room {
            Room::Many { half_m } => Some((slots, half_m)),
            Room::Nothing | Room::One => None,
        })
    }

    /// What training tasks are called where all of them have to be trained on, or none.
    pub fn all_seen(self) -> Option<&'static str> {
        self.spec().sampler.all_seen
    }

    /// Where a camera in front stands.
    pub fn front_view(self, layout: Layout) -> FrontView {
        match layout {
            Layout::Table => self.spec().front_view,
            Layout::Bench => self.spec().bench.front_view,
        }
    }

    /// The layout that a scene of the family has: its table tells.
    pub fn layout_of(self, scene: &Scene) -> Layout {
        if scene.table_half_m == self.spec().bench.table_half_m { Layout::Bench } else { Layout::Table }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_the_ones_of_files() {
        for family in Family::ALL {
            assert_eq!(serde_json::to_value(family).unwrap(), family.name());
            assert!(family.name().ends_with(family.short_name()), "{}", family.name());
        }
    }

    #[test]
    fn no_two_families_share_a_name_or_a_name_of_import() {
        let told = |family: Family| (family.short_name(), family.spec().imported_as);
        for (number, family) in Family::ALL.into_iter().enumerate() {
            let (short_name, imported_as) = told(family);
            for (other_name, other_import) in Family::ALL[..number].iter().copied().map(told) {
                assert!(short_name != other_name);
                assert!(imported_as.is_none() || imported_as != other_import);
            }
        }
    }

    #[test]
    fn slots_are_counted_through_the_kinds() {
        let cleanup: Vec<_> = Family::TableCleanup.kinds_with_slots().map(|(kind, slots)| (kind.name, slots)).collect();
        assert_eq!(cleanup, [("bowl", 0..4), ("fork", 4..5), ("tray", 5..6)]);
        assert_eq!(Family::TableCleanup.slot_name(SlotIndex(4)), "fork");
        assert_eq!(Family::TableCleanup.kind(SlotIndex(6)).map(|kind| kind.name), None);
        assert_eq!(Family::ObjectSorting.shared_containers().map(|(slots, _)| slots), Some(4..8));
    }
}
