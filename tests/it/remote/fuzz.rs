//! Damaged answers: none stops the program, and after the first that is refused the robot hears `stop` and no more.

use ntp::remote::RemoteRobot;
use ntp::robot::{Action, RobotApi as _};
use ntp::scene::SlotIndex;
use ntp::task::{Split, initial_state};
use proptest::prelude::any;

use super::wires::{Lines, Told, methods, scripted};
use super::{greet, simulated, trials};
use crate::fuzz::change::{changed, changes_of_text};
use crate::fuzz::run;
use crate::kinematic::{demonstration, tower, trial};

/// Everything that a robot can be asked for, until it is lost.
fn ask_everything(robot: &mut RemoteRobot) {
    let actions = [Action::Release, Action::MoveTo(SlotIndex(0)), Action::Grip];
    for action in actions {
        let _acted = robot.act(action);
    }
    let _settled = robot.settle();
}

#[test]
fn fuzz_answers_of_a_robot() {
    let task = tower("t", &[4, 1], Split::Unseen);
    let shown = demonstration(&task, &trial(&task, 0, 1), 0);
    let trials = trials(&shown);
    let initial = initial_state(task.family, &shown.scene, trials.trial(0).seed);
    let said = Told::default();
    let session = greet(said.around(simulated(&trials)), &trials);
    ask_everything(&mut RemoteRobot::reset(&session, &initial).unwrap());
    let whole: Vec<String> = said.lines_of("robot");
    let (family, scene) = (task.family, shown.scene.clone());
    run(250, &(any::<u32>(), changes_of_text()), |(which, changes)| {
        let mut lines = whole.clone();
        let which = which as usize % lines.len();
        let damaged = changed(lines[which].as_bytes(), &changes);
        let Ok(damaged) = String::from_utf8(damaged) else { return };
        lines.splice(which..=which, damaged.split('\n').map(str::to_owned));
        let sent = Lines::default();
        let wire = Box::new(scripted(lines, &sent));
        let patience = std::time::Duration::from_secs(1);
        let Ok(session) = ntp::remote::Session::begin(wire, "fuzz", family, scene.clone(), patience) else {
            assert_eq!(methods(&sent.lines()), ["hello", "stop"]);
            return;
        };
        if let Ok(mut robot) = RemoteRobot::reset(&session, &initial) {
            ask_everything(&mut robot);
            let finite = |frame: &ntp::trace::Frame| frame.state.gripper_in_world.translation.vector.norm() < 1e3;
            assert!(robot.frames().iter().all(finite));
        }
        let asked = methods(&sent.lines());
        let stops = asked.iter().filter(|method| *method == "stop").count();
        assert_eq!(stops, usize::from(session.lost().is_some()));
        assert!(stops == 0 || asked.last().unwrap() == "stop", "{asked:?}");
    });
}
