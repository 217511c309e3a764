//! The derived scene: everything that a renderer needs, as flat rows in the layouts of `orthant-resident`.
//!
//! The definition is [`DerivedScene::derive`], which walks the whole model. Its parts, in the order in which they are
//! made: the primitives ([`primitives`]), the world matrices ([`hierarchy`]), the decoded geometry
//! ([`crate::geometry`]), images, textures and materials ([`materials`]), the origin and the render nodes
//! ([`render_nodes`]), lights and emitters ([`lights`], [`emitters`]).
//!
//! Geometry and images are handed to the backend and not kept; rows are kept as a mirror.

pub mod emitters;
pub mod hierarchy;
pub mod lights;
pub mod materials;
pub mod primitives;
pub mod render_nodes;
mod specular_glossiness;
pub mod sync;

use crate::budget::Budget;
use crate::geometry::{GeometryPlan, GeometryStreams, RenderPrimitive};
use crate::textures::{ImageLimits, Levels};
use crate::{DeriveError, DeriveWarning};
use glam::{DAffine3, DVec3, Vec3};
use hierarchy::{DerivedNode, Hierarchy};
use orthant_resident::SceneBatch;
use orthant_resident::batch::{ImageWrite, RowWrites, TextureRow, TlasAction};
use orthant_resident::compare::Rows;
use orthant_resident::extent::scene_radius;
use orthant_resident::rows::{EmitterRow, LightRow, MaterialRow, MeshDesc, NodeFlags, RenderNodeRow};
use orthant_scene::Scene;
use orthant_scene::animation::{Pose, Posed};
use orthant_scene::model::{NodeId, SceneId, Store, VariantId};
use std::time::{Duration, Instant};

/// What part of a document is derived, and how.
#[derive(Clone, Debug)]
pub struct DeriveOptions {
    /// The scene to show; `None` is the document's default one, else its first, else all root nodes.
    pub scene: Option<SceneId>,
    /// The material variant to show.
    pub variant: Option<VariantId>,
    /// Decode images. Without it, materials show their factors (for counting and measuring).
    pub images: bool,
    /// Most bytes that rows, streams and images may take together. Documents are small and can ask for much: an instancing
    /// accessor without data declares a billion instances in a hundred bytes.
    pub max_bytes: u64,
    /// Keep what following edits needs ([`DerivedScene::sync`]).
    pub live: bool,
    /// What an animation says of the scene at the time that is shown. The default is the rest pose.
    pub pose: Pose,
    /// The origin of everything resident. `None` is chosen by where the scene is; edits do not move it, so that what is compared
    /// with a scene that was edited is derived about the same.
    pub origin: Option<DVec3>,
}

impl Default for DeriveOptions {
    fn default() -> Self {
        Self {
            scene: None,
            variant: None,
            images: true,
            max_bytes: u64::MAX,
            live: false,
            pose: Pose::default(),
            origin: None,
        }
    }
}

/// Time that the parts of a derivation took. Geometry and images are decoded side by side.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DeriveTimes {
    /// Accessors to streams, until the last was ready.
    pub geometry: Duration,
    /// Encoded images to mip chains, until the last was ready.
    pub images: Duration,
    /// Everything else: hierarchy, rows.
    pub rows: Duration,
}

/// The derived scene.
#[derive(Clone, Debug, Default)]
pub struct DerivedScene {
    /// The point of the document's world that is the origin of everything resident, in metres.
    pub origin: DVec3,
    /// The nodes that the scene shows, parents before children.
    pub hierarchy: Hierarchy,
    /// RenderPrimitives by index.
    pub primitives: Vec<RenderPrimitive>,
    /// Their MeshDescs.
    pub mesh_descs: Vec<MeshDesc>,
    /// Instances.
    pub render_nodes: Vec<RenderNodeRow>,
    /// The index in `hierarchy.nodes` of the node that a render node shows.
    pub owners: Vec<u32>,
    /// Materials: row 0 is the default material, row `slot + 1` the document's.
    pub materials: Vec<MaterialRow>,
    /// Textures.
    pub textures: Vec<TextureRow>,
    /// Punctual lights.
    pub lights: Vec<LightRow>,
    /// Emissive render nodes.
    pub emitters: Vec<EmitterRow>,
    /// What is shown otherwise than the document says.
    pub warnings: Vec<DeriveWarning>,
    /// The pose that is shown: of the derivation, or of the last sync.
    pub pose: Pose,
    /// Time that the parts took.
    pub times: DeriveTimes,
    streams: GeometryStreams,
    images: Vec<ImageWrite>,
    /// The scene that the caller asked for.
    asked_scene: Option<SceneId>,
    live: Option<Box<sync::Live>>,
}

