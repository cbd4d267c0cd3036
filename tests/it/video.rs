//! Pictures come back from PNG, H.264 and MP4, and what is damaged is named.

use std::collections::BTreeSet;

use image::AnimationDecoder as _;
use ntp::render::{CameraConfig, Channel, PictureFormat, Segment, Viewpoint};
use ntp::task::Split;
use ntp::trace::Episode;
use ntp::video::{
    ClipConfig, Film, H264Decoder, H264Encoder, Mp4Reader, Mp4Writer, Rgb, decode_png, encode_gif, encode_png,
    is_key_frame, write_gif, write_mp4, write_png,
};

use crate::kinematic::{demonstration, tower, trial};

const SIZE: [u32; 2] = [64, 48];

fn episode() -> Episode {
    let task = tower("three", &[1, 3, 5], Split::Seen);
    demonstration(&task, &trial(&task, 0, 1), 0)
}

/// Pictures of an episode's frames.
fn pictures() -> Vec<Rgb> {
    let episode = episode();
    let mut film = Film::new(&CameraConfig::new(Viewpoint::Front, SIZE));
    film.begin_episode(&episode).unwrap();
    let draw = |frame: &ntp::trace::Frame| {
        let picture = film.draw(&episode.scene, &frame.state);
        Rgb { size_px: [picture.width, picture.height], bytes: picture.rgb.clone() }
    };
    episode.frames.iter().map(draw).collect()
}

/// Packets with a key frame at every fourth picture.
fn packets(pictures: &[Rgb]) -> Vec<Vec<u8>> {
    let mut encoder = H264Encoder::new(SIZE, 10).unwrap();
    let encode = |(position, picture): (usize, &Rgb)| {
        let mut packet = Vec::new();
        encoder.encode(&picture.bytes, position % 4 == 0, &mut packet).unwrap();
        packet
    };
    pictures.iter().enumerate().map(encode).collect()
}

fn mean_difference(a: &Rgb, b: &Rgb) -> f64 {
    assert_eq!(a.size_px, b.size_px);
    let sum: f64 = a.bytes.iter().zip(&b.bytes).map(|(a, b)| f64::from(a.abs_diff(*b))).sum();
    sum / a.bytes.len() as f64
}

#[test]
fn png_gives_back_every_byte() {
    for picture in pictures() {
        let mut png = Vec::new();
        encode_png(&picture.bytes, picture.size_px, &mut png).unwrap();
        assert_eq!(decode_png(&png).unwrap(), picture);
        assert!(decode_png(&png[..png.len() / 2]).is_err());
    }
    assert!(encode_png(&[0; 5], [1, 2], &mut Vec::new()).is_err());
}

#[test]
fn h264_gives_back_nearly_what_went_in_picture_by_picture() {
    let pictures = pictures();
    let mut decoder = H264Decoder::new().unwrap();
    let mut decoded = Rgb::default();
    for (picture, packet) in pictures.iter().zip(packets(&pictures)) {
        decoder.decode(&packet, &mut decoded).unwrap();
        let difference = mean_difference(picture, &decoded);
        assert!(difference < 6.0, "mean difference {difference}");
    }
}

#[test]
fn key_frames_stand_where_they_were_asked_for_and_alone() {
    let pictures = pictures();
    for (position, packet) in packets(&pictures).iter().enumerate() {
        assert_eq!(is_key_frame(packet), position % 4 == 0, "picture {position}");
        let mut decoded = Rgb::default();
        let alone = H264Decoder::new().unwrap().decode(packet, &mut decoded);
        assert_eq!(alone.is_ok(), position % 4 == 0, "picture {position}");
    }
}

#[test]
fn the_same_pictures_give_the_same_packets() {
    let pictures = pictures();
    assert_eq!(packets(&pictures), packets(&pictures));
    assert!(H264Encoder::new(SIZE, 10).unwrap().encode(&[0; 7], true, &mut Vec::new()).is_err());
}

