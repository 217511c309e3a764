//! `bench edit`: edit, sync and the backend's apply, at growing sizes; on a device also the time until it is done.

use super::{Measured, Settings};
use crate::failure::{Exit, Failure};
use crate::job::backend::{AnyBackend, Asked, open};
use orthant_render::derived::sync::SyncReport;
use orthant_render::{DeriveOptions, DerivedScene};
use orthant_scene::Scene;
use orthant_scene::animation::Pose;
use orthant_scene::edit::{Cursor, Edit, Grouping, History};
use orthant_scene::import::{ImportOptions, import_slice};
use orthant_scene::model::{MaterialId, NodeId, Transform};
use orthant_vulkan::{Stage, Timings};
use serde_json::json;
use std::time::{Duration, Instant};

/// Nodes that show something, at each size.
const SIZES: [u32; 4] = [1_000, 10_000, 100_000, 1_000_000];
/// Distinct pieces of geometry that they share.
const MESHES: u32 = 1_000;
/// Nodes of a subtree that is edited whole, its top included.
const SUBTREE: u32 = 1_000;
/// Nodes up to which what the edits have led to is checked.
const CHECKED: u32 = 10_000;
/// How many times each small edit is measured in a run: enough that the first ones after a large edit, which find cold caches,
/// are not all that a percentile tells of.
const SMALL_EDITS: u32 = 2_000;

pub fn run(asked: &Asked<'_>, settings: Settings) -> Result<Vec<Measured>, Failure> {
    let mut results = Vec::new();
    let sizes = settings.size.map_or(SIZES.to_vec(), |size| vec![size.max(2)]);
    for n in sizes {
        for depth in [1, 64] {
            measure(n, depth, open(asked)?, settings, &mut results)?;
        }
    }
    Ok(results)
}

/// Groups of a thousand nodes below a chain of some depth, as a document.
pub(super) fn scene(nodes: u32, depth: u32) -> Result<Scene, Failure> {
    let groups = nodes.div_ceil(SUBTREE);
    let mut list = Vec::with_capacity((nodes + depth + 1) as usize);
    // The chain: its last node has the groups.
    for i in 0..depth {
        let children = if i + 1 < depth { vec![i + 1] } else { (0..groups).map(|g| depth + g * SUBTREE).collect() };
        list.push(json!({"children": children}));
    }
    for group in 0..groups {
        let first = depth + group * SUBTREE;
        let size = SUBTREE.min(nodes - group * SUBTREE);
        let place = |i: u32| {
            [f64::from(group % 100) * 40.0 + f64::from(i % 32), f64::from(i / 32), f64::from(group / 100) * 4.0]
        };
        let mut top = json!({"mesh": group % MESHES, "translation": [0, 0, 0]});
        if size > 1 {
            top["children"] = json!((first + 1..first + size).collect::<Vec<_>>());
        }
        list.push(top);
        list.extend((1..size).map(|i| json!({"mesh": (group + i) % MESHES, "translation": place(i)})));
    }
    // One triangle of its own for each mesh, in one buffer.
    let positions: Vec<u8> = (0..MESHES)
        .flat_map(|i| [[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [0.0, 0.5 + i as f32 * 1e-4, 0.0]])
        .flatten()
        .flat_map(f32::to_le_bytes)
        .collect();
    let document = json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": list,
        "materials": [{}],
        "meshes": (0..MESHES)
            .map(|i| json!({"primitives": [{"attributes": {"POSITION": i}, "material": 0}]}))
            .collect::<Vec<_>>(),
        "accessors": (0..MESHES)
            .map(|i| json!({"bufferView": 0, "byteOffset": 36 * i, "componentType": 5126, "count": 3, "type": "VEC3",
                "min": [0, 0, 0], "max": [0.5, 1, 0]}))
            .collect::<Vec<_>>(),
        "bufferViews": [{"buffer": 0, "byteLength": positions.len()}],
        "buffers": [{"byteLength": positions.len()}],
    });
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut glb = b"glTF".to_vec();
    for number in [2, (28 + text.len() + positions.len()) as u32, text.len() as u32] {
        glb.extend(number.to_le_bytes());
    }
    glb.extend(b"JSON");
    glb.extend(text);
    glb.extend((positions.len() as u32).to_le_bytes());
    glb.extend(b"BIN\0");
    glb.extend(positions);
    let internal = |e: String| Failure::new(Exit::Internal, format!("generated scene: {e}"));
    import_slice(glb, None, "bench.glb", &ImportOptions::default())
        .map(|i| i.scene)
        .map_err(|e| internal(e.to_string()))
}

/// Nodes that are edited before one sync.
const SCATTERED: u32 = 1_000;

