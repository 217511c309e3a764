//! The section of moving bodies: its place in the file.
//!
//! There are no bodies yet. What a newer program has written of them is kept as it is and written back, so that a world that is
//! changed by this program does not lose them. A section is a version and bytes that nobody here understands.

use std::sync::Arc;

/// A section of bodies, not understood.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct BodySection {
    /// Of what the bytes mean.
    version: u32,
    bytes: Arc<[u8]>,
}

impl BodySection {
    /// From the unpacked bytes of a section.
    pub fn decode(raw: &[u8]) -> Result<Self, String> {
        let (version, bytes) =
            raw.split_first_chunk().ok_or_else(|| "a section of bodies ends before its version".to_owned())?;
        Ok(Self { version: u32::from_le_bytes(*version), bytes: bytes.into() })
    }

    /// As it is written, before it is packed.
    pub fn encode(&self) -> Vec<u8> {
        [&self.version.to_le_bytes()[..], &self.bytes].concat()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::file::{FileFault, ReadOptions, read_bytes, salvage_bytes, write_to};
    use crate::{Aabb4, Block, BlockId, RegionTree, Scale, World, WorldPatch};

    fn world(sections: Vec<BodySection>) -> World {
        let mut world = World::new();
        let bounds = Aabb4::from_ints([0; 4], [9; 4]).unwrap();
        world.apply(&WorldPatch::of_tree(RegionTree::uniform(bounds, Block::of(BlockId(1), Scale::UNIT)))).unwrap();
        world.body_sections = sections;
        world
    }

    fn written(world: &World) -> Vec<u8> {
        let mut bytes = Vec::new();
        write_to(&mut bytes, world).unwrap();
        bytes
    }

    fn sections() -> Vec<BodySection> {
        let section = |version, bytes: &[u8]| BodySection { version, bytes: bytes.into() };
        vec![section(1, b"a tesseract that turns"), section(7, &[])]
    }

    #[test]
    fn bodies_that_nobody_understands_are_kept_and_written_back() {
        let bytes = written(&world(sections()));
        let mut again = read_bytes("test", &bytes, &ReadOptions::default()).unwrap();
        assert_eq!(again.body_sections, sections());
        assert_eq!(written(&again), bytes);
        // An edit does not lose them.
        let hole = Aabb4::from_ints([1; 4], [2; 4]).unwrap();
        again.apply(&WorldPatch::of_tree(RegionTree::empty(hole))).unwrap();
        let edited = read_bytes("test", &written(&again), &ReadOptions::default()).unwrap();
        assert_eq!(edited.body_sections, sections());
        assert_eq!(salvage_bytes("test", &bytes, &ReadOptions::default()).unwrap().world.body_sections, sections());
    }

    #[test]
    fn only_a_world_with_bodies_asks_for_a_program_that_knows_their_section() {
        let version = |bytes: &[u8]| u32::from_le_bytes(bytes[8..12].try_into().unwrap());
        assert_eq!(version(&written(&world(Vec::new()))), 1);
        assert_eq!(version(&written(&world(sections()))), 2);
    }

    #[test]
    fn every_flipped_bit_of_a_file_with_bodies_is_an_error() {
        let bytes = written(&world(sections()));
        for bit in 0..bytes.len() * 8 {
            let mut bad = bytes.clone();
            bad[bit / 8] ^= 1 << (bit % 8);
            assert!(read_bytes("test", &bad, &ReadOptions::default()).is_err(), "bit {bit}");
        }
    }

    #[test]
    fn memory_for_bodies_is_bounded() {
        let large = BodySection { version: 1, bytes: vec![0; 1 << 20].into() };
        let bytes = written(&world(vec![large]));
        let error = read_bytes("test", &bytes, &ReadOptions { max_memory: 1 << 19 }).unwrap_err();
        assert!(matches!(error.fault, FileFault::OverBudget { .. }), "{error}");
    }
}
