//! `ntp ingest FILES… --map MAP.toml --to DATASET`: recordings of robots as a dataset; `--propose` writes a map.

use crate::cli::IngestArgs;
use crate::commands::{CommandOutcome, UsageError, output};
use crate::ingest::{Map, ingest, propose};
use crate::words::counted;

pub(super) fn run(args: &IngestArgs) -> anyhow::Result<CommandOutcome> {
    let [first, ..] = args.files.as_slice() else { return Err(UsageError("no recording".to_owned()).into()) };
    if args.propose {
        if args.files.len() > 1 {
            return Err(UsageError("--propose looks at one recording; give one".to_owned()).into());
        }
        output::print(propose(first)?.trim_end())?;
        return Ok(CommandOutcome::Done);
    }
    let (Some(map), Some(to)) = (&args.map, &args.to) else {
        return Err(UsageError("--map and --to are needed, or --propose".to_owned()).into());
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(args.jobs.map_or(0, usize::from)).build()?;
    let map = Map::read(map)?;
    let summary = pool.install(|| ingest(&args.files, &map, to))?;
    if args.json {
        output::print_json(&summary)?;
    } else {
        let (episodes, frames) = (summary.episodes, summary.frames);
        let mut lines =
            vec![format!("{}, {} in {}", counted(episodes, "episode"), counted(frames, "frame"), to.display())];
        if summary.cut + summary.empty > 0 {
            lines.push(format!("{} cut, {} without a row", counted(summary.cut, "episode"), summary.empty));
        }
        lines.extend(summary.lines());
        output::print(&lines.join("\n"))?;
    }
    Ok(if summary.is_lossy() { CommandOutcome::LeftOut } else { CommandOutcome::Done })
}
