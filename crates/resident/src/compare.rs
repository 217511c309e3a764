//! Whether what is resident is what was derived: row by row, byte for byte, of everything or of what a batch has touched.
//!
//! The rows that are compared are plain slices, so that a backend with a device of its own hands in what it has read back.

use crate::batch::{RowWrites, SceneBatch, TextureRow};
use crate::rows::{EmitterRow, LightRow, MaterialRow, MeshDesc, RenderNodeRow};
use std::fmt::Debug;
use std::ops::Range;

/// The rows of a scene, buffer by buffer: those of the derived scene, or those that a backend has.
#[derive(Clone, Copy, Debug)]
pub struct Rows<'r> {
    /// Geometry ranges by RenderPrimitive.
    pub mesh_descs: &'r [MeshDesc],
    /// Textures.
    pub textures: &'r [TextureRow],
    /// Materials.
    pub materials: &'r [MaterialRow],
    /// Punctual lights.
    pub lights: &'r [LightRow],
    /// Emissive render nodes.
    pub emitters: &'r [EmitterRow],
    /// Instances.
    pub render_nodes: &'r [RenderNodeRow],
}

/// Ranges of rows that a batch writes, ascending, buffer by buffer. Empty by default.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Touched {
    /// Of [`Rows::mesh_descs`].
    pub mesh_descs: Vec<Range<u32>>,
    /// Of [`Rows::textures`].
    pub textures: Vec<Range<u32>>,
    /// Of [`Rows::materials`].
    pub materials: Vec<Range<u32>>,
    /// Of [`Rows::lights`].
    pub lights: Vec<Range<u32>>,
    /// Of [`Rows::emitters`].
    pub emitters: Vec<Range<u32>>,
    /// Of [`Rows::render_nodes`].
    pub render_nodes: Vec<Range<u32>>,
}

/// The first row that is not what it should be.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Mismatch {
    /// A buffer has another length.
    #[error("{buffer} has {derived} rows, but {resident} are resident")]
    Length {
        /// The buffer.
        buffer: &'static str,
        /// Rows of the derived scene.
        derived: usize,
        /// Rows that are resident.
        resident: usize,
    },
    /// A row differs.
    #[error("row {row} of {buffer}: {field} is {derived}, but {resident} is resident")]
    Row {
        /// The buffer.
        buffer: &'static str,
        /// The row.
        row: u32,
        /// Its first field that differs.
        field: String,
        /// What the derived scene says, or the first part of it that differs.
        derived: String,
        /// What is resident.
        resident: String,
    },
    /// A row differs in its bytes, and looks the same.
    #[error(
        "row {row} of {buffer}: the bytes differ where the values look the same (a sign of zero, or two kinds of NaN)"
    )]
    Bytes {
        /// The buffer.
        buffer: &'static str,
        /// The row.
        row: u32,
    },
}

impl Touched {
    /// What a batch writes. O(ranges).
    pub fn of(batch: &SceneBatch) -> Self {
        fn ranges<T>(writes: &RowWrites<T>) -> Vec<Range<u32>> {
            writes.ranges.iter().map(|range| range.first..range.first + range.rows.len() as u32).collect()
        }
        Self {
            mesh_descs: ranges(&batch.mesh_descs),
            textures: ranges(&batch.textures),
            materials: ranges(&batch.materials),
            lights: ranges(&batch.lights),
            emitters: ranges(&batch.emitters),
            render_nodes: ranges(&batch.render_nodes),
        }
    }
}

impl Rows<'_> {
    /// Compares every row with the resident one.
    ///
    /// # Errors
    /// The first difference.
    pub fn compare(&self, resident: &Rows<'_>) -> Result<(), Mismatch> {
        fn whole<T>(rows: &[T]) -> Vec<Range<u32>> {
            let all = 0..rows.len() as u32;
            vec![all]
        }
        let touched = Touched {
            mesh_descs: whole(self.mesh_descs),
            textures: whole(self.textures),
            materials: whole(self.materials),
            lights: whole(self.lights),
            emitters: whole(self.emitters),
            render_nodes: whole(self.render_nodes),
        };
        self.compare_touched(resident, &touched)
    }

    /// Compares the lengths of all buffers, and the rows that a batch has touched. O(touched).
    ///
    /// # Errors
    /// The first difference.
    pub fn compare_touched(&self, resident: &Rows<'_>, touched: &Touched) -> Result<(), Mismatch> {
        compare_buffer("mesh_descs", self.mesh_descs, resident.mesh_descs, &touched.mesh_descs)?;
        compare_buffer("textures", self.textures, resident.textures, &touched.textures)?;
        compare_buffer("materials", self.materials, resident.materials, &touched.materials)?;
        compare_buffer("lights", self.lights, resident.lights, &touched.lights)?;
        compare_buffer("emitters", self.emitters, resident.emitters, &touched.emitters)?;
        compare_buffer("render_nodes", self.render_nodes, resident.render_nodes, &touched.render_nodes)
    }
}

