//! `orthant convert`: one scene file becomes another, and voxels a world.

use crate::args::{Common, ConvertArgs, ImagesArg};
use crate::failure::{Exit, Failure};
use crate::job::world::write_world;
use crate::job::{WorldFormat, load_world};
use crate::output::{check_not_read, check_outputs, print};
use orthant_scene::export::{ExportError, ExportFault, ExportOptions, Images, export_path};
use orthant_scene::import::{Format, ImportOptions, import_path};
use std::path::Path;

/// Converts, and prints a line on stdout for each thing that the target does not hold as the source has it.
///
/// # Errors
/// A bad scene, or a target that cannot be written (bad input); a target of no known format (wrong usage).
pub fn run(args: &ConvertArgs, common: &Common) -> Result<(), Failure> {
    match (WorldFormat::of(&args.input), WorldFormat::of(&args.output)) {
        (Some(_), _) => return convert_world(args, common),
        (None, Some(_)) => {
            let what = format!("OUT {}: a scene cannot become a world", args.output.display());
            return Err(Failure::usage(what).remedy("use .gltf, .glb, .obj or .crts"));
        }
        (None, None) if args.salvage => {
            return Err(Failure::usage("--salvage is for .orw files: leave it out with a scene"));
        }
        (None, None) => {}
    }
    if Format::from_extension(&args.output).is_none() {
        let what = format!("{}: the extension says no format that can be written", args.output.display());
        return Err(Failure::usage(what).remedy("use .gltf, .glb, .obj or .crts"));
    }
    // A file may be converted onto itself.
    let output = [("OUT", args.output.as_path())];
    check_outputs(&output, &[])?;
    let mut import = ImportOptions::default();
    import.max_memory = common.max_memory();
    import.allow_external_files = args.allow_external_files;
    let imported = import_path(&args.input, &import).map_err(|e| Failure::new(Exit::BadInput, e.to_string()))?;
    check_not_read(&output, &imported.files, &args.input)?;
    if !common.quiet {
        for warning in &imported.warnings {
            eprintln!("warning: {}: {warning}", args.input.display());
        }
    }
    let mut export = ExportOptions::default();
    export.images = match args.images {
        ImagesArg::Keep => Images::Keep,
        ImagesArg::Embed => Images::Embed,
        ImagesArg::External => Images::External,
    };
    let report =
        export_path(&imported.scene, &args.output, &export).map_err(|error| export_failure(&args.input, error))?;
    let lines: Vec<String> = report.notes.iter().map(|note| format!("{note}\n")).collect();
    print(&lines.concat())
}

/// Voxels become a world file; so does a world file, which is written anew.
fn convert_world(args: &ConvertArgs, common: &Common) -> Result<(), Failure> {
    if WorldFormat::of(&args.output) != Some(WorldFormat::Orw) {
        let what = format!("OUT {}: a world is written as .orw only", args.output.display());
        let remedy = "name it so; a world is shown beside a scene by `orthant render SCENE --world W.orw`";
        return Err(Failure::usage(what).remedy(remedy));
    }
    for (option, is_given) in
        [("--images", args.images != ImagesArg::Keep), ("--allow-external-files", args.allow_external_files)]
    {
        if is_given {
            return Err(Failure::usage(format!("{option} is for scenes: leave it out with a world")));
        }
    }
    check_outputs(&[("OUT", args.output.as_path())], &[])?;
    let loaded = load_world(&args.input, args.salvage, common.max_memory())?;
    if !common.quiet {
        loaded.print_warnings();
        if loaded.world.region_count() == 0 {
            eprintln!("warning: {}: the file holds no block", args.input.display());
        }
    }
    write_world(&args.output, &loaded.world)
}

/// An export that failed: what cannot be written is the fault of the target, all else that of the scene.
pub fn export_failure(source: &Path, error: ExportError) -> Failure {
    match &error.fault {
        ExportFault::Io(io) => Failure::io(&error.file, "write the file", io),
        fault @ (ExportFault::TooLarge(_) | ExportFault::UnknownFormat(_)) => {
            Failure::bad_input(&error.file, fault.to_string())
        }
        fault => Failure::bad_input(source, format!("{fault}; {} is not written", error.file.display())),
    }
}