impl DerivedScene {
    /// Derives everything from the model, under the pose that the options name.
    pub fn derive(scene: &Scene, options: &DeriveOptions) -> Result<Self, DeriveError> {
        let start = Instant::now();
        let budget = Budget::new(options.max_bytes);
        let mut warnings = Vec::new();
        let variant = options.variant.or(scene.shown_variant());
        let table = primitives::register(scene, variant, &mut warnings);
        let posed = Posed::new(scene, &options.pose);
        let mut hierarchy = Hierarchy::build(posed, options.scene, &table)?;

        // Geometry and images side by side: a mesh whose tangents are made keeps one thread busy for long.
        let start_of_data = Instant::now();
        let emissive = emitters::emissive_primitives(posed, &table);
        let plan = GeometryPlan::new(scene, &table.primitives, &emissive, &budget)?;
        let limits = ImageLimits { max_bytes: budget.left(), levels: Levels::All };
        let decode_geometry = || {
            let pose = |i: usize| table.primitives[i].deformed_by.map(|node| hierarchy.skin_pose(posed, node));
            (plan.decode(&pose), start_of_data.elapsed())
        };
        let decode_images = || {
            let materials = materials::derive(posed, options.images.then_some(limits), &mut warnings);
            (materials, start_of_data.elapsed())
        };
        let ((streams, geometry), (materials, images)) = rayon::join(decode_geometry, decode_images);
        let (streams, materials) = (streams?, materials?);
        let data = start_of_data.elapsed();
        let image_bytes: usize = materials.images.iter().flat_map(|w| &w.image).map(|image| image.texels.len()).sum();
        budget.charge(image_bytes as u64).map_err(|over| DeriveError::over_budget("/images", "the images", over))?;

        let origin = options.origin.unwrap_or_else(|| hierarchy.origin(&table, &streams.mesh_descs));
        let nodes =
            render_nodes::derive(posed, &mut hierarchy, &table, &materials.rows, &streams.mesh_descs, origin, &budget)?;
        let (mut rows, owners) = (nodes.rows, nodes.owners);
        let lights = lights::derive(posed, &mut hierarchy, origin);
        let emitters = emitters::derive(&mut rows, &streams.mesh_descs, &materials);
        let times = DeriveTimes { geometry, images, rows: start.elapsed().saturating_sub(data) };
        let kept = options.live.then(|| sync::Kept::of(&materials));
        let mut derived = Self {
            origin,
            hierarchy,
            primitives: table.primitives.clone(),
            mesh_descs: streams.mesh_descs.clone(),
            render_nodes: rows,
            owners,
            materials: materials.rows,
            textures: materials.textures,
            lights,
            emitters,
            warnings,
            pose: options.pose.clone(),
            times,
            streams,
            images: materials.images,
            asked_scene: options.scene,
            live: None,
        };
        derived.streams.mesh_descs = Vec::new();
        if let Some(kept) = kept {
            derived.live = Some(Box::new(sync::Live::new(scene, options, &table, kept, &derived)));
            derived.render_nodes.reserve(sync::slack(derived.render_nodes.len()));
            derived.owners.reserve(sync::slack(derived.owners.len()));
            derived.hierarchy.reserve(sync::slack(derived.hierarchy.nodes.len()));
        }
        Ok(derived)
    }

    /// The batch that makes an empty backend show this scene. Geometry and images move into it: a second call has rows
    /// only and is meant for a backend that has them already.
    pub fn load_batch(&mut self) -> SceneBatch {
        let streams = std::mem::take(&mut self.streams);
        SceneBatch {
            expected_revision: 0,
            new_revision: 1,
            blas_builds: (0..self.mesh_descs.len() as u32)
                .filter(|&i| self.mesh_descs[i as usize].index_count > 0)
                .collect(),
            blas_updates: Vec::new(),
            blas_frees: Vec::new(),
            positions: RowWrites::whole(streams.positions),
            vertices: RowWrites::whole(streams.vertices),
            indices: RowWrites::whole(streams.indices),
            tangents: RowWrites::whole(streams.tangents),
            mesh_descs: RowWrites::whole(self.mesh_descs.clone()),
            images: std::mem::take(&mut self.images),
            textures: RowWrites::whole(self.textures.clone()),
            materials: RowWrites::whole(self.materials.clone()),
            lights: RowWrites::whole(self.lights.clone()),
            emitter_triangles: RowWrites::whole(streams.emitter_triangles),
            emitters: RowWrites::whole(self.emitters.clone()),
            render_nodes: RowWrites::whole(with_slack(&self.render_nodes, self.live.is_some())),
            tlas: TlasAction::Rebuild,
            scene_radius: scene_radius(&self.render_nodes, &self.mesh_descs),
        }
    }

