//! `--validate`: what is resident, read back, is what the derived scene says.

use orthant_cpu::ResidentScene;
use orthant_render::DerivedScene;
use orthant_resident::rows::NodeFlags;
use orthant_resident::world::WorldArenas;
use orthant_resident::world::compare::compare_live;
use orthant_vulkan::ResidentRows;

/// Compares every row of the resident scene with the derived one, byte for byte, and looks whether every visible RenderNode has
/// a BLAS and the TLAS is that of the rows.
///
/// # Errors
/// The first row and the field that differ.
pub fn validate(derived: &DerivedScene, resident: &ResidentScene) -> Result<(), String> {
    derived.rows().compare(&resident.rows()).map_err(|mismatch| mismatch.to_string())?;
    for (index, node) in derived.render_nodes.iter().enumerate() {
        let has_blas = resident.blas.get(node.primitive as usize).is_some_and(Option::is_some);
        if node.flags & NodeFlags::VISIBLE != 0 && !has_blas {
            return Err(format!("render node {index} has no BLAS (primitive {})", node.primitive));
        }
    }
    resident.validate()
}

/// The same for what was read back from a Vulkan device: every row, and every TLAS instance.
///
/// # Errors
/// The first row and the field that differ.
pub fn validate_vulkan(derived: &DerivedScene, resident: &ResidentRows) -> Result<(), String> {
    derived.rows().compare(&resident.rows()).map_err(|mismatch| mismatch.to_string())?;
    for (index, node) in derived.render_nodes.iter().enumerate() {
        let has_blas = resident.blas.get(node.primitive as usize).is_some_and(|&address| address != 0);
        if node.flags & NodeFlags::VISIBLE != 0 && !has_blas {
            return Err(format!("render node {index} has no BLAS (primitive {})", node.primitive));
        }
    }
    resident.check_instances()
}

/// Compares two sets of arenas in all that rays can come to: the tree, leaves, chunks, materials and their texels, byte for byte.
/// Free slots may differ.
///
/// # Errors
/// The first row and what differs.
pub fn compare_arenas(expected: &WorldArenas, resident: &WorldArenas) -> Result<(), String> {
    compare_live(expected, resident).map(|_| ()).map_err(|mismatch| mismatch.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use orthant_render::world::{BuildOptions, DerivedWorld};
    use orthant_resident::world::rows::NO_PAYLOAD;
    use orthant_world::{Aabb4, Generator, RegionNode, RegionTree, World, WorldPatch};

    #[test]
    fn a_wrong_bit_anywhere_is_found_and_named() {
        let mut world = World::new();
        let bounds = Aabb4::from_ints([-40; 4], [40; 4]).expect("a box");
        let node = RegionNode::Procedural(Generator::Terrain { seed: 1 });
        world.apply(&WorldPatch::of_tree(RegionTree { bounds, node })).expect("applied");
        let derived = DerivedWorld::build(&world, &BuildOptions::default()).expect("derived");
        let good = derived.mirror();
        assert_eq!(compare_arenas(good, &good.clone()), Ok(()));
        type Fault = fn(&mut WorldArenas);
        let faults: [(&str, Fault); 6] = [
            ("revision", |a| a.revision += 1),
            ("root", |a| a.root = orthant_resident::world::Root::EMPTY),
            ("world node", |a| a.nodes[3].bounds[1][0][3] += 1.0),
            ("world leaf", |a| a.leaves.last_mut().expect("a leaf").coarse ^= 1),
            ("block material", |a| a.palette[2].weight += 1.0),
            ("payload word", |a| {
                let first = a.leaves.iter().find(|l| l.payload != NO_PAYLOAD).expect("a chunk").payload as usize;
                a.payload[first + 140] ^= 1;
            }),
        ];
        for (word, fault) in faults {
            let mut bad = good.clone();
            fault(&mut bad);
            let found = compare_arenas(good, &bad).expect_err(word);
            assert!(found.contains(word), "{found}");
        }
    }
}
