//! What sizes of a network may be. A file that says otherwise is refused before anything is made of it.

/// The largest size: products of a few of them still fit a machine word.
const LARGEST: usize = 65_536;
/// The longest kernel.
const LONGEST: usize = 1001;
/// The most cameras that a network sees with.
pub(crate) const MOST_CAMERAS: usize = 16;

/// A configuration that makes no sense.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{key} is {found}; allowed: {allowed}")]
pub struct ConfigError {
    /// Its key.
    pub key: &'static str,
    /// As found.
    pub found: String,
    /// What is allowed.
    pub allowed: &'static str,
}

impl ConfigError {
    /// Refuses a value unless it fits.
    pub(crate) fn unless(
        fits: bool,
        key: &'static str,
        found: impl ToString,
        allowed: &'static str,
    ) -> Result<(), Self> {
        if fits { Ok(()) } else { Err(Self { key, found: found.to_string(), allowed }) }
    }
}

/// Refuses sizes that no network has.
pub(crate) fn check_sizes(sizes: &[(&'static str, usize)]) -> Result<(), ConfigError> {
    let fits = |&(key, size): &(&'static str, usize)| {
        ConfigError::unless((1..=LARGEST).contains(&size), key, size, "1 to 65536")
    };
    sizes.iter().try_for_each(fits)
}

/// Refuses kernels that have no middle.
pub(crate) fn check_kernels(kernels: &[(&'static str, usize)]) -> Result<(), ConfigError> {
    let fits = |&(key, kernel): &(&'static str, usize)| {
        ConfigError::unless(kernel % 2 == 1 && kernel <= LONGEST, key, kernel, "odd, 1 to 1001")
    };
    kernels.iter().try_for_each(fits)
}

/// Refuses numbers of cameras that no network sees with.
pub(crate) fn check_cameras(cameras: usize) -> Result<(), ConfigError> {
    ConfigError::unless((1..=MOST_CAMERAS).contains(&cameras), "cameras", cameras, "1 to 16")
}

/// How many cameras see where none are counted.
pub(crate) fn one_camera() -> usize {
    1
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes fields by reference")]
pub(crate) fn is_one_camera(cameras: &usize) -> bool {
    *cameras == 1
}
