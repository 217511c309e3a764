//! `orthant edit`: a script of operations, applied to a scene that stays alive.

use crate::args::{BackendArg, Common, EditArgs};
use crate::commands::convert::export_failure;
use crate::failure::{Exit, Failure};
use crate::job::backend::{Asked, open};
use crate::live::{Followed, Live, Stopped};
use crate::output::{Named, check_not_read, check_outputs, print, write_atomically};
use orthant_render::DeriveOptions;
use orthant_resident::batch::TlasAction;
use orthant_scene::Scene;
use orthant_scene::edit::script::{Operation, Session};
use orthant_scene::export::{ExportOptions, export_path};
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
    let output = args.output.as_deref().map(|path| ("-o", path));
    let report = args.report.as_deref().map(|path| ("--report", path));
    check_files(args, output, report)?;
    let outputs: Vec<_> = output.into_iter().chain(report).collect();
    let mut import = ImportOptions::default();
    import.max_memory = common.max_memory();
    import.allow_external_files = args.allow_external_files;
    let imported = import_path(&args.scene, &import).map_err(|e| Failure::new(Exit::BadInput, e.to_string()))?;
    check_not_read(&outputs, &imported.files, &args.scene)?;
    if !common.quiet {
        for warning in &imported.warnings {
            eprintln!("warning: {}: {warning}", args.scene.display());
        }
    }
    let script = std::fs::read_to_string(&args.ops).map_err(|e| Failure::io(&args.ops, "read the script", &e))?;
    let folder = args.ops.parent().unwrap_or(Path::new("."));
    let max_bytes = common.max_memory().saturating_sub(imported.charged_bytes);
    let mut editor = Editor::new(imported.scene, args, Session::new(folder, import), max_bytes, common.quiet)?;
    let say = |warnings: Vec<String>| {
        for warning in warnings.iter().filter(|_| !common.quiet) {
            eprintln!("warning: {}: {warning}", args.scene.display());
        }
    };
    say(editor.live.new_warnings());

    let mut report = String::new();
    let (mut refused, mut looked_at) = (0, 0);
    let reports = args.report.is_some() || args.output.is_none();
    for (number, line) in script.lines().enumerate().filter(|(_, line)| !is_blank(line)) {
        let at = |failure: Failure| failure.in_file(&args.ops).at(format!("line {}", number + 1));
        match editor.line(line) {
            Ok(entry) if reports => report.push_str(&format!("{entry}\n")),
            Ok(_) => {}
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
        // What has been merged is an input as much as the scene.
        let merged = editor.live.session.files();
        check_not_read(&outputs, &merged[looked_at.min(merged.len())..], &args.ops).map_err(at)?;
        looked_at = merged.len();
        say(editor.live.new_warnings());
    }
    editor.live.finish()?;
    if let Some(path) = &args.report {
        write_atomically(path, |w| {
            w.write_all(report.as_bytes()).map_err(|e| Failure::io(path, "write the report", &e))
        })?;
    }
    let mut lines = String::new();
    if let Some(output) = &args.output {
        let written = export_path(&editor.live.scene, output, &ExportOptions::default())
            .map_err(|error| export_failure(&args.scene, error))?;
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

/// Whether there is no operation in a line: the byte-order mark that some editors write is none.
fn is_blank(line: &str) -> bool {
    line.strip_prefix('\u{feff}').unwrap_or(line).trim().is_empty()
}

/// The scene may be written onto itself; nothing else may be an input and an output.
fn check_files(args: &EditArgs, output: Option<Named<'_>>, report: Option<Named<'_>>) -> Result<(), Failure> {
    let (scene, script) = (("the scene", args.scene.as_path()), ("the script", args.ops.as_path()));
    check_outputs(output.as_slice(), &[script])?;
    check_outputs(report.as_slice(), &[scene, script])?;
    let both: Vec<_> = output.into_iter().chain(report).collect();
    check_outputs(&both, &[])
}

/// A live scene, and what the command does after each operation on it.
struct Editor {
    live: Live,
    verify: bool,
    /// Operations so far: which rays are compared.
    done: u64,
}

impl Editor {
    fn new(scene: Scene, args: &EditArgs, session: Session, max_bytes: u64, quiet: bool) -> Result<Self, Failure> {
        let options = DeriveOptions { max_bytes, ..DeriveOptions::default() };
        // A device that is named follows, whatever it is.
        let asked = args.backend.or(args.device.is_some().then_some(BackendArg::Auto));
        let backend = asked
            .map(|asked| open(&Asked { watched: args.verify, quiet, ..Asked::new(asked, args.device.as_deref()) }))
            .transpose()?;
        let live = Live::new(scene, session, options, backend);
        Ok(Self { live: live.map_err(|failure| failure.in_file(&args.scene))?, verify: args.verify, done: 0 })
    }

    /// One line of the script; its line of the report.
    fn line(&mut self, line: &str) -> Result<Value, Stopped> {
        let operation = Operation::parse(line).map_err(|e| Stopped::Refused(e.to_string()))?;
        self.done += 1;
        let start = Instant::now();
        self.live.edit(&operation)?;
        let edit_time = start.elapsed();
        let followed = match self.live.follow() {
            Err(Stopped::Refused(what)) => {
                self.live.take_back(&operation).map_err(Stopped::Failed)?;
                return Err(Stopped::Refused(what));
            }
            followed => followed?,
        };
        if self.verify {
            self.check().map_err(Stopped::Failed)?;
        }
        Ok(self.entry(&operation, &followed, edit_time))
    }

    fn check(&mut self) -> Result<(), Failure> {
        let failed = |what| Failure::new(Exit::CheckFailed, format!("--verify: {what}"));
        self.live.check(self.done).map(|_| ()).map_err(failed)
    }

    fn entry(&self, operation: &Operation, followed: &Followed, edit: Duration) -> Value {
        let Followed { synced, time, holes_closed } = followed;
        let derived = &self.live.derived;
        let us = |time: Duration| (time.as_secs_f64() * 1e7).round() / 10.0;
        json!({
            "op": operation.name(),
            "edit_us": us(edit),
            "sync_us": us(*time),
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
            "render_nodes": derived.render_nodes.len(),
            "free_slots": derived.free_render_nodes(),
            "revision": derived.revision(),
        })
    }
}

#[cfg(test)]
mod tests;
