//! Numbers as whole numbers of the same order, so that they can be sorted and selected digit by digit.

use crate::dataset::feature::Dtype;

/// The values of a numeric column, those of one row after another.
#[derive(Clone, Copy)]
pub(crate) enum Numbers<'a> {
    Float32(&'a [f32]),
    Float64(&'a [f64]),
    Int64(&'a [i64]),
    Boolean(&'a [bool]),
}

impl Numbers<'_> {
    /// One dimension of the rows from `first_row` on, as values and as keys.
    pub(super) fn copy_dimension(
        self,
        first_row: usize,
        (dimension, width): (usize, usize),
        values: &mut Vec<f64>,
        keys: &mut Vec<u64>,
    ) {
        values.clear();
        keys.clear();
        match self {
            Self::Float32(all) => {
                let column = all[first_row * width..].chunks_exact(width).map(|row| row[dimension]);
                keys.extend(column.clone().map(key_of_f32));
                values.extend(column.map(f64::from));
            }
            Self::Float64(all) => {
                keys.extend(all[first_row..].iter().map(|&value| key_of_f64(value)));
                values.extend(&all[first_row..]);
            }
            Self::Int64(all) => {
                keys.extend(all[first_row..].iter().map(|&value| key_of_i64(value)));
                values.extend(all[first_row..].iter().map(|&value| value as f64));
            }
            Self::Boolean(all) => {
                keys.extend(all[first_row..].iter().map(|&value| u64::from(value)));
                values.extend(all[first_row..].iter().map(|&value| f64::from(u8::from(value))));
            }
        }
    }
}

/// Bytes that hold any key of a type.
pub(super) fn key_bytes(dtype: Dtype) -> usize {
    match dtype {
        Dtype::Float32 => 4,
        Dtype::Bool | Dtype::String => 1,
        Dtype::Float64 | Dtype::Int64 => 8,
    }
}

/// Zeros lose their sign, so that order and equality agree.
fn key_of_f32(value: f32) -> u64 {
    let bits = (value + 0.0).to_bits();
    u64::from(if bits >> 31 == 0 { bits | 1 << 31 } else { !bits })
}

fn key_of_f64(value: f64) -> u64 {
    let bits = (value + 0.0).to_bits();
    if bits >> 63 == 0 { bits | 1 << 63 } else { !bits }
}

fn key_of_i64(value: i64) -> u64 {
    value as u64 ^ 1 << 63
}

/// The value of a key.
pub(super) fn value_of(dtype: Dtype, key: u64) -> f64 {
    match dtype {
        Dtype::Float32 => {
            let bits = key as u32;
            f64::from(f32::from_bits(if bits >> 31 == 1 { bits & !(1 << 31) } else { !bits }))
        }
        Dtype::Float64 => f64::from_bits(if key >> 63 == 1 { key & !(1 << 63) } else { !key }),
        Dtype::Int64 => (key ^ 1 << 63) as i64 as f64,
        Dtype::Bool | Dtype::String => key as f64,
    }
}