#[test]
fn mp4_gives_back_every_packet_at_its_time() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("clip.mp4");
    let pictures = pictures();
    let packets = packets(&pictures);
    let mut writer = Mp4Writer::create(&path, SIZE, 10).unwrap();
    packets.iter().for_each(|packet| writer.write(packet).unwrap());
    writer.finish().unwrap();
    let mut reader = Mp4Reader::open(&path).unwrap();
    assert_eq!(reader.size_px(), SIZE);
    assert_eq!(reader.samples().len(), packets.len());
    let mut decoder = H264Decoder::new().unwrap();
    let (mut packet, mut decoded) = (Vec::new(), Rgb::default());
    for (position, picture) in pictures.iter().enumerate() {
        let sample = reader.samples()[position];
        assert!((sample.seconds - position as f64 / 10.0).abs() < 1e-9);
        assert_eq!(sample.is_key, position % 4 == 0);
        reader.read(position, &mut packet).unwrap();
        decoder.decode(&packet, &mut decoded).unwrap();
        assert!(mean_difference(picture, &decoded) < 6.0);
    }
    assert!(reader.read(packets.len(), &mut packet).is_err());
}

#[test]
fn a_damaged_mp4_is_an_error_that_names_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("clip.mp4");
    write_mp4(
        &path,
        &episode(),
        &CameraConfig::new(Viewpoint::Wrist, SIZE),
        &ClipConfig { fps: 5, ..ClipConfig::default() },
    )
    .unwrap();
    let bytes = std::fs::read(&path).unwrap();
    for len in [0, 7, 40, bytes.len() / 2, bytes.len() - 3] {
        std::fs::write(&path, &bytes[..len]).unwrap();
        let error = Mp4Reader::open(&path).err().map(|error| error.to_string());
        assert!(error.is_some_and(|error| error.contains("clip.mp4")), "cut to {len}");
    }
}

#[test]
fn clips_are_written_in_each_form() {
    let folder = tempfile::tempdir().unwrap();
    let episode = episode();
    let end_secs = episode.frames.last().unwrap().time_nanos as f64 / 1e9;
    let camera = CameraConfig { format: PictureFormat::H264, ..CameraConfig::new(Viewpoint::Front, SIZE) };
    let [mp4, gif, png] = ["a.mp4", "a.gif", "a.png"].map(|name| folder.path().join(name));
    let clip = ClipConfig { fps: 4, ..ClipConfig::default() };
    let made = write_mp4(&mp4, &episode, &camera, &clip).unwrap();
    assert_eq!((made.size_px, made.n_pictures), (SIZE, (end_secs * 4.0).ceil() as u64 + 1));
    assert_eq!(Mp4Reader::open(&mp4).unwrap().samples().len() as u64, made.n_pictures);
    assert_eq!(write_gif(&gif, &episode, &camera, &clip).unwrap(), made);
    assert!(std::fs::read(&gif).unwrap().starts_with(b"GIF89a"));
    write_png(&png, &episode, &camera, &episode.frames[0], Channel::Color).unwrap();
    assert_eq!(decode_png(&std::fs::read(&png).unwrap()).unwrap().size_px, SIZE);
}

/// What a viewer shows of a GIF: pictures with the hundredths of a second for which each stays.
fn shown(gif: &[u8]) -> Vec<(Rgb, u32)> {
    let decoder = image::codecs::gif::GifDecoder::new(std::io::Cursor::new(gif)).unwrap();
    let frame = |frame: image::ImageResult<image::Frame>| {
        let frame = frame.unwrap();
        let (millis, parts) = frame.delay().numer_denom_ms();
        let picture = image::DynamicImage::from(frame.into_buffer()).into_rgb8();
        (Rgb { size_px: picture.dimensions().into(), bytes: picture.into_raw() }, millis / parts / 10)
    };
    decoder.into_frames().map(frame).collect()
}

#[test]
fn a_gif_writes_what_changes_and_shows_every_picture_for_its_time() {
    let dark = |bright: &[usize]| {
        let bytes = (0..4 * 2 * 3).map(|at| if bright.contains(&(at / 3)) { 250 } else { 10 }).collect();
        Rgb { size_px: [4, 2], bytes }
    };
    let pictures = [dark(&[]), dark(&[]), dark(&[5, 6]), dark(&[6]), dark(&[6])];
    let gif = encode_gif(pictures.clone().into_iter(), 10, &BTreeSet::new()).unwrap();
    let expected = [(pictures[0].clone(), 20), (pictures[2].clone(), 10), (pictures[3].clone(), 20)];
    assert_eq!(shown(&gif), expected);
    let other_size = Rgb { size_px: [2, 2], bytes: vec![0; 12] };
    assert!(encode_gif([dark(&[]), other_size].into_iter(), 10, &BTreeSet::new()).is_err());
    assert!(encode_gif([Rgb { size_px: [4, 2], bytes: vec![0; 5] }].into_iter(), 10, &BTreeSet::new()).is_err());
    assert!(encode_gif(std::iter::empty(), 10, &BTreeSet::new()).is_err());
}

