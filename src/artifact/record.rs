//! Whether plan, receipts and manifest of a finished stage tell the same.

use std::path::Path;

use crate::artifact::stage_dir::read_if_there;
use crate::artifact::{ContractError, IoError, Manifest, Plan, Receipt, StageDir, read, sha256_bytes};

impl StageDir {
    /// Compares plan and receipts with the manifest. A folder without `receipts/` has been published, which leaves them
    /// out.
    ///
    /// # Errors
    ///
    /// [`ContractError::FileDiffers`] for the first file that does not tell what the manifest tells, and
    /// [`ContractError::Io`] for one that cannot be read.
    pub fn check_record(&self, manifest: &Manifest) -> Result<(), ContractError> {
        let path = self.plan_path();
        let plan = self.plan()?.ok_or_else(|| differs(&path, "missing".to_owned()))?;
        // Of the text: that of a number may have changed by less than its value tells.
        let found = (sha256_bytes(&compact(&read(&path)?)), plan.stage.as_str());
        let expected = (manifest.plan_id.clone(), manifest.stage.as_str());
        if found != expected {
            return Err(differs(&path, format!("its id and stage are {found:?}, but the manifest says {expected:?}")));
        }
        let folder = self.path().join("receipts");
        let has_receipts = folder.try_exists().map_err(IoError::system("read", &folder))?;
        if has_receipts { self.check_receipts(&plan, manifest) } else { Ok(()) }
    }

    fn check_receipts(&self, plan: &Plan, manifest: &Manifest) -> Result<(), ContractError> {
        let mut files = manifest.files.as_slice();
        let (mut episodes, mut failed) = (0_u64, 0_u64);
        for shard in 0..plan.shards {
            let path = self.receipt_path(shard);
            let receipt: Option<Receipt> = read_if_there(&path)?;
            let receipt = receipt.ok_or_else(|| differs(&path, "missing".to_owned()))?;
            let found = (receipt.plan_id.as_str(), receipt.shard);
            let expected = (manifest.plan_id.as_str(), shard);
            if found != expected {
                let problem = format!("its plan_id and shard are {found:?}, but the manifest makes them {expected:?}");
                return Err(differs(&path, problem));
            }
            let Some(rest) = files.strip_prefix(receipt.files.as_slice()) else {
                return Err(differs(&path, "its files are not those of the manifest".to_owned()));
            };
            files = rest;
            episodes = episodes.saturating_add(receipt.episodes);
            failed = failed.saturating_add(receipt.failed);
        }
        let (found, expected) = ((episodes, failed), (manifest.episodes, manifest.failed));
        if found != expected {
            let problem = format!("they count {found:?} episodes and failures, but the manifest says {expected:?}");
            return Err(differs(&self.path().join("receipts"), problem));
        }
        Ok(())
    }
}

fn differs(path: &Path, problem: String) -> ContractError {
    ContractError::FileDiffers { path: path.to_owned(), problem }
}

/// JSON without the spaces between its parts.
fn compact(json: &[u8]) -> Vec<u8> {
    let (mut is_text, mut is_escaped) = (false, false);
    let is_kept = |byte: &u8| {
        let is_part = is_text || !byte.is_ascii_whitespace();
        is_text ^= *byte == b'"' && !is_escaped;
        is_escaped = is_text && *byte == b'\\' && !is_escaped;
        is_part
    };
    json.iter().copied().filter(is_kept).collect()
}
