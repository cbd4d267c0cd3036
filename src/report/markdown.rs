//! `report.md`: the results as tables for a README or a terminal, and what made them.

mod glance;

use crate::report::chart::distinct;
use crate::report::chart::scale::{percent, short};
use crate::report::claims::{Claim, Note, Verdict};
use crate::report::detections::DetectionError;
use crate::report::robot_table::{PaperRobot, RobotRow, Share};
use crate::report::section::annotations::{self, LevelRow};
use crate::report::section::models::{self, ModelRow};
use crate::report::suite_names::SuiteNames;
use crate::report::summary::{Aggregate, FirstError, Report};

/// A column: its name, and whether numbers stand in it.
type Column<'c> = (&'c str, bool);

const COLUMNS: [Column<'static>; 12] = [
    ("suite", false),
    ("model", false),
    ("tasks", true),
    ("decoder", false),
    ("seeds", true),
    ("rollouts", true),
    ("success", true),
    ("goals met", true),
    ("95 % over rollouts", false),
    ("lowest, highest seed", false),
    ("95 % over seeds", false),
    ("paper", true),
];

/// The whole text.
pub(super) fn render(report: &Report) -> String {
    let mut text = format!("**{}**: {}.\n", report.title, made_by(report));
    let names = &SuiteNames::of(&report.aggregates);
    glance::glances(report, names).iter().for_each(|table| text.push_str(&format!("\n{table}")));
    let mut put = |columns: &[Column<'_>], rows: Vec<Vec<String>>| {
        if !rows.is_empty() {
            text.push('\n');
            text.push_str(&table(columns, rows));
        }
    };
    put(&COLUMNS, report.aggregates.iter().map(|of| row(of, names)).collect());
    put(&ROBOT_COLUMNS, report.robot_table.iter().map(|row| robot(row, names)).collect());
    put(&DETECTION_COLUMNS, report.detections.iter().map(|error| detection(error, names)).collect());
    put(&ANNOTATION_COLUMNS, annotations::rows(&report.annotations).into_iter().map(annotation).collect());
    put(&CLAIM_COLUMNS, report.claims.iter().map(claim).collect());
    let failed = report.aggregates.iter().filter_map(|row| failures(row, &report.errors, names));
    put(&FAILURE_COLUMNS, failed.collect());
    put(&MODEL_COLUMNS, models::models(&report.models).iter().map(model).collect());
    if !report.notes.is_empty() {
        text.push('\n');
        report.notes.iter().for_each(|said| text.push_str(&note(said)));
    }
    text
}

const ROBOT_COLUMNS: [Column<'static>; 9] = [
    ("robot table", false),
    ("model", false),
    ("trials", true),
    ("success", true),
    ("NTP failures", true),
    ("seen wrongly", true),
    ("manipulation failures", true),
    ("goals met", true),
    ("paper: success, NTP, manipulation", false),
];

fn robot(row: &RobotRow, names: &SuiteNames) -> Vec<String> {
    let told = |share: Share| {
        let [rate, low, high] = [share.rate, share.wilson_low, share.wilson_high].map(percent);
        format!("{rate} % ({low} to {high})")
    };
    let maybe = |share: Option<Share>| share.map_or_else(none, told);
    let paper = |paper: PaperRobot| {
        let shares = [paper.success, paper.ntp, paper.manipulation].map(percent);
        format!("{} % of {}", shares.join(", "), paper.trials)
    };
    vec![
        names.tell(&row.suite, &row.experiment),
        row.model.clone(),
        row.episodes.to_string(),
        told(row.success),
        maybe(row.ntp),
        maybe(row.localisation),
        maybe(row.manipulation),
        row.goals_met.map_or_else(none, |share| format!("{} %", percent(share))),
        row.paper.map_or_else(none, paper),
    ]
}

const ANNOTATION_COLUMNS: [Column<'static>; 9] = [
    ("annotations", false),
    ("episodes", true),
    ("exact", true),
    ("calls", true),
    ("level", false),
    ("frames", true),
    ("IoU", true),
    ("F1 at 0.1, 0.5, 1 s", true),
    ("edit", true),
];

