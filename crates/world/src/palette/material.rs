//! What a block looks like.

use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The look of a block. Colours are linear Rec. 709.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// The name, unique in a palette.
    pub name: Arc<str>,
    /// Albedo, 0 to 1. The pattern multiplies it.
    pub color: [f32; 3],
    /// Emitted radiance.
    #[serde(default)]
    pub emission: [f32; 3],
    /// For light that passes; `None` for an opaque material.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub transparency: Option<Transparency>,
    /// Roughness as in glTF, 0 to 1.
    #[serde(default = "one")]
    pub roughness: f32,
    /// Metalness as in glTF, 0 to 1.
    #[serde(default)]
    pub metallic: f32,
    /// What varies over a block.
    #[serde(default)]
    pub pattern: Pattern,
    /// Weight of a hit in the `integral` image mode, relative to the sky's 1; not negative.
    #[serde(default = "one")]
    pub weight: f32,
}

fn one() -> f32 {
    1.0
}

/// Beer's law: over a length `d` the fraction `exp(-absorption * d)` passes. Nothing is refracted.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Transparency {
    /// Absorption coefficients for red, green and blue, per world unit; not negative.
    pub absorption: [f32; 3],
}

/// What varies over a block. Coordinates run from 0 to 1 over the block at its own scale, turned by its orientation; on a
/// face the three coordinates that remain are in use.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Pattern {
    /// One colour.
    #[default]
    None,
    /// Cells of two brightnesses, as on a chessboard.
    Checker {
        /// Cells along an edge, at least 1.
        cells: u16,
        /// Factor of the darker cells, 0 to 1.
        contrast: f32,
    },
    /// Hashed value noise.
    Noise {
        /// Cells along an edge, at least 1.
        cells: u16,
        /// The darkest factor, 0 to 1; the brightest is 1.
        contrast: f32,
    },
    /// Darker lines along the edges.
    Edges {
        /// Width of the line as a fraction of the block's edge, 0 to 0.5.
        width: f32,
        /// Factor of the line, 0 to 1.
        contrast: f32,
    },
    /// Samples.
    Texture(Texture3),
}

/// A texture in three dimensions: samples at the centres of equal cells, nearest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Texture3 {
    /// Samples along each axis, 1 to 256.
    pub size: [u16; 3],
    /// sRGB, alpha unused: 4 bytes a sample, the first axis fastest.
    pub rgba: Arc<[u8]>,
}

/// A value that no material has.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MaterialError {
    /// No name.
    #[error("its name is empty, or longer than 256 bytes")]
    Name,
    /// A number beyond its range.
    #[error("{what} is {value}; it runs from {min} to {max}")]
    Range {
        /// Which number.
        what: &'static str,
        /// Its value.
        value: f32,
        /// The least value.
        min: f32,
        /// The greatest value.
        max: f32,
    },
    /// A texture without all of its samples, or with too many.
    #[error("its texture of {0:?} samples has {1} bytes; give 1 to 256 samples along each axis, 4 bytes each")]
    Texture([u16; 3], usize),
}

impl Material {
    /// An opaque, rough material of one colour (linear Rec. 709).
    pub fn colored(name: impl Into<Arc<str>>, color: [f32; 3]) -> Self {
        Self {
            name: name.into(),
            color,
            emission: [0.0; 3],
            transparency: None,
            roughness: 1.0,
            metallic: 0.0,
            pattern: Pattern::None,
            weight: 1.0,
        }
    }

    /// The linear colour of an sRGB one, each component of 255.
    pub fn linear([r, g, b]: [u8; 3]) -> [f32; 3] {
        // IEC 61966-2-1.
        [r, g, b].map(|component| {
            let value = f64::from(component) / 255.0;
            let linear = if value <= 0.040_45 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) };
            linear as f32
        })
    }

    /// Whether every value is in its range.
    ///
    /// # Errors
    /// [`MaterialError`] for the first that is not.
    pub fn check(&self) -> Result<(), MaterialError> {
        if self.name.is_empty() || self.name.len() > 256 {
            return Err(MaterialError::Name);
        }
        // A NaN is in no range.
        let within = |what, value: f32, max: f32| {
            let good = value >= 0.0 && value <= max;
            if good { Ok(()) } else { Err(MaterialError::Range { what, value, min: 0.0, max }) }
        };
        self.color.iter().try_for_each(|&c| within("color", c, 1.0))?;
        self.emission.iter().try_for_each(|&c| within("emission", c, f32::MAX))?;
        if let Some(transparency) = &self.transparency {
            transparency.absorption.iter().try_for_each(|&c| within("absorption", c, f32::MAX))?;
        }
        within("roughness", self.roughness, 1.0)?;
        within("metallic", self.metallic, 1.0)?;
        within("weight", self.weight, f32::MAX)?;
        match &self.pattern {
            Pattern::None => Ok(()),
            Pattern::Checker { cells, contrast } | Pattern::Noise { cells, contrast } => {
                if *cells == 0 {
                    return Err(MaterialError::Range { what: "cells", value: 0.0, min: 1.0, max: 65_535.0 });
                }
                within("contrast", *contrast, 1.0)
            }
            Pattern::Edges { width, contrast } => {
                within("width", *width, 0.5)?;
                within("contrast", *contrast, 1.0)
            }
            Pattern::Texture(texture) => {
                let samples: usize = texture.size.iter().map(|&n| usize::from(n)).product();
                let sized = texture.size.iter().all(|&n| (1..=256).contains(&n));
                if sized && texture.rgba.len() == 4 * samples {
                    Ok(())
                } else {
                    Err(MaterialError::Texture(texture.size, texture.rgba.len()))
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_beyond_their_range_are_named() {
        let good = Material::colored("a", [0.2, 0.4, 1.0]);
        assert_eq!(good.check(), Ok(()));
        let is_range = |material: Material, name: &str| match material.check() {
            Err(MaterialError::Range { what, .. }) => assert_eq!(what, name),
            other => panic!("{other:?}"),
        };
        is_range(Material { color: [f32::NAN, 0.0, 0.0], ..good.clone() }, "color");
        is_range(Material { emission: [-1.0, 0.0, 0.0], ..good.clone() }, "emission");
        is_range(Material { weight: f32::INFINITY, ..good.clone() }, "weight");
        is_range(Material { pattern: Pattern::Noise { cells: 0, contrast: 0.5 }, ..good.clone() }, "cells");
        let texture = Texture3 { size: [2, 2, 2], rgba: vec![0; 31].into() };
        let textured = Material { pattern: Pattern::Texture(texture), ..good };
        assert_eq!(textured.check(), Err(MaterialError::Texture([2; 3], 31)));
    }

    #[test]
    fn a_material_needs_no_more_than_a_name_and_a_colour() {
        let material: Material = serde_json::from_str(r#"{"name":"stone","color":[0.5,0.5,0.5]}"#).unwrap();
        assert_eq!(material, Material::colored("stone", [0.5; 3]));
        assert!(serde_json::from_str::<Material>(r#"{"name":"stone","colour":[0.5,0.5,0.5]}"#).is_err());
    }
}
