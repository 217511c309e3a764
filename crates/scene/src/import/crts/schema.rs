//! The JSON header, as it is read and written. Keys that are not here are ignored.

use serde::de::{Deserializer, Error};
use serde::{Deserialize, Serialize, Serializer};
use std::fmt;

/// The header.
#[derive(Debug, Default, Deserialize, Serialize)]
#[serde(default)]
pub struct Header {
    /// Written only: the layout of the lights is said by the two keys after it.
    #[serde(skip_deserializing)]
    pub crts_version: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub light_origin: Option<LightOrigin>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub light_emits: Option<LightEmits>,
    pub buffer_views: Vec<BufferView>,
    pub meshes: Vec<Mesh>,
    pub images: Vec<Image>,
    pub materials: Vec<Material>,
    pub objects: Vec<Object>,
}

/// What column 3 of a light's matrix is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum LightOrigin {
    Corner,
    Center,
}

/// Along which direction of column 2 a light shines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
pub enum LightEmits {
    #[serde(rename = "+z")]
    Positive,
    #[serde(rename = "-z")]
    Negative,
}

#[derive(Debug, Deserialize, Serialize)]
pub struct BufferView {
    pub byte_offset: u64,
    pub byte_length: u64,
    #[serde(rename = "type")]
    pub dtype: Dtype,
}

/// The element type of a view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dtype {
    shape: Shape,
    component: Component,
}

macro_rules! named {
    ($(#[$doc:meta])* $type:ident: $value:ty; $($variant:ident = $name:literal, $number:literal;)*) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        enum $type {
            $($variant,)*
        }

        impl $type {
            const ALL: &[Self] = &[$(Self::$variant),*];

            fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)* }
            }

            fn number(self) -> $value {
                match self { $(Self::$variant => $number,)* }
            }
        }
    };
}

named! {
    /// Its number is that of its components.
    Shape: usize;
    Scalar = "", 1;
    Vec2 = "VEC2_", 2;
    Vec3 = "VEC3_", 3;
    Vec4 = "VEC4_", 4;
    Mat2 = "MAT2_", 4;
    Mat3 = "MAT3_", 9;
    Mat4 = "MAT4_", 16;
}

named! {
    /// Its number is that of its bytes. The name is that inside a vector or matrix.
    Component: usize;
    I8 = "I8", 1;
    U8 = "U8", 1;
    I16 = "I16", 2;
    U16 = "U16", 2;
    I32 = "I32", 4;
    U32 = "U32", 4;
    F32 = "F32", 4;
    F64 = "F64", 8;
}

impl Component {
    fn scalar_name(self) -> &'static str {
        match self {
            Self::I8 => "INT_8",
            Self::U8 => "UINT_8",
            Self::I16 => "INT_16",
            Self::U16 => "UINT_16",
            Self::I32 => "INT_32",
            Self::U32 => "UINT_32",
            Self::F32 => "FLOAT_32",
            Self::F64 => "FLOAT_64",
        }
    }
}

impl Dtype {
    pub const UINT_8: Self = Self { shape: Shape::Scalar, component: Component::U8 };
    pub const VEC2_F32: Self = Self { shape: Shape::Vec2, component: Component::F32 };
    pub const VEC3_F32: Self = Self { shape: Shape::Vec3, component: Component::F32 };
    pub const VEC3_U32: Self = Self { shape: Shape::Vec3, component: Component::U32 };

    /// Bytes of an element.
    pub fn size(self) -> usize {
        self.shape.number() * self.component.number()
    }

    fn parse(name: &str) -> Option<Self> {
        let scalars = Component::ALL.iter().map(|&component| Self { shape: Shape::Scalar, component });
        let others = Shape::ALL[1..]
            .iter()
            .flat_map(|&shape| Component::ALL.iter().map(move |&component| Self { shape, component }));
        scalars.chain(others).find(|dtype| {
            let (first, second) = dtype.name();
            name.strip_prefix(first) == Some(second)
        })
    }

    /// In two parts.
    fn name(self) -> (&'static str, &'static str) {
        match self.shape {
            Shape::Scalar => (self.component.scalar_name(), ""),
            shape => (shape.name(), self.component.name()),
        }
    }
}

impl fmt::Display for Dtype {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (first, second) = self.name();
        write!(f, "{first}{second}")
    }
}

impl<'de> Deserialize<'de> for Dtype {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        Self::parse(&name).ok_or_else(|| {
            let shown: String = name.chars().take(40).collect();
            D::Error::custom(format!("\"{shown}\" is no element type; export the scene with a type such as VEC3_F32"))
        })
    }
}

