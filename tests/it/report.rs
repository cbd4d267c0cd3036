//! Reports: from rollouts and metrics tables to results, tables and the page.

use std::fs::File;
use std::path::{Path, PathBuf};

use ntp::report::{
    DetectionsInput, Fact, Figure, InSight, MetricsInput, ModelParts, ModelSummary, ReportInputs, RolloutsInput,
    Series, StageCost, Verdict, json_schema, make, paper_values,
};
use ntp::trace::ObservationNoise;
use polars::prelude::{Column, DataFrame, DataType, ParquetWriter, df};
use serde_json::{Value, json};

/// One row of a rollouts table.
#[derive(Clone)]
struct Rollout {
    variant: &'static str,
    suite: &'static str,
    /// What the suite asks for: by the name that it has here, and known by nothing else to the report.
    facts: Facts,
    seed: i64,
    episode: i64,
    /// `None` for a success.
    cause: Option<&'static str>,
    /// Decision, kind and program.
    divergence: Option<(i64, &'static str, &'static str)>,
    train_tasks: i64,
    decoder: &'static str,
    /// Decision at which physics first went wrong.
    fault: Option<i64>,
}

/// What a suite asks for.
#[derive(Clone, Copy)]
struct Facts {
    split: &'static str,
    family: &'static str,
    blocks: Option<i64>,
    order: &'static str,
    /// Chance of a push and its impulse.
    push: [f64; 2],
    /// Instances of each category, at least and at most.
    counts: Option<[i64; 2]>,
    bowls: Option<i64>,
    /// Objects on the table in even and in odd episodes.
    objects: [i64; 2],
}

const STACKING: Facts = Facts {
    split: "unseen",
    family: "block_stacking",
    blocks: Some(8),
    order: "own",
    push: [0.0, 0.0],
    counts: None,
    bowls: None,
    objects: [8, 8],
};

fn facts(suite: &str) -> Facts {
    let sorting =
        |counts, objects| Facts { family: "object_sorting", blocks: None, counts: Some(counts), objects, ..STACKING };
    let cleanup = |bowls, forks| Facts {
        family: "table_cleanup",
        bowls: Some(bowls),
        ..sorting([forks, forks], [bowls + forks, bowls + forks])
    };
    match suite {
        "stacking_unseen" => STACKING,
        "stacking_seen" => Facts { split: "seen", ..STACKING },
        "stacking_topology" => Facts { split: "seen", order: "shuffled", ..STACKING },
        "stacking_adversary" => Facts { push: [0.25, 0.06], ..STACKING },
        "stacking_adversary_030_mns" => Facts { push: [0.25, 0.03], ..STACKING },
        "stacking_adversary_120_mns" => Facts { push: [0.25, 0.12], ..STACKING },
        "four_blocks" => Facts { blocks: Some(4), objects: [4, 4], ..STACKING },
        "sorting_unseen_4" => sorting([1, 1], [4, 4]),
        "sorting_unseen_40" => sorting([10, 10], [40, 40]),
        "sorting_unseen_mixed" => sorting([1, 3], [4, 12]),
        "cleanup_unseen_1_20" => cleanup(1, 20),
        "cleanup_unseen_4_5" => cleanup(4, 5),
        other => panic!("no facts of {other}"),
    }
}

/// Core, scoping and encoder of a variant.
fn parts(variant: &str) -> Option<[&'static str; 3]> {
    let (object_centric, flattened) = ("object_centric", "flattened");
    Some(match variant {
        "ntp" | "c" => ["reactive", "scoped", object_centric],
        "ntp_paper" => ["reactive", "scoped", flattened],
        "ntp_gru" | "b" => ["gru", "scoped", object_centric],
        "flat" | "a" => ["reactive", "primitives", object_centric],
        "flat_paper" => ["reactive", "primitives", flattened],
        "ntp_vid_e2e" => ["reactive", "scoped", "colour_slots"],
        "ntp_vid_e2e_paper" => ["reactive", "scoped", "convolved"],
        "ntp_vid_e2e_general" => ["reactive", "scoped", "keypoints"],
        "ntp_vid_detector" => ["reactive", "scoped", "detected"],
        "ntp_vid_detector_paper" => ["reactive", "scoped", "detected_flattened"],
        other => panic!("no parts of {other}"),
    })
}

fn write_parquet(path: &Path, mut table: DataFrame) {
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    ParquetWriter::new(File::create(path).unwrap()).finish(&mut table).unwrap();
}

/// So many times its episode for the rollouts that met an adversary: those of `ntp`.
fn disturbed(row: &Rollout, times: i64) -> Option<i64> {
    (row.variant == "ntp").then_some(times * row.episode)
}

/// Of four goals: all of a success, three of a failure.
fn goals_met(row: &Rollout) -> i64 {
    if row.cause.is_none() { 4 } else { 3 }
}

fn rollouts_table(rows: &[Rollout]) -> DataFrame {
    let text = |of: fn(&Rollout) -> &'static str| rows.iter().map(of).collect::<Vec<_>>();
    let maybe = |of: fn(&Rollout) -> Option<&'static str>| rows.iter().map(of).collect::<Vec<_>>();
    let part = |at: usize| rows.iter().map(|row| parts(row.variant).map(|parts| parts[at])).collect::<Vec<_>>();
    let whole = |of: fn(&Rollout) -> Option<i64>| rows.iter().map(of).collect::<Vec<_>>();
    let real = |of: fn(&Rollout) -> f64| rows.iter().map(|row| Some(of(row))).collect::<Vec<_>>();
    df!(
        "variant" => text(|row| row.variant),
        "suite" => text(|row| row.suite),
        "training_seed" => rows.iter().map(|row| row.seed).collect::<Vec<_>>(),
        "episode" => rows.iter().map(|row| row.episode).collect::<Vec<_>>(),
        "task_id" => rows.iter().map(|row| format!("stack_{:04}", row.episode)).collect::<Vec<_>>(),
        "split" => text(|row| row.facts.split),
        "outcome" => text(|row| row.cause.unwrap_or("success")),
        "success" => rows.iter().map(|row| row.cause.is_none()).collect::<Vec<_>>(),
        "cause" => maybe(|row| row.cause),
        "calls" => rows.iter().map(|row| 30 + row.episode % 7).collect::<Vec<_>>(),
        "decisions" => rows.iter().map(|row| 40 + row.episode % 7).collect::<Vec<_>>(),
        "first_divergence" => rows.iter().map(|row| row.divergence.map(|(at, ..)| at)).collect::<Vec<_>>(),
        "divergence_kind" => maybe(|row| row.divergence.map(|(_, kind, _)| kind)),
        "divergence_program" => maybe(|row| row.divergence.map(|(.., program)| program)),
        "sim_secs" => rows.iter().map(|row| 10.0 + 0.1 * row.episode as f64).collect::<Vec<_>>(),
        "train_tasks" => rows.iter().map(|row| Some(row.train_tasks)).collect::<Vec<_>>(),
        "specification" => maybe(|_| Some("trajectories")),
        "decoder" => maybe(|row| Some(row.decoder)),
        "fault_decision" => rows.iter().map(|row| row.fault).collect::<Vec<_>>(),
        "pushes" => rows.iter().map(|row| disturbed(row, 1)).collect::<Vec<_>>(),
        "toppled" => rows.iter().map(|row| disturbed(row, 2)).collect::<Vec<_>>(),
        "goals" => whole(|_| Some(4)),
        "goals_met" => whole(|row| Some(goals_met(row))),
        "objects" => whole(|row| Some(row.facts.objects[row.episode as usize % 2])),
        "family" => maybe(|row| Some(row.facts.family)),
        "blocks" => whole(|row| row.facts.blocks),
        "order" => maybe(|row| Some(row.facts.order)),
        "adversary_probability" => real(|row| row.facts.push[0]),
        "adversary_impulse_ns" => real(|row| row.facts.push[1]),
        "demonstrated_min" => whole(|row| row.facts.counts.map(|[min, _]| min)),
        "demonstrated_max" => whole(|row| row.facts.counts.map(|[_, max]| max)),
        "on_table_min" => whole(|row| row.facts.counts.map(|[min, _]| min)),
        "on_table_max" => whole(|row| row.facts.counts.map(|[_, max]| max)),
        "bowls" => whole(|row| row.facts.bowls),
        "core" => part(0),
        "scoping" => part(1),
        "encoder" => part(2),
    )
    .unwrap()
}

