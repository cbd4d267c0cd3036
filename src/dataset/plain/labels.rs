//! Labels of others below the task: which sub-task goes on in which frames, and what goes on within it.
//!
//! # Input and output
//!
//! [`PlainLabels`] reads the labels of one episode after another in one of the forms of [`LabelsForm`]. They come as
//! spans of frames of two levels, nested: those of the second level lie within those of the first, and none of a level
//! shares a frame with another.

mod behavior;
mod language;
mod sarm;
mod subtask;

use crate::dataset::DatasetError;
use crate::dataset::plain::source::PlainSource;
use crate::table::TextTable;
use behavior::BehaviorLabels;
use language::LanguageLabels;
use sarm::SarmLabels;
use subtask::SubtaskLabels;

/// How labels are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LabelsForm {
    /// The column `subtask_index`, with texts in `meta/subtasks.parquet` or without.
    SubtaskIndex,
    /// `LeRobot`'s column `language_persistent`: its styles `subtask` and `motion`.
    Language,
    /// SARM's columns in `meta/episodes`, sparse and dense.
    Sarm,
    /// BEHAVIOR-1K's annotation files: skills and primitives.
    Behavior,
}

impl LabelsForm {
    const ALL: [Self; 4] = [Self::Language, Self::SubtaskIndex, Self::Sarm, Self::Behavior];

    /// Its name, as the command line has it.
    pub fn name(self) -> &'static str {
        match self {
            Self::SubtaskIndex => "subtask_index",
            Self::Language => "language",
            Self::Sarm => "sarm",
            Self::Behavior => "behavior",
        }
    }

    /// The form of a dataset's labels; of several, the first of language, `subtask_index`, sarm, behavior.
    pub(crate) fn of(source: &PlainSource) -> Option<Self> {
        let forms = source.label_forms();
        Self::ALL.into_iter().find(|form| forms.contains(&form.name()))
    }
}

impl std::str::FromStr for LabelsForm {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|form| form.name() == word).ok_or_else(|| {
            let names: Vec<&str> = Self::ALL.iter().map(|form| form.name()).collect();
            format!("unknown form {word:?}; allowed: {}", names.join(", "))
        })
    }
}

/// A label and the frames that have it, half-open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct LabelSpan {
    /// 1, or 2 within one of level 1.
    pub(crate) level: u8,
    /// Number of its text.
    pub(crate) text: u32,
    pub(crate) frames: [u32; 2],
}

/// Labels of one episode after another.
pub(crate) struct PlainLabels {
    texts: TextTable,
    form: Form,
    /// Labels that shared frames with others, or lay behind the end: they were cut.
    pub(crate) n_cut: u64,
}

enum Form {
    Subtask(SubtaskLabels),
    Language(LanguageLabels),
    Sarm(SarmLabels),
    Behavior(BehaviorLabels),
}

impl PlainLabels {
    pub(crate) fn open(form: LabelsForm) -> Self {
        let form = match form {
            LabelsForm::SubtaskIndex => Form::Subtask(SubtaskLabels::new()),
            LabelsForm::Language => Form::Language(LanguageLabels::new()),
            LabelsForm::Sarm => Form::Sarm(SarmLabels::new()),
            LabelsForm::Behavior => Form::Behavior(BehaviorLabels),
        };
        Self { texts: TextTable::default(), form, n_cut: 0 }
    }

    /// Gives a text the next number, if it has none.
    pub(crate) fn know(&mut self, text: &str) {
        self.texts.key(text);
    }

    /// All texts so far, by their numbers.
    pub(crate) fn texts(&self) -> &[String] {
        self.texts.texts()
    }

    /// The labels of an episode, those of the second level behind that of the first which they lie in.
    pub(crate) fn of_episode(&mut self, source: &PlainSource, position: usize) -> Result<Vec<LabelSpan>, DatasetError> {
        let texts = &mut self.texts;
        let spans = match &mut self.form {
            Form::Subtask(labels) => labels.of_episode(source, position, texts)?,
            Form::Language(labels) => labels.of_episode(source, position, texts)?,
            Form::Sarm(labels) => labels.of_episode(source, position, texts)?,
            Form::Behavior(labels) => labels.of_episode(source, position, texts)?,
        };
        let n_frames = u32::try_from(source.episodes[position].length).unwrap_or(u32::MAX);
        Ok(nested(spans, n_frames, &mut self.n_cut))
    }
}

/// Spans in order, without frames in common, the second level within the first. A span of the second level that lies in
/// none of the first is one of the first.
fn nested(spans: Vec<LabelSpan>, n_frames: u32, n_cut: &mut u64) -> Vec<LabelSpan> {
    let [outer, inner] = [1, 2].map(|level| {
        let of_level = spans.iter().filter(|span| span.level == level).copied().collect();
        apart(of_level, n_frames, n_cut)
    });
    if outer.is_empty() {
        return inner.into_iter().map(|span| LabelSpan { level: 1, ..span }).collect();
    }
    let mut all = Vec::new();
    let mut at = 0;
    for outer in outer {
        all.push(outer);
        while let Some(span) = inner.get(at) {
            let [begin, end] = [span.frames[0].max(outer.frames[0]), span.frames[1].min(outer.frames[1])];
            if span.frames[0] >= outer.frames[1] {
                break;
            }
            if begin < end {
                *n_cut += u64::from([begin, end] != span.frames);
                all.push(LabelSpan { frames: [begin, end], ..*span });
            }
            // What goes on behind this one is a part of the next one too.
            if span.frames[1] > outer.frames[1] {
                break;
            }
            at += 1;
        }
    }
    all
}

/// Spans of one level in order: what begins before the one before has ended is cut.
fn apart(mut spans: Vec<LabelSpan>, n_frames: u32, n_cut: &mut u64) -> Vec<LabelSpan> {
    spans.sort_by_key(|span| span.frames);
    let mut until = 0;
    let mut kept = Vec::with_capacity(spans.len());
    for span in spans {
        let frames = [span.frames[0].max(until), span.frames[1].min(n_frames)];
        *n_cut += u64::from(frames != span.frames);
        if frames[0] < frames[1] {
            until = frames[1];
            kept.push(LabelSpan { frames, ..span });
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::{LabelSpan, nested};

    #[test]
    fn second_level_is_cut_where_the_first_ends() {
        let span = |level, text, begin, end| LabelSpan { level, text, frames: [begin, end] };
        let mut n_cut = 0;
        let found = nested(
            vec![span(1, 0, 0, 5), span(1, 1, 4, 99), span(2, 2, 0, 2), span(2, 3, 2, 7), span(2, 4, 8, 9)],
            10,
            &mut n_cut,
        );
        let expected = [
            span(1, 0, 0, 5),
            span(2, 2, 0, 2),
            span(2, 3, 2, 5),
            span(1, 1, 5, 10),
            span(2, 3, 5, 7),
            span(2, 4, 8, 9),
        ];
        assert_eq!(found, expected);
        // The second of level 1 overlaps and is too long; the span across both is in two parts.
        assert_eq!(n_cut, 3);
        let alone = nested(vec![span(2, 7, 1, 3)], 10, &mut n_cut);
        assert_eq!(alone, [span(1, 7, 1, 3)]);
    }
}
