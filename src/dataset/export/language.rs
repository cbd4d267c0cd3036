//! Language columns of `LeRobot`: what goes on at each moment, in words.
//!
//! A call that runs a primitive is a `motion`, the call that calls primitives a `subtask`, and what the root has still to
//! call a `plan`, numbered; the root itself is the task. Each row of `language_persistent` holds all rows of its
//! episode, as the format wants it; `language_events` is empty.

use std::path::Path;
use std::sync::Arc;

use arrow::array::new_null_array;
use arrow::array::{Array as _, ArrayRef, Float32Array, ListArray, RecordBatch, StringArray, StructArray, UInt32Array};
use arrow::buffer::OffsetBuffer;
use arrow::compute::take;
use arrow::datatypes::{DataType, Field, Fields};
use arrow::error::ArrowError;

use crate::dataset::edit::EditError;
use crate::dataset::export::ExportSummary;
use crate::dataset::export::labels::{Label, LabelReader, LabelledCalls, LabelledEpisode};
use crate::dataset::export::plain::{copy_files, with_columns, write_frames};
use crate::dataset::files::info::Dtype;
use crate::dataset::files::info::FeatureInfo;
use crate::dataset::files::layout;
use crate::dataset::schema::META_EPISODES;

pub(crate) const PERSISTENT: &str = "language_persistent";
pub(crate) const EVENTS: &str = "language_events";

/// Something that holds from a moment on, until something of its style follows.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Entry {
    pub(crate) timestamp: f32,
    pub(crate) style: &'static str,
    pub(crate) content: String,
}

/// Writes the dataset with both columns.
pub(super) fn write(root: &Path, to: &Path) -> Result<ExportSummary, EditError> {
    let (info, reader) = LabelReader::open(root)?;
    let mut language = Language { reader, fps: info.fps, open: Vec::new(), frames_left: 0, n_entries: 0 };
    let declared = || FeatureInfo { dtype: Dtype::Language, shape: vec![1], names: None, info: None };
    let features = [PERSISTENT, EVENTS].map(|name| (name.to_owned(), declared()));
    let (info, _) = write_frames(root, to, features.into(), |rows| language.annotate(&rows))?;
    copy_files(root, to, (layout::META_EPISODES, META_EPISODES.name()), &META_EPISODES.options(), Ok)?;
    Ok(ExportSummary { episodes: info.total_episodes, labels: language.n_entries })
}

/// The entries of one episode after another.
struct Language {
    reader: LabelReader,
    fps: f64,
    /// Of the episode that the next frame belongs to.
    open: Vec<Entry>,
    frames_left: usize,
    n_entries: u64,
}

impl Language {
    /// The rows with both columns.
    fn annotate(&mut self, rows: &RecordBatch) -> Result<RecordBatch, EditError> {
        let (mut entries, mut positions, mut lengths) = (Vec::new(), Vec::new(), Vec::new());
        let mut n_left = rows.num_rows();
        while n_left > 0 {
            if self.frames_left == 0 && !self.next_episode()? {
                break;
            }
            let n_frames = n_left.min(self.frames_left);
            let (begin, end) = (entries.len() as u32, (entries.len() + self.open.len()) as u32);
            entries.extend_from_slice(&self.open);
            for _ in 0..n_frames {
                positions.extend(begin..end);
                lengths.push(self.open.len());
            }
            self.frames_left -= n_frames;
            n_left -= n_frames;
        }
        let columns = columns(&entries, positions, &lengths).map_err(EditError::rows(layout::DATA))?;
        without_words(rows).and_then(|rows| with_columns(&rows, columns)).map_err(EditError::rows(layout::DATA))
    }

    /// Reads the next episode that has frames; false after the last one.
    fn next_episode(&mut self) -> Result<bool, EditError> {
        let Some(episode) = self.reader.next().transpose()? else { return Ok(false) };
        self.open = entries(&episode, self.fps);
        self.frames_left = episode.times_secs.len();
        self.n_entries += self.open.len() as u64;
        Ok(true)
    }
}

