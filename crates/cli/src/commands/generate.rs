//! `orthant generate`: a scene that the program makes itself.

use crate::args::GenerateArgs;
use crate::failure::Failure;
use crate::generate::find;
use crate::output::check_outputs;

/// Writes the scene.
///
/// # Errors
/// A size option that is not this scene's, a size out of range or another extension than .glb or .gltf (usage), or an
/// I/O error.
pub fn run(args: &GenerateArgs) -> Result<(), Failure> {
    let generator = find(&args.name).ok_or_else(|| Failure::usage(format!("there is no scene {:?}", args.name)))?;
    let given = [
        ("trees", args.trees),
        ("nodes", args.nodes),
        ("depth", args.depth),
        ("side", args.side),
        ("count", args.count),
    ];
    let mut size = generator.size.map_or(0, |s| s.default);
    for (option, value) in given.into_iter().filter_map(|(option, value)| Some((option, value?))) {
        match generator.size {
            Some(s) if s.option == option => {
                if !(s.min..=s.max).contains(&value) {
                    let what = format!("--{option} is {value}, but it is {} to {} here", s.min, s.max);
                    return Err(Failure::usage(what));
                }
                size = value;
            }
            Some(s) => return Err(Failure::usage(format!("--{option} is not for {}: use --{}", args.name, s.option))),
            None => return Err(Failure::usage(format!("--{option} is not for {}: it has one size", args.name))),
        }
    }
    let extension = args.output.extension().and_then(|e| e.to_str()).unwrap_or_default();
    if !["glb", "gltf"].iter().any(|e| extension.eq_ignore_ascii_case(e)) {
        let what = format!("{}: generated scenes are .glb or .gltf: change the extension", args.output.display());
        return Err(Failure::usage(what));
    }
    check_outputs(&[("-o", &args.output)], &[])?;
    (generator.build)(size, args.seed).write(&args.output)
}
