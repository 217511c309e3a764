//! Edits in JSON, one object each.

use super::{EditError, EditLimits, Sphere, fill_box, fill_sphere, set_voxel};
use crate::block::{Block, BlockId};
use crate::palette::Palette;
use crate::space::{Aabb4, Fixed, Point4, Scale};
use crate::world::{World, WorldPatch};
use serde::{Deserialize, Deserializer, Serialize, de};

/// A block as an edit names it.
#[derive(Clone, PartialEq, Debug, Serialize)]
#[serde(untagged)]
pub enum BlockRef {
    /// A number, or `"air"`: a block of the edit's scale.
    Id(BlockId),
    /// All of a block, which has a scale of its own.
    Block(Block),
    /// The name of a material of the palette.
    Name(String),
}

impl<'de> Deserialize<'de> for BlockRef {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let value = serde_json::Value::deserialize(deserializer)?;
        match value {
            serde_json::Value::String(name) if name != "air" => Ok(Self::Name(name)),
            serde_json::Value::String(_) => Ok(Self::Id(BlockId::AIR)),
            id @ serde_json::Value::Number(_) => {
                let number = id.as_u64().and_then(|id| u16::try_from(id).ok());
                let none = || de::Error::custom(format!("{id} is no number of a block; they are 0 to 65535"));
                number.map(|id| Self::Id(BlockId(id))).ok_or_else(none)
            }
            block @ serde_json::Value::Object(_) => {
                serde_json::from_value(block).map(Self::Block).map_err(de::Error::custom)
            }
            _ => {
                Err(de::Error::custom("a block is \"air\", a number, a name, or {\"id\", \"orientation\", \"scale\"}"))
            }
        }
    }
}

impl BlockRef {
    /// The block, of this scale unless the reference says all of it.
    ///
    /// # Errors
    /// [`EditError::UnknownBlock`].
    pub fn resolve(&self, palette: &Palette, scale: Scale) -> Result<Block, EditError> {
        match self {
            Self::Id(id) => Ok(Block::of(*id, scale)),
            Self::Block(block) => Ok(*block),
            Self::Name(name) => {
                let unknown = || EditError::UnknownBlock { name: name.clone() };
                let id: BlockId = palette.id_of(name).ok_or_else(unknown)?;
                Ok(Block::of(id, scale))
            }
        }
    }
}

