//! One random sequence.

use orthant::args::BackendArg;
use orthant::failure::Failure;
use orthant::job::backend::{Asked, open};
use orthant::live::{Live, Stopped};
use orthant_render::{DeriveOptions, DerivedScene};
use orthant_scene::Scene;
use orthant_scene::edit::random::{Choice, Choices, merge, operation, time};
use orthant_scene::edit::script::{Operation, Session};
use orthant_scene::export::{ExportOptions, Images, gltf::to_glb};
use orthant_scene::import::ImportOptions;
use orthant_scene::model::Kind;
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

/// Rows that one full derivation may make for each edit; a larger scene is compared less often.
const ROWS_PER_EDIT: usize = 2_000;

/// A scene, and how it is checked.
pub struct Source {
    pub name: String,
    pub path: PathBuf,
    pub scene: Scene,
    /// The backend that follows, if one does.
    pub backend: Option<BackendArg>,
    /// Files that sequences merge now and then.
    merged: Vec<String>,
    every: usize,
    most_nodes: usize,
}

impl Source {
    pub fn new(
        name: String,
        path: PathBuf,
        scene: Scene,
        merged: Vec<PathBuf>,
        backend: Option<BackendArg>,
        every: Option<usize>,
    ) -> Result<Self, Failure> {
        let options = DeriveOptions { images: false, ..DeriveOptions::default() };
        let derived = DerivedScene::derive(&scene, &options).map_err(|e| Failure::bad_input(&path, e.to_string()))?;
        let triangles: usize = derived.mesh_descs.iter().map(|desc| desc.index_count as usize / 3).sum();
        let rows = derived.render_nodes.len() + derived.hierarchy.nodes.len() + triangles;
        let every = every.unwrap_or(rows.div_ceil(ROWS_PER_EDIT)).max(1);
        let merged = merged.iter().map(|path| path.display().to_string()).collect();
        let most_nodes = (2 * scene.count(Kind::Node)).max(200);
        Ok(Self { name, path, scene, backend, merged, every, most_nodes })
    }

    /// The scene as it was loaded, with all that follows it.
    pub fn live(&self) -> Result<Live, String> {
        // Encoded images are decoded by every full derivation: in the scenes of the tests they are small.
        let images = self.scene.images().values();
        let encoded: usize = images.map(|image| image.data.as_ref().map_or(0, |data| data.len())).sum();
        let options = DeriveOptions { images: encoded < 1 << 16, ..DeriveOptions::default() };
        let session = Session::new(Path::new("."), ImportOptions::default());
        let backend = self
            .backend
            .map(|backend| open(&Asked { watched: true, ..Asked::new(backend, None) }))
            .transpose()
            .map_err(|e| e.to_string())?;
        Live::new(self.scene.clone(), session, options, backend).map_err(|failure| failure.to_string())
    }

    /// The operation of a choice: random, but that a scene which has become large shrinks, and an empty one grows.
    pub fn operation(&self, scene: &Scene, choice: Choice) -> Operation {
        let nodes = scene.count(Kind::Node);
        if choice.0 >= u8::MAX - 3
            && nodes < self.most_nodes
            && let Some(operation) = merge(scene, &self.merged, choice)
        {
            return operation;
        }
        if choice.1 % 6 == 5 && scene.count(Kind::Animation) > 0 {
            return time(scene, choice);
        }
        match operation(scene, choice) {
            Operation::Duplicate { node, .. } if nodes > self.most_nodes => Operation::Delete { node },
            Operation::Delete { node } if nodes < 4 => Operation::Duplicate { node, label: None },
            operation => operation,
        }
    }
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let each = match self.every {
            1 => "compared after every edit".to_owned(),
            k => format!("large: compared after every {k}th edit"),
        };
        write!(
            f,
            "{}: {} nodes, {each}, kept below about {} nodes",
            self.name,
            self.scene.count(Kind::Node),
            self.most_nodes
        )
    }
}

