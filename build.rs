//! Compiles `schemas/mcap` into Rust types and, for each message type that recordings name, a descriptor set.
//!
//! No `protoc`: `protox` is a compiler of `.proto` in Rust.

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

const ROOT: &str = "schemas/mcap";

/// Message types that a channel of a recording may carry, and the files that declare them.
const MESSAGES: [(&str, &str); 14] = [
    ("foxglove.CameraCalibration", "foxglove/CameraCalibration.proto"),
    ("foxglove.CompressedImage", "foxglove/CompressedImage.proto"),
    ("foxglove.CompressedVideo", "foxglove/CompressedVideo.proto"),
    ("foxglove.Event", "foxglove/Event.proto"),
    ("foxglove.FrameTransforms", "foxglove/FrameTransforms.proto"),
    ("foxglove.Log", "foxglove/Log.proto"),
    ("foxglove.SceneUpdate", "foxglove/SceneUpdate.proto"),
    ("ntp.v1.EpisodeEnd", "ntp/v1/episode_end.proto"),
    ("ntp.v1.EpisodeStart", "ntp/v1/episode_start.proto"),
    ("ntp.v1.Observation", "ntp/v1/observation.proto"),
    ("ntp.v1.ProgramCall", "ntp/v1/program_call.proto"),
    ("ntp.v1.ProgramReturn", "ntp/v1/program_return.proto"),
    ("ntp.v1.ProgramStack", "ntp/v1/program_stack.proto"),
    ("ntp.v1.Push", "ntp/v1/push.proto"),
];

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed={ROOT}");
    println!("cargo:rerun-if-changed=build.rs");
    let out = PathBuf::from(std::env::var_os("OUT_DIR").ok_or("cargo sets OUT_DIR")?);
    generate_types()?;
    write_descriptors(&out.join("descriptors"))
}

fn generate_types() -> Result<(), Box<dyn Error>> {
    let files = MESSAGES.map(|(_, file)| file);
    let descriptors = protox::compile(files, [ROOT])?;
    prost_build::Config::new()
        .compile_well_known_types()
        // Its comments hold formulas, which would be taken for examples to run.
        .disable_comments([".foxglove.CameraCalibration"])
        .include_file("schemas.rs")
        .compile_fds(descriptors)?;
    Ok(())
}

/// One self-contained descriptor set a message type, as MCAP wants it: the file and all that it imports.
fn write_descriptors(folder: &Path) -> Result<(), Box<dyn Error>> {
    fs::create_dir_all(folder)?;
    for (message, file) in MESSAGES {
        let mut compiler = protox::Compiler::new([ROOT])?;
        compiler.include_imports(true).include_source_info(false).open_file(file)?;
        fs::write(folder.join(format!("{message}.binpb")), compiler.encode_file_descriptor_set())?;
    }
    Ok(())
}
