//! What cameras saw goes through recordings into datasets, images and videos alike, and comes back frame by frame.

use std::path::{Path, PathBuf};

use ntp::dataset::edit::{Carry, Condition, SplitBy, diff, filter, merge, repair, split};
use ntp::dataset::{
    ConvertConfig, EpisodePictures, FrameChoice, RecordingEpisodes, convert, play_back, read_trials, validate,
};
use ntp::recording::{RecordingError, ShardReader, ShardWriter};
use ntp::render::{CameraConfig, PictureFormat, Renderer, Viewpoint};
use ntp::seed::Seed;
use ntp::task::Split;
use ntp::trace::Episode;
use ntp::video::{Mp4Reader, Rgb};
use parquet::arrow::arrow_reader::{ArrowReaderMetadata, ArrowReaderOptions};
use parquet::file::metadata::PageIndexPolicy;
use re_lerobot::EpisodeIndex;
use re_lerobot::datasetv3::LeRobotDatasetV3;

use crate::dataset::{densify, episodes};

/// The feature of each camera, and how far a value may be off on average.
pub(crate) const CAMERAS: [(&str, PictureFormat, f64); 2] =
    [("front", PictureFormat::Png, 0.0), ("wrist", PictureFormat::H264, 8.0)];

pub(crate) fn cameras() -> Vec<CameraConfig> {
    let of = |(name, format, _): (&str, PictureFormat, f64)| {
        let view = if name == "front" { Viewpoint::Front } else { Viewpoint::Wrist };
        CameraConfig { format, ..CameraConfig::new(view, [64, 48]) }
    };
    CAMERAS.into_iter().map(of).collect()
}

pub(crate) struct Made {
    _folder: tempfile::TempDir,
    pub(crate) root: PathBuf,
    pub(crate) episodes: Vec<Episode>,
}

/// Episodes with two frames between boundaries.
fn dense() -> Vec<Episode> {
    episodes().iter().map(|episode| densify(episode, 2)).collect()
}

/// Episodes, filmed, recorded and converted.
pub(crate) fn made(frames: FrameChoice) -> Made {
    let (folder, episodes) = (tempfile::tempdir().unwrap(), dense());
    let path = film(folder.path(), "shard", &episodes, &cameras());
    let root = folder.path().join("dataset");
    convert_to(&[&path], frames, &root);
    Made { _folder: folder, root, episodes }
}

/// A recording of episodes.
fn film(folder: &Path, name: &str, episodes: &[Episode], cameras: &[CameraConfig]) -> PathBuf {
    let path = folder.join(format!("{name}.mcap"));
    let mut writer = ShardWriter::create(&path, "{}").unwrap().with_cameras(cameras);
    episodes.iter().for_each(|episode| writer.write(episode).unwrap());
    writer.finish().unwrap();
    path
}

