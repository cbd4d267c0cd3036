//! How long the long tests are: short as part of the suite, longer when asked for.

/// A number from the environment, or that of the suite.
#[expect(clippy::disallowed_methods, reason = "the length of a test is no setting of the program")]
pub(crate) fn from_environment(name: &str, in_suite: u64) -> u64 {
    std::env::var(name).map_or(in_suite, |text| text.parse().unwrap_or_else(|_| panic!("{name} is {text:?}")))
}

/// Says what a long test found; cargo shows it with `--nocapture`.
#[expect(clippy::print_stderr, reason = "figures of a long test are for whoever asked for it")]
pub(crate) fn tell(text: &str) {
    eprintln!("{text}");
}
