//! `schemas/mcap` against the schemas that recordings carry.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use mcap::records::Record;
use ntp::recording::ShardWriter;
use ntp::render::{CameraConfig, PictureFormat, Viewpoint};
use ntp::task::Split;
use ntp::trace::Episode;
use prost::Message;

use crate::kinematic::{demonstration, tower, trial};

/// As much of protobuf's own `descriptor.proto` as is looked into.
#[derive(Clone, PartialEq, Message)]
struct FileDescriptorSet {
    #[prost(message, repeated, tag = "1")]
    file: Vec<FileDescriptor>,
}

#[derive(Clone, PartialEq, Message)]
struct FileDescriptor {
    #[prost(string, tag = "1")]
    name: String,
    #[prost(string, tag = "2")]
    package: String,
    #[prost(string, repeated, tag = "3")]
    dependency: Vec<String>,
    #[prost(message, repeated, tag = "4")]
    message_type: Vec<Descriptor>,
}

#[derive(Clone, PartialEq, Message)]
struct Descriptor {
    #[prost(string, tag = "1")]
    name: String,
    #[prost(message, repeated, tag = "2")]
    field: Vec<FieldDescriptor>,
}

#[derive(Clone, PartialEq, Message)]
struct FieldDescriptor {
    #[prost(string, tag = "1")]
    name: String,
    #[prost(int32, tag = "3")]
    number: i32,
    #[prost(string, tag = "6")]
    type_name: String,
}

/// Name, encoding and data of each schema in a recording of a robot with an arm.
fn schemas_of_a_recording() -> BTreeMap<String, (String, Vec<u8>)> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("shard.mcap");
    let task = tower("two", &[1, 3], Split::Seen);
    let formats = [PictureFormat::Png, PictureFormat::H264].into_iter().zip([Viewpoint::Front, Viewpoint::Wrist]);
    let cameras: Vec<CameraConfig> =
        formats.map(|(format, view)| CameraConfig { format, ..CameraConfig::new(view, [16, 16]) }).collect();
    let mut writer = ShardWriter::create(&path, "{}").unwrap().with_cameras(&cameras);
    let mut parts = demonstration(&task, &trial(&task, 0, 1), 0).into_parts();
    parts.frames.iter_mut().for_each(|frame| frame.state.joints_rad = Some([0.5; 7]));
    writer.write(&Episode::new(parts).unwrap()).unwrap();
    writer.finish().unwrap();
    let bytes = fs::read(&path).unwrap();
    let records = mcap::read::ChunkFlattener::new(&bytes).unwrap().map(Result::unwrap);
    let schemas = records.filter_map(|record| match record {
        Record::Schema { header, data } => Some((header.name, (header.encoding, data.into_owned()))),
        _ => None,
    });
    schemas.collect()
}

fn descriptors() -> BTreeMap<String, FileDescriptorSet> {
    let decode =
        |(name, (_, data)): (String, (String, Vec<u8>))| (name, FileDescriptorSet::decode(data.as_slice()).unwrap());
    schemas_of_a_recording().into_iter().map(decode).collect()
}

fn proto_files() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("schemas/mcap");
    let mut files: Vec<PathBuf> = ["foxglove", "ntp/v1"]
        .iter()
        .flat_map(|folder| fs::read_dir(root.join(folder)).unwrap())
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "proto"))
        .collect();
    files.sort();
    files
}

/// Full names of the messages that a file declares at its top level.
fn declared(text: &str) -> Vec<String> {
    let package = text.lines().find_map(|line| line.strip_prefix("package ")).unwrap().trim_end_matches(';');
    let names = text.lines().filter_map(|line| line.strip_prefix("message ")?.strip_suffix(" {"));
    names.map(|name| format!("{package}.{name}")).collect()
}

#[test]
fn every_schema_is_protobuf_and_declared_in_schemas() {
    let declared: BTreeSet<String> =
        proto_files().iter().flat_map(|path| declared(&fs::read_to_string(path).unwrap())).collect();
    let schemas = schemas_of_a_recording();
    assert_eq!(schemas.len(), 15);
    for (name, (encoding, _)) in &schemas {
        assert_eq!(encoding, "protobuf");
        assert!(declared.contains(name), "{name} is in no file of schemas/mcap");
    }
}

#[test]
fn every_file_of_schemas_is_used_by_a_recording() {
    let used: BTreeSet<String> = descriptors().into_values().flat_map(|set| set.file).map(|file| file.name).collect();
    for path in proto_files() {
        let text = path.to_string_lossy().into_owned();
        let (_, relative) = text.split_once("schemas/mcap/").unwrap();
        assert!(used.contains(relative), "no message of a recording needs {relative}");
    }
}

#[test]
fn every_schema_stands_alone() {
    for (name, set) in descriptors() {
        let mut seen = BTreeSet::new();
        let mut messages = BTreeSet::new();
        for file in &set.file {
            for dependency in &file.dependency {
                assert!(seen.contains(dependency), "{name}: {} comes before its import {dependency}", file.name);
            }
            seen.insert(file.name.clone());
            messages.extend(file.message_type.iter().map(|message| format!("{}.{}", file.package, message.name)));
        }
        assert!(messages.contains(&name), "{name} is not in its own schema");
    }
}

#[test]
fn field_numbers_are_those_of_the_first_version() {
    let fields: Vec<String> = descriptors()
        .into_iter()
        .filter(|(name, _)| name.starts_with("ntp."))
        .flat_map(|(name, set)| {
            let short = name.rsplit('.').next().unwrap_or_default().to_owned();
            let messages = set.file.into_iter().flat_map(|file| file.message_type);
            messages.filter(move |message| message.name == short)
        })
        .map(|message| {
            let fields = message.field.iter().map(|field| format!("{}={}", field.name, field.number));
            format!("{}: {}", message.name, fields.collect::<Vec<_>>().join(" "))
        })
        .collect();
    let expected = [
        "EpisodeEnd: index=1 success=2 cause=3 frames=4 boundary_frames=5 calls=6 pushes=7",
        "EpisodeStart: index=1 family=2 task_id=3 task_text=4 split=5 trial=6 seed=7 counts=8 policy=9 scene=10 \
         specification_frames=11",
        "Observation: frame=1 boundary=2 opening_m=3 held=4 slots=5 slot_positions_m=6",
        "ProgramCall: call=1 caller=2 depth=3 step=4 program=5 argument=6 input=7 output=8 frame=9 end_of_program=10 \
         prediction=11",
        "ProgramReturn: call=1 program=2 frame=3",
        "ProgramStack: running=1 depth_0=2 depth_1=3 depth_2=4 depth_3=5",
        "Push: frames=1 body=2 impulse_x_ns=3 impulse_y_ns=4 impulse_z_ns=5 toppled=6",
    ];
    assert_eq!(fields, expected);
}

#[test]
fn every_field_and_value_of_ours_is_documented() {
    let ours = proto_files().into_iter().filter(|path| path.to_string_lossy().contains("ntp/v1"));
    for path in ours {
        let text = fs::read_to_string(&path).unwrap();
        let lines: Vec<&str> = text.lines().map(str::trim).collect();
        for pair in lines.windows(2) {
            let declares = (pair[1].ends_with(';') && pair[1].contains(" = ")) || pair[1].ends_with('{');
            let is_documented = pair[0].starts_with("//") || pair[1].starts_with("syntax");
            assert!(!declares || is_documented, "{}: {:?} has no comment", path.display(), pair[1]);
        }
    }
}