/// Seed 0 of `ntp`: four of five succeed. Seed 1: three of three. `flat`: none of two.
fn ten_rollouts() -> Vec<Rollout> {
    let row = |variant, seed, episode, cause, divergence| Rollout {
        variant,
        suite: "stacking_unseen",
        facts: facts("stacking_unseen"),
        seed,
        episode,
        cause,
        divergence,
        train_tasks: 1000,
        decoder: "mss",
        fault: None,
    };
    vec![
        row("flat", 0, 0, Some("missed_grasp"), Some((3, "argument", "block_stacking"))),
        row("ntp", 0, 0, None, None),
        row("ntp", 0, 1, None, None),
        row("ntp", 1, 0, None, None),
        row("ntp", 0, 2, Some("ended_early"), Some((17, "scope", "pick_and_place"))),
        row("ntp", 0, 3, None, Some((9, "program", "pick"))),
        row("ntp", 0, 4, None, None),
        row("flat", 0, 1, Some("never_ended"), Some((0, "program", "block_stacking"))),
        row("ntp", 1, 1, None, None),
        row("ntp", 1, 2, None, None),
    ]
}

/// Two levels; the loss halves every 100 steps. `end` was not recorded, one loss is not finite.
fn metrics_table(n_steps: i64) -> DataFrame {
    let steps: Vec<i64> = (0..n_steps).flat_map(|step| [step, step]).collect();
    let n = steps.len();
    let level = |row: usize| if row.is_multiple_of(2) { "pick" } else { "block_stacking" };
    let loss: Vec<Option<f32>> = steps.iter().map(|&step| Some(0.5_f32.powf(step as f32 / 100.0))).collect();
    let mut scope = loss.clone();
    scope.first_mut().into_iter().for_each(|loss| *loss = Some(f32::NAN));
    df!(
        "step" => &steps,
        "level" => (0..n).map(level).collect::<Vec<_>>(),
        "loss_program" => &loss,
        "loss_end" => vec![None::<f32>; n],
        "loss_scope" => scope,
        "loss_argument" => &loss,
        "loss_total" => &loss,
        "learning_rate" => vec![0.002_f32; n],
        "examples" => vec![32_i64; n],
    )
    .unwrap()
}

fn model() -> ModelSummary {
    ModelSummary {
        experiment: "ten".to_owned(),
        variant: "ntp".to_owned(),
        parts: ModelParts {
            core: Some("reactive".to_owned()),
            scoping: Some("scoped".to_owned()),
            encoder: Some("object_centric".to_owned()),
        },
        tag: None,
        train_tasks: 100,
        specification: "trajectories".to_owned(),
        seed: 0,
        parameters: 25_123,
        cpu_secs: Some(90.0),
    }
}

fn input(path: PathBuf) -> RolloutsInput {
    RolloutsInput { experiment: "ten".to_owned(), tag: None, noise: ObservationNoise::default(), path }
}

/// A run directory with ten rollouts in one file and one training.
struct Run {
    folder: tempfile::TempDir,
    inputs: ReportInputs,
}

impl Run {
    fn new(rows: &[Rollout]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let rollouts = folder.path().join("rollouts/all/rollouts.parquet");
        write_parquet(&rollouts, rollouts_table(rows));
        let metrics = folder.path().join("models/ntp/metrics.parquet");
        write_parquet(&metrics, metrics_table(300));
        let inputs = ReportInputs {
            title: "Ten <rollouts>".to_owned(),
            rollouts: vec![input(rollouts)],
            metrics: vec![MetricsInput { model: model(), path: metrics }],
            facts: vec![Fact {
                experiment: "ten".to_owned(),
                name: "training tasks".to_owned(),
                value: "100".to_owned(),
            }],
            costs: vec![StageCost {
                experiment: "ten".to_owned(),
                stage: "train".to_owned(),
                cpu_secs: Some(90.0),
                wall_secs: Some(50.0),
            }],
            commits: vec!["0123456789".to_owned()],
            paper: paper_values(),
            ..ReportInputs::default()
        };
        Self { folder, inputs }
    }

    fn out(&self) -> PathBuf {
        self.folder.path().join("report")
    }

    fn make(&self) -> ntp::report::Report {
        make(&self.inputs, &self.out()).unwrap()
    }

    fn text(&self, name: &str) -> String {
        std::fs::read_to_string(self.out().join(name)).unwrap()
    }
}

fn rollouts_path(run: &Run) -> &Path {
    &run.inputs.rollouts[0].path
}

