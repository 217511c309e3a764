//! Following edits: from what was touched to the writes that bring a backend up to date.
//!
//! [`DerivedScene::sync`] reaches the state that a full derivation of the edited document under the new pose would have, but
//! for the numbering of slots, at a cost of the order of what was touched. What a new pose touches is where it differs from
//! the one before: from there on it is like an edit. A change set says where to look, not what is there: each
//! part compares what it has with what the document says now, and marks the rows that differ.
//!
//! The order of the parts: meshes and materials, whose users are then touched too ([`resources`]); world matrices and
//! visibility, top down ([`nodes`]); geometry that is new, or that a pose deforms anew ([`geometry`]); the rows of render
//! nodes, lights and emitters ([`rows`]); the batch.

mod dirty;
mod extent;
mod geometry;
mod holes;
mod nodes;
mod occupancy;
pub mod oracle;
mod recover;
mod registry;
mod resources;
mod rows;
mod textures;
mod tlas;

pub use tlas::{TlasPolicy, TlasState};

use super::materials::Materials;
use super::primitives::PrimitiveTable;
use super::{DeriveOptions, DerivedScene, material_row};
use crate::DeriveError;
use crate::geometry::{GeometryStore, SkinPose};
use dirty::DirtyRows;
use extent::SceneExtent;
use glam::Vec3;
use orthant_resident::SceneBatch;
use orthant_resident::batch::{ImageWrite, TlasAction};
use orthant_resident::spans::SpanAllocator;
use orthant_scene::Scene;
use orthant_scene::animation::{Pose, Posed};
use orthant_scene::edit::ChangeSet;
use orthant_scene::model::{MeshId, NodeId, SceneId, VariantId};
use registry::Registry;
use rustc_hash::{FxHashMap, FxHashSet};
use std::borrow::Cow;
use std::collections::BTreeSet;
use textures::TextureTable;

/// Room for rows to come that arrays of a scene keep which is edited.
pub(super) fn slack(rows: usize) -> usize {
    rows / 8 + 1024
}

/// What a sync found and wrote.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct SyncReport {
    /// Render-node rows that changed.
    pub render_nodes: u32,
    /// Whether the render-node buffer is written whole.
    pub whole: bool,
    /// Material rows that changed.
    pub materials: u32,
    /// Light rows that changed.
    pub lights: u32,
    /// Emitter rows that changed.
    pub emitters: u32,
    /// Whether geometry came, went or changed.
    pub primitives_changed: bool,
    /// Render-node rows that are written, those between changed ones included.
    pub instances_written: u32,
    /// What the TLAS needs.
    pub tlas: TlasAction,
    /// BLAS that are built.
    pub blas_built: u32,
    /// BLAS that are updated: their vertices have moved.
    pub blas_updated: u32,
    /// Bytes that cross to the backend, images apart.
    pub upload_bytes: u64,
    /// Nodes that were looked at.
    pub visited: u64,
}

/// What following edits needs besides the rows.
#[derive(Clone, Debug)]
pub(crate) struct Live {
    shown: Option<SceneId>,
    /// The variant that the caller of the derivation asked for; the document's own choice counts where it did not.
    asked_variant: Option<VariantId>,
    variant: Option<VariantId>,
    images: bool,
    /// Most bytes that geometry and images may take, and that the rows of one node may.
    max_bytes: u64,
    /// By material row: the UV set that its normal map wants tangents for.
    tangent_sets: Vec<Option<u32>>,
    registry: Registry,
    textures: TextureTable,
    /// By material row.
    mean_emission: Vec<Vec3>,
    store: GeometryStore,
    node_spans: SpanAllocator,
    /// Entries of the hierarchy that hold no node.
    free_entries: Vec<u32>,
    /// By entry of the hierarchy: the sync in which it was brought up to date last.
    stamps: Vec<u32>,
    stamp: u32,
    /// The pose of each node that deforms its mesh, as it is resident.
    poses: FxHashMap<NodeId, SkinPose>,
    free_lights: Vec<u32>,
    free_emitters: Vec<u32>,
    tlas: TlasState,
    extent: SceneExtent,
    dirty: Dirty,
    /// Rows that the backend has.
    resident: Resident,
    revision: u64,
    /// The last sync failed: rows may be of neither state.
    has_failed: bool,
}

