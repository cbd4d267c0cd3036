//! The encoder of videos: what a perception finds in each picture is compared, picture by picture, with what it finds
//! in the picture of now.
//!
//! ```text
//! for each pair (i, k) of percepts: displacement then, displacement now            ─► max over k ─► e_ji
//! for each percept i: e_ji, and how it lies to the robot and how it looks, then and now ─► u_ji ─► max over i ─► v_j
//! temporal convolution over v_j ─► y_j ─► scoping labels;  max and last of them ─► core
//! temporal convolution over u_ji for each percept ─► all of them ─► argument
//! ```
//!
//! Of several cameras each finds percepts of its own, in pairs among themselves; above that all percepts are alike.
//!
//! # Invariants
//!
//! A picture is looked at once, however many decisions it takes part in: their windows are gathered from its percepts.
//!
//! # Source
//!
//! The form of [`super::object_centric`], in the picture's plane. Which percept is which object nobody says: the layer
//! that names the argument learns it.

mod eye;

use burn::module::{Module, ModuleDisplay};
use burn::tensor::activation::{leaky_relu, relu};
use burn::tensor::{Device, Tensor};
use serde::{Deserialize, Serialize};

use crate::model::encoder::{ArgumentDecoder, Encoder, Widths};
use crate::model::layers::{Init, Mlp, TemporalConv, with_most_before};
use crate::model::limits::{ConfigError, check_cameras, check_kernels, check_sizes, is_one_camera, one_camera};
use crate::model::linear::Linear;
use crate::model::perception::{Looks as _, PERCEPT_WIDTH, Perception};
use crate::model::pictures::{PictureIndex, PictureSample, Pictures, picked};
use crate::model::read_error::ReadError;
use crate::model::sighted::eye::{Eye, OBJECT_WIDTH, Other, PLACE_WIDTH, Seen};
use crate::model::specification_rows::States;
use crate::model::summary::summarize;
use crate::model::windows::{Padding, Windows};
use crate::seed::Seed;
use crate::trace::Span;

/// Weights of the layer that names the argument lie within this bound to begin with: logits then differ by about one. With
/// small ones a percept's features get no gradient before names are tied to percepts, nor names before features tell the
/// percept that is meant: a plateau at guessing, of some hundred steps or many more.
const NAMING_BOUND: f32 = 0.4;
/// What is left of a negative feature before names. With a rectifier the strong gradients of the first steps can silence
/// every feature of every percept, and names are guessed for good.
const NAMING_LEAK: f64 = 0.1;

/// Widths of the encoder of videos.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SightedConfig<P> {
    /// Of the perception.
    pub perception: P,
    /// How many cameras see, each with a perception of its own. Default 1.
    #[serde(default = "one_camera", skip_serializing_if = "is_one_camera")]
    pub cameras: usize,
    /// Features of a pair of percepts. Default 12.
    pub pair_width: usize,
    /// Features of a percept, of a frame, of the state, and of every hidden layer. Default 32.
    pub width: usize,
    /// Width of program embeddings and keys. Default 16.
    pub program_width: usize,
    /// Frames that a scoping label sees around itself; odd. Default 5.
    pub scope_kernel: usize,
    /// Frames that an argument sees around itself; odd. Default 3.
    pub argument_kernel: usize,
}

impl<P> SightedConfig<P> {
    /// The default widths with a perception.
    pub fn of(perception: P) -> Self {
        Self {
            perception,
            cameras: 1,
            pair_width: 12,
            width: 32,
            program_width: 16,
            scope_kernel: 5,
            argument_kernel: 3,
        }
    }

    /// Whether a network can have these sizes, those of the perception aside.
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        let &Self { perception: _, cameras, pair_width, width, program_width, scope_kernel, argument_kernel } = self;
        check_cameras(cameras)?;
        check_sizes(&[("pair_width", pair_width), ("width", width), ("program_width", program_width)])?;
        check_kernels(&[("scope_kernel", scope_kernel), ("argument_kernel", argument_kernel)])
    }
}

