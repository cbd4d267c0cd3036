//! Pictures of a dataset read as training reads them: any rows, ahead of their use, and errors that name what is wrong.

use std::path::{Path, PathBuf};

use ntp::dataset::{
    ConvertConfig, DatasetWriter, EpisodePictures, EpisodeRows, FrameChoice, PictureLoader, RecordingEpisodes, Wanted,
    convert, read_trials,
};
use ntp::recording::{CameraPictures, RecordingError, ShardReader, ShardWriter};
use ntp::render::{CameraConfig, PictureQuality, Viewpoint};
use ntp::task::Split;
use ntp::trace::Episode;
use ntp::video::{Film, Mp4Reader, Mp4Writer, Rgb};

use crate::dataset::{densify, episodes};
use crate::dataset_pictures::{CAMERAS, Made, cameras, made};
use crate::kinematic::{demonstration, tower, trial};

#[test]
fn any_rows_of_an_episode_are_those_of_the_whole() {
    for frames in [FrameChoice::Boundaries, FrameChoice::All] {
        let made = made(frames);
        for (name, ..) in CAMERAS {
            let mut pictures = EpisodePictures::open(&made.root, name).unwrap();
            let whole = pictures.read(1).unwrap();
            for rows in [vec![0], vec![whole.len() as u32 - 1], vec![1, 2, 5, 6], vec![3, 7], vec![]] {
                let mut found = Vec::new();
                pictures.visit(1, &rows, |picture| found.push(picture.clone())).unwrap();
                let wanted: Vec<Rgb> = rows.iter().map(|&row| whole[row as usize].clone()).collect();
                assert_eq!(found, wanted, "{name}, {rows:?}");
            }
        }
    }
}

/// Episodes with pictures that are large enough for several row groups.
fn many(file_megabytes: u32) -> (tempfile::TempDir, Vec<Episode>) {
    let task = tower("seven", &[0, 1, 2, 3, 4, 5, 6, 7], Split::Seen);
    let episodes: Vec<Episode> = (0..26).map(|at| demonstration(&task, &trial(&task, at, 1), u64::from(at))).collect();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("shard.mcap");
    let camera = CameraConfig { quality: PictureQuality::Plain, ..CameraConfig::new(Viewpoint::Front, [320, 320]) };
    let mut writer = ShardWriter::create(&path, "{}").unwrap().with_cameras(&[camera]);
    episodes.iter().for_each(|episode| writer.write(episode).unwrap());
    writer.finish().unwrap();
    let config = ConvertConfig { file_megabytes: file_megabytes.try_into().unwrap(), ..ConvertConfig::default() };
    let file = ("shard.mcap".to_owned(), "0".repeat(64));
    let episodes_of = ShardReader::open(&path).unwrap().boundaries().pictured();
    let recording = RecordingEpisodes { file: file.0, sha256: file.1, episodes: episodes_of };
    convert([Ok::<_, RecordingError>(recording)], &config, &folder.path().join("dataset")).unwrap();
    (folder, episodes)
}

#[test]
fn episodes_are_found_in_any_row_group_and_file() {
    for (file_megabytes, n_files) in [(1, 2), (100, 1)] {
        let (folder, episodes) = many(file_megabytes);
        let root = folder.path().join("dataset");
        let files = std::fs::read_dir(root.join("data/chunk-000")).unwrap().count();
        assert!(files >= n_files, "{files} files");
        let mut pictures = EpisodePictures::open(&root, "front").unwrap();
        let config = CameraConfig { quality: PictureQuality::Plain, ..CameraConfig::new(Viewpoint::Front, [320, 320]) };
        for at in [25, 0, 13, 24, 1] {
            let mut film = Film::new(&config);
            film.begin_episode(&episodes[at]).unwrap();
            let last = episodes[at].frames.last().unwrap();
            let wanted = &film.draw(&episodes[at].scene, &last.state).rgb;
            let rows = [pictures.n_pictures(at) as u32 - 1];
            pictures.visit(at, &rows, |picture| assert_eq!(&picture.bytes, wanted, "episode {at}")).unwrap();
        }
    }
}

