//! The rows of `ntp/scopes/`: the scoping labels that derive from the spans of calls.

pub(crate) mod check;
