//! The column `subtask_index`: each run of frames of one number is a label. A negative number is none.

use crate::dataset::DatasetError;
use crate::dataset::plain::arrays::whole_numbers;
use crate::dataset::plain::labels::LabelSpan;
use crate::dataset::plain::rows::RowCursor;
use crate::dataset::plain::source::PlainSource;
use crate::table::TextTable;
use crate::words::counted;

/// One past the greatest number of a sub-task without a text.
const MAX_NUMBER: i64 = 1 << 20;

pub(super) struct SubtaskLabels {
    rows: RowCursor,
}

impl SubtaskLabels {
    pub(super) fn new() -> Self {
        Self { rows: RowCursor::of_columns(|name| name == "subtask_index") }
    }

    pub(super) fn of_episode(
        &mut self,
        source: &PlainSource,
        position: usize,
        texts: &mut TextTable,
    ) -> Result<Vec<LabelSpan>, DatasetError> {
        let episode = &source.episodes[position];
        let (path, first) = source.rows_of(episode)?;
        let mut spans: Vec<LabelSpan> = Vec::new();
        // The number and the text of the last label.
        let mut last: Option<(i64, u32)> = None;
        let mut frame = 0;
        self.rows.each(&path, first, episode.length as usize, |rows| {
            let wrong = |problem: String| DatasetError::Count { path: path.clone(), problem };
            let numbers = whole_numbers(&rows, "subtask_index");
            let numbers = numbers.ok_or_else(|| wrong("it has no column subtask_index of whole numbers".to_owned()))?;
            for number in numbers {
                let text = match last.filter(|(known, _)| *known == number) {
                    Some((_, text)) => Some(text),
                    None => text_of(source, number, texts).map_err(wrong)?,
                };
                match (text, spans.last_mut()) {
                    (Some(text), Some(span))
                        if span.text == text && span.frames[1] == frame && last == Some((number, text)) =>
                    {
                        span.frames[1] = frame + 1;
                    }
                    (Some(text), _) => spans.push(LabelSpan { level: 1, text, frames: [frame, frame + 1] }),
                    (None, _) => {}
                }
                last = text.map(|text| (number, text));
                frame += 1;
            }
            Ok::<_, DatasetError>(())
        })?;
        Ok(spans)
    }
}

/// The text of a number, or `subtask 3` where there are no texts; `None` for none.
fn text_of(source: &PlainSource, number: i64, texts: &mut TextTable) -> Result<Option<u32>, String> {
    if number < 0 {
        return Ok(None);
    }
    match &source.subtasks {
        // The numbers before it have texts too, so that each stands at its number.
        None if number < MAX_NUMBER => {
            (texts.texts().len() as i64..=number).for_each(|number| {
                texts.key(&format!("subtask {number}"));
            });
            Ok(Some(number as u32))
        }
        None => Err(format!("subtask_index is {number}, which is none of fewer than {MAX_NUMBER} sub-tasks")),
        Some(known) => match known.get(number) {
            Some(text) => Ok(Some(texts.key(text))),
            None => Err(format!("subtask_index is {number}, but there are {}", counted(known.rows.len(), "sub-task"))),
        },
    }
}
