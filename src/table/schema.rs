//! The schema texts, as embedded and as parsed.

use std::collections::BTreeMap;
use std::sync::Arc;

use arrow::datatypes::{DataType, Field, Schema};
use parquet::arrow::parquet_to_arrow_schema;
use parquet::schema::parser::parse_message_type;
use parquet::schema::types::SchemaDescriptor;

use crate::table::{ColumnKind, Form, TableError, Value};

/// A table's contract: a name and the text of `schemas/parquet/NAME.message`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TableSchema {
    name: &'static str,
    text: &'static str,
}

/// A parsed schema, its columns in order.
pub(crate) struct ParsedSchema {
    pub(crate) descriptor: SchemaDescriptor,
    pub(crate) arrow: Schema,
    pub(crate) columns: Vec<(String, ColumnKind)>,
}

impl TableSchema {
    /// One row per episode that a policy acted: how it ended and where it first left the expert's calls.
    pub const ROLLOUTS: Self = Self::new("rollouts", include_str!("../../schemas/parquet/rollouts.message"));
    /// One row per training step and level that was logged.
    pub const METRICS: Self = Self::new("metrics", include_str!("../../schemas/parquet/metrics.message"));

    /// One row per logged training step of a detector.
    pub const DETECTOR_METRICS: Self =
        Self::new("detector_metrics", include_str!("../../schemas/parquet/detector_metrics.message"));
    /// One row per body and boundary frame of a demonstration in which a detector looked for it.
    pub const DETECTIONS: Self = Self::new("detections", include_str!("../../schemas/parquet/detections.message"));

    /// A contract from its embedded text.
    pub const fn new(name: &'static str, text: &'static str) -> Self {
        Self { name, text }
    }

    /// The name of the message and of the file.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// Parquet's message text.
    pub fn text(&self) -> &'static str {
        self.text
    }

    /// Every column with what it holds, in order.
    ///
    /// # Errors
    ///
    /// [`TableError::Schema`] when the text is none that a table can have.
    pub fn columns(&self) -> Result<Vec<(String, ColumnKind)>, TableError> {
        Ok(self.parse()?.columns)
    }

    pub(crate) fn parse(&self) -> Result<ParsedSchema, TableError> {
        self.parse_with(&[])
    }

    /// With further columns behind its own, given as lines of the message text.
    pub(crate) fn parse_with(&self, further: &[String]) -> Result<ParsedSchema, TableError> {
        let problem = |problem: String| TableError::Schema { schema: self.name, problem };
        let body = self.text.trim_end().strip_suffix('}').unwrap_or(self.text);
        let text = format!("{body}{}}}", further.concat());
        let root = parse_message_type(&text).map_err(|error| problem(error.to_string()))?;
        if root.name() != self.name {
            return Err(problem(format!("the message is called {:?}", root.name())));
        }
        let columns = root.get_fields().iter().map(|field| {
            let kind = ColumnKind::of(field).ok_or_else(|| problem(format!("column {:?} is of no kind", field.name())));
            Ok((field.name().to_owned(), kind?))
        });
        let columns = columns.collect::<Result<Vec<_>, TableError>>()?;
        let descriptor = SchemaDescriptor::new(Arc::new(root));
        let arrow = parquet_to_arrow_schema(&descriptor, None).map_err(|error| problem(error.to_string()))?;
        Ok(ParsedSchema { descriptor, arrow, columns })
    }
}

impl ParsedSchema {
    /// Gives lists their fixed lengths, which Parquet's text cannot say: Arrow's schema does.
    pub(crate) fn with_list_lengths(mut self, lengths: &BTreeMap<&'static str, i32>) -> Self {
        let fixed = |field: &Arc<Field>| match (lengths.get(field.name().as_str()), field.data_type()) {
            (Some(&length), DataType::List(element)) => {
                let data_type = DataType::FixedSizeList(Arc::clone(element), length);
                Arc::new(field.as_ref().clone().with_data_type(data_type))
            }
            _ => Arc::clone(field),
        };
        let fields: Vec<_> = self.arrow.fields().iter().map(fixed).collect();
        self.arrow = Schema::new(fields);
        self
    }

    /// Position and kind of a column.
    pub(crate) fn find(&self, name: &str) -> Option<(usize, ColumnKind)> {
        let position = self.columns.iter().position(|(column, _)| column == name)?;
        Some((position, self.columns[position].1))
    }

    /// Whether a column holds lists of floats, in which a dictionary finds nothing to share.
    pub(crate) fn is_float_list(&self, name: &str) -> bool {
        let kind = self.find(name).map(|(_, kind)| kind);
        kind.is_some_and(|kind| kind.form == Form::List && matches!(kind.value, Value::Float32 | Value::Float64))
    }
}
