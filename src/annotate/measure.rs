//! How well labels agree with true ones.
//!
//! Frames are told apart on three levels: the root's callees (`sub_task`), the calls that call primitives (`skill`) and
//! the primitives. Each frame has one label a level, or none; a boundary is a frame at which another call begins or
//! ends than before.
//!
//! # Source
//!
//! The usual measures of temporal segmentation: per-frame accuracy, intersection over union, F1 of boundaries within a
//! tolerance (each true boundary is found once at most), and the edit score of the sequence of labels.

mod boundaries;
mod edit;
mod level;

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::annotate::AnnotateError;
use crate::dataset::{LabelledEpisode, LabelledEpisodes, check_has_programs};
use crate::program::Program;
use crate::scene::SlotIndex;
use crate::trace::{ProgramCall, Span};
use crate::words::counted;
use level::Tally;

/// The levels.
pub(super) const LEVELS: [&str; 3] = ["sub_task", "skill", "primitive"];
/// How far a boundary may be from a true one, in seconds.
pub(super) const TOLERANCES_SECS: [f64; 3] = [0.1, 0.5, 1.0];

/// How well the labels of a dataset agree with true ones.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Measured {
    /// The folder of the true labels.
    pub truth: String,
    /// Episodes compared.
    pub episodes: u64,
    /// Episodes whose calls are all right: programs, arguments and frames.
    pub episodes_exact: u64,
    /// Frames compared.
    pub frames: u64,
    /// True calls.
    pub calls: u64,
    /// Calls that there are.
    pub calls_found: u64,
    /// True calls of which there is one with the same program, depth and frames.
    pub calls_with_span: u64,
    /// The same with the same argument, or the same as the slots that are moved to below it.
    pub calls_with_argument: u64,
    /// By level.
    pub levels: BTreeMap<String, LevelMeasured>,
}

/// How well the labels of a level agree with true ones.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct LevelMeasured {
    /// Share of frames with the right label.
    pub frame_accuracy: f64,
    /// Intersection over union of the frames of a label, over the labels of each episode.
    pub iou: f64,
    /// F1 of boundaries, by the tolerance in seconds.
    pub boundary_f1: BTreeMap<String, f64>,
    /// One minus the edit distance between the sequences of labels, divided by the length of the longer one; over
    /// episodes.
    pub edit_score: f64,
}

impl Measured {
    /// Share of true calls with the right program and frames.
    pub fn call_accuracy(&self) -> f64 {
        self.calls_with_span as f64 / self.calls.max(1) as f64
    }
}

/// Holds the labels of a dataset against those of another of the same episodes.
///
/// # Errors
///
/// When one of them cannot be read, or they are not of the same episodes and frames.
pub fn measure(truth: &Path, labelled: &Path) -> Result<Measured, AnnotateError> {
    let name = truth.canonicalize().unwrap_or_else(|_gone| truth.to_owned());
    let name = name.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let (mut all, mut levels) = (Measured::of(name), LEVELS.map(|_| Tally::default()));
    check_has_programs(truth)?;
    let differ = |problem: String| AnnotateError::Truth { path: truth.to_owned(), problem };
    let (mut right, mut found) = (LabelledEpisodes::open(truth)?, LabelledEpisodes::open(labelled)?);
    loop {
        let pair = (right.next().transpose()?, found.next().transpose()?);
        if let (Some(right), Some(found)) = &pair
            && right.recording().zip(found.recording()).is_some_and(|(there, here)| there != here)
        {
            let episode = all.episodes;
            return Err(differ(format!(
                "episode {episode} is of another recording than there; they are compared in order"
            )));
        }
        let (right, found) = match pair {
            (None, None) => break,
            (Some(right), Some(found)) if right.n_frames() == found.n_frames() => (right, found),
            (right, found) => {
                let frames = |of: &Option<LabelledEpisode>| of.as_ref().map_or(0, LabelledEpisode::n_frames);
                let (episode, of) = (all.episodes, frames(&right));
                let problem =
                    format!("episode {episode} has {of} here, but {} there", frames(&found), of = counted(of, "frame"));
                return Err(differ(problem));
            }
        };
        all.add(&right, &found);
        let pairs = right.levels().into_iter().zip(found.levels());
        for (tally, (right_labels, found_labels)) in levels.iter_mut().zip(pairs) {
            tally.add(&right_labels, &found_labels, right.times_secs());
        }
    }
    let named = LEVELS.iter().zip(levels).map(|(name, tally)| ((*name).to_owned(), tally.finish()));
    all.levels = named.collect();
    Ok(all)
}

/// A call without its place in the tree: depth, program, frames, and the slots that it is about.
type CallKey = (u8, Program, Span, Vec<SlotIndex>);

impl Measured {
    fn of(truth: String) -> Self {
        Self {
            truth,
            episodes: 0,
            episodes_exact: 0,
            frames: 0,
            calls: 0,
            calls_found: 0,
            calls_with_span: 0,
            calls_with_argument: 0,
            levels: BTreeMap::new(),
        }
    }

    fn add(&mut self, right: &LabelledEpisode, found: &LabelledEpisode) {
        let (right_calls, mut left) = (keys(right.calls()), keys(found.calls()));
        let n_found = left.len();
        let mut n_exact = 0;
        let mut without = left.clone();
        for (depth, program, span, slots) in &right_calls {
            let exact = left.iter().position(|of| (of.0, of.1, of.2, &of.3) == (*depth, *program, *span, slots));
            if let Some(at) = exact {
                left.swap_remove(at);
                n_exact += 1;
            }
            let spanned = without.iter().position(|of| (of.0, of.1, of.2) == (*depth, *program, *span));
            if let Some(at) = spanned {
                without.swap_remove(at);
                self.calls_with_span += 1;
            }
        }
        self.episodes += 1;
        self.frames += u64::from(right.n_frames());
        self.calls += right_calls.len() as u64;
        self.calls_found += n_found as u64;
        self.calls_with_argument += n_exact;
        self.episodes_exact += u64::from(n_exact as usize == right_calls.len().max(n_found));
    }
}

fn keys(calls: &[ProgramCall]) -> Vec<CallKey> {
    let key = |(position, call): (usize, &ProgramCall)| {
        let below = calls[position + 1..].iter().take_while(|other| other.depth > call.depth);
        let slots = calls[position..=position].iter().chain(below).filter_map(|call| call.argument);
        // The root is about everything, which its callees tell.
        let slots = if call.depth == 0 { Vec::new() } else { slots.collect() };
        (call.depth, call.program, call.frames, slots)
    };
    calls.iter().enumerate().map(key).collect()
}
