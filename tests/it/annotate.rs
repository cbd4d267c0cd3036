//! Demonstrations are taken apart by a policy alone, and what comes of it is a dataset like those of the expert.

use std::path::Path;

use ntp::annotate::{AnnotateConfig, Annotation, KeyFrames, Model, annotate, measure, parse};
use ntp::artifact::read_json;
use ntp::dataset::edit::{Carry, Condition, diff, filter, merge};
use ntp::dataset::export::{LabelForm, export};
use ntp::dataset::import::import;
use ntp::dataset::{ConvertConfig, FrameChoice, read_trials, schema, validate};
use ntp::program::Program;
use ntp::publish::publish;
use ntp::rollout::{Decision, Policy, PolicyError, Query, Specification};
use ntp::scene::SlotIndex;
use ntp::store::Folder;
use ntp::table;
use ntp::task::Family;
use ntp::trace::{Episode, ObservationRows, Prediction, ProgramCall, Span};
use serde_json::Value;

use crate::dataset::{convert_all, densify, episodes, sorting_episodes};
use crate::publish::publication;

/// Decides as the expert did, told by its episodes; what a trained model would find out by itself.
struct Knowing {
    trees: Vec<Vec<ProgramCall>>,
    /// Of each episode: how many calls it has made.
    made: Vec<usize>,
    /// How sure it says that it is.
    probability: f32,
    /// What it takes every slot for another of.
    mistakes: fn(SlotIndex) -> SlotIndex,
}

impl Knowing {
    fn new(episodes: &[Episode]) -> Self {
        let trees: Vec<_> = episodes.iter().map(|episode| episode.clone().boundaries_only().calls.clone()).collect();
        Self { made: vec![1; trees.len()], trees, probability: 0.99, mistakes: |slot| slot }
    }

    fn boxed(self, family: Family, n_slots: usize) -> Model {
        Model::new("knowing".to_owned(), family, n_slots, None, Box::new(self))
    }

    /// The first sub-task that is like one: what a root that looks for "the next can" finds.
    fn first_alike<'t>(calls: &'t [ProgramCall], call: &'t ProgramCall) -> &'t ProgramCall {
        let about = |call: &ProgramCall| -> Vec<SlotIndex> {
            let below = calls[call.id.0 as usize + 1..].iter().take_while(|other| other.depth > call.depth);
            below.filter_map(|call| call.argument).collect()
        };
        let alike = |other: &&ProgramCall| other.depth == call.depth && about(other) == about(call);
        calls.iter().find(alike).unwrap_or(call)
    }

    fn decide_one(&mut self, query: &Query) -> Decision {
        let calls = &self.trees[query.episode];
        let Some(call) = calls.get(self.made[query.episode]) else { return Decision::end(query) };
        let shown = call.output.filter(|_| call.program.is_composite());
        let scope = match shown {
            Some(_) if query.depth == 0 => Self::first_alike(calls, call).frames,
            Some(scope) => scope,
            None => query.window,
        };
        self.made[query.episode] += 1;
        Decision {
            program: call.program,
            scope,
            argument: call.argument.map(self.mistakes),
            argument_probability: self.probability,
            end_of_program: call.end_of_program,
            prediction: Some(Prediction {
                program_probability: 1.0,
                end_probability: f32::from(u8::from(call.end_of_program)),
                start_probabilities: Vec::new(),
                stop_probabilities: Vec::new(),
            }),
        }
    }
}

impl Policy for Knowing {
    fn name(&self) -> &str {
        "knowing"
    }

    fn decide(&mut self, queries: &[Query]) -> Result<Vec<Decision>, PolicyError> {
        Ok(queries.iter().map(|query| self.decide_one(query)).collect())
    }
}

fn config() -> AnnotateConfig {
    AnnotateConfig { doubt_below: 0.5, key_frames: KeyFrames::Auto, date: None }
}

/// The dataset of episodes, what `Knowing` makes of it, and what is told.
fn annotated(episodes: &[Episode], folder: &Path, knowing: Knowing) -> Annotation {
    let (own, to) = (folder.join("own"), folder.join("new"));
    convert_all(episodes, &ConvertConfig::default(), &own).unwrap();
    let n_slots = episodes[0].scene.slots.len();
    let mut models = [knowing.boxed(episodes[0].provenance.family, n_slots)];
    annotate(&own, &mut models, &to, &config(), Some(&own)).unwrap()
}

