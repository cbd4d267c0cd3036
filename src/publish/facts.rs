//! What card and metadata say of a dataset, gathered from its files.

use std::path::Path;

use serde::Serialize;

use crate::dataset::{DatasetSummary, summarize};
use crate::publish::origin::Origin;
use crate::publish::provenance::{Provenance, SourceFacts};
use crate::publish::tables::{TableFacts, tables};
use crate::publish::{Publication, PublishError};

/// The paper whose method the dataset is for.
const PAPER: &str = "\
@inproceedings{xu2018neural,
  title         = {Neural Task Programming: Learning to Generalize Across Hierarchical Tasks},
  author        = {Xu, Danfei and Nair, Suraj and Zhu, Yuke and Gao, Julian and Garg, Animesh and Fei-Fei, Li and Savarese, Silvio},
  booktitle     = {IEEE International Conference on Robotics and Automation},
  year          = {2018},
  eprint        = {1710.01813},
  archivePrefix = {arXiv}
}
";

/// What card and metadata say of a dataset.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Facts {
    pub(super) summary: DatasetSummary,
    pub(super) tables: Vec<TableFacts>,
    /// One sentence or two on what it is.
    pub(super) description: String,
    /// Where the labels are from.
    pub(super) labels_words: String,
    /// Who acted, and where.
    pub(super) acting_words: &'static str,
    /// What the splits are.
    pub(super) splits_words: &'static str,
    /// What is said of settings where none are at hand.
    pub(super) settings_words: &'static str,
    /// Tags at the hub.
    pub(super) tags: &'static [&'static str],
    /// The hub's word for who made the labels.
    pub(super) annotations_creators: &'static str,
    /// Whose it is.
    pub(super) creators: Vec<String>,
    /// Which frames are rows, in words.
    pub(super) frames_words: &'static str,
    /// How often whoever acted succeeded, in words.
    pub(super) success_words: String,
    pub(super) limits: Vec<String>,
    /// The command that made it.
    pub(super) command: String,
    /// The datasets that it was made of, where it was made of datasets.
    pub(super) sources: Vec<SourceFacts>,
    /// The pipeline file that makes it again.
    pub(super) pipeline: Option<String>,
    pub(super) import_sha256: Option<String>,
    pub(super) bibtex: String,
    pub(super) cite_as: String,
    /// Documents that tell where it comes from, by name.
    #[serde(skip)]
    pub(super) provenance_files: Vec<(String, Vec<u8>)>,
    /// What was not at hand.
    #[serde(skip)]
    pub(super) left_out: Vec<String>,
}

impl Facts {
    /// Gathers all of it.
    pub(super) fn gather(dataset: &Path, publication: &Publication) -> Result<Self, PublishError> {
        let summary = summarize(dataset)?;
        let provenance = Provenance::of(dataset)?;
        let pipeline = provenance.pipeline(&publication.slug());
        let origin = Origin::of(dataset, &summary)?;
        let creators = creators(&origin, publication);
        let cite_as = citation(publication, &creators, summary.declared.is_none());
        let left_out = match pipeline {
            Some(_) => Vec::new(),
            // Its own plan tells of each of them how it was made.
            None if !provenance.sources().is_empty() || origin != Origin::Simulated => Vec::new(),
            None => vec!["pipeline.toml: the recordings and tasks of the dataset do not lie beside it".to_owned()],
        };
        Ok(Self {
            tables: tables(dataset, &summary)?,
            description: origin.description(&summary),
            labels_words: origin.labels(),
            acting_words: origin.acting(),
            splits_words: origin.splits(),
            settings_words: origin.unknown_settings(),
            tags: origin.tags(),
            annotations_creators: origin.annotations_creators(),
            creators,
            frames_words: frames_words(&summary),
            success_words: success_words(&origin, &summary, &provenance),
            limits: origin.limits(&summary),
            command: provenance.command().unwrap_or_else(|| origin.command().to_owned()),
            sources: provenance.sources(),
            import_sha256: provenance.import_sha256().map(ToOwned::to_owned),
            bibtex: if summary.declared.is_some() { cite_as.clone() } else { format!("{cite_as}\n{PAPER}") },
            cite_as,
            provenance_files: provenance_files(&provenance, pipeline.as_deref()),
            pipeline,
            left_out,
            summary,
        })
    }
}

fn frames_words(summary: &DatasetSummary) -> &'static str {
    if summary.declared.is_some() {
        ""
    } else if summary.frames == "boundaries" {
        "one at the end of each primitive, and the first"
    } else {
        "every recorded one"
    }
}

fn success_words(origin: &Origin, summary: &DatasetSummary, provenance: &Provenance) -> String {
    let all = summary.total_episodes + summary.failed_left_out;
    let mut words = origin.success(summary);
    if let Some((episodes, failed)) = provenance.demonstrated().filter(|(episodes, _)| *episodes == all) {
        words.push_str(&format!(" The recordings say the same: {failed} of {episodes} failed in physics."));
    }
    words
}

/// Whose it is.
fn creators(origin: &Origin, publication: &Publication) -> Vec<String> {
    match publication.creators.as_slice() {
        [] => vec![origin.default_creator().to_owned()],
        named => named.to_vec(),
    }
}

/// How the dataset itself is cited.
fn citation(publication: &Publication, creators: &[String], is_ours: bool) -> String {
    let url = publication.url.as_ref().map(|url| format!("\n  url     = {{{url}}},")).unwrap_or_default();
    let made = if is_ours { "made" } else { "checked and published" };
    format!(
        "@misc{{{},\n  title   = {{{}}},\n  author  = {{{}}},\n  year    = {{{}}},{url}\n  note    = {{Release {}, {made} \
         with ntp {}: Neural Task Programming as a dataset pipeline}}\n}}\n",
        publication.slug(),
        publication.name,
        creators.join(" and "),
        publication.date.year(),
        publication.release,
        env!("CARGO_PKG_VERSION")
    )
}

/// The pipeline file, and the plans it is made of.
fn provenance_files(provenance: &Provenance, pipeline: Option<&str>) -> Vec<(String, Vec<u8>)> {
    let mut files = Vec::new();
    let mut add = |name: &str, value: serde_json::Result<Vec<u8>>| {
        files.extend(value.ok().map(|text| (format!("provenance/{name}.json"), text)));
    };
    if let Some(plan) = &provenance.tasks {
        add("tasks_plan", serde_json::to_vec_pretty(plan));
    }
    if let Some((plan, manifest)) = &provenance.recordings {
        add("recordings_plan", serde_json::to_vec_pretty(plan));
        add("recordings_manifest", serde_json::to_vec_pretty(manifest));
    }
    files.extend(pipeline.map(|text| ("pipeline.toml".to_owned(), text.as_bytes().to_vec())));
    files
}
