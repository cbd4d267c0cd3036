//! The paper's table of a real robot, ours below.

use minijinja::Value;
use serde::Serialize;

use crate::report::chart::scale::{percent, thousands};
use crate::report::robot_table::{PaperRobot, RobotRow, Share};
use crate::report::section::{Contents, Section};
use crate::report::suite_names::SuiteNames;

/// The section.
pub(super) const SECTION: Section = Section {
    name: "robot_table.html.j2",
    template: include_str!("robot_table.html.j2"),
    fill: |of| Value::from_serialize(fill(of)),
};

#[derive(Serialize)]
struct RobotTable {
    paper: Vec<PaperLine>,
    rows: Vec<Line>,
}

/// A line of the paper's table.
#[derive(Serialize)]
struct PaperLine {
    tasks: &'static str,
    trials: u64,
    success: String,
    ntp: String,
    manipulation: String,
}

/// A line of ours.
#[derive(Serialize)]
struct Line {
    suite: String,
    model: String,
    facts: String,
    trials: String,
    success: Cell,
    ntp: Option<Cell>,
    localisation: Option<String>,
    manipulation: Option<Cell>,
    goals_met: Option<String>,
    localisation_mm: Option<String>,
}

/// A share and its interval, in percent.
#[derive(Serialize)]
struct Cell {
    rate: String,
    low: String,
    high: String,
}

fn fill(of: &Contents<'_>) -> RobotTable {
    let rows = &of.report.robot_table;
    let mut paper: Vec<PaperRobot> = Vec::new();
    for line in rows.iter().filter_map(|row| row.paper) {
        if !paper.contains(&line) {
            paper.push(line);
        }
    }
    RobotTable {
        paper: paper.iter().map(paper_line).collect(),
        rows: rows.iter().map(|row| line(row, &of.names)).collect(),
    }
}

fn paper_line(line: &PaperRobot) -> PaperLine {
    PaperLine {
        tasks: line.tasks,
        trials: line.trials,
        success: percent(line.success),
        ntp: percent(line.ntp),
        manipulation: percent(line.manipulation),
    }
}

fn line(row: &RobotRow, names: &SuiteNames) -> Line {
    let cell = |share: Share| Cell {
        rate: percent(share.rate),
        low: percent(share.wilson_low),
        high: percent(share.wilson_high),
    };
    Line {
        suite: names.tell(&row.suite, &row.experiment),
        model: row.model.clone(),
        facts: row.facts.clone(),
        trials: thousands(row.episodes),
        success: cell(row.success),
        ntp: row.ntp.map(cell),
        localisation: row.localisation.map(|share| percent(share.rate)),
        manipulation: row.manipulation.map(cell),
        goals_met: row.goals_met.map(percent),
        localisation_mm: row.localisation_mm.map(|mm| format!("{mm:.1}")),
    }
}
