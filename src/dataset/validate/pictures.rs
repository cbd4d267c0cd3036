//! What cameras saw: that all pictures can be decoded and have the declared size.

use std::path::Path;

use crate::dataset::EpisodePictures;
use crate::dataset::files::finding::Validation;

/// Checks the pictures of all cameras.
pub(super) fn check(root: &Path, validation: &mut Validation) {
    let cameras = match EpisodePictures::cameras(root) {
        Ok(cameras) => cameras,
        Err(error) => return validation.failed_once("pictures.place", &error),
    };
    for camera in cameras {
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
