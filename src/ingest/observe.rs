//! Poses of gripper and objects as our observations, so that models read what was recorded.
//!
//! # Shapes
//!
//! What a row takes from messages: x, y, z of the gripper, the numbers whose sum is its opening, then x, y, z of each
//! body. What becomes of it: `observation.state`, as [`crate::trace::Observation::to_flat`], and
//! `ntp.gripper_in_world_m`.
//!
//! # Units and frames
//!
//! Metres, in the frame that the messages are in. The gripper's reference point is 2 cm above the centre of what it
//! holds, between the fingers; `offset_m` leads there from what the messages give.

use serde::Deserialize;

use super::map::{FeatureMap, Matching, NumberType, SourceMap, Store};
use super::path::FieldPath;
use crate::dataset::plain::{Cell, Dtype, PlainFeature, PlainKind};
use crate::geometry::{Vec3, upright};
use crate::scene::{Body, BodyIndex, Mobility, Scene, SceneState, Shape, Slot, locked_bodies};
use crate::task::{self, Family};
use crate::trace::Frame;
use crate::words::counted;

/// The feature of observations.
pub(super) const STATE: &str = "observation.state";
/// The feature of the gripper's place.
pub(super) const GRIPPER: &str = "ntp.gripper_in_world_m";
/// Stands for a body's name.
const BODY: &str = "{}";
/// From the gripper's reference point down to the centre of what it holds, in metres.
const GRASP_M: f32 = 0.02;
/// What a closed gripper holds is not farther from between its fingers, in metres: half of what it can open to.
const HOLD_M: f32 = 0.035;

/// Which messages tell poses.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ObservationsMap {
    /// The family whose objects these are, with its names.
    #[serde(default)]
    family: Option<Family>,
    /// Instances of each category of the family; 1 where nothing is said.
    #[serde(default)]
    counts: Vec<u16>,
    /// In place of a family: the names of the objects, a slot each.
    #[serde(default)]
    slots: Vec<String>,
    /// The gripper's position.
    gripper: SourceMap,
    /// From there to its reference point.
    #[serde(default)]
    offset_m: [f32; 3],
    /// Numbers whose sum is the distance between the fingers.
    opening: SourceMap,
    /// A smaller opening is closed.
    closed_below_m: f64,
    /// Where each object's position is: `{}` stands for its name.
    objects: SourceMap,
    #[serde(default, rename = "match")]
    matching: Matching,
    #[serde(default = "one")]
    max_age_secs: f64,
}

fn one() -> f64 {
    1.0
}

impl ObservationsMap {
    /// What there is to be observed.
    pub(super) fn scene(&self) -> Result<Scene, String> {
        match (self.family, self.slots.as_slice()) {
            (Some(family), []) => Ok(task::scene(family, &self.counts)),
            (None, names @ [_, ..]) => match names.iter().enumerate().find(|(at, name)| names[..*at].contains(name)) {
                Some((_, twice)) => Err(format!("observations.slots: {twice:?} stands twice")),
                None if names.iter().any(String::is_empty) => {
                    Err("observations.slots: a name is empty; allowed are names of objects".to_owned())
                }
                None => Ok(of_names(names)),
            },
            _ => Err("observations: either family, or slots with the names of objects".to_owned()),
        }
    }

    /// The numbers that a row takes, as a feature with a source each.
    pub(super) fn feature(&self) -> Result<FeatureMap, String> {
        let scene = self.scene()?;
        let bodies = scene.bodies.iter().map(|body| self.object(&body.name)).collect::<Result<Vec<_>, _>>()?;
        if !(self.closed_below_m.is_finite() && self.closed_below_m > 0.0) {
            return Err(format!("observations: closed_below_m is {}; it is above 0", self.closed_below_m));
        }
        let from = [self.gripper.clone(), self.opening.clone()].into_iter().chain(bodies).collect();
        Ok(FeatureMap {
            name: STATE.to_owned(),
            dtype: NumberType::Float32,
            matching: self.matching,
            max_age_secs: self.max_age_secs,
            store: Store::default(),
            names: None,
            from,
        })
    }

    fn object(&self, name: &str) -> Result<SourceMap, String> {
        let SourceMap { topic, field, joints, joint_names } = &self.objects;
        if !topic.contains(BODY) && !field.text().contains(BODY) {
            return Err(format!("observations.objects: neither topic nor field has {BODY}, the place of a name"));
        }
        let field = FieldPath::try_from(field.text().replace(BODY, name))?;
        let (topic, joints, joint_names) = (topic.replace(BODY, name), joints.clone(), joint_names.clone());
        Ok(SourceMap { topic, field, joints, joint_names })
    }
}

