//! Compiles `schemas/mcap` into Rust types and, for each message type that recordings name, its descriptor sets.
//!
//! No `protoc`: `protox` is a compiler of `.proto` in Rust.

use std::error::Error;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use protox::prost::Message as _;
use protox::prost_reflect::prost_types::{EnumValueDescriptorProto, FileDescriptorSet};

const ROOT: &str = "schemas/mcap";

/// As many programs as the first recordings knew. The enum of programs only ever grows at its end, and a recording
/// declares no more of them than its family needs: see `program::KnownPrograms`.
const FIRST_PROGRAMS: i32 = 12;
const PROGRAMS: &str = "Program";

/// Message types that a channel of a recording may carry, and the files that declare them.
const MESSAGES: [(&str, &str); 15] = [
    ("foxglove.CameraCalibration", "foxglove/CameraCalibration.proto"),
    ("foxglove.CompressedImage", "foxglove/CompressedImage.proto"),
    ("foxglove.CompressedVideo", "foxglove/CompressedVideo.proto"),
    ("foxglove.Event", "foxglove/Event.proto"),
    ("foxglove.FrameTransforms", "foxglove/FrameTransforms.proto"),
    ("foxglove.JointStates", "foxglove/JointStates.proto"),
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
    write_descriptors(&out)
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

/// The self-contained descriptor set of each message type, as MCAP wants it: the file and all that it imports. One for
/// each number of programs that a recording may know; `descriptors.rs` is the table of them.
fn write_descriptors(out: &Path) -> Result<(), Box<dyn Error>> {
    fs::create_dir_all(out.join("descriptors"))?;
    let mut table = String::from("&[");
    for (message, file) in MESSAGES {
        let mut compiler = protox::Compiler::new([ROOT])?;
        compiler.include_imports(true).include_source_info(false).open_file(file)?;
        let mut all = compiler.file_descriptor_set();
        let n_programs = programs(&mut all).map(|values| values.len() as i32 - 1).max();
        for n in FIRST_PROGRAMS..=n_programs.unwrap_or(FIRST_PROGRAMS) {
            let mut known = all.clone();
            programs(&mut known).for_each(|values| values.retain(|value| value.number() <= n));
            let name = format!("descriptors/{message}.{n}.binpb");
            fs::write(out.join(&name), known.encode_to_vec())?;
            write!(table, "({message:?}, {n}, include_bytes!(concat!(env!(\"OUT_DIR\"), \"/{name}\"))),")?;
        }
    }
    table.push(']');
    Ok(fs::write(out.join("descriptors.rs"), table)?)
}

/// The values of the enum of programs in each file that declares it: `IDLE`, then one a program.
fn programs(set: &mut FileDescriptorSet) -> impl Iterator<Item = &mut Vec<EnumValueDescriptorProto>> {
    let enums = set.file.iter_mut().filter(|file| file.package() == "ntp.v1").flat_map(|file| &mut file.enum_type);
    enums.filter(|declared| declared.name() == PROGRAMS).map(|declared| &mut declared.value)
}
