//! The wire form of protobuf, field by field, for the messages that are too many for their generated types.
//!
//! # Source
//!
//! <https://protobuf.dev/programming-guides/encoding>.

use prost::encoding::{DecodeContext, WireType, decode_varint, skip_field};

use super::error::MessageProblem;

/// Takes a number off the front of a message.
#[inline]
pub(super) fn varint(message: &mut &[u8]) -> Result<u64, MessageProblem> {
    match message.split_first() {
        Some((&byte, rest)) if byte < 0x80 => {
            *message = rest;
            Ok(u64::from(byte))
        }
        _ => Ok(decode_varint(message)?),
    }
}

/// Takes a field's number and wire type.
#[inline]
pub(super) fn key(message: &mut &[u8]) -> Result<(u32, WireType), MessageProblem> {
    let key = varint(message)?;
    let out_of_range = MessageProblem::OutOfRange { field: "field number", found: key >> 3 };
    let field = u32::try_from(key >> 3).ok().filter(|&field| field > 0).ok_or(out_of_range)?;
    Ok((field, WireType::try_from(key & 7)?))
}

/// Takes the content of a length-delimited field.
#[inline]
pub(super) fn content<'a>(message: &mut &'a [u8]) -> Result<&'a [u8], MessageProblem> {
    let length = usize::try_from(varint(message)?).map_err(|_error| MessageProblem::CutOff)?;
    let (content, rest) = message.split_at_checked(length).ok_or(MessageProblem::CutOff)?;
    *message = rest;
    Ok(content)
}

/// Takes a fixed number of bytes.
#[inline]
pub(super) fn bytes<const N: usize>(message: &mut &[u8]) -> Result<[u8; N], MessageProblem> {
    let (bytes, rest) = message.split_first_chunk().ok_or(MessageProblem::CutOff)?;
    *message = rest;
    Ok(*bytes)
}

/// Takes a field that nobody asks for.
pub(super) fn skip(field: u32, wire_type: WireType, message: &mut &[u8]) -> Result<(), MessageProblem> {
    Ok(skip_field(wire_type, field, message, DecodeContext::default())?)
}
