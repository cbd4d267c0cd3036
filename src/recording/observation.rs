//! `ntp.v1.Observation` to and from what a frame is beside its poses.
//!
//! There is one a frame, and a reader needs less of it than its generated type holds; so it is read field by field.

use prost::encoding::WireType;

use super::error::MessageProblem;
use super::schema::proto;
use super::wire;
use crate::scene::BodyIndex;
use crate::trace::Frame;

/// Field numbers.
const FRAME: u32 = 1;
const BOUNDARY: u32 = 2;
const OPENING: u32 = 3;
const HELD: u32 = 4;
const SLOTS: u32 = 5;

/// What a reader needs of an observation.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Observed {
    pub(super) frame: u32,
    pub(super) boundary: bool,
    pub(super) opening_m: f32,
    pub(super) held: Option<BodyIndex>,
    pub(super) slots: Vec<BodyIndex>,
}

pub(super) fn encode(position: u32, frame: &Frame) -> proto::Observation {
    let Frame { time_nanos: _, boundary, state, slots } = frame;
    let slot_positions_m = if *boundary { frame.observation().slots_m.into_flattened() } else { Vec::new() };
    proto::Observation {
        frame: position,
        boundary: *boundary,
        opening_m: state.opening_m,
        held: state.held.map(|body| u32::from(body.0)),
        slots: slots.iter().map(|body| u32::from(body.0)).collect(),
        slot_positions_m,
    }
}

/// Reads an observation in the place of the one before, whose memory it takes over.
pub(super) fn decode(mut message: &[u8], observed: &mut Observed) -> Result<(), MessageProblem> {
    let mut slots = std::mem::take(&mut observed.slots);
    slots.clear();
    *observed = Observed { slots, ..Observed::default() };
    while !message.is_empty() {
        match wire::key(&mut message)? {
            (FRAME, WireType::Varint) => observed.frame = narrow("frame", wire::varint(&mut message)?)?,
            (BOUNDARY, WireType::Varint) => observed.boundary = wire::varint(&mut message)? != 0,
            (OPENING, WireType::ThirtyTwoBit) => observed.opening_m = f32::from_le_bytes(wire::bytes(&mut message)?),
            (HELD, WireType::Varint) => observed.held = Some(body("held body", wire::varint(&mut message)?)?),
            (SLOTS, WireType::LengthDelimited) => {
                let mut packed = wire::content(&mut message)?;
                while !packed.is_empty() {
                    observed.slots.push(body("body of a slot", wire::varint(&mut packed)?)?);
                }
            }
            (SLOTS, WireType::Varint) => observed.slots.push(body("body of a slot", wire::varint(&mut message)?)?),
            (field, wire_type) => wire::skip(field, wire_type, &mut message)?,
        }
    }
    Ok(())
}

fn body(field: &'static str, number: u64) -> Result<BodyIndex, MessageProblem> {
    narrow(field, number).map(BodyIndex)
}

fn narrow<T: TryFrom<u64>>(field: &'static str, found: u64) -> Result<T, MessageProblem> {
    T::try_from(found).map_err(|_error| MessageProblem::OutOfRange { field, found })
}

#[cfg(test)]
mod tests {
    use prost::Message as _;

    use super::super::schema::proto;
    use super::{BodyIndex, MessageProblem, Observed};

    fn decode(message: &[u8]) -> Result<Observed, MessageProblem> {
        let before =
            Observed { boundary: true, held: Some(BodyIndex(3)), slots: vec![BodyIndex(9)], ..Observed::default() };
        let mut observed = before;
        super::decode(message, &mut observed).map(|()| observed)
    }

    #[test]
    fn what_the_generated_type_writes_is_read() {
        let message = proto::Observation {
            frame: 300,
            boundary: true,
            opening_m: 0.07,
            held: Some(0),
            slots: vec![0, 7, 200],
            slot_positions_m: vec![0.5; 9],
        };
        let expected = Observed {
            frame: 300,
            boundary: true,
            opening_m: 0.07,
            held: Some(BodyIndex(0)),
            slots: vec![BodyIndex(0), BodyIndex(7), BodyIndex(200)],
        };
        assert_eq!(decode(&message.encode_to_vec()), Ok(expected));
        assert_eq!(decode(&[]), Ok(Observed::default()));
    }

    #[test]
    fn numbers_that_are_not_packed_are_read() {
        assert_eq!(decode(&[0x28, 4, 0x28, 5]).unwrap().slots, [BodyIndex(4), BodyIndex(5)]);
    }
}