    /// The rows, to be compared with what is resident.
    pub fn rows(&self) -> Rows<'_> {
        Rows {
            mesh_descs: &self.mesh_descs,
            textures: &self.textures,
            materials: &self.materials,
            lights: &self.lights,
            emitters: &self.emitters,
            render_nodes: &self.render_nodes,
        }
    }

    /// Bytes of rows and maps that a derivation writes, geometry and images apart.
    pub fn row_bytes(&self) -> usize {
        size_of_val(self.render_nodes.as_slice())
            + size_of_val(self.owners.as_slice())
            + size_of_val(self.materials.as_slice())
            + size_of_val(self.mesh_descs.as_slice())
            + size_of_val(self.lights.as_slice())
            + size_of_val(self.emitters.as_slice())
            + self.hierarchy.bytes()
    }

    /// The render nodes of a node, in primitive order (instance by instance); none for a node that is not shown.
    pub fn render_nodes_of(&self, node: NodeId) -> std::ops::Range<u32> {
        self.hierarchy.get(node).map_or(0..0, |n| n.first_render_node..n.first_render_node + n.render_node_count)
    }

    /// The node that a render node shows.
    pub fn node_of(&self, render_node: u32) -> Option<NodeId> {
        let entry = *self.owners.get(render_node as usize)?;
        self.hierarchy.nodes.get(entry as usize).map(|node| node.node)
    }

    /// World from node, in the document's world (the origin is not subtracted).
    pub fn world_of(&self, node: NodeId) -> Option<DAffine3> {
        self.hierarchy.get(node).map(|n| n.world)
    }

    /// Bounds of all visible render nodes in the document's world, `None` where nothing is visible. Each is the box of
    /// its object-space box.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let mut bounds: Option<(DVec3, DVec3)> = None;
        for row in self.render_nodes.iter().filter(|r| r.flags & NodeFlags::VISIBLE != 0) {
            let desc = &self.mesh_descs[row.primitive as usize];
            let (lo, hi) = (Vec3::from_array(desc.bounds_min), Vec3::from_array(desc.bounds_max));
            for corner in 0..8 {
                let pick = |axis: usize| if corner >> axis & 1 == 0 { lo[axis] } else { hi[axis] };
                let p = row.world.transform_point(Vec3::new(pick(0), pick(1), pick(2))).as_dvec3() + self.origin;
                if p.is_finite() {
                    bounds = Some(bounds.map_or((p, p), |(a, b)| (a.min(p), b.max(p))));
                }
            }
        }
        bounds
    }

    /// Whether the scene lights itself: a punctual light, or a visible surface that emits.
    pub fn has_lights(&self) -> bool {
        use orthant_resident::rows::LightKind;
        self.lights.iter().any(|row| row.kind != LightKind::None as u32)
            || self.emitters.iter().any(|row| row.power > 0.0)
    }
}

/// A copy of rows; of a scene that is edited with room for rows to come, so that the first ones do not move all of them.
fn with_slack(rows: &[RenderNodeRow], is_live: bool) -> Vec<RenderNodeRow> {
    let mut copy = Vec::with_capacity(rows.len() + if is_live { sync::slack(rows.len()) } else { 0 });
    copy.extend_from_slice(rows);
    copy
}

/// The row of a material: its slot + 1, or 0 for the default one.
pub(crate) fn material_row(id: Option<orthant_scene::model::MaterialId>) -> u32 {
    id.map_or(0, |id| Store::<_, ()>::slot(id) as u32 + 1)
}

/// Keeps the parts' sizes in view: the hierarchy is walked for every derivation.
const _: () = assert!(size_of::<DerivedNode>() <= 136);
