//! SARM's columns of `meta/episodes`: names and first and last frames of sparse and of dense sub-tasks.

use crate::dataset::DatasetError;
use crate::dataset::plain::arrays::{list_at, numbers_of, texts_of};
use crate::dataset::plain::labels::LabelSpan;
use crate::dataset::plain::rows::RowCursor;
use crate::dataset::plain::source::PlainSource;
use crate::table::TextTable;
use crate::words::counted;

const LEVELS: [(&str, u8); 2] = [("sparse", 1), ("dense", 2)];

pub(super) struct SarmLabels {
    rows: RowCursor,
}

impl SarmLabels {
    pub(super) fn new() -> Self {
        Self { rows: RowCursor::of_columns(|name| name.contains("_subtask_")) }
    }

    pub(super) fn of_episode(
        &mut self,
        source: &PlainSource,
        position: usize,
        texts: &mut TextTable,
    ) -> Result<Vec<LabelSpan>, DatasetError> {
        let episode = &source.episodes[position];
        let path = &source.episode_files[episode.own.0];
        let mut spans = Vec::new();
        self.rows.each(path, episode.own.1, 1, |row| {
            for (name, level) in LEVELS {
                let list = |of: &str| list_at(row.column_by_name(&format!("{name}_subtask_{of}"))?, 0);
                let Some(names) = list("names").as_ref().and_then(texts_of) else { continue };
                let frames = [list("start_frames"), list("end_frames")].map(|of| of.as_ref().and_then(numbers_of));
                let times = [list("start_times"), list("end_times")].map(|of| of.as_ref().and_then(numbers_of));
                let ends = ends(frames, times, source.info.fps).filter(|ends| ends.len() == names.len());
                let ends = ends.ok_or_else(|| DatasetError::Row {
                    path: path.clone(),
                    row: episode.own.1 as u64,
                    problem: format!(
                        "{name} sub-tasks have {}, but other numbers of frames or times",
                        counted(names.len(), "name")
                    ),
                })?;
                let of_level = names.iter().zip(ends);
                spans.extend(of_level.map(|(text, frames)| LabelSpan { level, text: texts.key(text), frames }));
            }
            Ok::<_, DatasetError>(())
        })?;
        Ok(spans)
    }
}

/// Begins and ends, half-open; ends are included in the columns. Where there are no frames, times tell them.
fn ends(frames: [Option<Vec<f64>>; 2], times: [Option<Vec<f64>>; 2], fps: f64) -> Option<Vec<[u32; 2]>> {
    let [begins, lasts] = match (frames, times) {
        ([Some(begins), Some(lasts)], _) => [begins, lasts],
        (_, [Some(begins), Some(lasts)]) => {
            [begins, lasts].map(|times| times.into_iter().map(|secs| (secs * fps).round()).collect())
        }
        _ => return None,
    };
    let pair = |(begin, last): (&f64, &f64)| [begin.max(0.0) as u32, (last.max(-1.0) + 1.0) as u32];
    (begins.len() == lasts.len()).then(|| begins.iter().zip(&lasts).map(pair).collect())
}
