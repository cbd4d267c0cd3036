//! `ntp publish DATASET --to DIR|URL --license ID --date DAY`.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::cli::PublishArgs;
use crate::commands::kind::Kind;
use crate::commands::{CommandOutcome, UsageError, output};
use crate::dataset::summarize;
use crate::publish::{Publication, publish};
use crate::store::StoreAddress;
use crate::words::{counted, shell_path};

pub(super) fn run(args: &PublishArgs, stop: &Arc<AtomicBool>) -> anyhow::Result<CommandOutcome> {
    let kind = Kind::of(&args.dataset)?;
    if kind != Kind::Dataset {
        let problem = format!("{} is a {}; only datasets are published", args.dataset.display(), kind.name());
        return Err(UsageError(problem).into());
    }
    let publication = publication(args)?;
    let summary = publish(&args.dataset, args.to.open()?.as_ref(), &publication, || !stop.load(Ordering::Relaxed))?;
    if args.json {
        output::print_json(&summary)?;
    } else {
        output::print(&format!(
            "{}, {}, {} → {} ({} written, {} there already)",
            counted(summary.files, "file"),
            counted(summary.bytes, "byte"),
            publication.license.spdx,
            args.to,
            summary.copied,
            summary.kept
        ))?;
        if let StoreAddress::Folder(folder) = &args.to {
            let script = shell_path(&folder.join("upload.sh"));
            output::note(&format!("to the Hugging Face hub: sh {script} OWNER/NAME"));
        }
    }
    if summary.warnings > 0 {
        let warnings = counted(summary.warnings, "warning");
        output::note(&format!("{warnings}: ntp validate {}", shell_path(&args.dataset)));
    }
    summary.left_out.iter().for_each(|left_out| output::note(&format!("left out: {left_out}")));
    Ok(if summary.left_out.is_empty() { CommandOutcome::Done } else { CommandOutcome::LeftOut })
}

fn publication(args: &PublishArgs) -> anyhow::Result<Publication> {
    let name = match &args.name {
        Some(name) => name.trim().to_owned(),
        None => default_name(&args.dataset)?,
    };
    let texts = args.creator.iter().chain(&args.url).chain([&name]);
    if let Some(text) = texts.into_iter().find(|text| text.is_empty() || text.chars().any(char::is_control)) {
        return Err(UsageError(format!("{text:?} is no name: it is empty or of more than one line")).into());
    }
    Ok(Publication {
        license: args.license,
        date: args.date,
        name,
        creators: args.creator.clone(),
        url: args.url.clone(),
        release: args.release,
    })
}

/// Of a dataset of ours by its families; of others, whose programs are of no family or that have none, by the folder's
/// name.
fn default_name(dataset: &Path) -> anyhow::Result<String> {
    let summary = summarize(dataset)?;
    if summary.declared.is_none() && !summary.families.is_empty() {
        return Ok(format!("NTP demonstrations: {}", summary.families.join(", ").replace('_', " ")));
    }
    let folder = dataset.canonicalize().unwrap_or_else(|_gone| dataset.to_owned());
    Ok(folder
        .file_name()
        .map(|name| name.to_string_lossy().trim().to_owned())
        .filter(|name| !name.is_empty() && !name.chars().any(char::is_control))
        .unwrap_or_else(|| "Robot episodes".to_owned()))
}
