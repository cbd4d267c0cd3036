//! Files of Git LFS that were not fetched: a few lines stand where the content should be.

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

/// The first bytes of such a file.
const HEAD: &[u8] = b"version https://git-lfs";

/// What is wrong with a file whose content was not fetched; `None` for any other.
pub(crate) fn pointer_problem(path: &Path) -> Option<&'static str> {
    let mut head = [0; HEAD.len()];
    let is_pointer = File::open(path).and_then(|mut file| file.read_exact(&mut head)).is_ok() && head == HEAD;
    is_pointer.then_some("it is a Git LFS pointer and not the file itself: fetch it with `git lfs pull`")
}
