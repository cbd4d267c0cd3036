//! The numbers of a column: as values, as bytes on disk, and as keys, whole numbers of the same order.

use std::ops::Range;

use crate::dataset::files::info::Dtype;
use crate::table::Values;

/// Zeros lose their sign, so that order and equality agree.
fn key_of_f32(value: f32) -> u32 {
    let bits = (value + 0.0).to_bits();
    bits ^ ((bits as i32 >> 31) as u32 | 1 << 31)
}

fn key_of_f64(value: f64) -> u64 {
    let bits = (value + 0.0).to_bits();
    bits ^ ((bits as i64 >> 63) as u64 | 1 << 63)
}

fn key_of_i64(value: i64) -> u64 {
    value as u64 ^ 1 << 63
}

/// The key of a value, which is of the type.
pub(super) fn key_of(dtype: Dtype, value: f64) -> u64 {
    match dtype {
        Dtype::Float32 => u64::from(key_of_f32(value as f32)),
        Dtype::Float64 => key_of_f64(value),
        Dtype::Int64 => key_of_i64(value as i64),
        Dtype::Bool | Dtype::String | Dtype::Image | Dtype::Video | Dtype::Language | Dtype::Other => value as u64,
    }
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
        Dtype::Bool | Dtype::String | Dtype::Image | Dtype::Video | Dtype::Language | Dtype::Other => key as f64,
    }
}

/// Bytes of one key on disk.
pub(super) fn n_bytes(dtype: Dtype) -> usize {
    match dtype {
        Dtype::Float32 => 4,
        Dtype::Bool | Dtype::String | Dtype::Image | Dtype::Video | Dtype::Language | Dtype::Other => 1,
        Dtype::Float64 | Dtype::Int64 => 8,
    }
}

/// The numbers of some rows as values, row by row. A column of texts has none.
pub(in crate::dataset) fn copy_values(column: Values<'_>, rows: Range<usize>, values: &mut Vec<f64>) {
    values.clear();
    match column {
        Values::Float32(all) => values.extend(all[rows].iter().map(|&value| f64::from(value))),
        Values::Float32Vector(all, width) => {
            values.extend(all[rows.start * width..rows.end * width].iter().map(|&value| f64::from(value)));
        }
        Values::Float64Vector(all, width) => values.extend_from_slice(&all[rows.start * width..rows.end * width]),
        Values::Int64Vector(all, width) => {
            values.extend(all[rows.start * width..rows.end * width].iter().map(|&value| value as f64));
        }
        Values::Float64(all) => values.extend_from_slice(&all[rows]),
        Values::Int64(all) => values.extend(all[rows].iter().map(|&value| value as f64)),
        Values::Boolean(all) => values.extend(all[rows].iter().map(|&value| f64::from(u8::from(value)))),
        _ => {}
    }
}

/// The keys of some rows as bytes, row by row.
pub(super) fn copy_keys(column: Values<'_>, rows: Range<usize>, bytes: &mut Vec<u8>) {
    match column {
        Values::Float32(all) => copy_chunks(&all[rows], |&value| key_of_f32(value).to_le_bytes(), bytes),
        Values::Float32Vector(all, width) => {
            let all = &all[rows.start * width..rows.end * width];
            copy_chunks(all, |&value| key_of_f32(value).to_le_bytes(), bytes);
        }
        Values::Float64(all) => copy_chunks(&all[rows], |&value| key_of_f64(value).to_le_bytes(), bytes),
        Values::Float64Vector(all, width) => {
            let all = &all[rows.start * width..rows.end * width];
            copy_chunks(all, |&value| key_of_f64(value).to_le_bytes(), bytes);
        }
        Values::Int64Vector(all, width) => {
            let all = &all[rows.start * width..rows.end * width];
            copy_chunks(all, |&value| key_of_i64(value).to_le_bytes(), bytes);
        }
        Values::Int64(all) => copy_chunks(&all[rows], |&value| key_of_i64(value).to_le_bytes(), bytes),
        Values::Boolean(all) => copy_chunks(&all[rows], |&value| [u8::from(value)], bytes),
        _ => bytes.clear(),
    }
}

fn copy_chunks<T, const N: usize>(values: &[T], chunk: impl Fn(&T) -> [u8; N], bytes: &mut Vec<u8>) {
    bytes.resize(N * values.len(), 0);
    bytes.as_chunks_mut::<N>().0.iter_mut().zip(values).for_each(|(bytes, value)| *bytes = chunk(value));
}

/// The keys of one dimension of rows that are `width` keys wide.
pub(super) fn read_keys(dtype: Dtype, bytes: &[u8], (dimension, width): (usize, usize), keys: &mut Vec<u64>) {
    keys.clear();
    match dtype {
        Dtype::Float32 => {
            let rows = bytes.as_chunks::<4>().0.chunks_exact(width);
            keys.extend(rows.map(|row| u64::from(u32::from_le_bytes(row[dimension]))));
        }
        Dtype::Float64 | Dtype::Int64 => {
            let rows = bytes.as_chunks::<8>().0.chunks_exact(width);
            keys.extend(rows.map(|row| u64::from_le_bytes(row[dimension])));
        }
        Dtype::Bool | Dtype::String | Dtype::Image | Dtype::Video | Dtype::Language | Dtype::Other => {
            keys.extend(bytes.chunks_exact(width).map(|row| u64::from(row[dimension])));
        }
    }
}
