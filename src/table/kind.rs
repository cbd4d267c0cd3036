//! What a column holds, as a word for messages and as what Parquet's type says.

use std::fmt;

use arrow::datatypes::DataType;
use parquet::basic::{ConvertedType, LogicalType, Repetition, Type as PhysicalType};
use parquet::schema::types::Type;

/// What one value is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Value {
    /// A signed 64-bit number.
    Int64,
    /// A 32-bit float.
    Float32,
    /// A 64-bit float.
    Float64,
    /// True or false.
    Boolean,
    /// UTF-8.
    Text,
    /// An encoded picture: `LeRobot`'s struct of bytes and path.
    Picture,
    /// A 64-bit float for each channel of a picture: `LeRobot`'s lists `[3][1][1]`.
    Channels,
}

/// How many values a row has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// One.
    Required,
    /// One or none.
    Optional,
    /// Any number, in order.
    List,
}

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ColumnKind {
    /// What one value is.
    pub value: Value,
    /// How many values a row has.
    pub form: Form,
}

impl ColumnKind {
    /// The kind that a Parquet field has; `None` for the many that no table of ours uses.
    pub(crate) fn of(field: &Type) -> Option<Self> {
        if field.is_primitive() {
            let form = match field.get_basic_info().repetition() {
                Repetition::REQUIRED => Form::Required,
                Repetition::OPTIONAL => Form::Optional,
                Repetition::REPEATED => return None,
            };
            return Some(Self { value: value_of(field)?, form });
        }
        if is_picture(field) {
            return Some(Self { value: Value::Picture, form: Form::Required });
        }
        let element = element_of(field)?;
        if element.is_primitive() {
            return value_of(element).map(|value| Self { value, form: Form::List });
        }
        let innermost = element_of(element_of(element)?)?;
        let is_channels = innermost.is_primitive() && value_of(innermost) == Some(Value::Float64);
        is_channels.then_some(Self { value: Value::Channels, form: Form::Required })
    }

    /// A column of this kind as a line of Parquet's message text.
    pub(crate) fn declaration(self, name: &str) -> String {
        let value = |name: &str| match self.value {
            Value::Int64 => format!("int64 {name}"),
            Value::Float32 => format!("float {name}"),
            Value::Float64 | Value::Channels => format!("double {name}"),
            Value::Boolean => format!("boolean {name}"),
            Value::Text => format!("binary {name} (STRING)"),
            Value::Picture => format!("binary {name}"),
        };
        let list = |name: &str, element: &str| {
            format!("required group {name} (LIST) {{ repeated group list {{ {element} }} }}")
        };
        let element = format!("required {};", value("element"));
        match (self.value, self.form) {
            (Value::Picture, _) => {
                format!("  required group {name} {{ optional binary bytes; optional binary path (STRING); }}\n")
            }
            (Value::Channels, _) => {
                format!("  {}\n", list(name, &list("element", &list("element", &element))))
            }
            (_, Form::Required) => format!("  required {};\n", value(name)),
            (_, Form::Optional) => format!("  optional {};\n", value(name)),
            (_, Form::List) => format!("  {}\n", list(name, &element)),
        }
    }

    /// What Arrow calls a column of this kind that may be null; `None` for lists and pictures, which never are.
    pub(crate) fn nullable_type(self) -> Option<DataType> {
        match (self.form, self.value) {
            (Form::List, _) | (_, Value::Picture | Value::Channels) => None,
            (_, Value::Int64) => Some(DataType::Int64),
            (_, Value::Float32) => Some(DataType::Float32),
            (_, Value::Float64) => Some(DataType::Float64),
            (_, Value::Boolean) => Some(DataType::Boolean),
            (_, Value::Text) => Some(DataType::Utf8),
        }
    }

    /// Whether a column of this kind can be read where `expected` is asked for: values are of the same type, and a
    /// column that may be null may still hold none.
    pub(crate) fn can_be_read_as(self, expected: Self) -> bool {
        self.value == expected.value && (self.form == Form::List) == (expected.form == Form::List)
    }
}

/// What a list is of; `None` where a field is no list.
fn element_of(field: &Type) -> Option<&Type> {
    if field.is_primitive() {
        return None;
    }
    let is_list = field.get_basic_info().converted_type() == ConvertedType::LIST
        || matches!(field.get_basic_info().logical_type_ref(), Some(LogicalType::List));
    let [list] = field.get_fields() else { return None };
    if !is_list || !list.is_group() {
        return None;
    }
    let [element] = list.get_fields() else { return None };
    Some(element)
}

/// Bytes, and a path that is not used.
fn is_picture(field: &Type) -> bool {
    let [bytes, path] = field.get_fields() else { return false };
    let is_bytes = |field: &Type| field.is_primitive() && field.get_physical_type() == PhysicalType::BYTE_ARRAY;
    bytes.name() == "bytes" && path.name() == "path" && is_bytes(bytes) && is_bytes(path)
}

fn value_of(field: &Type) -> Option<Value> {
    let info = field.get_basic_info();
    let plain = info.logical_type_ref().is_none() && info.converted_type() == ConvertedType::NONE;
    let text =
        matches!(info.logical_type_ref(), Some(LogicalType::String)) || info.converted_type() == ConvertedType::UTF8;
    match field.get_physical_type() {
        PhysicalType::INT64 if plain => Some(Value::Int64),
        PhysicalType::FLOAT if plain => Some(Value::Float32),
        PhysicalType::DOUBLE if plain => Some(Value::Float64),
        PhysicalType::BOOLEAN if plain => Some(Value::Boolean),
        PhysicalType::BYTE_ARRAY if text => Some(Value::Text),
        _ => None,
    }
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Int64 => "int64",
            Self::Float32 => "float32",
            Self::Float64 => "float64",
            Self::Boolean => "boolean",
            Self::Text => "text",
            Self::Picture => "picture",
            Self::Channels => "float64 for each channel",
        })
    }
}

impl fmt::Display for ColumnKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.form {
            Form::Required => write!(f, "{}", self.value),
            Form::Optional => write!(f, "optional {}", self.value),
            Form::List => write!(f, "list of {}", self.value),
        }
    }
}