#[test]
fn ten_rollouts_become_a_results_table() {
    let run = Run::new(&ten_rollouts());
    run.make();
    insta::assert_snapshot!(run.text("results.csv"), @r#"
    experiment,variant,core,scoping,encoder,tag,train_tasks,specification,decoder,suite,family,split,blocks,order,adversary_probability,adversary_impulse_ns,demonstrated_min,demonstrated_max,on_table_min,on_table_max,bowls,objects_min,objects_max,seed,episodes,successes,success_rate,wilson_low,wilson_high,goals_met,causes,failures,localisation_mm,mean_calls,mean_sim_secs,pushes,toppled
    ten,ntp,reactive,scoped,object_centric,,1000,trajectories,mss,stacking_unseen,block_stacking,unseen,8,own,0.000000,0.000000,,,,,,8,8,0,5,4,0.800000,0.375535,0.963776,0.950000,ended_early=1,"",,32.000000,10.200000,10,20
    ten,ntp,reactive,scoped,object_centric,,1000,trajectories,mss,stacking_unseen,block_stacking,unseen,8,own,0.000000,0.000000,,,,,,8,8,1,3,3,1.000000,0.438503,1.000000,1.000000,"","",,31.000000,10.100000,3,6
    ten,flat,reactive,primitives,object_centric,,1000,trajectories,mss,stacking_unseen,block_stacking,unseen,8,own,0.000000,0.000000,,,,,,8,8,0,2,0,0.000000,0.000000,0.657620,0.750000,missed_grasp=1;never_ended=1,"",,30.500000,10.050000,,
    "#);
}

/// A detector's errors along x, in two frames of two blocks each, one of which is half hidden.
fn detections_table() -> DataFrame {
    df!(
        "variant" => vec!["ntp_vid_detector"; 4],
        "suite" => vec!["stacking_unseen"; 4],
        "training_seed" => vec![0_i64; 4],
        "train_tasks" => vec![100_i64; 4],
        "error_x_m" => vec![0.001_f64, -0.003, 0.001, -0.03],
        "error_y_m" => vec![0.0_f64; 4],
        "error_z_m" => vec![0.0_f64, 0.004, 0.0, 0.04],
        "visible_share" => vec![1.0_f64, 0.8, 0.9, 0.5],
    )
    .unwrap()
}

#[test]
fn detections_become_errors_in_centimetres_by_what_is_in_sight() {
    let mut run = Run::new(&ten_rollouts());
    let path = run.folder.path().join("rollouts/all/detections.parquet");
    write_parquet(&path, detections_table());
    run.inputs.detections = vec![DetectionsInput { experiment: "ten".to_owned(), tag: None, path }];
    let report = run.make();
    let parts: Vec<InSight> = report.detections.iter().map(|error| error.in_sight).collect();
    assert_eq!(parts, [InSight::All, InSight::Full, InSight::Part]);
    let all = &report.detections[0];
    assert_eq!((all.detections, all.seeds), (4, 1));
    // Distances are 0.1, 0.1, 0.5 and 5 cm.
    assert_eq!([all.median_cm, all.percentile_95_cm, all.over_2_cm], [0.1, 5.0, 0.25]);
    assert_eq!(all.mean_absolute_cm, [0.875, 0.0, 1.1]);
    // Squares along x sum up to 9.11 cm², with a mean error of -0.775 cm; along z to 16.16 cm², with one of 1.1 cm.
    let variance = (9.11 / 4.0 - 0.775_f64.powi(2) + 16.16 / 4.0 - 1.1_f64.powi(2)) / 3.0;
    assert!((all.deviation_cm - variance.sqrt()).abs() < 1e-9, "{}", all.deviation_cm);
    assert_eq!((report.detections[1].detections, report.detections[2].median_cm), (3, 5.0));
    for (file, told) in [("report.md", "| 1/4 to 3/4"), ("index.html", "Detectors"), ("report.json", "\"in_sight\"")] {
        assert!(run.text(file).contains(told), "{file}");
    }
    assert!(report.inputs.iter().any(|input| input.path.ends_with("detections.parquet")));
}

#[test]
fn detectors_that_a_tag_tells_apart_have_rows_of_their_own() {
    let mut run = Run::new(&ten_rollouts());
    let path = run.folder.path().join("rollouts/all/detections.parquet");
    write_parquet(&path, detections_table());
    let of = |tag: Option<&str>| DetectionsInput {
        experiment: "ten".to_owned(),
        tag: tag.map(str::to_owned),
        path: path.clone(),
    };
    run.inputs.detections = vec![of(Some("wrist")), of(None)];
    let report = run.make();
    let all = report.detections.iter().filter(|error| error.in_sight == InSight::All);
    let told: Vec<_> = all.map(|error| (error.tag.as_deref(), error.detections)).collect();
    assert_eq!(told, [(None, 4), (Some("wrist"), 4)]);
    assert!(run.text("report.md").contains("| ntp_vid_detector (wrist) |"));
    assert!(run.text("index.html").contains("ntp_vid_detector (wrist)"));
}

#[test]
fn a_training_becomes_curves() {
    let run = Run::new(&ten_rollouts());
    run.make();
    let curves = run.text("curves.csv");
    let head: Vec<&str> = curves.lines().take(4).collect();
    insta::assert_snapshot!(head.join("\n"), @"
    experiment,variant,tag,train_tasks,specification,seed,level,step,loss_total,loss_program,loss_end,loss_scope,loss_argument
    ten,ntp,,100,trajectories,0,block_stacking,2,0.993108,0.993108,,0.993108,0.993108
    ten,ntp,,100,trajectories,0,block_stacking,5,0.972671,0.972671,,0.972671,0.972671
    ten,ntp,,100,trajectories,0,block_stacking,8,0.952653,0.952653,,0.952653,0.952653
    ");
    assert_eq!(curves.lines().count(), 1 + 2 * 100, "300 steps are 100 points of 3 steps at each of 2 levels");
}

#[test]
fn results_have_the_promised_keys_in_report_json() {
    let run = Run::new(&ten_rollouts());
    run.make();
    let report: Value = serde_json::from_str(&run.text("report.json")).unwrap();
    let results = report["results"].as_array().unwrap();
    let names: Vec<_> =
        results.iter().map(|row| (row["variant"].as_str().unwrap(), row["seed"].as_i64().unwrap())).collect();
    assert_eq!(names, [("ntp", 0), ("ntp", 1), ("flat", 0)]);
    let first = &results[0];
    assert_eq!(first["suite"], "stacking_unseen");
    assert_eq!((&first["episodes"], &first["successes"], &first["success_rate"]), (&5.into(), &4.into(), &0.8.into()));
    let (low, high) = ntp::report::wilson(4, 5);
    assert_eq!((&first["wilson_low"], &first["wilson_high"]), (&low.into(), &high.into()));
    assert_eq!(first["causes"], json!({"ended_early": 1}));
    assert_eq!(results[2]["causes"], json!({"missed_grasp": 1, "never_ended": 1}));
    assert_eq!(report["inputs"][1]["path"], "rollouts/all/rollouts.parquet");
    assert_eq!(report["inputs"][1]["sha256"].as_str().unwrap().len(), 64);
}

#[test]
fn seeds_are_averaged_and_the_paper_stands_beside() {
    let report = Run::new(&ten_rollouts()).make();
    let [ntp, flat] = report.aggregates.as_slice() else { panic!("{:?}", report.aggregates) };
    assert_eq!((ntp.seeds, ntp.episodes, ntp.successes), (2, 8, 7));
    assert!((ntp.mean_success_rate - 0.9).abs() < 1e-12);
    assert_eq!((ntp.lowest_success_rate, ntp.highest_success_rate), (0.8, 1.0));
    assert_eq!((ntp.wilson_low, ntp.wilson_high), ntp::report::wilson(7, 8));
    let (low, high) = ntp::report::student(&[0.8, 1.0]).unwrap();
    assert_eq!((ntp.seeds_low, ntp.seeds_high), (Some(low), Some(high)));
    assert_eq!((flat.seeds_low, flat.seeds_high), (None, None), "one seed says nothing of others");
    assert_eq!((ntp.pushes, ntp.toppled, flat.pushes), (Some(13), Some(26), None));
    assert_eq!((ntp.paper_success_rate, flat.paper_success_rate), (Some(0.863), None));
}

#[test]
fn models_that_differ_in_tasks_or_decoder_are_told_apart() {
    let mut rows = ten_rollouts();
    for (train_tasks, decoder) in [(20, "mss"), (1000, "argmax")] {
        rows.extend(ten_rollouts().into_iter().map(|row| Rollout { train_tasks, decoder, ..row }));
    }
    let report = Run::new(&rows).make();
    let told = report.aggregates.iter().map(|row| {
        let actor = &row.actor;
        (actor.variant.as_str(), actor.train_tasks.unwrap(), actor.decoder.as_deref().unwrap(), row.episodes)
    });
    let told: Vec<_> = told.collect();
    let of = |name, n| [(name, 1000, "mss", n), (name, 1000, "argmax", n), (name, 20, "mss", n)];
    assert_eq!(told, [of("ntp", 8), of("flat", 2)].concat());
}

#[test]
fn a_tagged_model_is_told_apart_and_stands_for_no_model_of_the_paper() {
    let mut run = Run::new(&ten_rollouts());
    let tagged = run.folder.path().join("rollouts/tagged/rollouts.parquet");
    let rows: Vec<Rollout> = ten_rollouts().into_iter().map(|row| Rollout { cause: None, ..row }).collect();
    write_parquet(&tagged, rollouts_table(&rows));
    run.inputs.rollouts.push(RolloutsInput { tag: Some("adaptive".to_owned()), ..input(tagged) });
    let report = run.make();
    let told: Vec<_> = report
        .aggregates
        .iter()
        .map(|row| (row.actor.variant.as_str(), row.actor.tag.as_deref(), row.successes, row.paper_success_rate))
        .collect();
    let expected = [
        ("ntp", None, 7, Some(0.863)),
        ("ntp", Some("adaptive"), 8, None),
        ("flat", None, 0, None),
        ("flat", Some("adaptive"), 2, None),
    ];
    assert_eq!(told, expected);
    assert!(report.claims.iter().all(|claim| !claim.ours.contains("1.000")), "{:?}", report.claims);
    assert!(run.text("report.md").contains("| ntp (adaptive) "));
    assert!(run.text("index.html").contains("<code>ntp (adaptive)</code>"));
}

#[test]
fn pushes_and_what_they_toppled_stand_on_the_page() {
    let run = Run::new(&ten_rollouts());
    run.make();
    let page = run.text("index.html");
    let (_, table) = page.split_once("what the adversary did, and what toppled").unwrap();
    // Of `ntp` alone: 13 pushes in 8 rollouts, 26 bodies.
    for cell in ["<td class=\"n\">13</td><td class=\"n\">1.62</td>", "<td class=\"n\">26</td><td class=\"n\">2.00</td>"]
    {
        assert!(table.contains(cell), "{cell}");
    }
}

#[test]
fn force_becomes_a_figure_when_it_is_swept() {
    let suites = ["stacking_unseen", "stacking_adversary", "stacking_adversary_030_mns", "stacking_adversary_120_mns"];
    let rows: Vec<Vec<Rollout>> =
        suites.iter().zip([20, 16, 19, 10]).map(|(suite, n)| rollouts("ntp", suite, n, 20)).collect();
    let figures = Run::new(&rows.concat()).make().figures;
    let force = figures.iter().find(|figure| figure.id == "stacking_adversary_force").unwrap();
    let points: Vec<_> = force.series[0].ours.iter().map(|point| (point.x, point.success_rate)).collect();
    assert_eq!(points, [(0, 1.0), (30, 0.95), (60, 0.8), (120, 0.5)]);
    let chance = figures.iter().find(|figure| figure.id == "stacking_adversary").unwrap();
    assert_eq!(chance.series[0].ours.iter().map(|point| point.x).collect::<Vec<_>>(), [0, 25]);
    let figures = Run::new(&rows[..2].concat()).make().figures;
    assert!(figures.iter().all(|figure| figure.id != "stacking_adversary_force"), "two forces are no sweep");
}

/// Twenty rollouts of the robot table: 16 succeed, and of the others one fails by what was seen, one by the model and two
/// in physics. A well calibrated camera's errors, times `worse`.
fn robot_table(worse: f64) -> DataFrame {
    let rows = rollouts("ntp", "stacking_unseen", 16, 20);
    let failures = [Some("localisation"), Some("ntp"), Some("manipulation"), Some("manipulation")];
    let mut left = failures.into_iter();
    let failure: Vec<Option<&str>> = rows.iter().map(|row| row.cause.and_then(|_| left.next()?)).collect();
    let suite = format!("robot_stacking_{}", 100.0 * worse);
    let all = |value: f64| vec![Some(value); rows.len()];
    let seen = df!(
        "suite" => vec![suite; rows.len()],
        "robot" => vec!["sawyer"; rows.len()],
        "jaw_m" => all(0.057),
        "camera" => vec!["front"; rows.len()],
        "sensor" => vec!["kinect"; rows.len()],
        "calibration_deg" => all(0.1 * worse),
        "calibration_mm" => all(1.5 * worse),
        "depth_mm" => all(2.0 * worse),
        "localisation_mm" => (0..rows.len()).map(|at| Some(3.0 + (at % 2) as f64)).collect::<Vec<_>>(),
        "failure" => failure,
    );
    let mut table = rollouts_table(&rows).drop("suite").unwrap();
    table.hstack_mut(seen.unwrap().columns()).unwrap();
    table
}

#[test]
fn a_robot_that_sees_stands_below_the_papers_real_one() {
    let run = Run::new(&rollouts("ntp", "stacking_unseen", 20, 20));
    assert_eq!(run.make().robot_table, []);
    assert!(!run.text("index.html").contains("Robot table"));
    write_parquet(rollouts_path(&run), robot_table(1.0));
    let report = run.make();
    let [row] = report.robot_table.as_slice() else { panic!("{:?}", report.robot_table) };
    let count = |share: Option<ntp::report::Share>| share.unwrap().count;
    assert_eq!((row.success.count, row.success.rate), (16, 0.8));
    // The paper counts what was seen wrongly as the model's.
    assert_eq!((count(row.ntp), count(row.localisation), count(row.manipulation)), (2, 1, 2));
    assert_eq!(row.ntp.unwrap().wilson_high, ntp::report::wilson(2, 20).1);
    assert_eq!(row.localisation_mm, Some(3.5));
    let paper = row.paper.unwrap();
    assert_eq!((paper.trials, paper.success, paper.ntp, paper.manipulation), (20, 0.90, 0.05, 0.05));
    assert_eq!(report.aggregates[0].paper_success_rate, None, "the simulated experiments have no such robot");
    for text in ["Robot table", "Block Stacking, real robot", "front camera off by 0.1\u{b0}, 1.5 mm, 2 mm in depth"] {
        assert!(run.text("index.html").contains(text), "{text}");
    }
    assert!(run.text("report.md").contains("80.0 % (58.4 to 91.9)"), "{}", run.text("report.md"));
}

#[test]
fn the_first_error_is_a_decision_unless_physics_went_wrong_before() {
    let mut rows = ten_rollouts();
    let physics = |fault| Rollout { seed: 2, cause: Some("dropped_object"), fault, ..ten_rollouts()[4].clone() };
    rows.extend([
        Rollout { episode: 0, ..physics(Some(16)) },
        Rollout { episode: 1, ..physics(Some(17)) },
        Rollout { episode: 2, divergence: None, ..physics(Some(3)) },
    ]);
    let report = Run::new(&rows).make();
    let told: Vec<_> = report
        .errors
        .iter()
        .filter(|error| error.actor.variant == "ntp")
        .map(|error| (error.program.as_deref(), error.error.as_str(), error.episodes))
        .collect();
    assert_eq!(told, [(None, "physics", 2), (Some("pick_and_place"), "scope", 2)]);
}

#[test]
fn the_markdown_says_what_made_the_figures() {
    let run = Run::new(&ten_rollouts());
    run.make();
    insta::assert_snapshot!(run.text("report.md"), @"
    **Ten <rollouts>**: ntp 0.1.0, pipeline files at commit 0123456789, training seeds 0, 1.5 CPU-minutes.

    | suite           | model | tasks | decoder | seeds | rollouts | success | goals met | 95 % over rollouts | lowest, highest seed | 95 % over seeds | paper |
    | --------------- | ----- | ----: | ------- | ----: | -------: | ------: | --------: | ------------------ | -------------------- | --------------- | ----: |
    | stacking_unseen | ntp   |  1000 | mss     |     2 |        8 |   0.900 |     0.975 | [0.529, 0.978]     | 0.800, 1.000         | [0.000, 1.000]  | 0.863 |
    | stacking_unseen | flat  |  1000 | mss     |     1 |        2 |   0.000 |     0.750 | [0.000, 0.658]     | -                    | -               |     - |

    | the paper's claim                                 | experiment | encoder        | here       | figures                                                                           |
    | ------------------------------------------------- | ---------- | -------------- | ---------- | --------------------------------------------------------------------------------- |
    | NTP stacks unseen configurations better than Flat | ten        | object-centric | reproduced | ntp 0.900 (stacking_unseen, 1000 tasks), flat 0.000 (stacking_unseen, 1000 tasks) |

    | suite           | model | tasks | decoder | failed | as judged                     | first error: program and kind                         |
    | --------------- | ----- | ----: | ------- | -----: | ----------------------------- | ----------------------------------------------------- |
    | stacking_unseen | ntp   |  1000 | mss     |      1 | ended early 1                 | pick and place: scope 1                               |
    | stacking_unseen | flat  |  1000 | mss     |      2 | missed grasp 1, never ended 1 | block stacking: argument 1, block stacking: program 1 |

    | experiment | model | tasks | seeds | parameters | CPU-seconds a training |
    | ---------- | ----- | ----: | ----: | ---------: | ---------------------: |
    | ten        | ntp   |   100 |     1 |     25 123 |                     90 |
    ");
}

#[test]
fn the_markdown_begins_with_models_by_suite_and_the_papers_figures_beside_the_most_tasks() {
    let mut few = rollouts("ntp", "stacking_unseen", 3, 4);
    few.iter_mut().for_each(|row| row.train_tasks = 2);
    let mut argmax = rollouts("ntp", "stacking_unseen", 1, 4);
    argmax.iter_mut().for_each(|row| row.decoder = "argmax");
    let most = rollouts("ntp", "stacking_unseen", 4, 4);
    let topology = rollouts("ntp", "stacking_topology", 2, 4);
    let mut rows = [argmax, most, topology, rollouts("flat", "stacking_unseen", 0, 2)].concat();
    rows.iter_mut().for_each(|row| row.train_tasks = 1000);
    let run = Run::new(&[few, rows].concat());
    run.make();
    let text = run.text("report.md");
    let glance: Vec<&str> = text.lines().skip(2).take(5).collect();
    insta::assert_snapshot!(glance.join("\n"), @"
    | model | tasks | stacking_unseen | stacking_topology |
    | ----- | ----: | --------------: | ----------------: |
    | ntp   |  1000 |   1.000 (0.863) |             0.500 |
    | ntp   |     2 |           0.750 |                 - |
    | flat  |  1000 |           0.000 |                 - |
    ");
}

#[test]
fn a_figure_of_the_paper_stands_only_beside_results_of_its_conditions() {
    let told = |variant: &'static str, suite: &'static str, train_tasks: i64| {
        let rows = rollouts(variant, suite, 1, 4).into_iter().map(|row| Rollout { train_tasks, ..row });
        let [row] = <[_; 1]>::try_from(Run::new(&rows.collect::<Vec<_>>()).make().aggregates).unwrap();
        row.paper_success_rate
    };
    for encoder in ["ntp", "ntp_paper"] {
        assert_eq!(told(encoder, "stacking_unseen", 1000), Some(0.863), "{encoder}");
    }
    assert_eq!(told("ntp", "stacking_unseen", 100), None, "the paper trains on a thousand tasks");
    assert_eq!(told("ntp", "four_blocks", 1000), None, "the paper has eight blocks");
    assert_eq!(told("ntp_vid_e2e", "stacking_unseen", 1000), None, "the paper's figure is of full state");
    assert_eq!(told("ntp_gru", "stacking_adversary", 1000), Some(0.422));
    assert_eq!(told("ntp", "stacking_adversary_030_mns", 1000), None, "another push than the usual");
    assert_eq!([4, 5].map(|tasks| told("flat", "sorting_unseen_40", tasks)), [Some(0.25), None]);
    assert_eq!(told("ntp", "sorting_unseen_mixed", 4), Some(0.9), "4 to 12 objects are 4 to 40");
    assert_eq!(told("flat", "sorting_unseen_mixed", 4), None, "the paper's flat models are at 4 and at 40");
}

#[test]
fn suites_and_models_by_any_name_give_the_same_figures() {
    let suites = ["stacking_unseen", "stacking_seen", "stacking_adversary", "stacking_adversary_030_mns"];
    let others = ["sorting_unseen_4", "sorting_unseen_40", "cleanup_unseen_1_20", "cleanup_unseen_4_5"];
    let suites = [suites, others].concat();
    let names = ["h", "g", "stacking_adversary_p50", "sorting_unseen_4", "e", "d", "c", "b"];
    let made = |names: &[&'static str], variants: [&'static str; 3]| {
        let of_suite = |(&suite, &name): (&&'static str, &&'static str)| {
            let rows = variants
                .into_iter()
                .zip([10, 8, 5])
                .flat_map(|(variant, n)| rollouts(variant, suite, n, 10))
                .map(|row| Rollout { suite: name, ..row });
            rows.collect::<Vec<_>>()
        };
        let mut rows: Vec<Rollout> = suites.iter().zip(names).flat_map(of_suite).collect();
        rows.iter_mut().for_each(|row| row.train_tasks = 1000);
        let report = Run::new(&rows).make();
        let verdicts: Vec<_> = report.claims.iter().map(|claim| (claim.id.clone(), claim.verdict)).collect();
        let rates: Vec<_> =
            report.aggregates.iter().map(|row| (row.mean_success_rate, row.paper_success_rate)).collect();
        let points = |series: &Series| (series.ours.clone(), series.paper.clone());
        let figure = |figure: &Figure| (figure.id.clone(), figure.series.iter().map(points).collect::<Vec<_>>());
        let figures: Vec<_> = report.figures.iter().map(figure).collect();
        let cells: Vec<_> = report.grids.iter().map(|grid| grid.cells.clone()).collect();
        (figures, cells, verdicts, rates)
    };
    let (figures, cells, verdicts, rates) = made(&suites, ["ntp", "ntp_gru", "flat"]);
    assert!(figures.len() >= 3 && !cells.is_empty() && verdicts.len() >= 5, "{figures:?} {cells:?} {verdicts:?}");
    // In the order of the alphabet the models would stand the other way round.
    assert_eq!((figures, cells, verdicts, rates), made(&names, ["c", "b", "a"]));
}

#[test]
fn claims_and_figures_are_of_one_experiment() {
    let mut run = Run::new(&rollouts("ntp", "stacking_unseen", 90, 100));
    let other = run.folder.path().join("rollouts/other/rollouts.parquet");
    let of_other =
        [rollouts("flat", "stacking_unseen", 10, 100), rollouts("ntp", "stacking_unseen", 100, 100)].concat();
    let few = of_other.into_iter().map(|row| Rollout { train_tasks: 2, ..row });
    write_parquet(&other, rollouts_table(&few.collect::<Vec<_>>()));
    run.inputs.rollouts.push(RolloutsInput { experiment: "other".to_owned(), ..input(other) });
    let report = run.make();
    let told: Vec<_> = report.claims.iter().map(|claim| (claim.id.as_str(), claim.experiment.as_str())).collect();
    // Not `ntp` of one experiment above `flat` of the other, nor 4 tasks of one above 2 of the other.
    assert_eq!(told, [("stacking_flat", "other")]);
    assert!(report.figures.is_empty(), "two numbers of tasks, each in an experiment of its own: {:?}", report.figures);
}

#[test]
fn suites_of_one_name_are_told_with_their_experiments() {
    let rows = [rollouts("ntp", "stacking_unseen", 9, 10), rollouts("ntp", "stacking_seen", 10, 10)].concat();
    let mut run = Run::new(&rows);
    let other = run.folder.path().join("rollouts/other/rollouts.parquet");
    write_parquet(&other, rollouts_table(&rollouts("ntp", "stacking_unseen", 7, 10)));
    run.inputs.rollouts.push(RolloutsInput { experiment: "twelve_blocks".to_owned(), ..input(other) });
    run.make();
    let experiment = &run.inputs.rollouts[0].experiment;
    let (markdown, page) = (run.text("report.md"), run.text("index.html"));
    for name in [format!("stacking_unseen of {experiment}"), "stacking_unseen of twelve_blocks".to_owned()] {
        // Its success and its failures; on the page its dots, results, seeds and causes.
        assert_eq!(markdown.lines().filter(|line| line.starts_with(&format!("| {name} "))).count(), 2, "{markdown}");
        assert!(page.matches(&name).count() >= 4, "{name}: {}", page.matches(&name).count());
    }
    assert!(!markdown.contains("stacking_seen of"), "its name is enough: {markdown}");
}

#[test]
fn tables_without_facts_are_read_and_nothing_of_the_paper_stands_beside() {
    let run = Run::new(&ten_rollouts());
    let later =
        ["goals", "goals_met", "objects", "family", "blocks", "order", "adversary_probability", "adversary_impulse_ns"];
    let further =
        ["demonstrated_min", "demonstrated_max", "on_table_min", "on_table_max", "bowls", "core", "scoping", "encoder"];
    let table = rollouts_table(&ten_rollouts()).drop_many(later.into_iter().chain(further));
    write_parquet(rollouts_path(&run), table);
    let report = run.make();
    let told: Vec<_> =
        report.aggregates.iter().map(|row| (row.successes, row.goals_met, row.paper_success_rate)).collect();
    assert_eq!(told, [(0, None, None), (7, None, None)], "by name, since nothing else is known");
    assert!(report.figures.is_empty() && report.claims.is_empty());
    assert!(run.text("report.md").contains("|   0.900 |         - |"), "{}", run.text("report.md"));
}

#[test]
fn goals_met_are_averaged_over_rollouts_and_seeds() {
    let report = Run::new(&ten_rollouts()).make();
    // Seed 0 of `ntp` meets 4, 4, 3, 4 and 4 of 4 goals, seed 1 all; `flat` 3 of 4 twice.
    let told: Vec<_> = report.results.iter().map(|result| result.goals_met.unwrap()).collect();
    assert_eq!(told, [0.95, 1.0, 0.75]);
    assert_eq!(report.aggregates[0].goals_met, Some(0.975));
}

#[test]
fn curves_are_short_and_leave_out_what_is_not_finite() {
    let run = Run::new(&[]);
    write_parquet(&run.inputs.metrics[0].path, metrics_table(5000));
    let report = run.make();
    let curves = run.text("curves.csv");
    assert!((200..=241).contains(&curves.lines().count()), "{} lines", curves.lines().count());
    assert!(!curves.contains("NaN") && !curves.contains("inf"));
    assert_eq!(report.training.iter().map(|end| end.step).collect::<Vec<_>>(), [4999, 4999]);
}

#[test]
fn the_page_needs_nothing_else_and_escapes_what_it_is_given() {
    let run = Run::new(&ten_rollouts());
    run.make();
    let page = run.text("index.html");
    let page = page.replace("src=\"data:image/jpeg;base64,", "");
    for outside in ["http:", "https:", "src=", "<link", "<script", "@import", "url("] {
        assert!(!page.contains(outside), "the page has {outside}");
    }
    assert!(page.contains("Ten &lt;rollouts&gt;") && !page.contains("Ten <rollouts>"));
    assert!(page.contains("prefers-color-scheme: dark") && page.contains("width=device-width"));
    for tag in ["section", "div", "svg", "table", "tr", "figure", "details", "ul", "span", "p"] {
        let count =
            |start: String| page.matches(&format!("{start} ")).count() + page.matches(&format!("{start}>")).count();
        assert_eq!(count(format!("<{tag}")), count(format!("</{tag}")), "<{tag}>");
    }
}

#[test]
fn the_page_shows_every_part() {
    let run = Run::new(&ten_rollouts());
    run.make();
    let page = run.text("index.html");
    for part in [
        "<code>stacking_unseen</code> <small>Block Stacking, 8 blocks, unseen tasks</small>",
        "97.5 % of goals met",
        "8 rollouts",
        "paper 86.3 %<b>+3.7 pts</b>",
        "ended early: 1 of 8 rollouts, 12.5 %",
        "<code>ntp</code> 1 of 1 failure; 1 recovered",
        "decision 17: scope, 1 rollout</title>",
        "ntp, 100 tasks, training seed 0: 0.1267 in the end",
        "<dt>training tasks</dt><dd>100</dd>",
        "rollouts.parquet</code>",
    ] {
        assert!(page.contains(part), "the page lacks {part}");
    }
}

#[test]
fn the_same_inputs_in_any_order_give_the_same_bytes() {
    let mut run = Run::new(&ten_rollouts()[..5]);
    let second = run.folder.path().join("rollouts/more/rollouts.parquet");
    write_parquet(&second, rollouts_table(&ten_rollouts()[5..]));
    run.inputs.rollouts.push(input(second));
    let files = || ["report.json", "report.md", "results.csv", "curves.csv", "index.html"].map(|name| run.text(name));
    make(&run.inputs, &run.out()).unwrap();
    let before = files();
    let mut inputs = run.inputs.clone();
    inputs.rollouts.reverse();
    make(&inputs, &run.out()).unwrap();
    assert_eq!(before, files());
}

#[test]
fn rows_in_any_order_give_the_same_results() {
    let rows = ten_rollouts();
    let reversed: Vec<Rollout> = rows.iter().rev().cloned().collect();
    assert_eq!(Run::new(&rows).make().results, Run::new(&reversed).make().results);
}

/// The ten rollouts by the writer that the rollout stage uses.
fn write_own_table(path: &Path) {
    use ntp::rollout::ROLLOUTS;
    use ntp::table::{Column, write};
    let rows = ten_rollouts();
    let text = |of: fn(&Rollout) -> &str| Column::Text(rows.iter().map(|row| of(row).to_owned()).collect());
    let whole = |of: fn(&Rollout) -> i64| Column::Int64(rows.iter().map(of).collect());
    let maybe = |of: fn(&Rollout) -> Option<&'static str>| {
        Column::OptionalText(rows.iter().map(|row| of(row).map(str::to_owned)).collect())
    };
    let maybe_whole = |of: fn(&Rollout) -> Option<i64>| Column::OptionalInt64(rows.iter().map(of).collect());
    let columns = vec![
        ("variant", text(|row| row.variant)),
        ("suite", text(|row| row.suite)),
        ("training_seed", whole(|row| row.seed)),
        ("episode", whole(|row| row.episode)),
        ("task_id", text(|_| "stack_0000")),
        ("split", text(|_| "unseen")),
        ("outcome", text(|row| row.cause.unwrap_or("success"))),
        ("success", Column::Boolean(rows.iter().map(|row| row.cause.is_none()).collect())),
        ("cause", maybe(|row| row.cause)),
        ("calls", whole(|row| 30 + row.episode % 7)),
        ("decisions", whole(|row| 40 + row.episode % 7)),
        ("first_divergence", Column::OptionalInt64(rows.iter().map(|row| row.divergence.map(|(at, ..)| at)).collect())),
        ("divergence_kind", maybe(|row| row.divergence.map(|(_, kind, _)| kind))),
        ("divergence_program", maybe(|row| row.divergence.map(|(.., program)| program))),
        ("sim_secs", Column::Float64(rows.iter().map(|row| 10.0 + 0.1 * row.episode as f64).collect())),
        ("train_tasks", Column::OptionalInt64(rows.iter().map(|row| Some(row.train_tasks)).collect())),
        ("specification", maybe(|_| Some("trajectories"))),
        ("decoder", maybe(|row| Some(row.decoder))),
        ("fault_decision", Column::OptionalInt64(rows.iter().map(|row| row.fault).collect())),
        ("pushes", Column::OptionalInt64(rows.iter().map(|row| disturbed(row, 1)).collect())),
        ("toppled", Column::OptionalInt64(rows.iter().map(|row| disturbed(row, 2)).collect())),
        ("goals", maybe_whole(|_| Some(4))),
        ("goals_met", maybe_whole(|row| Some(goals_met(row)))),
        ("objects", maybe_whole(|_| Some(8))),
        ("family", maybe(|row| Some(row.facts.family))),
        ("blocks", maybe_whole(|row| row.facts.blocks)),
        ("order", maybe(|row| Some(row.facts.order))),
        ("adversary_probability", Column::OptionalFloat64(vec![Some(0.0); rows.len()])),
        ("adversary_impulse_ns", Column::OptionalFloat64(vec![Some(0.0); rows.len()])),
        ("demonstrated_min", maybe_whole(|_| None)),
        ("demonstrated_max", maybe_whole(|_| None)),
        ("on_table_min", maybe_whole(|_| None)),
        ("on_table_max", maybe_whole(|_| None)),
        ("bowls", maybe_whole(|_| None)),
        ("robot", maybe(|_| Some("gripper"))),
        ("jaw_m", Column::OptionalFloat64(vec![Some(0.07); rows.len()])),
        ("camera", maybe(|_| None)),
        ("sensor", maybe(|_| None)),
        ("calibration_deg", Column::OptionalFloat64(vec![None; rows.len()])),
        ("calibration_mm", Column::OptionalFloat64(vec![None; rows.len()])),
        ("depth_mm", Column::OptionalFloat64(vec![None; rows.len()])),
        ("localisation_mm", Column::OptionalFloat64(vec![None; rows.len()])),
        ("failure", maybe(|_| None)),
        ("core", maybe(|row| parts(row.variant).map(|parts| parts[0]))),
        ("scoping", maybe(|row| parts(row.variant).map(|parts| parts[1]))),
        ("encoder", maybe(|row| parts(row.variant).map(|parts| parts[2]))),
    ];
    write(path, &ROLLOUTS, columns).unwrap();
}

#[test]
fn tables_of_our_own_writer_give_the_same_report() {
    let run = Run::new(&ten_rollouts());
    let before = run.make();
    write_own_table(rollouts_path(&run));
    let after = run.make();
    assert_eq!(before.results, after.results);
    assert_eq!(before.divergences, after.divergences);
}

#[test]
fn a_report_of_nothing_is_a_report() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("report");
    let report = make(&ReportInputs { title: "Nothing".to_owned(), ..ReportInputs::default() }, &out).unwrap();
    assert!(report.results.is_empty() && report.training.is_empty());
    let page = std::fs::read_to_string(out.join("index.html")).unwrap();
    assert!(page.contains("No rollouts yet.") && page.contains("No training metrics yet."));
    let header = std::fs::read_to_string(out.join("results.csv")).unwrap();
    assert_eq!(header.lines().count(), 1);
}

#[test]
fn tables_without_rows_and_rollouts_without_failures_make_a_page() {
    let run = Run::new(&[]);
    write_parquet(&run.inputs.metrics[0].path, metrics_table(0));
    run.make();
    assert!(run.text("index.html").contains("No rollouts yet."));
    let successes: Vec<Rollout> = ten_rollouts().into_iter().filter(|row| row.cause.is_none()).collect();
    let run = Run::new(&successes);
    run.make();
    assert!(run.text("index.html").contains("No failures."));
}

/// Makes a report of a run with one thing changed.
#[track_caller]
fn check_error(change: impl FnOnce(&mut Run), expected: &str) {
    let mut run = Run::new(&ten_rollouts());
    change(&mut run);
    let error = make(&run.inputs, &run.out()).unwrap_err().to_string();
    let error = error.replace(&run.folder.path().display().to_string(), "RUN");
    assert!(error.contains(expected), "{error}\ndoes not contain\n{expected}");
    assert!(!run.out().exists(), "something was written in spite of the error");
}

#[test]
fn a_table_that_cannot_be_trusted_is_refused_by_name() {
    let rewrite = |change: fn(DataFrame) -> DataFrame| {
        move |run: &mut Run| write_parquet(rollouts_path(run), change(rollouts_table(&ten_rollouts())))
    };
    check_error(
        rewrite(|table| table.drop("suite").unwrap()),
        "column suite is missing; there are variant, training_seed, episode,",
    );
    check_error(
        rewrite(|mut table| {
            let seeds = table.column("training_seed").unwrap().cast(&DataType::Float64).unwrap();
            table.with_column(seeds).unwrap();
            table
        }),
        "column training_seed is f64, not i64: RUN/rollouts/all/rollouts.parquet",
    );
    check_error(
        rewrite(|mut table| {
            table.with_column(Column::new("success".into(), [true; 10])).unwrap();
            table
        }),
        "3 rows in which success is not what the outcome says: RUN/rollouts/all/rollouts.parquet",
    );
    check_error(
        rewrite(|mut table| {
            table.with_column(Column::new("divergence_kind".into(), ["mood"; 10])).unwrap();
            table
        }),
        "4 rows in which first_divergence has no program, or a kind that is not one of",
    );
    check_error(
        |run| run.inputs.rollouts.push(input(rollouts_path(run).to_owned())),
        "2 episodes of experiment ten, variant flat trained on 1000 tasks, decoder mss, suite stacking_unseen, training seed 0 occur more than once",
    );
    check_error(
        |run| {
            let bytes = std::fs::read(rollouts_path(run)).unwrap();
            std::fs::write(rollouts_path(run), &bytes[..bytes.len() / 2]).unwrap();
        },
        "cannot read the table: ",
    );
    check_error(
        |run| std::fs::remove_file(rollouts_path(run)).unwrap(),
        "failed to open RUN/rollouts/all/rollouts.parquet",
    );
    check_error(|run| run.inputs.metrics[0].path = rollouts_path(run).to_owned(), "column step is missing");
}

#[test]
fn the_committed_report_schema_is_the_generated_one() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("schemas/report.schema.json");
    let mut generated = serde_json::to_string_pretty(&json_schema()).unwrap();
    generated.push('\n');
    if std::fs::read_to_string(&path).ok().as_ref() != Some(&generated) {
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, &generated).unwrap();
        panic!("{} was stale and has been written anew: look at the change and commit it", path.display());
    }
}

