//! Putting shares together.

use super::{Header, Share, ShareError, coverage};
use std::path::PathBuf;

/// A whole image, from its shares.
#[derive(Clone, Debug, PartialEq)]
pub struct Merged {
    /// The header of one share: size, samples, tone mapping are those of all.
    pub header: Header,
    /// Mean linear radiance by pixel, rows from the top.
    pub pixels: Vec<[f32; 3]>,
}

/// Reads shares in any order, checks that they belong together and cover the image exactly once, and adds their blocks
/// in block order. One block of one share is held at a time, besides the image.
///
/// # Errors
/// Every [`ShareError`].
///
/// # Panics
/// If there are no shares.
pub fn merge(paths: &[PathBuf], max_memory: u64) -> Result<Merged, ShareError> {
    assert!(!paths.is_empty(), "the command line asks for at least one share");
    let shares: Vec<Share> = paths.iter().map(|p| Share::open(p)).collect::<Result<_, _>>()?;
    for share in &shares[1..] {
        same_rendering(share, &shares[0])?;
    }
    coverage::check(&shares)?;

    let header = shares[0].header.clone();
    let needed = u64::from(header.width) * u64::from(header.height) * 48;
    if needed > max_memory {
        return Err(ShareError::TooLarge { path: shares[0].path.clone(), needed, limit: max_memory });
    }
    let width = header.width as usize;
    let mut sum = vec![[0.0f32; 3]; width * header.height as usize];
    for block in 0..header.spp.div_ceil(super::BLOCK) {
        for share in shares.iter().filter(|s| s.header.blocks().contains(&block)) {
            let tile = share.header.tile();
            let rows = share.read_block(block)?;
            for (y, row) in rows.chunks_exact(tile.width as usize).enumerate() {
                let at = (tile.y as usize + y) * width + tile.x as usize;
                for (s, v) in sum[at..at + row.len()].iter_mut().zip(row) {
                    *s = [s[0] + v[0], s[1] + v[1], s[2] + v[2]];
                }
            }
        }
    }
    // The same division as `Film::resolve`
    let samples = header.spp as f32;
    let pixels = sum.into_iter().map(|s| s.map(|c| c / samples)).collect();
    Ok(Merged { header, pixels })
}

fn same_rendering(share: &Share, first: &Share) -> Result<(), ShareError> {
    let (a, b) = (&share.header, &first.header);
    let fields = [
        ("program", a.program.clone(), b.program.clone()),
        ("backend", a.backend.clone(), b.backend.clone()),
        ("image width", a.width.to_string(), b.width.to_string()),
        ("image height", a.height.to_string(), b.height.to_string()),
        ("number of samples", a.spp.to_string(), b.spp.to_string()),
        ("seed", a.seed.to_string(), b.seed.to_string()),
        ("hash of scene and settings", a.settings.clone(), b.settings.clone()),
        ("tone mapper", a.tonemap.clone(), b.tonemap.clone()),
        ("exposure", a.exposure.to_string(), b.exposure.to_string()),
    ];
    for (field, this, that) in fields {
        if this != that {
            let (path, other) = (share.path.clone(), first.path.clone());
            return Err(ShareError::Foreign { path, other, field, this, that });
        }
    }
    Ok(())
}
