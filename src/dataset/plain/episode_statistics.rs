//! Statistics of the episodes of older datasets: an object a line, in any order.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufRead as _, BufReader, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::artifact::{self, IoError};
use crate::dataset::DatasetError;
use crate::dataset::files::stated::parse;
use crate::dataset::plain::PlainInfo;

/// Where they are.
const FILE: &str = "meta/episodes_stats.jsonl";

/// The file, with where each episode's line begins.
pub(crate) struct EpisodeStatistics {
    path: PathBuf,
    file: BufReader<File>,
    /// By episode: its row among the lines, and its first byte.
    lines: BTreeMap<i64, (u64, u64)>,
}

impl EpisodeStatistics {
    /// Whether a dataset has any.
    pub(crate) fn are_there(info: &PlainInfo) -> bool {
        info.root().join(FILE).is_file()
    }

    /// Opens a dataset's; `None` where it has none.
    ///
    /// # Errors
    ///
    /// When a line is no JSON or names no episode, or one that another has named.
    pub(crate) fn open(info: &PlainInfo) -> Result<Option<Self>, DatasetError> {
        if !Self::are_there(info) {
            return Ok(None);
        }
        let path = info.root().join(FILE);
        let mut file = BufReader::new(artifact::open(&path)?);
        let mut lines = BTreeMap::new();
        let (mut begin, mut row, mut line) = (0, 0, String::new());
        while let n_bytes @ 1.. = next_line(&path, &mut file, &mut line)? {
            if !line.trim().is_empty() {
                let wrong = |problem: String| DatasetError::Row { path: path.clone(), row, problem };
                let value: Value = parse(&line).map_err(|error| wrong(format!("no JSON: {error}")))?;
                let index =
                    value["episode_index"].as_i64().ok_or_else(|| wrong("it has no episode_index".to_owned()))?;
                if lines.insert(index, (row, begin)).is_some() {
                    return Err(wrong(format!("episode {index} stands twice")));
                }
                row += 1;
            }
            begin += n_bytes;
        }
        Ok(Some(Self { path, file, lines }))
    }

    /// Where they are.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// An episode's, by feature and statistic.
    ///
    /// # Errors
    ///
    /// When it has none.
    pub(crate) fn of(&mut self, episode: i64) -> Result<Value, DatasetError> {
        let wrong = |row: u64, problem: String| DatasetError::Row { path: self.path.clone(), row, problem };
        let n_lines = self.lines.len() as u64;
        let missing = || wrong(n_lines, format!("there is no line of episode {episode}"));
        let &(row, begin) = self.lines.get(&episode).ok_or_else(missing)?;
        let mut line = String::new();
        self.file.seek(SeekFrom::Start(begin)).map_err(IoError::system("read", &self.path))?;
        next_line(&self.path, &mut self.file, &mut line)?;
        let mut value: Value = parse(&line).map_err(|error| wrong(row, format!("no JSON: {error}")))?;
        Ok(value["stats"].take())
    }
}

/// How many bytes the next line has; 0 at the end.
fn next_line(path: &Path, file: &mut BufReader<File>, line: &mut String) -> Result<u64, IoError> {
    line.clear();
    file.read_line(line).map(|n_bytes| n_bytes as u64).map_err(IoError::system("read", path))
}
