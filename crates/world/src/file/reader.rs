//! Reading a world, or what is intact of one.

use super::{
    BODIES, BodySection, DONE, FileError, FileFault, HEADER_BYTES, MAGIC, MARKER, MOST_RAW, PALETTE, REGIONS,
    ReadOptions, SECTION_HEADER_BYTES, VERSION, VERSION_BODIES, hash, regions,
};
use crate::palette::{OnConflict, Palette, PaletteEntry};
use crate::world::{Region, World};
use miniz_oxide::inflate::decompress_to_vec_with_limit;
use std::path::Path;

/// A region, its place in the arena and the index, about.
const REGION_BYTES: u64 = 256;

/// What is intact of a damaged file.
#[derive(Debug)]
pub struct Salvaged {
    /// The world of all sections that are intact.
    pub world: World,
    /// What is not, by offset. Empty for a whole file.
    pub damage: Vec<(u64, FileFault)>,
}

/// Reads a world.
///
/// # Errors
/// [`FileError`]; any damage is one.
pub fn read(path: &Path, options: &ReadOptions) -> Result<World, FileError> {
    with_bytes(path, options, |name, bytes| read_bytes(name, bytes, options))
}

/// Reads what is intact of a world.
///
/// # Errors
/// [`FileError`] if the file cannot be read, is no world, or needs more memory than is allowed.
pub fn salvage(path: &Path, options: &ReadOptions) -> Result<Salvaged, FileError> {
    with_bytes(path, options, |name, bytes| salvage_bytes(name, bytes, options))
}

/// [`read`] of a file in memory. `name` is for errors.
///
/// # Errors
/// As [`read`].
pub fn read_bytes(name: &str, bytes: &[u8], options: &ReadOptions) -> Result<World, FileError> {
    let mut damage = Vec::new();
    let world = parse(bytes, options, &mut |offset, fault| {
        damage.push((offset, fault));
        Verdict::Stop
    });
    let error = |(offset, fault)| FileError { file: name.to_owned(), offset, fault };
    match damage.into_iter().next() {
        Some(first) => Err(error(first)),
        None => world.map_err(error),
    }
}

/// [`salvage`] of a file in memory. `name` is for errors.
///
/// # Errors
/// As [`salvage`].
pub fn salvage_bytes(name: &str, bytes: &[u8], options: &ReadOptions) -> Result<Salvaged, FileError> {
    let mut damage = Vec::new();
    let world = parse(bytes, options, &mut |offset, fault| {
        damage.push((offset, fault));
        Verdict::Continue
    });
    let world = world.map_err(|(offset, fault)| FileError { file: name.to_owned(), offset, fault })?;
    Ok(Salvaged { world, damage })
}

fn with_bytes<T>(
    path: &Path,
    options: &ReadOptions,
    use_bytes: impl FnOnce(&str, &[u8]) -> Result<T, FileError>,
) -> Result<T, FileError> {
    let name = path.display().to_string();
    let error = |fault| FileError { file: name.clone(), offset: 0, fault };
    let length = std::fs::metadata(path).map_err(|e| error(e.into()))?.len();
    if length > options.max_memory {
        return Err(error(FileFault::OverBudget { needed: length, limit: options.max_memory }));
    }
    let bytes = std::fs::read(path).map_err(|e| error(e.into()))?;
    use_bytes(&name, &bytes)
}

/// Whether damage ends the reading.
#[derive(PartialEq)]
enum Verdict {
    Stop,
    Continue,
}

type Report<'a> = dyn FnMut(u64, FileFault) -> Verdict + 'a;
type Fatal = (u64, FileFault);

/// A section whose header is intact.
struct Section<'a> {
    kind: [u8; 4],
    number: u32,
    raw_length: u64,
    stored: &'a [u8],
    /// Where the stored bytes begin.
    at: usize,
    intact: bool,
}

