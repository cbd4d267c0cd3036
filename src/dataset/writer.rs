//! Writes a dataset episode by episode, in memory that does not grow with their number.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::artifact::{IoError, create_dir, write_json};
use crate::dataset::ConvertError;
use crate::dataset::calls::{CallRows, ScopeRows};
use crate::dataset::config::{ConvertConfig, FailedEpisodes, FrameChoice};
use crate::dataset::episode_view::{EpisodeView, ViewBuffers};
use crate::dataset::episodes::{EpisodePlaces, MetaRows, ProvenanceRows, Source};
use crate::dataset::frames::{EpisodeIds, FrameRows};
use crate::dataset::info::{Info, NTP_VERSION, NtpInfo, Stats, Totals};
use crate::dataset::layout;
use crate::dataset::rolling::RollingTable;
use crate::dataset::schema::{CALLS, EPISODES, FRAMES, META_EPISODES, SCOPES, SUBTASKS, TASKS};
use crate::dataset::statistics::Statistics;
use crate::dataset::text::TextTable;
use crate::program::{Program, vocabulary_hash};
use crate::table::{TableSchema, TableWriter, Values, WriteOptions};
use crate::task::Family;
use crate::trace::{Boundaries, Episode};

/// Rows of frames and of calls that make a row group, at least. A row group holds whole episodes.
const GROUP_ROWS: usize = 1 << 13;
/// The same for scoping labels, which are many and small.
const SCOPE_GROUP_ROWS: usize = 1 << 15;
/// The same for episodes.
const EPISODE_GROUP_ROWS: usize = 1 << 12;
const MEGABYTE: usize = 1 << 20;

/// What was written.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ConvertSummary {
    /// Episodes in the dataset.
    pub episodes: u64,
    /// Rows of `data/`.
    pub frames: u64,
    /// Rows of `ntp/calls/`.
    pub calls: u64,
    /// Rows of `ntp/scopes/`.
    pub scopes: u64,
    /// Distinct task texts.
    pub tasks: u64,
    /// Episodes that failed and were left out.
    pub failed_left_out: u64,
    /// Episodes that failed and are in the dataset.
    pub failed_included: u64,
    /// Every file, relative to the dataset with `/`, in order of their names.
    pub files: Vec<String>,
}

/// A dataset being written.
pub struct DatasetWriter {
    config: ConvertConfig,
    root: PathBuf,
    buffers: ViewBuffers,
    tables: Option<Tables>,
    failed_left_out: u64,
}

/// Everything that can begin once the number of slots is known.
struct Tables {
    n_slots: usize,
    slots: Vec<String>,
    families: BTreeSet<Family>,
    tasks: TextTable,
    frames: FrameRows,
    calls: CallRows,
    scopes: ScopeRows,
    provenance: ProvenanceRows,
    meta: MetaRows,
    statistics: Statistics,
    data_files: RollingTable,
    call_files: RollingTable,
    scope_files: RollingTable,
    meta_files: RollingTable,
    provenance_file: TableWriter,
    n_episodes: u64,
    n_frames: u64,
    n_calls: u64,
    n_scopes: u64,
    n_failed: u64,
}

impl DatasetWriter {
    /// Begins a dataset in an empty directory, which is made if needed.
    ///
    /// # Errors
    ///
    /// [`ConvertError::NotEmpty`] when there is something in it.
    pub fn create(root: &Path, config: &ConvertConfig) -> Result<Self, ConvertError> {
        create_dir(root)?;
        let mut entries = std::fs::read_dir(root).map_err(IoError::system("read folder", root))?;
        if entries.next().is_some() {
            return Err(ConvertError::NotEmpty { path: root.to_owned() });
        }
        let (config, root) = (config.clone(), root.to_owned());
        Ok(Self { config, root, buffers: ViewBuffers::default(), tables: None, failed_left_out: 0 })
    }

    /// Adds an episode of a recording, named by its file and hash. One that failed may be left out.
    ///
    /// # Errors
    ///
    /// When it has another number of slots than those before, its spans are off its boundaries, or nothing can be
    /// written.
    pub fn append(&mut self, episode: &Episode, file: &str, sha256: &str) -> Result<(), ConvertError> {
        if !self.is_wanted(episode) {
            return Ok(());
        }
        let view = self.buffers.view(episode, self.config.frames)?;
        append(&mut self.tables, &self.root, &self.config, &view, Source { file, sha256 })
    }

