//! `foxglove.FrameTransforms` to and from poses, without values in between.
//!
//! Transforms are most of a recording. The generated type allocates two strings a transform and leaves out fields that
//! equal zero, so that -0.0 would come back as 0.0; this writes and reads the wire form itself.
//!
//! # Units and frames
//!
//! Metres. Each transform is a child's pose in the world. f32 to f64 and back is exact.

use prost::bytes::BufMut as _;
use prost::encoding::{WireType, encode_varint, encoded_len_varint};

use super::error::MessageProblem;
use super::wire;
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
    let head = Head::new(log_time_nanos);
    let child_len = 1 + encoded_len_varint(child.len() as u64) + child.len();
    put_length(TRANSFORMS, head.bytes().len() + child_len + POSE_BYTES, buffer);
    buffer.put_slice(head.bytes());
    put_length(CHILD, child.len(), buffer);
    buffer.put_slice(child.as_bytes());
    // In the order of the fields x, y, z and x, y, z, w.
    put_doubles(TRANSLATION, child_in_world.translation.vector.as_slice(), buffer);
    put_doubles(ROTATION, child_in_world.rotation.coords.as_slice(), buffer);
}

/// Bytes of translation and rotation: a double and its key each, key and length before them.
const POSE_BYTES: usize = (2 + 3 * 9) + (2 + 4 * 9);

/// The fields that all transforms of a message share: timestamp and parent.
struct Head {
    bytes: [u8; 32],
    len: usize,
}

impl Head {
    fn new(log_time_nanos: u64) -> Self {
        let (seconds, nanos) = (log_time_nanos / 1_000_000_000, log_time_nanos % 1_000_000_000);
        let stamp_len = 2 + encoded_len_varint(seconds) + encoded_len_varint(nanos);
        let mut bytes = [0; 32];
        let mut rest = bytes.as_mut_slice();
        rest.put_slice(&[key(TIMESTAMP, WireType::LengthDelimited), stamp_len as u8]);
        for (field, number) in [(1, seconds), (2, nanos)] {
            rest.put_u8(key(field, WireType::Varint));
            encode_varint(number, &mut rest);
        }
        rest.put_slice(&[key(PARENT, WireType::LengthDelimited), WORLD.len() as u8]);
        rest.put_slice(WORLD.as_bytes());
        let len = 32 - rest.len();
        Self { bytes, len }
    }

    fn bytes(&self) -> &[u8] {
        &self.bytes[..self.len]
    }
}

fn key(field: u32, wire_type: WireType) -> u8 {
    (field << 3) as u8 | wire_type as u8
}

fn put_length(field: u32, length: usize, buffer: &mut Vec<u8>) {
    buffer.put_u8(key(field, WireType::LengthDelimited));
    encode_varint(length as u64, buffer);
}

fn put_doubles(field: u32, numbers: &[f32], buffer: &mut Vec<u8>) {
    put_length(field, 9 * numbers.len(), buffer);
    for (number, field) in numbers.iter().zip(1..) {
        buffer.put_u8(key(field, WireType::SixtyFourBit));
        buffer.put_f64_le(f64::from(*number));
    }
}

/// Gives each transform of a `FrameTransforms` to `each`: the child's frame id and its pose in the world.
pub(super) fn decode(
    log_time_nanos: u64,
    mut message: &[u8],
    mut each: impl FnMut(&[u8], Pose) -> Result<(), MessageProblem>,
) -> Result<(), MessageProblem> {
    let head = Head::new(log_time_nanos);
    while !message.is_empty() {
        match wire::key(&mut message)? {
            (TRANSFORMS, WireType::LengthDelimited) => {
                let transform = wire::content(&mut message)?;
                let parts = split_ours(&head, transform).map_or_else(|| split_any(transform), Ok)?;
                each(parts.child, parts.pose()?)?;
            }
            (field, wire_type) => wire::skip(field, wire_type, &mut message)?,
        }
    }
    Ok(())
}

/// A transform taken apart.
#[derive(Default)]
struct Parts<'a> {
    child: &'a [u8],
    translation: [f64; 3],
    rotation: [f64; 4],
}

