//! `--validate`: what is resident, read back, is what the derived scene says.

use crate::failure::{Exit, Failure};
use orthant_cpu::ResidentScene;
use orthant_render::DerivedScene;
use orthant_resident::rows::NodeFlags;

/// Compares every row of the resident scene with the derived one, byte for byte, and looks whether every visible RenderNode has
/// a BLAS and the TLAS is that of the rows.
///
/// # Errors
/// A check that failed; it names the first row and the field that differ.
pub fn validate(derived: &DerivedScene, resident: &ResidentScene) -> Result<(), Failure> {
    rows("mesh_descs", &derived.mesh_descs, &resident.mesh_descs)?;
    rows("textures", &derived.textures, &resident.textures)?;
    rows("materials", &derived.materials, &resident.materials)?;
    rows("lights", &derived.lights, &resident.lights)?;
    rows("emitters", &derived.emitters, &resident.emitters)?;
    rows("render_nodes", &derived.render_nodes, &resident.render_nodes)?;
    for (index, node) in derived.render_nodes.iter().enumerate() {
        let has_blas = resident.blas.get(node.primitive as usize).is_some_and(Option::is_some);
        if node.flags & NodeFlags::VISIBLE != 0 && !has_blas {
            return Err(mismatch(format!("render node {index} has no BLAS (primitive {})", node.primitive)));
        }
    }
    resident.validate().map_err(mismatch)
}

fn rows<T: bytemuck::Pod + std::fmt::Debug>(name: &str, derived: &[T], resident: &[T]) -> Result<(), Failure> {
    if derived.len() != resident.len() {
        return Err(mismatch(format!("{name} has {} rows, but {} are resident", derived.len(), resident.len())));
    }
    for (index, (a, b)) in derived.iter().zip(resident).enumerate() {
        if bytemuck::bytes_of(a) != bytemuck::bytes_of(b) {
            return Err(mismatch(format!("row {index} of {name}: {}", first_difference(a, b))));
        }
    }
    Ok(())
}

/// The first field that differs, from the debug forms of two rows: `field: value, but value is resident`.
fn first_difference<T: std::fmt::Debug>(a: &T, b: &T) -> String {
    let (a, b) = (format!("{a:#?}"), format!("{b:#?}"));
    let mut field = "";
    for (x, y) in a.lines().zip(b.lines()) {
        // Fields of the row itself are indented by one step.
        if x.starts_with("    ") && !x.starts_with("     ") {
            field = x.trim().split(':').next().unwrap_or_default();
        }
        if x != y {
            let value =
                |line: &str| line.trim().trim_end_matches(',').rsplit(": ").next().unwrap_or_default().to_owned();
            return format!("{field} is {}, but {} is resident", value(x), value(y));
        }
    }
    "the bytes differ where the values look the same (a sign of zero, or two kinds of NaN)".into()
}

fn mismatch(what: String) -> Failure {
    Failure::new(Exit::CheckFailed, format!("--validate: {what}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use orthant_resident::rows::{EmitterTriangle, MeshDesc};

    fn desc() -> MeshDesc {
        bytemuck::Zeroable::zeroed()
    }

    #[test]
    fn a_difference_names_the_row_and_the_field() {
        let rows_a = [desc(), MeshDesc { first_index: 7, ..desc() }];
        let rows_b = [desc(), MeshDesc { first_index: 9, ..desc() }];
        let failure = rows("mesh_descs", &rows_a, &rows_b).expect_err("they differ");
        assert_eq!(failure.exit, Exit::CheckFailed);
        assert_eq!(failure.what, "--validate: row 1 of mesh_descs: first_index is 7, but 9 is resident");
        let bounds = MeshDesc { bounds_min: [0.0, 3.0, 0.0], ..desc() };
        let failure = rows("mesh_descs", &[desc()], &[bounds]).expect_err("they differ");
        assert!(failure.what.contains("bounds_min is 0.0, but 3.0"), "{failure}");
        assert!(rows::<EmitterTriangle>("x", &[], &[bytemuck::Zeroable::zeroed()]).is_err());
        assert_eq!(rows("mesh_descs", &rows_a, &rows_a), Ok(()));
    }
}
