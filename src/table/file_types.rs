//! The type of each column of any Parquet file, in words.

use std::path::Path;

use parquet::arrow::arrow_reader::{ArrowReaderMetadata, ArrowReaderOptions};
use parquet::basic::{ConvertedType, LogicalType};
use parquet::schema::types::ColumnDescriptor;

use super::error::TableError;
use super::guard::guarded;
use crate::artifact;

/// The columns of a file in order, each with the types of the values in it: one, but for structs. Only the footer is
/// read.
///
/// # Errors
///
/// When the file is not there, or is truncated or corrupted.
pub fn column_types(path: &Path) -> Result<Vec<(String, Vec<String>)>, TableError> {
    guarded(path, || {
        let file = artifact::open(path)?;
        let options = ArrowReaderOptions::new().with_skip_arrow_metadata(true);
        let footer = ArrowReaderMetadata::load(&file, options).map_err(TableError::parquet(path))?;
        let mut columns: Vec<(String, Vec<String>)> = Vec::new();
        for leaf in footer.metadata().file_metadata().schema_descr().columns() {
            let root = leaf.path().parts().first().cloned().unwrap_or_default();
            match columns.last_mut().filter(|(name, _)| *name == root) {
                Some((_, types)) => types.push(type_of(leaf)),
                None => columns.push((root, vec![type_of(leaf)])),
            }
        }
        Ok(columns)
    })
}

fn type_of(leaf: &ColumnDescriptor) -> String {
    match (leaf.logical_type_ref(), leaf.converted_type()) {
        (Some(LogicalType::Float16), _) => "float16".to_owned(),
        (Some(LogicalType::Integer { bit_width, is_signed: true }), _) => format!("int{bit_width}"),
        (Some(LogicalType::Integer { bit_width, is_signed: false }), _) => format!("uint{bit_width}"),
        (Some(LogicalType::String), _) | (_, ConvertedType::UTF8) => "string".to_owned(),
        (_, ConvertedType::NONE) => leaf.physical_type().to_string().to_lowercase(),
        (_, converted) => converted.to_string().to_lowercase(),
    }
}
