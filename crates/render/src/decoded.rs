//! What the data of a document becomes before anything is derived from it.

use crate::DeriveError;
use crate::DeriveWarning;
use crate::budget::Budget;
use crate::derived::materials::ImageUse;
use crate::derived::primitives;
use crate::geometry::{GeometryPlan, GeometryStreams};
use crate::textures::{ImageLimits, Levels, decode_images};
use orthant_resident::image::ImageData;
use orthant_scene::Scene;
use std::sync::Arc;

/// The geometry and the images of a document, decoded: no tangents, no poses, no mips, no rows. It is what can be compared
/// with what other importers give; a renderer takes a [`DerivedScene`](crate::DerivedScene), which goes through the same
/// decoders.
#[derive(Debug, Default)]
pub struct DecodedScene {
    /// Every distinct primitive that has triangles, undeformed.
    pub streams: GeometryStreams,
    /// Every image of the document in its order, level 0 alone; `None` where it is missing or broken.
    pub images: Vec<Option<Arc<ImageData>>>,
    /// What is decoded otherwise than the document says.
    pub warnings: Vec<DeriveWarning>,
}

impl DecodedScene {
    /// Decodes geometry and, if asked for, images, side by side.
    ///
    /// # Errors
    /// Geometry that is broken, and more bytes than `max_bytes`.
    pub fn decode(scene: &Scene, images: bool, max_bytes: u64) -> Result<Self, DeriveError> {
        let budget = Budget::new(max_bytes);
        let primitives = primitives::distinct(scene);
        let no_emitters = vec![false; primitives.len()];
        let plan = GeometryPlan::new(scene, &primitives, &no_emitters, &budget)?;
        let limits = ImageLimits { max_bytes: budget.left(), levels: Levels::First };
        let images = || {
            let ids = scene.images().ids().filter(|_| images);
            let uses: Vec<ImageUse> = ids.map(|image| ImageUse { image, srgb: true }).collect();
            let mut warnings = Vec::new();
            let images = decode_images(scene, &uses, limits, &mut warnings)?;
            Ok((images, warnings))
        };
        let (streams, images) = rayon::join(|| plan.decode(&|_| None), images);
        let (streams, (images, warnings)) = (streams?, images?);
        Ok(Self { streams, images, warnings })
    }

    /// Bytes of the geometry streams.
    pub fn geometry_bytes(&self) -> u64 {
        self.streams.bytes()
    }

    /// Bytes of the texels.
    pub fn image_bytes(&self) -> u64 {
        self.images.iter().flatten().map(|image| image.texels.len() as u64).sum()
    }
}
