//! `--validate`: what is resident, read back, is what the derived scene says.

use orthant_cpu::ResidentScene;
use orthant_render::DerivedScene;
use orthant_resident::rows::NodeFlags;
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
