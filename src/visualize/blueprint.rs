//! The layout: scene and lanes at the left, words and numbers at the right, time below.
//!
//! The blueprint is logged entity by entity, as Rerun's own builder does, because that builder cannot set a view's
//! camera and names its parts at random.

use rerun::blueprint::components::{
    ContainerKind, Corner2D, IncludedContent, LoopMode, PanelState, PlayState, QueryExpression,
};
use rerun::components::{Position3D, Vector3D};
use rerun::datatypes::TimeRangeBoundary;
use rerun::external::re_sdk_types::blueprint::archetypes::{
    Background, ContainerBlueprint, EyeControls3D, LineGrid3D, PanelBlueprint, PlotLegend, ScalarAxis, TextLogColumns,
    TimeAxis, TimePanelBlueprint, ViewBlueprint, ViewContents, ViewportBlueprint, VisualBounds2D,
};
use rerun::external::re_sdk_types::blueprint::components::{BackgroundKind, TextLogColumn, TimelineColumn};
use rerun::external::re_sdk_types::blueprint::datatypes::{self as datatypes_of_views, TextLogColumnKind};
use rerun::external::uuid::Uuid;
use rerun::log::TimeColumn;
use rerun::{AsComponents, datatypes};

use crate::visualize::store::Store;
use crate::visualize::{Replay, VisualizeError, agreement, clock, palette, series, specification};