    /// Adds an episode of which only the boundary frames were read.
    ///
    /// # Errors
    ///
    /// As [`DatasetWriter::append`]; when there are frames between the boundaries, and they should be rows.
    pub fn append_boundaries(&mut self, boundaries: &Boundaries, file: &str, sha256: &str) -> Result<(), ConvertError> {
        let (episode, recorded) = (boundaries.episode(), boundaries.recorded());
        if self.config.frames == FrameChoice::All && recorded.positions.len() != recorded.count as usize {
            return Err(ConvertError::FramesMissing { episode: episode.provenance.index });
        }
        if !self.is_wanted(episode) {
            return Ok(());
        }
        let view = self.buffers.view_boundaries(boundaries);
        append(&mut self.tables, &self.root, &self.config, &view, Source { file, sha256 })
    }

    /// Whether an episode is to be written; one that is not is counted.
    fn is_wanted(&mut self, episode: &Episode) -> bool {
        let is_left_out = !episode.outcome.is_success() && self.config.failed == FailedEpisodes::LeaveOut;
        self.failed_left_out += u64::from(is_left_out);
        !is_left_out
    }

    /// Ends the dataset: what is buffered, the statistics and the JSON files.
    ///
    /// # Errors
    ///
    /// [`ConvertError::NoEpisodes`] when none was added; else when something cannot be written.
    pub fn finish(self) -> Result<ConvertSummary, ConvertError> {
        let Self { config, root, tables, failed_left_out, .. } = self;
        let tables = tables.ok_or(ConvertError::NoEpisodes { failed: failed_left_out })?;
        tables.finish(&root, &config, failed_left_out)
    }
}

/// Adds an episode to the tables, which the first one begins. After an error there are none.
fn append(
    tables: &mut Option<Tables>,
    root: &Path,
    config: &ConvertConfig,
    view: &EpisodeView<'_>,
    source: Source<'_>,
) -> Result<(), ConvertError> {
    let mut begun = match tables.take() {
        Some(begun) => begun,
        None => Tables::create(root, config, view.episode)?,
    };
    begun.append(view, source, config.fps.get())?;
    *tables = Some(begun);
    Ok(())
}

impl Tables {
    fn create(root: &Path, config: &ConvertConfig, first: &Episode) -> Result<Self, ConvertError> {
        let n_slots = first.scene.slots.len();
        let file_bytes = config.file_megabytes.get() as usize * MEGABYTE;
        let rolling = |folder, schema, options| RollingTable::new(root, folder, schema, options, file_bytes);
        Ok(Self {
            n_slots,
            slots: first.scene.slots.iter().map(|slot| slot.name.clone()).collect(),
            families: BTreeSet::new(),
            tasks: TextTable::default(),
            frames: FrameRows::new(n_slots),
            calls: CallRows::new(),
            scopes: ScopeRows::default(),
            provenance: ProvenanceRows::default(),
            meta: MetaRows::default(),
            statistics: Statistics::new(root, n_slots),
            data_files: rolling(layout::DATA, FRAMES, FrameRows::options(n_slots)),
            call_files: rolling(layout::CALLS, CALLS, CallRows::options()),
            scope_files: rolling(layout::SCOPES, SCOPES, ScopeRows::options()),
            meta_files: rolling(layout::META_EPISODES, META_EPISODES, MetaRows::options()),
            provenance_file: TableWriter::create(&root.join(layout::EPISODES), &EPISODES, WriteOptions::default())?,
            n_episodes: 0,
            n_frames: 0,
            n_calls: 0,
            n_scopes: 0,
            n_failed: 0,
        })
    }

