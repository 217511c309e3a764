//! Gzip (RFC 1952), one member.

use crate::import::{Fault, ImportFault, content};
use miniz_oxide::inflate::TINFLStatus;
use miniz_oxide::inflate::decompress_to_vec_with_limit;

/// The unpacked bytes; what is not gzip is given as it is.
pub fn unpack(bytes: &[u8], limit: u64) -> Result<Vec<u8>, Fault> {
    if !bytes.starts_with(&[0x1f, 0x8b]) {
        return Ok(bytes.to_vec());
    }
    let truncated = || (Some(bytes.len() as u64), ImportFault::Truncated("the gzip header"));
    let header = bytes.get(..10).ok_or_else(truncated)?;
    let (method, flags) = (header[2], header[3]);
    if method != 8 || flags & 0xe0 != 0 {
        return content(2, "this kind of gzip file is not known");
    }
    let mut at = 10;
    if flags & 4 != 0 {
        let length = bytes.get(at..at + 2).ok_or_else(truncated)?;
        at += 2 + usize::from(u16::from_le_bytes([length[0], length[1]]));
    }
    // The original name, and a comment, each ended by a zero.
    for flag in [8, 16] {
        if flags & flag != 0 {
            let rest = bytes.get(at..).ok_or_else(truncated)?;
            at += rest.iter().position(|&byte| byte == 0).ok_or_else(truncated)? + 1;
        }
    }
    if flags & 2 != 0 {
        at += 2;
    }
    let packed = bytes.get(at..bytes.len().saturating_sub(8)).ok_or_else(truncated)?;
    let limit_here = usize::try_from(limit).unwrap_or(usize::MAX);
    let unpacked = decompress_to_vec_with_limit(packed, limit_here).map_err(|error| match error.status {
        TINFLStatus::HasMoreOutput => (None, ImportFault::OverBudget { needed: limit.saturating_add(1), limit }),
        _ => (Some(at as u64), ImportFault::Content(format!("the gzip stream is damaged: {error}"))),
    })?;
    let trailer = &bytes[bytes.len() - 8..];
    let number = |at: usize| u32::from_le_bytes([trailer[at], trailer[at + 1], trailer[at + 2], trailer[at + 3]]);
    if number(0) != crc32(&unpacked) || number(4) != unpacked.len() as u32 {
        return content(bytes.len() as u64 - 8, "the gzip stream is damaged: its checksum is another");
    }
    Ok(unpacked)
}

/// CRC-32 (RFC 1952, section 8), by bytes.
pub fn crc32(bytes: &[u8]) -> u32 {
    const TABLE: [u32; 256] = {
        let mut table = [0; 256];
        let mut n = 0;
        while n < 256 {
            let mut c = n as u32;
            let mut bit = 0;
            while bit < 8 {
                c = if c & 1 == 1 { 0xedb8_8320 ^ (c >> 1) } else { c >> 1 };
                bit += 1;
            }
            table[n] = c;
            n += 1;
        }
        table
    };
    !bytes.iter().fold(u32::MAX, |crc, &byte| TABLE[usize::from(crc as u8 ^ byte)] ^ (crc >> 8))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn packed(content: &[u8], flags: u8, extra: &[u8]) -> Vec<u8> {
        let mut bytes = vec![0x1f, 0x8b, 8, flags, 0, 0, 0, 0, 0, 255];
        bytes.extend(extra);
        bytes.extend(miniz_oxide::deflate::compress_to_vec(content, 6));
        bytes.extend(crc32(content).to_le_bytes());
        bytes.extend((content.len() as u32).to_le_bytes());
        bytes
    }

    #[test]
    fn the_checksum_is_that_of_the_standard() {
        assert_eq!(crc32(b"123456789"), 0xcbf4_3926);
    }

    #[test]
    fn headers_of_all_kinds_are_skipped_and_damage_is_noticed() {
        let content = b"some bytes, some bytes, some bytes";
        for (flags, extra) in
            [(0, &b""[..]), (8, b"name\0"), (4, b"\x03\0abc"), (2, b"xx"), (31, b"\x01\0anme\0note\0xx")]
        {
            let good = packed(content, flags, extra);
            assert_eq!(unpack(&good, 1000).unwrap(), content);
            assert!(matches!(unpack(&good, 10), Err((_, ImportFault::OverBudget { .. }))));
            for length in 2..good.len() {
                assert!(unpack(&good[..length], 1000).is_err());
            }
            let mut bad = good.clone();
            let middle = good.len() - 12;
            bad[middle] ^= 1;
            assert!(unpack(&bad, 1000).is_err());
        }
        assert_eq!(unpack(b"\x0a\0\0\0", 10).unwrap(), b"\x0a\0\0\0");
    }
}