fn annotation(row: LevelRow) -> Vec<String> {
    let LevelRow { name, is_first: _, episodes, exact, calls, level, frames, iou, boundary_f1, edit } = row;
    let f1 = boundary_f1.join(", ");
    vec![name, episodes.to_string(), exact.to_string(), calls, level, frames, iou, f1, edit]
}

const DETECTION_COLUMNS: [Column<'static>; 12] = [
    ("suite", false),
    ("model", false),
    ("tasks", true),
    ("seeds", true),
    ("block in sight", false),
    ("detections", true),
    ("median cm", true),
    ("mean absolute x, y, z", true),
    ("deviation", true),
    ("95 %, 99 %", true),
    ("over 2 cm", true),
    ("paper's deviation", true),
];

fn detection(error: &DetectionError, names: &SuiteNames) -> Vec<String> {
    let [x, y, z] = error.mean_absolute_cm;
    vec![
        names.tell(&error.suite, &error.experiment),
        error.model(),
        error.train_tasks.to_string(),
        error.seeds.to_string(),
        error.in_sight.words().to_owned(),
        error.detections.to_string(),
        format!("{:.2}", error.median_cm),
        format!("{x:.2}, {y:.2}, {z:.2}"),
        format!("{:.2}", error.deviation_cm),
        format!("{:.2}, {:.2}", error.percentile_95_cm, error.percentile_99_cm),
        format!("{:.2} %", 100.0 * error.over_2_cm),
        error.paper_deviation_cm.map_or_else(none, |deviation| format!("{deviation:.0}")),
    ]
}

const FAILURE_COLUMNS: [Column<'static>; 7] = [
    ("suite", false),
    ("model", false),
    ("tasks", true),
    ("decoder", false),
    ("failed", true),
    ("as judged", false),
    ("first error: program and kind", false),
];

/// Why an actor's rollouts in a suite failed; nothing where none did.
fn failures(row: &Aggregate, errors: &[FirstError], names: &SuiteNames) -> Option<Vec<String>> {
    let failed = row.episodes - row.successes;
    let causes = row.causes.iter().map(|(cause, count)| (*count, cause.clone()));
    let own = errors.iter().filter(|error| error.actor == row.actor && error.suite == row.suite);
    let firsts = own.map(|error| {
        let program = error.program.as_ref().map(|program| format!("{program}: ")).unwrap_or_default();
        (error.episodes, format!("{program}{}", error.error))
    });
    let [suite, model, tasks, decoder] = told_apart(row, names);
    let (causes, firsts) = (most_first(causes.collect()), most_first(firsts.collect()));
    (failed > 0).then(|| vec![suite, model, tasks, decoder, failed.to_string(), causes, firsts])
}

/// `scope 12, program 3`, the most first.
fn most_first(mut counts: Vec<(u64, String)>) -> String {
    counts.sort_by(|a, b| b.0.cmp(&a.0).then_with(|| a.1.cmp(&b.1)));
    let told = counts.iter().map(|(count, name)| format!("{} {count}", name.replace('_', " ")));
    told.collect::<Vec<_>>().join(", ")
}

const MODEL_COLUMNS: [Column<'static>; 6] = [
    ("experiment", false),
    ("model", false),
    ("tasks", true),
    ("seeds", true),
    ("parameters", true),
    ("CPU-seconds a training", true),
];

fn model(row: &ModelRow) -> Vec<String> {
    vec![
        row.experiment.clone(),
        row.variant.clone(),
        row.tasks.clone(),
        row.seeds.to_string(),
        row.parameters.clone(),
        row.cpu_secs.clone().unwrap_or_else(none),
    ]
}

fn none() -> String {
    "-".to_owned()
}

