//! What may be said of a dataset by where it is from. Nothing is claimed of others' data that their files do not tell.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::artifact::{IoError, read_json};
use crate::dataset::{BY_MODEL, DatasetSummary};
use crate::publish::modelled::Modelled;
use crate::words::counted;

/// Where episodes and labels are from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(super) enum Origin {
    /// A program acted in the simulation, and its calls are the labels.
    Simulated,
    /// A dataset of others was brought in; the labels are what it had annotated.
    Annotated {
        /// By which column.
        column: String,
        /// The models that the column is from, where its files tell of them.
        models: Option<Modelled>,
    },
    /// A trained model took demonstrations apart.
    Modelled(Modelled),
    /// A dataset as it is, without program tables.
    Foreign {
        /// Forms of labels that it has.
        labels: Vec<&'static str>,
        /// The models that made them, where its files tell of them.
        models: Option<Modelled>,
    },
}

/// The part of `ntp/info.json` that tells.
#[derive(Deserialize)]
struct Told {
    #[serde(default)]
    annotated_by: Option<String>,
}

impl Origin {
    /// That of a dataset.
    pub(super) fn of(dataset: &Path, summary: &DatasetSummary) -> Result<Self, IoError> {
        let models = Modelled::of(dataset, summary.total_episodes)?;
        if let Some(declared) = &summary.declared {
            return Ok(Self::Foreign { labels: declared.labels.clone(), models });
        }
        let told: Told = read_json(&dataset.join("ntp/info.json"))?;
        Ok(match (told.annotated_by, models) {
            (None, _) => Self::Simulated,
            (Some(by), Some(models)) if by == BY_MODEL => Self::Modelled(models),
            (Some(column), models) => Self::Annotated { column, models },
        })
    }