fn observed(episode: &Episode) -> ObservationRows {
    let n_slots = episode.scene.slots.len();
    let observations: Vec<_> = episode.boundary_frames().map(|(_, frame)| frame.observation()).collect();
    ObservationRows::of(n_slots, &observations)
}

#[test]
fn a_demonstration_is_taken_apart_into_the_calls_that_made_it() {
    let episodes = episodes();
    let rows: Vec<ObservationRows> = episodes.iter().map(observed).collect();
    let parsed = parse(&mut Knowing::new(&episodes), Program::BlockStacking, &rows).unwrap();
    for (parsed, episode) in parsed.iter().zip(&episodes) {
        assert_eq!((&parsed.calls, &parsed.doubts[..]), (&episode.calls, &[][..]));
        // move_to has an argument, of .99; the root is as sure as the least sure of its calls.
        assert_eq!(parsed.confidences[0], 0.99);
    }
}

#[test]
fn several_things_of_one_kind_are_each_found_where_they_are() {
    let episodes = sorting_episodes();
    let rows: Vec<ObservationRows> = episodes.iter().map(observed).collect();
    let parsed = parse(&mut Knowing::new(&episodes), Program::ObjectSorting, &rows).unwrap();
    for (parsed, episode) in parsed.iter().zip(&episodes) {
        assert_eq!((&parsed.calls, &parsed.doubts[..]), (&episode.calls, &[][..]));
    }
}

#[test]
fn an_annotated_dataset_is_one_of_ours_with_a_confidence_for_each_call() {
    let folder = tempfile::tempdir().unwrap();
    let episodes = episodes();
    let annotation = annotated(&episodes, folder.path(), Knowing::new(&episodes));
    let (own, to) = (folder.path().join("own"), folder.path().join("new"));
    assert_eq!(validate(&to).findings, []);
    assert_eq!(annotation.doubtful, []);
    let measured = annotation.measured.unwrap();
    assert_eq!((measured.episodes, measured.episodes_exact), (6, 6));
    assert_eq!((measured.calls_with_span, measured.calls_with_argument), (measured.calls, measured.calls));
    for level in measured.levels.values() {
        assert_eq!((level.frame_accuracy, level.iou, level.edit_score), (1.0, 1.0, 1.0));
        assert!(level.boundary_f1.values().all(|f1| *f1 == 1.0));
    }
    // What a learner reads of it is what it reads of the expert's dataset.
    let learner = |root: &Path| read_trials(root).unwrap().trials;
    assert_eq!(learner(&to), learner(&own));
    let calls = to.join("ntp/calls/chunk-000/file-000.parquet");
    let columns = table::file_columns(&calls).unwrap();
    assert!(columns.iter().any(|(name, _)| name == "confidence"));
    let told: Value = read_json(&to.join("ntp/annotation.json")).unwrap();
    assert_eq!((&told["models"][0]["name"], &told["models"][0]["episodes"]), (&"knowing".into(), &6.into()));
    assert_eq!(told["measured"]["episodes_exact"], 6);
    let info: Value = read_json(&to.join("meta/info.json")).unwrap();
    assert_eq!(info["features"]["language_persistent"]["dtype"], "language");
}

