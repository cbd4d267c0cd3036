//! Columns of others as arrays of the types that are reckoned with: whatever a reader would cast is cast.

use arrow::array::{Array as _, ArrayRef, AsArray as _, RecordBatch};
use arrow::compute::cast;
use arrow::datatypes::{DataType, Float32Type, Float64Type, Int64Type};

use crate::dataset::files::info::Dtype;
use crate::table::Values;

/// The whole numbers of a column; `None` where it is not there, not of numbers, or has nulls.
pub(crate) fn whole_numbers(batch: &RecordBatch, name: &str) -> Option<Vec<i64>> {
    let column = batch.column_by_name(name).filter(|column| is_whole(column.data_type()))?;
    let column = cast(column, &DataType::Int64).ok().filter(|column| column.null_count() == 0)?;
    Some(column.as_primitive_opt::<Int64Type>()?.values().to_vec())
}

/// The numbers of a column, likewise.
pub(crate) fn numbers(batch: &RecordBatch, name: &str) -> Option<Vec<f64>> {
    let column = batch.column_by_name(name).filter(|column| is_number(column.data_type()))?;
    let column = cast(column, &DataType::Float64).ok().filter(|column| column.null_count() == 0)?;
    Some(column.as_primitive_opt::<Float64Type>()?.values().to_vec())
}

/// The numbers of an array, likewise.
pub(crate) fn numbers_of(column: &ArrayRef) -> Option<Vec<f64>> {
    let column = if is_number(column.data_type()) { cast(column, &DataType::Float64).ok()? } else { return None };
    let numbers = column.as_primitive_opt::<Float64Type>().filter(|numbers| numbers.null_count() == 0)?;
    Some(numbers.values().to_vec())
}

/// The texts of a column; nulls are empty.
pub(crate) fn texts(batch: &RecordBatch, name: &str) -> Option<Vec<String>> {
    texts_of(batch.column_by_name(name)?)
}

/// The same of an array.
pub(crate) fn texts_of(column: &ArrayRef) -> Option<Vec<String>> {
    let column = if is_text(column.data_type()) { cast(column, &DataType::Utf8).ok()? } else { return None };
    let column = column.as_string_opt::<i32>()?;
    Some(column.iter().map(|text| text.unwrap_or_default().to_owned()).collect())
}

/// Lists of texts, a list a row; a single text is a list of one.
pub(crate) fn text_lists(batch: &RecordBatch, name: &str) -> Option<Vec<Vec<String>>> {
    let column = batch.column_by_name(name)?;
    if is_text(column.data_type()) {
        return Some(texts_of(column)?.into_iter().map(|text| vec![text]).collect());
    }
    (0..column.len()).map(|row| list_at(column, row).map_or(Some(Vec::new()), |list| texts_of(&list))).collect()
}

/// The list of a row, of whatever kind of list; `None` for null.
pub(crate) fn list_at(column: &ArrayRef, row: usize) -> Option<ArrayRef> {
    if column.is_null(row) {
        return None;
    }
    match column.data_type() {
        DataType::List(_) => Some(column.as_list_opt::<i32>()?.value(row)),
        DataType::LargeList(_) => Some(column.as_list_opt::<i64>()?.value(row)),
        DataType::FixedSizeList(..) => Some(column.as_fixed_size_list_opt()?.value(row)),
        _ => None,
    }
}

/// Numbers of a column as statistics take them, row by row without gaps: lists of one length are flattened, at any
/// depth.
pub(crate) enum FlatNumbers {
    Float32(ArrayRef),
    Float64(ArrayRef),
    Int64(ArrayRef),
    Bool(Vec<bool>),
}

/// Why numbers are not as they are declared.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum FlatProblem {
    /// Of another type.
    Type(String),
    /// A null in a row of the batch.
    Null(usize),
    /// A row with another number of values.
    Width(usize, usize),
}

impl FlatNumbers {
    /// Those of a column with `width` numbers a row.
    pub(crate) fn of(column: &ArrayRef, dtype: Dtype, width: usize) -> Result<Self, FlatProblem> {
        let n_rows = column.len();
        let flat = flatten(column, n_rows)?;
        let other = || FlatProblem::Type(column.data_type().to_string());
        if !is_number(flat.data_type()) && flat.data_type() != &DataType::Boolean {
            return Err(other());
        }
        if flat.len() != width * n_rows {
            return Err(FlatProblem::Width(0, flat.len() / n_rows.max(1)));
        }
        if flat.null_count() > 0 {
            let null = (0..flat.len()).find(|&at| flat.is_null(at)).unwrap_or(0);
            return Err(FlatProblem::Null(null / width.max(1)));
        }
        let typed = |to: DataType| cast(&flat, &to).map_err(|_error| other());
        Ok(match dtype {
            Dtype::Float32 => Self::Float32(typed(DataType::Float32)?),
            Dtype::Float64 => Self::Float64(typed(DataType::Float64)?),
            Dtype::Bool if width == 1 => {
                let flags = typed(DataType::Boolean)?;
                Self::Bool(flags.as_boolean_opt().ok_or_else(other)?.values().iter().collect())
            }
            _ => Self::Int64(typed(DataType::Int64)?),
        })
    }

