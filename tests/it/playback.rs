//! Episodes of datasets, also of those that were annotated elsewhere, as they are shown.

use ntp::dataset::import::import;
use ntp::dataset::{EpisodePictures, FrameChoice, TrackPictures, play_back};
use ntp::video::decode_png;
use ntp::visualize::save_playbacks;

use crate::dataset_pictures::made;
use crate::import::theirs;
use crate::visualize::{entities, lane, recordings, temporal};

#[test]
fn an_imported_episode_is_shown_as_a_program_tree() {
    let folder = tempfile::tempdir().unwrap();
    let (source, ours) = (folder.path().join("theirs"), folder.path().join("ours"));
    theirs(&source);
    import(&source, None, &ours).unwrap();
    let playback = play_back(&ours, 2).unwrap();
    let calls: Vec<_> = playback.facts.calls.iter().map(|call| (call.depth, call.program.as_str())).collect();
    assert_eq!(calls, [(0, "task"), (1, "pick_and_place block_D block_B"), (1, "block_stacking")]);
    assert_eq!(playback.running, [[0, 5], [0, 4], [4, 5]]);
    assert_eq!(playback.times_secs.len(), 5);
    let features: Vec<_> = playback.numbers.iter().map(|track| (track.feature.as_str(), track.names.len())).collect();
    assert_eq!(features, [("observation.state", 26), ("action", 4)]);

    let path = folder.path().join("episode.rrd");
    let summary = save_playbacks(std::slice::from_ref(&playback), &path).unwrap();
    assert_eq!((summary.episodes, summary.frames, summary.calls), (1, 5, 3));
    let recordings = recordings(&path);
    let chunks = recordings.values().next().unwrap();
    assert_eq!(lane(chunks, "/programs/depth_0"), [(0, "task #0".to_owned())]);
    let second = [(0, "pick_and_place block_D block_B #1".to_owned()), (4, "block_stacking #2".to_owned())];
    assert_eq!(lane(chunks, "/programs/depth_1"), second);
    let found = entities(chunks);
    for entity in ["/calls", "/episode", "/numbers/action/gripper.closed"] {
        assert!(found.contains(entity), "{entity} is not among {found:?}");
    }
    let again = folder.path().join("again.rrd");
    save_playbacks(&[playback], &again).unwrap();
    assert_eq!(std::fs::read(path).unwrap(), std::fs::read(again).unwrap());
}

#[test]
fn calls_of_a_dataset_of_ours_last_until_the_frame_at_which_they_end() {
    let made = made(FrameChoice::All);
    let playback = play_back(&made.root, 0).unwrap();
    let episode = &made.episodes[0];
    for (call, running) in episode.calls.iter().zip(&playback.running) {
        assert_eq!(running, &[call.frames.begin, call.frames.last().max(call.frames.begin + 1)]);
    }
    assert_eq!(playback.facts.calls.len(), episode.calls.len());
    assert!(play_back(&made.root, 99).unwrap_err().to_string().contains("there is no episode 99"));
}

#[test]
fn images_and_videos_are_shown_as_the_dataset_has_them() {
    let made = made(FrameChoice::Boundaries);
    let playback = play_back(&made.root, 3).unwrap();
    let n_frames = playback.times_secs.len();
    let [front, wrist] = &playback.cameras[..] else { panic!("{} cameras", playback.cameras.len()) };
    assert_eq!([front.name.as_str(), wrist.name.as_str()], ["front", "wrist"]);
    let TrackPictures::Images(images) = &front.pictures else { panic!("no images") };
    let decoded: Vec<_> = images.iter().map(|png| decode_png(png).unwrap()).collect();
    assert_eq!(decoded, EpisodePictures::open(&made.root, "front").unwrap().read(3).unwrap());
    let TrackPictures::Video { mp4, from_secs } = &wrist.pictures else { panic!("no video") };
    let pictures = EpisodePictures::open(&made.root, "wrist").unwrap();
    let n_before: usize = (0..3).map(|episode| pictures.n_pictures(episode)).sum();
    assert_eq!((&mp4[4..8], *from_secs), (&b"ftyp"[..], n_before as f64 / 10.0));
    let path = made.root.with_file_name("episode.rrd");
    save_playbacks(&[playback], &path).unwrap();
    let recordings = recordings(&path);
    let chunks = recordings.values().next().unwrap();
    for camera in ["/camera/front", "/camera/wrist"] {
        assert_eq!(temporal(chunks, camera).num_rows(), n_frames, "{camera}");
    }
}
