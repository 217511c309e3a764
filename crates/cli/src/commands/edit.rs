//! `orthant edit`: a script of operations, applied to a scene that stays alive.

use crate::args::{BackendArg, Common, EditArgs};
use crate::failure::{Exit, Failure};
use crate::job::validate;
use crate::output::{print, write_atomically};
use orthant_cpu::CpuBackend;
use orthant_render::derived::sync::SyncReport;
use orthant_render::{DeriveOptions, DerivedScene};
use orthant_resident::Backend;
use orthant_resident::batch::TlasAction;
use orthant_scene::Scene;
use orthant_scene::animation::{AnimationPlayer, AnimationWarning, Pose};
use orthant_scene::edit::Cursor;
use orthant_scene::edit::script::{Operation, Outcome, Session};
use orthant_scene::export::{ExportFault, ExportOptions, export_path};
use orthant_scene::import::{Format, ImportOptions, import_path};
use serde_json::{Value, json};
use std::io::Write;
use std::path::Path;
use std::time::{Duration, Instant};

/// Applies the script, reports, and writes the scene.
///
/// # Errors
/// A bad scene or script, a refused operation (bad input); a difference that `--verify` found (check failed).
pub fn run(args: &EditArgs, common: &Common) -> Result<(), Failure> {
    if let Some(output) = &args.output
        && Format::from_extension(output).is_none()
    {
        let what = format!("{}: the extension says no format that can be written", output.display());
        return Err(Failure::usage(what).remedy("use .gltf, .glb, .obj or .crts"));
    }
    if args.backend == Some(BackendArg::Vulkan) {
        return Err(Failure::missing("--backend vulkan: this build renders on the CPU").remedy("use --backend cpu"));
    }
    let mut import = ImportOptions::default();
    import.max_memory = common.max_memory();
    import.allow_external_files = args.allow_external_files;
    let imported = import_path(&args.scene, &import).map_err(|e| Failure::new(Exit::BadInput, e.to_string()))?;
    if !common.quiet {
        for warning in &imported.warnings {
            eprintln!("warning: {}: {warning}", args.scene.display());
        }
    }
    let outputs = [&args.output, &args.report];
    for path in outputs.into_iter().flatten() {
        let is_same = |other: &Path| {
            std::fs::canonicalize(path).ok().is_some_and(|p| std::fs::canonicalize(other).ok() == Some(p))
        };
        if is_same(&args.ops)
            || args.report.as_ref() == Some(path) && (is_same(&args.scene) || args.output.as_ref() == Some(path))
        {
            return Err(Failure::usage(format!("{}: it is an input, or two outputs", path.display()))
                .remedy("name another file"));
        }
    }
    let script = std::fs::read_to_string(&args.ops).map_err(|e| Failure::io(&args.ops, "read the script", &e))?;
    let folder = args.ops.parent().unwrap_or(Path::new("."));
    let max_bytes = common.max_memory().saturating_sub(imported.charged_bytes);
    let mut live = Live::new(imported.scene, args, Session::new(folder, import), max_bytes)?;
    if !common.quiet {
        for warning in &live.derived.warnings {
            eprintln!("warning: {}: {warning}", args.scene.display());
        }
    }

    let mut report = String::new();
    let mut refused = 0;
    for (number, line) in script.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
        let at = |failure: Failure| failure.in_file(&args.ops).at(format!("line {}", number + 1));
        match live.line(line) {
            Ok(entry) => report.push_str(&format!("{entry}\n")),
            Err(Stopped::Refused(error)) if args.keep_going => {
                refused += 1;
                report.push_str(&format!("{}\n", json!({"line": number + 1, "refused": error})));
                if !common.quiet {
                    eprintln!("warning: {}: line {}: {error}", args.ops.display(), number + 1);
                }
            }
            Err(Stopped::Refused(error)) => {
                return Err(at(Failure::new(Exit::BadInput, error)
                    .remedy("mend the line, or leave refused operations out with --keep-going; nothing is written")));
            }
            Err(Stopped::Failed(failure)) => return Err(at(failure)),
        }
        for warning in live.new_warnings() {
            if !common.quiet {
                eprintln!("warning: {}: {warning}", args.scene.display());
            }
        }
    }
    if let Some(path) = &args.report {
        write_atomically(path, |w| {
            w.write_all(report.as_bytes()).map_err(|e| Failure::io(path, "write the report", &e))
        })?;
    }
    let mut lines = String::new();
    if let Some(output) = &args.output {
        let written =
            export_path(&live.scene, output, &ExportOptions::default()).map_err(|error| match &error.fault {
                ExportFault::Io(io) => Failure::io(&error.file, "write the file", io),
                fault => Failure::bad_input(&error.file, fault.to_string()),
            })?;
        written.notes.iter().for_each(|note| lines.push_str(&format!("{note}\n")));
    }
    if args.output.is_none() && args.report.is_none() {
        lines.push_str(&report);
    }
    if refused > 0 && !common.quiet {
        eprintln!("warning: {refused} operations were refused and left out");
    }
    print(&lines)
}

