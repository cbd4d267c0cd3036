//! Trials on disk, to be read back by their numbers when there are too many for memory.
//!
//! # Input and output
//!
//! A file without a name beside what is made of them: the system removes it with the process, however that ends. A
//! trial is a run of 32-bit words; what stands where is known here alone.
//!
//! # Invariants
//!
//! What is read back is what was written, to the last bit. Memory grows by [`Entry`] a trial.

use std::borrow::Borrow;
use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::ops::Range;
use std::os::unix::fs::FileExt as _;
use std::path::{Path, PathBuf};

use crate::artifact::IoError;
use crate::dataset::TrialData;
use crate::program::Program;
use crate::scene::SlotIndex;
use crate::task::{Family, Split};
use crate::trace::{CallId, GripperState, Instruction, ProgramCall, Span};

const BUFFER_BYTES: usize = 1 << 20;
/// In the place of what is not there.
const NOTHING: u32 = u32::MAX;

/// Where a trial lies, and what is asked of it without reading it.
#[derive(Clone, Copy, Debug)]
struct Entry {
    first_word: u64,
    /// Of [`TrialSpool::tasks`].
    task: u32,
    n_frames: u32,
}

/// Trials being written.
pub(super) struct SpoolWriter {
    folder: PathBuf,
    file: BufWriter<File>,
    n_words: u64,
    entries: Vec<Entry>,
    /// Ids of tasks, in the order in which they came.
    tasks: Vec<String>,
}

/// Trials that were written.
#[derive(Debug)]
pub struct TrialSpool {
    /// Slots of every scene.
    pub n_slots: usize,
    folder: PathBuf,
    file: File,
    n_words: u64,
    entries: Vec<Entry>,
    tasks: Vec<String>,
}

impl SpoolWriter {
    /// An empty one in a folder, which must have room for all trials.
    pub(super) fn new(folder: &Path) -> Result<Self, IoError> {
        let file = tempfile::tempfile_in(folder).map_err(IoError::system("make a temporary file in", folder))?;
        let file = BufWriter::with_capacity(BUFFER_BYTES, file);
        Ok(Self { folder: folder.to_owned(), file, n_words: 0, entries: Vec::new(), tasks: Vec::new() })
    }

    pub(super) fn push(&mut self, trial: &TrialData) -> Result<(), IoError> {
        if self.tasks.last() != Some(&trial.task_id) {
            self.tasks.push(trial.task_id.clone());
        }
        let words = encode(trial);
        let task = self.tasks.len().saturating_sub(1) as u32;
        self.entries.push(Entry { first_word: self.n_words, task, n_frames: trial.n_frames as u32 });
        self.n_words += words.len() as u64;
        let bytes: Vec<u8> = words.into_iter().flat_map(u32::to_le_bytes).collect();
        self.file.write_all(&bytes).map_err(IoError::system("write a temporary file in", &self.folder))
    }

    /// Trials of scenes with `n_slots` slots.
    pub(super) fn finish(self, n_slots: usize) -> Result<TrialSpool, IoError> {
        let Self { folder, file, n_words, entries, tasks } = self;
        let failed = IoError::system("write a temporary file in", &folder);
        let file = file.into_inner().map_err(|error| failed(error.into_error()))?;
        Ok(TrialSpool { n_slots, folder, file, n_words, entries, tasks })
    }
}

impl TrialSpool {
    /// Writes trials into a file without a name in a folder.
    ///
    /// # Errors
    ///
    /// When the file cannot be written.
    pub fn of(
        folder: &Path,
        n_slots: usize,
        trials: impl IntoIterator<Item: Borrow<TrialData>>,
    ) -> Result<Self, IoError> {
        let mut writer = SpoolWriter::new(folder)?;
        trials.into_iter().try_for_each(|trial| writer.push(trial.borrow()))?;
        writer.finish(n_slots)
    }

    /// How many trials.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Frames of a trial.
    pub fn n_frames(&self, trial: usize) -> usize {
        self.entries[trial].n_frames as usize
    }

    /// Whether a trial is of the same task as the one before it.
    pub fn continues_task(&self, trial: usize) -> bool {
        trial > 0 && self.entries[trial].task == self.entries[trial - 1].task
    }

    /// Reads some of them.
    ///
    /// # Errors
    ///
    /// When the file cannot be read.
    pub fn read(&self, trials: Range<usize>) -> Result<Vec<TrialData>, IoError> {
        let Some(first) = self.entries.get(trials.start).filter(|_| !trials.is_empty()) else {
            return Ok(Vec::new());
        };
        let end = self.entries.get(trials.end).map_or(self.n_words, |next| next.first_word);
        let mut bytes = vec![0; (end - first.first_word) as usize * size_of::<u32>()];
        let failed = || IoError::system("read a temporary file in", &self.folder);
        self.file.read_exact_at(&mut bytes, first.first_word * size_of::<u32>() as u64).map_err(failed())?;
        let words: Vec<u32> = bytes.as_chunks().0.iter().map(|bytes| u32::from_le_bytes(*bytes)).collect();
        let mut words = Words(words.into_iter());
        let read = |entry: &Entry| {
            let task_id = self.tasks[entry.task as usize].clone();
            let broken = || failed()(std::io::ErrorKind::InvalidData.into());
            decode(&mut words, task_id).ok_or_else(broken)
        };
        self.entries[trials].iter().map(read).collect()
    }
}

