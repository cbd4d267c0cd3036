//! How far an episode came: which of its task's goals hold once the actor has ended, at rest, and after what is carried
//! away was carried.

use crate::robot::RobotApi;
use crate::scene::SceneState;
use crate::task::{Task, condition_holds};
use crate::trace::Cause;

/// The goals of a task in the end. The paper's "proportion of task completed" is `met` of `goals`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Judgement {
    /// End conditions of the task.
    pub goals: u32,
    /// How many of them hold.
    pub met: u32,
    /// Why the task is not done, if it is not: [`Cause::EndedEarly`] when a goal does not hold at rest,
    /// [`Cause::FellWhenCarried`] when it no longer does after the carrying, [`Cause::RobotLost`] when the world can no
    /// longer be reached; goals are those that held when it was seen last then.
    pub cause: Option<Cause>,
}

/// Lets the world come to rest and judges it; where all goals hold and the family has a tray, carries it and judges
/// again.
pub fn judge(task: &Task, world: &mut dyn RobotApi) -> Judgement {
    let settled = world.settle();
    let at_rest = judged(task, world, settled, Cause::EndedEarly);
    let Some(tray) = task.family.tray().filter(|_| at_rest.cause.is_none()) else { return at_rest };
    for body in world.scene().slot(tray).bodies.clone() {
        let carried = world.carry(body);
        let carried = judged(task, world, carried, Cause::FellWhenCarried);
        if carried.cause.is_some() {
            return carried;
        }
    }
    at_rest
}

/// A state, with the cause where not all goals hold in it; where there is none, what was seen last with the cause of that.
fn judged(task: &Task, world: &dyn RobotApi, state: Result<SceneState, Cause>, cause: Cause) -> Judgement {
    let (state, lost) = match state {
        Ok(state) => (state, None),
        Err(lost) => (world.state(), Some(lost)),
    };
    let holds = |condition| condition_holds(world.scene(), &state, condition);
    let goals = task.conditions.len() as u32;
    let met = task.conditions.iter().filter(|condition| holds(condition)).count() as u32;
    Judgement { goals, met, cause: lost.or((met < goals).then_some(cause)) }
}
