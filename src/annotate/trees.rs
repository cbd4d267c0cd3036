//! The trees of a dataset's episodes, made as they are asked for.

use std::collections::VecDeque;
use std::path::Path;

use crate::annotate::{
    AnnotateConfig, AnnotateError, Annotation, Doubt, Doubtful, KeyFrame, KeyFrames, Model, Parsed, key_frames, parse,
};
use crate::dataset::{EpisodeTree, ObservedEpisode, ObservedEpisodes, RelabelSummary};
use crate::program::Program;
use crate::task::Family;
use crate::trace::{Observation, ObservationRows, ProgramCall, Span};

/// Episodes that are taken apart side by side.
const SIDE_BY_SIDE: usize = 64;

/// Gives the tree of each episode in order.
pub(super) struct Trees<'a> {
    episodes: ObservedEpisodes,
    models: &'a mut [Model],
    /// Which of them fit the dataset.
    fitting: Vec<usize>,
    config: &'a AnnotateConfig,
    finds_key_frames: bool,
    ready: VecDeque<EpisodeTree>,
    doubtful: Vec<Doubtful>,
}

impl<'a> Trees<'a> {
    /// Begins with the first episode.
    pub(super) fn new(
        root: &Path,
        episodes: ObservedEpisodes,
        models: &'a mut [Model],
        config: &'a AnnotateConfig,
    ) -> Result<Self, AnnotateError> {
        let slots = episodes.slots();
        let of_size = |model: &Model| model.n_slots == slots.len();
        let is_known = models.iter().any(|model| of_size(model) && model.knows(slots));
        let fits = |model: &Model| of_size(model) && (!is_known || model.knows(slots));
        let fitting: Vec<usize> = (0..models.len()).filter(|&at| fits(&models[at])).collect();
        if fitting.is_empty() {
            let models = models.iter().map(|of| format!("model {} knows {}", of.about.name, of.n_slots));
            return Err(AnnotateError::NoModel {
                path: root.to_owned(),
                n_slots: slots.len(),
                slots: slots.join(", "),
                models: models.collect::<Vec<_>>().join(", "),
            });
        }
        let finds_key_frames = match config.key_frames {
            KeyFrames::Auto => !episodes.has_boundaries_alone(),
            KeyFrames::Rows => false,
            KeyFrames::Found => true,
        };
        let (ready, doubtful) = (VecDeque::new(), Vec::new());
        Ok(Self { episodes, models, fitting, config, finds_key_frames, ready, doubtful })
    }

    /// What is told of all of them.
    pub(super) fn finish(self, summary: RelabelSummary) -> Annotation {
        Annotation {
            models: self.models.iter().map(|model| model.about.clone()).collect(),
            date: self.config.date.clone(),
            key_frames: if self.finds_key_frames { "found" } else { "rows" },
            summary,
            doubt_below: self.config.doubt_below,
            doubtful: self.doubtful,
            measured: None,
        }
    }

    /// Takes the next episodes apart.
    fn read_on(&mut self) -> Result<(), AnnotateError> {
        let episodes: Vec<ObservedEpisode> = self.episodes.by_ref().take(SIDE_BY_SIDE).collect::<Result<_, _>>()?;
        let keys: Vec<Vec<KeyFrame>> = episodes.iter().map(|episode| self.key_frames(episode)).collect();
        let rows: Vec<ObservationRows> =
            episodes.iter().zip(&keys).map(|(episode, keys)| rows_of(&episode.observations, keys)).collect();
        let mut by_model: Vec<(usize, std::vec::IntoIter<Parsed>)> = Vec::new();
        for &at in &self.fitting {
            let model = &mut self.models[at];
            let root = model.family().root_program();
            by_model.push((at, parse(model.policy.as_mut(), root, &rows)?.into_iter()));
        }
        for (episode, keys) in episodes.iter().zip(&keys) {
            let parsed = by_model.iter_mut().filter_map(|(at, parsed)| Some((*at, parsed.next()?))).collect();
            if let Some((at, parsed)) = self.likeliest(parsed) {
                let tree = self.tree(episode, keys, at, parsed);
                self.ready.push_back(tree);
            }
        }
        Ok(())
    }

    fn key_frames(&self, episode: &ObservedEpisode) -> Vec<KeyFrame> {
        if self.finds_key_frames {
            return key_frames(episode);
        }
        let rows = episode.observations.iter().enumerate();
        rows.map(|(frame, row)| KeyFrame::at(frame, !row.is_open())).collect()
    }

