//! The binary container (glTF 2.0, section 4).

use super::buffers::Packed;
use crate::export::ExportFault;
use std::io::{self, Write};

const HEADER: u64 = 12;
const CHUNK_HEADER: u64 = 8;

/// A document in its container.
pub struct Glb<'a> {
    json: &'a [u8],
    bin: &'a Packed,
    length: u32,
}

impl<'a> Glb<'a> {
    /// Fails where the lengths do not fit.
    pub fn new(json: &'a [u8], bin: &'a Packed) -> Result<Self, ExportFault> {
        let mut length = HEADER + CHUNK_HEADER + padded(json.len());
        if bin.len() > 0 {
            length += CHUNK_HEADER + padded(bin.len());
        }
        let length = u32::try_from(length).map_err(|_| ExportFault::TooLarge(length))?;
        Ok(Self { json, bin, length })
    }

    /// Bytes of the whole file.
    pub fn len(&self) -> u64 {
        u64::from(self.length)
    }

    /// Writes the file.
    pub fn write(&self, w: &mut dyn Write) -> io::Result<()> {
        w.write_all(b"glTF")?;
        w.write_all(&2u32.to_le_bytes())?;
        w.write_all(&self.length.to_le_bytes())?;
        chunk_header(w, self.json.len(), b"JSON")?;
        w.write_all(self.json)?;
        pad(w, self.json.len(), b' ')?;
        if self.bin.len() > 0 {
            chunk_header(w, self.bin.len(), b"BIN\0")?;
            self.bin.write(w)?;
            pad(w, self.bin.len(), 0)?;
        }
        Ok(())
    }
}

fn padded(length: usize) -> u64 {
    (length as u64).next_multiple_of(4)
}

fn chunk_header(w: &mut dyn Write, length: usize, kind: &[u8; 4]) -> io::Result<()> {
    // The sum of all lengths fits.
    w.write_all(&(padded(length) as u32).to_le_bytes())?;
    w.write_all(kind)
}

fn pad(w: &mut dyn Write, length: usize, with: u8) -> io::Result<()> {
    let count = padded(length) as usize - length;
    w.write_all(&[with; 4][..count])
}
