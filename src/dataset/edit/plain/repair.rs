//! What can be verified of a broken dataset of anybody's features: its episodes from the first one on.

use std::path::Path;

use crate::dataset::edit::EditError;
use crate::dataset::edit::plain::target::{PlainTarget, Reading};
use crate::dataset::edit::plain::videos::Carry;
use crate::dataset::edit::target::EditSummary;
use crate::dataset::validate::episode_problem;

/// Writes the longest verified prefix; says what was found first behind it.
pub(in crate::dataset::edit) fn write_prefix(
    root: &Path,
    folder: &Path,
) -> Result<(EditSummary, Option<String>), EditError> {
    let mut reading = Reading::open(root)?;
    let mut target = PlainTarget::create(folder, &reading, Carry::Packets)?;
    let n_episodes = reading.source.episodes.len();
    let mut end = None;
    for position in 0..n_episodes {
        let verified = episode_problem(&reading.source, position);
        if let Some(problem) = verified {
            end = Some(problem);
            break;
        }
        match target.append(&mut reading, position, None) {
            Ok(()) => {}
            // Rows and pictures are read once more: what cannot be is no part of it.
            Err(EditError::Dataset(unreadable)) => {
                end = Some(unreadable.to_string());
                break;
            }
            Err(error) => return Err(error),
        }
    }
    if target.n_episodes() == 0 {
        let reason = end.unwrap_or_else(|| "it has no episode".to_owned());
        let problem = format!("not even its first episode can be verified: {reason}");
        return Err(EditError::refused("edit.empty", root, problem));
    }
    target.leave_out(n_episodes as u64 - target.n_episodes());
    Ok((target.finish(None)?, end))
}