#[test]
fn a_gif_of_an_episode_stays_close_to_its_pictures() {
    let pictures = pictures();
    let shown = shown(&encode_gif(pictures.iter().cloned(), 10, &BTreeSet::new()).unwrap());
    let (mut number, mut left) = (0, 0);
    for picture in &pictures {
        if left == 0 {
            left = shown[number].1;
            number += 1;
        }
        assert!(mean_difference(picture, &shown[number - 1].0) < 4.0);
        left -= 10;
    }
    assert_eq!((number, left), (shown.len(), 0));
}

#[test]
fn running_programs_stand_below_the_picture_in_their_colours_and_none_before_it_is_called() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("programs.gif");
    let episode = episode();
    let camera = CameraConfig::new(Viewpoint::Front, [320, 240]);
    let clip = ClipConfig { programs: true, speed: 2.0, ..ClipConfig::default() };
    let made = write_gif(&path, &episode, &camera, &clip).unwrap();
    // Four depths (task, sub-task, pick or place, primitive) of 20 pixels, and twice a margin of 6.
    assert_eq!(made.size_px, [320, 240 + 4 * 20 + 12]);
    let end_secs = episode.frames.last().unwrap().time_nanos as f64 / 1e9;
    assert_eq!(made.n_pictures, (end_secs * 10.0 / 2.0).ceil() as u64 + 1);
    let shown = shown(&std::fs::read(&path).unwrap());
    let near = |picture: &Rgb, column: usize, row: usize, color: [u8; 3]| {
        let at = 3 * (row * 320 + column);
        picture.bytes[at..at + 3].iter().zip(color).all(|(found, asked)| found.abs_diff(asked) < 16)
    };
    let (first, last) = (&shown[0].0, &shown[shown.len() - 1].0);
    let middle_of_root = 240 + 6 + 10;
    let root = ntp::program::Program::BlockStacking.color();
    assert!(!near(first, 300, middle_of_root, root));
    // One call, one bar, of exactly its colour: a palette chosen for the picture above would blend it with its neighbours.
    let bar = |column: usize| last.bytes[3 * (middle_of_root * 320 + column)..][..3] == root;
    assert_eq!((0..320).filter(|&column| bar(column)).count(), 320 - 6 - (0..320).position(bar).unwrap());
    let is_text = |picture: &Rgb| (0..160).any(|column| near(picture, column, middle_of_root, [225, 229, 235]));
    assert!(is_text(first), "the running program is not named");
}

#[test]
fn a_picture_of_depths_is_in_millimetres_and_one_of_segments_in_their_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let episode = episode();
    let camera = CameraConfig::new(Viewpoint::Front, SIZE);
    let frame = &episode.frames[0];
    let mut film = Film::new(&camera);
    film.begin_episode(&episode).unwrap();
    let drawn = film.draw(&episode.scene, &frame.state);
    let read = |channel| {
        let path = folder.path().join("grey.png");
        write_png(&path, &episode, &camera, frame, channel).unwrap();
        image::open(&path).unwrap()
    };
    let (depths, segments) = (read(Channel::Depth).into_luma16(), read(Channel::Segments).into_luma8());
    assert_eq!(<[u32; 2]>::from(depths.dimensions()), SIZE);
    let of_pixel = |&(column, row): &(u32, u32)| {
        let depth_m = drawn.depth_at_m(column, row);
        let depth_mm = if depth_m.is_finite() { (1000.0 * depth_m).round() as u16 } else { 0 };
        (depth_mm, drawn.segment(column, row).number() as u8)
    };
    let pixels: Vec<(u32, u32)> = (0..SIZE[1]).flat_map(|row| (0..SIZE[0]).map(move |column| (column, row))).collect();
    let found = |&(column, row): &(u32, u32)| (depths.get_pixel(column, row)[0], segments.get_pixel(column, row)[0]);
    assert!(pixels.iter().all(|pixel| found(pixel) == of_pixel(pixel)));
    let table = u8::try_from(Segment::Table.number()).unwrap();
    assert!(pixels.iter().map(of_pixel).any(|(depth_mm, segment)| segment == table && depth_mm > 500));
}
