//! Decoded pictures that are kept within a limit, and what is to be decoded next.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use crate::dataset::DatasetError;

/// Some pictures of an item of a list.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Wanted {
    /// Which item.
    pub position: usize,
    /// Which of its pictures, in rising order.
    pub frames: Vec<usize>,
}

/// `[height, width, 3]`, a byte each; or why there is none.
pub(super) type Decoded = Result<Arc<Vec<u8>>, Arc<DatasetError>>;
/// All that was wanted, or why there is not.
pub(super) type Found = Result<Vec<Arc<Vec<u8>>>, Arc<DatasetError>>;

/// What is decoded, and what is to be.
#[derive(Default)]
pub(super) struct Shelf {
    most_bytes: usize,
    n_bytes: usize,
    /// Announcements so far.
    turn: u64,
    queue: VecDeque<Wanted>,
    /// What is being decoded.
    busy: Option<Wanted>,
    /// By position and frame.
    decoded: BTreeMap<(usize, usize), Kept>,
    /// Whether nothing more will be decoded.
    pub(super) has_ended: bool,
}

struct Kept {
    picture: Decoded,
    /// The announcement at which it was wanted last.
    turn: u64,
}

impl Shelf {
    pub(super) fn new(most_bytes: usize) -> Self {
        Self { most_bytes, ..Self::default() }
    }

    pub(super) fn n_bytes(&self) -> usize {
        self.n_bytes
    }

    /// Keeps what is there, and queues what is not.
    pub(super) fn announce(&mut self, wanted: &[Wanted]) {
        self.turn += 1;
        for wanted in wanted {
            for &frame in &wanted.frames {
                if let Some(kept) = self.decoded.get_mut(&(wanted.position, frame)) {
                    kept.turn = self.turn;
                }
            }
            let under_way = |frame| self.busy.iter().chain(&self.queue).any(|other| other.has(wanted.position, frame));
            let missing = self.missing(wanted).filter(|&frame| !under_way(frame)).collect();
            self.queue_unless_empty(Wanted { position: wanted.position, frames: missing }, VecDeque::push_back);
        }
    }

    /// What is wanted, when all of it is there; or the first reason why some of it cannot be.
    pub(super) fn find(&self, wanted: &Wanted) -> Option<Found> {
        let kept = wanted.frames.iter().map(|&frame| self.decoded.get(&(wanted.position, frame)));
        let kept: Option<Vec<&Kept>> = kept.collect();
        kept.map(|kept| kept.into_iter().map(|kept| kept.picture.clone()).collect())
    }

    /// Puts something of what is not there before all else, with what is queued together with it: a video is decoded
    /// from a key frame on. Whether there was nothing of it in the queue before.
    pub(super) fn hurry(&mut self, wanted: &Wanted) -> bool {
        let position = wanted.position;
        let is_busy = |frame| self.busy.as_ref().is_some_and(|busy| busy.has(position, frame));
        let missing: Vec<usize> = self.missing(wanted).filter(|&frame| !is_busy(frame)).collect();
        let is_of_it = |queued: &Wanted| missing.iter().any(|&frame| queued.has(position, frame));
        let queued = self.queue.iter().position(is_of_it).and_then(|at| self.queue.remove(at));
        let is_new = queued.is_none() && !missing.is_empty();
        self.queue_unless_empty(queued.unwrap_or(Wanted { position, frames: missing }), VecDeque::push_front);
        is_new
    }

    /// The next to decode.
    pub(super) fn begin(&mut self) -> Option<Wanted> {
        self.busy = self.queue.pop_front();
        self.busy.clone()
    }

    /// Keeps what was decoded, one for each that was wanted.
    pub(super) fn keep(&mut self, wanted: &Wanted, decoded: Vec<Decoded>) {
        self.busy = None;
        for (&frame, picture) in wanted.frames.iter().zip(decoded) {
            self.n_bytes += size(&picture);
            let before = self.decoded.insert((wanted.position, frame), Kept { picture, turn: self.turn });
            self.n_bytes -= before.map_or(0, |kept| size(&kept.picture));
        }
        if self.n_bytes > self.most_bytes {
            self.let_go();
        }
    }

    /// Lets go of what was wanted longest ago, and of some more, so that this is not done for each picture.
    fn let_go(&mut self) {
        let old = self.decoded.iter().filter(|(_, kept)| kept.turn + 1 < self.turn);
        let mut old: Vec<(u64, (usize, usize))> = old.map(|(&at, kept)| (kept.turn, at)).collect();
        old.sort_unstable();
        for (_, at) in old {
            if self.n_bytes <= self.most_bytes / 8 * 7 {
                return;
            }
            self.n_bytes -= self.decoded.remove(&at).map_or(0, |kept| size(&kept.picture));
        }
    }

    fn missing<'w>(&'w self, wanted: &'w Wanted) -> impl Iterator<Item = usize> + 'w {
        let frames = wanted.frames.iter().copied();
        frames.filter(|&frame| !self.decoded.contains_key(&(wanted.position, frame)))
    }

    fn queue_unless_empty(&mut self, wanted: Wanted, queue: fn(&mut VecDeque<Wanted>, Wanted)) {
        if !wanted.frames.is_empty() {
            queue(&mut self.queue, wanted);
        }
    }
}

impl Wanted {
    fn has(&self, position: usize, frame: usize) -> bool {
        self.position == position && self.frames.contains(&frame)
    }
}

fn size(decoded: &Decoded) -> usize {
    decoded.as_ref().map_or(0, |bytes| bytes.len())
}