/// So many rollouts of which the first ones succeed.
fn rollouts(variant: &'static str, suite: &'static str, successes: i64, episodes: i64) -> Vec<Rollout> {
    let row = |episode| Rollout {
        variant,
        suite,
        facts: facts(suite),
        seed: 0,
        episode,
        cause: (episode >= successes).then_some("never_ended"),
        divergence: None,
        train_tasks: 4,
        decoder: "mss",
        fault: None,
    };
    (0..episodes).map(row).collect()
}

#[test]
fn a_figure_of_the_paper_has_ours_and_theirs_by_length() {
    let rows = [
        rollouts("ntp", "sorting_unseen_4", 19, 20),
        rollouts("ntp", "sorting_unseen_40", 18, 20),
        rollouts("flat_paper", "sorting_unseen_4", 2, 20),
        rollouts("ntp", "sorting_unseen_mixed", 0, 20),
    ];
    let report = Run::new(&rows.concat()).make();
    let [figure] = report.figures.as_slice() else { panic!("{:?}", report.figures) };
    assert_eq!(figure.id, "sorting_length");
    let points = |at: usize| {
        let series = &figure.series[at];
        let ours: Vec<_> = series.ours.iter().map(|point| (point.x, point.success_rate)).collect();
        let paper: Vec<_> = series.paper.iter().map(|point| (point.x, point.success_rate)).collect();
        (series.variant.as_str(), ours, paper)
    };
    assert_eq!(points(0), ("ntp", vec![(4, 0.95), (40, 0.9)], vec![(4, 0.9), (40, 0.9)]));
    assert_eq!(points(1), ("flat_paper", vec![(4, 0.1)], vec![(4, 0.4)]));
    assert!(figure.source.contains("over 90 %"));
    let few = rows.concat().into_iter().map(|row| Rollout { train_tasks: 2, ..row });
    let [figure] = <[_; 1]>::try_from(Run::new(&few.collect::<Vec<_>>()).make().figures).unwrap();
    let n_theirs: usize = figure.series.iter().map(|series| series.paper.len()).sum();
    assert_eq!((n_theirs, figure.source.as_str()), (0, "Experiment 1"), "the paper trains on four tasks");
}

