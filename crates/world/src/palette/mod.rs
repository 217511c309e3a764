//! The palette: which materials a world has, by name and by number.

mod material;

pub use material::{Material, MaterialError, Pattern, Texture3, Transparency};

use crate::block::{Block, BlockId};
use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The materials of a world. Names are unique; a material's number never changes and none goes.
#[derive(Clone, Debug, Default)]
pub struct Palette {
    /// By id; the gaps are ids that a patch named before anyone defined them.
    by_id: BTreeMap<BlockId, Arc<Material>>,
    by_name: FxHashMap<Arc<str>, BlockId>,
}

/// A material that a patch brings, under the number that the patch's blocks call it by.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PaletteEntry {
    /// The number in the patch.
    pub id: BlockId,
    /// The material.
    pub material: Material,
}

/// What becomes of an entry whose name the palette has with another content.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum OnConflict {
    /// The patch is refused.
    #[default]
    Refuse,
    /// The palette's material stays, and the patch's blocks have it.
    Keep,
    /// The patch's material takes its place, also for the blocks that are there.
    Replace,
}

/// Why entries were refused. The palette is then unchanged.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PaletteError {
    /// A name with two meanings.
    #[error(
        "the palette has another material of the name {name:?}; rename it, or say whether to keep or to replace it"
    )]
    Conflict {
        /// The name.
        name: String,
    },
    /// Two entries of one patch with one number or one name.
    #[error("two entries of the patch have the {what}; give each its own")]
    Twice {
        /// The number or the name.
        what: String,
    },
    /// Number 0 is taken.
    #[error("material {name:?} has the number 0, which is air; number materials from 1")]
    Air {
        /// The material's name.
        name: String,
    },
    /// No number is left.
    #[error("the palette is full: it has 65,535 materials")]
    Full,
    /// A value that no material has.
    #[error("material {name:?}: {fault}")]
    Material {
        /// The material's name.
        name: String,
        /// What is wrong with it.
        fault: MaterialError,
    },
}

/// What [`Palette::plan`] found: how the numbers of a patch translate, and what is to be written.
#[derive(Clone, Debug, Default)]
pub struct PalettePlan {
    /// Numbers of the patch that differ from those of the palette.
    translation: FxHashMap<BlockId, BlockId>,
    /// New and replaced materials under the palette's numbers.
    writes: Vec<(BlockId, Arc<Material>)>,
}

impl PalettePlan {
    /// A block of the patch in the numbers of the palette.
    pub fn translate(&self, block: Block) -> Block {
        match self.translation.get(&block.id()) {
            Some(&id) => block.with_id(id),
            None => block,
        }
    }

    /// Whether any number changes.
    pub fn translates(&self) -> bool {
        !self.translation.is_empty()
    }

    /// The numbers whose materials are new or other than before.
    pub fn written(&self) -> impl Iterator<Item = BlockId> + '_ {
        self.writes.iter().map(|(id, _)| *id)
    }
}

impl Palette {
    /// A palette with air alone.
    pub fn new() -> Self {
        Self::default()
    }

    /// The material of a number; `None` for air and for a number that nothing has defined, which is drawn in a warning
    /// colour.
    pub fn get(&self, id: BlockId) -> Option<&Arc<Material>> {
        self.by_id.get(&id)
    }

    /// The number of a name.
    pub fn id_of(&self, name: &str) -> Option<BlockId> {
        self.by_name.get(name).copied()
    }