const CLAIM_COLUMNS: [Column<'static>; 5] =
    [("the paper's claim", false), ("experiment", false), ("encoder", false), ("here", false), ("figures", false)];

fn claim(claim: &Claim) -> Vec<String> {
    let verdict = match claim.verdict {
        Verdict::Reproduced => claim.verdict.words().to_owned(),
        _ => format!("**{}**", claim.verdict.words()),
    };
    vec![claim.claim.clone(), claim.experiment.clone(), claim.encoder.clone(), verdict, claim.ours.clone()]
}

fn note(note: &Note) -> String {
    match note.variant.as_str() {
        "" => format!("- {}\n", note.text),
        variant => format!("- `{variant}`: {}\n", note.text),
    }
}

/// What made the figures: program, commit, seeds, cost.
pub(super) fn made_by(report: &Report) -> String {
    let mut parts = vec![format!("ntp {}", report.ntp_version)];
    if !report.commits.is_empty() {
        parts.push(format!("pipeline files at commit {}", report.commits.join(", ")));
    }
    let mut seeds: Vec<i64> = report.models.iter().map(|model| model.seed).collect();
    seeds.sort_unstable();
    seeds.dedup();
    if !seeds.is_empty() {
        let seeds = seeds.iter().map(i64::to_string).collect::<Vec<_>>().join(", ");
        parts.push(format!("training seeds {seeds}"));
    }
    if !report.costs.is_empty() {
        let cpu_secs: Option<f64> = report.costs.iter().map(|cost| cost.cpu_secs).sum();
        let minutes = cpu_secs.map_or_else(|| "-".to_owned(), |secs| short((secs / 6.0).round() / 10.0));
        parts.push(format!("{minutes} CPU-minutes"));
    }
    let experiments = distinct(report.aggregates.iter().map(|row| &row.actor.experiment));
    if experiments.len() > 1 {
        parts.push(format!("experiments {}", experiments.join(", ")));
    }
    parts.join(", ")
}

/// What tells rows apart: suite, model, training tasks, decoder.
fn told_apart(row: &Aggregate, names: &SuiteNames) -> [String; 4] {
    [
        names.of_row(row),
        row.actor.model(),
        row.actor.train_tasks.map_or_else(none, |tasks| tasks.to_string()),
        row.actor.decoder.clone().unwrap_or_else(none),
    ]
}

fn row(row: &Aggregate, names: &SuiteNames) -> Vec<String> {
    let pair = |low: f64, high: f64| format!("[{low:.3}, {high:.3}]");
    let range = format!("{:.3}, {:.3}", row.lowest_success_rate, row.highest_success_rate);
    let of_seeds = row.seeds_low.zip(row.seeds_high);
    let figures = [
        row.seeds.to_string(),
        row.episodes.to_string(),
        format!("{:.3}", row.mean_success_rate),
        row.goals_met.map_or_else(none, |share| format!("{share:.3}")),
        pair(row.wilson_low, row.wilson_high),
        if row.seeds > 1 { range } else { none() },
        of_seeds.map_or_else(none, |(low, high)| pair(low, high)),
        row.paper_success_rate.map_or_else(none, |rate| format!("{rate:.3}")),
    ];
    told_apart(row, names).into_iter().chain(figures).collect()
}

/// A table whose columns stand one below the other in plain text too.
fn table(columns: &[Column<'_>], rows: Vec<Vec<String>>) -> String {
    let width = |at: usize| {
        let cells = rows.iter().map(|row| row[at].chars().count());
        cells.chain([columns[at].0.chars().count(), 3]).max().unwrap_or(3)
    };
    let widths: Vec<usize> = (0..columns.len()).map(width).collect();
    let pad = |(at, cell): (usize, &str)| match columns[at].1 {
        true => format!("{cell:>width$}", width = widths[at]),
        false => format!("{cell:<width$}", width = widths[at]),
    };
    let line = |cells: &[&str]| {
        let cells: Vec<String> = cells.iter().copied().enumerate().map(pad).collect();
        format!("| {} |\n", cells.join(" | "))
    };
    let rule = |at: usize| match columns[at].1 {
        true => format!("{}:", "-".repeat(widths[at] - 1)),
        false => "-".repeat(widths[at]),
    };
    let rules: Vec<String> = (0..columns.len()).map(rule).collect();
    let mut text = line(&columns.iter().map(|(name, _)| *name).collect::<Vec<_>>());
    text.push_str(&line(&rules.iter().map(String::as_str).collect::<Vec<_>>()));
    for row in &rows {
        text.push_str(&line(&row.iter().map(String::as_str).collect::<Vec<_>>()));
    }
    text
}