/// The encoder of videos. What belongs to the first camera lies beside what all share, where models of one camera have it.
#[derive(Module, Debug)]
pub struct Sighted<P: Module> {
    perception: P,
    pair_demonstration: Linear,
    pair_state: Linear,
    pair: Linear,
    object_seen: Mlp,
    object_pairs: Linear,
    object_demonstration: Linear,
    object_state: Linear,
    object: Linear,
    state: Mlp,
    scope_conv: TemporalConv,
    others: Vec<Other<P>>,
}

/// A perception whose finds are given the names of slots.
pub trait Naming: Perception {
    /// How an object is named by what is found.
    type Decoder: ArgumentDecoder<Sighted<Self>>;
}

/// Names an object by what the specification and the state show of every percept: which percept is which object nobody
/// says.
#[derive(Module, Debug)]
pub struct PerceptNaming {
    conv: TemporalConv,
    object: Linear,
    context: Linear,
    slots: Linear,
}

/// What every picture gives by itself, `F` pictures of `C` cameras with `K` percepts each.
#[derive(Clone, Debug)]
pub struct Percepts<L> {
    /// First layer of pairs as part of a demonstration, and as what is seen now: `[F, C * K * K, pair]` each.
    pairs: [Tensor<3>; 2],
    /// The same of percepts: `[F, C * K, H]` each.
    objects: [Tensor<3>; 2],
    /// The state with the robot, `[F, H + C * PERCEPT_WIDTH]`.
    states: Tensor<2>,
    /// What is kept besides, of each camera.
    looks: Vec<L>,
}

/// Percepts of windows.
#[derive(Clone, Debug)]
pub struct SightedDemonstration<L> {
    /// `[B, T, C * K * K, pair]`
    pairs: Tensor<4>,
    /// `[B, T, C * K, H]`
    objects: Tensor<4>,
    padding: Option<Padding>,
    /// Of all pictures, of each camera.
    looks: Vec<L>,
    /// How many these are.
    n_pictures: usize,
    /// The pictures that each window shows.
    shown: Vec<Vec<PictureIndex>>,
}

/// Demonstration and state, compared.
#[derive(Clone, Debug)]
pub struct SightedReading<L> {
    /// Each percept in each frame, `[B, T, C * K, H]`.
    pub(crate) objects: Tensor<4>,
    /// Each frame with its neighbours, `[B, T, H]`; zero beyond a window.
    frames: Tensor<3>,
    /// Most and last of the window, `[B, 2 H]`.
    context: Tensor<2>,
    /// The state with the robot, `[B, H + C * PERCEPT_WIDTH]`.
    state: Tensor<2>,
    pub(crate) padding: Option<Padding>,
    /// What is kept besides of the window's first and last frame, of each camera.
    pub(crate) ends: Vec<[L; 2]>,
}

impl<P: Perception> Sighted<P> {
    /// From the first camera to the last.
    fn eyes(&self) -> impl Iterator<Item = Eye<'_, P>> {
        let Self { perception, pair_demonstration, pair_state, object_seen, state, .. } = self;
        let first = Eye { perception, pair_demonstration, pair_state, object_seen, state };
        std::iter::once(first).chain(self.others.iter().map(|other| other.eye()))
    }

    /// Each percept in each frame, compared with its pairs and itself now: `[B, T, C * K, H]`.
    fn compare(
        &self,
        demonstration: &SightedDemonstration<P::Looks>,
        pairs_now: Tensor<3>,
        objects_now: Tensor<3>,
    ) -> Tensor<4> {
        let SightedDemonstration { pairs, objects, .. } = demonstration;
        let [n_batch, n_frames, n_percepts, _] = objects.dims();
        let compared = self.pair.forward(relu(pairs.clone() + pairs_now.unsqueeze_dim(1))); // [B, T, C * K * K, pair]
        let [_, _, n_pairs, n_pair] = compared.dims();
        let each = n_pairs / n_percepts.max(1);
        let relations = compared.reshape([n_batch * n_frames, n_percepts, each, n_pair]).max_dim(2);
        let relations = relations.reshape([n_batch, n_frames, n_percepts, n_pair]);
        let hidden = self.object_pairs.forward(relations) + objects.clone() + objects_now.unsqueeze_dim(1);
        relu(self.object.forward(relu(hidden)))
    }
}

