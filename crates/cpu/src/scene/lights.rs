//! What light tables look at of the scene.

use super::ResidentScene;
use orthant_resident::SceneBatch;
use orthant_resident::lights::{LightChanges, LightRows};
use orthant_resident::rows::{EmitterRow, LightRow, MeshDesc, NONE, RenderNodeRow};

impl ResidentScene {
    /// What of the lights a batch may change. O(the batch).
    pub fn light_changes(&self, batch: &SceneBatch) -> LightChanges {
        let emitter_of = |row: u32| self.render_nodes.get(row as usize).map_or(NONE, |row| row.emitter);
        LightChanges::new(self.lights.len(), emitter_of, batch)
    }
}

impl LightRows for ResidentScene {
    fn lights(&self) -> &[LightRow] {
        &self.lights
    }

    fn emitters(&self) -> &[EmitterRow] {
        &self.emitters
    }

    fn emitting_node(&self, row: u32) -> Option<&RenderNodeRow> {
        self.render_nodes.get(row as usize)
    }

    fn mesh_desc(&self, primitive: u32) -> Option<&MeshDesc> {
        self.mesh_descs.get(primitive as usize)
    }

    fn first_triangle(&self, primitive: u32) -> Option<[[f32; 3]; 3]> {
        let desc = self.mesh_descs.get(primitive as usize)?;
        let indices = self.indices.get(desc.first_index as usize..)?.first_chunk::<3>()?;
        let position = |&i: &u32| self.positions.get(desc.first_vertex as usize + i as usize).copied();
        let [a, b, c] = indices.each_ref().map(position);
        Some([a?, b?, c?])
    }
}
