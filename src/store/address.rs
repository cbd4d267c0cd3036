//! Places as they are written: a folder, or `s3://BUCKET[/PREFIX]`.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

use crate::store::{Folder, Store, StoreError};

/// A place as it is written on the command line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StoreAddress {
    /// A folder.
    Folder(PathBuf),
    /// A place in a bucket of an S3-compatible store.
    Bucket(BucketUrl),
}

/// `s3://BUCKET[/PREFIX]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BucketUrl {
    /// The bucket's name.
    pub bucket: String,
    /// What the names of all files begin with, without `/` at its ends; empty for none.
    pub prefix: String,
}

/// A text is no place.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{found:?} is no place for files; allowed: a folder, or s3://BUCKET[/PREFIX] without . and .. in it")]
pub struct AddressError {
    found: String,
}

impl FromStr for StoreAddress {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        let wrong = || AddressError { found: text.to_owned() };
        let Some((scheme, rest)) = text.split_once("://") else {
            return if text.is_empty() { Err(wrong()) } else { Ok(Self::Folder(text.into())) };
        };
        let (bucket, prefix) = rest.split_once('/').unwrap_or((rest, ""));
        let prefix = prefix.trim_end_matches('/');
        let is_name = |part: &str| !["", ".", ".."].contains(&part) && !part.chars().any(char::is_control);
        let is_bucket = is_name(bucket) && bucket.chars().all(|c| c.is_ascii_alphanumeric() || "-._".contains(c));
        if scheme != "s3" || !is_bucket || !(prefix.is_empty() || prefix.split('/').all(is_name)) {
            return Err(wrong());
        }
        Ok(Self::Bucket(BucketUrl { bucket: bucket.to_owned(), prefix: prefix.to_owned() }))
    }
}

impl fmt::Display for BucketUrl {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let slash = if self.prefix.is_empty() { "" } else { "/" };
        write!(f, "s3://{}{slash}{}", self.bucket, self.prefix)
    }
}

impl fmt::Display for StoreAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Folder(path) => write!(f, "{}", path.display()),
            Self::Bucket(url) => write!(f, "{url}"),
        }
    }
}

impl StoreAddress {
    /// Opens it. A bucket's address and keys are taken from the environment, as programs for such stores do.
    ///
    /// # Errors
    ///
    /// [`StoreError::NoCloud`] for a bucket when the program was built without the feature `cloud`; when settings in
    /// the environment contradict each other.
    pub fn open(&self) -> Result<Box<dyn Store>, StoreError> {
        match self {
            Self::Folder(path) => Ok(Box::new(Folder::new(path))),
            #[cfg(feature = "cloud")]
            Self::Bucket(url) => Ok(Box::new(crate::store::Bucket::from_env(url)?)),
            #[cfg(not(feature = "cloud"))]
            Self::Bucket(url) => Err(StoreError::NoCloud { url: url.to_string() }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{BucketUrl, StoreAddress};

    #[test]
    fn a_place_is_a_folder_or_a_bucket_with_a_prefix() {
        let bucket = |bucket: &str, prefix: &str| {
            StoreAddress::Bucket(BucketUrl { bucket: bucket.into(), prefix: prefix.into() })
        };
        assert_eq!("data/published".parse(), Ok(StoreAddress::Folder("data/published".into())));
        assert_eq!("s3://robots".parse(), Ok(bucket("robots", "")));
        assert_eq!("s3://robots/a/b/".parse(), Ok(bucket("robots", "a/b")));
        assert_eq!(bucket("robots", "a/b").to_string(), "s3://robots/a/b");
        for wrong in ["", "s3://", "s3:///a", "s3://a b", "s3://robots/a/../b", "s3://robots//a", "gs://robots"] {
            assert!(wrong.parse::<StoreAddress>().is_err(), "{wrong:?}");
        }
    }
}
