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

/// The cameras of a recording that is being written.
#[derive(Default)]
pub(super) struct Cameras {
    films: Vec<Film>,
}

/// What a camera filmed, with what it is and where.
pub(super) struct Filmed {
    pub(super) format: PictureFormat,
    frame_id: String,
    calibration: CameraCalibration,
    transform: FrameTransform,
    pictures: Vec<Vec<u8>>,
}

impl Cameras {
    pub(super) fn new(configs: &[CameraConfig]) -> Self {
        Self { films: configs.iter().map(Film::new).collect() }
    }

    /// Name and format of each camera.
    pub(super) fn configs(&self) -> impl Iterator<Item = &CameraConfig> {
        self.films.iter().map(Film::config)
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.films.len()
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
    let frame_id = frame_id(&film.config().name);
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
        child_frame_id: frame_id.clone(),
        translation: Some(Vector3 { x, y, z }),
        rotation: Some(Quaternion { x: i, y: j, z: k, w }),
    };
    Ok(Filmed { format: film.config().format, frame_id, calibration, transform, pictures })
}

/// The frame of reference of a camera.
fn frame_id(camera: &str) -> String {
    format!("camera_{camera}")
}

impl Filmed {
    /// What the camera is, from now on.
    pub(super) fn calibration(&self, log_time_nanos: u64) -> Vec<u8> {
        let stamp = Some(timestamp(log_time_nanos));
        CameraCalibration { timestamp: stamp, ..self.calibration.clone() }.encode_to_vec()
    }

    /// Where the camera is, from now on.
    pub(super) fn transform(&self, log_time_nanos: u64) -> Vec<u8> {
        let transform = FrameTransform { timestamp: Some(timestamp(log_time_nanos)), ..self.transform.clone() };
        FrameTransforms { transforms: vec![transform] }.encode_to_vec()
    }

    /// The picture of a frame.
    pub(super) fn picture(&mut self, log_time_nanos: u64, position: usize) -> Vec<u8> {
        let timestamp: Option<Timestamp> = Some(timestamp(log_time_nanos));
        let (frame_id, data) = (self.frame_id.clone(), std::mem::take(&mut self.pictures[position]));
        match self.format {
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
    pictures: CameraPictures,
    /// Pictures seen, also those that were passed over.
    seen: usize,
}

impl PicturesBeingRead {
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
            CameraTopic::Transform => return Ok(()),
            CameraTopic::Calibration => {
                let calibration = CameraCalibration::decode(data)?;
                let reading = self.reading(camera);
                reading.pictures.size_px = [calibration.width, calibration.height];
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
        reading.seen += 1;
        expect("number of pictures", reading.seen, n_frames)?;
        reading.pictures.format = format;
        if is_kept {
            reading.pictures.pictures.push(picture);
        }
        Ok(())
    }

    fn reading(&mut self, camera: &str) -> &mut Reading {
        let position = self.cameras.iter().position(|reading| reading.pictures.camera == camera);
        let position = position.unwrap_or_else(|| {
            let (camera, format) = (camera.to_owned(), PictureFormat::default());
            let pictures = CameraPictures { camera, size_px: [0; 2], format, pictures: Vec::new() };
            self.cameras.push(Reading { pictures, seen: 0 });
            self.cameras.len() - 1
        });
        &mut self.cameras[position]
    }

    /// The pictures of the episode, which has so many frames.
    pub(super) fn finish(self, n_frames: usize) -> Result<Vec<CameraPictures>, MessageProblem> {
        for reading in &self.cameras {
            reading.check(n_frames).map_err(|problem| problem.of_camera(&reading.pictures.camera))?;
        }
        Ok(self.cameras.into_iter().map(|reading| reading.pictures).collect())
    }
}

impl Reading {
    /// Whether there is a picture of each frame, and a calibration.
    fn check(&self, n_frames: usize) -> Result<(), MessageProblem> {
        expect("number of pictures", self.seen, n_frames)?;
        if self.pictures.size_px.contains(&0) {
            return Err(MessageProblem::Missing { field: "calibration" });
        }
        Ok(())
    }
}

fn expect(field: &'static str, found: usize, expected: usize) -> Result<(), MessageProblem> {
    let (found, expected) = (found as u64, expected as u64);
    if found == expected { Ok(()) } else { Err(MessageProblem::Unexpected { field, found, expected }) }
}
