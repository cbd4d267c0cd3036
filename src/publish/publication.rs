//! What only the publisher can say: licence, day, name, creators, address, release.

use std::fmt;
use std::str::FromStr;

use crate::date::Date;
use crate::publish::License;

/// What only the publisher can say.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Publication {
    /// Under which licence.
    pub license: License,
    /// On which day.
    pub date: Date,
    /// What it is called.
    pub name: String,
    /// Whose it is; when empty the project's, if the project made it.
    pub creators: Vec<String>,
    /// Where it can be found.
    pub url: Option<String>,
    /// Which release it is.
    pub release: Release,
}

/// A semantic version: major when rows changed their meaning, minor when some were added, patch when only the
/// packaging changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Release {
    major: u32,
    minor: u32,
    patch: u32,
}

/// A text is no release.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{found:?} is no release of the form MAJOR.MINOR.PATCH, such as 1.0.0")]
pub struct NoRelease {
    found: String,
}

impl FromStr for Release {
    type Err = NoRelease;

    fn from_str(text: &str) -> Result<Self, NoRelease> {
        let number = |part: &str| {
            let is_plain = !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit());
            is_plain.then(|| part.parse::<u32>().ok()).flatten()
        };
        let parts: Vec<Option<u32>> = text.split('.').map(number).collect();
        match parts[..] {
            [Some(major), Some(minor), Some(patch)] => Ok(Self { major, minor, patch }),
            _ => Err(NoRelease { found: text.to_owned() }),
        }
    }
}

impl fmt::Display for Release {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}.{}", self.major, self.minor, self.patch)
    }
}

impl Publication {
    /// `owner/name` of an address at the Hugging Face hub.
    pub(super) fn repository(&self) -> Option<&str> {
        let rest = self.url.as_deref()?.strip_prefix("https://huggingface.co/datasets/")?.trim_end_matches('/');
        let is_name = |part: &str| {
            !part.is_empty() && part.chars().all(|letter| letter.is_ascii_alphanumeric() || "._-".contains(letter))
        };
        (rest.split('/').count() == 2 && rest.split('/').all(is_name)).then_some(rest)
    }

    /// The name as a folder, a pipeline and a citation can have it.
    pub(super) fn slug(&self) -> String {
        let plain = self.name.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' });
        let words: String = plain.collect();
        let words: Vec<&str> = words.split('-').filter(|word| !word.is_empty()).collect();
        let mut slug = words.join("-");
        slug.truncate(48);
        if slug.is_empty() { "dataset".to_owned() } else { slug }
    }
}
