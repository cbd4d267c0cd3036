//! `foxglove.FrameTransforms` to and from poses, without values in between.
//!
//! Transforms are most of a recording. The generated type allocates two strings a transform and leaves out fields that
//! equal zero, so that -0.0 would come back as 0.0; this writes and reads the wire form itself.
//!
//! # Units and frames
//!
//! Metres. Each transform is a child's pose in the world. f32 to f64 and back is exact.

use prost::bytes::{Buf as _, BufMut as _};
use prost::encoding::{
    DecodeContext, WireType, decode_key, decode_varint, encode_varint, encoded_len_varint, skip_field,
};

use super::error::MessageProblem;
use crate::geometry::{Pose, Rotation, Vec3};

/// The frame id of the world.
pub(super) const WORLD: &str = "world";
/// The frame id of the gripper.
pub(super) const GRIPPER: &str = "gripper";

/// How far the square of a rotation's norm may be from one.
const UNIT_TOLERANCE: f32 = 1e-3;

/// Field numbers of `FrameTransforms`, `FrameTransform`, `Timestamp`.
const TRANSFORMS: u32 = 1;
const TIMESTAMP: u32 = 1;
const PARENT: u32 = 2;
const CHILD: u32 = 3;
const TRANSLATION: u32 = 4;
const ROTATION: u32 = 5;

/// Writes a transform behind those that are there: any number of them, one after the other, is a `FrameTransforms`.
pub(super) fn encode(log_time_nanos: u64, child: &str, child_in_world: &Pose, buffer: &mut Vec<u8>) {
    let (seconds, nanos) = (log_time_nanos / 1_000_000_000, log_time_nanos % 1_000_000_000);
    let stamp_len = 2 + encoded_len_varint(seconds) + encoded_len_varint(nanos);
    let text_len = |text: &str| 1 + encoded_len_varint(text.len() as u64) + text.len();
    let length = 2 + stamp_len + text_len(WORLD) + text_len(child) + (2 + 3 * 9) + (2 + 4 * 9);
    put_length(TRANSFORMS, length, buffer);
    put_length(TIMESTAMP, stamp_len, buffer);
    for (field, number) in [(1, seconds), (2, nanos)] {
        put_key(field, WireType::Varint, buffer);
        encode_varint(number, buffer);
    }
    for (field, text) in [(PARENT, WORLD), (CHILD, child)] {
        put_length(field, text.len(), buffer);
        buffer.put_slice(text.as_bytes());
    }
    // In the order of the fields x, y, z and x, y, z, w.
    put_doubles(TRANSLATION, child_in_world.translation.vector.as_slice(), buffer);
    put_doubles(ROTATION, child_in_world.rotation.coords.as_slice(), buffer);
}

fn put_key(field: u32, wire_type: WireType, buffer: &mut Vec<u8>) {
    buffer.put_u8((field << 3) as u8 | wire_type as u8);
}

fn put_length(field: u32, length: usize, buffer: &mut Vec<u8>) {
    put_key(field, WireType::LengthDelimited, buffer);
    encode_varint(length as u64, buffer);
}

fn put_doubles(field: u32, numbers: &[f32], buffer: &mut Vec<u8>) {
    put_length(field, 9 * numbers.len(), buffer);
    for (number, field) in numbers.iter().zip(1..) {
        put_key(field, WireType::SixtyFourBit, buffer);
        buffer.put_f64_le(f64::from(*number));
    }
}

/// Gives each transform of a `FrameTransforms` to `each`: the child's frame id and its pose in the world.
pub(super) fn decode(
    mut message: &[u8],
    mut each: impl FnMut(&[u8], Pose) -> Result<(), MessageProblem>,
) -> Result<(), MessageProblem> {
    while !message.is_empty() {
        match decode_key(&mut message)? {
            (TRANSFORMS, WireType::LengthDelimited) => {
                let (child, pose) = decode_transform(take(&mut message)?)?;
                each(child, pose)?;
            }
            (field, wire_type) => skip_field(wire_type, field, &mut message, DecodeContext::default())?,
        }
    }
    Ok(())
}

fn decode_transform(mut message: &[u8]) -> Result<(&[u8], Pose), MessageProblem> {
    let mut child: &[u8] = &[];
    let mut translation = [0.0; 3];
    let mut rotation = [0.0; 4];
    while !message.is_empty() {
        match decode_key(&mut message)? {
            (PARENT, WireType::LengthDelimited) => {
                let parent = take(&mut message)?;
                if parent != WORLD.as_bytes() {
                    return Err(MessageProblem::UnknownFrame { frame: text(parent) });
                }
            }
            (CHILD, WireType::LengthDelimited) => child = take(&mut message)?,
            (TRANSLATION, WireType::LengthDelimited) => decode_doubles(take(&mut message)?, &mut translation)?,
            (ROTATION, WireType::LengthDelimited) => decode_doubles(take(&mut message)?, &mut rotation)?,
            (field, wire_type) => skip_field(wire_type, field, &mut message, DecodeContext::default())?,
        }
    }
    let [x, y, z, w] = rotation;
    // The stored bits are the state: they must not be normalised again.
    let rotation = Rotation::new_unchecked(nalgebra::Quaternion::new(w, x, y, z));
    if (rotation.norm_squared() - 1.0).abs() < UNIT_TOLERANCE {
        Ok((child, Pose::from_parts(Vec3::from(translation).into(), rotation)))
    } else {
        Err(MessageProblem::NotUnit { frame: text(child) })
    }
}

