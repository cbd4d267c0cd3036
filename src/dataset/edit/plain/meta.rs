//! The rows of `meta/episodes`: carried over with all their columns, but for what counts where an episode lies.

use std::sync::Arc;

use arrow::array::{ArrayRef, Float64Array, RecordBatch};
use arrow::compute::concat_batches;
use arrow::datatypes::{DataType, Field, Schema, SchemaRef};
use arrow::error::ArrowError;
use serde_json::{Value, json};

use crate::dataset::DatasetError;
use crate::dataset::edit::EditError;
use crate::dataset::edit::plain::json::array_of;
use crate::dataset::edit::plain::schema::{cast_to, fitted, plain_type};
use crate::dataset::files::layout;
use crate::dataset::pictures::video_columns;
use crate::dataset::plain::{DeclaredKind, EpisodeStatistics, PlainEpisode, PlainInfo, PlainSource, RowCursor};
use crate::table::BatchReader;

/// Statistics that older datasets have of an episode.
const LINE_STATISTICS: [&str; 5] = ["min", "max", "mean", "std", "count"];
/// Columns of whole numbers that every row has.
const NUMBERS: [&str; 8] = [
    "episode_index",
    "length",
    "data/chunk_index",
    "data/file_index",
    "dataset_from_index",
    "dataset_to_index",
    "meta/episodes/chunk_index",
    "meta/episodes/file_index",
];

/// The rows of a source's episodes.
pub(super) enum MetaSource {
    Tables(RowCursor),
    Lines(Option<EpisodeStatistics>),
}

impl MetaSource {
    pub(super) fn open(source: &PlainSource) -> Result<Self, EditError> {
        if source.info.version.is_by_episode() {
            return Ok(Self::Lines(EpisodeStatistics::open(&source.info)?));
        }
        Ok(Self::Tables(RowCursor::of_batches(256)))
    }

    /// The row of an episode, in the columns of a schema. Episodes are asked for in their order.
    pub(super) fn row(
        &mut self,
        source: &PlainSource,
        position: usize,
        schema: &SchemaRef,
    ) -> Result<RecordBatch, EditError> {
        let episode = &source.episodes[position];
        let path = &source.episode_files[episode.own.0];
        match self {
            Self::Tables(cursor) => {
                let mut found = None;
                cursor.each(path, episode.own.1, 1, |row| {
                    found = Some(fitted(&row, schema).map_err(EditError::rows(path))?);
                    Ok::<_, EditError>(())
                })?;
                let missing = || DatasetError::Count { path: path.clone(), problem: "a row is missing".to_owned() };
                Ok(found.ok_or_else(missing)?)
            }
            Self::Lines(lines) => {
                let statistics = lines.as_mut().map_or(Ok(Value::Null), |lines| lines.of(episode.index))?;
                row_of_line(episode, &statistics, schema).map_err(EditError::rows(path))
            }
        }
    }
}

fn row_of_line(episode: &PlainEpisode, statistics: &Value, schema: &SchemaRef) -> Result<RecordBatch, ArrowError> {
    let value = |name: &str| match name.strip_prefix("stats/").and_then(|name| name.rsplit_once('/')) {
        Some((feature, statistic)) => statistics[feature][statistic].clone(),
        None if name == "tasks" => json!(episode.tasks),
        None if name == "length" => json!(episode.length),
        None => Value::Null,
    };
    let column = |field: &Arc<Field>| {
        let value = value(field.name());
        array_of(&[Some(&value).filter(|value| !value.is_null())], field.data_type())
    };
    RecordBatch::try_new(Arc::clone(schema), schema.fields().iter().map(column).collect())
}

/// The columns that rows are written with: those of a source, and any that must be there.
pub(super) fn schema_of(source: &PlainSource) -> Result<SchemaRef, EditError> {
    let info = &source.info;
    let mut fields: Vec<Field> = Vec::new();
    if info.version.is_by_episode() {
        fields.extend(line_fields(info));
    } else if let Some(path) = source.episode_files.first() {
        let reader = BatchReader::open(path, 1)?;
        fields.extend(reader.schema().fields().iter().map(|field| carried_field(field)));
    }
    let list = DataType::List(Arc::new(Field::new("element", DataType::Utf8, true)));
    let numbers = NUMBERS.into_iter().map(|name| Field::new(name, DataType::Int64, true));
    let videos = info.videos().flat_map(|video| {
        let [chunk, file, from, to] = video_columns(&video.name).map(|(name, _)| name);
        let whole = [chunk, file].map(|name| Field::new(name, DataType::Int64, true));
        whole.into_iter().chain([from, to].map(|name| Field::new(name, DataType::Float64, true))).collect::<Vec<_>>()
    });
    for field in numbers.chain([Field::new("tasks", list, true)]).chain(videos) {
        match fields.iter_mut().find(|known| known.name() == field.name()) {
            Some(known) => *known = field,
            None => fields.push(field),
        }
    }
    Ok(Arc::new(Schema::new(fields)))
}

