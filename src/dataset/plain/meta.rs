//! `meta/episodes/`: a row an episode.

use std::path::Path;
use std::sync::Arc;

use arrow::array::{
    ArrayRef, Float64Array, Float64Builder, Int64Array, Int64Builder, ListBuilder, RecordBatch, StringBuilder,
};
use arrow::datatypes::{DataType, Field, Schema};

use crate::dataset::files::layout::{self, FilePlace};
use crate::dataset::plain::feature::PlainError;
use crate::dataset::plain::video::VideoPlace;
use crate::table::{BatchWriter, TableError, Values, WriteOptions};

/// What is known of an episode.
#[derive(Clone, Debug, Default)]
pub(super) struct MetaRow {
    pub(super) task: String,
    pub(super) length: u64,
    /// Index of its first frame.
    pub(super) from: u64,
    pub(super) data: FilePlace,
    /// By feature.
    pub(super) videos: Vec<(String, VideoPlace)>,
    pub(super) statistics: Vec<(String, Statistic)>,
}

/// A statistic of a feature: doubles, or how many.
#[derive(Clone, Debug)]
pub(super) enum Statistic {
    Doubles(Vec<f64>),
    Counts(Vec<i64>),
}

/// The statistics of one episode.
pub(super) fn owned<'a>(columns: impl Iterator<Item = (&'a str, Values<'a>)>) -> Vec<(String, Statistic)> {
    let owned = columns.filter_map(|(name, values)| {
        let statistic = match values {
            Values::Float64Vector(values, _) | Values::Float64(values) => Statistic::Doubles(values.to_vec()),
            Values::Int64Vector(values, _) | Values::Int64(values) => Statistic::Counts(values.to_vec()),
            _ => return None,
        };
        Some((name.to_owned(), statistic))
    });
    owned.collect()
}

/// Writes the table.
pub(super) fn write(root: &Path, rows: &[MetaRow]) -> Result<(), PlainError> {
    let path = FilePlace::default().in_dataset(root, layout::META_EPISODES);
    let mut columns = numbers(rows);
    for position in 0..rows.first().map_or(0, |row| row.videos.len()) {
        videos(rows, position, &mut columns);
    }
    for position in 0..rows.first().map_or(0, |row| row.statistics.len()) {
        columns.push(statistic(rows, position));
    }
    let zeros = || Arc::new(Int64Array::from(vec![0; rows.len()])) as ArrayRef;
    columns.push(("meta/episodes/chunk_index".to_owned(), zeros()));
    columns.push(("meta/episodes/file_index".to_owned(), zeros()));
    let field = |(name, array): &(String, ArrayRef)| Field::new(name, array.data_type().clone(), false);
    let schema = Arc::new(Schema::new(columns.iter().map(field).collect::<Vec<_>>()));
    let arrays = columns.into_iter().map(|(_, array)| array).collect();
    let batch = RecordBatch::try_new(Arc::clone(&schema), arrays).map_err(TableError::arrow(&path))?;
    let mut writer = BatchWriter::create(&path, "meta_episodes", &schema, WriteOptions::default())?;
    writer.write(&batch)?;
    Ok(writer.commit()?)
}

fn numbers(rows: &[MetaRow]) -> Vec<(String, ArrayRef)> {
    let column = |name: &str, number: &dyn Fn(usize, &MetaRow) -> i64| {
        let numbers = rows.iter().enumerate().map(|(position, row)| number(position, row));
        (name.to_owned(), Arc::new(Int64Array::from_iter_values(numbers)) as ArrayRef)
    };
    let mut tasks = ListBuilder::new(StringBuilder::new()).with_field(Field::new("element", DataType::Utf8, false));
    for row in rows {
        tasks.values().append_value(&row.task);
        tasks.append(true);
    }
    vec![
        column("episode_index", &|position, _| position as i64),
        ("tasks".to_owned(), Arc::new(tasks.finish())),
        column("length", &|_, row| row.length as i64),
        column("data/chunk_index", &|_, row| i64::from(row.data.chunk)),
        column("data/file_index", &|_, row| i64::from(row.data.file)),
        column("dataset_from_index", &|_, row| row.from as i64),
        column("dataset_to_index", &|_, row| (row.from + row.length) as i64),
    ]
}

fn videos(rows: &[MetaRow], position: usize, columns: &mut Vec<(String, ArrayRef)>) {
    let feature = &rows[0].videos[position].0;
    let places = || rows.iter().filter_map(|row| row.videos.get(position)).map(|(_, place)| place);
    let numbers = |number: fn(&VideoPlace) -> u32| {
        Arc::new(Int64Array::from_iter_values(places().map(|place| i64::from(number(place))))) as ArrayRef
    };
    let seconds =
        |second: fn(&VideoPlace) -> f64| Arc::new(Float64Array::from_iter_values(places().map(second))) as ArrayRef;
    columns.push((format!("videos/{feature}/chunk_index"), numbers(|place| place.file.chunk)));
    columns.push((format!("videos/{feature}/file_index"), numbers(|place| place.file.file)));
    columns.push((format!("videos/{feature}/from_timestamp"), seconds(|place| place.from_secs)));
    columns.push((format!("videos/{feature}/to_timestamp"), seconds(|place| place.to_secs)));
}

fn statistic(rows: &[MetaRow], position: usize) -> (String, ArrayRef) {
    let (name, first) = &rows[0].statistics[position];
    let values = rows.iter().filter_map(|row| row.statistics.get(position)).map(|(_, statistic)| statistic);
    let array: ArrayRef = match first {
        Statistic::Doubles(_) => {
            let field = Field::new("element", DataType::Float64, false);
            let mut lists = ListBuilder::new(Float64Builder::new()).with_field(field);
            for value in values {
                if let Statistic::Doubles(doubles) = value {
                    lists.values().append_slice(doubles);
                }
                lists.append(true);
            }
            Arc::new(lists.finish())
        }
        Statistic::Counts(_) => {
            let mut lists =
                ListBuilder::new(Int64Builder::new()).with_field(Field::new("element", DataType::Int64, false));
            for value in values {
                if let Statistic::Counts(counts) = value {
                    lists.values().append_slice(counts);
                }
                lists.append(true);
            }
            Arc::new(lists.finish())
        }
    };
    (name.clone(), array)
}