fn decode_doubles(mut message: &[u8], numbers: &mut [f32]) -> Result<(), MessageProblem> {
    // As written here, all of them are there in their order.
    let (parts, rest) = message.as_chunks::<9>();
    let is_ours = |(part, field): (&[u8; 9], u8)| part[0] == (field << 3) | WireType::SixtyFourBit as u8;
    if rest.is_empty() && parts.len() == numbers.len() && parts.iter().zip(1..).all(is_ours) {
        for (number, [_key, bytes @ ..]) in numbers.iter_mut().zip(parts) {
            *number = f64::from_le_bytes(*bytes) as f32;
        }
        return Ok(());
    }
    while !message.is_empty() {
        let (field, wire_type) = decode_key(&mut message)?;
        match (numbers.get_mut(field as usize - 1), wire_type) {
            (Some(number), WireType::SixtyFourBit) => {
                *number = message.try_get_f64_le().map_err(|_error| MessageProblem::CutOff)? as f32;
            }
            _ => skip_field(wire_type, field, &mut message, DecodeContext::default())?,
        }
    }
    Ok(())
}

/// The content of a length-delimited field, off the front of a message.
fn take<'a>(message: &mut &'a [u8]) -> Result<&'a [u8], MessageProblem> {
    let length = usize::try_from(decode_varint(message)?).map_err(|_error| MessageProblem::CutOff)?;
    let (field, rest) = message.split_at_checked(length).ok_or(MessageProblem::CutOff)?;
    *message = rest;
    Ok(field)
}

/// A frame id for an error message.
pub(super) fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[cfg(test)]
mod tests {
    use prost::Message as _;

    use super::super::schema::foxglove::FrameTransforms;
    use super::{decode, encode};
    use crate::geometry::{Pose, Rotation, Vec3};

    fn pose(x: f32, y: f32, z: f32) -> Pose {
        Pose::from_parts(Vec3::new(x, y, z).into(), Rotation::from_euler_angles(0.1, -0.2, 0.3))
    }

    #[test]
    fn the_generated_type_reads_what_is_written() {
        let mut buffer = Vec::new();
        encode(3_000_000_007, "gripper", &pose(0.1, 0.2, 0.3), &mut buffer);
        encode(3_000_000_007, &"a long name ".repeat(20), &pose(1.0, 0.0, -1.0), &mut buffer);
        let message = FrameTransforms::decode(buffer.as_slice()).unwrap();
        assert_eq!(message.transforms.len(), 2);
        let first = &message.transforms[0];
        assert_eq!((first.parent_frame_id.as_str(), first.child_frame_id.as_str()), ("world", "gripper"));
        let stamp = first.timestamp.unwrap();
        assert_eq!((stamp.seconds, stamp.nanos), (3, 7));
        assert_eq!(first.translation.unwrap().y, f64::from(0.2_f32));
        assert_eq!(first.rotation.unwrap().w, f64::from(pose(0.0, 0.0, 0.0).rotation.w));
        let mut again = Vec::new();
        decode(&message.encode_to_vec(), |child, pose| {
            encode(3_000_000_007, std::str::from_utf8(child).unwrap(), &pose, &mut again);
            Ok(())
        })
        .unwrap();
        assert_eq!(again, buffer);
    }

    #[test]
    fn poses_come_back_bit_for_bit() {
        let written = Pose::from_parts(
            Vec3::new(-0.0, f32::MIN_POSITIVE, 1.0e-45).into(),
            Rotation::new_unchecked(nalgebra::Quaternion::new(-1.0, -0.0, 0.0, -0.0)),
        );
        let mut buffer = Vec::new();
        encode(0, "a", &written, &mut buffer);
        let mut found = Vec::new();
        decode(&buffer, |_, pose| {
            found.extend(
                pose.translation.vector.iter().chain(pose.rotation.coords.iter()).map(|number| number.to_bits()),
            );
            Ok(())
        })
        .unwrap();
        let numbers = written.translation.vector.iter().chain(written.rotation.coords.iter());
        assert_eq!(found, numbers.map(|number| number.to_bits()).collect::<Vec<_>>());
    }
}
