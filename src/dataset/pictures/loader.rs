//! Pictures of many episodes, decoded by a thread of their own before they are asked for.
//!
//! # Invariants
//!
//! What is given out depends on the dataset alone, not on what was announced or how fast the thread is. Memory holds
//! decoded pictures up to a limit; above it only those of the last two announcements stay.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle};

use crate::artifact::IoError;
use crate::dataset::pictures::shelf::{Decoded, Found, Shelf, Wanted};
use crate::dataset::{DatasetError, EpisodePictures};

/// Some rows of an episode.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EpisodeRows {
    /// Which episode of the dataset.
    pub episode: usize,
    /// Which of its rows, in rising order.
    pub rows: Vec<u32>,
}

/// The pictures of one camera at some rows of episodes, by their position in a list.
pub struct PictureLoader {
    size_px: [u32; 2],
    shared: Arc<Shared>,
    worker: Option<JoinHandle<()>>,
}

struct Shared {
    root: PathBuf,
    list: Vec<EpisodeRows>,
    shelf: Mutex<Shelf>,
    changed: Condvar,
}

impl PictureLoader {
    /// Begins with nothing decoded. About `most_bytes` of decoded pictures are kept for when they are wanted again.
    ///
    /// # Errors
    ///
    /// When the dataset has no such camera, or no pictures of one of the rows.
    pub fn open(root: &Path, camera: &str, list: Vec<EpisodeRows>, most_bytes: usize) -> Result<Self, DatasetError> {
        let pictures = EpisodePictures::open(root, camera)?;
        list.iter().try_for_each(|item| pictures.check_rows(item.episode, &item.rows))?;
        let size_px = pictures.size_px();
        let shelf = Mutex::new(Shelf::new(most_bytes));
        let shared = Arc::new(Shared { root: root.to_owned(), list, shelf, changed: Condvar::new() });
        let of_thread = Arc::clone(&shared);
        let worker = Builder::new().name("pictures".to_owned()).spawn(move || of_thread.work(pictures));
        let worker = worker.map_err(IoError::system("begin a thread for the pictures of", root))?;
        Ok(Self { size_px, shared, worker: Some(worker) })
    }

    /// Width and height, in pixels.
    pub fn size_px(&self) -> [u32; 2] {
        self.size_px
    }

    /// Says what will be wanted next; it is decoded in this order.
    pub fn announce(&self, wanted: &[Wanted]) {
        self.shared.lock().announce(wanted);
        self.shared.changed.notify_all();
    }

    /// Pictures `[height, width, 3]`, a byte each; waits for them.
    ///
    /// # Errors
    ///
    /// As [`EpisodePictures::visit`], or when the list has none there.
    pub fn get(&self, wanted: &Wanted) -> Found {
        let mut shelf = self.shared.lock();
        loop {
            if let Some(found) = shelf.find(wanted) {
                return found;
            }
            if shelf.has_ended {
                return Err(self.shared.wrong("the thread that decodes pictures has ended".to_owned()));
            }
            if shelf.hurry(wanted) {
                self.shared.changed.notify_all();
            }
            shelf = self.shared.changed.wait(shelf).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Bytes of decoded pictures that are kept now.
    pub fn n_bytes(&self) -> usize {
        self.shared.lock().n_bytes()
    }
}

impl Drop for PictureLoader {
    fn drop(&mut self) {
        self.shared.end();
        // A thread that ended by a panic has said so.
        let _outcome = self.worker.take().map(JoinHandle::join);
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Shelf> {
        self.shelf.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn end(&self) {
        self.lock().has_ended = true;
        self.changed.notify_all();
    }

    fn wrong(&self, problem: String) -> Arc<DatasetError> {
        Arc::new(DatasetError::Count { path: self.root.clone(), problem })
    }

    /// What the thread does until the end.
    fn work(&self, mut pictures: EpisodePictures) {
        let _ending = Ending(self);
        while let Some(wanted) = self.next() {
            let decoded = self.decode(&mut pictures, &wanted);
            self.lock().keep(&wanted, decoded);
            self.changed.notify_all();
        }
    }

    /// Waits for something to decode; nothing at the end.
    fn next(&self) -> Option<Wanted> {
        let mut shelf = self.lock();
        while !shelf.has_ended {
            let next = shelf.begin();
            if next.is_some() {
                return next;
            }
            shelf = self.changed.wait(shelf).unwrap_or_else(PoisonError::into_inner);
        }
        None
    }

    /// One for each that is wanted.
    fn decode(&self, pictures: &mut EpisodePictures, wanted: &Wanted) -> Vec<Decoded> {
        let mut decoded = Vec::with_capacity(wanted.frames.len());
        let outcome = self.rows(wanted).and_then(|(episode, rows)| {
            let visit = pictures.visit(episode, &rows, |picture| decoded.push(Ok(Arc::new(picture.bytes.clone()))));
            visit.map_err(Arc::new)
        });
        // What follows a picture that cannot be read has not been read either.
        decoded.resize(wanted.frames.len(), outcome.map(|()| Arc::default()));
        decoded
    }

    /// The episode, and which of its rows.
    fn rows(&self, wanted: &Wanted) -> Result<(usize, Vec<u32>), Arc<DatasetError>> {
        let Wanted { position, frames } = wanted;
        let Some(EpisodeRows { episode, rows }) = self.list.get(*position) else {
            return Err(self.wrong(format!("no pictures at position {position} of {}", self.list.len())));
        };
        let row = |&frame: &usize| {
            let beyond = || self.wrong(format!("no picture {frame} of {} at position {position}", rows.len()));
            rows.get(frame).copied().ok_or_else(beyond)
        };
        Ok((*episode, frames.iter().map(row).collect::<Result<_, _>>()?))
    }
}

/// Says that the thread has ended, also when it panics: nobody must wait for it.
struct Ending<'s>(&'s Shared);

impl Drop for Ending<'_> {
    fn drop(&mut self) {
        self.0.end();
    }
}
