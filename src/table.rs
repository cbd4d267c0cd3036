//! Parquet tables: columns in memory to and from a file whose schema text is in schemas/parquet.
