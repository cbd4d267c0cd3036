//! The files behind each table.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use polars::prelude::{
    Column, DataFrame, DataType, IntoLazy as _, LazyFrame, NamedFrom as _, PlRefPath, PolarsError, ScanArgsParquet,
    SchemaRef, Series, UnionArgs, col, concat, lit,
};
use serde::Serialize;
use tempfile::TempPath;

use crate::dataset;
use crate::query::{Answer, QueryError};
use crate::table::{self, column_types};

/// The table whose columns have become more.
const ROLLOUTS: &str = "rollouts";

/// Tables by name, each of any number of files.
#[derive(Clone, Debug, Default)]
pub struct Tables(BTreeMap<&'static str, Vec<Source>>);

/// A file, and the model that it is of, for a table that does not say so itself.
#[derive(Clone, Debug)]
struct Source {
    path: PathBuf,
    model: Option<String>,
    /// What was read of a file that is no Parquet.
    rows: Option<DataFrame>,
    /// The file as Polars can read it, where it cannot read the file itself.
    plain: Option<Arc<TempPath>>,
}

impl Source {
    fn new(path: PathBuf) -> Self {
        Self { path, model: None, rows: None, plain: None }
    }

    /// The file that is read.
    fn file(&self) -> &Path {
        match &self.plain {
            Some(plain) => plain,
            None => &self.path,
        }
    }
}

/// What a table holds.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct TableInfo {
    /// Its name in statements.
    pub table: &'static str,
    /// Files that it is read from.
    pub files: usize,
    /// Names and types of its columns.
    pub columns: Vec<(String, String)>,
}

impl Tables {
    /// Adds the tables of a dataset.
    ///
    /// # Errors
    ///
    /// When a file is missing or has another number of rows than the dataset counts.
    pub fn add_dataset(&mut self, root: &Path) -> Result<(), QueryError> {
        for (name, files) in dataset::table_files(root)? {
            match files {
                dataset::TableFiles::Parquet(files) => {
                    for path in files {
                        let plain = table::without_extensions(&path)?.map(Arc::new);
                        self.0.entry(name).or_default().push(Source { plain, ..Source::new(path) });
                    }
                }
                dataset::TableFiles::Columns(path, columns) => {
                    let rows = Some(frame_of(&path, columns)?);
                    self.0.entry(name).or_default().push(Source { rows, ..Source::new(path) });
                }
            }
        }
        Ok(())
    }

    /// Adds a `rollouts.parquet`.
    pub fn add_rollouts(&mut self, path: &Path) {
        self.add(ROLLOUTS, path.to_owned(), None);
    }

    /// Adds a `detections.parquet`.
    pub fn add_detections(&mut self, path: &Path) {
        self.add("detections", path.to_owned(), None);
    }

    /// Adds the `detector_metrics.parquet` of a model.
    pub fn add_detector_metrics(&mut self, path: &Path, model: &str) {
        self.add("detector_metrics", path.to_owned(), Some(model.to_owned()));
    }

    /// Adds the `metrics.parquet` of a model.
    pub fn add_metrics(&mut self, path: &Path, model: &str) {
        self.add("metrics", path.to_owned(), Some(model.to_owned()));
    }

    fn add(&mut self, name: &'static str, path: PathBuf, model: Option<String>) {
        self.0.entry(name).or_default().push(Source { model, ..Source::new(path) });
    }

    /// The tables that there are.
    pub fn names(&self) -> Vec<&'static str> {
        self.0.keys().copied().collect()
    }

    /// The tables with their columns. The types of a table with a column that queries do not read are those of its
    /// files.
    ///
    /// # Errors
    ///
    /// When a file cannot be opened.
    pub fn describe(&self) -> Result<Vec<TableInfo>, QueryError> {
        self.0.iter().map(|(&table, sources)| info(table, sources)).collect()
    }

    /// The columns of a table as an answer.
    pub(super) fn columns_of(&self, table: &str) -> Result<Answer, QueryError> {
        let no_table = || QueryError::NoTable { name: table.to_owned(), tables: self.names() };
        let (&table, sources) = self.0.get_key_value(table).ok_or_else(no_table)?;
        let (names, types): (Vec<_>, Vec<_>) = info(table, sources)?.columns.into_iter().unzip();
        self.listing(vec![Column::new("column".into(), names), Column::new("type".into(), types)])
    }

    /// The names of the tables as an answer.
    pub(super) fn listed(&self) -> Result<Answer, QueryError> {
        self.listing(vec![Column::new("table".into(), self.names())])
    }

    fn listing(&self, columns: Vec<Column>) -> Result<Answer, QueryError> {
        let rows = DataFrame::new_infer_height(columns);
        rows.map(Answer::new).map_err(|source| QueryError::Refused { source, tables: self.names() })
    }

    /// Opens the tables that are asked for; no row is read. Lists of fixed length become lists of any, of which
    /// functions and subscripts take elements, if `has_elements`.
    pub(super) fn scan(
        &self,
        is_asked: impl Fn(&str) -> bool,
        has_elements: bool,
    ) -> Result<Vec<(&'static str, LazyFrame)>, QueryError> {
        let asked = self.0.iter().filter(|(name, _)| is_asked(name));
        let open = |(&name, sources): (&&'static str, &Vec<Source>)| {
            if let Some(error) = unreadable(sources)? {
                return Err(error);
            }
            let frame = frame(name, sources)?;
            Ok((name, if has_elements { with_lists(frame, sources)? } else { frame }))
        };
        asked.map(open).collect()
    }
}