/// A column of statistics is of doubles, or of whole numbers where it counts.
fn carried_field(field: &Field) -> Field {
    let kind = plain_type(field.data_type());
    let is_count = field.name().ends_with("/count");
    let kind = if field.name().starts_with("stats/") { with_numbers(&kind, is_count) } else { kind };
    Field::new(field.name(), kind, true)
}

fn with_numbers(kind: &DataType, is_count: bool) -> DataType {
    match kind {
        DataType::List(item) | DataType::FixedSizeList(item, _) => {
            DataType::List(Arc::new(Field::new("element", with_numbers(item.data_type(), is_count), true)))
        }
        _ if is_count => DataType::Int64,
        _ => DataType::Float64,
    }
}

/// Statistics of older datasets, as columns.
fn line_fields(info: &PlainInfo) -> Vec<Field> {
    if !EpisodeStatistics::are_there(info) {
        return Vec::new();
    }
    let depth = |kind: DeclaredKind, shape: &[usize]| match kind {
        DeclaredKind::Numbers(_) => Some(shape.len()),
        DeclaredKind::Image | DeclaredKind::Video => Some(3),
        _ => None,
    };
    let of_feature = |(name, depth): (&str, usize)| {
        let field = |statistic: &str| {
            let is_count = statistic == "count";
            let number = if is_count { DataType::Int64 } else { DataType::Float64 };
            let nested = (0..if is_count { 1 } else { depth })
                .fold(number, |inner, _| DataType::List(Arc::new(Field::new("element", inner, true))));
            Field::new(format!("stats/{name}/{statistic}"), nested, true)
        };
        LINE_STATISTICS.map(field)
    };
    let features = info.features.iter().filter_map(|of| Some((of.name.as_str(), depth(of.kind, &of.shape)?)));
    features.flat_map(of_feature).collect()
}

/// Rows that are not yet written.
pub(super) struct MetaRows {
    schema: SchemaRef,
    rows: Vec<RecordBatch>,
}

impl MetaRows {
    pub(super) fn new(schema: SchemaRef) -> Self {
        Self { schema, rows: Vec::new() }
    }

    pub(super) fn schema(&self) -> &SchemaRef {
        &self.schema
    }

    pub(super) fn n_rows(&self) -> usize {
        self.rows.len()
    }

    /// Adds a row with some of its columns changed. A single number stands in whatever lists the column has.
    pub(super) fn push(&mut self, row: &RecordBatch, changed: &[(String, Changed)]) -> Result<(), EditError> {
        let mut columns = row.columns().to_vec();
        for (name, value) in changed {
            if let Ok(at) = self.schema.index_of(name) {
                let kind = self.schema.field(at).data_type();
                columns[at] = value.array(kind).map_err(EditError::rows(layout::META_EPISODES))?;
            }
        }
        let row = RecordBatch::try_new(Arc::clone(&self.schema), columns);
        self.rows.push(row.map_err(EditError::rows(layout::META_EPISODES))?);
        Ok(())
    }

    /// All rows as one batch; `None` when there are none. Then it begins anew.
    pub(super) fn take(&mut self) -> Result<Option<RecordBatch>, EditError> {
        let rows = std::mem::take(&mut self.rows);
        if rows.is_empty() {
            return Ok(None);
        }
        concat_batches(&self.schema, &rows).map(Some).map_err(EditError::rows(layout::META_EPISODES))
    }
}

/// What a column is given.
pub(super) enum Changed {
    Number(f64),
    Texts(Vec<String>),
}

impl Changed {
    fn array(&self, kind: &DataType) -> Result<ArrayRef, ArrowError> {
        fn nested(number: &Value, kind: &DataType) -> Value {
            match kind {
                DataType::List(item) => json!([nested(number, item.data_type())]),
                _ => number.clone(),
            }
        }
        match self {
            Self::Texts(texts) => Ok(array_of(&[Some(&json!(texts))], kind)),
            Self::Number(number) => match kind {
                DataType::List(_) => {
                    let is_whole = number.fract() == 0.0 && number.abs() < 9e15;
                    let value = if is_whole { json!(*number as i64) } else { json!(number) };
                    Ok(array_of(&[Some(&nested(&value, kind))], kind))
                }
                _ => {
                    let array: ArrayRef = Arc::new(Float64Array::from(vec![*number]));
                    cast_to(&array, kind)
                }
            },
        }
    }
}

/// Columns that only one of two sources has, but for statistics.
pub(super) fn other_column(first: &SchemaRef, other: &SchemaRef) -> Option<String> {
    let is_other = |field: &&Arc<Field>| !field.name().starts_with("stats/") && first.index_of(field.name()).is_err();
    other.fields().iter().find(is_other).map(|field| field.name().clone())
}