/// A backend that has all of a scene that was derived just now.
fn loaded(derived: &mut DerivedScene) -> Result<CpuBackend, Failure> {
    let mut backend = CpuBackend::new();
    let batch = derived.load_batch();
    backend.apply(batch).map_err(|e| Failure::new(Exit::Internal, e.to_string()))?;
    Ok(backend)
}

/// Rows of render nodes that are moved into holes after one operation, at most.
const HOLES_AT_ONCE: u32 = 1 << 16;

/// Why a line stopped the script.
enum Stopped {
    /// The operation makes no sense, for this reason; nothing has changed.
    Refused(String),
    /// Something else went wrong.
    Failed(Failure),
}

/// The scene and all that follows it.
struct Live {
    scene: Scene,
    session: Session,
    derived: DerivedScene,
    backend: Option<CpuBackend>,
    cursor: Cursor,
    /// The overlay of `set_time`. It is not part of the document, and not saved.
    pose: Pose,
    player: AnimationPlayer,
    /// What animations are not played as the file says, each once.
    warnings: Vec<AnimationWarning>,
    verify: bool,
}

impl Live {
    fn new(mut scene: Scene, args: &EditArgs, session: Session, max_bytes: u64) -> Result<Self, Failure> {
        scene.prepare_edits();
        let options = DeriveOptions { live: true, max_bytes, ..DeriveOptions::default() };
        let mut derived = DerivedScene::derive(&scene, &options)
            .map_err(|e| Failure::bad_input(&args.scene, e.what).at(e.place).remedy(e.remedy))?;
        let backend = args.backend.map(|_| loaded(&mut derived)).transpose()?;
        let cursor = scene.change_log().cursor();
        let (pose, player) = (Pose::default(), AnimationPlayer::new(max_bytes));
        Ok(Self { scene, session, derived, backend, cursor, pose, player, warnings: Vec::new(), verify: args.verify })
    }

    /// One line of the script; its line of the report.
    fn line(&mut self, line: &str) -> Result<Value, Stopped> {
        let operation = Operation::parse(line).map_err(|e| Stopped::Refused(e.to_string()))?;
        let start = Instant::now();
        let outcome = self.session.run(&mut self.scene, &operation).map_err(|e| Stopped::Refused(e.to_string()))?;
        let mut pose_before = None;
        if let Outcome::TimeSet { seconds, animation } = outcome {
            let pose = match animation {
                Some(id) => {
                    let pose = self.player.pose(&self.scene, id, seconds);
                    pose.map_err(|e| Stopped::Refused(e.to_string()))?
                }
                None => Pose::default(),
            };
            pose_before = Some(std::mem::replace(&mut self.pose, pose));
        }
        let edit_time = start.elapsed();
        let start = Instant::now();
        let synced = match self.sync() {
            Err(Stopped::Refused(what)) => {
                self.take_back(&operation, pose_before).map_err(Stopped::Failed)?;
                return Err(Stopped::Refused(what));
            }
            synced => synced?,
        };
        let sync_time = start.elapsed();
        let holes_closed = self.close_holes().map_err(Stopped::Failed)?;
        if self.verify {
            self.check().map_err(Stopped::Failed)?;
        }
        Ok(self.entry(&operation, &synced, edit_time, sync_time, holes_closed))
    }

