//! What cameras see of an episode: filmed while it is written, and read back.
//!
//! An episode is filmed as a whole before any of its messages is written, so that one that cannot be filmed leaves no
//! trace. Memory holds the encoded pictures of one episode.

use prost::Message as _;

use super::error::{EpisodeProblem, MessageProblem};
use super::schema::foxglove::{
    CameraCalibration, CompressedImage, CompressedVideo, FrameTransform, FrameTransforms, Quaternion, Vector3,
};
use super::schema::{CameraTopic, Timestamp, timestamp};
use super::transform::{GRIPPER, WORLD};
use crate::artifact::Plan;
use crate::render::{CameraConfig, Mount, PictureFormat};
use crate::trace::{Actor, Episode};
use crate::video::{Film, VideoError};

/// What one camera saw of an episode.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraPictures {
    /// The camera's name.
    pub camera: String,
    /// Width and height, in pixels.
    pub size_px: [u32; 2],
    /// How pictures are stored.
    pub format: PictureFormat,
    /// One a frame: PNG, or a packet of H.264 in Annex B. A boundary's can be shown without those before.
    pub pictures: Vec<Vec<u8>>,
}

/// An episode, or a part of one, with what cameras saw of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Pictured<T> {
    /// The episode.
    pub episode: T,
    /// One for each camera of the recording.
    pub cameras: Vec<CameraPictures>,
}

/// The cameras that filmed a recording's episodes, as its plan tells: the first is what a policy that sees looks with.
/// None where there were none, or the plan is of another kind.
pub fn cameras_of(plan: &Plan) -> Vec<CameraConfig> {
    plan.setting(&["generate", "cameras"]).or_else(|| plan.setting(&["cameras"])).unwrap_or_default()
}

/// The cameras of a recording that is being written.
#[derive(Default)]
pub(super) struct Cameras {
    /// Name and format of each.
    declared: Vec<(String, PictureFormat)>,
    /// None where episodes come with what cameras saw.
    films: Vec<Film>,
}

/// What a camera filmed, with what it is and where.
#[derive(Debug)]
pub(super) struct Filmed {
    pub(super) seen: CameraPictures,
    calibration: CameraCalibration,
    transforms: FrameTransforms,
}

impl Cameras {
    pub(super) fn new(configs: &[CameraConfig]) -> Self {
        let declared = configs.iter().map(|config| (config.name.clone(), config.format));
        Self { declared: declared.collect(), films: configs.iter().map(Film::new).collect() }
    }

    /// Those of an episode that was filmed before.
    pub(super) fn of(filmed: &[Filmed]) -> Self {
        Self { declared: filmed.iter().map(Filmed::declared).collect(), films: Vec::new() }
    }

    /// Name and format of each camera.
    pub(super) fn declared(&self) -> &[(String, PictureFormat)] {
        &self.declared
    }

    /// Whether an episode that was filmed before is of these cameras.
    pub(super) fn check(&self, filmed: &[Filmed]) -> Result<(), EpisodeProblem> {
        let are_same = filmed.iter().map(Filmed::declared).eq(self.declared.iter().cloned());
        if are_same { Ok(()) } else { Err(EpisodeProblem::Cameras) }
    }

    /// Films all frames of an episode with each camera.
    pub(super) fn film(&mut self, episode: &Episode) -> Result<Vec<Filmed>, EpisodeProblem> {
        let filmed = self.films.iter_mut().map(|film| {
            let camera = film.config().name.clone();
            filmed(film, episode).map_err(|error| EpisodeProblem::Camera { camera, message: error.to_string() })
        });
        filmed.collect()
    }
}

fn filmed(film: &mut Film, episode: &Episode) -> Result<Filmed, VideoError> {
    film.begin_episode(episode)?;
    let frame_id = format!("camera_{}", film.config().name);
    let pictures = episode.frames.iter().map(|frame| {
        let picture = film.frame(&episode.scene, &frame.state, frame.boundary)?;
        Ok(picture.to_vec())
    });
    let pictures = pictures.collect::<Result<_, VideoError>>()?;
    // The expert always handles something. A policy may end before it has moved.
    if episode.provenance.actor == Actor::Expert {
        film.check_sight()?;
    }
    let camera = film.camera();
    let matrix = camera.matrix();
    let [a, b, c, d, e, f, g, h, i] = matrix;
    let calibration = CameraCalibration {
        timestamp: None,
        frame_id: frame_id.clone(),
        width: camera.width,
        height: camera.height,
        k: matrix.to_vec(),
        r: vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p: vec![a, b, c, 0.0, d, e, f, 0.0, g, h, i, 0.0],
        ..CameraCalibration::default()
    };
    let (parent, pose) = match camera.mount {
        Mount::World(in_world) => (WORLD, in_world),
        Mount::Gripper(in_gripper) => (GRIPPER, in_gripper),
    };
    let [x, y, z] = <[f32; 3]>::from(pose.translation.vector).map(f64::from);
    let [i, j, k, w] = <[f32; 4]>::from(pose.rotation.coords).map(f64::from);
    let transform = FrameTransform {
        timestamp: None,
        parent_frame_id: parent.to_owned(),
        child_frame_id: frame_id,
        translation: Some(Vector3 { x, y, z }),
        rotation: Some(Quaternion { x: i, y: j, z: k, w }),
    };
    let CameraConfig { name, format, .. } = film.config().clone();
    let seen = CameraPictures { camera: name, size_px: [camera.width, camera.height], format, pictures };
    Ok(Filmed { seen, calibration, transforms: FrameTransforms { transforms: vec![transform] } })
}