fn listed(made: &Made) -> Vec<EpisodeRows> {
    let trials = read_trials(&made.root).unwrap().trials;
    trials.into_iter().map(|trial| EpisodeRows { episode: trial.episode, rows: trial.rows }).collect()
}

#[test]
fn a_loader_gives_boundary_pictures_whatever_was_announced_within_its_limit() {
    for frames in [FrameChoice::Boundaries, FrameChoice::All] {
        let made = made(frames);
        for (name, ..) in CAMERAS {
            let mut pictures = EpisodePictures::open(&made.root, name).unwrap();
            let list = listed(&made);
            let mut wanted = Vec::new();
            for EpisodeRows { episode, rows } in &list {
                let mut bytes = Vec::new();
                pictures.visit(*episode, rows, |picture| bytes.push(picture.bytes.clone())).unwrap();
                wanted.push(bytes);
            }
            let largest = wanted.iter().map(|bytes| bytes.concat().len()).max().unwrap();
            // All pictures, one, or every second one.
            let some = |position: usize, step: usize| {
                let all = 0..wanted[position].len();
                let frames = match step % 3 {
                    0 => all.collect(),
                    1 => vec![step % all.len()],
                    _ => all.step_by(2).collect(),
                };
                Wanted { position, frames }
            };
            for limit in [0, largest, usize::MAX] {
                let loader = PictureLoader::open(&made.root, name, list.clone(), limit).unwrap();
                for step in 0..3 * list.len() {
                    // What is asked for was announced, now or before, or not at all.
                    let position = (step * 7) % list.len();
                    loader.announce(&[some((position + step % 3) % list.len(), step / 2)]);
                    let asked = some(position, step);
                    let found = loader.get(&asked).unwrap();
                    assert_eq!(found.len(), asked.frames.len());
                    let mut pairs = found.iter().zip(&asked.frames);
                    assert!(pairs.all(|(found, &frame)| **found == wanted[position][frame]), "{name}, {step}");
                    assert!(loader.n_bytes() <= limit.max(5 * largest), "{} bytes", loader.n_bytes());
                }
            }
        }
    }
}

#[test]
fn a_loader_refuses_rows_without_pictures_before_anything_is_read() {
    let made = made(FrameChoice::Boundaries);
    let mut list = listed(&made);
    list[1].rows.push(500);
    let error = PictureLoader::open(&made.root, "front", list, 0).err().unwrap().to_string();
    assert!(error.contains("episode 1: observation.images.front: row 500 has no picture"), "{error}");
    let loader = PictureLoader::open(&made.root, "front", listed(&made), 0).unwrap();
    let said = |position, frame| loader.get(&Wanted { position, frames: vec![frame] }).unwrap_err().to_string();
    assert!(said(99, 0).contains("no pictures at position 99"));
    assert!(said(0, 500).contains("no picture 500 of"));
}

#[test]
fn a_loader_decodes_no_more_than_what_was_wanted() {
    let made = made(FrameChoice::Boundaries);
    let loader = PictureLoader::open(&made.root, "front", listed(&made), usize::MAX).unwrap();
    let [width, height] = loader.size_px();
    loader.announce(&[Wanted { position: 1, frames: vec![0, 2] }]);
    for (frames, n_kept) in [(vec![0, 2], 2), (vec![2], 2), (vec![1, 2], 3)] {
        loader.get(&Wanted { position: 1, frames }).unwrap();
        assert_eq!(loader.n_bytes(), n_kept * 3 * (width * height) as usize);
    }
}

/// What reading an episode of a changed dataset says.
fn said(made: &Made, camera: &str, episode: usize) -> String {
    EpisodePictures::open(&made.root, camera).unwrap().read(episode).unwrap_err().to_string()
}

