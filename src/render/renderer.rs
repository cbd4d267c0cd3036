//! Draws pictures, one after the other, in the same memory.

use crate::arm::links_in_world;
use crate::geometry::{Pose, Rotation, Vec3};
use crate::render::camera::Camera;
use crate::render::look::Look;
use crate::render::mesh::{Face, Mesh};
use crate::render::model::{ArmPart, Model};
use crate::render::picture::{Picture, Segment};
use crate::render::raster::{Affine, NOTHING, Raster};
use crate::render::shade::{Drawn, Palette, Prepared, Shader};
use crate::render::shadow::ShadowMap;
use crate::render::view::{NEAR_M, Sight, View, clip_near};
use crate::scene::{BodyIndex, Scene, SceneState};

/// The most samples across a pixel.
const MAX_SAMPLES: u32 = 4;
/// The width of the sun's map, at least and at most.
const MAP_SIZES: [usize; 2] = [96, 2048];
/// A face that is seen from less far than this above its plane is not drawn, in metres.
const EDGE_ON_M: f32 = 1e-5;

/// A renderer with its memory. It keeps the meshes of the last scene, so that drawing a scene again costs nothing but
/// the drawing.
#[derive(Debug)]
pub struct Renderer {
    look: Look,
    shader: Shader,
    /// The scene that was drawn last and its meshes.
    model: Option<(Scene, Model)>,
    frame: Frame,
    picture: Picture,
}

/// Memory for what a picture needs on its way.
#[derive(Debug, Default)]
struct Frame {
    raster: Raster,
    shadows: ShadowMap,
    faces: Vec<Drawn>,
    corners: Vec<Vec3>,
    scratch: Vec<Vec3>,
    polygon: Vec<[f32; 2]>,
    palettes: Vec<Palette>,
    n_palettes: usize,
    /// Of a row of samples.
    depths: Vec<f32>,
    row: Vec<u8>,
    sums: Vec<u16>,
}

impl Renderer {
    /// Draws with a look.
    pub fn new(look: Look) -> Self {
        let shader = Shader::new(&look);
        Self { look, shader, model: None, frame: Frame::default(), picture: Picture::default() }
    }

    /// How things look.
    pub fn look(&self) -> &Look {
        &self.look
    }

    /// Draws with another look from now on.
    pub fn set_look(&mut self, look: Look) {
        if look != self.look {
            self.shader = Shader::new(&look);
            self.look = look;
            self.model = None;
        }
    }

    /// Draws a scene at one instant as a camera sees it. The picture is the same for the same arguments and look,
    /// whatever was drawn before.
    pub fn draw(&mut self, scene: &Scene, state: &SceneState, camera: &Camera) -> &Picture {
        let model = kept(&mut self.model, scene, &self.look);
        let samples = self.look.samples.clamp(1, MAX_SAMPLES);
        let things = things(model, state);
        let to_sun = *self.shader.to_sun();
        let map_size = (2 * camera.width.max(camera.height) as usize).clamp(MAP_SIZES[0], MAP_SIZES[1]);
        let casters: Vec<(&Mesh, Pose)> = things[1..].iter().map(|thing| (thing.mesh, thing.in_world)).collect();
        self.frame.shadows.draw(&casters, &to_sun, self.look.shadows, map_size);
        let view = view(camera, state, samples);
        let size = [camera.width, camera.height].map(|pixels| (pixels * samples) as usize);
        self.frame.raster.clear(size[0], size[1], 0.0);
        self.frame.faces.clear();
        self.frame.n_palettes = 0;
        for thing in &things {
            self.frame.add(&view, thing, &self.shader);
        }
        self.picture.resize(camera.width, camera.height);
        self.frame.color(&self.shader, &view, samples as usize, &mut self.picture);
        &self.picture
    }

    /// Depths and segments alone, as [`Renderer::draw`] has them with one sample a pixel; without colours it is many
    /// times faster.
    pub fn draw_depths(&mut self, scene: &Scene, state: &SceneState, camera: &Camera) -> &Picture {
        let things = things(kept(&mut self.model, scene, &self.look), state);
        let view = view(camera, state, 1);
        self.frame.raster.clear(camera.width as usize, camera.height as usize, 0.0);
        things.iter().for_each(|thing| self.frame.cover(&view, thing));
        self.picture.resize(camera.width, camera.height);
        self.picture.rgb.clear();
        let Raster { nearness, owner, .. } = &self.frame.raster;
        self.picture.depth_m.iter_mut().zip(nearness).for_each(|(depth, nearness)| *depth = 1.0 / nearness);
        let number = |&owner: &u32| if owner == NOTHING { Segment::Background.number() } else { owner as u16 };
        self.picture.segments.iter_mut().zip(owner).for_each(|(segment, owner)| *segment = number(owner));
        &self.picture
    }
}