impl Serialize for Dtype {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

#[derive(Debug, Deserialize, Serialize)]
pub struct Mesh {
    #[serde(default)]
    pub name: Option<String>,
    pub positions: i64,
    pub indices: i64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub texcoords: Option<i64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normals: Option<i64>,
}

#[derive(Debug, Deserialize, Serialize)]
pub struct Image {
    #[serde(default)]
    pub name: Option<String>,
    pub view: i64,
    /// Written only: readers cannot rely on it.
    #[serde(rename = "type", skip_deserializing)]
    pub media_type: String,
    #[serde(default)]
    pub color_space: Option<String>,
}

/// A channel of a texture that replaces a factor.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
pub struct ScalarTexture {
    pub texture: i64,
    pub channel: i64,
}

macro_rules! disney {
    ($($variant:ident: $key:ident, $texture:ident = $name:literal, $default:literal;)*) => {
        /// A parameter of the Disney BSDF that is a number.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[repr(usize)]
        pub enum Scalar {
            $($variant,)*
        }

        impl Scalar {
            pub const ALL: [Self; SCALARS] = [$(Self::$variant),*];

            /// Its key; that of its texture has `_texture` behind it.
            pub fn key(self) -> &'static str {
                match self { $(Self::$variant => $name,)* }
            }

            /// What a file that has no such key means.
            pub fn default_value(self) -> f64 {
                match self { $(Self::$variant => $default,)* }
            }
        }

        /// How many of them there are.
        pub const SCALARS: usize = [$($default),*].len();

        #[derive(Debug, Default, Deserialize, Serialize)]
        #[serde(default)]
        pub struct Material {
            pub name: Option<String>,
            #[serde(skip_serializing_if = "Option::is_none")]
            pub base_color: Option<[f64; 3]>,
            #[serde(skip_serializing_if = "Option::is_none")]
            pub base_color_texture: Option<i64>,
            $(
                #[serde(skip_serializing_if = "Option::is_none")]
                pub $key: Option<f64>,
                #[serde(skip_serializing_if = "Option::is_none")]
                pub $texture: Option<ScalarTexture>,
            )*
        }

        impl Material {
            /// A factor and its texture.
            pub fn scalar(&self, scalar: Scalar) -> (Option<f64>, Option<ScalarTexture>) {
                match scalar { $(Scalar::$variant => (self.$key, self.$texture),)* }
            }

            pub fn set_scalar(&mut self, scalar: Scalar, factor: f64, texture: Option<ScalarTexture>) {
                match scalar {
                    $(Scalar::$variant => (self.$key, self.$texture) = (Some(factor), texture),)*
                }
            }
        }
    };
}

disney! {
    Metallic: metallic, metallic_texture = "metallic", 0.0;
    Specular: specular, specular_texture = "specular", 0.5;
    Roughness: roughness, roughness_texture = "roughness", 1.0;
    SpecularTint: specular_tint, specular_tint_texture = "specular_tint", 0.0;
    Anisotropic: anisotropic, anisotropic_texture = "anisotropic", 0.0;
    Sheen: sheen, sheen_texture = "sheen", 0.0;
    SheenTint: sheen_tint, sheen_tint_texture = "sheen_tint", 0.0;
    Clearcoat: clearcoat, clearcoat_texture = "clearcoat", 0.0;
    ClearcoatRoughness: clearcoat_roughness, clearcoat_roughness_texture = "clearcoat_roughness", 0.0;
    Ior: ior, ior_texture = "ior", 1.5;
    Transmission: transmission, transmission_texture = "transmission", 0.0;
}

/// The base colour of a file that has no such key.
pub const DEFAULT_BASE_COLOR: [f64; 3] = [0.9; 3];

#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "UPPERCASE")]
pub enum ObjectKind {
    Mesh,
    Light,
    Camera,
}

#[derive(Debug, Deserialize, Serialize)]
pub struct Object {
    #[serde(default)]
    pub name: Option<String>,
    #[serde(rename = "type")]
    pub kind: ObjectKind,
    /// Column-major. `null` is what writers make of NaN and infinity.
    pub matrix: [Option<f64>; 16],
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mesh: Option<i64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material: Option<i64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub color: Option<[f64; 3]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub energy: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size: Option<[f64; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fov_y: Option<f64>,
}

/// An upper bound for the memory that a header takes, by what its text can hold: every object may be of the largest kind,
/// and vectors hold their old and their new block while they grow.
pub fn parsed_bound(text: &str) -> u64 {
    const GROWTH: u64 = 3;
    const SIZES: [usize; 5] =
        [size_of::<BufferView>(), size_of::<Mesh>(), size_of::<Image>(), size_of::<Material>(), size_of::<Object>()];
    let largest = SIZES.into_iter().max().unwrap_or(0) as u64;
    let objects = text.bytes().filter(|&b| b == b'{').count() as u64;
    // A vector begins with room for four.
    2 * text.len() as u64 + GROWTH * largest * (objects + 4 * 5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_element_type_has_its_name_and_size() {
        let mut seen = 0;
        for (name, size) in [
            ("INT_8", 1),
            ("UINT_8", 1),
            ("INT_16", 2),
            ("UINT_16", 2),
            ("INT_32", 4),
            ("UINT_32", 4),
            ("FLOAT_32", 4),
            ("FLOAT_64", 8),
            ("VEC2_I8", 2),
            ("VEC3_U16", 6),
            ("VEC4_F64", 32),
            ("MAT2_F32", 16),
            ("MAT3_F32", 36),
            ("MAT4_I16", 32),
        ] {
            let dtype = Dtype::parse(name).unwrap_or_else(|| panic!("{name} is not known"));
            assert_eq!((dtype.to_string().as_str(), dtype.size()), (name, size));
            seen += 1;
        }
        assert_eq!(seen, 14);
        for unknown in ["", "F32", "VEC3", "VEC3_", "VEC3_F16", "VEC5_F32", "float_32", "VEC3_FLOAT_32", "FLOAT_32 "] {
            assert_eq!(Dtype::parse(unknown), None, "{unknown}");
        }
    }
}
