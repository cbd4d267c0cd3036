//! Episodes into Rerun: scene, running programs, scopes and probabilities over time.
//!
//! # Input and output
//!
//! [`Episode`]s, each with the demonstration it was given where one is at hand, become one Rerun recording each, in an
//! `.rrd` file or in a spawned viewer, together with a blueprint that lays them out. Rerun is used here alone, and
//! what is shown is read from the episode, never from physics.
//!
//! # Entities
//!
//! ```text
//! world/{table, bodies/<name>, gripper/{palm, fingers}, target}   the scene
//! world/adversary, adversary        pushes of an adversary, where there are any: an arrow and a lane
//! camera/{front, wrist}             what cameras see
//! filmed/<camera>                   what the recording's own cameras saw, the first of them what a policy that sees saw
//! programs/depth_<n>                the stack of running programs, a lane a depth
//! programs_of_expert/depth_<n>      the same of the demonstration, beside a rollout
//! agreement                         whether a rollout's decisions are the expert's, until the first that is not
//! specification/…                   which part of the specification each running program may see
//! probability/{end_of_program, program}/depth_<n>                 what a learned policy thought
//! observation/<slot>                distance of what each slot shows from the gripper, in metres
//! calls                             every call in words
//! episode                           task, provenance and outcome in words
//! ```
//!
//! Timelines are `sim_time` (the episode's own clock) and `frame` (position among its recorded frames).
//!
//! An episode of a dataset (a [`Playback`]) has `programs`, `calls` and `episode` as well, `camera/<name>` for each of
//! the dataset's cameras, and `numbers/<feature>/<dimension>`; its timelines are `timestamp` and `frame`.
//!
//! # Invariants
//!
//! The same replays give the same bytes: ids come from content, never from a clock.

mod agreement;
mod blueprint;
mod calls;
mod clock;
mod gripper;
mod lanes;
mod layout;
mod palette;
mod pictures;
mod playback;
mod pushes;
mod rrd;
mod series;
mod specification;
mod store;
mod text;
mod viewer;
mod world;

use std::path::{Path, PathBuf};

use rerun::log::ChunkError;

use crate::artifact::IoError;
    pushes::put(&mut store, episode)?;
use crate::render::CameraConfig;
    calls::put(&mut store, replay)?;
    lanes::put(&mut store, "programs", episode)?;
    if let Some(demonstration) = demonstration {
        lanes::put(&mut store, "programs_of_expert", demonstration)?;
        agreement::put(&mut store, episode, divergence)?;
    }
    specification::put(&mut store, episode, specification.as_ref())?;
    series::put(&mut store, episode)?;
    Ok(store)
}

/// The demonstration with boundary frames alone, whose positions are what spans of a specification count.
fn specification_of(episode: &Episode, demonstration: Option<&Episode>) -> Result<Option<Episode>, VisualizeError> {
    let Some(demonstration) = demonstration else {
        return Ok((episode.provenance.actor == Actor::Expert).then(|| episode.clone().boundaries_only()));
    };
    let specification = demonstration.clone().boundaries_only();
    if specification.frames.len() != episode.specification_frames as usize {
        return Err(VisualizeError::ForeignDemonstration {
            episode: episode.provenance.index,
            demonstration: demonstration.provenance.index,
            expected: episode.specification_frames,
            found: specification.frames.len(),
        });
    }
    Ok(Some(specification))
}
