use super::AnyId;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

/// What an object carries besides what is modelled: kept for export, byte for byte in meaning.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Extra {
    /// glTF `extras`.
    pub extras: Option<Box<Value>>,
    /// Extensions that are not modelled, by name, in file order. Numbers in it that are indices are those of the file that
    /// was loaded; those that [`Other::links`] names are written anew by export.
    pub extensions: Option<Box<Map<String, Value>>>,
    /// What few objects have.
    pub other: Option<Box<Other>>,
    /// Which members with a default the file states.
    pub stated: Stated,
}

impl Extra {
    /// The indices inside [`Extra::extensions`].
    pub fn links(&self) -> &[Link] {
        self.other.as_ref().map_or(&[], |other| &other.links)
    }

    /// [`Extra::links`], to be mended.
    pub(crate) fn links_mut(&mut self) -> &mut [Link] {
        self.other.as_mut().map_or(&mut [], |other| &mut other.links)
    }

    /// With what the file states.
    pub(crate) fn stating(mut self, stated: Stated) -> Self {
        self.stated = stated;
        self
    }
}

/// What few objects have, apart, so that the others do not pay for it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Other {
    /// Members that neither the specification nor an extension knows.
    pub members: Map<String, Value>,
    /// Indices inside [`Extra::extensions`], in the order of the document.
    pub links: Vec<Link>,
}

/// An index inside an extension that is kept as JSON: which object it means.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Link {
    /// Where: a JSON pointer below the `extensions` object, such as `/KHR_texture_basisu/source`. What is there is a
    /// number, or a JSON pointer into the document (KHR_animation_pointer), whose first index is meant.
    pub path: Box<str>,
    /// The object.
    pub target: AnyId,
}

macro_rules! members {
    ($($variant:ident = $name:literal,)*) => {
        /// A member that has a default. The model holds its value; whether a file that says what goes without saying is
        /// kept in [`Stated`].
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
        #[repr(u8)]
        pub enum Member {
            $(#[doc = concat!("`", $name, "`.")] $variant,)*
        }

        impl Member {
            /// As JSON has it.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)* }
            }

            const COUNT: usize = [$(Self::$variant),*].len();
        }
    };
}

members! {
    AlphaMode = "alphaMode",
    AnisotropyRotation = "anisotropyRotation",
    AnisotropyStrength = "anisotropyStrength",
    AttenuationColor = "attenuationColor",
    BaseColorFactor = "baseColorFactor",
    ByteOffset = "byteOffset",
    ClearcoatFactor = "clearcoatFactor",
    ClearcoatRoughnessFactor = "clearcoatRoughnessFactor",
    Color = "color",
    DiffuseTransmissionColorFactor = "diffuseTransmissionColorFactor",
    DiffuseTransmissionFactor = "diffuseTransmissionFactor",
    Dispersion = "dispersion",
    DoubleSided = "doubleSided",
    EmissiveFactor = "emissiveFactor",
    EmissiveStrength = "emissiveStrength",
    InnerConeAngle = "innerConeAngle",
    Intensity = "intensity",
    Interpolation = "interpolation",
    Ior = "ior",
    IridescenceFactor = "iridescenceFactor",
    IridescenceIor = "iridescenceIor",
    IridescenceThicknessMaximum = "iridescenceThicknessMaximum",
    IridescenceThicknessMinimum = "iridescenceThicknessMinimum",
    MetallicFactor = "metallicFactor",
    Mode = "mode",
    Normalized = "normalized",
    Offset = "offset",
    OuterConeAngle = "outerConeAngle",
    PbrMetallicRoughness = "pbrMetallicRoughness",
    Rotation = "rotation",
    RoughnessFactor = "roughnessFactor",
    Scale = "scale",
    SheenColorFactor = "sheenColorFactor",
    SheenRoughnessFactor = "sheenRoughnessFactor",
    SpecularColorFactor = "specularColorFactor",
    SpecularFactor = "specularFactor",
    Spot = "spot",
    Strength = "strength",
    TexCoord = "texCoord",
    ThicknessFactor = "thicknessFactor",
    Translation = "translation",
    TransmissionFactor = "transmissionFactor",
    Visible = "visible",
}

/// The members with a default that a file states. Export writes those that are stated, and those that differ from the
/// default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Stated(u64);

impl Stated {
    /// Whether the file states it.
    #[inline]
    pub fn has(self, member: Member) -> bool {
        self.0 & (1 << member as u8) != 0
    }

    /// Notes a member that is there, and passes its value on.
    #[inline]
    pub(crate) fn note<T>(&mut self, member: Member, value: Option<T>) -> Option<T> {
        const { assert!(Member::COUNT <= u64::BITS as usize) };
        self.0 |= u64::from(value.is_some()) << member as u8;
        value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_stated_is_what_was_there() {
        let mut stated = Stated::default();
        assert_eq!(stated.note(Member::AlphaMode, Some(1)), Some(1));
        assert_eq!(stated.note(Member::Visible, None::<u8>), None);
        assert_eq!(stated.note(Member::TransmissionFactor, Some(2)), Some(2));
        assert!(stated.has(Member::AlphaMode) && stated.has(Member::TransmissionFactor));
        assert!(!stated.has(Member::Visible) && !stated.has(Member::Translation));
    }
}