    fn append(&mut self, view: &EpisodeView<'_>, source: Source<'_>, fps: u32) -> Result<(), ConvertError> {
        self.note_scene(view)?;
        let places = EpisodePlaces {
            episode_index: self.n_episodes as i64,
            data: self.data_files.place(),
            first_index: self.n_frames as i64,
            calls: self.call_files.place(),
            first_call: self.n_calls as i64,
            scopes: self.scope_files.place(),
            first_scope: self.n_scopes as i64,
            n_scopes: self.scopes.append(view, self.n_episodes as i64) as i64,
        };
        let task_index = i64::from(self.tasks.key(&view.episode.provenance.task_text));
        let (episode_index, first_index) = (places.episode_index, places.first_index);
        let first_row = self.frames.n_rows();
        self.frames.append(view, EpisodeIds { episode_index, first_index, task_index, fps });
        self.statistics.append(&self.frames.columns(), &(first_row..self.frames.n_rows()));
        self.calls.append(view, episode_index);
        self.provenance.append(view, source, places);
        self.meta.append(view, places, self.meta_files.place());
        self.n_episodes += 1;
        self.n_frames += view.n_rows() as u64;
        self.n_calls += view.episode.calls.len() as u64;
        self.n_scopes += places.n_scopes as u64;
        self.n_failed += u64::from(!view.episode.outcome.is_success());
        self.write_full_groups()
    }

    /// Slots are as many as before; where their names differ, features are named by number.
    fn note_scene(&mut self, view: &EpisodeView<'_>) -> Result<(), ConvertError> {
        let (slots, provenance) = (&view.episode.scene.slots, &view.episode.provenance);
        if slots.len() != self.n_slots {
            let (expected, found) = (self.n_slots, slots.len());
            return Err(ConvertError::Slots { episode: provenance.index, expected, found });
        }
        if slots.iter().zip(&self.slots).any(|(slot, known)| slot.name != *known) {
            self.slots = (0..self.n_slots).map(|slot| format!("slot_{slot}")).collect();
        }
        self.families.insert(provenance.family);
        Ok(())
    }

    fn write_full_groups(&mut self) -> Result<(), ConvertError> {
        if self.frames.n_rows() >= GROUP_ROWS {
            self.write_frames()?;
        }
        if self.calls.n_rows() >= GROUP_ROWS {
            self.write_calls()?;
        }
        if self.scopes.n_rows() >= SCOPE_GROUP_ROWS {
            self.write_scopes()?;
        }
        if self.meta.n_rows() >= EPISODE_GROUP_ROWS {
            self.write_episodes()?;
        }
        Ok(())
    }

    fn write_frames(&mut self) -> Result<(), ConvertError> {
        let columns = self.frames.columns();
        self.statistics.keep(&columns, self.frames.n_rows())?;
        self.data_files.write_row_group(&columns)?;
        self.frames.clear();
        Ok(())
    }

    fn write_calls(&mut self) -> Result<(), ConvertError> {
        self.call_files.write_row_group(&self.calls.columns())?;
        self.calls.clear();
        Ok(())
    }

    fn write_scopes(&mut self) -> Result<(), ConvertError> {
        self.scope_files.write_row_group(&self.scopes.columns())?;
        self.scopes.clear();
        Ok(())
    }

