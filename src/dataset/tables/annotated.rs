//! Programs that were annotated elsewhere: a root, and below it runs of frames.

use std::collections::BTreeSet;

use crate::artifact::sha256_bytes;
use crate::trace::Span;

/// The family of tasks of others.
pub(crate) const FAMILY: &str = "annotated";
/// Name of the root program.
pub(crate) const ROOT: &str = "task";
/// A call: the root's, or that of a label. It sees all frames of its episode, and hands on its own.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AnnotatedCall {
    /// Number of its text; `None` for the root.
    pub(crate) text: Option<u32>,
    /// Position of the call that it lies in.
    pub(crate) caller: Option<u32>,
    /// 0 for the root.
    pub(crate) depth: u8,
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
