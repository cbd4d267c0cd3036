//! Reading an MP4 file's boxes with a library, whatever the file is.

use std::fs::File;
use std::io::{BufReader, Error, Read, Result, Seek, SeekFrom};
use std::path::Path;

use re_mp4::Mp4;

use crate::artifact::{self, IoError};
use crate::table::catch_panic;
use crate::video::VideoError;

/// A sound file's places are read a few times each.
const MOST_VISITS: u32 = 100;

/// An MP4 file's boxes, the file, and how long it is.
pub(super) fn read_container(path: &Path) -> std::result::Result<(Mp4, File, u64), VideoError> {
    let wrong = |message: String| VideoError::Container { path: path.to_owned(), message };
    let file = artifact::open(path)?;
    let len = file.metadata().map_err(IoError::system("read", path))?.len();
    let reader = Watched::new(BufReader::new(file.try_clone().map_err(IoError::system("open", path))?));
    // The library indexes by numbers that it reads; a damaged file must not end the program.
    match catch_panic(|| Mp4::read(reader, len)) {
        Ok(Ok(mp4)) => Ok((mp4, file, len)),
        Ok(Err(error)) => Err(wrong(error.to_string())),
        Err(words) => Err(wrong(format!("the video's tables contradict each other: {words}"))),
    }
}

/// A reader that fails where it is led in a circle: the library reads a box of length 0 again and again.
///
/// One place is watched until twice as many steps were made (Brent's way to find a cycle).
struct Watched<R> {
    inner: R,
    at: u64,
    n_steps: u64,
    watched: u64,
    n_visits: u32,
}

impl<R> Watched<R> {
    fn new(inner: R) -> Self {
        Self { inner, at: 0, n_steps: 0, watched: 0, n_visits: 0 }
    }

    fn step(&mut self) -> Result<()> {
        self.n_steps += 1;
        if self.n_steps.is_power_of_two() {
            (self.watched, self.n_visits) = (self.at, 0);
        } else if self.at == self.watched {
            self.n_visits += 1;
        }
        if self.n_visits > MOST_VISITS {
            return Err(Error::other(format!("a box at byte {} leads to itself", self.at)));
        }
        Ok(())
    }
}

impl<R: Read> Read for Watched<R> {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize> {
        self.step()?;
        let n_read = self.inner.read(bytes)?;
        self.at += n_read as u64;
        Ok(n_read)
    }
}

impl<R: Seek> Seek for Watched<R> {
    fn seek(&mut self, to: SeekFrom) -> Result<u64> {
        self.at = self.inner.seek(to)?;
        Ok(self.at)
    }

    fn stream_position(&mut self) -> Result<u64> {
        Ok(self.at)
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Cursor, Read as _, Seek as _, SeekFrom};

    use super::{MOST_VISITS, Watched};

    #[test]
    fn a_circle_is_left_and_a_long_way_is_gone_to_its_end() {
        let bytes = vec![0; 1 << 20];
        let mut long = Watched::new(Cursor::new(&bytes));
        let mut four = [0; 4];
        (0..bytes.len() / 4).for_each(|_| long.read_exact(&mut four).unwrap());
        let mut round = Watched::new(Cursor::new(&bytes));
        let mut go = || {
            round.seek(SeekFrom::Start(40))?;
            (0..3).try_for_each(|_| round.read_exact(&mut four))
        };
        let n_rounds = (0..10_000).position(|_| go().is_err());
        assert!(n_rounds.is_some_and(|n_rounds| n_rounds < 4 * MOST_VISITS as usize), "{n_rounds:?}");
    }
}