/// Objects that are told apart by their names alone.
fn of_names(names: &[String]) -> Scene {
    let body = |name: &String| Body {
        name: name.clone(),
        shape: Shape::Cuboid { half_extents_m: [0.025; 3] },
        mobility: Mobility::Movable,
        color: [128; 3],
    };
    let slots = names.iter().enumerate().map(|(at, name)| Slot::single(name.clone(), at)).collect();
    Scene { bodies: names.iter().map(body).collect(), slots, table_half_m: [1.0; 2] }
}

/// Makes observations of numbers, row by row.
pub(super) struct Observer {
    scene: Scene,
    offset: Vec3,
    closed_below_m: f64,
    /// Which body each slot showed in the row before; nothing at the beginning of an episode.
    shown: Option<Vec<BodyIndex>>,
}

impl Observer {
    pub(super) fn new(map: &ObservationsMap) -> Result<Self, String> {
        let (scene, offset) = (map.scene()?, Vec3::from(map.offset_m));
        Ok(Self { scene, offset, closed_below_m: map.closed_below_m, shown: None })
    }

    /// What is wrong with the widths of the sources, if anything.
    pub(super) fn check(widths: &[usize]) -> Result<(), String> {
        let wrong = |what: &str, found: usize| {
            Err(format!("observations.{what} gives {found}, not x, y and z", found = counted(found, "number")))
        };
        match widths {
            [gripper, ..] if *gripper != 3 => wrong("gripper", *gripper),
            [_, _, objects @ ..] => match objects.iter().find(|&&width| width != 3) {
                Some(&found) => wrong("objects", found),
                None => Ok(()),
            },
            _ => Ok(()),
        }
    }

    /// The features that are written.
    pub(super) fn declared(&self) -> [PlainFeature; 2] {
        let of_slot = |slot: &Slot| ["x", "y", "z"].map(|axis| format!("{}.{axis}_m", slot.name));
        let gripper = ["gripper.open", "gripper.closed"].map(ToOwned::to_owned);
        let state = self.scene.slots.iter().flat_map(of_slot).chain(gripper).collect();
        let place = ["x", "y", "z"].map(ToOwned::to_owned).into();
        [(STATE, state), (GRIPPER, place)].map(|(name, names)| PlainFeature {
            name: name.to_owned(),
            kind: PlainKind::Numbers(Dtype::Float32, names),
        })
    }

    /// Begins an episode.
    pub(super) fn begin_episode(&mut self) {
        self.shown = None;
    }

    /// What is written of a row's numbers.
    pub(super) fn cells(&mut self, numbers: &[f64]) -> [Cell; 2] {
        let vector = |xyz: &[f64]| Vec3::new(xyz[0] as f32, xyz[1] as f32, xyz[2] as f32);
        let n_bodies = self.scene.bodies.len();
        let (own, bodies) = numbers.split_at(numbers.len().saturating_sub(3 * n_bodies));
        let (gripper, opening) = own.split_at(3.min(own.len()));
        let gripper = if gripper.len() == 3 { vector(gripper) + self.offset } else { self.offset };
        let places: Vec<Vec3> = bodies.chunks_exact(3).map(vector).collect();
        let opening_m: f64 = opening.iter().sum();
        let held = (opening_m < self.closed_below_m).then(|| nearest(&places, gripper)).flatten();
        let state = SceneState {
            gripper_in_world: upright(gripper, 0.0),
            opening_m: opening_m as f32,
            held,
            bodies_in_world: places.iter().map(|&place| upright(place, 0.0)).collect(),
            joints_rad: None,
        };
        let slots = locked_bodies(&self.scene, &state, self.shown.as_deref());
        self.shown = Some(slots.clone());
        let frame = Frame { time_nanos: 0, boundary: false, state, slots };
        let wide = |values: &[f32]| Cell::Numbers(values.iter().map(|&value| f64::from(value)).collect());
        [wide(&frame.observation().to_flat()), wide(gripper.as_slice())]
    }
}

/// What is between the fingers.
fn nearest(places: &[Vec3], gripper: Vec3) -> Option<BodyIndex> {
    let between = gripper - Vec3::z() * GRASP_M;
    let distances = places.iter().map(|place| (place - between).norm());
    let (body, distance_m) = distances.enumerate().min_by(|a, b| a.1.total_cmp(&b.1))?;
    (distance_m <= HOLD_M).then_some(BodyIndex(body as u16))
}
