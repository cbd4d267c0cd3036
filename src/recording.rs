//! Episodes to and from MCAP.