impl<P: Naming + ModuleDisplay> Encoder for Sighted<P> {
    type Config = SightedConfig<P::Config>;
    type Percepts = Percepts<P::Looks>;
    type Demonstration = SightedDemonstration<P::Looks>;
    type Reading = SightedReading<P::Looks>;
    type Argument = P::Decoder;

    fn new(config: &Self::Config, _n_slots: usize, init: &mut Init) -> Self {
        let &SightedConfig { perception, cameras, pair_width, width, scope_kernel, .. } = config;
        let n_object = pair_width + 2 * width;
        Self {
            perception: P::new(&perception, init),
            pair_demonstration: init.part(PLACE_WIDTH, pair_width, 2 * PLACE_WIDTH),
            pair_state: init.linear(PLACE_WIDTH, pair_width),
            pair: init.linear(pair_width, pair_width),
            object_seen: init.mlp(&[OBJECT_WIDTH, width, width]),
            object_pairs: init.part(pair_width, width, n_object),
            object_demonstration: init.part(width, width, n_object),
            object_state: init.linear(width, width),
            object: init.linear(width, width),
            state: init.mlp(&[OBJECT_WIDTH, width, width]),
            scope_conv: init.temporal_conv(scope_kernel, width, width),
            others: (1..cameras).map(|_| Other::new(config, init)).collect(),
        }
    }

    fn widths(config: &Self::Config) -> Widths {
        let &SightedConfig { cameras, width, program_width, .. } = config;
        let (context, frame) = (2 * width, 2 * width);
        Widths { context, state: width + cameras * PERCEPT_WIDTH, frame, program: program_width, core: vec![width] }
    }

    fn calibrated(mut self, sample: &PictureSample, seed: Seed) -> Result<Self, ReadError> {
        let n_cameras = self.others.len() + 1;
        let others = self.others.into_iter().enumerate().map(|(number, other)| {
            let camera = number + 1;
            other.calibrated(&sample.of_camera(camera, n_cameras), seed.derive("camera", &[camera as u64]))
        });
        self.others = others.collect::<Result<_, ReadError>>()?;
        self.perception = self.perception.calibrated(&sample.of_camera(0, n_cameras), seed)?;
        Ok(self)
    }