    pub(super) fn tags(&self) -> &'static [&'static str] {
        match self {
            Self::Simulated => {
                &["LeRobot", "robotics", "neural-task-programming", "hierarchical", "imitation-learning", "synthetic"]
            }
            Self::Annotated { .. } => &["LeRobot", "robotics", "hierarchical", "imitation-learning"],
            Self::Modelled(_) => {
                &["LeRobot", "robotics", "neural-task-programming", "hierarchical", "imitation-learning"]
            }
            Self::Foreign { .. } => &["LeRobot", "robotics", "imitation-learning"],
        }
    }

    /// The hub's word for who made the labels.
    pub(super) fn annotations_creators(&self) -> &'static str {
        match self {
            Self::Simulated
            | Self::Modelled(_)
            | Self::Annotated { models: Some(_), .. }
            | Self::Foreign { models: Some(_), .. } => "machine-generated",
            Self::Annotated { .. } => "found",
            Self::Foreign { labels, .. } if labels.is_empty() => "no-annotation",
            Self::Foreign { .. } => "found",
        }
    }

    /// One sentence or two on what the dataset is.
    pub(super) fn description(&self, summary: &DatasetSummary) -> String {
        let DatasetSummary { total_episodes, total_tasks, .. } = *summary;
        let what = if *self == Self::Simulated { "simulated robot episode" } else { "robot episode" };
        let (episodes, tasks) = (counted(total_episodes, what), counted(total_tasks, "task"));
        match self {
            Self::Simulated => {
                let actors = summary.actors.iter().map(|(actor, episodes)| format!("{episodes} by {actor}"));
                let families = summary.families.iter().map(|family| family.replace('_', " "));
                format!(
                    "{episodes} ({}) of {tasks} of {}, with the hierarchy of \
                     programs that acted them: true labels of every program call, its arguments, and the part of the \
                     demonstration it was given.",
                    actors.collect::<Vec<_>>().join(", "),
                    families.collect::<Vec<_>>().join(", ")
                )
            }
            Self::Annotated { column, .. } => format!(
                "{episodes} of {tasks}, with their annotated sub-tasks as a program tree. The sub-tasks are {} of the dataset \
                 that it was brought in from.",
                form_in_words(column)
            ),
            Self::Modelled(models) => format!(
                "{episodes} of {tasks}, taken apart by the model {} into a \
                 hierarchy of program calls with arguments, spans and confidences.",
                models.names()
            ),
            Self::Foreign { .. } => {
                let robot = summary.declared.as_ref().and_then(|declared| declared.robot_type.as_deref());
                let robot = robot.map_or_else(String::new, |robot| format!(", robot type {robot:?}"));
                let (frames, fps) = (summary.total_frames, summary.fps);
                format!("{episodes} of {tasks}: {frames} at {fps} a second{robot}.", frames = counted(frames, "frame"))
            }
        }
    }

    /// Where the labels are from.
    pub(super) fn labels(&self) -> String {
        match self {
            Self::Simulated => "Every episode comes with the program that made it: which program called which, with what \
                                argument, on which part of the demonstration, and when it ended. None of these labels was \
                                guessed or drawn by hand; they are the calls of the program that acted."
                .to_owned(),
            Self::Annotated { column, models } => {
                let from = match models {
                    Some(models) => models.words(""),
                    None => format!(
                        "These labels are {} as they were found. The files do not tell who annotated them, how, or how exactly.",
                        form_in_words(column)
                    ),
                };
                format!(
                    "Every episode is a call of the root program `task`, and each run of frames of one sub-task is a call \
                     below it. {from}"
                )
            }
            Self::Modelled(models) => models.words(" `calls.confidence` tells how sure each call is."),
            Self::Foreign { labels, .. } if labels.is_empty() => {
                "Beside the tasks in words it has no labels: frames are not told apart by what is being done.".to_owned()
            }
            Self::Foreign { labels, models } => {
                let labels = labels.join(", ");
                match models {
                    Some(models) => format!("It has labels below the task ({labels}). {}", models.words("")),
                    None => format!(
                        "It has labels below the task ({labels}), as they were found. The files do not tell who annotated \
                         them, how, or how exactly."
                    ),
                }
            }
        }
    }

    /// Who acted, and where.
    pub(super) fn acting(&self) -> &'static str {
        match self {
            Self::Simulated => {
                "A scripted expert or a policy acted in a rigid-body simulation (rapier3d); who it was is in `episodes.actor`."
            }
            Self::Annotated { .. } => {
                "Episodes, videos and statistics are those of the dataset that it was brought in from. Its files do not \
                 tell whether a robot or a simulation acted."
            }
            Self::Modelled(_) => {
                "Episodes, videos and observations are those of the dataset that was annotated; who acted is in \
                 `episodes.actor`, as far as it was known."
            }
            Self::Foreign { .. } => "The files do not tell who acted, nor whether on a robot or in a simulation.",
        }
    }

    /// What the splits are.
    pub(super) fn splits(&self) -> &'static str {
        match self {
            Self::Simulated => {
                "A task is `seen` or `unseen` as a whole, decided when tasks are drawn and checked on the canonical goal: no \
                 end configuration of an unseen task is among the seen ones. Demonstrations are made of seen tasks; unseen \
                 ones are for evaluation. The column is `episodes.split`, and a task has one split in all of its episodes."
            }
            Self::Annotated { .. } | Self::Modelled(_) => {
                "The column is `episodes.split`. Nothing holds tasks of one split apart from those of another."
            }
            Self::Foreign { .. } => {
                "They are those of `meta/info.json`. Nothing holds tasks of one split apart from those of another."
            }
        }
    }

    /// How often whoever acted succeeded, where it was told.
    pub(super) fn success(&self, summary: &DatasetSummary) -> String {
        let successes = summary.outcomes.get("success").copied().unwrap_or(0);
        let all = summary.total_episodes + summary.failed_left_out;
        match self {
            Self::Simulated => {
                let share = 100.0 * successes as f64 / all.max(1) as f64;
                format!("{successes} of {all} succeeded ({share:.1} %).", all = counted(all, "episode"))
            }
            Self::Annotated { .. } | Self::Modelled(_) => {
                "Demonstrations are taken for successes: nobody has judged them.".to_owned()
            }
            Self::Foreign { .. } => "The files do not tell which episodes succeeded.".to_owned(),
        }
    }

    pub(super) fn limits(&self, summary: &DatasetSummary) -> Vec<String> {
        let fps = summary.fps;
        let own: Vec<String> = match self {
            Self::Simulated => vec![
                "Simulated: rigid bodies, a gripper without an arm, known poses. Nothing of it was measured on a robot."
                    .to_owned(),
                format!(
                    "`timestamp` is regular at {fps} a second, as LeRobot wants; the simulation's own time is \
                     `ntp.time_secs`.", fps = counted(fps, "frame")),
                "Observations are positions of slots, relative to the gripper.".to_owned(),
            ],
            Self::Annotated { models, .. } => vec![
                match models {
                    Some(models) => models.limit(),
                    None => "The accuracy of the labels was not measured.".to_owned(),
                },
                "Spans of sub-tasks share no frame.".to_owned(),
                format!("`timestamp` is regular at {fps} a second, as LeRobot wants.", fps = counted(fps, "frame")),
            ],
            Self::Modelled(models) => vec![
                models.limit(),
                format!("`timestamp` is regular at {fps} a second, as LeRobot wants.", fps = counted(fps, "frame")),
                "Observations are positions of slots, relative to the gripper.".to_owned(),
            ],
            Self::Foreign { models, .. } => vec![
                format!(
                    "`timestamp` is regular at {fps} a second, as LeRobot wants: when a sensor was read is not told.",
                    fps = counted(fps, "frame")
                ),
                "What its columns mean is told by their names alone.".to_owned(),
            ]
            .into_iter()
            .chain(models.as_ref().map(Modelled::limit))
            .collect(),
        };
        let boundaries =
            "Frames between the ends of primitives are not in the tables: motions have no intermediate states.";
        let unseen = "It has no episode of an unseen task: how well a learner generalizes shows elsewhere.";
        let left_out = summary.failed_left_out;
        let left_out_words = format!(
            "{left_out} that failed were left out: what is here is better than what acted.",
            left_out = counted(left_out, "episode")
        );
        let is_simulated = *self == Self::Simulated;
        let further = [
            (summary.frames == "boundaries", boundaries.to_owned()),
            (left_out > 0, left_out_words),
            (is_simulated && !summary.splits.contains_key("unseen"), unseen.to_owned()),
        ];
        own.into_iter().chain(further.into_iter().filter(|(holds, _)| *holds).map(|(_, words)| words)).collect()
    }

    /// Who is named where the publisher names nobody.
    pub(super) fn default_creator(&self) -> &'static str {
        match self {
            Self::Simulated => "The ntp project",
            Self::Annotated { .. } | Self::Modelled(_) => {
                "Unknown: the authors of the dataset that it was brought in from"
            }
            Self::Foreign { .. } => "Unknown: whoever recorded it",
        }
    }

    /// The command that made it, where no plan tells.
    pub(super) fn command(&self) -> &'static str {
        match self {
            Self::Simulated => "ntp convert PIPELINE.toml",
            Self::Annotated { .. } => "ntp dataset import THEIRS",
            Self::Modelled(_) => "ntp annotate DEMONSTRATIONS --model MODEL",
            Self::Foreign { .. } => "",
        }
    }

    /// What is said where no plan is at hand.
    pub(super) fn unknown_settings(&self) -> &'static str {
        match self {
            Self::Simulated => {
                "The recordings and tasks behind it were not at hand when it was published, so the settings that made them \
                 are not told here."
            }
            Self::Annotated { .. } => {
                "`ntp/episodes.parquet` names the file that each episode was read from, by name and hash."
            }
            Self::Modelled(_) => {
                "`ntp/annotation.json` names the models, and `ntp/episodes.parquet` what each episode was read from, by \
                 name and hash."
            }
            Self::Foreign { .. } => "",
        }
    }
}

/// Where labels of a form lie.
fn form_in_words(form: &str) -> String {
    match form {
        "language" => "the language columns".to_owned(),
        "sarm" => "SARM's columns of `meta/episodes`".to_owned(),
        "behavior" => "BEHAVIOR-1K's files below `annotations/`".to_owned(),
        column => format!("the column `{column}`"),
    }
}