#[test]
fn clean_up_becomes_a_grid_of_bowls_and_forks() {
    let rows = [rollouts("ntp", "cleanup_unseen_1_20", 5, 10), rollouts("ntp", "cleanup_unseen_4_5", 10, 10)];
    let run = Run::new(&rows.concat());
    let report = run.make();
    let cells: Vec<_> = report.grids[0].cells.iter().map(|cell| (cell.bowls, cell.forks, cell.success_rate)).collect();
    assert_eq!(cells, [(1, 20, 0.5), (4, 5, 1.0)]);
    assert!(run.text("index.html").contains("--shade: 50%\" title=\"10 rollouts\">50.0</td>"));
}

#[track_caller]
fn check_claim(id: &str, rows: &[Vec<Rollout>], expected: &[(&str, Verdict)]) {
    let report = Run::new(&rows.concat()).make();
    let claims = report.claims.iter().filter(|claim| claim.id == id);
    let found: Vec<_> = claims.map(|claim| (claim.encoder.as_str(), claim.verdict)).collect();
    assert_eq!(found, expected);
}

#[test]
fn an_ordering_counts_when_it_is_beyond_its_interval() {
    let suite = "stacking_unseen";
    let against = |flat: i64| vec![rollouts("ntp", suite, 90, 100), rollouts("flat", suite, flat, 100)];
    check_claim("stacking_flat", &against(10), &[("object-centric", Verdict::Reproduced)]);
    check_claim("stacking_flat", &against(90), &[("object-centric", Verdict::NoDifference)]);
    check_claim("stacking_flat", &against(85), &[("object-centric", Verdict::NoDifference)]);
    check_claim("stacking_flat", &against(100), &[("object-centric", Verdict::NotReproduced)]);
    let paper = [rollouts("ntp_paper", suite, 90, 100), rollouts("flat_paper", suite, 0, 100)];
    check_claim("stacking_flat", &paper, &[("flattened", Verdict::Reproduced)]);
    check_claim("stacking_flat", &[rollouts("ntp", suite, 90, 100)], &[]);
}

