//! What is told of labels that models made, carried on to what is made of them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde_json::json;

use crate::artifact::{IoError, write_json};
use crate::dataset::edit::target::EditSummary;
use crate::dataset::files::annotation::{Doubt, Model, Told};
use crate::dataset::files::layout;

/// What several sources must agree on to be told of all.
const COMMON: [&str; 3] = ["date", "key_frames", "doubt_below"];

/// The episodes of a source that are in what is made.
pub(super) struct Kept {
    /// The source.
    pub(super) root: PathBuf,
    /// By their numbers there, those in what is made.
    pub(super) numbers: BTreeMap<u64, u64>,
    /// How many there are in the source.
    pub(super) n_source: u64,
}

impl Kept {
    /// Those kept whose labels no model made.
    fn of_others(&self, told: &Option<Told>) -> Vec<u64> {
        match told {
            None => self.numbers.values().copied().collect(),
            Some(told) => told.episodes_of_others.iter().filter_map(|of| self.numbers.get(of)).copied().collect(),
        }
    }

    /// How many of a model's episodes are kept, where that is known: of several models nothing tells whose an episode is.
    fn episodes_of(&self, model: &Model, told: &Told) -> Option<u64> {
        let is_only = told.models.iter().filter(|model| model.episodes != Some(0)).count() == 1;
        let kept =
            self.numbers.keys().filter(|number| told.episodes_of_others.binary_search(number).is_err()).count() as u64;
        match model.episodes {
            Some(1..) if is_only => Some(kept),
            Some(1..) if (self.numbers.len() as u64) < self.n_source => None,
            all => all,
        }
    }
}

/// Writes what the sources tell, with the numbers that episodes have now, and adds the file to those of `summary`. What
/// was measured is told of one source alone: of several together nothing was.
pub(super) fn carry(sources: &[Kept], to: &Path, summary: &mut EditSummary) -> Result<(), IoError> {
    let mut told: Vec<(&Kept, Told)> = Vec::new();
    let mut episodes_of_others = Vec::new();
    for kept in sources {
        let of = Told::of(&kept.root)?;
        episodes_of_others.extend(kept.of_others(&of));
        told.extend(of.map(|of| (kept, of)));
    }
    episodes_of_others.sort_unstable();
    if episodes_of_others.len() as u64 == summary.episodes {
        return Ok(());
    }
    let Some((_, first)) = told.first() else { return Ok(()) };
    let mut others = first.others.clone();
    let differs = |key: &str| told.iter().any(|(_, other)| other.others.get(key) != first.others.get(key));
    others.retain(|key, _| !(COMMON.contains(&key.as_str()) && differs(key)));
    others.retain(|key, _| key != "subtasks" && !(key == "measured" && sources.len() > 1));
    for (key, count) in [
        ("episodes", summary.episodes),
        ("frames", summary.frames),
        ("calls", summary.calls),
        ("scopes", summary.scopes),
    ] {
        // Without program tables there are no calls to count.
        match count {
            0 => others.remove(key),
            _ => others.insert(key.to_owned(), json!(count)),
        };
    }
    let carried = Told { models: models(&told), doubtful: doubtful(&told), episodes_of_others, others };
    write_json(&to.join(layout::ANNOTATION), &carried)?;
    summary.files.push(layout::ANNOTATION.to_owned());
    summary.files.sort_unstable();
    Ok(())
}

/// The doubtful episodes that were kept; nothing where a source does not list them.
fn doubtful(told: &[(&Kept, Told)]) -> Option<Vec<Doubt>> {
    let mut all = Vec::new();
    for (kept, told) in told {
        let moved = |doubt: &Doubt| Some(Doubt { episode: *kept.numbers.get(&doubt.episode)?, ..doubt.clone() });
        all.extend(told.doubtful.as_ref()?.iter().filter_map(moved));
    }
    Some(all)
}

/// Each model once, with how many of its episodes there are.
fn models(told: &[(&Kept, Told)]) -> Vec<Model> {
    let mut all: Vec<Model> = Vec::new();
    for (kept, told) in told {
        for model in &told.models {
            let episodes = kept.episodes_of(model, told);
            match all.iter_mut().find(|known| known.identity == model.identity) {
                Some(known) => known.episodes = known.episodes.zip(episodes).map(|(a, b)| a + b),
                None => all.push(Model { episodes, identity: model.identity.clone() }),
            }
        }
    }
    all
}