#[test]
fn a_video_that_lacks_frames_or_does_not_decode_is_named_with_episode_and_camera() {
    let made = made(FrameChoice::Boundaries);
    let path = made.root.join("videos/observation.images.wrist/chunk-000/file-000.mp4");
    let whole = std::fs::read(&path).unwrap();
    // As many samples as the first episode has.
    let mut reader = Mp4Reader::open(&path).unwrap();
    let shorter = made.root.join("shorter.mp4");
    let mut writer = Mp4Writer::create(&shorter, [64, 48], 10).unwrap();
    let mut packet = Vec::new();
    for sample in 0..EpisodePictures::open(&made.root, "wrist").unwrap().n_pictures(0) {
        reader.read(sample, &mut packet).unwrap();
        writer.write(&packet).unwrap();
    }
    writer.finish().unwrap();
    std::fs::rename(&shorter, &path).unwrap();
    assert!(EpisodePictures::open(&made.root, "wrist").unwrap().read(0).is_ok());
    let error = said(&made, "wrist", 1);
    assert!(error.contains("episode 1: observation.images.wrist: picture of row"), "{error}");
    assert!(error.contains("no picture"), "{error}");
    let mut damaged = whole;
    let end = damaged.len() / 2;
    damaged[64..end].fill(0x55);
    std::fs::write(&path, damaged).unwrap();
    let error = said(&made, "wrist", 0);
    assert!(error.contains("episode 0: observation.images.wrist: "), "{error}");
}

#[test]
fn pictures_of_another_size_than_declared_are_named_with_episode_and_camera() {
    let made = made(FrameChoice::Boundaries);
    let path = made.root.join("meta/info.json");
    let text = std::fs::read_to_string(&path).unwrap();
    let mut info: serde_json::Value = serde_json::from_str(&text).unwrap();
    for (name, ..) in CAMERAS {
        info["features"][format!("observation.images.{name}")]["shape"] = serde_json::json!([64, 64, 3]);
    }
    std::fs::write(&path, info.to_string()).unwrap();
    for (name, ..) in CAMERAS {
        let error = said(&made, name, 2);
        let expected = format!("episode 2: observation.images.{name}: picture of row");
        assert!(error.contains(&expected) && error.contains("64x48 pixels, expected 64x64"), "{error}");
    }
}

#[test]
fn a_recording_without_all_pictures_of_an_episode_makes_no_dataset() {
    let folder = tempfile::tempdir().unwrap();
    let episode = densify(&episodes()[0], 2);
    let path = folder.path().join("shard.mcap");
    let mut writer = ShardWriter::create(&path, "{}").unwrap().with_cameras(&cameras());
    writer.write(&episode).unwrap();
    writer.finish().unwrap();
    let whole = ShardReader::open(&path).unwrap().pictured().next().unwrap().unwrap();
    let check = |change: &dyn Fn(&mut CameraPictures), problem: &str| {
        let mut broken = whole.clone();
        change(&mut broken.cameras[1]);
        let root = folder.path().join("dataset");
        let mut dataset = DatasetWriter::create(&root, &ConvertConfig::default()).unwrap();
        let error = dataset.append_pictured(&broken, "shard.mcap", "0").unwrap_err().to_string();
        assert!(error.contains("episode 0, camera wrist: ") && error.contains(problem), "{error}");
        drop(dataset);
        let left: Vec<_> = walk(&root);
        assert!(left.is_empty(), "{left:?}");
        std::fs::remove_dir_all(&root).unwrap();
    };
    let n_frames = episode.frames.len();
    check(&|pictures| drop(pictures.pictures.pop()), &format!("it has {} pictures of {n_frames} frames", n_frames - 1));
    check(&|pictures| pictures.pictures[3].truncate(20), "a packet holds no picture");
    check(&|pictures| pictures.pictures[0] = vec![0; 50], "failed to decode H.264");
}

/// All files below a folder.
fn walk(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.flat_map(|path| if path.is_dir() { walk(&path) } else { vec![path] }).collect()
}
