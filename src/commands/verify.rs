//! `ntp verify DIR|URL`: a published copy against its `SHA256SUMS`.

use crate::cli::VerifyArgs;
use crate::commands::{CommandOutcome, output};
use crate::publish::verify;
use crate::words::counted;

pub(super) fn run(args: &VerifyArgs) -> anyhow::Result<CommandOutcome> {
    let verified = verify(args.copy.open()?.as_ref())?;
    if args.json {
        output::print_json(&verified)?;
    } else {
        let mut lines: Vec<String> = Vec::new();
        for found in &verified.differences {
            let detail = if found.detail.is_empty() { String::new() } else { format!(": {}", found.detail) };
            lines.push(format!("{:10}  {}{detail}", found.difference.name(), found.path));
        }
        let n_differences = verified.differences.len();
        lines.push(match n_differences {
            0 => format!("as published: {}", counted(verified.files, "file")),
            n => format!("{} among {}", counted(n, "difference"), counted(verified.files, "file")),
        });
        output::print(&lines.join("\n"))?;
    }
    Ok(if verified.differences.is_empty() { CommandOutcome::Done } else { CommandOutcome::CheckFailed })
}