impl Filmed {
    fn declared(&self) -> (String, PictureFormat) {
        (self.seen.camera.clone(), self.seen.format)
    }

    /// What the camera is, from now on.
    pub(super) fn calibration(&self, log_time_nanos: u64) -> Vec<u8> {
        let stamp = Some(timestamp(log_time_nanos));
        CameraCalibration { timestamp: stamp, ..self.calibration.clone() }.encode_to_vec()
    }

    /// Where the camera is, from now on.
    pub(super) fn transform(&self, log_time_nanos: u64) -> Vec<u8> {
        let stamp = Some(timestamp(log_time_nanos));
        let transforms = self.transforms.transforms.iter().cloned();
        let transforms = transforms.map(|transform| FrameTransform { timestamp: stamp, ..transform }).collect();
        FrameTransforms { transforms }.encode_to_vec()
    }

    /// The picture of a frame.
    pub(super) fn picture(&mut self, log_time_nanos: u64, position: usize) -> Vec<u8> {
        let timestamp: Option<Timestamp> = Some(timestamp(log_time_nanos));
        let frame_id = self.calibration.frame_id.clone();
        let data = std::mem::take(&mut self.seen.pictures[position]);
        match self.seen.format {
            PictureFormat::Png => {
                CompressedImage { timestamp, frame_id, data, format: "png".to_owned() }.encode_to_vec()
            }
            PictureFormat::H264 => {
                CompressedVideo { timestamp, frame_id, data, format: "h264".to_owned() }.encode_to_vec()
            }
        }
    }
}

/// The pictures of an episode being read, camera by camera in the order of the file.
#[derive(Debug, Default)]
pub(super) struct PicturesBeingRead {
    cameras: Vec<Reading>,
}

#[derive(Debug)]
struct Reading {
    filmed: Filmed,
    /// Pictures seen, also those that were passed over.
    n_seen: usize,
}

impl PicturesBeingRead {
    /// Of these cameras, and any other of which a message comes.
    pub(super) fn new(cameras: &[String]) -> Self {
        Self { cameras: cameras.iter().map(|camera| Reading::new(camera)).collect() }
    }

    /// Takes a message of a camera; `n_frames` frames were read before it, the last of which is kept or passed over.
    pub(super) fn message(
        &mut self,
        camera: &str,
        topic: CameraTopic,
        data: &[u8],
        n_frames: usize,
        is_kept: bool,
    ) -> Result<(), MessageProblem> {
        let taken = self.take(camera, topic, data, n_frames, is_kept);
        taken.map_err(|problem| problem.of_camera(camera))
    }

    fn take(
        &mut self,
        camera: &str,
        topic: CameraTopic,
        data: &[u8],
        n_frames: usize,
        is_kept: bool,
    ) -> Result<(), MessageProblem> {
        let format = match topic {
            CameraTopic::Transform => {
                self.reading(camera).filmed.transforms = FrameTransforms::decode(data)?;
                return Ok(());
            }
            CameraTopic::Calibration => {
                let calibration = CameraCalibration::decode(data)?;
                let filmed = &mut self.reading(camera).filmed;
                filmed.seen.size_px = [calibration.width, calibration.height];
                filmed.calibration = calibration;
                return Ok(());
            }
            CameraTopic::Image => PictureFormat::Png,
            CameraTopic::Video => PictureFormat::H264,
        };
        let picture = match format {
            PictureFormat::Png => CompressedImage::decode(data)?.data,
            PictureFormat::H264 => CompressedVideo::decode(data)?.data,
        };
        let reading = self.reading(camera);
        reading.n_seen += 1;
        expect("number of pictures", reading.n_seen, n_frames)?;
        reading.filmed.seen.format = format;
        if is_kept {
            reading.filmed.seen.pictures.push(picture);
        }
        Ok(())
    }

    fn reading(&mut self, camera: &str) -> &mut Reading {
        let position = self.cameras.iter().position(|reading| reading.filmed.seen.camera == camera);
        let position = position.unwrap_or_else(|| {
            self.cameras.push(Reading::new(camera));
            self.cameras.len() - 1
        });
        &mut self.cameras[position]
    }

    /// The pictures of the episode, which has so many frames.
    pub(super) fn finish(self, n_frames: usize) -> Result<Vec<Filmed>, MessageProblem> {
        for reading in &self.cameras {
            reading.check(n_frames).map_err(|problem| problem.of_camera(&reading.filmed.seen.camera))?;
        }
        Ok(self.cameras.into_iter().map(|reading| reading.filmed).collect())
    }
}

impl Reading {
    fn new(camera: &str) -> Self {
        let (camera, format) = (camera.to_owned(), PictureFormat::default());
        let seen = CameraPictures { camera, size_px: [0; 2], format, pictures: Vec::new() };
        let (calibration, transforms) = (CameraCalibration::default(), FrameTransforms::default());
        Self { filmed: Filmed { seen, calibration, transforms }, n_seen: 0 }
    }

    /// Whether there is a picture of each frame, and a calibration.
    fn check(&self, n_frames: usize) -> Result<(), MessageProblem> {
        expect("number of pictures", self.n_seen, n_frames)?;
        if self.filmed.seen.size_px.contains(&0) {
            return Err(MessageProblem::Missing { field: "calibration" });
        }
        Ok(())
    }
}

fn expect(field: &'static str, found: usize, expected: usize) -> Result<(), MessageProblem> {
    let (found, expected) = (found as u64, expected as u64);
    if found == expected { Ok(()) } else { Err(MessageProblem::Unexpected { field, found, expected }) }
}
