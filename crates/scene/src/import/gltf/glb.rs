//! The binary container (glTF 2.0, section 4).

use crate::import::warning::{WarningKind, Warnings};
use crate::import::{ImportFault, Place};
use std::ops::Range;

/// The first bytes of every GLB.
pub const GLB_MAGIC: &[u8] = b"glTF";
const JSON: u32 = u32::from_le_bytes(*b"JSON");
const BIN: u32 = u32::from_le_bytes(*b"BIN\0");

/// Where the two chunks are in the file.
#[derive(Debug, PartialEq)]
pub struct Chunks {
    pub json: Range<usize>,
    pub bin: Option<Range<usize>>,
}

/// Finds the chunks of a file that begins with [`GLB_MAGIC`].
pub fn chunks(file: &[u8], warnings: &mut Warnings) -> Result<Chunks, (Place, ImportFault)> {
    let damaged = |offset: usize, what: String| (Place::Offset(offset as u64), ImportFault::Container(what));
    let word = |offset: usize| -> Option<u32> {
        let bytes = file.get(offset..offset.checked_add(4)?)?;
        Some(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
    };
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return Err(damaged(file.len(), "the GLB ends within its header; the file is truncated".to_owned()));
    };
    if version != 2 {
        return Err((Place::Offset(4), ImportFault::Version(format!("{version} of the GLB container"))));
    }
    let length = length as usize;
    if length > file.len() {
        let what = format!("the GLB says it has {length} bytes, but there are {}; the file is truncated", file.len());
        return Err(damaged(8, what));
    }
    if length < file.len() {
        tolerate(warnings, 8, "there are bytes after the end of the GLB; they are ignored");
    }

    let mut found = Chunks { json: 0..0, bin: None };
    let mut offset = 12;
    let mut number = 0;
    while offset < length {
        let (Some(chunk_length), Some(kind)) = (word(offset), word(offset + 4)) else {
            return Err(damaged(offset, "the file ends within the header of a chunk; it is truncated".to_owned()));
        };
        let start = offset + 8;
        let Some(end) = start.checked_add(chunk_length as usize).filter(|&end| end <= length) else {
            let available = length.saturating_sub(start);
            return Err(damaged(
                offset,
                format!("the chunk says it has {chunk_length} bytes, but there are {available}; the file is truncated"),
            ));
        };
        if chunk_length % 4 != 0 {
            tolerate(warnings, offset, "the length of a GLB chunk is not a multiple of 4");
        }
        match (number, kind) {
            (0, JSON) => found.json = start..end,
            (0, _) => return Err(damaged(offset, "the first chunk of a GLB must be JSON".to_owned())),
            (1, BIN) => found.bin = Some(start..end),
            (_, JSON) => tolerate(warnings, offset, "the GLB has a second JSON chunk; it is ignored"),
            (_, BIN) if found.bin.is_some() => {
                tolerate(warnings, offset, "the GLB has a second BIN chunk; it is ignored")
            }
            (_, BIN) => {
                tolerate(warnings, offset, "the BIN chunk of the GLB is not its second one");
                found.bin = Some(start..end);
            }
            _ => tolerate(warnings, offset, "a GLB chunk of a type that is not known is ignored"),
        }
        number += 1;
        offset = end;
    }
    if number == 0 {
        return Err(damaged(12, "the GLB has no JSON chunk".to_owned()));
    }
    Ok(found)
}

fn tolerate(warnings: &mut Warnings, offset: usize, what: &'static str) {
    warnings.push(WarningKind::Tolerated(what), || Place::Offset(offset as u64));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn glb(chunks: &[(&[u8; 4], &[u8])]) -> Vec<u8> {
        let mut out = [GLB_MAGIC, &2u32.to_le_bytes(), &[0; 4]].concat();
        for (kind, data) in chunks {
            out.extend((data.len() as u32).to_le_bytes());
            out.extend(*kind);
            out.extend(*data);
        }
        let length = (out.len() as u32).to_le_bytes();
        out[8..12].copy_from_slice(&length);
        out
    }

    fn read(file: &[u8]) -> Result<(Chunks, Vec<String>), String> {
        let mut warnings = Warnings::default();
        let chunks = chunks(file, &mut warnings).map_err(|(place, fault)| format!("{place}{fault}"))?;
        Ok((chunks, warnings.into_list().iter().map(ToString::to_string).collect()))
    }

    #[test]
    fn both_chunks_are_found_where_they_are() {
        let (chunks, warnings) = read(&glb(&[(b"JSON", b"{}  "), (b"BIN\0", b"12345678")])).unwrap();
        assert_eq!(chunks, Chunks { json: 20..24, bin: Some(32..40) });
        assert!(warnings.is_empty());
        assert_eq!(read(&glb(&[(b"JSON", b"{}  ")])).unwrap().0.bin, None);
    }

    #[test]
    fn further_chunks_are_ignored_with_a_warning() {
        let file = glb(&[(b"JSON", b"{}  "), (b"BIN\0", b"1234"), (b"XXXX", b""), (b"JSON", b""), (b"BIN\0", b"")]);
        let (chunks, warnings) = read(&file).unwrap();
        assert_eq!(chunks, Chunks { json: 20..24, bin: Some(32..36) });
        assert_eq!(warnings.len(), 3);
        assert!(warnings[0].starts_with("byte 36: a GLB chunk of a type that is not known"), "{warnings:?}");
    }

    #[test]
    fn damage_is_an_error_that_says_where() {
        let whole = glb(&[(b"JSON", b"{}  "), (b"BIN\0", b"1234")]);
        for (file, message) in [
            (whole[..10].to_vec(), "byte 10: the GLB ends within its header"),
            (whole[..30].to_vec(), "byte 8: the GLB says it has 36 bytes, but there are 30"),
            (glb(&[]), "byte 12: the GLB has no JSON chunk"),
            (glb(&[(b"BIN\0", b"")]), "byte 12: the first chunk of a GLB must be JSON"),
            ([&whole[..4], &[1], &whole[5..]].concat(), "byte 4: version \"1 of the GLB container\""),
            ([&whole[..12], &[0xff; 4], &whole[16..]].concat(), "byte 12: the chunk says it has 4294967295 bytes"),
            ([&whole[..8], &[30], &whole[9..]].concat(), "byte 24: the chunk says it has 4 bytes, but there are 0"),
        ] {
            let error = read(&file).unwrap_err();
            assert!(error.starts_with(message), "{error}");
        }
    }

    #[test]
    fn bytes_after_the_end_are_ignored_with_a_warning() {
        let mut file = glb(&[(b"JSON", b"{}  ")]);
        file.extend(b"tail");
        assert!(read(&file).unwrap().1[0].contains("bytes after the end"));
    }
}
