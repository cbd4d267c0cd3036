//! NTP in burn: encoders, interpreter, core, program memory, argument decoder.
