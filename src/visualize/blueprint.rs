//! The layout of replays: scene and lanes at the left, words and numbers at the right, time below.

use rerun::blueprint::components::ContainerKind;
use rerun::components::{Position3D, Vector3D};
use rerun::datatypes;
use rerun::external::re_sdk_types::blueprint::archetypes::{Background, EyeControls3D, LineGrid3D, VisualBounds2D};
use rerun::external::re_sdk_types::blueprint::components::BackgroundKind;

use crate::visualize::layout::{Layout, Node};
use crate::visualize::store::Store;
use crate::visualize::{Replay, VisualizeError, agreement, arm, clock, palette, pictures, series, specification};

/// The blueprint for some replays: one for all, since Rerun has one an application.
pub(super) fn blueprint(replays: &[Replay<'_>]) -> Result<Store, VisualizeError> {
    let mut layout = Layout::new();
    let left = left(&mut layout, replays)?;
    let right = right(&mut layout, replays)?;
    let root = layout.split(ContainerKind::Horizontal, &[left, right], &[0.64, 0.36])?;
    layout.finish(root, replays.len(), clock::SIM_TIME, divergent(replays))
}

/// From the first divergence of a single replay to its end, to be found at once in the time panel.
fn divergent(replays: &[Replay<'_>]) -> Option<datatypes::AbsoluteTimeRange> {
    let [replay] = replays else { return None };
    let frames = &replay.episode.frames;
    let first = frames.get(agreement::frame_of(replay.episode, replay.divergence?)?)?;
    let time = |nanos: u64| datatypes::TimeInt(nanos as i64);
    Some(datatypes::AbsoluteTimeRange { min: time(first.time_nanos), max: time(frames.last()?.time_nanos) })
}

fn has_predictions(replays: &[Replay<'_>]) -> bool {
    replays.iter().any(|replay| series::has_predictions(replay.episode))
}

/// Scene, lanes, specification.
fn left(layout: &mut Layout, replays: &[Replay<'_>]) -> Result<Node, VisualizeError> {
    let scene = layout.view("3D", "Scene", "world", &["/world/**"])?;
    put_camera(layout, scene, replays)?;
    let front = layout.view("2D", "Camera in front", "camera/front", &["/camera/front"])?;
    let wrist = layout.view("2D", "Camera on the gripper", "camera/wrist", &["/camera/wrist"])?;
    let mut cameras = filmed(layout, replays)?;
    cameras.extend([front, wrist]);
    let shares = vec![1.0; cameras.len()];
    let cameras = layout.split(ContainerKind::Vertical, &cameras, &shares)?;
    let scene = layout.split(ContainerKind::Horizontal, &[scene, cameras], &[0.68, 0.32])?;
    let paired = replays.iter().any(|replay| replay.demonstration.is_some());
    let (name, contents): (&str, &[&str]) = if paired {
        (
            "Running programs, and those of the demonstration",
            &["/agreement", "/adversary", "/programs/**", "/programs_of_expert/**"],
        )
    } else {
        ("Running programs", &["/adversary", "/programs/**"])
    };
    let lanes = layout.view("StateTimeline", name, "", contents)?;
    let name = if has_predictions(replays) {
        "Scope on the specification (curves: probability of its start, green, and of its end, red)"
    } else {
        "Scope on the specification"
    };
    let scope = layout.view("2D", name, "specification", &["/specification/**"])?;
    put_strip_bounds(layout, scope, replays)?;
    let shares = if paired { [0.34, 0.49, 0.17] } else { [0.56, 0.24, 0.2] };
    layout.split(ContainerKind::Vertical, &[scene, lanes, scope], &shares)
}

/// What the recordings' own cameras saw, if there were any: one above the other, or several in one place.
fn filmed(layout: &mut Layout, replays: &[Replay<'_>]) -> Result<Vec<Node>, VisualizeError> {
    let mut known: Vec<String> = Vec::new();
    let mut views = Vec::new();
    for replay in replays {
        for (at, camera) in replay.cameras.iter().enumerate() {
            let entity = pictures::entity(camera);
            if !known.contains(&entity) {
                let title = pictures::title(replay, at, camera);
                views.push(layout.view("2D", &title, &entity, &[&format!("/{entity}")])?);
                known.push(entity);
            }
        }
    }
    match views.len() {
        0 | 1 => Ok(views),
        _ => Ok(vec![layout.split(ContainerKind::Tabs, &views, &[])?]),
    }
}

/// Words, then numbers: probabilities where there are any.
fn right(layout: &mut Layout, replays: &[Replay<'_>]) -> Result<Node, VisualizeError> {
    let document = layout.view("TextDocument", "Episode", "episode", &["/episode"])?;
    let log = layout.log("Calls", "calls", clock::SIM_TIME)?;
    let mut parts = vec![document, log];
    let distance = layout.plot("Distance from the gripper (m)", "observation", None)?;
    if has_predictions(replays) {
        let (ends, program) = ("probability/end_of_program", "probability/program");
        parts.push(layout.plot("Probability that the caller ends", ends, Some([-0.05, 1.05]))?);
        let chosen = layout.plot("Probability of the chosen program", program, Some([-0.05, 1.05]))?;
        let mut numbers = vec![chosen, distance];
        numbers.extend(joints(layout, replays)?);
        parts.push(layout.split(ContainerKind::Tabs, &numbers, &[])?);
    } else {
        match joints(layout, replays)? {
            None => parts.push(distance),
            Some(joints) => parts.push(layout.split(ContainerKind::Tabs, &[distance, joints], &[])?),
        }
    }
    let shares: &[f32] = if parts.len() > 3 { &[0.32, 0.28, 0.2, 0.2] } else { &[0.38, 0.34, 0.28] };
    layout.split(ContainerKind::Vertical, &parts, shares)
}

/// The plot of an arm's joints, where a robot has one.
fn joints(layout: &mut Layout, replays: &[Replay<'_>]) -> Result<Option<Node>, VisualizeError> {
    let has_arm = replays.iter().any(|replay| arm::is_there(replay.episode));
    has_arm.then(|| layout.plot("Joints (rad)", "joints", None)).transpose()
}

/// Looks at the whole table from in front and above.
fn put_camera(layout: &mut Layout, view: Node, replays: &[Replay<'_>]) -> Result<(), VisualizeError> {
    let halves = replays.iter().flat_map(|replay| replay.episode.scene.table_half_m);
    let reach = halves.fold(0.1_f32, f32::max);
    let eye = EyeControls3D::new()
        .with_position(Position3D::new(0.65 * reach, -2.05 * reach, 1.5 * reach))
        .with_look_target(Position3D::new(0.0, -0.05 * reach, 0.2 * reach))
        .with_eye_up(Vector3D::from([0.0, 0.0, 1.0]));
    layout.put_property(view, "EyeControls3D", &eye)?;
    layout.put_property(view, "LineGrid3D", &LineGrid3D::new().with_visible(false))?;
    layout.put_property(
        view,
        "Background",
        &Background::new(BackgroundKind::SolidColor).with_color(palette::color(palette::SKY)),
    )
}

fn put_strip_bounds(layout: &mut Layout, view: Node, replays: &[Replay<'_>]) -> Result<(), VisualizeError> {
    let n_rows = replays.iter().map(|replay| specification::n_rows(replay.episode)).max().unwrap_or(1);
    let height = f32::from(n_rows) * specification::ROW_PITCH;
    let bounds = VisualBounds2D::new(datatypes::Range2D {
        x_range: [-f64::from(specification::MARGIN), f64::from(specification::WIDTH) + 1.0].into(),
        y_range: [-f64::from(specification::ROW_PITCH) / 2.0, f64::from(height - specification::ROW_PITCH / 2.0)]
            .into(),
    });
    layout.put_property(view, "VisualBounds2D", &bounds)
}
