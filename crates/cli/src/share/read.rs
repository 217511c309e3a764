//! Reading a share: the header at once and checked, blocks when they are asked for.

use super::{HASH, Header, MAGIC, MAX_HEADER, ShareError, VERSION};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// A share whose header is read and whose length is right.
#[derive(Clone, Debug)]
pub struct Share {
    /// The file.
    pub path: PathBuf,
    /// What it is a part of, and which part.
    pub header: Header,
    /// Byte offset of the first block.
    first_block: u64,
}

impl Share {
    /// Reads and checks the header, and the length of the file.
    ///
    /// # Errors
    /// The file cannot be read, is no share, or is damaged or truncated.
    pub fn open(path: &Path) -> Result<Self, ShareError> {
        let read_error = |source| ShareError::Read { path: path.to_owned(), source };
        let damaged = |offset: u64, what: String| ShareError::Damaged { path: path.to_owned(), offset, what };
        let mut file = File::open(path).map_err(read_error)?;
        let length = file.metadata().map_err(read_error)?.len();

        let mut start = [0u8; 16];
        if length < 16 {
            return Err(damaged(length, "the file ends within the first 16 bytes of a share".into()));
        }
        file.read_exact(&mut start).map_err(read_error)?;
        let word = |at: usize| u32::from_le_bytes([start[at], start[at + 1], start[at + 2], start[at + 3]]);
        if &start[..8] != MAGIC {
            return Err(damaged(0, "this is no share".into()));
        }
        if word(8) != VERSION {
            return Err(damaged(8, format!("version {} is not known; this program reads version {VERSION}", word(8))));
        }
        let header_length = word(12);
        if header_length > MAX_HEADER || 16 + u64::from(header_length) + HASH > length {
            return Err(damaged(12, format!("the header claims {header_length} bytes, more than the file has")));
        }
        // At most 1 MiB, and no more than the file has.
        let mut bytes = start.to_vec();
        bytes.resize(16 + header_length as usize, 0);
        file.read_exact(&mut bytes[16..]).map_err(read_error)?;
        let mut hash = [0u8; HASH as usize];
        file.read_exact(&mut hash).map_err(read_error)?;
        if blake3::hash(&bytes).as_bytes() != &hash {
            return Err(damaged(12, "the header does not match its checksum".into()));
        }
        let header: Header = serde_json::from_slice(&bytes[16..]).map_err(|e| damaged(16, e.to_string()))?;
        if let Some(fault) = header.fault() {
            return Err(damaged(16, fault));
        }
        let first_block = bytes.len() as u64 + HASH;
        let expected = first_block + header.block_bytes() * u64::from(header.blocks().end - header.blocks().start);
        if length < expected {
            return Err(damaged(length, format!("the file ends here, but has to have {expected} bytes")));
        }
        if length > expected {
            return Err(damaged(expected, format!("{} bytes follow the last block", length - expected)));
        }
        Ok(Self { path: path.to_owned(), header, first_block })
    }

    /// Reads the sums of one block and checks them: red, green and blue by pixel of the tile.
    ///
    /// # Errors
    /// The file cannot be read or is damaged.
    ///
    /// # Panics
    /// If the share does not have the block.
    pub fn read_block(&self, index: u32) -> Result<Vec<[f32; 3]>, ShareError> {
        assert!(self.header.blocks().contains(&index), "the caller asks for blocks of this share");
        let read_error = |source| ShareError::Read { path: self.path.clone(), source };
        let length = self.header.block_bytes();
        let offset = self.first_block + length * u64::from(index - self.header.blocks().start);
        let damaged = |what: &str| ShareError::Damaged { path: self.path.clone(), offset, what: what.into() };
        let mut file = File::open(&self.path).map_err(read_error)?;
        file.seek(SeekFrom::Start(offset)).map_err(read_error)?;
        // The length was checked against the file's when it was opened.
        let mut bytes = vec![0u8; length as usize];
        file.read_exact(&mut bytes).map_err(read_error)?;
        let (content, hash) = bytes.split_at(bytes.len() - HASH as usize);
        if blake3::hash(content).as_bytes() != hash {
            return Err(damaged(&format!("block {index} does not match its checksum")));
        }
        let words: Vec<[u8; 4]> = content.as_chunks::<4>().0.to_vec();
        if u32::from_le_bytes(words[0]) != index || u32::from_le_bytes(words[1]) != self.header.block_samples(index) {
            return Err(damaged(&format!("this is not block {index}")));
        }
        let values: Vec<f32> = words[2..].iter().map(|&w| f32::from_le_bytes(w)).collect();
        Ok(values.as_chunks::<3>().0.to_vec())
    }
}
