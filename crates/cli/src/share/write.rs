//! Writing a share, block by block.

use super::{Header, MAGIC, VERSION};
use orthant_resident::film::FilmBlock;
use std::io::{self, Write};

/// Writes a share to a stream: the header at once, then block after block.
pub struct ShareWriter<W: Write> {
    out: W,
    header: Header,
    next: u32,
}

impl<W: Write> ShareWriter<W> {
    /// Writes the header.
    ///
    /// # Errors
    /// Those of the stream.
    pub fn new(mut out: W, header: Header) -> io::Result<Self> {
        let json = serde_json::to_vec(&header)?;
        let mut bytes = Vec::with_capacity(16 + json.len());
        bytes.extend_from_slice(MAGIC);
        bytes.extend_from_slice(&VERSION.to_le_bytes());
        // A header is a few hundred bytes.
        bytes.extend_from_slice(&(json.len() as u32).to_le_bytes());
        bytes.extend_from_slice(&json);
        out.write_all(&bytes)?;
        out.write_all(blake3::hash(&bytes).as_bytes())?;
        Ok(Self { out, next: header.blocks().start, header })
    }

    /// Writes the next block.
    ///
    /// # Errors
    /// Those of the stream.
    ///
    /// # Panics
    /// If it is not the next block of the share, or its size is not that of the tile: the caller made the frame.
    pub fn block(&mut self, block: &FilmBlock) -> io::Result<()> {
        let pixels = self.header.tile[2] as usize * self.header.tile[3] as usize;
        assert_eq!((block.index, block.sum.len()), (self.next, pixels), "blocks in order, each as large as the tile");
        assert_eq!(block.samples, self.header.block_samples(block.index), "blocks are whole");
        let mut bytes = Vec::with_capacity(8 + pixels * 12);
        bytes.extend_from_slice(&block.index.to_le_bytes());
        bytes.extend_from_slice(&block.samples.to_le_bytes());
        bytes.extend(block.sum.as_flattened().iter().flat_map(|v| v.to_le_bytes()));
        self.out.write_all(&bytes)?;
        self.out.write_all(blake3::hash(&bytes).as_bytes())?;
        self.next += 1;
        Ok(())
    }

    /// Ends the share.
    ///
    /// # Panics
    /// If blocks are missing.
    pub fn finish(self) {
        assert_eq!(self.next, self.header.blocks().end, "all blocks were written");
    }
}