    /// Every material by number, in ascending order.
    pub fn iter(&self) -> impl Iterator<Item = (BlockId, &Arc<Material>)> + '_ {
        self.by_id.iter().map(|(&id, material)| (id, material))
    }

    /// How many materials there are.
    pub fn len(&self) -> usize {
        self.by_id.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.by_id.is_empty()
    }

    /// What adding entries would do. Nothing changes yet.
    ///
    /// An entry whose name is known gets the palette's number; `on_conflict` says what becomes of another content. A new
    /// name gets the number that it asks for, or the next free one if that is taken.
    ///
    /// # Errors
    /// [`PaletteError`].
    pub fn plan(&self, entries: &[PaletteEntry], on_conflict: OnConflict) -> Result<PalettePlan, PaletteError> {
        let mut plan = PalettePlan::default();
        let mut asked = FxHashMap::default();
        let mut named = FxHashMap::default();
        for entry in entries {
            let name = &entry.material.name;
            let fault = |fault| PaletteError::Material { name: name.to_string(), fault };
            entry.material.check().map_err(fault)?;
            if entry.id == BlockId::AIR {
                return Err(PaletteError::Air { name: name.to_string() });
            }
            if asked.insert(entry.id, ()).is_some() {
                return Err(PaletteError::Twice { what: format!("number {}", entry.id.0) });
            }
            if named.insert(name.clone(), ()).is_some() {
                return Err(PaletteError::Twice { what: format!("name {name:?}") });
            }
        }
        let mut taken = FxHashMap::default();
        let mut next = 1_u32;
        for entry in entries {
            let known = self.by_name.get(&entry.material.name).copied();
            let id = match known {
                Some(id) => id,
                None if !self.by_id.contains_key(&entry.id) && !taken.contains_key(&entry.id) => entry.id,
                None => loop {
                    let id = BlockId(u16::try_from(next).map_err(|_| PaletteError::Full)?);
                    // A number that another entry asks for is left to it.
                    if !self.by_id.contains_key(&id) && !taken.contains_key(&id) && !asked.contains_key(&id) {
                        break id;
                    }
                    next += 1;
                },
            };
            taken.insert(id, ());
            if id != entry.id {
                plan.translation.insert(entry.id, id);
            }
            let same = known.and_then(|id| self.by_id.get(&id)).map(|material| **material == entry.material);
            let write = match (same, on_conflict) {
                (None, _) | (Some(false), OnConflict::Replace) => true,
                (Some(true), _) | (Some(false), OnConflict::Keep) => false,
                (Some(false), OnConflict::Refuse) => {
                    return Err(PaletteError::Conflict { name: entry.material.name.to_string() });
                }
            };
            if write {
                plan.writes.push((id, Arc::new(entry.material.clone())));
            }
        }
        Ok(plan)
    }

    /// Carries a plan out. It must be a plan of this palette as it is.
    pub(crate) fn commit(&mut self, plan: &PalettePlan) {
        for (id, material) in &plan.writes {
            self.by_name.insert(material.name.clone(), *id);
            self.by_id.insert(*id, material.clone());
        }
    }

    /// Adds a material, and gives its number; that of an equal one if there is one.
    ///
    /// # Errors
    /// [`PaletteError`] as with [`OnConflict::Refuse`].
    pub fn add(&mut self, material: Material) -> Result<BlockId, PaletteError> {
        let free = (1..=u16::MAX).map(BlockId).find(|id| !self.by_id.contains_key(id));
        let known = self.id_of(&material.name);
        let id = known.or(free).ok_or(PaletteError::Full)?;
        let plan = self.plan(&[PaletteEntry { id, material }], OnConflict::Refuse)?;
        self.commit(&plan);
        Ok(id)
    }

    /// Every material as entries under the palette's numbers.
    pub fn entries(&self) -> Vec<PaletteEntry> {
        self.iter().map(|(id, material)| PaletteEntry { id, material: (**material).clone() }).collect()
    }
}

/// By number and content.
impl PartialEq for Palette {
    fn eq(&self, other: &Self) -> bool {
        self.by_id == other.by_id
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(id: u16, name: &str, red: f32) -> PaletteEntry {
        PaletteEntry { id: BlockId(id), material: Material::colored(name, [red, 0.0, 0.0]) }
    }

    #[test]
    fn an_equal_material_gets_the_number_that_it_has() {
        let mut palette = Palette::new();
        let stone = palette.add(Material::colored("stone", [0.5; 3])).unwrap();
        assert_eq!(palette.add(Material::colored("stone", [0.5; 3])), Ok(stone));
        assert_eq!(palette.len(), 1);
    }

    #[test]
    fn a_number_that_is_taken_is_translated() {
        let mut palette = Palette::new();
        let plan = palette.plan(&[entry(1, "a", 0.0)], OnConflict::Refuse).unwrap();
        palette.commit(&plan);
        let plan = palette.plan(&[entry(1, "b", 0.0), entry(2, "c", 0.0)], OnConflict::Refuse).unwrap();
        let block = |id| Block::of(BlockId(id), crate::Scale::UNIT);
        assert_eq!(plan.translate(block(1)), block(3), "2 is asked for by the other entry");
        assert_eq!(plan.translate(block(2)), block(2));
        palette.commit(&plan);
        assert_eq!(palette.id_of("b"), Some(BlockId(3)));
    }

    #[test]
    fn one_name_has_one_meaning() {
        let mut palette = Palette::new();
        palette.commit(&palette.plan(&[entry(1, "a", 0.0)], OnConflict::Refuse).unwrap());
        let other = [entry(5, "a", 1.0)];
        assert_eq!(
            palette.plan(&other, OnConflict::Refuse).unwrap_err(),
            PaletteError::Conflict { name: "a".to_owned() }
        );
        let keep = palette.plan(&other, OnConflict::Keep).unwrap();
        assert_eq!(keep.written().count(), 0);
        let replace = palette.plan(&other, OnConflict::Replace).unwrap();
        assert_eq!(replace.written().collect::<Vec<_>>(), [BlockId(1)]);
        palette.commit(&replace);
        assert_eq!(palette.get(BlockId(1)).unwrap().color, [1.0, 0.0, 0.0]);
    }

    #[test]
    fn entries_that_contradict_each_other_are_refused() {
        let palette = Palette::new();
        let twice = [entry(1, "a", 0.0), entry(1, "b", 0.0)];
        assert!(matches!(palette.plan(&twice, OnConflict::Keep), Err(PaletteError::Twice { .. })));
        let twice = [entry(1, "a", 0.0), entry(2, "a", 0.0)];
        assert!(matches!(palette.plan(&twice, OnConflict::Keep), Err(PaletteError::Twice { .. })));
        assert!(matches!(palette.plan(&[entry(0, "a", 0.0)], OnConflict::Keep), Err(PaletteError::Air { .. })));
        assert!(matches!(palette.plan(&[entry(1, "a", -1.0)], OnConflict::Keep), Err(PaletteError::Material { .. })));
    }
}