/// An edit of a world.
///
/// In JSON: `{"set": [x, y, z, w], "scale": 0, "block": 5}` (lattice indices at the scale), `{"fill": {"min", "max"}, "block"}`,
/// `{"sphere": {"center", "radius"}, "scale": 0, "block"}` (world units), or `{"patch": {...}}`. The scale is 0 if it is left out.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(try_from = "Wire")]
pub enum WorldEdit {
    /// One voxel.
    Set {
        /// Lattice indices.
        index: [i64; 4],
        /// Their scale.
        scale: Scale,
        /// What is put there.
        block: BlockRef,
    },
    /// A box.
    Fill {
        /// The box.
        bounds: Aabb4,
        /// The scale of the block.
        scale: Scale,
        /// What is put there.
        block: BlockRef,
    },
    /// A ball.
    Sphere {
        /// The ball and the scale of its voxels.
        sphere: Sphere,
        /// What is put there.
        block: BlockRef,
    },
    /// A patch.
    Patch(Box<WorldPatch>),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Wire {
    set: Option<[i64; 4]>,
    fill: Option<Aabb4>,
    sphere: Option<Ball>,
    patch: Option<Box<WorldPatch>>,
    scale: Option<Scale>,
    block: Option<BlockRef>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Ball {
    center: Point4,
    radius: Fixed,
}

impl TryFrom<Wire> for WorldEdit {
    type Error = &'static str;

    fn try_from(wire: Wire) -> Result<Self, &'static str> {
        let scale = wire.scale.unwrap_or_default();
        let block = wire.block.ok_or("the edit has no \"block\"");
        match (wire.set, wire.fill, wire.sphere, wire.patch) {
            (Some(index), None, None, None) => Ok(Self::Set { index, scale, block: block? }),
            (None, Some(bounds), None, None) => Ok(Self::Fill { bounds, scale, block: block? }),
            (None, None, Some(Ball { center, radius }), None) => {
                Ok(Self::Sphere { sphere: Sphere { center, radius, scale }, block: block? })
            }
            (None, None, None, Some(patch)) if block.is_err() && wire.scale.is_none() => Ok(Self::Patch(patch)),
            (None, None, None, Some(_)) => Err("a patch has its own blocks: leave out \"block\" and \"scale\""),
            _ => Err("an edit has exactly one of \"set\", \"fill\", \"sphere\", \"patch\""),
        }
    }
}

impl WorldEdit {
    /// The patches that make the edit in this world, in order.
    ///
    /// # Errors
    /// [`EditError`].
    pub fn patches(&self, world: &World, limits: &EditLimits) -> Result<Vec<WorldPatch>, EditError> {
        let palette = world.palette();
        match self {
            Self::Set { index, scale, block } => {
                set_voxel(*index, *scale, block.resolve(palette, *scale)?).map(|patch| vec![patch])
            }
            Self::Fill { bounds, scale, block } => Ok(vec![fill_box(*bounds, block.resolve(palette, *scale)?)]),
            Self::Sphere { sphere, block } => fill_sphere(world, sphere, block.resolve(palette, sphere.scale)?, limits),
            Self::Patch(patch) => Ok(vec![(**patch).clone()]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::palette::Material;

    #[test]
    fn edits_are_read_as_the_command_line_has_them() {
        let read = |json: &str| serde_json::from_str::<WorldEdit>(json);
        let set = read(r#"{"set":[1,-2,3,4],"scale":-1,"block":5}"#).unwrap();
        let mut world = World::new();
        let patches = set.patches(&world, &EditLimits::default()).unwrap();
        world.apply(&patches[0]).unwrap();
        let at = Point4([0.5, -1.0, 1.5, 2.0].map(|c| Fixed::from_f64(c).unwrap()));
        assert_eq!(world.block_at(at), Block::of(BlockId(5), Scale::new(-1).unwrap()));
        for good in [
            r#"{"fill":{"min":[0,0,0,0],"max":["1.5",2,3,4]},"block":"air"}"#,
            r#"{"sphere":{"center":[0,0,0,0.5],"radius":2.5},"scale":0,"block":{"id":3,"scale":2}}"#,
            r#"{"patch":{"authoritative_bounds":{"min":[0,0,0,0],"max":[1,1,1,1]},"subtree":{"empty":{}}}}"#,
        ] {
            assert!(read(good).is_ok(), "{good}: {:?}", read(good));
        }
        for bad in [
            r#"{"set":[1,2,3,4]}"#,
            r#"{"set":[1,2,3],"block":1}"#,
            r#"{"set":[1,2,3,4],"block":1,"fill":{"min":[0,0,0,0],"max":[1,1,1,1]}}"#,
            r#"{"block":1}"#,
            r#"{"set":[1,2,3,4],"block":1,"scale":16}"#,
            r#"{"set":[1,2,3,4],"block":1,"size":2}"#,
            r#"{"set":[1,2,3,4],"block":65536}"#,
            r#"{"set":[1,2,3,4],"block":[1,0,0]}"#,
            r#"{"set":[1,2,3,4],"block":null}"#,
        ] {
            assert!(read(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn blocks_are_named_by_their_material() {
        let mut palette = Palette::new();
        let id = palette.add(Material::colored("stone", [0.5; 3])).unwrap();
        let scale = Scale::new(2).unwrap();
        let named = |name: &str| serde_json::from_value::<BlockRef>(name.into()).unwrap().resolve(&palette, scale);
        assert_eq!(named("stone"), Ok(Block::of(id, scale)));
        assert_eq!(named("air"), Ok(Block::AIR));
        let full = |json: &str| serde_json::from_str::<BlockRef>(json).unwrap().resolve(&palette, scale);
        assert_eq!(full("7"), Ok(Block::of(BlockId(7), scale)));
        assert_eq!(full(r#"{"id":7,"scale":0}"#), Ok(Block::of(BlockId(7), Scale::UNIT)), "what is said holds");
        assert!(matches!(named("moon"), Err(EditError::UnknownBlock { .. })));
    }
}