/// Reads all sections. Damage is reported; a fatal fault, or damage that stops the reading, ends it.
fn parse(bytes: &[u8], options: &ReadOptions, report: &mut Report) -> Result<World, Fatal> {
    let mut used = bytes.len() as u64;
    let mut charge = |more: u64, offset: u64| {
        used = used.saturating_add(more);
        let over = FileFault::OverBudget { needed: used, limit: options.max_memory };
        if used > options.max_memory { Err((offset, over)) } else { Ok(()) }
    };
    check_header(bytes, report)?;
    let mut palette = Palette::new();
    let mut all: Vec<Region> = Vec::new();
    let mut bodies = Vec::new();
    let mut at = HEADER_BYTES.min(bytes.len());
    let mut expected = 0;
    let mut done = false;
    while at < bytes.len() && !done {
        let section = match section_at(bytes, at) {
            Ok(section) => section,
            Err(fault) => {
                if report(at as u64, fault) == Verdict::Stop {
                    return Ok(World::new());
                }
                // The next marker that begins an intact header.
                let next =
                    (at + 1..bytes.len()).find(|&i| bytes[i..].starts_with(&MARKER) && section_at(bytes, i).is_ok());
                let Some(next) = next else { break };
                at = next;
                continue;
            }
        };
        let offset = section.at as u64;
        let mut problem = None;
        if section.number != expected {
            problem = Some((at as u64, FileFault::Order));
        }
        expected = section.number.saturating_add(1);
        at = section.at + section.stored.len();
        if !section.intact {
            problem = Some((offset, FileFault::Damaged("section")));
        } else if problem.is_none() || section.kind != DONE {
            charge(section.raw_length, offset)?;
            let result = unpack(&section).and_then(|raw| match section.kind {
                PALETTE => read_palette(&raw, &mut palette).map_err(FileFault::Content),
                REGIONS => {
                    let mut over = None;
                    let read = regions::decode(&raw, |more| {
                        charge(more, offset).map_err(|fatal| {
                            over = Some(fatal);
                            (0, String::new())
                        })
                    });
                    if let Some((_, fault)) = over {
                        return Err(fault);
                    }
                    let read =
                        read.map_err(|(place, what)| FileFault::Content(format!("unpacked byte {place}: {what}")))?;
                    charge(read.len() as u64 * REGION_BYTES, offset).map_err(|(_, fault)| fault)?;
                    all.extend(read);
                    Ok(())
                }
                BODIES => BodySection::decode(&raw).map(|section| bodies.push(section)).map_err(FileFault::Content),
                DONE => {
                    done = true;
                    // Regions that the world keeps in no form (all air) do not occur in what is written.
                    if raw == (all.len() as u64).to_le_bytes() { Ok(()) } else { Err(FileFault::Order) }
                }
                kind => Err(FileFault::Content(format!("there is no section {:?}", String::from_utf8_lossy(&kind)))),
            });
            match result {
                Ok(()) => {}
                Err(fault @ FileFault::OverBudget { .. }) => return Err((offset, fault)),
                Err(fault) => problem = problem.or(Some((offset, fault))),
            }
        }
        if let Some((offset, fault)) = problem
            && report(offset, fault) == Verdict::Stop
        {
            return Ok(World::new());
        }
    }
    if !done {
        report(bytes.len() as u64, FileFault::Truncated("world"));
    } else if at < bytes.len() {
        report(at as u64, FileFault::Trailing);
    }
    let (mut world, dropped) = World::from_regions(palette, all);
    world.body_sections = bodies;
    for region in dropped {
        let what = format!("two regions overlap at {:?}; every point has one owner", region.bounds);
        report(bytes.len() as u64, FileFault::Content(what));
    }
    Ok(world)
}

fn check_header(bytes: &[u8], report: &mut Report) -> Result<(), Fatal> {
    let Some(header) = bytes.get(..HEADER_BYTES) else {
        let fault = if bytes.len() >= 8 && bytes.starts_with(&MAGIC) {
            FileFault::Truncated("header")
        } else {
            FileFault::NotAWorld
        };
        return Err((0, fault));
    };
    let intact = header[16..] == hash(&[&header[..16]]);
    if !intact {
        // With a whole section in it, it is a world whose header is damaged.
        if section_at(bytes, HEADER_BYTES).is_err() {
            return Err((0, FileFault::NotAWorld));
        }
        report(0, FileFault::Damaged("header"));
        return Ok(());
    }
    if !header.starts_with(&MAGIC) {
        return Err((0, FileFault::NotAWorld));
    }
    let version = u32::from_le_bytes([header[8], header[9], header[10], header[11]]);
    if !(VERSION..=VERSION_BODIES).contains(&version) || header[12..16] != [0; 4] {
        return Err((8, FileFault::Version(version)));
    }
    Ok(())
}

/// The section whose header begins at a place.
fn section_at(bytes: &[u8], at: usize) -> Result<Section<'_>, FileFault> {
    let header = bytes.get(at..at + SECTION_HEADER_BYTES).ok_or(FileFault::Truncated("header of a section"))?;
    if !header.starts_with(&MARKER) || header[48..] != hash(&[&header[..48]]) {
        return Err(FileFault::Damaged("header of a section"));
    }
    let number = |at: usize| u64::from_le_bytes(std::array::from_fn(|i| header[at + i]));
    let (raw_length, stored_length) = (number(16), number(24));
    let start = at + SECTION_HEADER_BYTES;
    let end = usize::try_from(stored_length).ok().and_then(|length| start.checked_add(length));
    let stored = end.and_then(|end| bytes.get(start..end)).ok_or(FileFault::Truncated("section"))?;
    Ok(Section {
        kind: [header[8], header[9], header[10], header[11]],
        number: u32::from_le_bytes([header[12], header[13], header[14], header[15]]),
        raw_length,
        stored,
        at: start,
        intact: header[32..48] == hash(&[stored]),
    })
}

fn unpack(section: &Section) -> Result<Vec<u8>, FileFault> {
    let too_large = || FileFault::Content(format!("a section of {} bytes; at most {MOST_RAW}", section.raw_length));
    let limit = usize::try_from(section.raw_length).ok().filter(|&n| n as u64 <= MOST_RAW).ok_or_else(too_large)?;
    let raw = decompress_to_vec_with_limit(section.stored, limit);
    let raw = raw.map_err(|e| FileFault::Content(format!("a section cannot be unpacked: {e}")))?;
    if raw.len() == limit {
        Ok(raw)
    } else {
        Err(FileFault::Content("a section has another length than it says".to_owned()))
    }
}

fn read_palette(raw: &[u8], palette: &mut Palette) -> Result<(), String> {
    let entries: Vec<PaletteEntry> = serde_json::from_slice(raw).map_err(|e| format!("the palette: {e}"))?;
    let plan = palette.plan(&entries, OnConflict::Refuse).map_err(|e| format!("the palette: {e}"))?;
    if plan.translates() {
        return Err("the palette has a material twice".to_owned());
    }
    palette.commit(&plan);
    Ok(())
}