/// The blueprint for some replays: one for all, since Rerun has one an application.
pub(super) fn blueprint(replays: &[Replay<'_>]) -> Result<Store, VisualizeError> {
    let mut layout = Layout::new();
    let left = left(&mut layout, replays)?;
    let right = right(&mut layout, replays)?;
    let root = layout.split(ContainerKind::Horizontal, &[left, right], &[0.64, 0.36])?;
    let viewport =
        ViewportBlueprint::new().with_root_container(root.uuid()).with_auto_layout(false).with_auto_views(false);
    layout.put("viewport", &viewport)?;
    let recordings = if replays.len() > 1 { PanelState::Expanded } else { PanelState::Collapsed };
    layout.put("blueprint_panel", &PanelBlueprint::new().with_state(recordings))?;
    layout.put("selection_panel", &PanelBlueprint::new().with_state(PanelState::Collapsed))?;
    let time = TimePanelBlueprint::new()
        .with_state(PanelState::Collapsed)
        .with_timeline(clock::SIM_TIME)
        .with_play_state(PlayState::Paused)
        .with_loop_mode(LoopMode::Off);
    let time = match divergent(replays) {
        Some(range) => time.with_time_selection(range),
        None => time,
    };
    layout.put("time_panel", &time)?;
    layout.store.activate();
    Ok(layout.store)
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
    let cameras = layout.split(ContainerKind::Vertical, &[front, wrist], &[0.5, 0.5])?;
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

/// Words, then numbers: probabilities where there are any.
fn right(layout: &mut Layout, replays: &[Replay<'_>]) -> Result<Node, VisualizeError> {
    let document = layout.view("TextDocument", "Episode", "episode", &["/episode"])?;
    let log = layout.view("TextLog", "Calls", "calls", &["/calls"])?;
    put_log_columns(layout, log)?;
    let mut parts = vec![document, log];
    let distance = put_plot(layout, "Distance from the gripper (m)", "observation", None)?;
    if has_predictions(replays) {
        let (ends, program) = ("probability/end_of_program", "probability/program");
        parts.push(put_plot(layout, "Probability that the caller ends", ends, Some([-0.05, 1.05]))?);
        let chosen = put_plot(layout, "Probability of the chosen program", program, Some([-0.05, 1.05]))?;
        parts.push(layout.split(ContainerKind::Tabs, &[chosen, distance], &[])?);
    } else {
        parts.push(distance);
    }
    let shares: &[f32] = if parts.len() > 3 { &[0.32, 0.28, 0.2, 0.2] } else { &[0.38, 0.34, 0.28] };
    layout.split(ContainerKind::Vertical, &parts, shares)
}

/// When, and what was called: all lines are of one entity.
fn put_log_columns(layout: &mut Layout, log: Node) -> Result<(), VisualizeError> {
    let time =
        TimelineColumn(datatypes_of_views::TimelineColumn { visible: true.into(), timeline: clock::SIM_TIME.into() });
    let body = TextLogColumn(datatypes_of_views::TextLogColumn { visible: true.into(), kind: TextLogColumnKind::Body });
    let columns = TextLogColumns::new().with_timeline_columns([time]).with_text_log_columns([body]);
    layout.put_property(log, "TextLogColumns", &columns)
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

fn put_plot(layout: &mut Layout, name: &str, origin: &str, range: Option<[f64; 2]>) -> Result<Node, VisualizeError> {
    let view = layout.view("TimeSeries", name, origin, &[&format!("/{origin}/**")])?;
    let legend = PlotLegend::new().with_corner(Corner2D::RightTop).with_visible(range.is_some());
    layout.put_property(view, "PlotLegend", &legend)?;
    // Rerun would show half a minute to both sides of the cursor.
    let whole = datatypes::TimeRange { start: TimeRangeBoundary::Infinite, end: TimeRangeBoundary::Infinite };
    layout.put_property(view, "TimeAxis", &TimeAxis::new().with_view_range(whole))?;
    if let Some(range) = range {
        layout.put_property(view, "ScalarAxis", &ScalarAxis::new().with_range(range))?;
    }
    Ok(view)
}

/// A view or a container.
#[derive(Clone, Copy)]
struct Node {
    kind: &'static str,
    number: u128,
}

impl Node {
    fn id(self) -> Uuid {
        Uuid::from_u128(self.number)
    }

    fn uuid(self) -> datatypes::Uuid {
        self.id().into()
    }

    fn path(self) -> String {
        format!("{}/{}", self.kind, self.id())
    }
}

/// A blueprint on its way.
struct Layout {
    store: Store,
    n_nodes: u128,
}

impl Layout {
    fn new() -> Self {
        Self { store: Store::blueprint("layout"), n_nodes: 0 }
    }

    fn put(&mut self, path: &str, what: &dyn AsComponents) -> Result<(), VisualizeError> {
        self.store.put_whole(path, [TimeColumn::new_sequence("blueprint", [0_i64])], what)
    }

    fn put_property(&mut self, view: Node, name: &str, what: &dyn AsComponents) -> Result<(), VisualizeError> {
        self.put(&format!("{}/{name}", view.path()), what)
    }

    fn node(&mut self, kind: &'static str) -> Node {
        self.n_nodes += 1;
        Node { kind, number: self.n_nodes }
    }

    fn view(&mut self, class: &str, name: &str, origin: &str, contents: &[&str]) -> Result<Node, VisualizeError> {
        let view = self.node("view");
        let queries = contents.iter().map(|&query| QueryExpression(query.into()));
        self.put_property(view, "ViewContents", &ViewContents::new(queries))?;
        let blueprint = ViewBlueprint::new(class).with_display_name(name).with_space_origin(format!("/{origin}"));
        self.put(&view.path(), &blueprint)?;
        Ok(view)
    }

    fn split(&mut self, kind: ContainerKind, parts: &[Node], shares: &[f32]) -> Result<Node, VisualizeError> {
        let container = self.node("container");
        let contents = parts.iter().map(|part| IncludedContent(part.path().into()));
        let blueprint = ContainerBlueprint::new(kind).with_contents(contents);
        let blueprint = match kind {
            ContainerKind::Horizontal => blueprint.with_col_shares(shares.iter().copied()),
            ContainerKind::Vertical => blueprint.with_row_shares(shares.iter().copied()),
            ContainerKind::Tabs | ContainerKind::Grid => blueprint,
        };
        self.put(&container.path(), &blueprint)?;
        Ok(container)
    }
}