#[test]
fn an_annotated_dataset_is_edited_with_its_labels_its_words_and_what_is_told_of_them() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let episodes = episodes();
    // Unsure of everything, so that each episode is listed.
    annotated(&episodes, folder.path(), Knowing { probability: 0.1, ..Knowing::new(&episodes) });
    let told = |name: &str| read_json::<Value>(&path(name).join("ntp/annotation.json")).unwrap();
    let doubtful = |name: &str| -> Vec<u64> {
        told(name)["doubtful"].as_array().unwrap().iter().map(|doubt| doubt["episode"].as_u64().unwrap()).collect()
    };
    assert_eq!(doubtful("new"), [0, 1, 2, 3, 4, 5]);
    let some = |numbers: &[&str]| Condition {
        episodes: numbers.iter().map(|numbers| numbers.parse().unwrap()).collect(),
        ..Condition::default()
    };
    filter(&path("new"), &some(&["1", "4-5"]), &path("some"), Carry::Packets).unwrap();
    assert_eq!(validate(&path("some")).findings, []);
    assert_eq!(doubtful("some"), [0, 1, 2]);
    let of_model = told("some")["models"][0].clone();
    assert_eq!((of_model["episodes"].as_u64(), told("some")["episodes"].as_u64()), (Some(3), Some(3)));
    assert_eq!(told("some")["measured"]["episodes"], 6, "as it was measured");
    filter(&path("new"), &some(&["0", "2-3"]), &path("others"), Carry::Packets).unwrap();
    merge(&[path("some"), path("others")], &path("all"), Carry::Packets).unwrap();
    assert_eq!(validate(&path("all")).findings, []);
    assert_eq!(doubtful("all"), [0, 1, 2, 3, 4, 5]);
    assert_eq!(told("all")["models"].as_array().unwrap().len(), 1);
    assert_eq!((told("all")["models"][0]["episodes"].as_u64(), told("all").get("measured")), (Some(6), None));
    // Calls, frames and language columns are those of before, in another order.
    let difference = diff(&path("new"), &path("all")).unwrap();
    assert!(difference.is_none() && difference.same == 6 && difference.moved == 6, "{difference:?}");
    let info: Value = read_json(&path("all").join("meta/info.json")).unwrap();
    assert_eq!(info["features"]["language_events"]["dtype"], "language");
    // What tells of the labels and is not as it was written is refused by its name, and nothing is made.
    for damaged in [r#"{"models": ["ntp"]}"#, r#"{"models": [], "doubtful": [{"episode": "one"}]}"#, "[]", "{"] {
        std::fs::remove_file(path("some").join("manifest.json")).ok();
        std::fs::write(path("some").join("ntp/annotation.json"), damaged).unwrap();
        let error = merge(&[path("some"), path("others")], &path("refused"), Carry::Packets).unwrap_err().to_string();
        assert!(error.contains("some/ntp/annotation.json") && !path("refused").exists(), "{damaged}: {error}");
    }
}