fn convert_to(paths: &[&Path], frames: FrameChoice, root: &Path) {
    let config = ConvertConfig { frames, ..ConvertConfig::default() };
    let name = |path: &Path| path.file_name().unwrap().to_str().unwrap().to_owned();
    let sha256 = |path: &Path| ntp::artifact::sha256_bytes(name(path).as_bytes());
    let readers = paths.iter().map(|path| (name(path), sha256(path), ShardReader::open(path).unwrap()));
    match frames {
        FrameChoice::All => {
            let recordings = readers.map(|(file, sha256, reader)| {
                Ok::<_, RecordingError>(RecordingEpisodes { file, sha256, episodes: reader.pictured() })
            });
            convert(recordings, &config, root).unwrap();
        }
        FrameChoice::Boundaries => {
            let recordings = readers.map(|(file, sha256, reader)| {
                let episodes = reader.boundaries().pictured();
                Ok::<_, RecordingError>(RecordingEpisodes { file, sha256, episodes })
            });
            convert(recordings, &config, root).unwrap();
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

/// Whoever wants the pictures of one episode reads whole pages.
#[test]
fn a_page_ends_with_the_picture_that_fills_it() {
    let made = made(FrameChoice::All);
    let file = std::fs::File::open(made.root.join("data/chunk-000/file-000.parquet")).unwrap();
    let options = ArrowReaderOptions::new().with_offset_index_policy(PageIndexPolicy::Required);
    let footer = ArrowReaderMetadata::load(&file, options).unwrap();
    let columns = footer.metadata().file_metadata().schema_descr().columns().iter();
    let column = columns.clone().position(|leaf| leaf.path().parts() == ["observation.images.front", "bytes"]).unwrap();
    let groups = footer.metadata().offset_index().unwrap();
    let pages: Vec<i32> =
        groups.iter().flat_map(|group| group[column].page_locations()).map(|page| page.compressed_page_size).collect();
    let largest_picture = 3 * 64 * 48;
    assert!(pages.len() > 1, "{pages:?}");
    assert!(pages.iter().all(|&bytes| bytes < (1 << 16) + largest_picture), "{pages:?}");
}

#[test]
fn the_same_recordings_give_the_same_videos() {
    let [a, b] = [made(FrameChoice::All), made(FrameChoice::All)];
    assert_eq!(video(&a.root), video(&b.root));
}

fn video(root: &Path) -> Vec<u8> {
    std::fs::read(root.join("videos/observation.images.wrist/chunk-000/file-000.mp4")).unwrap()
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

/// The datasets `a` of the first episodes, `b` of the others, and `whole` of all, each episode with its pictures.
fn parts(frames: FrameChoice) -> (tempfile::TempDir, [PathBuf; 3]) {
    let (folder, episodes) = (tempfile::tempdir().unwrap(), dense());
    let a = film(folder.path(), "first", &episodes[..2], &cameras());
    let b = film(folder.path(), "second", &episodes[2..], &cameras());
    let roots = ["a", "b", "whole"].map(|name| folder.path().join(name));
    convert_to(&[&a], frames, &roots[0]);
    convert_to(&[&b], frames, &roots[1]);
    convert_to(&[&a, &b], frames, &roots[2]);
    (folder, roots)
}

/// The pictures of each episode of a camera.
fn all_pictures(root: &Path, camera: &str) -> Vec<Vec<Rgb>> {
    let mut pictures = EpisodePictures::open(root, camera).unwrap();
    (0..pictures.n_episodes()).map(|episode| pictures.read(episode).unwrap()).collect()
}

#[track_caller]
fn assert_opens_in_rerun(root: &Path) {
    let opened = LeRobotDatasetV3::load_from_directory(root).unwrap();
    for (position, pictures) in all_pictures(root, "front").into_iter().enumerate() {
        let rows = opened.read_episode_data(EpisodeIndex(position)).unwrap();
        assert_eq!(rows.num_rows(), pictures.len(), "episode {position}");
        assert!(rows.column_by_name("observation.images.front").is_some());
        let video = opened.read_episode_video_contents("observation.images.wrist", EpisodeIndex(position)).unwrap();
        assert_eq!(&video[4..8], b"ftyp");
    }
}

#[test]
fn merged_datasets_have_the_pictures_and_statistics_of_one_converted_at_once() {
    for frames in [FrameChoice::Boundaries, FrameChoice::All] {
        let (folder, [a, b, whole]) = parts(frames);
        let merged = folder.path().join("merged");
        let summary = merge(&[a, b], &merged, Carry::Packets).unwrap();
        assert!(summary.files.iter().any(|file| file.ends_with(".mp4")));
        assert_eq!(validate(&merged).findings, []);
        for (camera, ..) in CAMERAS {
            assert_eq!(all_pictures(&merged, camera), all_pictures(&whole, camera));
        }
        assert!(video(&merged) == video(&whole));
        assert!(diff(&merged, &whole).unwrap().is_none());
        for file in ["meta/stats.json", "meta/info.json"] {
            let [found, expected] = [&merged, &whole].map(|root| std::fs::read_to_string(root.join(file)).unwrap());
            assert_eq!(found, expected, "{file}");
        }
        assert_opens_in_rerun(&merged);
    }
}

#[test]
fn a_filtered_dataset_has_the_pictures_of_its_episodes_alone() {
    let made = made(FrameChoice::Boundaries);
    let unseen: Vec<usize> = (0..made.episodes.len())
        .filter(|&position| made.episodes[position].provenance.split == Split::Unseen)
        .collect();
    assert!(unseen[0] > 0 && unseen.len() > 1);
    let folder = tempfile::tempdir().unwrap();
    let (filtered, alone) = (folder.path().join("filtered"), folder.path().join("alone"));
    filter(
        &made.root,
        &Condition { split: Some(Split::Unseen.name().to_owned()), ..Condition::default() },
        &filtered,
        Carry::Packets,
    )
    .unwrap();
    let wanted: Vec<Episode> = unseen.iter().map(|&position| made.episodes[position].clone()).collect();
    convert_to(&[&film(folder.path(), "shard", &wanted, &cameras())], FrameChoice::Boundaries, &alone);
    assert_eq!(validate(&filtered).findings, []);
    for (camera, ..) in CAMERAS {
        let all = all_pictures(&made.root, camera);
        let expected: Vec<_> = unseen.iter().map(|&position| all[position].clone()).collect();
        assert_eq!(all_pictures(&filtered, camera), expected);
    }
    let stats = |root: &Path| -> serde_json::Value { ntp::artifact::read_json(&root.join("meta/stats.json")).unwrap() };
    for (camera, ..) in CAMERAS {
        let feature = format!("observation.images.{camera}");
        assert_eq!(stats(&filtered)[&feature], stats(&alone)[&feature]);
    }
    assert_opens_in_rerun(&filtered);
}

#[test]
fn parts_of_a_split_dataset_hold_every_picture_once() {
    let made = made(FrameChoice::Boundaries);
    let folder = tempfile::tempdir().unwrap();
    let parts = split(&made.root, &SplitBy::Task, &folder.path().join("parts"), Carry::Packets).unwrap();
    let mut n_pictures = 0;
    for (name, _) in &parts {
        let part = folder.path().join("parts").join(name);
        assert_eq!(validate(&part).findings, []);
        n_pictures += all_pictures(&part, "wrist").concat().len();
    }
    assert_eq!(n_pictures, all_pictures(&made.root, "wrist").concat().len());
}

#[test]
fn a_repaired_dataset_ends_before_the_first_picture_that_cannot_be_decoded() {
    let made = made(FrameChoice::Boundaries);
    let path = made.root.join("videos/observation.images.wrist/chunk-000/file-000.mp4");
    let before = all_pictures(&made.root, "wrist");
    let offset = sample_offset(&path, before[..3].concat().len());
    let mut bytes = std::fs::read(&path).unwrap();
    bytes[offset + 40..offset + 200].fill(0x55);
    std::fs::write(&path, &bytes).unwrap();
    let mended = made.root.with_file_name("mended");
    let repaired = repair(&made.root, &mended).unwrap();
    assert_eq!(repaired.written.unwrap().episodes, 3);
    assert!(
        repaired.reasons.iter().any(|reason| reason.contains("observation.images.wrist")),
        "{:?}",
        repaired.reasons
    );
    assert_eq!(validate(&mended).findings, []);
    assert_eq!(all_pictures(&mended, "wrist"), before[..3]);
}

/// Where a sample of a video begins.
fn sample_offset(path: &Path, sample: usize) -> usize {
    Mp4Reader::open(path).unwrap().samples()[sample].offset as usize
}

#[test]
fn a_difference_names_the_pictures_that_changed() {
    let [a, b] = [made(FrameChoice::Boundaries), made(FrameChoice::Boundaries)];
    assert!(diff(&a.root, &b.root).unwrap().is_none());
    let path = b.root.join("videos/observation.images.wrist/chunk-000/file-000.mp4");
    let pictures = all_pictures(&b.root, "wrist");
    let offset = sample_offset(&path, pictures[..2].concat().len());
    let mut bytes = std::fs::read(&path).unwrap();
    bytes[offset + 40] ^= 1;
    std::fs::write(&path, &bytes).unwrap();
    let found = diff(&a.root, &b.root).unwrap();
    assert_eq!((found.changed, found.same), (1, a.episodes.len() as u64 - 1));
    assert_eq!(found.changed_episodes[0].before.episode_index, 2);
    assert_eq!(found.changed_episodes[0].frames, [("observation.images.wrist".to_owned(), 1)].into());
}

#[test]
fn pictures_that_do_not_fit_together_are_refused_by_name() {
    let (folder, [a, b, _]) = parts(FrameChoice::Boundaries);
    let refused = |sources: &[PathBuf], code: &str, words: &str| {
        let error = merge(sources, &folder.path().join("merged"), Carry::Packets).unwrap_err().to_string();
        assert!(error.starts_with(code) && error.contains(words), "{error:?} is no {code} with {words:?}");
    };
    let other = folder.path().join("other");
    let wider: Vec<_> = cameras().into_iter().map(|camera| CameraConfig { size_px: [96, 48], ..camera }).collect();
    convert_to(&[&film(folder.path(), "wider", &dense()[2..], &wider)], FrameChoice::Boundaries, &other);
    refused(&[a.clone(), other.clone()], "edit.features", "observation.images");
    std::fs::remove_dir_all(&other).unwrap();
    convert_to(&[&film(folder.path(), "blind", &dense()[2..], &[])], FrameChoice::Boundaries, &other);
    refused(&[a.clone(), other], "edit.features", "observation.images");
    let info = b.join("meta/info.json");
    let text = std::fs::read_to_string(&info).unwrap();
    std::fs::write(&info, text.replace("\"h264\"", "\"av1\"")).unwrap();
    refused(&[a, b], "edit.video", "av1");
}

#[test]
fn one_damaged_picture_in_the_middle_of_an_episode_is_found_and_not_shown() {
    let made = made(FrameChoice::Boundaries);
    let path = made.root.join("data/chunk-000/file-000.parquet");
    let mut bytes = std::fs::read(&path).unwrap();
    let png = b"\x89PNG";
    let damaged = (0..bytes.len() - 4).filter(|&at| &bytes[at..at + 4] == png).nth(5).unwrap();
    bytes[damaged..damaged + 4].fill(0);
    std::fs::write(&path, bytes).unwrap();
    let said = "observation.images.front: picture of row 5: failed to decode PNG";
    let findings = validate(&made.root).findings;
    let [one] = &findings[..] else { panic!("{findings:?}") };
    assert_eq!((one.code, one.place.as_str()), ("pictures.decode", "episode 0"));
    assert!(one.message.contains(said), "{findings:?}");
    assert!(play_back(&made.root, 0).unwrap_err().to_string().contains(&format!("episode 0: {said}")));
    assert!(play_back(&made.root, 1).is_ok());
}
