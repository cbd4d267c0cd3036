//! Pushes of an adversary to and from `ntp.v1.Push`.

use super::calls::decode_span;
use super::error::MessageProblem;
use super::schema::proto;
use super::start::narrow;
use crate::scene::BodyIndex;
use crate::trace::{Push, Span};

pub(super) fn encode(push: &Push) -> proto::Push {
    let Push { frames: Span { begin, end }, body, impulse_ns: [impulse_x_ns, impulse_y_ns, impulse_z_ns], toppled } =
        push;
    proto::Push {
        frames: Some(proto::Span { begin: *begin, end: *end }),
        body: body.0.into(),
        impulse_x_ns: *impulse_x_ns,
        impulse_y_ns: *impulse_y_ns,
        impulse_z_ns: *impulse_z_ns,
        toppled: toppled.iter().map(|body| body.0.into()).collect(),
    }
}

pub(super) fn decode(message: proto::Push) -> Result<Push, MessageProblem> {
    let proto::Push { frames, body, impulse_x_ns, impulse_y_ns, impulse_z_ns, toppled } = message;
    let toppled = toppled.into_iter().map(|body| narrow("toppled", body).map(BodyIndex));
    Ok(Push {
        frames: decode_span(&frames.ok_or(MessageProblem::Missing { field: "frames" })?)?,
        body: BodyIndex(narrow("body", body)?),
        impulse_ns: [impulse_x_ns, impulse_y_ns, impulse_z_ns],
        toppled: toppled.collect::<Result<_, _>>()?,
    })
}
