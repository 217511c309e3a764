//! What a point of the world is made of.

use crate::space::{Scale, ScaleError};
use serde::de::{self, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;

/// The number of a material in a palette; 0 is air.
#[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Serialize, Deserialize)]
#[serde(transparent)]
pub struct BlockId(pub u16);

impl BlockId {
    /// Nothing.
    pub const AIR: Self = Self(0);
}

/// One of the 192 rotations of a tesseract onto itself; 0 turns nothing.
///
/// `code = 8 * permutation + signs`: the permutation in lexicographic order (0 is the identity), one sign bit for each of
/// the images of x, y and z. The sign of the image of w is what makes the determinant 1.
#[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
#[repr(transparent)]
pub struct Orientation(u8);

/// A number that is no orientation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("orientation {0} is out of range; there are the 192 orientations 0 to 191")]
pub struct OrientationError(pub u8);

impl Orientation {
    /// As the material has it.
    pub const IDENTITY: Self = Self(0);

    /// # Errors
    /// [`OrientationError`] from 192 on.
    pub const fn new(code: u8) -> Result<Self, OrientationError> {
        if code < 192 { Ok(Self(code)) } else { Err(OrientationError(code)) }
    }

    /// The code.
    pub const fn get(self) -> u8 {
        self.0
    }

    /// For each axis of the material the axis of the world (0 to 3) that it points along, and whether it points backwards.
    pub fn axes(self) -> [(usize, bool); 4] {
        let permutation = permutation(self.0 / 8);
        let signs = self.0 % 8;
        let negative: [bool; 3] = std::array::from_fn(|a| signs >> a & 1 == 1);
        let last = negative.iter().fold(is_odd(permutation), |odd, &sign| odd ^ sign);
        [
            (permutation[0], negative[0]),
            (permutation[1], negative[1]),
            (permutation[2], negative[2]),
            (permutation[3], last),
        ]
    }

    /// The orientation that points the material's axes along these; `None` if they are no rotation.
    pub fn from_axes(axes: [(usize, bool); 4]) -> Option<Self> {
        (0..192).map(Self).find(|orientation| orientation.axes() == axes)
    }
}

/// The permutation of four things with this number in lexicographic order.
fn permutation(mut number: u8) -> [usize; 4] {
    let mut left = vec![0, 1, 2, 3];
    [6, 2, 1, 1].map(|block| {
        let chosen = left.remove(usize::from(number / block).min(left.len() - 1));
        number %= block;
        chosen
    })
}

fn is_odd(permutation: [usize; 4]) -> bool {
    let inversions = (0..4).flat_map(|a| (a + 1..4).map(move |b| (a, b)));
    inversions.filter(|&(a, b)| permutation[a] > permutation[b]).count() % 2 == 1
}

/// What a block is: its material, how that is turned, and the edge that the block has.
///
/// A block has its own scale, so that edges and textures of a coarse block stay as they are when what is around it is kept
/// at a finer scale. Air has neither orientation nor scale: there is one air.
#[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct Block {
    id: BlockId,
    orientation: Orientation,
    scale: Scale,
}

impl Block {
    /// Nothing.
    pub const AIR: Self = Self { id: BlockId::AIR, orientation: Orientation::IDENTITY, scale: Scale::UNIT };

    /// A block; air whatever the rest if the id says so.
    pub const fn new(id: BlockId, orientation: Orientation, scale: Scale) -> Self {
        if id.0 == 0 { Self::AIR } else { Self { id, orientation, scale } }
    }

    /// A block of a scale, not turned.
    pub const fn of(id: BlockId, scale: Scale) -> Self {
        Self::new(id, Orientation::IDENTITY, scale)
    }

    /// The material.
    pub const fn id(self) -> BlockId {
        self.id
    }

    /// How the material is turned.
    pub const fn orientation(self) -> Orientation {
        self.orientation
    }

    /// The block's edge.
    pub const fn scale(self) -> Scale {
        self.scale
    }

    /// Whether it is nothing.
    pub const fn is_air(self) -> bool {
        self.id.0 == 0
    }

    /// The same block of another material.
    pub const fn with_id(self, id: BlockId) -> Self {
        Self::new(id, self.orientation, self.scale)
    }

    /// 32 bits: the id in the low 16, then 8 of orientation, then 8 of scale (two's complement).
    pub const fn to_bits(self) -> u32 {
        self.id.0 as u32 | (self.orientation.0 as u32) << 16 | (self.scale.get() as u8 as u32) << 24
    }

