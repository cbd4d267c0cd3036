//! What is written of a dataset at its end: the last rows, texts, totals and statistics.

use serde_json::json;

use crate::artifact::{IoError, write_json};
use crate::dataset::edit::EditError;
use crate::dataset::edit::target::{EditSummary, Target};
use crate::dataset::files::info::{Features, Info, NtpInfo, Stats};
use crate::dataset::files::layout;
use crate::dataset::tables::annotated::vocabulary;
use crate::dataset::tables::frames::feature::{FEATURES, action_of, declared};
use crate::dataset::tables::texts::write::{write_subtasks, write_tasks};
use crate::program::KnownPrograms;

impl Target {
    /// Ends the dataset. `failed_left_out` is what its sources left out of their recordings.
    pub(in crate::dataset::edit) fn finish(mut self, failed_left_out: u64) -> Result<EditSummary, EditError> {
        self.write_episodes()?;
        self.write_calls()?;
        self.write_scopes()?;
        write_tasks(&self.root, self.tasks.texts())?;
        write_subtasks(&self.root, self.subtasks.texts())?;
        let slots = self.slots.take().unwrap_or_default();
        self.write_info(&slots)?;
        write_json(&self.root.join(layout::NTP_INFO), &self.ntp_info(slots, failed_left_out))?;
        let Self { root, tasks, statistics, pictures, mut summary, .. } = self;
        let single = [layout::INFO, layout::STATS, layout::TASKS, layout::SUBTASKS, layout::NTP_INFO, layout::EPISODES];
        let mut files: Vec<String> = single.map(ToOwned::to_owned).into();
        for table in [self.frame_files, self.call_files, self.scope_files, self.meta_files] {
            files.extend(table.finish()?);
        }
        self.provenance_file.commit()?;
        write_json(&root.join(layout::STATS), &Stats(statistics.finish()?, pictures.statistics()))?;
        files.extend(pictures.finish()?);
        files.sort_unstable();
        summary.tasks = tasks.texts().len() as u64;
        summary.files = files;
        Ok(summary)
    }

    /// Writes what is declared; of an imported dataset all that others have declared, with totals of its own.
    fn write_info(&self, slots: &[String]) -> Result<(), IoError> {
        let (path, own) = (self.root.join(layout::INFO), self.info(slots));
        let Some(mut theirs) = self.theirs.clone() else { return write_json(&path, &own) };
        theirs["total_episodes"] = json!(own.total_episodes);
        theirs["total_frames"] = json!(own.total_frames);
        theirs["total_tasks"] = json!(own.total_tasks);
        theirs["splits"] = json!(own.splits);
        write_json(&path, &theirs)
    }

    fn info(&self, slots: &[String]) -> Info {
        let total_episodes = self.summary.episodes;
        Info {
            total_episodes,
            total_frames: self.summary.frames,
            total_tasks: self.tasks.texts().len() as u64,
            splits: [("train".to_owned(), format!("0:{total_episodes}"))].into(),
            features: self.declared_features(slots),
            ..self.info.clone()
        }
    }

    /// Features of ours in the order of their columns, then any others.
    fn declared_features(&self, slots: &[String]) -> Features {
        let is_ours = |name: &str| FEATURES.iter().any(|feature| feature.name == name);
        let others = self.info.features.0.iter().filter(|(name, _)| !is_ours(name)).cloned();
        Features(declared(slots, action_of(&self.info)).0.into_iter().chain(others).collect())
    }

    /// As many programs as the first dataset knows, or more where the episodes' families need them.
    fn known_programs(&self) -> KnownPrograms {
        let first = KnownPrograms::of_hash(&self.ntp.vocabulary_hash);
        first
            .into_iter()
            .chain(self.families.iter().map(|family| family.programs()))
            .max()
            .unwrap_or(KnownPrograms::ALL)
    }

    fn ntp_info(&self, slots: Vec<String>, failed_left_out: u64) -> NtpInfo {
        let (vocabulary, vocabulary_hash) = if self.ntp.has_our_programs() {
            let known = self.known_programs();
            (known.names().map(ToOwned::to_owned).collect(), known.hash())
        } else {
            vocabulary(self.subtasks.texts())
        };
        NtpInfo {
            vocabulary,
            vocabulary_hash,
            ntp_version: env!("CARGO_PKG_VERSION").to_owned(),
            families: self.families.iter().map(|family| family.name().to_owned()).collect(),
            slots,
            total_calls: self.summary.calls,
            total_scopes: self.summary.scopes,
            failed_left_out,
            ..self.ntp.clone()
        }
    }
}
