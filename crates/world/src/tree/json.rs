//! Trees in JSON: `{"bounds": {"min", "max"}, KIND: ...}` with exactly one of the kinds.

use super::{ChunkArray, RegionNode, RegionTree};
use crate::block::Block;
use crate::chunk::Chunk;
use crate::generate::Generator;
use crate::space::{Aabb4, ChunkShape, Lattice, Scale};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use std::sync::Arc;

/// `"empty": {}`, `"uniform": block`, `"procedural": generator`, `"chunk_array": {"scale", "shape", "chunks"}`, or
/// `"branch": [tree, ...]`. The outermost tree of a patch may leave out its bounds: they are then those of the patch.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct TreeWire {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    bounds: Option<Aabb4>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    empty: Option<Nothing>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    uniform: Option<Block>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    procedural: Option<Generator>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    chunk_array: Option<ArrayWire>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    branch: Option<Vec<TreeWire>>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Nothing {}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ArrayWire {
    scale: Scale,
    shape: ChunkShape,
    chunks: Vec<ChunkWire>,
}

/// Shared chunks are written out once for each place.
struct ChunkWire(Arc<Chunk>);

impl Serialize for ChunkWire {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for ChunkWire {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Chunk::deserialize(deserializer).map(|chunk| Self(Arc::new(chunk)))
    }
}

impl TreeWire {
    /// The tree; `outer` are the bounds if there are none.
    pub fn into_tree(self, outer: Option<Aabb4>) -> Result<RegionTree, String> {
        let bounds = self.bounds.or(outer).ok_or("a region without \"bounds\"")?;
        let mut nodes = Vec::new();
        nodes.extend(self.empty.map(|Nothing {}| RegionNode::Empty));
        nodes.extend(self.uniform.map(RegionNode::Uniform));
        nodes.extend(self.procedural.map(RegionNode::Procedural));
        if let Some(ArrayWire { scale, shape, chunks }) = self.chunk_array {
            let chunks = chunks.into_iter().map(|ChunkWire(chunk)| chunk).collect();
            let array = ChunkArray { lattice: Lattice { scale, shape }, chunks };
            array.check(&bounds).map_err(|e| e.to_string())?;
            nodes.push(RegionNode::ChunkArray(array));
        }
        if let Some(parts) = self.branch {
            let parts = parts.into_iter().map(|part| part.into_tree(None)).collect::<Result<_, _>>()?;
            nodes.push(RegionNode::Branch(parts));
        }
        match (nodes.pop(), nodes.is_empty()) {
            (Some(node), true) => Ok(RegionTree { bounds, node }),
            _ => {
                let kinds = r#""empty", "uniform", "procedural", "chunk_array", "branch""#;
                Err(format!("a region has exactly one of {kinds}"))
            }
        }
    }

    fn of(tree: &RegionTree) -> Self {
        let mut wire = Self {
            bounds: Some(tree.bounds),
            empty: None,
            uniform: None,
            procedural: None,
            chunk_array: None,
            branch: None,
        };
        match &tree.node {
            RegionNode::Empty => wire.empty = Some(Nothing {}),
            RegionNode::Uniform(block) => wire.uniform = Some(*block),
            RegionNode::Procedural(generator) => wire.procedural = Some(generator.clone()),
            RegionNode::ChunkArray(ChunkArray { lattice, chunks }) => {
                let chunks = chunks.iter().cloned().map(ChunkWire).collect();
                wire.chunk_array = Some(ArrayWire { scale: lattice.scale, shape: lattice.shape, chunks });
            }
            RegionNode::Branch(parts) => wire.branch = Some(parts.iter().map(Self::of).collect()),
        }
        wire
    }
}

impl Serialize for RegionTree {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        TreeWire::of(self).serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for RegionTree {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        TreeWire::deserialize(deserializer)?.into_tree(None).map_err(de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block::BlockId;

    fn ints(min: [i32; 4], max: [i32; 4]) -> Aabb4 {
        Aabb4::from_ints(min, max).unwrap()
    }

    #[test]
    fn every_kind_of_tree_comes_back() {
        let block = |id| Block::of(BlockId(id), Scale::UNIT);
        let lattice = Lattice::flat(Scale::UNIT);
        let dense = Chunk::from_blocks(&std::array::from_fn(|i| block((i % 5) as u16)));
        let chunks = vec![Arc::new(dense), Arc::new(Chunk::uniform(block(2)))];
        let tree = RegionTree::branch(
            ints([0; 4], [100; 4]),
            vec![
                RegionTree::empty(ints([0; 4], [1; 4])),
                RegionTree::uniform(ints([1; 4], [2; 4]), block(9)),
                RegionTree { bounds: ints([50; 4], [60; 4]), node: RegionNode::Procedural(Generator::Flat) },
                RegionTree::chunk_array(ints([15, 0, 0, 0], [20, 3, 16, 1]), lattice, chunks).unwrap(),
            ],
        );
        let json = serde_json::to_string(&tree).unwrap();
        assert_eq!(serde_json::from_str::<RegionTree>(&json).unwrap(), tree);
    }

    #[test]
    fn a_region_is_of_exactly_one_kind() {
        let bounds = r#""bounds":{"min":[0,0,0,0],"max":[1,1,1,1]}"#;
        for (rest, good) in [
            (r#""uniform":1"#, true),
            (r#""uniform":"air""#, true),
            (r#""uniform":1,"empty":{}"#, false),
            (r#""solid":1"#, false),
            (r#""chunk_array":{"scale":0,"shape":"cube","chunks":[]}"#, false),
            (r#""chunk_array":{"scale":0,"shape":"cube","chunks":[{"uniform":1}]}"#, true),
        ] {
            let json = format!("{{{bounds},{rest}}}");
            assert_eq!(serde_json::from_str::<RegionTree>(&json).is_ok(), good, "{json}");
        }
        assert!(serde_json::from_str::<RegionTree>(&format!("{{{bounds}}}")).is_err());
    }
}