    fn write_episodes(&mut self) -> Result<(), ConvertError> {
        let mut columns: Vec<(&str, Values<'_>)> = self.meta.columns().into();
        columns.extend(self.statistics.columns());
        self.meta_files.write_row_group(&columns)?;
        self.provenance_file.write_row_group(&self.provenance.columns())?;
        self.meta.clear();
        self.statistics.clear();
        self.provenance.clear();
        Ok(())
    }

    fn finish(
        mut self,
        root: &Path,
        config: &ConvertConfig,
        failed_left_out: u64,
    ) -> Result<ConvertSummary, ConvertError> {
        self.write_rest()?;
        write_tasks(root, self.tasks.texts())?;
        write_subtasks(root, self.frames.subtasks())?;
        let tasks = self.tasks.texts().len() as u64;
        let totals = Totals { episodes: self.n_episodes, frames: self.n_frames, tasks };
        write_json(
            &root.join(layout::INFO),
            &Info::new(totals, &self.slots, config.fps.get(), config.file_megabytes.get()),
        )?;
        write_json(&root.join(layout::NTP_INFO), &self.ntp_info(config, failed_left_out))?;
        let Self { n_episodes, n_frames, n_calls, n_scopes, n_failed, statistics, .. } = self;
        let data_files = self.data_files.finish()?;
        self.provenance_file.commit()?;
        let stats = statistics.finish()?;
        write_json(&root.join(layout::STATS), &Stats(stats))?;
        let single = [layout::INFO, layout::STATS, layout::TASKS, layout::SUBTASKS, layout::NTP_INFO, layout::EPISODES];
        let mut files: Vec<String> = single.map(ToOwned::to_owned).into();
        files.extend(data_files);
        files.extend(self.call_files.finish()?);
        files.extend(self.scope_files.finish()?);
        files.extend(self.meta_files.finish()?);
        files.sort_unstable();
        Ok(ConvertSummary {
            episodes: n_episodes,
            frames: n_frames,
            calls: n_calls,
            scopes: n_scopes,
            tasks,
            failed_left_out,
            failed_included: n_failed,
            files,
        })
    }

    fn write_rest(&mut self) -> Result<(), ConvertError> {
        if self.frames.n_rows() > 0 {
            self.write_frames()?;
        }
        if self.calls.n_rows() > 0 {
            self.write_calls()?;
        }
        if self.scopes.n_rows() > 0 {
            self.write_scopes()?;
        }
        if self.provenance.n_rows() > 0 {
            self.write_episodes()?;
        }
        Ok(())
    }

    fn ntp_info(&self, config: &ConvertConfig, failed_left_out: u64) -> NtpInfo {
        NtpInfo {
            schema_version: NTP_VERSION,
            ntp_version: env!("CARGO_PKG_VERSION").to_owned(),
            frames: config.frames.name().to_owned(),
            families: self.families.iter().map(|family| family.name().to_owned()).collect(),
            n_slots: self.n_slots,
            slots: self.slots.clone(),
            vocabulary: Program::ALL.map(|program| program.name().to_owned()).into(),
            vocabulary_hash: vocabulary_hash(),
            total_calls: self.n_calls,
            total_scopes: self.n_scopes,
            failed_left_out,
        }
    }
}

fn write_tasks(root: &Path, texts: &[String]) -> Result<(), ConvertError> {
    let metadata = pandas_index("task_index", "__index_level_0__", None);
    write_texts(root, layout::TASKS, TASKS, ["task_index", "__index_level_0__"], texts, metadata)
}

fn write_subtasks(root: &Path, texts: &[String]) -> Result<(), ConvertError> {
    let metadata = pandas_index("subtask_index", "subtask", Some("subtask"));
    write_texts(root, layout::SUBTASKS, SUBTASKS, ["subtask_index", "subtask"], texts, metadata)
}

fn write_texts(
    root: &Path,
    file: &str,
    schema: TableSchema,
    [number, text]: [&'static str; 2],
    texts: &[String],
    pandas: String,
) -> Result<(), ConvertError> {
    let options = WriteOptions { metadata: vec![("pandas".to_owned(), pandas)], ..WriteOptions::default() };
    let mut writer = TableWriter::create(&root.join(file), &schema, options)?;
    let numbers: Vec<i64> = (0..texts.len() as i64).collect();
    writer.write_row_group(&[(number, Values::Int64(&numbers)), (text, Values::Text(texts))])?;
    Ok(writer.commit()?)
}

/// Key-value metadata that makes the text the index of the table in pandas: `LeRobot` takes a task's text from there,
/// and from a plain column would silently take the number of the row.
fn pandas_index(number: &str, text: &str, index_name: Option<&str>) -> String {
    let column = |name: Option<&str>, field: &str, pandas: &str, numpy: &str| {
        serde_json::json!({
            "name": name, "field_name": field, "pandas_type": pandas, "numpy_type": numpy, "metadata": null
        })
    };
    let columns = [column(Some(number), number, "int64", "int64"), column(index_name, text, "unicode", "object")];
    serde_json::json!({
        "index_columns": [text],
        "column_indexes": [],
        "columns": columns,
        "creator": {"library": "ntp", "version": env!("CARGO_PKG_VERSION")},
        "pandas_version": "2.2.0",
    })
    .to_string()
}