    /// What the animation that is played is not shown of, if that was not said before.
    fn new_warnings(&mut self) -> Vec<AnimationWarning> {
        let known = &self.warnings;
        let new: Vec<AnimationWarning> =
            self.player.warnings().iter().filter(|warning| !known.contains(warning)).cloned().collect();
        self.warnings.extend_from_slice(&new);
        new
    }

    /// Takes an operation back that leads to what cannot be shown (geometry that cannot be decoded, more than fits into the
    /// memory). The sync after one that failed derives everything anew. O(scene).
    fn take_back(&mut self, operation: &Operation, pose: Option<Pose>) -> Result<(), Failure> {
        let internal = |what: String| Failure::new(Exit::Internal, what);
        self.session.take_back(&mut self.scene, operation).map_err(|e| internal(e.to_string()))?;
        self.pose = pose.unwrap_or_else(|| std::mem::take(&mut self.pose));
        match self.sync() {
            Ok(_) => Ok(()),
            Err(Stopped::Failed(failure)) => Err(failure),
            Err(Stopped::Refused(what)) => Err(internal(what)),
        }
    }

    fn sync(&mut self) -> Result<SyncReport, Stopped> {
        let internal = |what: String| Stopped::Failed(Failure::new(Exit::Internal, what));
        let synced = match self.scene.change_log().take(&mut self.cursor) {
            Some(changes) => self.derived.sync(&self.scene, &self.pose, &changes),
            // The operation touched more than the log of changes keeps.
            None => self.derived.derive_anew(&self.scene, &self.pose),
        };
        let (batch, report) = synced.map_err(|e| Stopped::Refused(e.to_string()))?;
        if let Some(backend) = &mut self.backend {
            backend.apply(batch).map_err(|e| internal(e.to_string()))?;
        }
        Ok(report)
    }

    /// Moves render nodes into holes where more than half of their rows are holes: between operations, not as a part of one.
    /// Returns how many holes are closed.
    fn close_holes(&mut self) -> Result<u32, Failure> {
        let internal = |what: String| Failure::new(Exit::Internal, what);
        if !self.derived.holes_are_due() {
            return Ok(0);
        }
        let before = self.derived.free_render_nodes();
        let (batch, _) = self.derived.close_holes(&self.scene, HOLES_AT_ONCE).map_err(|e| internal(e.to_string()))?;
        if let Some(backend) = &mut self.backend {
            backend.apply(batch).map_err(|e| internal(e.to_string()))?;
        }
        Ok(before - self.derived.free_render_nodes())
    }

    fn check(&self) -> Result<(), Failure> {
        self.derived.check(&self.scene).map_err(|what| Failure::new(Exit::CheckFailed, format!("--verify: {what}")))?;
        match &self.backend {
            Some(backend) => {
                validate::validate(&self.derived, backend.scene())?;
                let what = |what| Failure::new(Exit::CheckFailed, format!("--verify: lights: {what}"));
                backend.validate_lights().map_err(what)
            }
            None => Ok(()),
        }
    }

    fn entry(
        &self,
        operation: &Operation,
        synced: &SyncReport,
        edit: Duration,
        sync: Duration,
        holes_closed: u32,
    ) -> Value {
        let us = |time: Duration| (time.as_secs_f64() * 1e7).round() / 10.0;
        json!({
            "op": operation.name(),
            "edit_us": us(edit),
            "sync_us": us(sync),
            "dirty": {
                "render_nodes": synced.render_nodes,
                "all": synced.whole,
                "materials": synced.materials,
                "lights": synced.lights,
                "primitives_changed": synced.primitives_changed,
            },
            "upload_bytes": synced.upload_bytes,
            "instances_written": synced.instances_written,
            "tlas": match synced.tlas {
                TlasAction::None => "none",
                TlasAction::Update => "update",
                TlasAction::Rebuild => "rebuild",
            },
            "blas_built": synced.blas_built,
            "blas_updated": synced.blas_updated,
            "holes_closed": holes_closed,
            "render_nodes": self.derived.render_nodes.len(),
            "free_slots": self.derived.free_render_nodes(),
            "revision": self.derived.revision(),
        })
    }
}

#[cfg(test)]
mod tests;
