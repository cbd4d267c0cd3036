//! Parquet files as Polars frames whose columns are as their schema says.
//!
//! # Errors
//!
//! A column that is missing or of another type is named with its file before any row is read.

use std::path::{Path, PathBuf};

use polars::prelude::{
    Column, DataFrame, DataType, LazyFrame, NULL, PlRefPath, PlSmallStr, PolarsError, ScanArgsParquet, col, lit,
};

use crate::report::ReportError;

/// Opens a file, of which nothing but the schema is read, and leaves only the columns that are asked for.
pub(super) fn scan(path: &Path, columns: &[(&str, DataType)]) -> Result<LazyFrame, ReportError> {
    scan_with(path, columns, &[])
}

/// The same with `later` columns behind, which are null in files that were written before there were any.
pub(super) fn scan_with(
    path: &Path,
    columns: &[(&str, DataType)],
    later: &[(&str, DataType)],
) -> Result<LazyFrame, ReportError> {
    let unreadable = |source: PolarsError| ReportError::Table { path: path.to_owned(), source };
    let source = PlRefPath::try_from_path(path).map_err(unreadable)?;
    let options = ScanArgsParquet { glob: false, ..ScanArgsParquet::default() };
    let mut frame = LazyFrame::scan_parquet(source, options).map_err(unreadable)?;
    let schema = frame.collect_schema().map_err(unreadable)?;
    let is_later = |name: &&str| later.iter().any(|(later, _)| later == name);
    let mut selected = Vec::new();
    for (name, expected) in columns.iter().chain(later) {
        let problem = match schema.get(name) {
            None if is_later(name) => {
                selected.push(lit(NULL).cast(expected.clone()).alias(*name));
                continue;
            }
            None => format!(
                "is missing; there are {}",
                schema.iter_names().map(PlSmallStr::as_str).collect::<Vec<_>>().join(", ")
            ),
            Some(found) if found != expected => format!("is {found}, not {expected}"),
            Some(_) => {
                selected.push(col(*name));
                continue;
            }
        };
        return Err(ReportError::Column { path: path.to_owned(), column: (*name).to_owned(), problem });
    }
    Ok(frame.select(selected))
}

/// Reads the rows of a query over files.
pub(super) fn collect(frame: LazyFrame, of: &[PathBuf]) -> Result<DataFrame, ReportError> {
    let path = of.first().cloned().unwrap_or_default();
    frame.collect().map_err(|source| ReportError::Table { path, source })
}

/// The columns of a frame that was asked for by name: only a wrong query can miss one.
pub(super) struct Rows<'a>(pub(super) &'a DataFrame);

impl Rows<'_> {
    fn column(&self, name: &str) -> Result<&Column, ReportError> {
        self.0.column(name).map_err(ReportError::Query)
    }

    /// Text, empty where there is none.
    pub(super) fn text(&self, name: &str) -> Result<Vec<String>, ReportError> {
        let column = self.column(name)?.str().map_err(ReportError::Query)?;
        Ok(column.iter().map(|value| value.unwrap_or_default().to_owned()).collect())
    }

    /// Text, `None` where there is none.
    pub(super) fn optional_text(&self, name: &str) -> Result<Vec<Option<String>>, ReportError> {
        let column = self.column(name)?.str().map_err(ReportError::Query)?;
        Ok(column.iter().map(|value| value.map(str::to_owned)).collect())
    }

    /// Whole numbers, `None` where there is none.
    pub(super) fn optional_whole(&self, name: &str) -> Result<Vec<Option<i64>>, ReportError> {
        let column = self.column(name)?.cast(&DataType::Int64).map_err(ReportError::Query)?;
        Ok(column.i64().map_err(ReportError::Query)?.iter().collect())
    }

    /// Numbers, `None` where there is none.
    pub(super) fn optional_real(&self, name: &str) -> Result<Vec<Option<f64>>, ReportError> {
        Ok(self.column(name)?.f64().map_err(ReportError::Query)?.iter().collect())
    }

    /// Numbers, not a number where there is none.
    pub(super) fn real(&self, name: &str) -> Result<Vec<f64>, ReportError> {
        Ok(self.optional_real(name)?.into_iter().map(|value| value.unwrap_or(f64::NAN)).collect())
    }

    /// Whole numbers, 0 where there is none.
    pub(super) fn whole(&self, name: &str) -> Result<Vec<i64>, ReportError> {
        Ok(self.optional_whole(name)?.into_iter().map(Option::unwrap_or_default).collect())
    }
}