#[test]
fn a_claim_over_lengths_is_as_good_as_its_worst_length() {
    let at = |four: i64, forty: i64| {
        vec![rollouts("ntp", "sorting_unseen_4", four, 100), rollouts("ntp", "sorting_unseen_40", forty, 100)]
    };
    check_claim("sorting_long_tasks", &at(100, 90), &[("object-centric", Verdict::Reproduced)]);
    check_claim("sorting_long_tasks", &at(100, 89), &[("object-centric", Verdict::NotReproduced)]);
}

#[test]
fn losses_are_compared_as_differences_of_differences() {
    let with = |ntp: i64, gru: i64| {
        vec![
            rollouts("ntp", "stacking_unseen", 100, 100),
            rollouts("ntp", "stacking_adversary", ntp, 100),
            rollouts("ntp_gru", "stacking_unseen", 100, 100),
            rollouts("ntp_gru", "stacking_adversary", gru, 100),
        ]
    };
    check_claim("adversary_reactive", &with(90, 40), &[("object-centric", Verdict::Reproduced)]);
    check_claim("adversary_reactive", &with(40, 90), &[("object-centric", Verdict::NotReproduced)]);
    check_claim("adversary_reactive", &with(90, 88), &[("object-centric", Verdict::NoDifference)]);
}

