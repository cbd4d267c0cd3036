//! Which files each table of a dataset has, for readers that take tables as a whole.

use std::path::{Path, PathBuf};

use crate::artifact::read_json;
use crate::dataset::DatasetError;
use crate::dataset::files::info::{Info, NtpInfo};
use crate::dataset::files::layout::{self, FilePlace};
use crate::dataset::schema::{CALLS, EPISODES, FRAMES, SCOPES, SUBTASKS, TASKS};
use crate::table::{TableReader, TableSchema};

/// The files of each table, by the table's name. Only footers are read.
///
/// # Errors
///
/// When a file cannot be opened, or the files of a table have another number of rows than the dataset counts: then one
/// is missing.
pub fn table_files(root: &Path) -> Result<Vec<(&'static str, Vec<PathBuf>)>, DatasetError> {
    let info: Info = read_json(&root.join(layout::INFO))?;
    let ntp: NtpInfo = read_json(&root.join(layout::NTP_INFO))?;
    let rolling = [
        (FRAMES, layout::DATA, info.total_frames),
        (CALLS, layout::CALLS, ntp.total_calls),
        (SCOPES, layout::SCOPES, ntp.total_scopes),
    ];
    let single = [(EPISODES, layout::EPISODES), (TASKS, layout::TASKS), (SUBTASKS, layout::SUBTASKS)];
    let mut tables = Vec::new();
    for (schema, folder, n_rows) in rolling {
        tables.push((schema.name(), files_of(root, &schema, folder, n_rows)?));
    }
    tables.extend(single.map(|(schema, file)| (schema.name(), vec![root.join(file)])));
    Ok(tables)
}

/// Files are numbered without gaps; the first that is not there ends the table.
fn files_of(root: &Path, schema: &TableSchema, folder: &str, expected: u64) -> Result<Vec<PathBuf>, DatasetError> {
    let mut files = Vec::new();
    let (mut place, mut n_rows) = (FilePlace::default(), 0);
    loop {
        let path = place.in_dataset(root, folder);
        if !files.is_empty() && !place.is_there(root, folder)? {
            break;
        }
        n_rows += TableReader::open_columns(&path, schema, &[])?.n_rows();
        files.push(path);
        place = place.next();
    }
    if n_rows != expected {
        let problem = format!("its {} files have {n_rows} rows, but the dataset counts {expected}", files.len());
        return Err(DatasetError::Count { path: root.join(folder), problem });
    }
    Ok(files)
}
