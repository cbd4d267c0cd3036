//! Progress of long work on stderr: bars with ETA on a terminal, plain lines elsewhere.
