//! Whether shares cover an image exactly once.

use super::{BLOCK, Share, ShareError};
use orthant_resident::frame::Tile;

/// Checks that the shares cover every sample of every pixel once.
pub(super) fn check(shares: &[Share]) -> Result<(), ShareError> {
    for (i, share) in shares.iter().enumerate() {
        for other in &shares[..i] {
            if let Some(part) = common_part(share, other) {
                return Err(ShareError::Overlap { path: share.path.clone(), other: other.path.clone(), part });
            }
        }
    }
    let whole = &shares[0].header;
    let pixels = u64::from(whole.width) * u64::from(whole.height);
    for block in 0..whole.spp.div_ceil(BLOCK) {
        let tiles: Vec<Tile> =
            shares.iter().filter(|s| s.header.blocks().contains(&block)).map(|s| s.header.tile()).collect();
        let covered: u64 = tiles.iter().map(|t| u64::from(t.width) * u64::from(t.height)).sum();
        if covered < pixels {
            let (x, y) = first_gap(&tiles, whole.width, whole.height);
            let (first, end) = (block * BLOCK, block * BLOCK + whole.block_samples(block));
            let part = format!("pixel {x},{y} in the samples {first}..{end}");
            return Err(ShareError::Gap { part, width: whole.width, height: whole.height, spp: whole.spp });
        }
    }
    Ok(())
}

/// The part that two shares have in common, in words.
fn common_part(a: &Share, b: &Share) -> Option<String> {
    let (s, t) = (a.header.tile(), b.header.tile());
    let (x, y) = (s.x.max(t.x), s.y.max(t.y));
    let (right, bottom) = ((s.x + s.width).min(t.x + t.width), (s.y + s.height).min(t.y + t.height));
    let first = a.header.samples[0].max(b.header.samples[0]);
    let end = a.header.samples[1].min(b.header.samples[1]);
    let common = x < right && y < bottom && first < end;
    common.then(|| format!("the tile {x},{y},{},{} in the samples {first}..{end}", right - x, bottom - y))
}

/// The first pixel, by rows, that disjoint tiles leave uncovered. There is one.
fn first_gap(tiles: &[Tile], width: u32, height: u32) -> (u32, u32) {
    for y in 0..height {
        let mut row: Vec<(u32, u32)> =
            tiles.iter().filter(|t| (t.y..t.y + t.height).contains(&y)).map(|t| (t.x, t.width)).collect();
        row.sort_unstable();
        let mut x = 0;
        for (at, width) in row {
            if at > x {
                break;
            }
            x = at + width;
        }
        if x < width {
            return (x, y);
        }
    }
    unreachable!("the caller has found fewer covered pixels than the image has")
}
