//! `ntp annotate DATASET --model MODEL… --to NEW`.

use crate::annotate::{AnnotateConfig, Annotation, Doubtful, KeyFrames, Measured, Model, annotate};
use crate::cli::{AnnotateArgs, KeyFrameChoice};
use crate::commands::dataset::refuse_within;
use crate::commands::{CommandOutcome, UsageError, output};
use crate::model::Decoder;
use crate::words::{counted, shell_path};

/// Doubtful episodes that are printed; all are in `ntp/annotation.json`.
const LISTED: usize = 20;

pub(super) fn run(args: &AnnotateArgs) -> anyhow::Result<CommandOutcome> {
    refuse_within(&args.dataset, &args.to)?;
    let decoder = Decoder::ALL.into_iter().find(|decoder| decoder.name() == args.decoder);
    let decoder = decoder.ok_or_else(|| UsageError(format!("unknown decoder {:?}", args.decoder)))?;
    let twice = args.model.iter().enumerate().find(|(at, path)| args.model[..*at].contains(path));
    if let Some((_, twice)) = twice {
        return Err(UsageError(format!("--model {} is given twice", twice.display())).into());
    }
    let models = args.model.iter().map(|path| Model::load(path, decoder));
    let mut models = models.collect::<Result<Vec<_>, _>>()?;
    let key_frames = match args.key_frames {
        KeyFrameChoice::Auto => KeyFrames::Auto,
        KeyFrameChoice::Rows => KeyFrames::Rows,
        KeyFrameChoice::Found => KeyFrames::Found,
    };
    let date = args.date.map(|date| date.to_string());
    let config = AnnotateConfig { doubt_below: args.doubt_below, key_frames, date };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(args.jobs.map_or(0, usize::from)).build()?;
    let annotation =
        pool.install(|| annotate(&args.dataset, &mut models, &args.to, &config, args.against.as_deref()))?;
    if args.json {
        output::print_json(&annotation)?;
    } else {
        output::print(&in_words(args, &annotation))?;
    }
    Ok(CommandOutcome::Done)
}

fn in_words(args: &AnnotateArgs, annotation: &Annotation) -> String {
    let (summary, to) = (annotation.summary, args.to.display());
    let (episodes, n_doubtful) = (summary.episodes, annotation.doubtful.len());
    let mut lines = vec![format!(
        "{to}: {}, {}, {n_doubtful} doubtful; key frames {}",
        counted(episodes, "episode"),
        counted(summary.calls, "call"),
        annotation.key_frames
    )];
    for model in annotation.models.iter().filter(|_| annotation.models.len() > 1) {
        lines.push(format!("  model {} ({}): {}", model.name, model.family.name(), counted(model.episodes, "episode")));
    }
    lines.extend(annotation.doubtful.iter().take(LISTED).map(|doubtful| doubt_in_words(args, doubtful)));
    if n_doubtful > LISTED {
        lines.push(format!("  {} more in {to}/ntp/annotation.json", n_doubtful - LISTED));
    }
    lines.extend(annotation.measured.as_ref().map(table));
    lines.join("\n")
}

fn doubt_in_words(args: &AnnotateArgs, doubtful: &Doubtful) -> String {
    let Doubtful { episode, confidence, doubts } = doubtful;
    let first = doubts.first().map(ToString::to_string).unwrap_or_default();
    let more = if doubts.len() > 1 { format!(" and {} more", doubts.len() - 1) } else { String::new() };
    let replay = format!("ntp replay {} --episode {episode} --spawn", shell_path(&args.to));
    format!("  episode {episode}, confidence {confidence:.2}: {first}{more}\n    {replay}")
}

/// How well the labels agree with true ones.
fn table(measured: &Measured) -> String {
    let percent = |part: u64, of: u64| format!("{:.1} %", 100.0 * part as f64 / of.max(1) as f64);
    let mut lines = vec![
        format!(
            "against {}: {}, {}",
            measured.truth,
            counted(measured.episodes, "episode"),
            counted(measured.frames, "frame")
        ),
        format!("  calls with right program and frames      {}", percent(measured.calls_with_span, measured.calls)),
        format!("  … and arguments                          {}", percent(measured.calls_with_argument, measured.calls)),
        format!("  episodes with every call right           {}", percent(measured.episodes_exact, measured.episodes)),
        format!(
            "  {:<10} {:>9} {:>7} {:>9} {:>9} {:>9} {:>7}",
            "level", "frames", "IoU", "F1 0.1 s", "F1 0.5 s", "F1 1 s", "edit"
        ),
    ];
    for (name, level) in &measured.levels {
        let f1: Vec<String> = level.boundary_f1.values().map(|f1| format!("{f1:>9.3}")).collect();
        let (frames, iou, edit) = (level.frame_accuracy, level.iou, level.edit_score);
        lines.push(format!("  {name:<10} {frames:>9.3} {iou:>7.3} {} {edit:>7.3}", f1.join(" ")));
    }
    lines.join("\n")
}
