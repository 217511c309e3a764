//! AOVs in files.

use crate::failure::Failure;
use crate::image_io::{Channel, write_channels};
use glam::DVec3;
use orthant_resident::Film;
use orthant_resident::frame::Aov;
use std::path::{Path, PathBuf};

/// The AOV's name on the command line and in file names, and its channels in the file: colours are R, G, B, vectors
/// X, Y, Z, depth is Z, and indices are `id`.
fn names(aov: Aov) -> (&'static str, &'static [&'static str]) {
    match aov {
        Aov::Albedo => ("albedo", &["R", "G", "B"]),
        Aov::Normal => ("normal", &["X", "Y", "Z"]),
        Aov::Position => ("position", &["X", "Y", "Z"]),
        Aov::Depth => ("depth", &["Z"]),
        Aov::Node => ("node", &["id"]),
        Aov::Primitive => ("primitive", &["id"]),
        Aov::Material => ("material", &["id"]),
        Aov::Block => ("block", &["id"]),
        Aov::Face => ("face", &["id"]),
        Aov::Cell => ("cell", &["X", "Y", "Z", "W"]),
    }
}

/// `IMAGE-STEM.AOV.exr` beside the image.
pub fn path(image: &Path, aov: Aov) -> PathBuf {
    let stem = image.file_stem().unwrap_or_default().to_string_lossy();
    image.with_file_name(format!("{stem}.{}.exr", names(aov).0))
}

/// Writes every AOV of a film beside the image. Positions are in the document's world, or in that which is shown: `origin` is added to
/// them.
///
/// # Errors
/// An I/O error that names the file.
pub fn write(image: &Path, film: &Film, origin: DVec3) -> Result<(), Failure> {
    for (aov, values) in &film.aovs {
        let (_, channel_names) = names(*aov);
        let count = channel_names.len();
        // A hit has an index, and only positions of hits are places.
        let channels = channel_names
            .iter()
            .enumerate()
            .map(|(c, name)| {
                let offset = if *aov == Aov::Position { origin[c] } else { 0.0 };
                let value = |v: f32| if offset == 0.0 { v } else { (f64::from(v) + offset) as f32 };
                Channel { name, values: values.iter().skip(c).step_by(count).map(|&v| value(v)).collect() }
            })
            .collect();
        write_channels(&path(image, *aov), film.tile.width, film.tile.height, channels)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image_io::read;
    use orthant_resident::frame::Tile;

    #[test]
    fn aovs_lie_beside_the_image_under_its_stem() {
        assert_eq!(path(Path::new("out/a.b.png"), Aov::Depth), Path::new("out/a.b.depth.exr"));
    }

    #[test]
    fn positions_are_in_the_world_of_the_document() {
        let folder = tempfile::tempdir().expect("folder");
        let image = folder.path().join("a.png");
        let film = Film {
            width: 1,
            height: 1,
            tile: Tile { x: 0, y: 0, width: 1, height: 1 },
            samples: 16,
            sum: vec![[0.0; 3]],
            blocks: Vec::new(),
            aovs: vec![(Aov::Position, vec![1.0, 2.0, 3.0]), (Aov::Node, vec![-1.0])],
        };
        write(&image, &film, DVec3::new(10.0, 0.0, -3.0)).expect("write");
        let position = read(&path(&image, Aov::Position), 1 << 20).expect("read");
        assert_eq!(position.pixels, [[11.0, 2.0, 0.0]]);
        let node = read(&path(&image, Aov::Node), 1 << 20).expect("read");
        assert_eq!(node.pixels, [[-1.0; 3]]);
    }
}
