//! What cameras saw comes back frame by frame, and readers that do not ask for it are not disturbed.

use std::path::Path;

use ntp::recording::{CameraPictures, ShardReader, ShardWriter, inspect};
use ntp::render::{CameraConfig, PictureFormat, Renderer, Viewpoint};
use ntp::seed::Seed;
use ntp::task::Split;
use ntp::trace::Episode;
use ntp::video::{H264Decoder, Rgb, decode_png};

use crate::kinematic::{demonstration, tower, trial};

pub(super) fn cameras() -> [CameraConfig; 2] {
    let front = CameraConfig::new(Viewpoint::Front, [64, 64]);
    let wrist = CameraConfig { format: PictureFormat::H264, ..CameraConfig::new(Viewpoint::Wrist, [48, 32]) };
    [front, wrist]
}

pub(super) fn episodes() -> Vec<Episode> {
    let task = tower("three", &[1, 3, 5], Split::Seen);
    (0..2).map(|index| demonstration(&task, &trial(&task, index, 1), u64::from(index))).collect()
}

pub(super) fn write(path: &Path) -> Vec<Episode> {
    let episodes = episodes();
    let mut writer = ShardWriter::create(path, "{}").unwrap().with_cameras(&cameras());
    episodes.iter().for_each(|episode| writer.write(episode).unwrap());
    writer.finish().unwrap();
    episodes
}

fn is_right(pictures: &CameraPictures, config: &CameraConfig, episode: &Episode) {
    assert_eq!((pictures.camera.as_str(), pictures.size_px), (config.name.as_str(), config.size_px));
    assert_eq!(pictures.pictures.len(), episode.frames.len());
    let seed = Seed(episode.provenance.seed);
    let mut renderer = Renderer::new(config.look(&episode.scene, seed));
    let camera = config.camera(episode.provenance.family, seed);
    for (bytes, frame) in pictures.pictures.iter().zip(&episode.frames) {
        let expected = &renderer.draw(&episode.scene, &frame.state, &camera).rgb;
        let mut found = Rgb::default();
        match pictures.format {
            PictureFormat::Png => found = decode_png(bytes).unwrap(),
            // Every frame of the kinematic world is a boundary: each can be shown alone.
            PictureFormat::H264 => H264Decoder::new().unwrap().decode(bytes, &mut found).unwrap(),
        }
        let difference: u64 = found.bytes.iter().zip(expected).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
        let most = if pictures.format == PictureFormat::Png { 0 } else { 8 * expected.len() as u64 };
        assert!(difference <= most, "{}: difference {difference}", pictures.camera);
    }
}

#[test]
fn pictures_come_back_frame_by_frame() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("shard.mcap");
    let episodes = write(&path);
    let read: Vec<_> = ShardReader::open(&path).unwrap().pictured().map(Result::unwrap).collect();
    assert_eq!(read.len(), episodes.len());
    for (found, episode) in read.iter().zip(&episodes) {
        assert_eq!(found.episode, *episode);
        assert_eq!(found.cameras.len(), 2);
        for (pictures, config) in found.cameras.iter().zip(cameras()) {
            is_right(pictures, &config, episode);
        }
    }
    let boundaries = ShardReader::open(&path).unwrap().boundaries().pictured().map(Result::unwrap);
    for (found, whole) in boundaries.zip(&read) {
        assert_eq!(found.cameras, whole.cameras);
    }
}

#[test]
fn readers_that_ask_for_no_pictures_see_the_same_episodes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("shard.mcap");
    let episodes = write(&path);
    let read: Vec<Episode> = ShardReader::open(&path).unwrap().map(Result::unwrap).collect();
    assert_eq!(read, episodes);
    assert_eq!(ShardReader::open(&path).unwrap().read_episode(1).unwrap(), episodes[1]);
}

#[test]
fn the_same_episodes_and_cameras_give_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let paths = ["a.mcap", "b.mcap"].map(|name| folder.path().join(name));
    paths.iter().for_each(|path| drop(write(path)));
    let [a, b] = paths.map(|path| std::fs::read(path).unwrap());
    assert_eq!(a, b);
}

#[test]
fn each_camera_has_its_topics() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("shard.mcap");
    let episodes = write(&path);
    let n_frames: u64 = episodes.iter().map(|episode| episode.frames.len() as u64).sum();
    let topics = inspect(&path).unwrap().topics;
    let of = |name: &str| {
        topics.iter().find(|topic| topic.topic == name).map(|topic| (topic.schema.as_str(), topic.messages))
    };
    assert_eq!(of("/camera/front/image"), Some(("foxglove.CompressedImage", n_frames)));
    assert_eq!(of("/camera/wrist/video"), Some(("foxglove.CompressedVideo", n_frames)));
    assert_eq!(of("/camera/wrist/calibration"), Some(("foxglove.CameraCalibration", 2)));
    assert_eq!(of("/camera/front/tf"), Some(("foxglove.FrameTransforms", 2)));
}

#[test]
fn a_demonstration_of_which_a_camera_sees_nothing_is_refused_with_episode_and_camera() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("shard.mcap");
    let away = CameraConfig {
        name: "sky".to_owned(),
        eye_m: Some([0.0, -0.8, 0.8]),
        target_m: Some([0.0, -2.0, 1.5]),
        ..CameraConfig::new(Viewpoint::Fixed, [32, 32])
    };
    let [front, _] = cameras();
    let mut writer = ShardWriter::create(&path, "{}").unwrap().with_cameras(&[front, away]);
    let episode = episodes().remove(1);
    let error = writer.write(&episode).unwrap_err().to_string();
    let said = "camera sky: none of the things in the scene is in any of its pictures";
    assert!(error.contains("episode 1") && error.contains(said), "{error}");
    // A policy's episode may end before a camera on its gripper has seen anything.
    let mut parts = episode.into_parts();
    parts.provenance.actor = ntp::trace::Actor::Policy("ntp".to_owned());
    writer.write(&Episode::new(parts).unwrap()).unwrap();
    drop(writer);
    assert!(!path.exists());
}
