//! Table, bodies and the mark around the body that the running `move_to` goes to.

use rerun::components::FillMode;
use rerun::external::re_log_types::EntityPath;
use rerun::{AsComponents, Boxes3D, Cylinders3D, Ellipsoids3D, Mesh3D, Quaternion, Transform3D, ViewCoordinates};

use crate::geometry::{Pose, Vec3};
use crate::scene::{Body, BodyIndex, Bowl, Mobility, Prism, Shape};
use crate::trace::{Episode, ProgramCall};
use crate::visualize::store::Store;
use crate::visualize::{VisualizeError, clock, lanes, palette};

/// With more movable bodies than this, their names would hide the scene; they are shown on hovering anyway.
const MAX_LABELLED: usize = 8;
const TABLE_THICKNESS_M: f32 = 0.02;
/// Half of the thickness of drawn edges.
const EDGE_RADIUS_M: f32 = 0.001;
/// Space between a body and the mark around it.
const TARGET_MARGIN_M: f32 = 0.006;

/// Logs the scene at all frames.
pub(super) fn put(store: &mut Store, episode: &Episode) -> Result<(), VisualizeError> {
    store.put_static("world", &ViewCoordinates::RIGHT_HAND_Z_UP())?;
    put_table(store, episode.scene.table_half_m)?;
    let n_movable = episode.scene.bodies.iter().filter(|body| body.mobility == Mobility::Movable).count();
    for (index, body) in episode.scene.body_indices().zip(&episode.scene.bodies) {
        let path = EntityPath::from("world/bodies").join(&EntityPath::from_single_string(body.name.as_str()));
        let labelled = n_movable <= MAX_LABELLED || body.mobility == Mobility::Fixed;
        store.put_static(path.clone(), form(body, labelled).as_ref())?;
        let pose = |frame: &crate::trace::Frame| *frame.state.body_in_world(index);
        put_poses(store, path, episode, pose)?;
    }
    put_target(store, episode)
}

/// Logs the poses of something that moves, at the frames where it has moved.
pub(super) fn put_poses(
    store: &mut Store,
    path: impl Into<EntityPath>,
    episode: &Episode,
    pose: impl Fn(&crate::trace::Frame) -> Pose,
) -> Result<(), VisualizeError> {
    let positions = clock::changes(&episode.frames, &pose);
    let poses: Vec<Pose> = positions.iter().map(|&position| pose(&episode.frames[position])).collect();
    let translations = poses.iter().map(|pose| <[f32; 3]>::from(pose.translation.vector));
    let rotations = poses.iter().map(|pose| Quaternion::from_xyzw(pose.rotation.coords.into()));
    let transforms = Transform3D::new().with_many_translation(translations).with_many_quaternion(rotations);
    store.put_rows(path, clock::times(&episode.frames, &positions), &transforms)
}

fn put_table(store: &mut Store, [half_x, half_y]: [f32; 2]) -> Result<(), VisualizeError> {
    let half_z = TABLE_THICKNESS_M / 2.0;
    let table = Boxes3D::from_centers_and_half_sizes([[0.0, 0.0, -half_z]], [[half_x, half_y, half_z]])
        .with_colors([palette::color(palette::TABLE)])
        .with_fill_mode(FillMode::Solid);
    store.put_static("world/table", &table)
}

/// What is written on a body: `D` for `block_D`, but `can_3` in full.
fn short_name(name: &str) -> &str {
    match name.rsplit_once('_') {
        Some((_, last)) if last.starts_with(|first: char| first.is_alphabetic()) => last,
        _ => name,
    }
}

/// The body's form about its own centre.
fn form(body: &Body, labelled: bool) -> Box<dyn AsComponents> {
    let colors = [palette::color(body.color)];
    let labels = [short_name(&body.name)];
    match body.shape {
        Shape::Cuboid { half_extents_m } => Box::new(
            Boxes3D::from_half_sizes([half_extents_m])
                .with_colors(colors)
                .with_fill_mode(FillMode::Solid)
                .with_labels(labels)
                .with_show_labels(labelled),
        ),
        Shape::Cylinder { radius_m, half_height_m } => Box::new(
            Cylinders3D::from_lengths_and_radii([2.0 * half_height_m], [radius_m])
                .with_colors(colors)
                .with_fill_mode(FillMode::Solid)
                .with_labels(labels)
                .with_show_labels(labelled),
        ),
        Shape::Ball { radius_m } => Box::new(
            Ellipsoids3D::from_radii([radius_m])
                .with_colors(colors)
                .with_fill_mode(FillMode::Solid)
                .with_labels(labels)
                .with_show_labels(labelled),
        ),
        Shape::OpenBox { inner_m, wall_m } => Box::new(open_box(inner_m, wall_m).with_colors(colors)),
        Shape::Bowl(bowl) => Box::new(bowl_mesh(&bowl, body.color)),
    }
}

