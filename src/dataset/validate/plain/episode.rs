//! One episode by itself: its row, its frames, its pictures.

use crate::dataset::files::finding::{Severity, Validation};
use crate::dataset::plain::PlainSource;
use crate::dataset::validate::plain::frames::Walk;
use crate::dataset::validate::plain::{episodes, videos};
use crate::table::BatchReader;
use crate::words::counted;

/// What is wrong with an episode, judged by itself; what was wrong with those before says nothing of it.
pub(crate) fn episode_problem(source: &PlainSource, position: usize) -> Option<String> {
    let mut validation = Validation::default();
    let episode = source.episodes.get(position)?;
    let next = position.checked_sub(1).map_or(0, |before| source.episodes[before].rows[1]);
    if let Some(problem) = episodes::problems(source, position, episode, next).into_iter().next() {
        let path = &source.episode_files[episode.own.0];
        return Some(format!("episodes.row {}: row {}: {problem}", path.display(), episode.own.1));
    }
    let (path, first) = match source.rows_of(episode) {
        Ok(place) => place,
        Err(error) => return Some(error.to_string()),
    };
    let mut walk = Walk::from(source, position);
    let end = first.saturating_add(usize::try_from(episode.length).unwrap_or(usize::MAX));
    let read = BatchReader::open_rows(&path, first..end).and_then(|mut reader| {
        let mut row = first as u64;
        while let Some(batch) = reader.next_batch()? {
            walk.batch(&path, row, &batch, &mut validation);
            row += batch.num_rows() as u64;
        }
        Ok(row - first as u64)
    });
    match read {
        Ok(n_rows) if n_rows == episode.length => {}
        Ok(n_rows) => {
            return Some(format!(
                "{}: it ends after {n_rows} of episode {position}",
                path.display(),
                n_rows = counted(n_rows, "frame")
            ));
        }
        Err(error) => return Some(error.to_string()),
    }
    videos::check_episode(source, episode, &mut validation);
    let found = validation.findings.iter().find(|finding| finding.severity == Severity::Error)?;
    Some(format!("{} {}: {} {}", found.code, found.path.display(), found.place, found.message))
}
