//! The rows of episodes: in order, without gaps, of tasks that are there; and files that no episode names.

use std::collections::BTreeSet;
use std::path::PathBuf;

use crate::dataset::DatasetError;
use crate::dataset::files::finding::Validation;
use crate::dataset::files::layout;
use crate::dataset::plain::{PlainEpisode, PlainSource, files_below};
use crate::words::counted;

pub(super) fn check(source: &PlainSource, validation: &mut Validation) {
    let mut next = 0;
    for (position, episode) in source.episodes.iter().enumerate() {
        validation.episodes += 1;
        for problem in problems(source, position, episode, next) {
            let path = &source.episode_files[episode.own.0];
            validation.error("episodes.row", path, format!("row {}", episode.own.1), problem);
        }
        next = episode.rows[1];
    }
    if let Err(error) = check_files(source, validation) {
        validation.failed("file.unreadable", &error);
    }
}

pub(super) fn problems(source: &PlainSource, position: usize, episode: &PlainEpisode, next: i64) -> Vec<String> {
    let mut problems = Vec::new();
    if episode.index != position as i64 {
        problems.push(format!("episode_index is {}: readers take rows by position, as {position}", episode.index));
    }
    let [from, to] = episode.rows;
    if from != next || to - from != episode.length as i64 {
        problems.push(format!(
            "dataset_from_index and dataset_to_index are {from} and {to}, but {next} and {} are of length {}",
            next + episode.length as i64,
            episode.length
        ));
    }
    if episode.length == 0 {
        problems.push("it has no frame".to_owned());
    }
    let unknown = episode.tasks.iter().find(|task| source.tasks.number(task).is_none());
    problems.extend(
        unknown.map(|task| format!("its task {task:?} is none of the {}", counted(source.tasks.rows.len(), "task"))),
    );
    problems
}

/// Files of frames and the episodes that name them; files of videos likewise.
fn check_files(source: &PlainSource, validation: &mut Validation) -> Result<(), DatasetError> {
    let info = &source.info;
    let (data, videos) = (info.root().join(layout::DATA), info.root().join(layout::VIDEOS));
    let named: BTreeSet<PathBuf> =
        source.episodes.iter().filter_map(|episode| Some(info.data_file(episode.data?))).collect();
    let readers_take =
        if info.version.is_by_episode() { files_below(&data, "parquet")? } else { source.data_files.clone() };
    for path in readers_take.iter().filter(|path| !named.is_empty() && !named.contains(*path)) {
        let message = "no episode is in this file, but readers that take all files of the folder would read it";
        validation.error("file.unlisted", path, String::new(), message.to_owned());
    }
    let shown: BTreeSet<PathBuf> = source
        .episodes
        .iter()
        .flat_map(|episode| {
            let spans = info.videos().zip(&episode.videos);
            spans
                .filter_map(|(video, span)| Some(info.video_file(&video.name, span.as_ref()?.file)))
                .collect::<Vec<_>>()
        })
        .collect();
    for path in files_below(&videos, "mp4")?.iter().filter(|path| !shown.contains(*path)) {
        let message = "no episode has pictures in this file: nobody will see them";
        validation.warn("file.unlisted", path, String::new(), message.to_owned());
    }
    if !info.version.is_by_episode() {
        check_places(source, validation);
    }
    Ok(())
}

/// Whether each episode names the file that its rows are in: readers go by rows, downloads go by names.
fn check_places(source: &PlainSource, validation: &mut Validation) {
    for episode in &source.episodes {
        let (Some(data), Some(found)) = (episode.data, source.file_of_row(episode.rows[0])) else { continue };
        let named = source.info.data_file(data);
        if *found != named {
            let path = &source.episode_files[episode.own.0];
            let (found, named) = (found.display(), named.display());
            let message = format!("its frames are in {found}, but data/chunk_index and data/file_index name {named}");
            validation.error("episodes.row", path, format!("row {}", episode.own.1), message);
            // Those behind it are likely to be off by the same.
            return;
        }
    }
}
