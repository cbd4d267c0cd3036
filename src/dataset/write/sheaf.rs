//! The tables of a dataset side by side, as one sheaf: rows are gathered episode by episode and written by row groups.

use std::collections::BTreeSet;
use std::path::Path;

use crate::arm;
use crate::artifact::write_json;
use crate::dataset::ConvertError;
use crate::dataset::config::{ActionChoice, ConvertConfig};
use crate::dataset::files::info::{Info, NTP_VERSION, NtpInfo, Stats, Totals};
use crate::dataset::files::layout;
use crate::dataset::files::rolling::Rolling;
use crate::dataset::pictures::PictureFeatures;
use crate::dataset::schema::{CALLS, EPISODES, FRAMES, META_EPISODES, SCOPES};
use crate::dataset::statistics::{NumericFeature, Statistics};
use crate::dataset::tables::frames::feature::declared;
use crate::dataset::tables::frames::write::{EpisodeIds, FrameRows, has_joints};
use crate::dataset::tables::texts::write::{write_subtasks, write_tasks};
use crate::dataset::tables::view::{EpisodePlaces, EpisodeView, Source};
use crate::dataset::tables::{calls, episodes, meta_episodes, scopes};
use crate::dataset::write::summary::ConvertSummary;
use crate::program::KnownPrograms;
use crate::recording::CameraPictures;
use crate::table::{TableRows as _, TableSchema, TableWriter, TextTable, Values, WriteOptions};
use crate::task::Family;
use crate::trace::Episode;

/// Rows of frames and of calls that make a row group, at least. A row group holds whole episodes.
pub(crate) const GROUP_ROWS: usize = 1 << 13;
/// The same for scoping labels, which are many and small.
pub(crate) const SCOPE_GROUP_ROWS: usize = 1 << 15;
/// The same for episodes.
pub(crate) const EPISODE_GROUP_ROWS: usize = 1 << 12;
pub(crate) const MEGABYTE: usize = 1 << 20;

/// A table of a dataset in many files.
fn rolling(root: &Path, folder: &'static str, schema: TableSchema, options: WriteOptions, file_bytes: usize) -> Files {
    Rolling::new(root, folder, file_bytes, move |path| TableWriter::create(path, &schema, options.clone()))
}

type Files = Rolling<TableWriter>;

/// Everything that can begin once the number of slots is known.
pub(crate) struct Tables {
    n_slots: usize,
    slots: Vec<String>,
    families: BTreeSet<Family>,
    tasks: TextTable,
    frames: FrameRows,
    calls: calls::Rows,
    scopes: scopes::Rows,
    provenance: episodes::Rows,
    meta: meta_episodes::Rows,
    pictures: PictureFeatures,
    statistics: Statistics,
    data_files: Files,
    call_files: Files,
    scope_files: Files,
    meta_files: Files,
    provenance_file: TableWriter,
    n_episodes: u64,
    n_frames: u64,
    n_calls: u64,
    n_scopes: u64,
    n_failed: u64,
}

impl Tables {
    /// Begins all of them, for scenes as the first episode's.
    pub(crate) fn create(
        root: &Path,
        config: &ConvertConfig,
        first: &Episode,
        cameras: &[CameraPictures],
    ) -> Result<Self, ConvertError> {
        let pictures = PictureFeatures::new(root, config, cameras);
        let n_slots = first.scene.slots.len();
        let file_bytes = config.file_megabytes.get() as usize * MEGABYTE;
        let has_joints = has_joints(first);
        if config.action == ActionChoice::Joints && !has_joints {
            return Err(ConvertError::NoJoints { episode: first.provenance.index });
        }
        let frames = FrameRows::new(n_slots, config.action, has_joints);
        let further = frames.further().into_iter().chain(pictures.data_schema()).collect();
        let data_options = WriteOptions { further, ..FrameRows::options(n_slots, config.action) };
        let meta_options = WriteOptions { further: pictures.meta_schema(), ..META_EPISODES.options() };
        let rolling = |folder, schema, options| rolling(root, folder, schema, options, file_bytes);
        Ok(Self {
            n_slots,
            slots: first.scene.slots.iter().map(|slot| slot.name.clone()).collect(),
            families: BTreeSet::new(),
            tasks: TextTable::default(),
            frames,
            calls: calls::Rows::default(),
            scopes: scopes::Rows::default(),
            provenance: episodes::Rows::default(),
            meta: meta_episodes::Rows::default(),
            statistics: Statistics::new(root, NumericFeature::all(n_slots, config.action, has_joints)),
            data_files: rolling(layout::DATA, FRAMES, data_options),
            call_files: rolling(layout::CALLS, CALLS, CALLS.options()),
            scope_files: rolling(layout::SCOPES, SCOPES, SCOPES.options()),
            meta_files: rolling(layout::META_EPISODES, META_EPISODES, meta_options),
            pictures,
            provenance_file: TableWriter::create(&root.join(layout::EPISODES), &EPISODES, EPISODES.options())?,
            n_episodes: 0,
            n_frames: 0,
            n_calls: 0,
            n_scopes: 0,
            n_failed: 0,
        })
    }

