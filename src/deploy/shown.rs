//! What a demonstration shows: its sub-tasks are what is to be done, what they bring about is the goal.

use crate::deploy::DeployError;
use crate::scene::SlotIndex;
use crate::task::{Goal, Task};
use crate::trace::{CallId, Episode};

/// The task of a demonstration, from its calls alone: so a recording by itself is enough.
///
/// # Errors
///
/// When it shows no sub-task.
pub fn shown_task(demonstration: &Episode) -> Result<Task, DeployError> {
    let provenance = &demonstration.provenance;
    let mut goals: Vec<Goal> = Vec::new();
    for sub_task in sub_tasks(demonstration) {
        if let [source, target] = *sub_task.as_slice()
            && !goals.contains(&Goal { source, target })
        {
            goals.push(Goal { source, target });
        }
    }
    if goals.is_empty() {
        return Err(DeployError::NoTask { task_id: provenance.task_id.clone() });
    }
    Ok(Task {
        id: provenance.task_id.clone(),
        family: provenance.family,
        conditions: goals.iter().map(|goal| goal.brings_about(provenance.family)).collect(),
        goals,
        split: provenance.split,
        blocks: None,
    })
}

/// The slots that each call of the root moves to, in order.
fn sub_tasks(demonstration: &Episode) -> Vec<Vec<SlotIndex>> {
    let mut sub_tasks: Vec<Vec<SlotIndex>> = Vec::new();
    for call in &demonstration.calls {
        if call.caller == Some(CallId(0)) {
            sub_tasks.push(Vec::new());
        }
        if let (Some(slot), Some(sub_task)) = (call.argument, sub_tasks.last_mut()) {
            sub_task.push(slot);
        }
    }
    sub_tasks
}
