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

use crate::report::claims::{Check, Claim, difference, different};
use crate::report::order;
use crate::report::summary::Aggregate;

/// Before the names of all variants that see.
pub(in crate::report) const SIGHTED: &str = "ntp_vid_";

/// What is to be said of a variant beside its figures.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Note {
    /// The variant; empty for what holds for all of those in the report that see.
    pub variant: String,
    /// What it is given, and what its figures are no evidence for.
    pub text: String,
}

/// A way of seeing, and the variants that differ in nothing else.
struct Eyes {
    /// As [`Claim::encoder`] names it.
    name: &'static str,
    /// From positions.
    state: &'static str,
    end_to_end: &'static str,
    detector: Option<&'static str>,
}

const EYES: [Eyes; 3] = [
    Eyes { name: "colour slots", state: "ntp", end_to_end: "ntp_vid_e2e", detector: Some("ntp_vid_detector") },
    Eyes {
        name: "the paper's convolutions",
        state: "ntp_paper",
        end_to_end: "ntp_vid_e2e_paper",
        detector: Some("ntp_vid_detector_paper"),
    },
    Eyes { name: "general", state: "ntp", end_to_end: "ntp_vid_e2e_general", detector: None },
];

/// The suite that the paper tells of.
const SUITE: &str = "stacking_unseen";

const NOTES: [(&str, &str); 5] = [
    (
        "ntp_vid_e2e",
        "Colour slots: prototypes of colour before a still background. They need things that differ in colour and a \
         camera that stands still; their figures say nothing of letters, textures or a moving camera.",
    ),
    (
        "ntp_vid_e2e_paper",
        "The paper's seven convolutions, from a picture to one vector of 128 features. This is the paper's model.",
    ),
    (
        "ntp_vid_e2e_general",
        "An encoder of our own without clusters of colour and without a background to subtract, for things told apart \
         by letters and for a camera that moves; what it saw stands among the facts.",
    ),
    (
        "ntp_vid_detector",
        "A detector that finds things by their colour and learns from true positions, with all that colour slots need; \
         NTP behind it learns on what it finds. Where the gripper is and whether it is closed, the robot knows of itself; \
         end to end no network is given that.",
    ),
    ("ntp_vid_detector_paper", "A detector of VGG16's shape that learns from true positions, before `ntp_paper`."),
];

/// What holds for all of them.
const COMMON: [&str; 2] = [
    "The model names the object; where that is, `move_to` is told by the simulator, as in the paper end to end. The \
     paper's detector also says where; ours is asked for what programs decide on alone.",
    "The paper has full state above end to end above the detector. Where ours differs, colour is why: unlike the \
     paper's two networks, `ntp_vid_e2e` and `ntp_vid_detector` both find things by their colour, so that what one of \
     them cannot see the other cannot either, and little is left to tell them apart.",
];

/// Every claim that our rollouts can say something about, for each way of seeing.
pub(super) fn claims(aggregates: &[Aggregate]) -> Vec<Claim> {
    let rows = Rows(aggregates);
    let state = |eyes: &Eyes| if rows.is_there(eyes.state) { eyes.state } else { "ntp" };
    let above = |id: &str, claim: &str, pair: &dyn Fn(&Eyes) -> Option<(&'static str, &'static str)>| {
        let judged = EYES.iter().filter_map(|eyes| {
            let (upper, lower) = pair(eyes)?;
            let (upper, lower) = rows.pair(upper, lower)?;
            told(id, claim, eyes, Check::Above(vec![difference(upper, lower)]))
        });
        judged.collect::<Vec<_>>()
    };
    let mut claims = above("pictures_state", "NTP stacks better from full state than end to end from video", &|eyes| {
        Some((state(eyes), eyes.end_to_end))
    });
    claims.extend(above(
        "pictures_detector",
        "From video, NTP stacks better end to end than behind a detector",
        &|eyes| Some((eyes.end_to_end, eyes.detector?)),
    ));
    claims.extend(EYES.iter().filter_map(|eyes| {
        let (most, fewest) = rows.most_and_fewest_tasks(eyes.end_to_end)?;
        let claim = "More training tasks help NTP from video with unseen ones";
        told("pictures_more_tasks", claim, eyes, Check::Above(vec![different(most, fewest)?]))
    }));
    claims
}

/// What is to be said of the variants that see, of those that are there.
pub(in crate::report) fn notes(aggregates: &[Aggregate]) -> Vec<Note> {
    let note = |variant: &str, text: &str| Note { variant: variant.to_owned(), text: text.to_owned() };
    let own = NOTES.iter().filter(|(variant, _)| Rows(aggregates).is_there(variant));
    let mut notes: Vec<Note> = own.map(|(variant, text)| note(variant, text)).collect();
    if !notes.is_empty() {
        notes.extend(COMMON.map(|text| note("", text)));
    }
    notes
}

fn told(id: &str, claim: &str, eyes: &Eyes, check: Check<'_>) -> Option<Claim> {
    let (verdict, ours) = check.judge()?;
    let (id, claim, encoder) = (id.to_owned(), claim.to_owned(), eyes.name.to_owned());
    Some(Claim { id, claim, encoder, verdict, ours })
}

/// Rows of all actors.
struct Rows<'a>(&'a [Aggregate]);

impl<'a> Rows<'a> {
    fn is_there(&self, variant: &str) -> bool {
        self.0.iter().any(|row| row.actor.variant == variant)
    }

    /// A variant's rows in the suite, the most training tasks first.
    fn of(&self, variant: &str) -> Vec<&'a Aggregate> {
        let own = |row: &&Aggregate| row.actor.variant == variant && row.suite == SUITE && row.actor.is_demonstrated();
        let mut own: Vec<&Aggregate> = self.0.iter().filter(own).collect();
        own.sort_by_cached_key(|row| (std::cmp::Reverse(row.actor.train_tasks), order::actor(&row.actor)));
        own
    }

    /// Rows of two variants that may be compared, of the most training tasks.
    fn pair(&self, upper: &str, lower: &str) -> Option<(&'a Aggregate, &'a Aggregate)> {
        let lower = self.of(lower);
        self.of(upper).into_iter().find_map(|row| {
            let same = |other: &&&Aggregate| {
                (&other.actor.experiment, other.actor.train_tasks) == (&row.actor.experiment, row.actor.train_tasks)
            };
            Some((row, *lower.iter().find(same)?))
        })
    }

    fn most_and_fewest_tasks(&self, variant: &str) -> Option<(&'a Aggregate, &'a Aggregate)> {
        let rows = self.of(variant);
        let most = *rows.first()?;
        let fewest = rows.into_iter().rfind(|row| row.actor.experiment == most.actor.experiment)?;
        Some((most, fewest))
    }
}