    /// As columns of statistics have them.
    pub(crate) fn values(&self, width: usize) -> Values<'_> {
        match self {
            Self::Float32(flat) => match flat.as_primitive_opt::<Float32Type>() {
                Some(flat) => Values::Float32Vector(flat.values(), width),
                None => Values::Float32Vector(&[], width),
            },
            Self::Float64(flat) => match flat.as_primitive_opt::<Float64Type>() {
                Some(flat) => Values::Float64Vector(flat.values(), width),
                None => Values::Float64Vector(&[], width),
            },
            Self::Int64(flat) => match flat.as_primitive_opt::<Int64Type>() {
                Some(flat) => Values::Int64Vector(flat.values(), width),
                None => Values::Int64Vector(&[], width),
            },
            Self::Bool(flags) => Values::Boolean(flags),
        }
    }

    /// The first of them that is not finite.
    pub(crate) fn first_not_finite(&self) -> Option<usize> {
        match self {
            Self::Float32(flat) => {
                let values = flat.as_primitive_opt::<Float32Type>()?.values();
                let is_finite = values.iter().fold(0.0_f32, |sum, value| sum + value * 0.0) == 0.0;
                if is_finite { None } else { values.iter().position(|value| !value.is_finite()) }
            }
            Self::Float64(flat) => {
                let values = flat.as_primitive_opt::<Float64Type>()?.values();
                let is_finite = values.iter().fold(0.0_f64, |sum, value| sum + value * 0.0) == 0.0;
                if is_finite { None } else { values.iter().position(|value| !value.is_finite()) }
            }
            Self::Int64(_) | Self::Bool(_) => None,
        }
    }
}

/// The values below lists, of which each must have as many as the others.
fn flatten(column: &ArrayRef, n_rows: usize) -> Result<ArrayRef, FlatProblem> {
    let first_null = || (0..column.len()).find(|&row| column.is_null(row)).unwrap_or(0);
    let per_row = column.len() / n_rows.max(1);
    let inner = match column.data_type() {
        DataType::List(_) => match column.as_list_opt::<i32>() {
            Some(list) => {
                let offsets = list.offsets();
                check_regular(offsets.windows(2).map(|ends| ends[1] - ends[0]), per_row)?;
                let (begin, end) = (offsets[0] as usize, offsets[list.len()] as usize);
                list.values().slice(begin, end - begin)
            }
            None => return Ok(column.clone()),
        },
        DataType::LargeList(_) => match column.as_list_opt::<i64>() {
            Some(list) => {
                let offsets = list.offsets();
                check_regular(offsets.windows(2).map(|ends| (ends[1] - ends[0]) as i32), per_row)?;
                let (begin, end) = (offsets[0] as usize, offsets[list.len()] as usize);
                list.values().slice(begin, end - begin)
            }
            None => return Ok(column.clone()),
        },
        DataType::FixedSizeList(_, length) => match column.as_fixed_size_list_opt() {
            Some(list) => {
                let length = *length as usize;
                list.values().slice(list.value_offset(0) as usize, length * list.len())
            }
            None => return Ok(column.clone()),
        },
        _ => return Ok(column.clone()),
    };
    if column.null_count() > 0 {
        return Err(FlatProblem::Null(first_null() / per_row.max(1)));
    }
    flatten(&inner, n_rows)
}

fn check_regular(lengths: impl Iterator<Item = i32>, per_row: usize) -> Result<(), FlatProblem> {
    let mut first = None;
    for (at, length) in lengths.enumerate() {
        if *first.get_or_insert(length) != length {
            return Err(FlatProblem::Width(at / per_row.max(1), length.unsigned_abs() as usize));
        }
    }
    Ok(())
}

fn is_whole(kind: &DataType) -> bool {
    kind.is_integer()
}

fn is_number(kind: &DataType) -> bool {
    kind.is_integer() || kind.is_floating()
}

fn is_text(kind: &DataType) -> bool {
    match kind {
        DataType::Utf8 | DataType::LargeUtf8 | DataType::Utf8View => true,
        DataType::Dictionary(_, values) => is_text(values),
        _ => false,
    }
}