/// The meshes of a scene: those that were kept, if they are of it.
fn kept<'m>(model: &'m mut Option<(Scene, Model)>, scene: &Scene, look: &Look) -> &'m Model {
    let (_, model) = match model.take() {
        Some(kept) if kept.0 == *scene => model.insert(kept),
        _ => model.insert((scene.clone(), Model::new(scene, look))),
    };
    model
}

/// One rigid thing in the world.
struct Thing<'m> {
    mesh: &'m Mesh,
    in_world: Pose,
    segment: Segment,
}

/// All things, the table first.
fn things<'m>(model: &'m Model, state: &SceneState) -> Vec<Thing<'m>> {
    let gripper = state.gripper_in_world;
    let finger = |turn: Rotation| {
        let beside = Pose::translation(0.0, state.opening_m / 2.0, 0.0);
        Thing { mesh: &model.finger, in_world: gripper * turn * beside, segment: Segment::Gripper }
    };
    let half_turn = Rotation::new_unchecked(nalgebra::Quaternion::new(0.0, 0.0, 0.0, 1.0));
    let table = Thing { mesh: &model.table, in_world: Pose::identity(), segment: Segment::Table };
    let links = state.joints_rad.as_ref().map(links_in_world);
    let hand = if links.is_some() { &model.hand_of_arm } else { &model.hand };
    let hand = Thing { mesh: hand, in_world: gripper, segment: Segment::Gripper };
    let arm = links.into_iter().flat_map(|links| {
        model.arm.iter().map(move |ArmPart { link, in_link, mesh }| Thing {
            mesh,
            in_world: links[*link] * in_link,
            segment: Segment::Gripper,
        })
    });
    let bodies = model.bodies.iter().zip(&state.bodies_in_world).enumerate().map(|(index, (mesh, in_world))| Thing {
        mesh,
        in_world: *in_world,
        segment: Segment::Body(BodyIndex(index as u16)),
    });
    std::iter::once(table)
        .chain(bodies)
        .chain([hand, finger(Rotation::identity()), finger(half_turn)])
        .chain(arm)
        .collect()
}

/// A thing before the camera.
struct Seen {
    sight: Sight,
    rotation: nalgebra::Rotation3<f32>,
    origin: Vec3,
}

impl Seen {
    /// `None` when it is behind the camera.
    fn of(view: &View, thing: &Thing<'_>) -> Option<Self> {
        let sight = view.sight(&thing.in_world);
        let origin = sight.in_camera.translation.vector;
        let is_before = origin.z + thing.mesh.radius_m >= NEAR_M;
        is_before.then(|| Self { rotation: sight.in_camera.rotation.to_rotation_matrix(), origin, sight })
    }
}

fn view(camera: &Camera, state: &SceneState, samples: u32) -> View {
    let scale = samples as f32;
    View {
        camera_in_world: camera.in_world(state),
        focal: camera.focal_px * scale,
        center: camera.center_px().map(|center| (center + 0.5) * scale),
    }
}

impl Frame {
    /// Rasterises the faces of a thing that look at the camera.
    fn add(&mut self, view: &View, thing: &Thing<'_>, shader: &Shader) {
        let Some(seen) = Seen::of(view, thing) else { return };
        for face in &thing.mesh.faces {
            let Some(nearness) = self.outline(view, thing.mesh, face, &seen) else { continue };
            let owner = self.faces.len() as u32;
            self.raster.fill(&self.polygon, &nearness, owner);
            let shaded = shader.prepare(view, &seen.sight, &thing.in_world, face, &mut self.n_palettes);
            self.faces.push(shaded.of(thing.segment.number()));
        }
    }

    /// The same without light: who is nearest is told by the number of its segment.
    fn cover(&mut self, view: &View, thing: &Thing<'_>) {
        let Some(seen) = Seen::of(view, thing) else { return };
        for face in &thing.mesh.faces {
            let Some(nearness) = self.outline(view, thing.mesh, face, &seen) else { continue };
            self.raster.fill(&self.polygon, &nearness, u32::from(thing.segment.number()));
        }
    }