/// Types that Polars, as it is built, cannot hold.
const UNREAD: [&str; 3] = ["float16", "uint8", "uint16"];

/// Why a table cannot be read, judged by its first file.
fn unreadable(sources: &[Source]) -> Result<Option<QueryError>, QueryError> {
    let Some(Source { path, rows: None, .. }) = sources.first() else { return Ok(None) };
    let columns = column_types(path)?;
    let found = columns.into_iter().find_map(|(column, types)| {
        let kind = types.into_iter().find(|kind| UNREAD.contains(&kind.as_str()))?;
        Some(QueryError::Type { path: path.clone(), column, kind })
    });
    Ok(found)
}

fn info(table: &'static str, sources: &[Source]) -> Result<TableInfo, QueryError> {
    let columns = match (unreadable(sources)?, sources.first()) {
        (Some(_), Some(Source { path, .. })) => {
            let columns = column_types(path)?.into_iter();
            columns.map(|(name, types)| (name, types.join(", "))).collect()
        }
        _ => {
            let schema = frame(table, sources)?.collect_schema().map_err(|source| refused(sources, source))?;
            schema.iter().map(|(name, kind)| (name.to_string(), kind.to_string())).collect()
        }
    };
    Ok(TableInfo { table, files: sources.len(), columns })
}

/// A table that Polars cannot open, by its first file.
fn refused(sources: &[Source], source: PolarsError) -> QueryError {
    QueryError::Table { path: sources.first().map_or_else(PathBuf::new, |source| source.path.clone()), source }
}

/// Columns that were read already.
fn frame_of(path: &Path, columns: Vec<(&'static str, table::Column)>) -> Result<DataFrame, QueryError> {
    let column = |(name, values): (&'static str, table::Column)| match values {
        table::Column::Int64(values) => Some(Column::new(name.into(), values)),
        table::Column::Float64(values) => Some(Column::new(name.into(), values)),
        table::Column::Text(values) => Some(Column::new(name.into(), values)),
        table::Column::TextList(rows) => {
            let rows: Vec<Series> = rows.into_iter().map(|row| Series::new("".into(), row)).collect();
            Some(Column::new(name.into(), rows))
        }
        _ => None,
    };
    let rows = DataFrame::new_infer_height(columns.into_iter().filter_map(column).collect());
    rows.map_err(|source| QueryError::Table { path: path.to_owned(), source })
}

/// The files of a table of this name as one.
fn frame(name: &str, sources: &[Source]) -> Result<LazyFrame, QueryError> {
    match name {
        ROLLOUTS => scan_rollouts(sources).map_err(|source| refused(sources, source)),
        _ => union(sources),
    }
}

fn with_lists(mut frame: LazyFrame, sources: &[Source]) -> Result<LazyFrame, QueryError> {
    let schema = frame.collect_schema().map_err(|source| refused(sources, source))?;
    let lists = schema.iter().filter_map(|(name, kind)| match kind {
        DataType::Array(inner, _) => Some(col(name.clone()).cast(DataType::List(inner.clone()))),
        _ => None,
    });
    Ok(frame.with_columns(lists.collect::<Vec<_>>()))
}

/// The files of a table as one. Where they do not say which model they are of, they are read at once: learning curves
/// are short, and Polars cannot count the rows of a union of lazy frames without its 128-bit numbers.
fn union(sources: &[Source]) -> Result<LazyFrame, QueryError> {
    if let [Source { rows: Some(rows), .. }] = sources {
        return Ok(rows.clone().lazy());
    }
    let unreadable = |source| refused(sources, source);
    if sources.iter().all(|source| source.model.is_none()) {
        return scan(sources.iter().map(Source::file)).map_err(unreadable);
    }
    let with_model = |source: &Source| {
        let model = source.model.clone().unwrap_or_default();
        Ok(scan([source.file()])?.with_columns([lit(model).alias("model")]))
    };
    let frames = sources.iter().map(with_model).collect::<Result<Vec<_>, _>>().map_err(unreadable)?;
    let rows = concat(&frames, UnionArgs::default()).and_then(LazyFrame::collect).map_err(unreadable)?;
    Ok(rows.lazy())
}

fn scan<'a>(paths: impl IntoIterator<Item = &'a Path>) -> Result<LazyFrame, PolarsError> {
    let paths = paths.into_iter().map(PlRefPath::try_from_path).collect::<Result<Vec<_>, _>>()?;
    open(paths, None)
}

/// Rollouts of several versions of this program as one table: a column that a file lacks is null there.
fn scan_rollouts(sources: &[Source]) -> Result<LazyFrame, PolarsError> {
    let paths = sources.iter().map(|source| PlRefPath::try_from_path(&source.path)).collect::<Result<Vec<_>, _>>()?;
    let schemas = paths.iter().map(|path| open(vec![path.clone()], None)?.collect_schema());
    let widest = schemas.collect::<Result<Vec<_>, _>>()?.into_iter().max_by_key(|schema| schema.len());
    open(paths, widest)
}

/// Files as one table, of the first one's columns or of those that are given.
fn open(paths: Vec<PlRefPath>, schema: Option<SchemaRef>) -> Result<LazyFrame, PolarsError> {
    let allow_missing_columns = schema.is_some();
    let options = ScanArgsParquet { glob: false, schema, allow_missing_columns, ..ScanArgsParquet::default() };
    let mut frame = LazyFrame::scan_parquet_files(paths.into(), options)?;
    frame.collect_schema()?;
    Ok(frame)
}