#[test]
fn the_page_and_the_markdown_say_what_did_not_reproduce() {
    let rows = [rollouts("ntp", "stacking_unseen", 20, 100), rollouts("flat", "stacking_unseen", 90, 100)];
    let run = Run::new(&rows.concat());
    run.make();
    assert!(run.text("index.html").contains("<span class=\"verdict not_reproduced\">not reproduced</span>"));
    assert!(run.text("report.md").contains("| **not reproduced** "));
}

#[test]
fn each_way_of_seeing_is_judged_by_itself() {
    let suite = "stacking_unseen";
    let rows = [
        rollouts("ntp", suite, 100, 100),
        rollouts("ntp_vid_e2e", suite, 80, 100),
        rollouts("ntp_vid_detector", suite, 79, 100),
        rollouts("ntp_paper", suite, 60, 100),
        rollouts("ntp_vid_e2e_paper", suite, 90, 100),
        rollouts("ntp_vid_detector_paper", suite, 0, 100),
        rollouts("ntp_vid_e2e_general", suite, 100, 100),
    ];
    let (slots, convolutions, general) = ("colour slots", "the paper's convolutions", "general");
    let (reproduced, not, neither) = (Verdict::Reproduced, Verdict::NotReproduced, Verdict::NoDifference);
    check_claim("pictures_state", &rows, &[(slots, reproduced), (convolutions, not), (general, neither)]);
    check_claim("pictures_detector", &rows, &[(slots, neither), (convolutions, reproduced)]);
    // Without its own full state the paper's network is set beside the plain one.
    check_claim("pictures_state", &[rows[0].clone(), rows[4].clone()], &[(convolutions, reproduced)]);
    check_claim("pictures_state", &rows[1..3], &[]);
}

