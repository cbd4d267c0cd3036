//! The two streams: results on stdout, complaints on stderr.

use std::io::Write as _;
use std::path::Path;

use serde::Serialize;

use crate::commands::UsageError;

/// A result could not be printed.
#[derive(Debug, thiserror::Error)]
#[error("failed to write to stdout: {0}")]
struct StdoutError(#[source] std::io::Error);

/// Prints a result.
///
/// # Errors
///
/// When stdout is closed, or what it goes to is full.
pub(super) fn print(text: &str) -> anyhow::Result<()> {
    let end = if text.ends_with('\n') { "" } else { "\n" };
    let mut stdout = std::io::stdout().lock();
    let written = stdout.write_all(text.as_bytes()).and_then(|()| stdout.write_all(end.as_bytes()));
    Ok(written.and_then(|()| stdout.flush()).map_err(StdoutError)?)
}

/// Prints a result as indented JSON.
///
/// # Errors
///
/// As [`print`].
pub(super) fn print_json(value: &impl Serialize) -> anyhow::Result<()> {
    print(&serde_json::to_string_pretty(value)?)
}

/// Prints what went wrong. Nothing is left to do when stderr is closed.
pub(super) fn complain(error: &anyhow::Error) {
    let _closed = writeln!(std::io::stderr().lock(), "ntp: {}", in_words(error));
}

/// An error with its causes, each said once: many tell their cause themselves.
fn in_words(error: &anyhow::Error) -> String {
    error.chain().map(ToString::to_string).fold(String::new(), |said, cause| match said.contains(&cause) {
        true => said,
        false if said.is_empty() => cause,
        false => format!("{said}: {cause}"),
    })
}

/// Prints a note that is no result.
pub(super) fn note(text: &str) {
    let _closed = writeln!(std::io::stderr().lock(), "{text}");
}

/// Refuses to write a file over one that the command reads. Other files of the name are replaced, whole.
pub(super) fn refuse_replacing(source: &Path, option: &str, to: &Path) -> Result<(), UsageError> {
    let (Ok(read), Ok(there)) = (source.canonicalize(), to.canonicalize()) else { return Ok(()) };
    if there.is_file() && there.starts_with(&read) {
        let (to, source) = (to.display(), source.display());
        return Err(UsageError(format!("{option} {to}: this file is of {source}, which is read; choose another name")));
    }
    Ok(())
}

/// Whether the reader of stdout went away, which is no failure (`ntp … | head`).
pub(super) fn is_broken_pipe(error: &anyhow::Error) -> bool {
    let of_stdout = error.downcast_ref::<StdoutError>().map(|StdoutError(error)| error);
    let io = of_stdout.or_else(|| error.downcast_ref::<std::io::Error>());
    io.is_some_and(|error| error.kind() == std::io::ErrorKind::BrokenPipe)
}

#[cfg(test)]
mod tests {
    use anyhow::Context as _;

    use super::in_words;

    #[test]
    fn a_cause_that_was_told_is_not_told_again() {
        let error = || std::io::Error::other("disk is full");
        let told = Err::<(), _>(error()).context("failed to write a: disk is full").unwrap_err();
        assert_eq!(in_words(&told), "failed to write a: disk is full");
        let untold = Err::<(), _>(error()).context("failed to write a").unwrap_err();
        assert_eq!(in_words(&untold), "failed to write a: disk is full");
    }
}
