//! `ntp.v1.EpisodeStart` to and from provenance and scene.

use super::error::MessageProblem;
use super::schema::proto::{self, body};
use crate::scene::{Body, BodyIndex, Bowl, Mobility, Scene, Shape, Slot};
use crate::trace::{Actor, EpisodeParts, Provenance};

/// What an `EpisodeStart` holds.
pub(super) struct Start {
    pub(super) provenance: Provenance,
    pub(super) scene: Scene,
    pub(super) specification_frames: u32,
}

pub(super) fn encode(episode: &EpisodeParts) -> proto::EpisodeStart {
    let Provenance { index, family, task_id, task_text, split, trial, seed, counts, actor } = &episode.provenance;
    proto::EpisodeStart {
        index: *index,
        family: family.name().to_owned(),
        task_id: task_id.clone(),
        task_text: task_text.clone(),
        split: split.name().to_owned(),
        trial: *trial,
        seed: *seed,
        counts: counts.iter().copied().map(u32::from).collect(),
        policy: match actor {
            Actor::Expert => None,
            Actor::Policy(variant) => Some(variant.clone()),
        },
        scene: Some(encode_scene(&episode.scene)),
        specification_frames: episode.specification_frames,
    }
}

fn encode_scene(scene: &Scene) -> proto::Scene {
    let Scene { bodies, slots, table_half_m: [table_half_x_m, table_half_y_m] } = scene;
    let slot = |slot: &Slot| proto::Slot {
        name: slot.name.clone(),
        bodies: slot.bodies.iter().map(|body| u32::from(body.0)).collect(),
    };
    proto::Scene {
        bodies: bodies.iter().map(encode_body).collect(),
        slots: slots.iter().map(slot).collect(),
        table_half_x_m: *table_half_x_m,
        table_half_y_m: *table_half_y_m,
    }
}

fn encode_body(body: &Body) -> proto::Body {
    let Body { name, shape, mobility, color: [red, green, blue] } = body;
    proto::Body {
        name: name.clone(),
        shape: Some(encode_shape(shape)),
        mobility: match mobility {
            Mobility::Movable => body::Mobility::Movable.into(),
            Mobility::Fixed => body::Mobility::Fixed.into(),
        },
        color_rgb: u32::from_be_bytes([0, *red, *green, *blue]),
    }
}

fn encode_shape(shape: &Shape) -> body::Shape {
    match *shape {
        Shape::Cuboid { half_extents_m: [half_x_m, half_y_m, half_z_m] } => {
            body::Shape::Cuboid(proto::Cuboid { half_x_m, half_y_m, half_z_m })
        }
        Shape::Cylinder { radius_m, half_height_m } => {
            body::Shape::Cylinder(proto::Cylinder { radius_m, half_height_m })
        }
        Shape::Ball { radius_m } => body::Shape::Ball(proto::Ball { radius_m }),
        Shape::OpenBox { inner_m: [inner_half_x_m, inner_half_y_m, inner_height_m], wall_m } => {
            body::Shape::OpenBox(proto::OpenBox { inner_half_x_m, inner_half_y_m, inner_height_m, wall_m })
        }
        Shape::Bowl(Bowl { floor_radius_m, rim_radius_m, height_m, wall_m, foot_radius_m, foot_height_m }) => {
            body::Shape::Bowl(proto::Bowl {
                floor_radius_m,
                rim_radius_m,
                height_m,
                wall_m,
                foot_radius_m,
                foot_height_m,
            })
        }
    }
}

pub(super) fn decode(message: proto::EpisodeStart) -> Result<Start, MessageProblem> {
    let proto::EpisodeStart {
        index,
        family,
        task_id,
        task_text,
        split,
        trial,
        seed,
        counts,
        policy,
        scene,
        specification_frames,
    } = message;
    let unknown = |field, word: &str| MessageProblem::UnknownWord { field, word: word.to_owned() };
    let provenance = Provenance {
        index,
        family: family.parse().map_err(|_error| unknown("family", &family))?,
        task_id,
        task_text,
        split: split.parse().map_err(|_error| unknown("split", &split))?,
        trial,
        seed,
        counts: counts.into_iter().map(|count| narrow("count", count)).collect::<Result<_, _>>()?,
        actor: policy.map_or(Actor::Expert, Actor::Policy),
    };
    let scene = decode_scene(scene.ok_or(MessageProblem::Missing { field: "scene" })?)?;
    Ok(Start { provenance, scene, specification_frames })
}

fn decode_scene(scene: proto::Scene) -> Result<Scene, MessageProblem> {
    let proto::Scene { bodies, slots, table_half_x_m, table_half_y_m } = scene;
    narrow::<u16>("number of bodies", bodies.len() as u32)?;
    narrow::<u16>("number of slots", slots.len() as u32)?;
    let slot = |proto::Slot { name, bodies }| {
        let bodies = bodies.into_iter().map(|body| narrow("body of a slot", body).map(BodyIndex));
        Ok(Slot { name, bodies: bodies.collect::<Result<_, MessageProblem>>()? })
    };
    Ok(Scene {
        bodies: bodies.into_iter().map(decode_body).collect::<Result<_, _>>()?,
        slots: slots.into_iter().map(slot).collect::<Result<_, MessageProblem>>()?,
        table_half_m: [table_half_x_m, table_half_y_m],
    })
}

fn decode_body(body: proto::Body) -> Result<Body, MessageProblem> {
    let mobility = match body.mobility() {
        body::Mobility::Unspecified => return Err(MessageProblem::Missing { field: "mobility of a body" }),
        body::Mobility::Movable => Mobility::Movable,
        body::Mobility::Fixed => Mobility::Fixed,
    };
    let proto::Body { name, shape, mobility: _, color_rgb } = body;
    let shape = shape.ok_or(MessageProblem::Missing { field: "shape of a body" })?;
    let [above, red, green, blue] = color_rgb.to_be_bytes();
    if above != 0 {
        return Err(MessageProblem::OutOfRange { field: "color_rgb", found: u64::from(color_rgb) });
    }
    Ok(Body { name, shape: decode_shape(&shape), mobility, color: [red, green, blue] })
}

fn decode_shape(shape: &body::Shape) -> Shape {
    match *shape {
        body::Shape::Cuboid(proto::Cuboid { half_x_m, half_y_m, half_z_m }) => {
            Shape::Cuboid { half_extents_m: [half_x_m, half_y_m, half_z_m] }
        }
        body::Shape::Cylinder(proto::Cylinder { radius_m, half_height_m }) => {
            Shape::Cylinder { radius_m, half_height_m }
        }
        body::Shape::Ball(proto::Ball { radius_m }) => Shape::Ball { radius_m },
        body::Shape::OpenBox(proto::OpenBox { inner_half_x_m, inner_half_y_m, inner_height_m, wall_m }) => {
            Shape::OpenBox { inner_m: [inner_half_x_m, inner_half_y_m, inner_height_m], wall_m }
        }
        body::Shape::Bowl(proto::Bowl {
            floor_radius_m,
            rim_radius_m,
            height_m,
            wall_m,
            foot_radius_m,
            foot_height_m,
        }) => Shape::Bowl(Bowl { floor_radius_m, rim_radius_m, height_m, wall_m, foot_radius_m, foot_height_m }),
    }
}

/// A number of the schema in a smaller type.
pub(super) fn narrow<T: TryFrom<u32>>(field: &'static str, number: u32) -> Result<T, MessageProblem> {
    T::try_from(number).map_err(|_error| MessageProblem::OutOfRange { field, found: u64::from(number) })
}