    fn perceive(&self, pictures: &Pictures) -> Result<Percepts<P::Looks>, ReadError> {
        let n_cameras = self.others.len() + 1;
        let see = |(camera, eye): (usize, Eye<'_, P>)| eye.see(&pictures.of_camera(camera, n_cameras));
        let seen: Vec<Seen<P::Looks>> = self.eyes().enumerate().map(see).collect::<Result<_, _>>()?;
        let beside = |part: fn(&Seen<P::Looks>) -> &Tensor<3>| -> Tensor<3> {
            Tensor::cat(seen.iter().map(|seen| part(seen).clone()).collect(), 1)
        };
        let hidden = beside(|seen| &seen.objects);
        let pairs = [beside(|seen| &seen.pairs[0]), beside(|seen| &seen.pairs[1])];
        let states: Option<Tensor<2>> = seen.iter().map(|seen| seen.state.clone()).reduce(Tensor::max_pair);
        let robots = seen.iter().map(|seen| seen.robot.clone());
        Ok(Percepts {
            pairs,
            objects: [self.object_demonstration.forward(hidden.clone()), self.object_state.forward(hidden)],
            states: Tensor::cat(states.into_iter().chain(robots).collect(), 1),
            looks: seen.into_iter().map(|seen| seen.looks).collect(),
        })
    }

    fn demonstration(
        &self,
        windows: &Windows,
        percepts: &Percepts<P::Looks>,
    ) -> Result<SightedDemonstration<P::Looks>, ReadError> {
        let device = self.device();
        let n_pictures = percepts.states.dims()[0];
        let shown = picked(windows.pictures()?, n_pictures, &device)?;
        let gather = |all: &Tensor<3>| {
            let [_, n_inner, width] = all.dims();
            all.clone().select(0, shown.clone()).reshape([windows.n_windows(), windows.n_frames(), n_inner, width])
        };
        Ok(SightedDemonstration {
            pairs: gather(&percepts.pairs[0]),
            objects: gather(&percepts.objects[0]),
            padding: windows.padding(&device),
            looks: percepts.looks.clone(),
            n_pictures,
            shown: windows.shown()?.into_iter().map(<[_]>::to_vec).collect(),
        })
    }

    fn window(demonstration: &SightedDemonstration<P::Looks>, span: Span) -> SightedDemonstration<P::Looks> {
        let cut = |frames: &Tensor<4>| frames.clone().narrow(1, span.begin as usize, span.len());
        let shown = |window: &Vec<PictureIndex>| window[span.begin as usize..span.end as usize].to_vec();
        SightedDemonstration {
            pairs: cut(&demonstration.pairs),
            objects: cut(&demonstration.objects),
            padding: None,
            looks: demonstration.looks.clone(),
            n_pictures: demonstration.n_pictures,
            shown: demonstration.shown.iter().map(shown).collect(),
        }
    }

    fn read(
        &self,
        demonstration: &SightedDemonstration<P::Looks>,
        states: &States,
        percepts: &Percepts<P::Looks>,
    ) -> Result<SightedReading<P::Looks>, ReadError> {
        let device = self.device();
        let now = picked(states.pictures()?, percepts.states.dims()[0], &device)?;
        let pairs_now = percepts.pairs[1].clone().select(0, now.clone());
        let objects_now = percepts.objects[1].clone().select(0, now.clone());
        let objects = self.compare(demonstration, pairs_now, objects_now);
        let padding = demonstration.padding.as_ref();
        let (frames, context) = summarize(&self.scope_conv, objects.clone().max_dim(2).squeeze_dim(2), padding);
        let state = percepts.states.clone().select(0, now);
        let end = |end: fn(&[PictureIndex]) -> Option<&PictureIndex>| {
            let shown: Vec<PictureIndex> =
                demonstration.shown.iter().map(|window| end(window).copied().unwrap_or_default()).collect();
            picked(&shown, demonstration.n_pictures, &device)
        };
        let (first, last) = (end(<[_]>::first)?, end(<[_]>::last)?);
        let ends = |looks: &P::Looks| [looks.select(first.clone()), looks.select(last.clone())];
        let ends = demonstration.looks.iter().map(ends).collect();
        Ok(SightedReading { objects, frames, context, state, padding: demonstration.padding.clone(), ends })
    }

    fn context(reading: &SightedReading<P::Looks>) -> Tensor<2> {
        reading.context.clone()
    }

    fn state(reading: &SightedReading<P::Looks>) -> Tensor<2> {
        reading.state.clone()
    }

    fn frames(reading: &SightedReading<P::Looks>) -> Tensor<3> {
        with_most_before(reading.frames.clone())
    }

    fn device(&self) -> Device {
        self.pair.device()
    }
}

impl<P: Naming> ArgumentDecoder<Sighted<P>> for PerceptNaming {
    fn new(config: &SightedConfig<P::Config>, n_slots: usize, _n_view: usize, init: &mut Init) -> Self {
        let &SightedConfig { perception, cameras, width, program_width, argument_kernel, .. } = config;
        let n_context = program_width + width;
        Self {
            conv: init.temporal_conv(argument_kernel, width, width),
            object: init.part(2 * width, width, 2 * width + n_context),
            context: init.linear(n_context, width),
            slots: init.linear_within(cameras * P::n_percepts(&perception) * width, n_slots, NAMING_BOUND),
        }
    }

    fn forward(
        &self,
        reading: &SightedReading<P::Looks>,
        program: Tensor<2>,
        _view: Tensor<2>,
        hidden: Tensor<2>,
    ) -> Tensor<2> {
        let padding = reading.padding.as_ref();
        let objects = Padding::mask_objects(padding, reading.objects.clone());
        let last = Padding::last_objects(padding, objects.clone());
        let moving = Padding::mask_objects(padding, self.conv.forward(objects)).max_dim(1).squeeze_dim(1);
        let context = self.context.forward(Tensor::cat(vec![program, hidden], 1));
        let object = self.object.forward(Tensor::<3>::cat(vec![moving, last], 2)); // [B, K, H]
        let told = leaky_relu(object + context.unsqueeze_dim(1), NAMING_LEAK);
        self.slots.forward(told.flatten::<2>(1, 2))
    }
}