    /// Adds an episode, and writes the row groups that are full.
    pub(crate) fn append(
        &mut self,
        view: &EpisodeView<'_>,
        cameras: &[CameraPictures],
        source: Source<'_>,
        fps: u32,
    ) -> Result<(), ConvertError> {
        self.note_scene(view)?;
        self.pictures.append(view, cameras)?;
        let places = EpisodePlaces {
            episode_index: self.n_episodes as i64,
            data: self.data_files.place(),
            first_index: self.n_frames as i64,
            calls: self.call_files.place(),
            first_call: self.n_calls as i64,
            scopes: self.scope_files.place(),
            first_scope: self.n_scopes as i64,
            n_scopes: self.scopes.append_episode(view, self.n_episodes as i64) as i64,
        };
        let task_index = i64::from(self.tasks.key(&view.episode.provenance.task_text));
        let (episode_index, first_index) = (places.episode_index, places.first_index);
        let first_row = self.frames.n_rows();
        self.frames.append(view, EpisodeIds { episode_index, first_index, task_index, fps });
        self.statistics.append(&self.frames.numbers(), &(first_row..self.frames.n_rows()));
        self.calls.append_episode(view, episode_index);
        self.provenance.append_episode(view, source, places);
        self.meta.append_episode(view, places, self.meta_files.place());
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
        if !self.frames.fits(view.episode) {
            return Err(ConvertError::Joints { episode: provenance.index });
        }
        self.families.insert(provenance.family);
        Ok(())
    }

    fn write_full_groups(&mut self) -> Result<(), ConvertError> {
        if self.frames.n_rows() >= GROUP_ROWS || self.pictures.are_many() {
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
        self.statistics.keep(&self.frames.numbers(), self.frames.n_rows())?;
        let columns: Vec<(&str, Values<'_>)> = columns.into_iter().chain(self.pictures.data_columns()).collect();
        self.data_files.write(|file| file.write_row_group(&columns))?;
        self.frames.clear();
        self.pictures.clear_rows();
        Ok(())
    }

    fn write_calls(&mut self) -> Result<(), ConvertError> {
        self.call_files.write(|file| file.write_row_group(&self.calls.columns()))?;
        self.calls.clear();
        Ok(())
    }

    fn write_scopes(&mut self) -> Result<(), ConvertError> {
        self.scope_files.write(|file| file.write_row_group(&self.scopes.columns()))?;
        self.scopes.clear();
        Ok(())
    }

    fn write_episodes(&mut self) -> Result<(), ConvertError> {
        let mut columns: Vec<(&str, Values<'_>)> = self.meta.columns();
        columns.extend(self.statistics.columns());
        columns.extend(self.pictures.meta_columns());
        self.meta_files.write(|file| file.write_row_group(&columns))?;
        self.pictures.clear_episodes();
        self.provenance_file.write_row_group(&self.provenance.columns())?;
        self.meta.clear();
        self.statistics.clear();
        self.provenance.clear();
        Ok(())
    }

    /// Writes what is left, the statistics and the JSON files.
    pub(crate) fn finish(
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
        let mut info = Info::new(
            totals,
            declared(&self.slots, config.action),
            f64::from(config.fps.get()),
            config.file_megabytes.get(),
        );
        info.features.0.extend(self.frames.declared_further(&self.slots));
        info.features.0.extend(self.pictures.declared());
        if self.frames.has_joints() {
            info.robot_type = arm::NAME.to_owned();
        }
        write_json(&root.join(layout::INFO), &info)?;
        write_json(&root.join(layout::NTP_INFO), &self.ntp_info(config, failed_left_out))?;
        let Self { n_episodes, n_frames, n_calls, n_scopes, n_failed, statistics, pictures, .. } = self;
        let data_files = self.data_files.finish()?;
        self.provenance_file.commit()?;
        let stats = statistics.finish()?;
        write_json(&root.join(layout::STATS), &Stats(stats, pictures.statistics()))?;
        let single = [layout::INFO, layout::STATS, layout::TASKS, layout::SUBTASKS, layout::NTP_INFO, layout::EPISODES];
        let mut files: Vec<String> = single.map(ToOwned::to_owned).into();
        files.extend(data_files);
        files.extend(pictures.finish()?);
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
        let known = self.families.iter().map(|family| family.programs()).max().unwrap_or(KnownPrograms::FIRST);
        NtpInfo {
            schema_version: NTP_VERSION,
            ntp_version: env!("CARGO_PKG_VERSION").to_owned(),
            frames: config.frames.name().to_owned(),
            families: self.families.iter().map(|family| family.name().to_owned()).collect(),
            n_slots: self.n_slots,
            slots: self.slots.clone(),
            vocabulary: known.names().map(ToOwned::to_owned).collect(),
            vocabulary_hash: known.hash(),
            total_calls: self.n_calls,
            total_scopes: self.n_scopes,
            failed_left_out,
            annotated_by: None,
        }
    }
}
