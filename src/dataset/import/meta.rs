//! The rows of `meta/episodes`: carried over with the columns that name task, split and outcome.

use std::path::Path;
use std::sync::Arc;

use arrow::array::{ArrayRef, BooleanArray, Int64Array, RecordBatch, StringArray};
use arrow::datatypes::{DataType, Field};

use crate::dataset::edit::EditError;
use crate::dataset::export::with_columns;
use crate::dataset::files::layout::{self, FilePlace};
use crate::dataset::import::rows::task_id;
use crate::dataset::plain::PlainSource;
use crate::dataset::schema::META_EPISODES;
use crate::table::{BatchReader, BatchWriter, WriteOptions};

/// Rows that are read at a time.
const BATCH_ROWS: usize = 512;

/// Writes the files of episodes again; `places` are the files that their frames are in
/// now, and their tasks.
pub(super) fn write_meta(source: &PlainSource, places: &[(FilePlace, i64)], to: &Path) -> Result<(), EditError> {
    let mut own = FilePlace::default();
    let mut position = 0;
    for path in &source.episode_files {
        let mut reader = BatchReader::open_columns(path, BATCH_ROWS, |_name| true)?;
        let mut writer: Option<BatchWriter> = None;
        while let Some(rows) = reader.next_batch()? {
            let rows = changed(source, &rows, position, own, places).map_err(EditError::rows(path))?;
            position += rows.num_rows();
            let mut open = match writer.take() {
                Some(open) => open,
                None => {
                    let target = own.in_dataset(to, layout::META_EPISODES);
                    BatchWriter::create(&target, META_EPISODES.name(), rows.schema_ref(), WriteOptions::default())?
                }
            };
            open.write(&rows)?;
            writer = Some(open);
        }
        if let Some(writer) = writer {
            writer.commit()?;
            own = own.next();
        }
    }
    Ok(())
}

fn changed(
    source: &PlainSource,
    rows: &RecordBatch,
    first: usize,
    own: FilePlace,
    places: &[(FilePlace, i64)],
) -> Result<RecordBatch, arrow::error::ArrowError> {
    let positions = first..first + rows.num_rows();
    let place = |at: usize| places.get(at).copied().unwrap_or_default().0;
    let numbers = |of: &dyn Fn(usize) -> u32| -> ArrayRef {
        Arc::new(positions.clone().map(|at| i64::from(of(at))).collect::<Int64Array>())
    };
    let number = |name: &str, column: ArrayRef| (Field::new(name, DataType::Int64, false), column);
    let text = |name: &str, of: &dyn Fn(usize) -> String| {
        let column: ArrayRef = Arc::new(StringArray::from_iter_values(positions.clone().map(of)));
        (Field::new(name, DataType::Utf8, false), column)
    };
    let task = |at: usize| task_id(places.get(at).and_then(|(_, task)| source.tasks.get(*task)).unwrap_or_default());
    let split = |at: usize| source.info.split_of(at as u64).unwrap_or("none").to_owned();
    let success: ArrayRef = Arc::new(BooleanArray::from(vec![true; rows.num_rows()]));
    let columns = vec![
        number("data/chunk_index", numbers(&|at| place(at).chunk)),
        number("data/file_index", numbers(&|at| place(at).file)),
        number("meta/episodes/chunk_index", numbers(&|_at| own.chunk)),
        number("meta/episodes/file_index", numbers(&|_at| own.file)),
        text("ntp/task_id", &task),
        text("ntp/split", &split),
        (Field::new("ntp/success", DataType::Boolean, false), success),
    ];
    let names: Vec<&String> = columns.iter().map(|(field, _)| field.name()).collect();
    let schema = rows.schema();
    let kept: Vec<usize> = (0..schema.fields().len()).filter(|&at| !names.contains(&schema.field(at).name())).collect();
    with_columns(&rows.project(&kept)?, columns)
}
