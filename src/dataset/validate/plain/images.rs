//! Columns of encoded pictures: each is there and of the declared size, and the first and last of an episode decode.

use arrow::array::{Array as _, ArrayRef, AsArray as _, BinaryArray, LargeBinaryArray, StructArray};

use crate::dataset::plain::Declared;
use crate::dataset::validate::plain::run::Run;
use crate::video::{decode_picture, is_picture, picture_size};

/// What is wrong first, and in which row.
pub(super) fn check_images(
    feature: &Declared,
    column: &ArrayRef,
    runs: &[Run],
) -> Option<(&'static str, usize, String)> {
    let Some(pictures) = column.as_struct_opt().and_then(Encoded::of) else {
        let problem = format!("it is declared as pictures, but is {}", column.data_type());
        return Some(("file.columns", 0, problem));
    };
    let expected = feature.size_px();
    for row in 0..column.len() {
        let Some(bytes) = pictures.get(row) else {
            return Some(("file.null", row, "it has no picture".to_owned()));
        };
        if !is_known(bytes) {
            match is_picture(bytes) {
                true => continue,
                false => {
                    return Some(("pictures.decode", row, "its bytes are no picture of any known form".to_owned()));
                }
            }
        }
        let size = match picture_size(bytes) {
            Ok(size) => size,
            Err(error) => return Some(("pictures.decode", row, error.to_string())),
        };
        if expected.is_some_and(|expected| expected != size) {
            let problem = format!("a picture is {}x{}, but its shape is {:?}", size[0], size[1], feature.shape);
            return Some(("pictures.format", row, problem));
        }
    }
    let ends = runs.iter().flat_map(|run| {
        let first = (run.first_frame == 0).then_some(run.rows.start);
        first.into_iter().chain(run.is_last.then(|| run.rows.end.saturating_sub(1)))
    });
    for row in ends {
        if let Some(bytes) = pictures.get(row).filter(|bytes| is_known(bytes))
            && let Err(error) = decode_picture(bytes)
        {
            return Some(("pictures.decode", row, error.to_string()));
        }
    }
    None
}

/// Whether a picture is one that is decoded here: PNG or JPEG.
fn is_known(bytes: &[u8]) -> bool {
    bytes.starts_with(b"\x89PNG") || bytes.starts_with(&[0xff, 0xd8])
}

/// Bytes of pictures, in either kind of column.
pub(super) enum Encoded<'c> {
    Short(&'c BinaryArray),
    Long(&'c LargeBinaryArray),
}

impl<'c> Encoded<'c> {
    pub(super) fn of(column: &'c StructArray) -> Option<Self> {
        let bytes = column.column_by_name("bytes")?;
        bytes.as_binary_opt::<i32>().map(Self::Short).or_else(|| bytes.as_binary_opt::<i64>().map(Self::Long))
    }

    fn get(&self, row: usize) -> Option<&'c [u8]> {
        match self {
            Self::Short(bytes) => bytes.is_valid(row).then(|| bytes.value(row)),
            Self::Long(bytes) => bytes.is_valid(row).then(|| bytes.value(row)),
        }
    }
}
