//! What cameras saw goes through recordings into datasets, images and videos alike, and comes back frame by frame.

use std::path::{Path, PathBuf};

use ntp::dataset::{ConvertConfig, EpisodePictures, FrameChoice, RecordingEpisodes, convert, read_trials, validate};
use ntp::recording::{RecordingError, ShardReader, ShardWriter};
use ntp::render::{CameraConfig, PictureFormat, Renderer, Viewpoint};
use ntp::seed::Seed;
use ntp::trace::Episode;
use re_lerobot::EpisodeIndex;
use re_lerobot::datasetv3::LeRobotDatasetV3;

use crate::dataset::{densify, episodes};

/// The feature of each camera, and how far a value may be off on average.
const CAMERAS: [(&str, PictureFormat, f64); 2] =
    [("front", PictureFormat::Png, 0.0), ("wrist", PictureFormat::H264, 8.0)];

fn cameras() -> Vec<CameraConfig> {
    let of = |(name, format, _): (&str, PictureFormat, f64)| {
        let view = if name == "front" { Viewpoint::Front } else { Viewpoint::Wrist };
        CameraConfig { format, ..CameraConfig::new(view, [64, 48]) }
    };
    CAMERAS.into_iter().map(of).collect()
}

struct Made {
    _folder: tempfile::TempDir,
    root: PathBuf,
    episodes: Vec<Episode>,
}

/// Episodes with two frames between boundaries, filmed, recorded and converted.
fn made(frames: FrameChoice) -> Made {
    let folder = tempfile::tempdir().unwrap();
    let episodes: Vec<Episode> = episodes().iter().map(|episode| densify(episode, 2)).collect();
    let path = folder.path().join("shard.mcap");
    let mut writer = ShardWriter::create(&path, "{}").unwrap().with_cameras(&cameras());
    episodes.iter().for_each(|episode| writer.write(episode).unwrap());
    writer.finish().unwrap();
    let root = folder.path().join("dataset");
    convert_to(&path, frames, &root);
    Made { _folder: folder, root, episodes }
}

fn convert_to(path: &Path, frames: FrameChoice, root: &Path) {
    let config = ConvertConfig { frames, ..ConvertConfig::default() };
    let reader = ShardReader::open(path).unwrap();
    let file = || ("shard.mcap".to_owned(), "0".repeat(64));
    match frames {
        FrameChoice::All => {
            let (file, sha256) = file();
            let recording = RecordingEpisodes { file, sha256, episodes: reader.pictured() };
            convert([Ok::<_, RecordingError>(recording)], &config, root).unwrap();
        }
        FrameChoice::Boundaries => {
            let (file, sha256) = file();
            let recording = RecordingEpisodes { file, sha256, episodes: reader.boundaries().pictured() };
            convert([Ok::<_, RecordingError>(recording)], &config, root).unwrap();
        }
    }
}

#[test]
fn pictures_of_a_dataset_are_what_the_cameras_saw() {
    for frames in [FrameChoice::Boundaries, FrameChoice::All] {
        let made = made(frames);
        assert_eq!(EpisodePictures::cameras(&made.root).unwrap(), ["front", "wrist"]);
        for ((name, _, most), config) in CAMERAS.into_iter().zip(cameras()) {
            let mut pictures = EpisodePictures::open(&made.root, name).unwrap();
            assert_eq!((pictures.n_episodes(), pictures.size_px()), (made.episodes.len(), [64, 48]));
            // Backwards: an episode can be read without those before.
            for (position, episode) in made.episodes.iter().enumerate().rev() {
                let seed = Seed(episode.provenance.seed);
                let mut renderer = Renderer::new(config.look(&episode.scene, seed));
                let camera = config.camera(episode.provenance.family, seed);
                let wanted = episode.frames.iter().filter(|frame| frames == FrameChoice::All || frame.boundary);
                let read = pictures.read(position).unwrap();
                assert_eq!(read.len(), wanted.clone().count());
                for (found, frame) in read.iter().zip(wanted) {
                    let expected = &renderer.draw(&episode.scene, &frame.state, &camera).rgb;
                    let sum: u64 = found.bytes.iter().zip(expected).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
                    assert!(sum as f64 <= most * expected.len() as f64, "{name}, episode {position}: {sum}");
                }
            }
            assert!(pictures.read(99).is_err());
        }
        assert!(EpisodePictures::open(&made.root, "left").is_err());
    }
}

#[test]
fn a_dataset_with_pictures_is_valid_and_can_be_learned_from() {
    let made = made(FrameChoice::Boundaries);
    let validation = validate(&made.root);
    assert!(validation.findings.is_empty(), "{:?}", validation.findings);
    assert_eq!(read_trials(&made.root).unwrap().trials.len(), made.episodes.len());
    let stats: serde_json::Value =
        serde_json::from_slice(&std::fs::read(made.root.join("meta/stats.json")).unwrap()).unwrap();
    for (name, ..) in CAMERAS {
        let mean = &stats[format!("observation.images.{name}")]["mean"];
        assert_eq!(mean.as_array().unwrap().len(), 3);
        assert!((0.2..0.9).contains(&mean[0][0][0].as_f64().unwrap()), "{mean}");
    }
}

#[test]
fn reruns_reader_opens_images_and_videos() {
    let made = made(FrameChoice::All);
    let opened = LeRobotDatasetV3::load_from_directory(&made.root).unwrap();
    for position in 0..made.episodes.len() {
        let rows = opened.read_episode_data(EpisodeIndex(position)).unwrap();
        assert_eq!(rows.num_rows(), made.episodes[position].frames.len());
        assert!(rows.column_by_name("observation.images.front").is_some());
        let video = opened.read_episode_video_contents("observation.images.wrist", EpisodeIndex(position)).unwrap();
        assert_eq!(&video[4..8], b"ftyp");
    }
}

#[test]
fn the_same_recordings_give_the_same_videos() {
    let [a, b] = [made(FrameChoice::All), made(FrameChoice::All)];
    let video =
        |made: &Made| std::fs::read(made.root.join("videos/observation.images.wrist/chunk-000/file-000.mp4")).unwrap();
    assert_eq!(video(&a), video(&b));
}

#[test]
fn a_damaged_video_and_a_missing_one_are_found() {
    let made = made(FrameChoice::Boundaries);
    let path = made.root.join("videos/observation.images.wrist/chunk-000/file-000.mp4");
    let mut bytes = std::fs::read(&path).unwrap();
    let middle = bytes.len() / 4;
    bytes[middle..middle + 400].fill(0x55);
    std::fs::write(&path, &bytes).unwrap();
    let codes = |root: &Path| -> Vec<String> {
        validate(root).findings.iter().map(|finding| finding.code.to_owned()).collect()
    };
    assert!(codes(&made.root).iter().any(|code| code == "pictures.decode"));
    std::fs::remove_file(&path).unwrap();
    assert!(!codes(&made.root).is_empty());
}
