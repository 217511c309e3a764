use super::{Material, Scene};

/// How a lobe's extension is named, and whether a material shows it.
type Lobe = (&'static str, fn(&Material) -> bool);

/// Lobes that the renderers do not show yet. A lobe that a material carries with a factor of zero is not seen, and does
/// not count.
const UNRENDERED: &[Lobe] = &[
    ("KHR_materials_anisotropy", |m| m.anisotropy.as_ref().is_some_and(|a| a.strength != 0.0)),
    ("KHR_materials_clearcoat", |m| m.clearcoat.as_ref().is_some_and(|c| c.factor != 0.0)),
    ("KHR_materials_diffuse_transmission", |m| m.diffuse_transmission.as_ref().is_some_and(|d| d.factor != 0.0)),
    ("KHR_materials_dispersion", |m| m.dispersion.is_some_and(|d| d != 0.0)),
    ("KHR_materials_iridescence", |m| m.iridescence.as_ref().is_some_and(|i| i.factor != 0.0)),
    ("KHR_materials_sheen", |m| m.sheen.as_ref().is_some_and(|s| s.color != [0.0; 3])),
    ("KHR_materials_specular", |m| {
        m.specular
            .as_ref()
            .is_some_and(|s| s.factor != 1.0 || s.color != [1.0; 3] || s.texture.is_some() || s.color_texture.is_some())
    }),
    ("KHR_materials_transmission", |m| m.transmission.as_ref().is_some_and(|t| t.factor != 0.0)),
    ("KHR_materials_volume", |m| m.volume.as_ref().is_some_and(|v| v.thickness != 0.0)),
];

impl Scene {
    /// The extensions, in alphabetical order, whose lobes a material of the document has and no renderer shows yet.
    pub fn unrendered_lobes(&self) -> Vec<&'static str> {
        let is_used = |lobe: &Lobe| self.materials.iter().any(|(_, material)| lobe.1(material));
        UNRENDERED.iter().filter(|lobe| is_used(lobe)).map(|&(name, _)| name).collect()
    }
}
