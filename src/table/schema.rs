//! What a table is: its columns in order, with what each holds and means.

use std::collections::BTreeMap;
use std::sync::Arc;

use arrow::datatypes::{DataType, Field, Schema};
use parquet::arrow::parquet_to_arrow_schema;
use parquet::schema::parser::parse_message_type;
use parquet::schema::types::SchemaDescriptor;

use crate::table::write::WriteOptions;
use crate::table::{ColumnKind, Form, TableError, Value};

/// One column of a table.
#[derive(Clone, Copy, Debug)]
pub struct ColumnSpec {
    name: &'static str,
    kind: ColumnKind,
    meaning: &'static str,
    encoding: Encoding,
    is_later: bool,
}

/// How a column's numbers are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Encoding {
    /// In a dictionary, where that is shorter.
    Dictionary,
    /// As they are: in a dictionary they would find nothing to share.
    Plain,
    /// As differences: whole numbers near to their neighbours.
    Delta,
}

impl ColumnSpec {
    /// A column by its name, what it holds, and what that means.
    pub const fn new(name: &'static str, kind: ColumnKind, meaning: &'static str) -> Self {
        Self { name, kind, meaning, encoding: Encoding::Dictionary, is_later: false }
    }

    /// Its numbers are stored as they are.
    #[must_use]
    pub const fn plain(self) -> Self {
        Self { encoding: Encoding::Plain, ..self }
    }

    /// Its numbers are stored as differences.
    #[must_use]
    pub const fn delta(self) -> Self {
        Self { encoding: Encoding::Delta, ..self }
    }

    /// Files of earlier versions lack the column: it is null there.
    #[must_use]
    pub const fn later(self) -> Self {
        assert!(matches!(self.kind.form, Form::Optional), "a later column is optional");
        Self { is_later: true, ..self }
    }

    /// Its name. A `*` stands for each of some names.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// What it holds.
    pub fn kind(&self) -> ColumnKind {
        self.kind
    }

    /// What its values mean, as a phrase.
    pub fn meaning(&self) -> &'static str {
        self.meaning.trim()
    }

    /// Whether files of earlier versions lack it.
    pub fn is_later(&self) -> bool {
        self.is_later
    }
}

/// A table's contract: its name and its columns.
#[derive(Clone, Copy, Debug)]
pub struct TableSchema {
    name: &'static str,
    about: &'static str,
    columns: &'static [ColumnSpec],
    sorted_by: &'static [&'static str],
    /// Columns that are there for each of some names.
    each: Option<Each>,
}

/// Names, and the columns that are there for each of them.
type Each = (fn() -> Vec<String>, &'static [ColumnSpec]);

/// A parsed schema, its columns in order.
pub(crate) struct ParsedSchema {
    pub(crate) descriptor: SchemaDescriptor,
    pub(crate) arrow: Schema,
    pub(crate) columns: Vec<(String, ColumnKind)>,
}

impl TableSchema {
    /// A contract from its columns; `about` tells what a row is.
    pub const fn new(name: &'static str, about: &'static str, columns: &'static [ColumnSpec]) -> Self {
        Self { name, about, columns, sorted_by: &[], each: None }
    }

    /// Its rows are sorted by these columns.
    #[must_use]
    pub const fn sorted_by(self, columns: &'static [&'static str]) -> Self {
        Self { sorted_by: columns, ..self }
    }

    /// Further columns, for each of some names, which take the place of the `*`.
    #[must_use]
    pub const fn each(self, names: fn() -> Vec<String>, columns: &'static [ColumnSpec]) -> Self {
        Self { each: Some((names, columns)), ..self }
    }

    /// The name of the message and of the file.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// Where the table is and what a row is; paragraphs of Markdown, each line indented by a space.
    pub fn about(&self) -> &'static str {
        self.about
    }

    /// Its columns as they are declared. Those that are there for each of some names have a `*` in theirs.
    pub fn specs(&self) -> impl Iterator<Item = &'static ColumnSpec> {
        self.columns.iter().chain(self.each.map_or(&[][..], |(_, columns)| columns))
    }

    /// What a column means; `None` where there is no such column.
    pub fn meaning(&self, column: &str) -> Option<&'static str> {
        let is_meant = |pattern: &str| match pattern.split_once('*') {
            None => pattern == column,
            Some((before, after)) => column.strip_prefix(before).is_some_and(|rest| rest.ends_with(after)),
        };
        self.specs().find(|spec| is_meant(spec.name)).map(ColumnSpec::meaning)
    }

    /// Every column with what it holds, in order.
    pub fn columns(&self) -> Vec<(String, ColumnKind)> {
        let own = self.columns.iter().map(|column| (column.name.to_owned(), column.kind));
        let each = self.each.map(|(names, columns)| {
            let of_name = |name: String| columns.iter().map(move |of| (of.name.replace('*', &name), of.kind));
            names().into_iter().flat_map(of_name)
        });
        own.chain(each.into_iter().flatten()).collect()
    }

    /// Parquet's message text.
    pub fn text(&self) -> String {
        self.text_with(&[])
    }

    fn text_with(&self, further: &[String]) -> String {
        let lines = self.columns().into_iter().map(|(name, kind)| kind.declaration(&name));
        let lines: String = lines.chain(further.iter().cloned()).collect();
        format!("message {} {{\n{lines}}}\n", self.name)
    }

    /// How the declaration has the table written.
    pub(crate) fn options(&self) -> WriteOptions {
        let stored = |encoding: Encoding| {
            self.columns.iter().filter(move |column| column.encoding == encoding).map(|column| column.name).collect()
        };
        WriteOptions {
            plain: stored(Encoding::Plain),
            delta_encoded: stored(Encoding::Delta),
            sorted_by: self.sorted_by.to_vec(),
            ..WriteOptions::default()
        }
    }

    /// Whether files of earlier versions lack a column.
    pub(super) fn is_later(&self, column: &str) -> bool {
        self.columns.iter().any(|spec| spec.name == column && spec.is_later)
    }

    /// With further columns behind its own, given as lines of the message text.
    pub(crate) fn parse_with(&self, further: &[String]) -> Result<ParsedSchema, TableError> {
        let problem = |problem: String| TableError::Schema { schema: self.name, problem };
        let text = self.text_with(further);
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