/// The rows without words of before, which are those of the same calls.
fn without_words(rows: &RecordBatch) -> Result<RecordBatch, ArrowError> {
    let is_kept = |at: &usize| ![PERSISTENT, EVENTS].contains(&rows.schema_ref().field(*at).name().as_str());
    rows.project(&(0..rows.num_columns()).filter(is_kept).collect::<Vec<_>>())
}

/// What an episode says, in order of time.
fn entries(episode: &LabelledEpisode, fps: f64) -> Vec<Entry> {
    let entry = |style: &'static str, begin: u32, content: String| {
        // As `timestamp` is made, so that both are equal.
        Entry { timestamp: (f64::from(begin) / fps) as f32, style, content }
    };
    let subtasks = episode.subtasks();
    let is_own = matches!(episode.calls, LabelledCalls::Own(_));
    let plans = (0..subtasks.len()).map(|at| entry("plan", subtasks[at].begin, numbered(&subtasks[at..])));
    let skills = episode.skills().into_iter().map(|label| entry("subtask", label.begin, label.text));
    let motions = episode.primitives().into_iter().map(|label| {
        let argument = episode.argument(label.call);
        let words = if is_own { label.text.replace('_', " ") } else { label.text };
        entry("motion", label.begin, argument.map_or(words.clone(), |argument| format!("{words} {argument}")))
    });
    let mut entries: Vec<Entry> = plans.chain(skills).chain(motions).collect();
    entries.sort_by(|a, b| a.timestamp.total_cmp(&b.timestamp));
    entries
}

/// `1. pick_and_place block_D block_B`, a line each.
pub(crate) fn numbered(labels: &[Label]) -> String {
    let lines = labels.iter().enumerate().map(|(at, label)| format!("{}. {}", at + 1, label.text));
    lines.collect::<Vec<_>>().join("\n")
}

/// Both columns: `positions` of the entries of all rows, `lengths` of each row.
pub(crate) fn columns(
    entries: &[Entry],
    positions: Vec<u32>,
    lengths: &[usize],
) -> Result<Vec<(Field, ArrayRef)>, ArrowError> {
    let texts =
        |text: fn(&Entry) -> &str| -> ArrayRef { Arc::new(StringArray::from_iter_values(entries.iter().map(text))) };
    let none = |field: &Field| new_null_array(field.data_type(), entries.len());
    let fields = fields(true);
    let columns: Vec<ArrayRef> = fields
        .iter()
        .map(|field| match field.name().as_str() {
            "role" => texts(|_| "assistant"),
            "content" => texts(|entry| &entry.content),
            "style" => texts(|entry| entry.style),
            "timestamp" => Arc::new(Float32Array::from_iter_values(entries.iter().map(|entry| entry.timestamp))),
            _ => none(field),
        })
        .collect();
    let rows = take(&StructArray::try_new(fields, columns, None)?, &UInt32Array::from(positions), None)?;
    let persistent = list(PERSISTENT, rows, OffsetBuffer::from_lengths(lengths.iter().copied()))?;
    let nothing = new_null_array(&DataType::Struct(self::fields(false)), 0);
    Ok(vec![persistent, list(EVENTS, nothing, OffsetBuffer::new_zeroed(lengths.len()))?])
}

fn list(name: &str, rows: ArrayRef, offsets: OffsetBuffer<i32>) -> Result<(Field, ArrayRef), ArrowError> {
    let item = Arc::new(Field::new("element", rows.data_type().clone(), true));
    let list = ListArray::try_new(Arc::clone(&item), offsets, rows, None)?;
    Ok((Field::new(name, DataType::List(item), true), Arc::new(list)))
}

/// The fields of one entry. Only what lasts has a moment at which it began.
fn fields(is_persistent: bool) -> Fields {
    let text = |name: &str, is_nullable: bool| Field::new(name, DataType::Utf8, is_nullable);
    let calls = DataType::List(Arc::new(Field::new("element", DataType::Utf8, true)));
    let mut fields = vec![text("role", false), text("content", true), text("style", true)];
    if is_persistent {
        fields.push(Field::new("timestamp", DataType::Float32, false));
    }
    fields.extend([text("camera", true), Field::new("tool_calls", calls, true)]);
    fields.into()
}