/// What was done.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tally {
    pub edits: u64,
    pub refused: u64,
    pub checks: u64,
    pub rays: u64,
}

impl std::ops::AddAssign for Tally {
    fn add_assign(&mut self, other: Self) {
        self.edits += other.edits;
        self.refused += other.refused;
        self.checks += other.checks;
        self.rays += other.rays;
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} edits ({} refused), {} comparisons, {} rays", self.edits, self.refused, self.checks, self.rays)
    }
}

/// A failure: what it is, and the operations that led to it.
pub struct Finding {
    pub script: Vec<Operation>,
    pub what: String,
}

/// Runs a sequence until it fails. The scene that it leads to is written into a folder, if one is given.
pub fn run(source: &Source, seed: u64, edits: usize, export: Option<&Path>) -> (Tally, Option<Finding>) {
    let mut tally = Tally::default();
    let mut script = Vec::new();
    let result = guarded(|| drive(source, seed, edits, export, &mut script, &mut tally));
    (tally, result.err().map(|what| Finding { script, what }))
}

/// A panic is a failure like any other.
pub fn guarded(run: impl FnOnce() -> Result<(), String>) -> Result<(), String> {
    catch_unwind(AssertUnwindSafe(run)).unwrap_or_else(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
        Err(format!("panic: {}", text.unwrap_or("without a message")))
    })
}

fn drive(
    source: &Source,
    seed: u64,
    edits: usize,
    export: Option<&Path>,
    script: &mut Vec<Operation>,
    tally: &mut Tally,
) -> Result<(), String> {
    let mut live = source.live()?;
    for (i, choice) in Choices(seed.wrapping_mul(0x9e37_79b9)).take(edits).enumerate() {
        let operation = source.operation(&live.scene, choice);
        script.push(operation.clone());
        tally.edits += 1;
        if !step(&mut live, &operation)? {
            tally.refused += 1;
        }
        if i % source.every == 0 || i + 1 == edits {
            tally.rays += live.check(seed ^ i as u64)?;
            tally.checks += 1;
        }
    }
    if let Some(folder) = export {
        let path = folder.join(format!("{}-{seed}.glb", source.name));
        std::fs::write(&path, glb(&live.scene)?).map_err(|e| format!("{}: {e}", path.display()))?;
    }
    undo_all(source, &mut live, script)
}

/// One operation, followed. `false` if it was refused.
pub fn step(live: &mut Live, operation: &Operation) -> Result<bool, String> {
    match live.edit(operation) {
        Ok(()) => {}
        Err(Stopped::Refused(_)) => return Ok(false),
        Err(Stopped::Failed(failure)) => return Err(failure.to_string()),
    }
    match live.follow() {
        Ok(_) => Ok(true),
        Err(Stopped::Refused(what)) => Err(format!("sync: {what}")),
        Err(Stopped::Failed(failure)) => Err(failure.to_string()),
    }
}

fn glb(scene: &Scene) -> Result<Vec<u8>, String> {
    let mut options = ExportOptions::default();
    // There are no files beside what is compared and validated.
    options.images = Images::Embed;
    to_glb(scene, &options).map(|files| files.document).map_err(|e| e.to_string())
}

/// Takes everything back that the history holds. If it holds all, the scene is the one that was loaded.
fn undo_all(source: &Source, live: &mut Live, script: &mut Vec<Operation>) -> Result<(), String> {
    let is_whole = live.session.history.forgotten() == 0;
    let undo = Operation::Undo { count: live.session.history.done().len() };
    script.push(undo.clone());
    step(live, &undo)?;
    live.check(0)?;
    live.finish().map_err(|failure| failure.to_string())?;
    if is_whole && glb(&live.scene)? != glb(&source.scene)? {
        return Err("undo of everything is not the scene that was loaded".to_owned());
    }
    Ok(())
}
