//! What cameras saw: that all pictures can be decoded and have the declared size.

use std::path::Path;

use crate::dataset::EpisodePictures;
use crate::dataset::files::finding::Validation;

/// Checks the pictures of all cameras.
pub(super) fn check(root: &Path, validation: &mut Validation) {
    // A file of features that cannot be read is found where they are checked.
    for camera in EpisodePictures::cameras(root).unwrap_or_default() {
        let mut pictures = match EpisodePictures::open(root, &camera) {
            Ok(pictures) => pictures,
            Err(error) => {
                validation.failed("pictures.place", &error);
                continue;
            }
        };
        for episode in 0..pictures.n_episodes() {
            if let Err(error) = pictures.check(episode) {
                validation.failed("pictures.decode", &error);
            }
        }
    }
}