/// An edit that has been followed.
struct Edited {
    /// Until the backend had taken the batch.
    host: Duration,
    /// Until a device had done its work too.
    settled: Duration,
    report: SyncReport,
    /// What the stages of the device have taken, where they are measured.
    stages: Option<Timings>,
}

/// What is reported of one kind of edit.
struct Figure {
    measured: Measured,
    settled: Vec<f64>,
    report: SyncReport,
    stages: Vec<Timings>,
}

struct Live {
    scene: Scene,
    history: History,
    derived: DerivedScene,
    backend: AnyBackend,
    cursor: Cursor,
    /// Whether the stages of the device are measured: that costs the host a little.
    is_timed: bool,
}

fn internal(what: impl ToString) -> Failure {
    Failure::new(Exit::Internal, what.to_string())
}

impl Live {
    fn new(mut scene: Scene, mut backend: AnyBackend) -> Result<Self, Failure> {
        scene.prepare_edits();
        let options = DeriveOptions { live: true, ..DeriveOptions::default() };
        let mut derived = DerivedScene::derive(&scene, &options).map_err(internal)?;
        backend.apply(derived.load_batch()).map_err(internal)?;
        let cursor = scene.change_log().cursor();
        Ok(Self { scene, history: History::default(), derived, backend, cursor, is_timed: false })
    }

    fn follow(&mut self) -> Result<SyncReport, Failure> {
        let changes = self.scene.change_log().take(&mut self.cursor).ok_or_else(|| internal("the log is too short"))?;
        let (batch, report) = self.derived.sync(&self.scene, &Pose::default(), &changes).map_err(internal)?;
        self.backend.apply(batch).map_err(internal)?;
        Ok(report)
    }

    fn edit(&mut self, edit: Edit) -> Result<Edited, Failure> {
        let start = Instant::now();
        self.history.apply(&mut self.scene, edit, Grouping::Alone).map_err(internal)?;
        let report = self.follow()?;
        self.settle(start, report)
    }

    /// Waits until a device has done what the edit made it do.
    fn settle(&mut self, start: Instant, report: SyncReport) -> Result<Edited, Failure> {
        let host = start.elapsed();
        if let AnyBackend::Vulkan(vulkan) = &self.backend {
            while !vulkan.is_idle().map_err(internal)? {
                std::hint::spin_loop();
            }
        }
        let settled = start.elapsed();
        let stages = match &mut self.backend {
            AnyBackend::Vulkan(vulkan) if self.is_timed => Some(vulkan.take_timings().map_err(internal)?),
            _ => None,
        };
        Ok(Edited { host, settled, report, stages })
    }

    /// Many edits, followed at once.
    fn edit_all(&mut self, edits: Vec<Edit>) -> Result<Edited, Failure> {
        let start = Instant::now();
        for edit in edits {
            self.history.apply(&mut self.scene, edit, Grouping::Alone).map_err(internal)?;
        }
        let report = self.follow()?;
        self.settle(start, report)
    }

    /// Has the stages of a device measured from now on; false where there are none.
    fn measure_stages(&mut self) -> Result<bool, Failure> {
        self.is_timed = match &mut self.backend {
            AnyBackend::Vulkan(vulkan) => vulkan.set_timed(true) && vulkan.take_timings().is_ok(),
            AnyBackend::Cpu(_) => false,
        };
        Ok(self.is_timed)
    }

    fn undo(&mut self) -> Result<Edited, Failure> {
        let start = Instant::now();
        self.history.undo(&mut self.scene, 1).map_err(internal)?;
        let report = self.follow()?;
        self.settle(start, report)
    }
}

