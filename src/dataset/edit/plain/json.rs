//! JSON as Arrow arrays, and numbers as JSON of a shape.

use std::sync::Arc;

use arrow::array::{ArrayRef, Float64Array, Int64Array, ListArray, StringArray, new_null_array};
use arrow::buffer::{NullBuffer, OffsetBuffer};
use arrow::datatypes::DataType;
use serde_json::Value;

/// Values as an array of a type: numbers, texts, and lists of them at any depth. What is of another kind is null.
pub(super) fn array_of(values: &[Option<&Value>], kind: &DataType) -> ArrayRef {
    match kind {
        DataType::Float64 => Arc::new(Float64Array::from_iter(values.iter().map(|value| (*value)?.as_f64()))),
        DataType::Int64 => Arc::new(Int64Array::from_iter(values.iter().map(|value| (*value)?.as_i64()))),
        DataType::Utf8 => Arc::new(StringArray::from_iter(values.iter().map(|value| (*value)?.as_str()))),
        DataType::List(item) => {
            let lists: Vec<Option<&Vec<Value>>> = values.iter().map(|value| (*value)?.as_array()).collect();
            let inner: Vec<Option<&Value>> = lists.iter().flatten().flat_map(|list| list.iter().map(Some)).collect();
            let lengths = lists.iter().map(|list| list.map_or(0, Vec::len));
            let nulls: NullBuffer = lists.iter().map(Option::is_some).collect();
            let offsets = OffsetBuffer::<i32>::from_lengths(lengths);
            let nulls = (nulls.null_count() > 0).then_some(nulls);
            match ListArray::try_new(Arc::clone(item), offsets, array_of(&inner, item.data_type()), nulls) {
                Ok(list) => Arc::new(list),
                Err(_) => new_null_array(kind, values.len()),
            }
        }
        other => new_null_array(other, values.len()),
    }
}

/// Numbers in nested lists: those of shape `[2, 3]` are two lists of three.
pub(super) fn shaped(numbers: &[f64], shape: &[usize]) -> Value {
    match shape {
        [_, rest @ ..] if !rest.is_empty() => {
            let size: usize = rest.iter().product();
            numbers.chunks(size.max(1)).map(|numbers| shaped(numbers, rest)).collect()
        }
        _ => numbers.iter().map(|&number| Value::from(number)).collect(),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::shaped;

    #[test]
    fn numbers_are_nested_as_their_shape_says() {
        assert_eq!(shaped(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0], &[2, 3]), json!([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]));
        assert_eq!(shaped(&[1.0], &[1]), json!([1.0]));
    }
}
