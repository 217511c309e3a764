//! Scenes for the tests of this crate.

use super::ResidentScene;
use glam::DAffine3;
use orthant_resident::batch::{RowWrites, SceneBatch, TlasAction};
use orthant_resident::rows::{Mat3x4, MeshDesc, NONE, NodeFlags, RenderNodeRow, VertexRow};

/// Triangles with shared vertices.
#[derive(Clone, Debug, Default)]
pub(crate) struct TestMesh {
    pub positions: Vec<[f32; 3]>,
    pub indices: Vec<u32>,
}

/// A batch that changes nothing of an empty scene.
pub(crate) fn empty_batch() -> SceneBatch {
    SceneBatch {
        expected_revision: 0,
        new_revision: 1,
        positions: RowWrites::none(0),
        vertices: RowWrites::none(0),
        indices: RowWrites::none(0),
        tangents: RowWrites::none(0),
        mesh_descs: RowWrites::none(0),
        blas_builds: Vec::new(),
        blas_updates: Vec::new(),
        blas_frees: Vec::new(),
        images: Vec::new(),
        textures: RowWrites::none(0),
        materials: RowWrites::none(0),
        lights: RowWrites::none(0),
        emitter_triangles: RowWrites::none(0),
        emitters: RowWrites::none(0),
        render_nodes: RowWrites::none(0),
        tlas: TlasAction::None,
        scene_radius: 1.0,
    }
}

/// A batch that writes nothing to a scene and leaves it as it is.
pub(crate) fn batch_on(scene: &ResidentScene) -> SceneBatch {
    SceneBatch {
        expected_revision: scene.revision,
        new_revision: scene.revision + 1,
        positions: RowWrites::none(scene.positions.len() as u32),
        vertices: RowWrites::none(scene.vertices.len() as u32),
        indices: RowWrites::none(scene.indices.len() as u32),
        tangents: RowWrites::none(scene.tangents.len() as u32),
        mesh_descs: RowWrites::none(scene.mesh_descs.len() as u32),
        textures: RowWrites::none(scene.textures.len() as u32),
        materials: RowWrites::none(scene.materials.len() as u32),
        lights: RowWrites::none(scene.lights.len() as u32),
        emitter_triangles: RowWrites::none(scene.emitter_triangles.len() as u32),
        emitters: RowWrites::none(scene.emitters.len() as u32),
        render_nodes: RowWrites::none(scene.render_nodes.len() as u32),
        ..empty_batch()
    }
}

/// The row of an instance; `flags` are added to those that make it seen, and to MIRRORED where the matrix is.
pub(crate) fn instance(primitive: u32, world: DAffine3, flags: u32) -> RenderNodeRow {
    let mirrored = if world.matrix3.determinant() < 0.0 { NodeFlags::MIRRORED } else { 0 };
    RenderNodeRow {
        world: Mat3x4::from_affine(&world),
        inverse: Mat3x4::from_affine(&world.inverse()),
        primitive,
        material: 0,
        node: 0,
        flags: NodeFlags::OCCUPIED | NodeFlags::VISIBLE | mirrored | flags,
        emitter: NONE,
        reserved: [0; 3],
    }
}

/// The batch that loads meshes and instances into an empty scene.
pub(crate) fn load_batch(meshes: &[TestMesh], render_nodes: Vec<RenderNodeRow>) -> SceneBatch {
    let mut positions = Vec::new();
    let mut indices = Vec::new();
    let mut descs = Vec::new();
    for mesh in meshes {
        descs.push(MeshDesc {
            first_vertex: positions.len() as u32,
            vertex_count: mesh.positions.len() as u32,
            first_index: indices.len() as u32,
            index_count: mesh.indices.len() as u32,
            first_tangent: NONE,
            first_emitter_triangle: NONE,
            ..bytemuck::Zeroable::zeroed()
        });
        positions.extend_from_slice(&mesh.positions);
        indices.extend_from_slice(&mesh.indices);
    }
    let vertices: Vec<VertexRow> = vec![bytemuck::Zeroable::zeroed(); positions.len()];
    SceneBatch {
        positions: RowWrites::whole(positions),
        vertices: RowWrites::whole(vertices),
        indices: RowWrites::whole(indices),
        mesh_descs: RowWrites::whole(descs),
        blas_builds: (0..meshes.len() as u32).collect(),
        render_nodes: RowWrites::whole(render_nodes),
        tlas: TlasAction::Rebuild,
        ..empty_batch()
    }
}

/// A scene of meshes and instances.
pub(crate) fn scene(meshes: &[TestMesh], render_nodes: Vec<RenderNodeRow>) -> ResidentScene {
    let mut scene = ResidentScene::new();
    scene.apply(load_batch(meshes, render_nodes)).expect("the batch of a test is valid");
    scene
}
