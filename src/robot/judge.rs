//! Whether a task is done once an actor has ended: at rest, and after what is carried away was carried.

use crate::robot::RobotApi;
use crate::task::{Task, goal_holds};
use crate::trace::Cause;

/// Lets the world come to rest and judges it; where the family has a tray, carries it and judges again.
///
/// # Errors
///
/// [`Cause::EndedEarly`] when the goal does not hold at rest, [`Cause::FellWhenCarried`] when it no longer does after
/// the carrying.
pub fn judge(task: &Task, world: &mut dyn RobotApi) -> Result<(), Cause> {
    let at_rest = world.settle();
    if !goal_holds(world.scene(), &at_rest, &task.conditions) {
        return Err(Cause::EndedEarly);
    }
    let Some(tray) = task.family.tray() else { return Ok(()) };
    for body in world.scene().slot(tray).bodies.clone() {
        let carried = world.carry(body);
        if !goal_holds(world.scene(), &carried, &task.conditions) {
            return Err(Cause::FellWhenCarried);
        }
    }
    Ok(())
}
