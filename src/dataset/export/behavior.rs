//! BEHAVIOR-1K's annotations: a file for each episode, skills and primitives with the frames that they take.

use std::path::Path;

use serde::Serialize;

use crate::artifact::write_json;
use crate::dataset::edit::EditError;
use crate::dataset::export::ExportSummary;
use crate::dataset::export::labels::{Label, LabelReader, LabelledCalls, LabelledEpisode};
use crate::dataset::files::annotation;

#[derive(Serialize)]
struct Annotation {
    task_name: String,
    data_folder: String,
    meta_data: MetaData,
    skill_annotation: Vec<Skill>,
    primitive_annotation: Vec<Primitive>,
}

#[derive(Serialize)]
struct MetaData {
    task_duration: i64,
    valid_duration: [i64; 2],
}

#[derive(Serialize)]
struct Skill {
    skill_idx: usize,
    skill_id: [usize; 1],
    skill_description: [String; 1],
    skill_type: [&'static str; 1],
    object_id: [Vec<String>; 1],
    manipulating_object_id: Vec<String>,
    memory_prefix: [String; 0],
    spatial_prefix: [String; 0],
    frame_duration: [u32; 2],
}

#[derive(Serialize)]
struct Primitive {
    primitive_idx: usize,
    primitive_id: [usize; 1],
    primitive_description: [String; 1],
    primitive_type: [&'static str; 1],
    object_id: [Vec<String>; 1],
    manipulating_object_id: Vec<String>,
    memory_prefix: [String; 0],
    spatial_prefix: [String; 0],
    /// Of the skills that it is a part of.
    skill_idxes: Vec<usize>,
    frame_duration: [u32; 2],
}

/// Writes `annotations/task-XXXX/episode_XXXXXXXX.json`.
pub(super) fn write(root: &Path, to: &Path) -> Result<ExportSummary, EditError> {
    let mut summary = ExportSummary::default();
    for episode in LabelReader::open(root)?.1 {
        let episode = episode?;
        let labels = of_episode(&episode);
        summary.episodes += 1;
        summary.labels += (labels.skill_annotation.len() + labels.primitive_annotation.len()) as u64;
        let file = format!("task-{:04}/episode_{:08}.json", episode.task_index, episode.row.episode_index);
        write_json(&to.join("annotations").join(file), &labels)?;
    }
    annotation::copy(root, to)?;
    Ok(summary)
}

fn of_episode(episode: &LabelledEpisode) -> Annotation {
    let (skills, n_frames) = (episode.skills(), episode.row.n_frames);
    let primitives = episode.primitives();
    Annotation {
        task_name: episode.row.task_text.clone(),
        data_folder: String::new(),
        meta_data: MetaData { task_duration: n_frames, valid_duration: [0, n_frames] },
        skill_annotation: skills.iter().enumerate().map(|(at, label)| skill(episode, at, label)).collect(),
        primitive_annotation: primitives
            .iter()
            .enumerate()
            .map(|(at, label)| primitive(episode, at, label, &skills))
            .collect(),
    }
}

fn skill(episode: &LabelledEpisode, at: usize, label: &Label) -> Skill {
    let objects = objects(episode, label.call);
    Skill {
        skill_idx: at,
        skill_id: [program_id(episode, label)],
        skill_description: [label.text.clone()],
        skill_type: ["uncoordinated"],
        manipulating_object_id: objects.clone(),
        object_id: [objects],
        memory_prefix: [],
        spatial_prefix: [],
        frame_duration: [label.begin, label.end],
    }
}

fn primitive(episode: &LabelledEpisode, at: usize, label: &Label, skills: &[Label]) -> Primitive {
    let caller = episode.caller(label.call);
    let objects = objects(episode, label.call);
    Primitive {
        primitive_idx: at,
        primitive_id: [program_id(episode, label)],
        primitive_description: [label.text.clone()],
        primitive_type: ["uncoordinated"],
        manipulating_object_id: objects.clone(),
        object_id: [objects],
        memory_prefix: [],
        spatial_prefix: [],
        skill_idxes: (0..skills.len()).filter(|&skill| Some(skills[skill].call) == caller).collect(),
        frame_duration: [label.begin, label.end],
    }
}

/// The program's number; of annotated ones, that of the first call of the episode with the same text.
fn program_id(episode: &LabelledEpisode, label: &Label) -> usize {
    match &episode.calls {
        LabelledCalls::Own(calls) => calls[label.call].program.index(),
        LabelledCalls::Annotated(calls) => {
            calls.iter().position(|call| call.program == label.text).unwrap_or(label.call)
        }
    }
}

/// The slots that a call and those below it move to, in order of first use.
fn objects(episode: &LabelledEpisode, position: usize) -> Vec<String> {
    let LabelledCalls::Own(calls) = &episode.calls else { return Vec::new() };
    let below = calls[position + 1..].iter().take_while(|call| call.depth > calls[position].depth);
    let mut objects: Vec<String> = Vec::new();
    for slot in calls[position..=position].iter().chain(below).filter_map(|call| call.argument) {
        let name = episode.slot(usize::from(slot.0)).to_owned();
        if !objects.contains(&name) {
            objects.push(name);
        }
    }
    objects
}