    /// The block of [`Self::to_bits`]; an error for what no block has.
    ///
    /// # Errors
    /// [`BlockError`].
    pub fn from_bits(bits: u32) -> Result<Self, BlockError> {
        let [low, high, orientation, scale] = bits.to_le_bytes();
        let block = Self::new(
            BlockId(u16::from_le_bytes([low, high])),
            Orientation::new(orientation)?,
            Scale::new(scale as i8)?,
        );
        // One block has one encoding.
        if block.to_bits() == bits { Ok(block) } else { Err(BlockError::Air) }
    }
}

/// Bits that are those of no block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BlockError {
    /// No such orientation.
    #[error(transparent)]
    Orientation(#[from] OrientationError),
    /// No such scale.
    #[error(transparent)]
    Scale(#[from] ScaleError),
    /// Air with an orientation or a scale.
    #[error("air has neither orientation nor scale")]
    Air,
}

/// `"air"`, or the id alone for a block of unit scale that is not turned, or all three.
impl Serialize for Block {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        use serde::ser::SerializeStruct;
        if self.is_air() {
            return serializer.serialize_str("air");
        }
        if self.orientation == Orientation::IDENTITY && self.scale == Scale::UNIT {
            return serializer.serialize_u16(self.id.0);
        }
        let mut fields = serializer.serialize_struct("Block", 3)?;
        fields.serialize_field("id", &self.id)?;
        fields.serialize_field("orientation", &self.orientation.0)?;
        fields.serialize_field("scale", &self.scale)?;
        fields.end()
    }
}

impl<'de> Deserialize<'de> for Block {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct BlockVisitor;
        impl<'de> Visitor<'de> for BlockVisitor {
            type Value = Block;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(r#""air", the id of a block (0 to 65535), or {"id", "orientation", "scale"}"#)
            }
            fn visit_str<E: de::Error>(self, text: &str) -> Result<Block, E> {
                if text == "air" { Ok(Block::AIR) } else { Err(E::invalid_value(de::Unexpected::Str(text), &self)) }
            }
            fn visit_u64<E: de::Error>(self, id: u64) -> Result<Block, E> {
                let id = u16::try_from(id).map_err(|_| E::invalid_value(de::Unexpected::Unsigned(id), &self))?;
                Ok(Block::of(BlockId(id), Scale::UNIT))
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Block, A::Error> {
                #[derive(Deserialize)]
                #[serde(deny_unknown_fields)]
                struct Fields {
                    id: BlockId,
                    #[serde(default)]
                    orientation: u8,
                    #[serde(default)]
                    scale: Scale,
                }
                let fields = Fields::deserialize(de::value::MapAccessDeserializer::new(map))?;
                let orientation = Orientation::new(fields.orientation).map_err(de::Error::custom)?;
                Ok(Block::new(fields.id, orientation, fields.scale))
            }
        }
        deserializer.deserialize_any(BlockVisitor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orientations_are_the_192_rotations() {
        let mut seen = std::collections::HashSet::new();
        for code in 0..192 {
            let axes = Orientation::new(code).unwrap().axes();
            assert!(seen.insert(axes));
            let negative = axes.iter().filter(|(_, negative)| *negative).count() % 2 == 1;
            assert_eq!(is_odd(axes.map(|(axis, _)| axis)), negative, "the determinant is 1");
            assert_eq!(Orientation::from_axes(axes), Orientation::new(code).ok());
        }
        assert_eq!(Orientation::IDENTITY.axes(), [(0, false), (1, false), (2, false), (3, false)]);
        assert!(Orientation::new(192).is_err());
    }

    #[test]
    fn there_is_one_air() {
        let scale = Scale::new(3).unwrap();
        assert_eq!(Block::of(BlockId::AIR, scale), Block::AIR);
        assert_eq!(Block::from_bits(3 << 24), Err(BlockError::Air));
    }

    #[test]
    fn bits_and_json_come_back() {
        for (id, orientation, scale) in [(1, 0, 0), (65_535, 191, -16), (7, 3, 15)] {
            let orientation = Orientation::new(orientation).unwrap();
            let block = Block::new(BlockId(id), orientation, Scale::new(scale).unwrap());
            assert_eq!(Block::from_bits(block.to_bits()), Ok(block));
            let json = serde_json::to_string(&block).unwrap();
            assert_eq!(serde_json::from_str::<Block>(&json).unwrap(), block);
        }
        assert_eq!(serde_json::from_str::<Block>("\"air\"").unwrap(), Block::AIR);
        assert_eq!(serde_json::from_str::<Block>("0").unwrap(), Block::AIR);
        for bad in
            ["\"stone\"", "65536", "-1", r#"{"id":1,"scale":16}"#, r#"{"id":1,"orientation":192}"#, r#"{"id":1,"x":0}"#]
        {
            assert!(serde_json::from_str::<Block>(bad).is_err(), "{bad}");
        }
    }
}
