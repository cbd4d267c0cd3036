//! Small recordings of robots, made from nothing.

use std::collections::BTreeMap;
use std::path::Path;

use mcap::records::MessageHeader;
use mcap::{WriteOptions, Writer};
use ntp::video::{H264Encoder, encode_png};
use serde_json::Value;

/// A message: topic, message encoding, schema (name, encoding, text), time, content.
#[derive(Clone)]
struct Message {
    topic: String,
    encoding: &'static str,
    schema: Option<(&'static str, &'static str, &'static str)>,
    nanos: u64,
    data: Vec<u8>,
}

/// Messages in the order of the file.
#[derive(Clone, Default)]
pub(super) struct Bag(Vec<Message>);

const JOINT_STATE: &str = "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n\
    ================\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n\
    ================\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";

impl Bag {
    pub(super) fn json(&mut self, topic: &str, nanos: u64, content: Value) {
        let position = self.0.len();
        self.json_at(position, topic, nanos, content);
    }

    /// At a place in the file.
    pub(super) fn json_at(&mut self, position: usize, topic: &str, nanos: u64, content: Value) {
        let (topic, data) = (topic.to_owned(), content.to_string().into_bytes());
        self.0.insert(position, Message { topic, encoding: "json", schema: None, nanos, data });
    }

    pub(super) fn ros2(&mut self, topic: &str, nanos: u64, data: Vec<u8>) {
        let schema = Some(("sensor_msgs/msg/JointState", "ros2msg", JOINT_STATE));
        self.0.push(Message { topic: topic.to_owned(), encoding: "cdr", schema, nanos, data });
    }

    pub(super) fn other(&mut self, topic: &str, encoding: &'static str, schema: &'static str) {
        let schema = Some(("any/Any", schema, ""));
        self.0.push(Message { topic: topic.to_owned(), encoding, schema, nanos: 0, data: vec![0; 8] });
    }

    /// By time.
    pub(super) fn sort(&mut self) {
        self.0.sort_by_key(|message| message.nanos);
    }

    pub(super) fn write(&self, path: &Path) {
        let options = WriteOptions::new().compression_threads(0).chunk_size(Some(4000));
        let mut writer: Writer<_> = options.create(std::fs::File::create(path).unwrap()).unwrap();
        let mut channels: BTreeMap<&str, u16> = BTreeMap::new();
        for Message { topic, encoding, schema, nanos, data } in &self.0 {
            let channel = *channels.entry(topic).or_insert_with(|| {
                let schema = match schema {
                    Some((name, encoding, text)) => writer.add_schema(name, encoding, text.as_bytes()).unwrap(),
                    None => 0,
                };
                writer.add_channel(schema, topic, encoding, &BTreeMap::new()).unwrap()
            });
            let header = MessageHeader { channel_id: channel, sequence: 0, log_time: *nanos, publish_time: *nanos };
            writer.write_to_known_channel(&header, data).unwrap();
        }
        writer.finish().unwrap();
    }
}

/// Plain CDR, little endian, written field by field.
pub(super) fn joint_state_cdr(nanos: u64, joints: &[(&str, f64)]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let pad = |bytes: &mut Vec<u8>, size: usize| bytes.resize(bytes.len().next_multiple_of(size), 0);
    let text = |bytes: &mut Vec<u8>, text: &str| {
        pad(bytes, 4);
        bytes.extend((text.len() as u32 + 1).to_le_bytes());
        bytes.extend(text.bytes().chain([0]));
    };
    bytes.extend(((nanos / 1_000_000_000) as u32).to_le_bytes());
    bytes.extend(((nanos % 1_000_000_000) as u32).to_le_bytes());
    text(&mut bytes, "base");
    pad(&mut bytes, 4);
    bytes.extend((joints.len() as u32).to_le_bytes());
    joints.iter().for_each(|(name, _)| text(&mut bytes, name));
    pad(&mut bytes, 4);
    bytes.extend((joints.len() as u32).to_le_bytes());
    pad(&mut bytes, 8);
    joints.iter().for_each(|(_, position)| bytes.extend(position.to_le_bytes()));
    bytes.extend(0_u32.to_le_bytes());
    [0, 1, 0, 0].into_iter().chain(bytes).collect()
}

pub(super) fn png(rgb: &[u8], size_px: [u32; 2]) -> Vec<u8> {
    let mut png = Vec::new();
    encode_png(rgb, size_px, &mut png).unwrap();
    png
}

/// A JPEG of 16x16 pixels of one grey.
pub(super) fn jpeg(grey: u8) -> Vec<u8> {
    let mut jpeg = Vec::new();
    let encoder = image::codecs::jpeg::JpegEncoder::new(&mut jpeg);
    image::ImageEncoder::write_image(encoder, &[grey; 256], 16, 16, image::ExtendedColorType::L8).unwrap();
    jpeg
}

/// Packets of a video of 32x32 pixels with a key frame every so many.
pub(super) fn video(n_pictures: usize, group: usize) -> Vec<Vec<u8>> {
    let mut encoder = H264Encoder::new([32, 32], 10).unwrap();
    let packet = |number: usize| {
        let rgb: Vec<u8> =
            (0..32 * 32).flat_map(|pixel| [(pixel * 7 + number * 40) as u8, number as u8, pixel as u8]).collect();
        let mut packet = Vec::new();
        encoder.encode(&rgb, number.is_multiple_of(group), &mut packet).unwrap();
        packet
    };
    (0..n_pictures).map(packet).collect()
}

pub(super) fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let group = |three: &[u8]| {
        let held = three.iter().fold(0_u32, |held, byte| held << 8 | u32::from(*byte)) << (8 * (3 - three.len()));
        let digit = |at: usize| if at <= three.len() { DIGITS[(held >> (18 - 6 * at) & 63) as usize] } else { b'=' };
        [0, 1, 2, 3].map(|at| digit(at) as char)
    };
    bytes.chunks(3).flat_map(group).collect()
}

/// Every file of a folder, by its path in it.
pub(super) fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in std::fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(folder).unwrap().to_string_lossy().into_owned();
                files.insert(name, std::fs::read(path).unwrap());
            }
        }
    }
    files
}
