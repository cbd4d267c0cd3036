//! What the paper claims of NTP from video, for each of our ways of seeing by itself, and what is to be said of each.
//!
//! # Invariants
//!
//! Only models of one experiment and as many training tasks are compared: they saw the same pictures.
//!
//! # Source
//!
//! Paper, experiment 4: on Block Stacking, full state is above end to end, and this above the detector.

use schemars::JsonSchema;
use serde::Serialize;

use crate::report::claims::check::{Check, difference, different};
use crate::report::claims::{Claim, experiment_of};
use crate::report::facts::{Ask, BLOCK_STACKING};
use crate::report::kind::Design;
use crate::report::order;
use crate::report::summary::Aggregate;

/// What is to be said of a variant beside its figures.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Note {
    /// The variant; empty for what holds for all of those in the report that see.
    pub variant: String,
    /// What it is given, and what its figures are no evidence for.
    pub text: String,
}

/// A way of seeing, and the encoders of NTP that differ in nothing else.
struct Eyes {
    /// As [`Claim::encoder`] names it.
    name: &'static str,
    /// From positions.
    state: &'static str,
    end_to_end: &'static str,
    detector: Option<&'static str>,
}

const EYES: [Eyes; 3] = [
    Eyes { name: "colour slots", state: OBJECT_CENTRIC, end_to_end: "colour_slots", detector: Some("detected") },
    Eyes {
        name: "the paper's convolutions",
        state: "flattened",
        end_to_end: "convolved",
        detector: Some("detected_flattened"),
    },
    Eyes { name: "general", state: OBJECT_CENTRIC, end_to_end: "keypoints", detector: None },
];

/// Stands for full state where the paper's own encoder of it is not there.
const OBJECT_CENTRIC: &str = "object_centric";

/// What is to be said of each encoder that sees.
const NOTES: [(&str, &str); 5] = [
    (
        "colour_slots",
        "Colour slots: prototypes of colour before a still background. They need things that differ in colour and a \
         camera that stands still; their figures say nothing of letters, textures or a moving camera.",
    ),
    (
        "convolved",
        "The paper's seven convolutions, from a picture to one vector of 128 features. This is the paper's model.",
    ),
    (
        "keypoints",
        "An encoder of our own without clusters of colour and without a background to subtract, for things told apart \
         by letters and for a camera that moves; what it saw stands among the facts.",
    ),
    (
        "detected",
        "A detector that finds things by their colour and learns from true positions, with all that colour slots need; \
         NTP behind it learns on what it finds. Where the gripper is and whether it is closed, the robot knows of itself; \
         end to end no network is given that.",
    ),
    ("detected_flattened", "A detector of VGG16's shape that learns from true positions, before `ntp_paper`."),
];

/// What holds for all of them.
const COMMON: [&str; 2] = [
    "The model names the object; where that is, `move_to` is told by the simulator, as in the paper end to end. The \
     paper's detector also says where; ours is asked for what programs decide on alone.",
    "The paper has full state above end to end above the detector. Where ours differs, colour is why: unlike the \
     paper's two networks, `ntp_vid_e2e` and `ntp_vid_detector` both find things by their colour, so that what one of \
     them cannot see the other cannot either, and little is left to tell them apart.",
];

/// Every claim that our rollouts can say something about, for each way of seeing, within one experiment.
pub(super) fn claims(experiments: &[Vec<&Aggregate>]) -> Vec<Claim> {
    let rules: [fn(&Rows<'_>, &Eyes) -> Option<Claim>; 3] = [state, detector, more_tasks];
    let judge = |rule: fn(&Rows<'_>, &Eyes) -> Option<Claim>| {
        let of_experiment =
            |rows: &Vec<&Aggregate>| EYES.iter().filter_map(|eyes| rule(&Rows(rows), eyes)).collect::<Vec<_>>();
        experiments.iter().flat_map(of_experiment).collect::<Vec<_>>()
    };
    rules.into_iter().flat_map(judge).collect()
}

fn state(rows: &Rows<'_>, eyes: &Eyes) -> Option<Claim> {
    let state = if rows.of(eyes.state).is_empty() { OBJECT_CENTRIC } else { eyes.state };
    let claim = "NTP stacks better from full state than end to end from video";
    rows.above("pictures_state", claim, eyes, (state, eyes.end_to_end))
}

fn detector(rows: &Rows<'_>, eyes: &Eyes) -> Option<Claim> {
    let claim = "From video, NTP stacks better end to end than behind a detector";
    rows.above("pictures_detector", claim, eyes, (eyes.end_to_end, eyes.detector?))
}

fn more_tasks(rows: &Rows<'_>, eyes: &Eyes) -> Option<Claim> {
    let own = rows.of(eyes.end_to_end);
    let claim = "More training tasks help NTP from video with unseen ones";
    rows.told("pictures_more_tasks", claim, eyes, Check::Above(vec![different(own.first()?, own.last()?)?]))
}

/// What is to be said of the variants that see, of those that are there.
pub(in crate::report) fn notes(aggregates: &[Aggregate]) -> Vec<Note> {
    let note = |variant: &str, text: &str| Note { variant: variant.to_owned(), text: text.to_owned() };
    let reads = |encoder: &str| aggregates.iter().find(|row| row.actor.parts.reads_by(encoder));
    let own = NOTES.iter().filter_map(|(encoder, text)| Some(note(&reads(encoder)?.actor.variant, text)));
    let mut notes: Vec<Note> = own.collect();
    if !notes.is_empty() {
        notes.extend(COMMON.map(|text| note("", text)));
    }
    notes
}

/// Rows of the models of one experiment.
struct Rows<'a>(&'a [&'a Aggregate]);

impl<'a> Rows<'a> {
    /// NTP's rows in unseen tasks by an encoder, the most training tasks first.
    fn of(&self, encoder: &str) -> Vec<&'a Aggregate> {
        let is_own = |row: &&&Aggregate| {
            row.actor.parts.is(Design::NTP)
                && row.actor.parts.reads_by(encoder)
                && row.facts.asks(BLOCK_STACKING, Ask::Unseen)
        };
        let mut own: Vec<&Aggregate> = self.0.iter().filter(is_own).copied().collect();
        own.sort_by_cached_key(|row| (std::cmp::Reverse(row.actor.train_tasks), order::actor(&row.actor)));
        own
    }

    /// One encoder above another, after the most training tasks that both have.
    fn above(&self, id: &str, claim: &str, eyes: &Eyes, (upper, lower): (&str, &str)) -> Option<Claim> {
        let lower = self.of(lower);
        let pair = self
            .of(upper)
            .into_iter()
            .find_map(|row| Some((row, *lower.iter().find(|other| other.actor.train_tasks == row.actor.train_tasks)?)));
        let (upper, lower) = pair?;
        self.told(id, claim, eyes, Check::Above(vec![difference(upper, lower)]))
    }

    fn told(&self, id: &str, claim: &str, eyes: &Eyes, check: Check<'_>) -> Option<Claim> {
        let (verdict, ours) = check.judge()?;
        let (id, claim, encoder) = (id.to_owned(), claim.to_owned(), eyes.name.to_owned());
        Some(Claim { id, claim, experiment: experiment_of(self.0), encoder, verdict, ours })
    }
}
