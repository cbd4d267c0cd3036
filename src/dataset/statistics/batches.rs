//! Arrow columns as the statistics take them, and statistics as Arrow columns.

use std::sync::Arc;

use arrow::array::{ArrayRef, AsArray as _, Float64Array, Int64Array, ListArray, RecordBatch};
use arrow::buffer::OffsetBuffer;
use arrow::datatypes::{DataType, Field, Float32Type, Float64Type, Int64Type, Schema};
use arrow::error::ArrowError;

use crate::dataset::files::info::Dtype;
use crate::dataset::files::info::Info;
use crate::dataset::statistics::NumericFeature;
use crate::dataset::tables::frames::feature::{FEATURES, Feature};
use crate::table::Values;

/// The features that have statistics, among the columns of the frames.
pub(crate) fn numeric_features(info: &Info, columns: &Schema) -> Vec<NumericFeature> {
    let numeric = |name: &str| {
        let (_, declared) = info.features.0.iter().find(|(feature, _)| feature == name)?;
        let is_number = matches!(declared.dtype, Dtype::Float32 | Dtype::Float64 | Dtype::Int64 | Dtype::Bool);
        let of_ours = FEATURES.iter().find(|feature| feature.name == name);
        let is_of_episodes = of_ours.is_some_and(Feature::has_episode_statistics);
        let &[width] = &declared.shape[..] else { return None };
        (is_number && width > 0).then(|| NumericFeature {
            name: name.to_owned(),
            dtype: declared.dtype,
            width,
            is_of_episodes,
        })
    };
    columns.fields().iter().filter_map(|field| numeric(field.name())).collect()
}

/// The flags among the columns of the features, which Arrow keeps as bits.
pub(crate) fn flags(rows: &RecordBatch, features: &[NumericFeature]) -> Vec<Vec<bool>> {
    let of = |feature: &NumericFeature| rows.column_by_name(&feature.name)?.as_boolean_opt();
    let flags = |feature: &NumericFeature| of(feature).map(|column| column.values().iter().collect());
    features.iter().map(|feature| flags(feature).unwrap_or_default()).collect()
}

/// The columns of the features. Each must be there and of its kind.
pub(crate) fn values<'r>(
    rows: &'r RecordBatch,
    features: &'r [NumericFeature],
    flags: &'r [Vec<bool>],
) -> Result<Vec<(&'r str, Values<'r>)>, ArrowError> {
    let column = |(feature, flags): (&'r NumericFeature, &'r Vec<bool>)| {
        let column = rows.column_by_name(&feature.name);
        let values = match feature.dtype {
            Dtype::Bool => (flags.len() == rows.num_rows()).then_some(Values::Boolean(flags)),
            _ => column.and_then(|column| numbers(column, feature)).filter(|values| is_of(*values, feature.dtype)),
        };
        let wrong = || ArrowError::SchemaError(format!("column {:?} is not as it is declared", feature.name));
        Ok((feature.name.as_str(), values.ok_or_else(wrong)?))
    };
    features.iter().zip(flags).map(column).collect()
}

/// Whether values are of the type that is declared.
fn is_of(values: Values<'_>, dtype: Dtype) -> bool {
    match values {
        Values::Float32(_) | Values::Float32Vector(..) => dtype == Dtype::Float32,
        Values::Float64(_) | Values::Float64Vector(..) => dtype == Dtype::Float64,
        Values::Int64(_) | Values::Int64Vector(..) => dtype == Dtype::Int64,
        _ => false,
    }
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
            vectors(list.values(), item.data_type(), begin..begin + width * column.len(), width)
        }
        DataType::List(item) => {
            let list = column.as_list_opt::<i32>()?;
            let is_regular = list.offsets().windows(2).all(|ends| ends[1] - ends[0] == width as i32);
            let (begin, end) = (*list.offsets().first()? as usize, *list.offsets().last()? as usize);
            is_regular.then(|| vectors(list.values(), item.data_type(), begin..end, width)).flatten()
        }
        _ => None,
    }
}

fn vectors<'r>(
    values: &'r ArrayRef,
    data_type: &DataType,
    range: std::ops::Range<usize>,
    width: usize,
) -> Option<Values<'r>> {
    match data_type {
        DataType::Float32 => {
            Some(Values::Float32Vector(&values.as_primitive_opt::<Float32Type>()?.values()[range], width))
        }
        DataType::Float64 => {
            Some(Values::Float64Vector(&values.as_primitive_opt::<Float64Type>()?.values()[range], width))
        }
        DataType::Int64 => Some(Values::Int64Vector(&values.as_primitive_opt::<Int64Type>()?.values()[range], width)),
        _ => None,
    }
}

/// Single numbers as a column; `None` for anything else.
pub(crate) fn scalars(values: Values<'_>) -> Option<ArrayRef> {
    match values {
        Values::Int64(values) => Some(Arc::new(Int64Array::from(values.to_vec()))),
        Values::Float64(values) => Some(Arc::new(Float64Array::from(values.to_vec()))),
        _ => None,
    }
}

/// Lists of one length as a column of a field.
pub(crate) fn lists(field: &Field, values: Values<'_>) -> Result<ArrayRef, ArrowError> {
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