/// The bowl's prisms as one mesh. Corners are not shared between triangles, so that edges stay sharp.
fn bowl_mesh(bowl: &Bowl, rgb: [u8; 3]) -> Mesh3D {
    let of_prism = |prism: &Prism| {
        let corners = prism.corners();
        prism.triangles().into_iter().map(move |triangle| triangle.map(|corner| corners[corner as usize]))
    };
    let triangles: Vec<[[f32; 3]; 3]> = bowl.prisms().iter().flat_map(of_prism).collect();
    let normal = |[a, b, c]: &[[f32; 3]; 3]| {
        let [a, b, c] = [a, b, c].map(|corner| Vec3::from(*corner));
        <[f32; 3]>::from((b - a).cross(&(c - a)).normalize())
    };
    let normals: Vec<[f32; 3]> = triangles.iter().flat_map(|triangle| [normal(triangle); 3]).collect();
    Mesh3D::new(triangles.into_iter().flatten()).with_vertex_normals(normals).with_albedo_factor(*palette::color(rgb))
}

/// Floor and four walls; the origin is the middle of the floor's upper side.
fn open_box([half_x, half_y, height]: [f32; 3], wall: f32) -> Boxes3D {
    let half_wall = wall / 2.0;
    let (beside_x, beside_y) = (half_x + half_wall, half_y + half_wall);
    let centers = [
        [0.0, 0.0, -half_wall],
        [beside_x, 0.0, height / 2.0],
        [-beside_x, 0.0, height / 2.0],
        [0.0, beside_y, height / 2.0],
        [0.0, -beside_y, height / 2.0],
    ];
    let half_sizes = [
        [half_x + wall, half_y + wall, half_wall],
        [half_wall, half_y + wall, height / 2.0],
        [half_wall, half_y + wall, height / 2.0],
        [half_x, half_wall, height / 2.0],
        [half_x, half_wall, height / 2.0],
    ];
    // What lies inside is to be seen through the walls.
    Boxes3D::from_centers_and_half_sizes(centers, half_sizes)
        .with_fill_mode(FillMode::TransparentFillMajorWireframe)
        .with_radii([EDGE_RADIUS_M])
}

/// A wireframe around the body that the running `move_to` goes to.
fn put_target(store: &mut Store, episode: &Episode) -> Result<(), VisualizeError> {
    let primitives = episode.calls.iter().filter(|call| call.argument.is_some());
    let events: Vec<(usize, Option<&ProgramCall>)> = lanes::events(&episode.frames, primitives);
    let (positions, running): (Vec<usize>, Vec<Option<&ProgramCall>>) = events.into_iter().unzip();
    let targets: Vec<([f32; 3], [f32; 3])> =
        running.iter().flatten().filter_map(|call| target_box(episode, call)).collect();
    let lengths: Vec<usize> = running.iter().map(|call| usize::from(call.is_some())).collect();
    let (centers, half_sizes): (Vec<_>, Vec<_>) = targets.into_iter().unzip();
    let n_boxes = centers.len();
    let boxes =
        Boxes3D::from_centers_and_half_sizes(centers, half_sizes)
            .with_colors(vec![palette::color(palette::TARGET); n_boxes]);
    let style = Boxes3D::update_fields().with_fill_mode(FillMode::MajorWireframe).with_radii([EDGE_RADIUS_M]);
    store.put_static("world/target", &style)?;
    store.put_ragged_rows("world/target", clock::times(&episode.frames, &positions), &boxes, &lengths)
}

/// Centre and half of the edges of the box around what a call's argument shows when it is called.
fn target_box(episode: &Episode, call: &ProgramCall) -> Option<([f32; 3], [f32; 3])> {
    let frame = &episode.frames[call.frames.begin as usize];
    let body: BodyIndex = frame.slots[usize::from(call.argument?.0)];
    let shape = episode.scene.body(body).shape;
    let half = shape.half_extents_m().add_scalar(TARGET_MARGIN_M);
    let mut center = frame.state.body_in_world(body).translation.vector;
    if shape.rim_m().is_some() {
        center.z += half.z;
    }
    Some((center.into(), half.into()))
}
