//! What an action did to the bodies that it should have left alone.

use rapier3d::math::Vector;

use crate::scene::{BodyIndex, Mobility, Scene, SceneState, lies_in_any_container};
use crate::sim::check::is_on_table;
use crate::sim::engine_shape::IntoEngine as _;
use crate::trace::Cause;

/// How far a body that stands may be displaced before it counts as knocked, in metres.
const KNOCKED_M: f32 = 0.01;

/// Where each body was when it was last left alone.
pub(super) struct Watch {
    bodies: Vec<Watched>,
}

#[derive(Clone, Copy)]
struct Watched {
    position: Vector,
    place: Place,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Place {
    OnTable,
    OffTable,
}

impl Watch {
    pub(super) fn new(state: &SceneState) -> Self {
        let watched = |pose: &crate::geometry::Pose| Watched {
            position: pose.translation.vector.into_engine(),
            place: Place::OnTable,
        };
        Self { bodies: state.bodies_in_world.iter().map(watched).collect() }
    }

    /// Takes where everything is now for where it was left; whether a body has fallen off the table since it was last
    /// judged.
    pub(super) fn forgive(&mut self, scene: &Scene, state: &SceneState) -> bool {
        let mut lost = false;
        for (watched, body) in self.bodies.iter_mut().zip(scene.body_indices()) {
            let place = place(scene, state, body);
            lost |= watched.place == Place::OnTable && place == Place::OffTable;
            *watched = Watched { position: state.body_in_world(body).translation.vector.into_engine(), place };
        }
        lost
    }

    /// Judges an action by the state after it; `handled` were in the grasp at its start or its end, and `is_moving`
    /// tells the bodies that still move: they are judged when they rest.
    pub(super) fn judge(
        &mut self,
        scene: &Scene,
        state: &SceneState,
        handled: &[BodyIndex],
        is_moving: impl Fn(BodyIndex) -> bool,
    ) -> Option<Cause> {
        let mut cause = None;
        let movable = scene.body_indices().filter(|&body| scene.body(body).mobility == Mobility::Movable);
        for body in movable {
            let watched = &mut self.bodies[usize::from(body.0)];
            let before = *watched;
            let position = state.body_in_world(body).translation.vector.into_engine();
            watched.place = place(scene, state, body);
            let knocked = (position - before.position).length() > KNOCKED_M
                && !handled.contains(&body)
                && !lies_in_any_container(scene, state, body);
            if before.place == Place::OnTable && watched.place == Place::OffTable {
                cause = gravest(cause, Some(Cause::ObjectOffTable));
            } else if knocked && before.place == Place::OnTable {
                cause = gravest(cause, Some(Cause::KnockedTower));
            }
            if knocked || !is_moving(body) || handled.contains(&body) {
                watched.position = position;
            }
        }
        cause
    }
}

fn place(scene: &Scene, state: &SceneState, body: BodyIndex) -> Place {
    let on_table = is_on_table(scene, state.body_in_world(body)) || state.held == Some(body);
    if on_table { Place::OnTable } else { Place::OffTable }
}

/// The graver of two causes: what was lost or broken comes before what merely did not work.
pub(super) fn gravest(first: Option<Cause>, second: Option<Cause>) -> Option<Cause> {
    let gravity = |cause: &Cause| match cause {
        Cause::ObjectOffTable => 0,
        Cause::PushedOffTable => 1,
        Cause::KnockedTower => 2,
        Cause::DroppedObject => 3,
        Cause::MissedGrasp => 4,
        Cause::UnknownSlot
        | Cause::TimeLimit
        | Cause::EndedEarly
        | Cause::NeverEnded
        | Cause::FellWhenCarried
        | Cause::NoPath
        | Cause::Collided
        | Cause::NotSeen
        | Cause::RobotLost => 5,
    };
    first.into_iter().chain(second).min_by_key(gravity)
}
