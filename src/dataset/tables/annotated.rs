//! Programs that were annotated elsewhere: a root, and below it runs of frames.

use std::collections::BTreeSet;

use crate::artifact::sha256_bytes;
use crate::trace::Span;

/// Name of the root program.
pub(crate) const ROOT: &str = "task";
/// What a dataset that was annotated elsewhere says in `ntp/info.json`.
pub(crate) const ANNOTATED_BY: &str = "subtask_index";

/// A call: the root's, or that of a sub-task. What it is given and what it hands on are its frames.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AnnotatedCall<'t> {
    pub(crate) program: &'t str,
    pub(crate) frames: Span,
}

/// The programs of annotated episodes, in an order that does not depend on that of the episodes, with the hash that
/// names them.
pub(crate) fn vocabulary(subtasks: &[String]) -> (Vec<String>, String) {
    let texts: BTreeSet<&String> = subtasks.iter().collect();
    let programs: Vec<String> = std::iter::once(ROOT.to_owned()).chain(texts.into_iter().cloned()).collect();
    let hash = sha256_bytes(programs.join("\n").as_bytes())[..16].to_owned();
    (programs, hash)
}
