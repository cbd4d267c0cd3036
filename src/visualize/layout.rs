//! A blueprint being put together from views and containers.
//!
//! It is logged entity by entity, as Rerun's own builder does, because that builder cannot set a view's camera and names
//! its parts at random.

use rerun::blueprint::components::{
    ContainerKind, Corner2D, IncludedContent, LoopMode, PanelState, PlayState, QueryExpression,
};
use rerun::datatypes::TimeRangeBoundary;
use rerun::external::re_sdk_types::blueprint::archetypes::{
    ContainerBlueprint, PanelBlueprint, PlotLegend, ScalarAxis, TextLogColumns, TimeAxis, TimePanelBlueprint,
    ViewBlueprint, ViewContents, ViewportBlueprint,
};
use rerun::external::re_sdk_types::blueprint::components::{TextLogColumn, TimelineColumn};
use rerun::external::re_sdk_types::blueprint::datatypes::{self as datatypes_of_views, TextLogColumnKind};
use rerun::external::uuid::Uuid;
use rerun::log::TimeColumn;
use rerun::{AsComponents, datatypes};

use crate::visualize::VisualizeError;
use crate::visualize::store::Store;

/// A view or a container.
#[derive(Clone, Copy)]
pub(super) struct Node {
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
pub(super) struct Layout {
    store: Store,
    n_nodes: u128,
}

impl Layout {
    pub(super) fn new() -> Self {
        Self { store: Store::blueprint("layout"), n_nodes: 0 }
    }

    fn put(&mut self, path: &str, what: &dyn AsComponents) -> Result<(), VisualizeError> {
        self.store.put_whole(path, [TimeColumn::new_sequence("blueprint", [0_i64])], what)
    }

    pub(super) fn put_property(
        &mut self,
        view: Node,
        name: &str,
        what: &dyn AsComponents,
    ) -> Result<(), VisualizeError> {
        self.put(&format!("{}/{name}", view.path()), what)
    }

    fn node(&mut self, kind: &'static str) -> Node {
        self.n_nodes += 1;
        Node { kind, number: self.n_nodes }
    }

    pub(super) fn view(
        &mut self,
        class: &str,
        name: &str,
        origin: &str,
        contents: &[&str],
    ) -> Result<Node, VisualizeError> {
        let view = self.node("view");
        let queries = contents.iter().map(|&query| QueryExpression(query.into()));
        self.put_property(view, "ViewContents", &ViewContents::new(queries))?;
        let blueprint = ViewBlueprint::new(class).with_display_name(name).with_space_origin(format!("/{origin}"));
        self.put(&view.path(), &blueprint)?;
        Ok(view)
    }

    pub(super) fn split(
        &mut self,
        kind: ContainerKind,
        parts: &[Node],
        shares: &[f32],
    ) -> Result<Node, VisualizeError> {
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

    /// A view of numbers over all the time below `origin`.
    pub(super) fn plot(&mut self, name: &str, origin: &str, range: Option<[f64; 2]>) -> Result<Node, VisualizeError> {
        let view = self.view("TimeSeries", name, origin, &[&format!("/{origin}/**")])?;
        let legend = PlotLegend::new().with_corner(Corner2D::RightTop).with_visible(range.is_some());
        self.put_property(view, "PlotLegend", &legend)?;
        // Rerun would show half a minute to both sides of the cursor.
        let whole = datatypes::TimeRange { start: TimeRangeBoundary::Infinite, end: TimeRangeBoundary::Infinite };
        self.put_property(view, "TimeAxis", &TimeAxis::new().with_view_range(whole))?;
        if let Some(range) = range {
            self.put_property(view, "ScalarAxis", &ScalarAxis::new().with_range(range))?;
        }
        Ok(view)
    }

    /// A view of lines of text: when on a timeline, and what. All are of one entity.
    pub(super) fn log(&mut self, name: &str, origin: &str, timeline: &str) -> Result<Node, VisualizeError> {
        let view = self.view("TextLog", name, origin, &[&format!("/{origin}")])?;
        let time =
            TimelineColumn(datatypes_of_views::TimelineColumn { visible: true.into(), timeline: timeline.into() });
        let body =
            TextLogColumn(datatypes_of_views::TextLogColumn { visible: true.into(), kind: TextLogColumnKind::Body });
        let columns = TextLogColumns::new().with_timeline_columns([time]).with_text_log_columns([body]);
        self.put_property(view, "TextLogColumns", &columns)?;
        Ok(view)
    }

    /// Makes it the layout of so many recordings, with `selection` marked on the timeline.
    pub(super) fn finish(
        mut self,
        root: Node,
        n_recordings: usize,
        timeline: &str,
        selection: Option<datatypes::AbsoluteTimeRange>,
    ) -> Result<Store, VisualizeError> {
        let viewport =
            ViewportBlueprint::new().with_root_container(root.uuid()).with_auto_layout(false).with_auto_views(false);
        self.put("viewport", &viewport)?;
        let recordings = if n_recordings > 1 { PanelState::Expanded } else { PanelState::Collapsed };
        self.put("blueprint_panel", &PanelBlueprint::new().with_state(recordings))?;
        self.put("selection_panel", &PanelBlueprint::new().with_state(PanelState::Collapsed))?;
        let time = TimePanelBlueprint::new()
            .with_state(PanelState::Collapsed)
            .with_timeline(timeline)
            .with_play_state(PlayState::Paused)
            .with_loop_mode(LoopMode::Off);
        let time = match selection {
            Some(range) => time.with_time_selection(range),
            None => time,
        };
        self.put("time_panel", &time)?;
        self.store.activate();
        Ok(self.store)
    }
}
