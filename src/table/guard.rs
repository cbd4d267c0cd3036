//! Turns panics of the Parquet reader on corrupted files into errors.
//!
//! The reader checks most of what it decodes, but not all: some flipped bits end in an assertion of its own. A file's
//! content must never stop the program, so such a panic is caught here and is not printed.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::path::Path;
use std::sync::Once;

use parquet::errors::ParquetError;

use crate::table::TableError;

thread_local! {
    static GUARDED: Cell<bool> = const { Cell::new(false) };
}

static QUIET_HOOK: Once = Once::new();

/// Runs a step of reading. What it borrows must not be used again after an error.
pub(crate) fn guarded<T>(path: &Path, step: impl FnOnce() -> Result<T, TableError>) -> Result<T, TableError> {
    catch_panic(step).unwrap_or_else(|words| {
        let source = ParquetError::General(format!("the file is corrupted: {words}"));
        Err(TableError::parquet(path)(source))
    })
}

/// Runs a step of another's code. What it borrows must not be used again after a panic, whose words are the error.
pub(crate) fn catch_panic<T>(step: impl FnOnce() -> T) -> Result<T, String> {
    QUIET_HOOK.call_once(|| {
        let loud = take_hook();
        set_hook(Box::new(move |panic| {
            if !GUARDED.get() {
                loud(panic);
            }
        }));
    });
    let before = GUARDED.replace(true);
    let result = catch_unwind(AssertUnwindSafe(step));
    GUARDED.set(before);
    result.map_err(|panic| {
        let words = panic.downcast_ref::<&str>().map(|words| (*words).to_owned());
        words.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_default()
    })
}