#[test]
fn an_annotated_dataset_is_held_against_the_rules_of_lerobot_and_what_is_told_of_its_labels() {
    let folder = tempfile::tempdir().unwrap();
    let episodes = episodes();
    annotated(&episodes, folder.path(), Knowing::new(&episodes));
    let (new, statistics) = (folder.path().join("new"), "meta/stats.json");
    let told = |name: &str| new.join("ntp").join(name);
    let codes_with = |path: &Path, content: &str| {
        let before = std::fs::read(path).unwrap();
        std::fs::write(path, content).unwrap();
        let found = validate(&new).findings;
        std::fs::write(path, before).unwrap();
        found.into_iter().map(|finding| (finding.code, finding.message)).collect::<Vec<_>>()
    };
    let check = |path: &Path, content: &str, code: &str, words: &str| {
        let found = codes_with(path, content);
        assert!(found.iter().any(|(found, message)| *found == code && message.contains(words)), "{content}: {found:?}");
    };
    let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:0123\nsize 9\n";
    check(&new.join(statistics), "{", "file.unreadable", "");
    check(&new.join(statistics), pointer, "file.pointer", "");
    let annotation = told("annotation.json");
    check(&annotation, "{", "file.unreadable", "");
    check(&annotation, pointer, "file.pointer", "");
    check(&annotation, r#"{"models": []}"#, "annotation.value", "models");
    let models = r#""models": [{"name": "ntp", "variant": "ntp", "episodes": 6}]"#;
    let doubt = format!(r#"{{{models}, "doubtful": [{{"episode": 6}}]}}"#);
    check(&annotation, &doubt, "annotation.value", "no episode 6; there are 6");
    let measured = format!(r#"{{{models}, "measured": {{"calls": 3, "calls_with_span": 4}}}}"#);
    check(&annotation, &measured, "annotation.value", "calls_with_span is 4 and calls 3");
    assert_eq!(validate(&new).findings, []);
}

#[test]
fn labels_are_written_in_one_form_once_and_compared_with_those_of_the_same_recordings() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let episodes = episodes();
    annotated(&episodes, folder.path(), Knowing::new(&episodes));
    export(&path("new"), LabelForm::Language, &path("again")).unwrap();
    assert_eq!(validate(&path("again")).findings, []);
    let columns = table::file_columns(&path("again").join("data/chunk-000/file-000.parquet")).unwrap();
    for name in ["language_persistent", "language_events"] {
        assert_eq!(columns.iter().filter(|(column, _)| column.starts_with(name)).count(), 1, "{columns:?}");
    }
    // The same episodes in another order, as many frames each.
    let order = |first: &str, then: &str| {
        let one = |number: &str, to: &str| {
            let condition = Condition { episodes: vec![number.parse().unwrap()], ..Condition::default() };
            filter(&path("new"), &condition, &path(to), Carry::Packets).unwrap();
        };
        one(first, "first");
        one(then, "then");
        merge(&[path("first"), path("then")], &path("turned"), Carry::Packets).unwrap();
    };
    order("1", "0");
    let condition = Condition { episodes: vec!["0-1".parse().unwrap()], ..Condition::default() };
    filter(&path("new"), &condition, &path("straight"), Carry::Packets).unwrap();
    let error = measure(&path("straight"), &path("turned")).unwrap_err().to_string();
    assert!(error.contains("episode 0 is of another recording"), "{error}");
    assert_eq!(measure(&path("straight"), &path("straight")).unwrap().episodes_exact, 2);
    // What is copied as it is is looked at before.
    std::fs::write(path("own").join("meta/tasks.parquet"), "PAR1").unwrap();
    let mut models = [Knowing::new(&episodes).boxed(Family::BlockStacking, 8)];
    let error = annotate(&path("own"), &mut models, &path("no"), &config(), None).unwrap_err().to_string();
    assert!(error.contains("meta/tasks.parquet") && !path("no").exists(), "{error}");
}

/// Written in the forms of others, published, brought in again: whose labels they are is told all along.
#[test]
fn labels_of_a_model_are_called_so_in_every_form_and_when_they_come_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let episodes = episodes();
    annotated(&episodes, folder.path(), Knowing::new(&episodes));
    let told = |name: &str| std::fs::read(path(name).join("ntp/annotation.json")).unwrap();
    let said_of = |name: &str| {
        let to = path(&format!("{name}_published"));
        publish(&path(name), &Folder::new(&to), &publication(), || true).unwrap();
        std::fs::read_to_string(to.join("README.md")).unwrap()
    };
    let said = "These labels are predictions: the model `knowing` (variant";
    let forms = [("index", LabelForm::SubtaskIndex), ("words", LabelForm::Language), ("sarm", LabelForm::Sarm)];
    for (name, form) in forms {
        export(&path("new"), form, &path(name)).unwrap();
        assert_eq!(validate(&path(name)).findings, [], "{name}");
        assert_eq!(told(name), told("new"), "{name}");
        let back = format!("{name}_back");
        import(&path(name), None, &path(&back)).unwrap();
        assert_eq!(validate(&path(&back)).findings, [], "{back}");
        for made in [name, &back] {
            let card = said_of(made);
            assert!(card.contains(said) && card.contains("- machine-generated"), "{made}: {card}");
            assert!(!card.contains("do not tell who annotated"), "{made}: {card}");
            assert!(card.contains("Measured against the labels of `own` (6 episodes): 100.0 %"), "{made}: {card}");
        }
    }
    export(&path("new"), LabelForm::Behavior, &path("behavior")).unwrap();
    assert_eq!(told("behavior"), told("new"));
    let condition = Condition { episodes: vec!["0-1".parse().unwrap()], ..Condition::default() };
    filter(&path("words"), &condition, &path("part"), Carry::Packets).unwrap();
    assert_eq!(validate(&path("part")).findings, []);
    let card = said_of("part");
    assert!(card.contains("(6 episodes, of which a part is here): 100.0 %"), "{card}");
    assert!(!card.contains("not described"), "{card}");
    let card = said_of("new");
    assert!(card.contains("how sure the model is of the call"), "{card}");
    // Beside episodes that nobody is known to have annotated.
    filter(&path("words"), &condition, &path("others"), Carry::Packets).unwrap();
    std::fs::remove_file(path("others").join("manifest.json")).unwrap();
    std::fs::remove_file(path("others").join("ntp/annotation.json")).unwrap();
    merge(&[path("part"), path("others")], &path("both"), Carry::Packets).unwrap();
    let card = said_of("both");
    assert!(card.contains("Of 2 other episodes, the files do not tell who annotated them."), "{card}");
    assert!(card.contains("Their accuracy was not measured."), "{card}");
    // Of the others alone nothing is told of models, and of labels that a model made none are measured against.
    let condition = Condition { episodes: vec!["2-3".parse().unwrap()], ..Condition::default() };
    filter(&path("both"), &condition, &path("only_others"), Carry::Packets).unwrap();
    assert!(!path("only_others").join("ntp").exists());
    let mut models = [Knowing::new(&episodes).boxed(Family::BlockStacking, 8)];
    let against = annotate(&path("own"), &mut models, &path("no"), &config(), Some(&path("new"))).unwrap_err();
    assert!(against.to_string().contains("predictions of the model `knowing`") && !path("no").exists(), "{against}");
    // What is told must be true of what is there, also without tables of programs.
    std::fs::write(path("part").join("ntp/annotation.json"), r#"{"models": []}"#).unwrap();
    assert!(validate(&path("part")).findings.iter().any(|finding| finding.code == "annotation.value"));
}

#[test]
fn a_dataset_without_a_word_of_ours_is_annotated_too() {
    let folder = tempfile::tempdir().unwrap();
    let (own, theirs, to) = ["own", "theirs", "new"].map(|name| folder.path().join(name)).into();
    let episodes = episodes();
    convert_all(&episodes, &ConvertConfig::default(), &own).unwrap();
    export(&own, LabelForm::SubtaskIndex, &theirs).unwrap();
    assert!(!theirs.join("ntp").exists());
    let mut models = [Knowing::new(&episodes).boxed(Family::BlockStacking, 8)];
    let config = AnnotateConfig { key_frames: KeyFrames::Rows, ..config() };
    let annotation = annotate(&theirs, &mut models, &to, &config, Some(&own)).unwrap();
    assert_eq!(validate(&to).findings, []);
    assert_eq!(annotation.measured.unwrap().episodes_exact, 6);
    let mut rows = table::read(&to.join("ntp/episodes.parquet"), &schema::EPISODES).unwrap();
    assert_eq!(rows.text("actor").unwrap(), ["demonstrator"; 6]);
    assert_eq!(rows.int64("trial").unwrap(), [0, 1, 0, 1, 0, 1]);
}

#[test]
fn what_is_wrong_is_measured_and_what_cannot_be_is_listed_for_a_person() {
    let folder = tempfile::tempdir().unwrap();
    let episodes = episodes();
    let mistaken = Knowing { mistakes: |slot| SlotIndex((slot.0 + 1) % 8), ..Knowing::new(&episodes) };
    let annotation = annotated(&episodes, folder.path(), mistaken);
    let measured = annotation.measured.unwrap();
    assert_eq!((measured.episodes_exact, measured.calls_with_span), (0, measured.calls));
    // The roots, and calls without a slot: of each sub-task grip and release, and the end.
    let n_subtasks: u64 = episodes.iter().flat_map(|of| &of.calls).filter(|call| call.depth == 1).count() as u64 - 6;
    assert_eq!(measured.calls_with_argument, 6 + 6 + 2 * n_subtasks);
    assert_eq!(annotation.doubtful.len(), 6);
    let first = annotation.doubtful[0].doubts[0].to_string();
    assert!(first.starts_with("the gripper is ") && first.ends_with(" cm beside what call 3 moves to"), "{first}");
}

#[test]
fn a_policy_that_is_not_sure_makes_its_episodes_doubtful() {
    let folder = tempfile::tempdir().unwrap();
    let episodes = episodes();
    let unsure = Knowing { probability: 0.25, ..Knowing::new(&episodes) };
    let annotation = annotated(&episodes, folder.path(), unsure);
    assert_eq!(annotation.doubtful.len(), 6);
    assert_eq!(annotation.doubtful[0].confidence, 0.25);
    assert_eq!(annotation.doubtful[0].doubts[0].to_string(), "call 1 (pick_and_place) has confidence 0.25");
}

/// Answers every question with one program.
struct Stubborn(Program);

impl Policy for Stubborn {
    fn name(&self) -> &str {
        "stubborn"
    }

    fn decide(&mut self, queries: &[Query]) -> Result<Vec<Decision>, PolicyError> {
        let program = self.0;
        let decision = |query: &Query| Decision {
            program,
            scope: Span { begin: query.window.begin, end: query.window.begin + 1 },
            argument: program.takes_argument().then_some(SlotIndex(0)),
            end_of_program: program == Program::None,
            ..Decision::end(query)
        };
        Ok(queries.iter().map(decision).collect())
    }
}

#[test]
fn whatever_a_policy_says_a_lawful_tree_comes_of_it_and_a_doubt() {
    let episodes = episodes();
    for program in Program::ALL {
        let folder = tempfile::tempdir().unwrap();
        let (own, to) = (folder.path().join("own"), folder.path().join("new"));
        convert_all(&episodes, &ConvertConfig::default(), &own).unwrap();
        let policy = Box::new(Stubborn(program));
        let mut models = [Model::new("stubborn".to_owned(), Family::BlockStacking, 8, None, policy)];
        let annotation = annotate(&own, &mut models, &to, &config(), None).unwrap();
        assert_eq!(validate(&to).findings, [], "{program}");
        assert_eq!(annotation.doubtful.len(), 6, "{program}");
    }
}

#[test]
fn two_models_that_disagree_make_an_episode_doubtful() {
    let folder = tempfile::tempdir().unwrap();
    let (own, to) = (folder.path().join("own"), folder.path().join("new"));
    let episodes = episodes();
    convert_all(&episodes, &ConvertConfig::default(), &own).unwrap();
    let stubborn = Box::new(Stubborn(Program::Grip));
    let mut models = [
        Model::new("stubborn".to_owned(), Family::BlockStacking, 8, None, stubborn),
        Knowing::new(&episodes).boxed(Family::BlockStacking, 8),
    ];
    let annotation = annotate(&own, &mut models, &to, &config(), Some(&own)).unwrap();
    assert_eq!(annotation.measured.unwrap().episodes_exact, 6);
    assert_eq!(annotation.models.iter().map(|model| model.episodes).collect::<Vec<_>>(), [0, 6]);
    assert_eq!(annotation.doubtful[0].doubts[0].to_string(), "model stubborn says something else");
}

#[test]
fn a_dataset_of_other_slots_is_refused_with_what_the_models_know() {
    let folder = tempfile::tempdir().unwrap();
    let (own, to) = (folder.path().join("own"), folder.path().join("new"));
    let episodes = episodes();
    convert_all(&episodes, &ConvertConfig::default(), &own).unwrap();
    let mut models = [Knowing::new(&episodes).boxed(Family::TableCleanup, 6)];
    let error = annotate(&own, &mut models, &to, &config(), None).unwrap_err().to_string();
    let wanted = "its observations have 8 slots (block_A, block_B, block_C, block_D, block_E, block_F, block_G, \
                  block_H), but model knowing knows 6";
    assert!(error.ends_with(wanted), "{error}");
    assert!(!to.exists());
}

#[test]
fn labels_of_other_episodes_are_not_compared() {
    let folder = tempfile::tempdir().unwrap();
    let (own, other) = (folder.path().join("own"), folder.path().join("other"));
    let episodes = episodes();
    convert_all(&episodes, &ConvertConfig::default(), &own).unwrap();
    convert_all(&episodes[1..], &ConvertConfig::default(), &other).unwrap();
    let error = measure(&own, &other).unwrap_err().to_string();
    assert!(error.ends_with("episode 0 is of another recording than there; they are compared in order"), "{error}");
}

#[test]
fn boundaries_of_a_dense_dataset_are_not_read_when_it_is_annotated() {
    let folder = tempfile::tempdir().unwrap();
    let (own, to) = (folder.path().join("own"), folder.path().join("new"));
    let dense: Vec<Episode> = episodes().iter().map(|episode| densify(episode, 3)).collect();
    convert_all(&dense, &ConvertConfig { frames: FrameChoice::All, ..ConvertConfig::default() }, &own).unwrap();
    let mut models = [Knowing::new(&dense).boxed(Family::BlockStacking, 8)];
    let annotation = annotate(&own, &mut models, &to, &config(), Some(&own)).unwrap();
    assert_eq!(annotation.key_frames, "found");
    assert_eq!(validate(&to).findings, []);
    let _specification = Specification::observed(observed(&dense[0]));
}