impl Parts<'_> {
    fn pose(&self) -> Result<Pose, MessageProblem> {
        let [x, y, z, w] = self.rotation.map(|number| number as f32);
        // The stored bits are the state: they must not be normalised again.
        let rotation = Rotation::new_unchecked(nalgebra::Quaternion::new(w, x, y, z));
        if (rotation.norm_squared() - 1.0).abs() < UNIT_TOLERANCE {
            let translation = Vec3::from(self.translation.map(|number| number as f32));
            Ok(Pose::from_parts(translation.into(), rotation))
        } else {
            Err(MessageProblem::NotUnit { frame: text(self.child) })
        }
    }
}

/// A transform as [`encode`] lays it out; `None` when it is laid out otherwise.
fn split_ours<'a>(head: &Head, transform: &'a [u8]) -> Option<Parts<'a>> {
    let rest = transform.strip_prefix(head.bytes())?;
    let (child, pose) = rest.split_last_chunk::<POSE_BYTES>()?;
    let child = match child {
        [CHILD_KEY, length, child @ ..] if *length < 0x80 && usize::from(*length) == child.len() => child,
        _ => return None,
    };
    let (translation, rotation) = pose.split_at(2 + 3 * 9);
    Some(Parts {
        child,
        translation: split_doubles(TRANSLATION, translation)?,
        rotation: split_doubles(ROTATION, rotation)?,
    })
}

const CHILD_KEY: u8 = (CHILD << 3) as u8 | WireType::LengthDelimited as u8;

fn split_doubles<const N: usize>(field: u32, message: &[u8]) -> Option<[f64; N]> {
    let doubles = message.strip_prefix(&[key(field, WireType::LengthDelimited), 9 * N as u8])?;
    let (doubles, _) = doubles.as_chunks::<9>();
    let mut numbers = [0.0; N];
    for ((number, [found, bytes @ ..]), field) in numbers.iter_mut().zip(doubles).zip(1..) {
        if *found != key(field, WireType::SixtyFourBit) {
            return None;
        }
        *number = f64::from_le_bytes(*bytes);
    }
    Some(numbers)
}

/// A transform with its fields in any order.
fn split_any(mut transform: &[u8]) -> Result<Parts<'_>, MessageProblem> {
    let mut parts = Parts::default();
    while !transform.is_empty() {
        match wire::key(&mut transform)? {
            (PARENT, WireType::LengthDelimited) => {
                let parent = wire::content(&mut transform)?;
                if parent != WORLD.as_bytes() {
                    return Err(MessageProblem::UnknownFrame { frame: text(parent) });
                }
            }
            (CHILD, WireType::LengthDelimited) => parts.child = wire::content(&mut transform)?,
            (TRANSLATION, WireType::LengthDelimited) => {
                decode_doubles(wire::content(&mut transform)?, &mut parts.translation)?;
            }
            (ROTATION, WireType::LengthDelimited) => {
                decode_doubles(wire::content(&mut transform)?, &mut parts.rotation)?;
            }
            (field, wire_type) => wire::skip(field, wire_type, &mut transform)?,
        }
    }
    Ok(parts)
}

fn decode_doubles(mut message: &[u8], numbers: &mut [f64]) -> Result<(), MessageProblem> {
    while !message.is_empty() {
        let (field, wire_type) = wire::key(&mut message)?;
        match (numbers.get_mut(field as usize - 1), wire_type) {
            (Some(number), WireType::SixtyFourBit) => *number = f64::from_le_bytes(wire::bytes(&mut message)?),
            _ => wire::skip(field, wire_type, &mut message)?,
        }
    }
    Ok(())
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
        // The last one leaves out what is zero, and at another time none is as it would be laid out here.
        for (message, log_time_nanos) in
            [(&message.encode_to_vec(), 3_000_000_007), (&buffer, 3_000_000_007), (&buffer, 8)]
        {
            let mut again = Vec::new();
            decode(log_time_nanos, message, |child, pose| {
                encode(3_000_000_007, std::str::from_utf8(child).unwrap(), &pose, &mut again);
                Ok(())
            })
            .unwrap();
            assert_eq!(again, buffer);
        }
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
        decode(0, &buffer, |_, pose| {
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
