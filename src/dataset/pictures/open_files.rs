//! Files that stay open between reads.

use crate::dataset::files::layout::FilePlace;

/// Most files that are open at once: well below what systems allow.
const MAX_OPEN: usize = 64;

/// The files that were read last, the latest at the end.
pub(super) struct OpenFiles<R>(Vec<(FilePlace, R)>);

impl<R> Default for OpenFiles<R> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<R> OpenFiles<R> {
    /// The reader of a file, which is opened unless it is open; the one that was not read for longest gives way to it.
    pub(super) fn get<E>(&mut self, place: FilePlace, open: impl FnOnce() -> Result<R, E>) -> Result<&mut R, E> {
        let entry = match self.0.iter().position(|(at, _)| *at == place) {
            Some(position) => self.0.remove(position),
            None => (place, open()?),
        };
        if self.0.len() >= MAX_OPEN {
            self.0.remove(0);
        }
        self.0.push(entry);
        let last = self.0.len() - 1;
        Ok(&mut self.0[last].1)
    }
}

#[cfg(test)]
mod tests {
    use super::{FilePlace, MAX_OPEN, OpenFiles};

    #[test]
    fn a_file_is_opened_once_until_too_many_others_were_read() {
        let mut files = OpenFiles::<u32>::default();
        let mut opened = Vec::new();
        let mut get = |file: u32| {
            let open = || {
                opened.push(file);
                Ok::<_, ()>(file)
            };
            assert_eq!(files.get(FilePlace { chunk: 0, file }, open), Ok(&mut { file }));
        };
        let others = 1..MAX_OPEN as u32;
        [0, 0].into_iter().chain(others).chain([0, 99, 0, 1]).for_each(&mut get);
        let expected: Vec<u32> = (0..MAX_OPEN as u32).chain([99, 1]).collect();
        assert_eq!(opened, expected);
    }
}
