//! Arrow columns as the statistics take them, and statistics as Arrow columns.

use std::sync::Arc;

use arrow::array::{ArrayRef, AsArray as _, Float64Array, Int64Array, ListArray, RecordBatch};
use arrow::buffer::OffsetBuffer;
use arrow::datatypes::{DataType, Field, Float32Type, Float64Type, Int64Type};
use arrow::error::ArrowError;

use crate::dataset::feature::Dtype;
use crate::dataset::statistics::NumericFeature;
use crate::table::Values;

/// The flags among the columns of the features, which Arrow keeps as bits.
pub(super) fn flags(rows: &RecordBatch, features: &[NumericFeature]) -> Vec<Vec<bool>> {
    let of = |feature: &NumericFeature| rows.column_by_name(&feature.name)?.as_boolean_opt();
    let flags = |feature: &NumericFeature| of(feature).map(|column| column.values().iter().collect());
    features.iter().map(|feature| flags(feature).unwrap_or_default()).collect()
}

/// The columns of the features. Each must be there and of its kind.
pub(super) fn values<'r>(
    rows: &'r RecordBatch,
    features: &'r [NumericFeature],
    flags: &'r [Vec<bool>],
) -> Result<Vec<(&'r str, Values<'r>)>, ArrowError> {
    let column = |(feature, flags): (&'r NumericFeature, &'r Vec<bool>)| {
        let column = rows.column_by_name(&feature.name);
        let values = match feature.dtype {
            Dtype::Bool => (flags.len() == rows.num_rows()).then_some(Values::Boolean(flags)),
            _ => column.and_then(|column| numbers(column, feature)),
        };
        let wrong = || ArrowError::SchemaError(format!("column {:?} is not as it is declared", feature.name));
        Ok((feature.name.as_str(), values.ok_or_else(wrong)?))
    };
    features.iter().zip(flags).map(column).collect()
}

fn numbers<'r>(column: &'r ArrayRef, feature: &NumericFeature) -> Option<Values<'r>> {
    let width = feature.width;
    match column.data_type() {
        DataType::Float32 => Some(Values::Float32(column.as_primitive_opt::<Float32Type>()?.values())),
        DataType::Float64 => Some(Values::Float64(column.as_primitive_opt::<Float64Type>()?.values())),
        DataType::Int64 => Some(Values::Int64(column.as_primitive_opt::<Int64Type>()?.values())),
        DataType::FixedSizeList(item, length) if *length as usize == width => {
            let list = column.as_fixed_size_list_opt()?;
            let begin = list.value_offset(0) as usize;
            let end = begin + width * column.len();
            match item.data_type() {
                DataType::Float32 => Some(Values::Float32Vector(
                    &list.values().as_primitive_opt::<Float32Type>()?.values()[begin..end],
                    width,
                )),
                DataType::Float64 => Some(Values::Float64Vector(
                    &list.values().as_primitive_opt::<Float64Type>()?.values()[begin..end],
                    width,
                )),
                DataType::Int64 => Some(Values::Int64Vector(
                    &list.values().as_primitive_opt::<Int64Type>()?.values()[begin..end],
                    width,
                )),
                _ => None,
            }
        }
        _ => None,
    }
}

/// Lists of one length as a column of a field.
pub(super) fn lists(field: &Field, values: Values<'_>) -> Result<ArrayRef, ArrowError> {
    let (numbers, width): (ArrayRef, usize) = match values {
        Values::Float64Vector(values, width) => (Arc::new(Float64Array::from(values.to_vec())), width),
        Values::Int64Vector(values, width) => (Arc::new(Int64Array::from(values.to_vec())), width),
        _ => return Err(ArrowError::SchemaError(format!("column {:?} is no list of numbers", field.name()))),
    };
    let DataType::List(item) = field.data_type() else {
        return Err(ArrowError::SchemaError(format!("column {:?} is {}", field.name(), field.data_type())));
    };
    let offsets = OffsetBuffer::from_lengths(std::iter::repeat_n(width, values.n_rows()));
    Ok(Arc::new(ListArray::try_new(Arc::clone(item), offsets, numbers, None)?))
}