#[derive(Clone, Debug, Default)]
struct Dirty {
    render_nodes: DirtyRows,
    materials: DirtyRows,
    lights: DirtyRows,
    emitters: DirtyRows,
    mesh_descs: DirtyRows,
    textures: DirtyRows,
    blas_builds: BTreeSet<u32>,
    blas_updates: BTreeSet<u32>,
    blas_frees: BTreeSet<u32>,
    images: Vec<ImageWrite>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Resident {
    render_nodes: u32,
    materials: u32,
    lights: u32,
    emitters: u32,
    mesh_descs: u32,
    textures: u32,
}

/// What one sync still has to do.
#[derive(Default)]
struct Work {
    /// Nodes whose place, transform, visibility or content may have changed.
    nodes: FxHashSet<NodeId>,
    /// Those of them that hang elsewhere now.
    placed: FxHashSet<NodeId>,
    /// Nodes whose rows are to be made anew, in the order in which they were reached.
    refill: Vec<NodeId>,
    queued: FxHashSet<NodeId>,
    /// Nodes whose geometry is deformed by what has moved.
    poses: BTreeSet<NodeId>,
    /// Render nodes whose emission may have changed.
    emission: Vec<u32>,
    /// Meshes that are new.
    new_meshes: Vec<MeshId>,
    visited: u64,
}

/// What is kept of the derivation's materials.
pub(super) struct Kept {
    textures: TextureTable,
    mean_emission: Vec<Vec3>,
}

impl Kept {
    pub fn of(materials: &Materials) -> Self {
        Self { textures: TextureTable::new(materials), mean_emission: materials.mean_emission.clone() }
    }
}

impl Work {
    fn refill(&mut self, node: NodeId) {
        if self.queued.insert(node) {
            self.refill.push(node);
        }
    }
}

impl Live {
    /// What a full derivation has made.
    pub(super) fn new(
        scene: &Scene,
        options: &DeriveOptions,
        table: &PrimitiveTable,
        kept: Kept,
        derived: &DerivedScene,
    ) -> Self {
        let count = |rows: usize| rows as u32;
        let posed = Posed::new(scene, &options.pose);
        let mut textures = kept.textures;
        for (id, _) in scene.materials().iter() {
            textures.note_conversion(id, &posed.material(id), &derived.materials[material_row(Some(id)) as usize]);
        }
        let tlas = TlasState::built(TlasPolicy::default(), &derived.render_nodes, &derived.mesh_descs);
        Self {
            shown: nodes::shown_scene(scene, options.scene),
            asked_variant: options.variant,
            variant: options.variant.or(scene.shown_variant()),
            images: options.images,
            max_bytes: options.max_bytes,
            tangent_sets: resources::tangent_sets(scene),
            registry: Registry::new(scene, table),
            textures,
            mean_emission: kept.mean_emission,
            store: GeometryStore::of(&derived.mesh_descs),
            node_spans: SpanAllocator::packed(count(derived.render_nodes.len())),
            free_entries: Vec::new(),
            stamps: {
                let nodes = derived.hierarchy.nodes.len();
                let mut stamps = Vec::with_capacity(nodes + slack(nodes));
                stamps.resize(nodes, 0);
                stamps
            },
            stamp: 0,
            poses: table
                .deformed_nodes()
                .filter(|(node, _)| derived.hierarchy.get(*node).is_some())
                .map(|(node, _)| (node, derived.hierarchy.skin_pose(posed, node)))
                .collect(),
            free_lights: Vec::new(),
            free_emitters: Vec::new(),
            extent: SceneExtent::new(derived.render_nodes.len(), |row| tlas.extent(row)),
            tlas,
            dirty: Dirty::default(),
            resident: Resident {
                render_nodes: count(derived.render_nodes.len()),
                materials: count(derived.materials.len()),
                lights: count(derived.lights.len()),
                emitters: count(derived.emitters.len()),
                mesh_descs: count(derived.mesh_descs.len()),
                textures: count(derived.textures.len()),
            },
            revision: 1,
            has_failed: false,
        }
    }
}

impl Live {
    /// Bytes that geometry and images may still take.
    fn bytes_left(&self) -> u64 {
        self.max_bytes.saturating_sub(self.store.bytes()).saturating_sub(self.textures.image_bytes())
    }
}

fn not_live() -> DeriveError {
    let what = "the scene was derived to be shown once, and cannot follow edits";
    DeriveError::new("", what, "derive it with DeriveOptions::live")
}

impl DerivedScene {
    /// Follows edits and poses. `changes` is what edits touched since the derivation or the last sync; `pose` is what is
    /// shown on top of the document now, whatever it was before. The batch brings a backend from the revision of the last
    /// batch to the next. A pose that is another costs the nodes on which the two differ and what hangs below them.
    ///
    /// # Errors
    /// If the scene was derived without [`DeriveOptions::live`], or what is new cannot be decoded or is more than
    /// [`DeriveOptions::max_bytes`]. The rows may be those of neither state then, and a backend is still at the last batch:
    /// take the edit back and sync again. The first sync after one that failed derives everything anew, whatever `changes`
    /// says, and its batch writes all of it.
    pub fn sync(
        &mut self,
        scene: &Scene,
        pose: &Pose,
        changes: &ChangeSet,
    ) -> Result<(SceneBatch, SyncReport), DeriveError> {
        if self.live.as_ref().is_some_and(|live| live.has_failed) {
            return self.derive_anew(scene, pose);
        }
        let Some(mut live) = self.live.take() else { return Err(not_live()) };
        let mut all = Cow::Borrowed(changes);
        if self.pose != *pose {
            all.to_mut().merge(&self.pose.difference(pose, scene));
            self.pose = pose.clone();
        }
        let posed = Posed::new(scene, pose);
        let result = Sync { derived: self, live: &mut live, scene, posed, work: Work::default() }.run(&all);
        live.has_failed = result.is_err();
        self.live = Some(live);
        result
    }