#[test]
fn models_that_see_are_compared_after_as_many_training_tasks() {
    let trained = |tasks: i64, rows: Vec<Rollout>| -> Vec<Rollout> {
        rows.into_iter().map(|row| Rollout { train_tasks: tasks, ..row }).collect()
    };
    let suite = "stacking_unseen";
    let rows = [
        trained(1000, rollouts("ntp", suite, 100, 100)),
        trained(100, rollouts("ntp", suite, 50, 100)),
        trained(100, rollouts("ntp_vid_e2e", suite, 90, 100)),
        trained(20, rollouts("ntp_vid_e2e", suite, 10, 100)),
        trained(20, rollouts("flat", suite, 10, 100)),
        trained(100, rollouts("flat", suite, 10, 100)),
    ];
    check_claim("pictures_state", &rows, &[("colour slots", Verdict::NotReproduced)]);
    check_claim("pictures_more_tasks", &rows, &[("colour slots", Verdict::Reproduced)]);
    let report = Run::new(&rows.concat()).make();
    let variants = |id: &str| -> Vec<String> {
        let figure = report.figures.iter().find(|figure| figure.id == id).unwrap();
        figure.series.iter().map(|series| series.variant.clone()).collect()
    };
    assert_eq!(variants("stacking_pictures"), ["ntp", "ntp_vid_e2e"]);
    assert_eq!(variants("stacking_unseen"), ["ntp", "flat"]);
    let blind = Run::new(&[rows[0].clone(), rows[1].clone()].concat()).make();
    assert!(blind.figures.iter().all(|figure| figure.id != "stacking_pictures") && blind.notes.is_empty());
}

#[test]
fn what_models_that_see_are_given_is_said_of_those_that_are_there() {
    let run = Run::new(&rollouts("ntp_vid_e2e", "stacking_unseen", 20, 100));
    run.make();
    for text in [run.text("index.html"), run.text("report.md")] {
        for said in ["need things that differ in colour", "is told by the simulator"] {
            assert!(text.contains(said), "{said}");
        }
        assert!(!text.contains("VGG16"));
    }
}

#[test]
fn every_table_of_the_page_scrolls_in_a_box_of_its_own() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src/report");
    let mut n_tables = 0;
    for folder in [root.clone(), root.join("section")] {
        let templates = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        for path in templates.filter(|path| path.extension().is_some_and(|extension| extension == "j2")) {
            let text = std::fs::read_to_string(&path).unwrap();
            let lines: Vec<&str> = text.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
            for (at, _) in lines.iter().enumerate().filter(|(_, line)| line.starts_with("<table")) {
                let before = lines[at - 1];
                let boxes =
                    ["<div class=\"card scroll\">", "<div class=\"card scroll next\">", "<div class=\"scrolled\">"];
                assert!(boxes.contains(&before), "{}: {before}", path.display());
                n_tables += 1;
            }
        }
    }
    assert!(n_tables > 12, "{n_tables}");
}