fn measure(
    n: u32,
    depth: u32,
    backend: AnyBackend,
    settings: Settings,
    results: &mut Vec<Measured>,
) -> Result<(), Failure> {
    let mut live = Live::new(scene(n, depth)?, backend)?;
    let node = |live: &Live, slot: u32| -> Result<NodeId, Failure> {
        live.scene.nodes().id_in_slot(slot as usize).ok_or_else(|| internal("a node is missing"))
    };
    let material: MaterialId = live.scene.materials().ids().next().ok_or_else(|| internal("no material"))?;
    let top = node(&live, depth)?;
    let parent = node(&live, depth - 1)?;
    let names = [
        "transform_leaf",
        "material",
        "scattered_1000",
        "duplicate_1000",
        "delete_1000",
        "undo_delete_1000",
        "hide_1000",
        "reparent_1000",
    ];
    let mut figures = names.map(|name| Figure {
        measured: Measured::new(name, n.into()).with("depth", depth),
        settled: Vec::new(),
        report: SyncReport::default(),
        stages: Vec::new(),
    });
    let mut note = |figure: usize, edited: Edited| {
        let figure = &mut figures[figure];
        match edited.stages {
            // A run that is measured on the device is not one that is measured here.
            Some(stages) => figure.stages.push(stages),
            None => {
                figure.measured.runs.push(edited.host);
                figure.settled.push(edited.settled.as_secs_f64());
            }
        }
        figure.report = edited.report;
    };
    let move_to = |node: NodeId, x: f64| {
        let transform = Transform::Trs { translation: [x, 1.0, 0.0], rotation: [0.0, 0.0, 0.0, 1.0], scale: [1.0; 3] };
        Edit::SetTransform { node, transform }
    };
    // The node at the top of every group has the others.
    let leaf = |live: &Live, i: u32| {
        let at = i % n;
        let is_top = at.is_multiple_of(SUBTREE);
        node(
            live,
            depth
                + if !is_top {
                    at
                } else if at + 1 < n {
                    at + 1
                } else {
                    at - 1
                },
        )
    };
    // Once to warm up.
    live.edit(move_to(top, 0.5))?;
    for run in 0..=settings.runs {
        if run == settings.runs && !live.measure_stages()? {
            break;
        }
        for i in 0..SMALL_EDITS {
            let leaf = leaf(&live, i * 7919 + run as u32)?;
            let edited = live.edit(move_to(leaf, f64::from(i)))?;
            note(0, edited);
            let set = json!({"pbrMetallicRoughness": {"roughnessFactor": f64::from(i) / f64::from(SMALL_EDITS)}});
            let edited = live.edit(Edit::SetMaterial { material, set })?;
            note(1, edited);
        }
        for i in 0..SMALL_EDITS / 100 {
            let slots = 0..SCATTERED.min(n - 1);
            let moves = slots.map(|k| Ok(move_to(leaf(&live, k * 7919 + run as u32)?, f64::from(i + k))));
            let scattered = live.edit_all(moves.collect::<Result<_, Failure>>()?)?;
            note(2, scattered);
        }
        let duplicated = live.edit(Edit::Duplicate { node: top })?;
        note(3, duplicated);
        live.undo()?;
        let deleted = live.edit(Edit::Delete { node: top })?;
        note(4, deleted);
        let restored = live.undo()?;
        note(5, restored);
        let hidden = live.edit(Edit::SetVisible { node: top, visible: false })?;
        note(6, hidden);
        live.undo()?;
        let wrapper = Edit::AddNode { parent: Some(parent), name: None, transform: Transform::default() };
        let made = live.history.apply(&mut live.scene, wrapper, Grouping::Alone).map_err(internal)?.made;
        live.follow()?;
        let Some(orthant_scene::model::AnyId::Node(wrapper)) = made else { return Err(internal("no node was made")) };
        live.edit(move_to(wrapper, 3.0))?;
        let moved = Edit::Reparent { node: top, parent: Some(wrapper), index: None, keep_world: false };
        let moved = live.edit(moved)?;
        note(7, moved);
        (0..3).try_for_each(|_| live.undo().map(|_| ()))?;
    }
    // The check looks at everything, and derives everything anew.
    if n <= CHECKED {
        live.derived.check(&live.scene).map_err(internal)?;
        live.backend.validate(&live.derived)?;
    }
    for Figure { measured, mut settled, report, stages } in figures {
        let mut times: Vec<f64> = measured.runs.iter().map(Duration::as_secs_f64).collect();
        times.sort_by(f64::total_cmp);
        let p99 = times[(times.len() * 99 / 100).min(times.len() - 1)];
        let rows = report.render_nodes + report.materials + report.lights + report.emitters;
        let mut measured = measured.with("p99_s", p99).with("upload_bytes", report.upload_bytes).with("rows", rows);
        if matches!(live.backend, AnyBackend::Vulkan(_)) {
            settled.sort_by(f64::total_cmp);
            measured = measured.with("settled_s", settled[settled.len() / 2]);
        }
        for (stage, name) in Stage::ALL {
            let mut seconds: Vec<f64> =
                stages.iter().map(|times| times.of(stage)).filter(|t| t.count > 0).map(|t| t.seconds).collect();
            seconds.sort_by(f64::total_cmp);
            if let Some(&median) = seconds.get(seconds.len() / 2) {
                measured = measured.with(&format!("gpu_{name}_s"), median);
            }
        }
        results.push(measured.with("backend", live.backend.name()).with("device", live.backend.device()));
    }
    let mut full = Measured::new("full_derive", n.into()).with("depth", depth);
    for _ in 0..settings.runs {
        full.time(|| DerivedScene::derive(&live.scene, &DeriveOptions::default())).map_err(internal)?;
    }
    results.push(full);
    Ok(())
}
