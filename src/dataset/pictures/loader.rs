//! Pictures of many episodes, decoded by a thread of their own before they are asked for.
//!
//! # Invariants
//!
//! What is given out depends on the dataset alone, not on what was announced or how fast the thread is. Memory holds
//! decoded pictures up to a limit; above it only those of the last two announcements stay.

use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle};

use crate::artifact::IoError;
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

/// `[row, height, width, 3]`, a byte each; or why there are none.
pub type Decoded = Result<Arc<Vec<u8>>, Arc<DatasetError>>;

struct Shared {
    root: PathBuf,
    list: Vec<EpisodeRows>,
    shelf: Mutex<Shelf>,
    changed: Condvar,
}

/// What is decoded, and what is to be.
#[derive(Default)]
struct Shelf {
    most_bytes: usize,
    n_bytes: usize,
    /// Announcements so far.
    turn: u64,
    queue: VecDeque<usize>,
    /// What the thread works on.
    busy: Option<usize>,
    decoded: BTreeMap<usize, Kept>,
    has_ended: bool,
}

struct Kept {
    pictures: Decoded,
    /// The announcement at which it was wanted last.
    turn: u64,
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
        let shelf = Mutex::new(Shelf { most_bytes, ..Shelf::default() });
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

    /// Says which positions of the list will be wanted next; they are decoded in this order.
    pub fn announce(&self, positions: &[usize]) {
        let mut shelf = self.shared.lock();
        shelf.turn += 1;
        for &position in positions {
            shelf.want(position);
        }
        self.shared.changed.notify_all();
    }

    /// The pictures at a position of the list; waits for them.
    ///
    /// # Errors
    ///
    /// As [`EpisodePictures::visit`].
    pub fn get(&self, position: usize) -> Decoded {
        let mut shelf = self.shared.lock();
        loop {
            if let Some(kept) = shelf.decoded.get(&position) {
                return kept.pictures.clone();
            }
            if shelf.has_ended {
                let problem = "the thread that decodes pictures has ended".to_owned();
                return Err(Arc::new(DatasetError::Count { path: self.shared.root.clone(), problem }));
            }
            if shelf.busy != Some(position) {
                shelf.queue.retain(|&other| other != position);
                shelf.queue.push_front(position);
                self.shared.changed.notify_all();
            }
            shelf = self.shared.changed.wait(shelf).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Bytes of decoded pictures that are kept now.
    pub fn n_bytes(&self) -> usize {
        self.shared.lock().n_bytes
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

    /// What the thread does until the end.
    fn work(&self, mut pictures: EpisodePictures) {
        let _ending = Ending(self);
        while let Some(position) = self.next() {
            let decoded = self.decode(&mut pictures, position);
            self.lock().keep(position, decoded);
            self.changed.notify_all();
        }
    }

    /// Waits for something to decode; nothing at the end.
    fn next(&self) -> Option<usize> {
        let mut shelf = self.lock();
        while !shelf.has_ended {
            shelf.busy = shelf.queue.pop_front();
            if shelf.busy.is_some() {
                return shelf.busy;
            }
            shelf = self.changed.wait(shelf).unwrap_or_else(PoisonError::into_inner);
        }
        None
    }

    fn decode(&self, pictures: &mut EpisodePictures, position: usize) -> Decoded {
        let Some(EpisodeRows { episode, rows }) = self.list.get(position) else {
            let problem = format!("no pictures at position {position} of {}", self.list.len());
            return Err(Arc::new(DatasetError::Count { path: self.root.clone(), problem }));
        };
        let [width, height] = pictures.size_px().map(|pixels| pixels as usize);
        let mut bytes = Vec::with_capacity(rows.len() * width * height * 3);
        pictures.visit(*episode, rows, |picture| bytes.extend_from_slice(&picture.bytes)).map_err(Arc::new)?;
        Ok(Arc::new(bytes))
    }
}

/// Says that the thread has ended, also when it panics: nobody must wait for it.
struct Ending<'s>(&'s Shared);

impl Drop for Ending<'_> {
    fn drop(&mut self) {
        self.0.end();
    }
}

impl Shelf {
    /// Keeps what is there, and queues what is not.
    fn want(&mut self, position: usize) {
        match self.decoded.get_mut(&position) {
            Some(kept) => kept.turn = self.turn,
            None if self.busy == Some(position) || self.queue.contains(&position) => {}
            None => self.queue.push_back(position),
        }
    }

    fn keep(&mut self, position: usize, pictures: Decoded) {
        self.busy = None;
        self.n_bytes += size(&pictures);
        self.decoded.insert(position, Kept { pictures, turn: self.turn });
        while self.n_bytes > self.most_bytes {
            let old = self.decoded.iter().filter(|(_, kept)| kept.turn + 1 < self.turn);
            let Some(oldest) = old.min_by_key(|(_, kept)| kept.turn).map(|(&position, _)| position) else { return };
            self.n_bytes -= self.decoded.remove(&oldest).map_or(0, |kept| size(&kept.pictures));
        }
    }
}

fn size(pictures: &Decoded) -> usize {
    pictures.as_ref().map_or(0, |bytes| bytes.len())
}