fn compare_buffer<T: bytemuck::Pod + Debug>(
    buffer: &'static str,
    derived: &[T],
    resident: &[T],
    touched: &[Range<u32>],
) -> Result<(), Mismatch> {
    if derived.len() != resident.len() {
        return Err(Mismatch::Length { buffer, derived: derived.len(), resident: resident.len() });
    }
    for range in touched {
        // A buffer may have become shorter since: what was written behind its end is gone.
        let rows = range.start as usize..(range.end as usize).min(derived.len());
        if !rows.is_empty() {
            compare_range(buffer, range.start, &derived[rows.clone()], &resident[rows])?;
        }
    }
    Ok(())
}

/// Compares consecutive rows of a buffer from `first` on with those that are resident there, or were read back.
///
/// # Errors
/// The first difference, another number of rows included.
pub fn compare_range<T: bytemuck::Pod + Debug>(
    buffer: &'static str,
    first: u32,
    derived: &[T],
    resident: &[T],
) -> Result<(), Mismatch> {
    if derived.len() != resident.len() {
        return Err(Mismatch::Length { buffer, derived: derived.len(), resident: resident.len() });
    }
    let same = bytemuck::cast_slice::<T, u8>(derived) == bytemuck::cast_slice::<T, u8>(resident);
    if same {
        return Ok(());
    }
    let differs = |(_, (a, b)): &(u32, (&T, &T))| bytemuck::bytes_of(*a) != bytemuck::bytes_of(*b);
    match (first..).zip(derived.iter().zip(resident)).find(differs) {
        Some((row, (a, b))) => Err(difference(buffer, row, a, b)),
        None => Ok(()),
    }
}

/// The first field that differs, from the debug forms of two rows.
fn difference<T: Debug>(buffer: &'static str, row: u32, a: &T, b: &T) -> Mismatch {
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
            return Mismatch::Row { buffer, row, field: field.to_owned(), derived: value(x), resident: value(y) };
        }
    }
    Mismatch::Bytes { buffer, row }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rows::EmitterTriangle;

    fn desc() -> MeshDesc {
        bytemuck::Zeroable::zeroed()
    }

    fn rows(mesh_descs: &[MeshDesc]) -> Rows<'_> {
        Rows { mesh_descs, textures: &[], materials: &[], lights: &[], emitters: &[], render_nodes: &[] }
    }

    #[test]
    fn a_difference_names_the_row_and_the_field() {
        let derived = [desc(), MeshDesc { first_index: 7, ..desc() }];
        let resident = [desc(), MeshDesc { first_index: 9, ..desc() }];
        let mismatch = rows(&derived).compare(&rows(&resident)).expect_err("they differ");
        assert_eq!(mismatch.to_string(), "row 1 of mesh_descs: first_index is 7, but 9 is resident");
        let bounds = [MeshDesc { bounds_min: [0.0, 3.0, 0.0], ..desc() }];
        let mismatch = rows(&[desc()]).compare(&rows(&bounds)).expect_err("they differ").to_string();
        assert!(mismatch.contains("bounds_min is 0.0, but 3.0"), "{mismatch}");
        let zero = [MeshDesc { bounds_min: [-0.0, 0.0, 0.0], ..desc() }];
        assert!(rows(&[desc()]).compare(&rows(&zero)).is_err(), "a sign of zero is a difference");
        assert!(compare_range::<EmitterTriangle>("x", 0, &[], &[bytemuck::Zeroable::zeroed()]).is_err());
        assert_eq!(rows(&derived).compare(&rows(&derived)), Ok(()));
    }

    #[test]
    fn of_touched_rows_only_these_are_compared_and_the_lengths_of_all() {
        let derived = [desc(), desc(), desc(), desc()];
        let mut resident = derived;
        resident[2].index_count = 3;
        let compare = |resident: &[MeshDesc], touched: &[Range<u32>]| {
            let touched = Touched { mesh_descs: touched.to_vec(), ..Touched::default() };
            rows(&derived).compare_touched(&rows(resident), &touched)
        };
        assert_eq!(compare(&resident, &[0..2, 3..4]), Ok(()));
        let mismatch = compare(&resident, &[0..1, 2..4]).expect_err("row 2 differs");
        assert!(matches!(mismatch, Mismatch::Row { row: 2, .. }), "{mismatch}");
        let mismatch = compare(&resident[..3], &[]).expect_err("a row is missing");
        assert_eq!(mismatch, Mismatch::Length { buffer: "mesh_descs", derived: 4, resident: 3 });
        // What a later batch has cut off again is nowhere.
        assert_eq!(compare(&derived, &[3..9, 20..30]), Ok(()));
    }
}
