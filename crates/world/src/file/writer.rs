//! Writing a world.

use super::regions::Encoder;
use super::{
    BODIES, DONE, FileError, FileFault, MAGIC, MARKER, PALETTE, REGIONS, SECTION_HEADER_BYTES, VERSION, VERSION_BODIES,
    atomic, hash,
};
use crate::world::World;
use miniz_oxide::deflate::compress_to_vec;
use std::io::{self, Write};
use std::path::Path;

/// A section of regions is closed when it has so many bytes: small enough that damage costs little.
const SECTION_BYTES: usize = 1 << 20;

/// Writes a world to a file: whole, or not at all.
///
/// # Errors
/// [`FileError`].
pub fn write(path: &Path, world: &World) -> Result<(), FileError> {
    let error = |e| FileError { file: path.display().to_string(), offset: 0, fault: FileFault::Io(e) };
    atomic::write(path, |out| write_to(out, world)).map_err(error)
}

/// Writes a world as the bytes of a file. Worlds of the same regions are the same bytes.
///
/// # Errors
/// Those of the writer.
pub fn write_to(out: &mut dyn Write, world: &World) -> io::Result<()> {
    let mut header = MAGIC.to_vec();
    let version = if world.body_sections.is_empty() { VERSION } else { VERSION_BODIES };
    header.extend(version.to_le_bytes());
    header.extend([0; 4]);
    let check = hash(&[&header]);
    out.write_all(&header)?;
    out.write_all(&check)?;
    let mut number = 0;
    let mut section = |kind, raw: &[u8]| {
        number += 1;
        write_section(out, kind, number - 1, raw)
    };
    section(PALETTE, &serde_json::to_vec(&world.palette().entries())?)?;
    let mut regions: Vec<_> = world.regions().map(|(_, region)| region).collect();
    regions.sort_unstable_by_key(|region| {
        let [x, y, z, w] = region.bounds.min_raw();
        [w, z, y, x]
    });
    let mut encoder = Encoder::default();
    for region in &regions {
        encoder.push(region);
        if encoder.bytes() >= SECTION_BYTES {
            section(REGIONS, &std::mem::take(&mut encoder).finish())?;
        }
    }
    if encoder.count() > 0 {
        section(REGIONS, &encoder.finish())?;
    }
    for bodies in &world.body_sections {
        section(BODIES, &bodies.encode())?;
    }
    section(DONE, &(regions.len() as u64).to_le_bytes())
}

fn write_section(out: &mut dyn Write, kind: [u8; 4], number: u32, raw: &[u8]) -> io::Result<()> {
    let stored = compress_to_vec(raw, 6);
    let mut header = Vec::with_capacity(SECTION_HEADER_BYTES);
    header.extend(MARKER);
    header.extend(kind);
    header.extend(number.to_le_bytes());
    header.extend((raw.len() as u64).to_le_bytes());
    header.extend((stored.len() as u64).to_le_bytes());
    header.extend(hash(&[&stored]));
    header.extend(hash(&[&header]));
    out.write_all(&header)?;
    out.write_all(&stored)
}
