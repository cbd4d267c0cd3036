//! The column `language_persistent`: what begins at a moment holds until something of its style follows.

use arrow::array::{Array as _, AsArray as _, RecordBatch};

use crate::dataset::DatasetError;
use crate::dataset::plain::arrays::{list_at, numbers, texts};
use crate::dataset::plain::labels::LabelSpan;
use crate::dataset::plain::rows::RowCursor;
use crate::dataset::plain::source::PlainSource;
use crate::table::TextTable;

/// Styles that are labels, by level. Plans, memories and rewordings of the task are none.
const LEVELS: [(&str, u8); 2] = [("subtask", 1), ("motion", 2)];

/// How much before its frame a label may begin: floats of four bytes.
const TOLERANCE_FRAMES: f64 = 1e-3;

pub(super) struct LanguageLabels {
    rows: RowCursor,
}

impl LanguageLabels {
    pub(super) fn new() -> Self {
        Self { rows: RowCursor::of_columns(|name| name == "language_persistent") }
    }

    pub(super) fn of_episode(
        &mut self,
        source: &PlainSource,
        position: usize,
        known: &mut TextTable,
    ) -> Result<Vec<LabelSpan>, DatasetError> {
        let episode = &source.episodes[position];
        let (path, first) = source.rows_of(episode)?;
        let mut spans = Vec::new();
        let mut is_first = true;
        let n_frames = u32::try_from(episode.length).unwrap_or(u32::MAX);
        self.rows.each(&path, first, episode.length as usize, |rows| {
            // All frames have the same list.
            if std::mem::replace(&mut is_first, false) {
                let wrong = |problem: &str| DatasetError::Count { path: path.clone(), problem: problem.to_owned() };
                let column = rows.column_by_name("language_persistent");
                let column = column.ok_or_else(|| wrong("it has no column language_persistent"))?;
                let Some(list) = list_at(column, 0).filter(|list| !list.is_empty()) else { return Ok(()) };
                let entries = list.as_struct_opt().ok_or_else(|| wrong("language_persistent has no entries"))?;
                let entries = RecordBatch::from(entries.clone());
                spans = spans_of(&entries, source.info.fps, n_frames, known)
                    .ok_or_else(|| wrong("an entry of language_persistent has no style, content or timestamp"))?;
            }
            Ok::<_, DatasetError>(())
        })?;
        Ok(spans)
    }
}

fn spans_of(entries: &RecordBatch, fps: f64, n_frames: u32, known: &mut TextTable) -> Option<Vec<LabelSpan>> {
    let (styles, contents) = (texts(entries, "style")?, texts(entries, "content")?);
    let times = numbers(entries, "timestamp")?;
    let mut spans = Vec::new();
    for (style, level) in LEVELS {
        let of_style = (0..styles.len()).filter(|&at| styles[at] == style);
        let mut begins: Vec<(u32, usize)> =
            of_style.map(|at| ((times[at] * fps - TOLERANCE_FRAMES).ceil().max(0.0) as u32, at)).collect();
        begins.sort_unstable();
        for (place, &(begin, at)) in begins.iter().enumerate() {
            let end = begins.get(place + 1).map_or(n_frames, |&(next, _)| next);
            if begin < end && !contents[at].is_empty() {
                spans.push(LabelSpan { level, text: known.key(&contents[at]), frames: [begin, end] });
            }
        }
    }
    Some(spans)
}