    /// The revision of the last batch: 1 after the derivation.
    pub fn revision(&self) -> u64 {
        self.live.as_ref().map_or(1, |live| live.revision)
    }

    /// How much updates may degrade the TLAS.
    pub fn set_tlas_policy(&mut self, policy: TlasPolicy) {
        if let Some(live) = &mut self.live {
            live.tlas.policy = policy;
        }
    }

    /// Rows of the render-node buffer that hold no instance.
    pub fn free_render_nodes(&self) -> u32 {
        self.live.as_ref().map_or(0, |live| self.render_nodes.len() as u32 - live.node_spans.used())
    }
}

/// One sync.
struct Sync<'s> {
    derived: &'s mut DerivedScene,
    live: &'s mut Live,
    scene: &'s Scene,
    /// The same under the pose.
    posed: Posed<'s>,
    work: Work,
}

impl Sync<'_> {
    fn run(mut self, changes: &ChangeSet) -> Result<(SceneBatch, SyncReport), DeriveError> {
        self.live.stamp += 1;
        self.resources(changes)?;
        self.nodes(changes);
        self.geometry()?;
        self.prove_unshown()?;
        self.rows()?;
        self.emission()?;
        Ok(self.batch())
    }

    fn batch(mut self) -> (SceneBatch, SyncReport) {
        let Self { derived, live, work, .. } = &mut self;
        let dirty = &mut live.dirty;
        let mut report = SyncReport {
            render_nodes: dirty.render_nodes.len() as u32,
            materials: dirty.materials.len() as u32,
            lights: dirty.lights.len() as u32,
            emitters: dirty.emitters.len() as u32,
            visited: work.visited,
            ..SyncReport::default()
        };
        let geometry = live.store.take_writes();
        let blas_builds: Vec<u32> = std::mem::take(&mut dirty.blas_builds).into_iter().collect();
        let mut blas_updates = std::mem::take(&mut dirty.blas_updates);
        blas_updates.retain(|slot| blas_builds.binary_search(slot).is_err());
        let mut blas_frees = std::mem::take(&mut dirty.blas_frees);
        blas_frees.retain(|slot| blas_builds.binary_search(slot).is_err());
        report.primitives_changed = !dirty.mesh_descs.is_empty() || !blas_builds.is_empty() || !blas_frees.is_empty();
        let rows = derived.render_nodes.len();
        live.extent.update(dirty.render_nodes.marked(), rows, |row| live.tlas.extent(row));
        let resident = live.resident;
        let tlas = live.tlas.take();
        let batch = SceneBatch {
            expected_revision: live.revision,
            new_revision: live.revision + 1,
            positions: geometry.positions,
            vertices: geometry.vertices,
            indices: geometry.indices,
            tangents: geometry.tangents,
            mesh_descs: dirty.mesh_descs.writes(&derived.mesh_descs, resident.mesh_descs),
            blas_builds,
            blas_updates: blas_updates.into_iter().collect(),
            blas_frees: blas_frees.into_iter().collect(),
            images: std::mem::take(&mut dirty.images),
            textures: dirty.textures.writes(&derived.textures, resident.textures),
            materials: dirty.materials.writes(&derived.materials, resident.materials),
            lights: dirty.lights.writes(&derived.lights, resident.lights),
            emitter_triangles: geometry.emitter_triangles,
            emitters: dirty.emitters.writes(&derived.emitters, resident.emitters),
            render_nodes: dirty.render_nodes.writes(&derived.render_nodes, resident.render_nodes),
            tlas,
            scene_radius: live.extent.radius(),
        };
        live.revision += 1;
        let count = |rows: usize| rows as u32;
        live.resident = Resident {
            render_nodes: count(derived.render_nodes.len()),
            materials: count(derived.materials.len()),
            lights: count(derived.lights.len()),
            emitters: count(derived.emitters.len()),
            mesh_descs: count(derived.mesh_descs.len()),
            textures: count(derived.textures.len()),
        };
        report.tlas = tlas;
        report.blas_built = batch.blas_builds.len() as u32;
        report.blas_updated = batch.blas_updates.len() as u32;
        report.upload_bytes = batch.upload_bytes();
        report.instances_written = batch.render_nodes.ranges.iter().map(|range| range.rows.len() as u32).sum();
        report.whole = report.instances_written > 0 && report.instances_written as usize == derived.render_nodes.len();
        (batch, report)
    }

    /// Whether a node deforms its mesh.
    fn is_deformed(&self, node: NodeId) -> bool {
        super::primitives::is_deformed(&self.scene.nodes()[node], self.scene)
    }
}