    /// The surest of what models say of an episode; where another says something else, that is a doubt.
    fn likeliest(&self, parsed: Vec<(usize, Parsed)>) -> Option<(usize, Parsed)> {
        let mut all = parsed.into_iter();
        let first = all.next()?;
        let mut others = Vec::new();
        let best = all.fold(first, |best, next| {
            let (better, worse) = if sureness(&next.1) > sureness(&best.1) { (next, best) } else { (best, next) };
            others.push(worse);
            better
        });
        let (at, mut best) = best;
        let says_else = |(other, parsed): &(usize, Parsed)| {
            let is_same = parsed.calls == best.calls || self.models[*other].family() != self.models[at].family();
            (!is_same).then(|| Doubt::Disagreement { model: self.models[*other].about.name.clone() })
        };
        let disagreements: Vec<Doubt> = others.iter().filter_map(says_else).collect();
        best.doubts.extend(disagreements);
        Some((at, best))
    }

    /// The tree, its spans counted in the episode's frames.
    fn tree(&mut self, episode: &ObservedEpisode, keys: &[KeyFrame], at: usize, parsed: Parsed) -> EpisodeTree {
        let Parsed { calls, confidences, mut doubts } = parsed;
        let below = self.config.doubt_below;
        let unsure = calls.iter().zip(&confidences).skip(1).filter(|(_, confidence)| **confidence < below);
        doubts.extend(unsure.map(|(call, &confidence)| {
            let (call, program) = (call.id.0, call.program);
            Doubt::Unsure { call, program, confidence }
        }));
        if !doubts.is_empty() {
            let confidence = confidences.first().copied().unwrap_or(0.0);
            self.doubtful.push(Doubtful { episode: episode.episode_index, confidence, doubts });
        }
        let n_frames = episode.n_frames() as u32;
        let calls = in_frames(calls, keys, n_frames);
        let family = self.note(at);
        let task_text = episode.task_text.clone();
        EpisodeTree { family, task_text, calls, confidences, boundaries: keys.iter().map(|key| key.frame).collect() }
    }

    fn note(&mut self, at: usize) -> Family {
        let model = &mut self.models[at];
        model.about.episodes += 1;
        model.family()
    }
}

impl Iterator for Trees<'_> {
    type Item = Result<EpisodeTree, AnnotateError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.ready.is_empty()
            && let Err(error) = self.read_on()
        {
            return Some(Err(error));
        }
        self.ready.pop_front().map(Ok)
    }
}

/// How sure all calls of an episode are together, less for each doubt.
fn sureness(parsed: &Parsed) -> f32 {
    let logs = parsed.confidences.iter().skip(1).map(|confidence| confidence.max(1e-6).ln());
    let n = parsed.confidences.len().saturating_sub(1).max(1) as f32;
    logs.sum::<f32>() / n - parsed.doubts.len() as f32
}

/// The observations of key frames.
fn rows_of(all: &ObservationRows, keys: &[KeyFrame]) -> ObservationRows {
    let observation = |key: &KeyFrame| {
        let row = all.get(key.shown as usize)?;
        let shifted = |at: &[f32; 3]| [0, 1, 2].map(|axis| at[axis] + key.shift_m[axis]);
        Some(Observation { slots_m: row.positions.iter().map(shifted).collect(), closed: key.closed })
    };
    let observations: Vec<Observation> = keys.iter().filter_map(observation).collect();
    ObservationRows::of(all.n_slots(), &observations)
}

/// Calls whose spans count key frames, with spans that count all frames. The root has all of them, and its end is at
/// the last.
fn in_frames(mut calls: Vec<ProgramCall>, keys: &[KeyFrame], n_frames: u32) -> Vec<ProgramCall> {
    let frame = |key: u32| keys.get(key as usize).map_or(0, |key| key.frame);
    let last = n_frames.saturating_sub(1);
    for position in 0..calls.len() {
        let call = &calls[position];
        let is_end_of_root = call.depth == 1 && call.program == Program::None;
        let frames = match position {
            0 => Span { begin: 0, end: n_frames },
            _ if is_end_of_root => Span { begin: last, end: n_frames },
            _ => Span { begin: frame(call.frames.begin), end: frame(call.frames.last()) + 1 },
        };
        let caller = call.caller.map_or(position, |caller| caller.0 as usize);
        calls[position].frames = frames;
        calls[position].input = calls[caller].frames;
        calls[position].output = (calls[position].program != Program::None).then_some(frames);
    }
    calls
}