/// A trial without its task's id.
fn encode(trial: &TrialData) -> Vec<u32> {
    let TrialData {
        task_id: _,
        family,
        split,
        trial,
        episode,
        n_frames,
        rows,
        observations,
        grippers,
        calls,
        instructions,
    } = trial;
    let counts = [rows.len(), observations.len(), grippers.len(), calls.len(), instructions.len()];
    let mut words = vec![position(&Family::ALL, family), position(&Split::ALL, split), *trial];
    words.extend([*episode as u32, (*episode as u64 >> 32) as u32, *n_frames as u32]);
    words.extend(counts.map(|count| count as u32));
    words.extend(rows);
    words.extend(observations.iter().map(|value| value.to_bits()));
    for GripperState { in_world_m, closed } in grippers {
        words.extend(in_world_m.map(f32::to_bits));
        words.push(u32::from(*closed));
    }
    calls.iter().for_each(|call| encode_call(call, &mut words));
    for Instruction { call, words: said } in instructions {
        words.push(call.0);
        words.extend(said.map(u32::from));
    }
    words
}

/// Demonstrations have no predictions.
fn encode_call(call: &ProgramCall, words: &mut Vec<u32>) {
    let ProgramCall {
        id,
        caller,
        depth,
        step,
        program,
        argument,
        input,
        output,
        frames,
        end_of_program,
        prediction: _,
    } = call;
    words.extend([id.0, caller.map_or(NOTHING, |caller| caller.0), u32::from(*depth), u32::from(*step)]);
    words.extend([program.index() as u32, argument.map_or(NOTHING, |slot| u32::from(slot.0))]);
    let [begin, end] = output.map_or([NOTHING; 2], |part| [part.begin, part.end]);
    words.extend([input.begin, input.end, begin, end, frames.begin, frames.end, u32::from(*end_of_program)]);
}

/// Words being read.
struct Words(std::vec::IntoIter<u32>);

impl Words {
    fn next(&mut self) -> Option<u32> {
        self.0.next()
    }

    fn some(&mut self) -> Option<Option<u32>> {
        Some(self.next().filter(|word| *word != NOTHING))
    }

    fn float(&mut self) -> Option<f32> {
        self.next().map(f32::from_bits)
    }

    fn span(&mut self) -> Option<Span> {
        Some(Span { begin: self.next()?, end: self.next()? })
    }
}

fn decode(words: &mut Words, task_id: String) -> Option<TrialData> {
    let family = *Family::ALL.get(words.next()? as usize)?;
    let split = *Split::ALL.get(words.next()? as usize)?;
    let trial = words.next()?;
    let episode = u64::from(words.next()?) | u64::from(words.next()?) << 32;
    let n_frames = words.next()? as usize;
    let [n_rows, n_values, n_grippers, n_calls, n_instructions] =
        [words.next()?, words.next()?, words.next()?, words.next()?, words.next()?].map(|count| count as usize);
    let rows = (0..n_rows).map(|_| words.next()).collect::<Option<_>>()?;
    let observations = (0..n_values).map(|_| words.float()).collect::<Option<_>>()?;
    let gripper = |words: &mut Words| {
        let in_world_m = [words.float()?, words.float()?, words.float()?];
        Some(GripperState { in_world_m, closed: words.next()? != 0 })
    };
    let grippers = (0..n_grippers).map(|_| gripper(words)).collect::<Option<_>>()?;
    let calls = (0..n_calls).map(|_| decode_call(words)).collect::<Option<_>>()?;
    let instruction = |words: &mut Words| {
        let call = CallId(words.next()?);
        let said = [words.next()?, words.next()?, words.next()?];
        Some(Instruction { call, words: said.map(|word| word as u16) })
    };
    let instructions = (0..n_instructions).map(|_| instruction(words)).collect::<Option<_>>()?;
    let episode = usize::try_from(episode).ok()?;
    Some(TrialData {
        task_id,
        family,
        split,
        trial,
        episode,
        n_frames,
        rows,
        observations,
        grippers,
        calls,
        instructions,
    })
}

fn decode_call(words: &mut Words) -> Option<ProgramCall> {
    let id = CallId(words.next()?);
    let caller = words.some()?.map(CallId);
    let (depth, step) = (words.next()? as u8, words.next()? as u16);
    let program = Program::from_index(words.next()? as usize)?;
    let argument = words.some()?.map(|slot| SlotIndex(slot as u16));
    let input = words.span()?;
    let output = words.span().filter(|part| part.begin != NOTHING);
    let frames = words.span()?;
    let end_of_program = words.next()? != 0;
    Some(ProgramCall {
        id,
        caller,
        depth,
        step,
        program,
        argument,
        input,
        output,
        frames,
        end_of_program,
        prediction: None,
    })
}

fn position<T: PartialEq>(all: &[T], wanted: &T) -> u32 {
    all.iter().position(|one| one == wanted).map_or(NOTHING, |position| position as u32)
}
