//! How far two pictures are apart.
//!
//! * [`error`]: RMSE, relative MSE and the largest difference of a channel;
//! * [`flip`]: what a viewer sees when flipping between the two;
//! * [`hits`]: whether they show the same things.

pub mod error;
pub mod flip;
pub mod hits;

use crate::image_io::{Encoding, Picture};

/// All metrics of a pair of pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// Root of the mean squared difference over all pixels and channels.
    pub rmse: f64,
    /// Mean of `(a - b)^2 / (b^2 + 0.01)` over all pixels and channels; `b` is the reference.
    pub rel_mse: f64,
    /// Largest absolute difference of a channel.
    pub max: f64,
    /// Mean FLIP error, 0..=1.
    pub flip: f64,
    /// Whether FLIP is the one for HDR images.
    pub hdr: bool,
}

/// The names of the metrics, as on the command line and in JSON.
pub const METRICS: [&str; 4] = ["rmse", "rel_mse", "max", "flip"];

impl Comparison {
    /// A metric by its name.
    pub fn get(&self, name: &str) -> Option<f64> {
        match name {
            "rmse" => Some(self.rmse),
            "rel_mse" => Some(self.rel_mse),
            "max" => Some(self.max),
            "flip" => Some(self.flip),
            _ => None,
        }
    }
}

/// Compares a picture with a reference of the same size.
///
/// Two display-encoded pictures (PNG) are compared by their encoded values in 0..=1, and by LDR-FLIP. Otherwise both
/// are compared as linear radiance, and by HDR-FLIP.
///
/// # Panics
/// If the sizes differ.
pub fn compare(test: Picture, reference: Picture) -> Comparison {
    assert_eq!((test.width, test.height), (reference.width, reference.height), "pictures of one size");
    let (width, height) = (test.width as usize, test.height as usize);
    let hdr = test.encoding == Encoding::Linear || reference.encoding == Encoding::Linear;
    let (a, b) = if hdr { (test.into_linear(), reference.into_linear()) } else { (test, reference) };
    let errors = error::errors(&a.pixels, &b.pixels);
    let map = if hdr {
        flip::hdr_flip(&b.pixels, &a.pixels, width, height)
    } else {
        let (a, b) = (a.into_linear(), b.into_linear());
        flip::ldr_flip(&b.pixels, &a.pixels, width, height)
    };
    let flip = map.iter().map(|&v| f64::from(v)).sum::<f64>() / map.len() as f64;
    Comparison { rmse: errors.rmse, rel_mse: errors.rel_mse, max: errors.max, flip, hdr }
}