    /// Puts a face's outline in the picture into `polygon`; gives its nearness, or nothing where it is not seen.
    fn outline(&mut self, view: &View, mesh: &Mesh, face: &Face, seen: &Seen) -> Option<Affine> {
        let above = face.normal.dot(&seen.sight.eye) - face.offset;
        if above < EDGE_ON_M {
            return None;
        }
        self.corners.clear();
        self.corners
            .extend(mesh.corners[face.corners.clone()].iter().map(|corner| seen.rotation * corner + seen.origin));
        clip_near(&mut self.corners, &mut self.scratch);
        if self.corners.len() < 3 {
            return None;
        }
        self.polygon.clear();
        self.polygon.extend(self.corners.iter().map(|corner| view.project(corner)));
        Some(view.slope(&(seen.rotation * face.normal / -above)))
    }

    /// Colours, depths and segments of all pixels.
    fn color(&mut self, shader: &Shader, view: &View, samples: usize, picture: &mut Picture) {
        let Self { raster, shadows, faces, palettes, n_palettes, depths, row: bytes, sums, .. } = self;
        palettes.iter_mut().for_each(Palette::clear);
        palettes.resize(palettes.len().max(*n_palettes), Palette::default());
        let place = shadows.place(view);
        let mut prepared = Prepared { faces, palettes, shadows, place, height: raster.height };
        let width = raster.width;
        depths.resize(width, 0.0);
        bytes.resize(3 * width, 0);
        let mut shade = |row: usize, rgb: &mut [u8]| {
            let samples = row * width..(row + 1) * width;
            let nearness = &raster.nearness[samples.clone()];
            depths.iter_mut().zip(nearness).for_each(|(depth, nearness)| *depth = 1.0 / nearness);
            shader.shade_row(&mut prepared, row, &raster.owner[samples], depths, rgb);
        };
        for (pixel_row, rgb) in picture.rgb.chunks_exact_mut(3 * width / samples).enumerate() {
            if samples == 1 {
                shade(pixel_row, rgb);
                continue;
            }
            sums.clear();
            sums.resize(rgb.len(), 0);
            for row in pixel_row * samples..(pixel_row + 1) * samples {
                shade(row, bytes);
                add_samples(sums, bytes, samples);
            }
            let n_samples = (samples * samples) as u16;
            rgb.iter_mut().zip(sums.iter()).for_each(|(value, sum)| *value = ((sum + n_samples / 2) / n_samples) as u8);
        }
        self.measure(samples, picture);
    }

    /// Depths and segments: those of the nearest sample of each pixel.
    fn measure(&self, samples: usize, picture: &mut Picture) {
        let Raster { width, nearness, owner, .. } = &self.raster;
        let segment_of = |owner: u32| match owner {
            NOTHING => Segment::Background.number(),
            face => self.faces[face as usize].segment,
        };
        if samples == 1 {
            picture.depth_m.iter_mut().zip(nearness).for_each(|(depth, nearness)| *depth = 1.0 / nearness);
            picture.segments.iter_mut().zip(owner).for_each(|(segment, &owner)| *segment = segment_of(owner));
            return;
        }
        let n_columns = width / samples;
        for (pixel, (depth, segment)) in picture.depth_m.iter_mut().zip(&mut picture.segments).enumerate() {
            let first = (pixel / n_columns) * samples * width + (pixel % n_columns) * samples;
            let nearest = nearest_sample(nearness, *width, first, samples);
            *depth = 1.0 / nearness[nearest];
            *segment = segment_of(owner[nearest]);
        }
    }
}

/// The nearest of the samples of the pixel whose first sample is `first`.
fn nearest_sample(nearness: &[f32], width: usize, first: usize, samples: usize) -> usize {
    let mut nearest = first;
    for row in 0..samples {
        for sample in first + row * width..first + row * width + samples {
            if nearness[sample] > nearness[nearest] {
                nearest = sample;
            }
        }
    }
    nearest
}

/// Adds a row of samples to the sums of its pixels.
fn add_samples(sums: &mut [u16], bytes: &[u8], samples: usize) {
    for (sum, pixel) in sums.chunks_exact_mut(3).zip(bytes.chunks_exact(3 * samples)) {
        for sample in pixel.chunks_exact(3) {
            sum.iter_mut().zip(sample).for_each(|(sum, &value)| *sum += u16::from(value));
        }
    }
}
