//! BasisLZ with ETC1S: two codebooks for the whole file, and per slice two indices a block.

use super::bits::Bits;
use super::huffman::Huffman;

/// Intensity modifiers of ETC1 by table and selector (Khronos Data Format, "ETC1", in the order of ETC1S selectors).
const MODIFIERS: [[i32; 4]; 8] = [
    [-8, -2, 2, 8],
    [-17, -5, 5, 17],
    [-29, -9, 9, 29],
    [-42, -13, 13, 42],
    [-60, -18, 18, 60],
    [-80, -24, 24, 80],
    [-106, -33, 33, 106],
    [-183, -47, 47, 183],
];

/// A base colour of 5 bits a channel and an intensity table.
#[derive(Clone, Copy)]
struct Endpoint {
    color: [u8; 3],
    table: u8,
}

/// Where a slice is in its level.
#[derive(Clone, Copy)]
struct Slice {
    offset: usize,
    length: usize,
}

/// What the second slice of an image holds.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Second {
    Nothing,
    Green,
    Alpha,
}

/// The slices of one image (here: of one level).
struct ImageSlices {
    first: Slice,
    second: Slice,
}

/// The global data of a file, its codebooks decoded.
pub(in crate::textures) struct BasisLz {
    images: Vec<ImageSlices>,
    tables: Tables,
    endpoints: Vec<Endpoint>,
    /// Four rows of four selectors of two bits, from the lowest bit.
    selectors: Vec<[u8; 4]>,
    red_only: bool,
    second: Second,
}

struct Tables {
    endpoint_pred: Huffman,
    endpoint_delta: Huffman,
    selector: Huffman,
    run_length: Huffman,
    history: usize,
}

impl BasisLz {
    /// Reads the global data of a file of so many levels. `channels` are the channel ids of its samples.
    pub(in crate::textures) fn new(global: &[u8], levels: usize, channels: &[u8]) -> Result<Self, String> {
        let word = |at: usize| -> Result<u32, String> {
            let bytes = global.get(at..at + 4).ok_or("the BasisLZ global data is cut off")?;
            Ok(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
        };
        let counts = word(0)?;
        let (endpoint_count, selector_count) = ((counts & 0xffff) as usize, (counts >> 16) as usize);
        let mut at = 20;
        let mut images = Vec::with_capacity(levels);
        for _ in 0..levels {
            if word(at)? & 2 != 0 {
                return Err("the KTX2 file is a video; a material's texture is one image".into());
            }
            let slice = |at: usize| -> Result<Slice, String> {
                Ok(Slice { offset: word(at)? as usize, length: word(at + 4)? as usize })
            };
            images.push(ImageSlices { first: slice(at + 4)?, second: slice(at + 12)? });
            at += 20;
        }
        let mut section = |length: u32| -> Result<&[u8], String> {
            let bytes = global.get(at..).and_then(|rest| rest.get(..length as usize));
            at += length as usize;
            bytes.ok_or_else(|| "a section of the BasisLZ global data is cut off".into())
        };
        let endpoints = read_endpoints(section(word(4)?)?, endpoint_count)?;
        let selectors = read_selectors(section(word(8)?)?, selector_count)?;
        let tables = read_tables(section(word(12)?)?)?;
        // Channel ids of ETC1S samples: 0 RGB, 3 RRR, 4 GGG, 15 alpha.
        let (red_only, second) = match channels {
            [_, 15] => (false, Second::Alpha),
            [3, 4] => (true, Second::Green),
            [3] => (true, Second::Nothing),
            [_] => (false, Second::Nothing),
            _ => return Err("the KTX2 descriptor has channels that ETC1S cannot have".into()),
        };
        Ok(Self { images, tables, endpoints, selectors, red_only, second })
    }

    /// Decodes a level to RGBA of 8 bits.
    pub(in crate::textures) fn decode(&self, level: usize, data: &[u8], w: u32, h: u32) -> Result<Vec<u8>, String> {
        let (w, h) = (w as usize, h as usize);
        let slices = &self.images[level];
        let part = |slice: Slice| {
            let bytes = data.get(slice.offset..).and_then(|rest| rest.get(..slice.length));
            bytes.filter(|b| !b.is_empty()).ok_or_else(|| format!("a slice of level {level} lies outside of the level"))
        };
        let blocks = self.blocks(part(slices.first)?, w, h)?;
        let mut out = vec![255; w * h * 4];
        let red_only = self.red_only;
        self.paint(&blocks, &mut out, w, |texel, color| {
            texel[..3].copy_from_slice(&color);
            if red_only {
                (texel[1], texel[2]) = (0, 0);
            }
        });
        if self.second != Second::Nothing {
            let blocks = self.blocks(part(slices.second)?, w, h)?;
            let channel = if self.second == Second::Alpha { 3 } else { 1 };
            // A slice of one channel is stored in all three.
            self.paint(&blocks, &mut out, w, |texel, color| texel[channel] = color[1]);
        }
        Ok(out)
    }

    /// Calls `set` with each texel that a block covers, and its colour.
    fn paint(&self, blocks: &[(u16, u16)], out: &mut [u8], width: usize, set: impl Fn(&mut [u8], [u8; 3])) {
        let across = width.div_ceil(4);
        for (row, blocks) in out.chunks_mut(width * 4 * 4).zip(blocks.chunks(across)) {
            for (bx, &(endpoint, selector)) in blocks.iter().enumerate() {
                let Endpoint { color, table } = self.endpoints[usize::from(endpoint)];
                let base = color.map(|c| i32::from(c << 3 | c >> 2));
                let palette = MODIFIERS[usize::from(table)].map(|m| base.map(|c| (c + m).clamp(0, 255) as u8));
                for (line, bits) in row.chunks_mut(width * 4).zip(self.selectors[usize::from(selector)]) {
                    for (x, texel) in line[bx * 16..].chunks_exact_mut(4).take(4).enumerate() {
                        set(texel, palette[usize::from(bits >> (2 * x) & 3)]);
                    }
                }
            }
        }
    }

    /// The endpoint and selector of each block of a slice, in raster order ("ETC1S Slice Block Decoding").
    fn blocks(&self, data: &[u8], width: usize, height: usize) -> Result<Vec<(u16, u16)>, String> {
        const REPEAT_LAST: u32 = 256;
        let (across, down) = (width.div_ceil(4), height.div_ceil(4));
        // Runs let few bits stand for many blocks, so that only the level's own size bounds their number.
        let mut blocks: Vec<(u16, u16)> = Vec::with_capacity(across * down);
        let bits = &mut Bits::new(data);
        let broken = |what: &str| format!("an ETC1S slice is broken: {what}");
        let mut selectors = SelectorReader::new(self);
        let mut kept_bits = vec![0u8; across.div_ceil(2)];
        let (mut pred_bits, mut last_symbol, mut repeats) = (0u32, 0u32, 0u32);
        let mut previous = 0usize;
        for y in 0..down {
            for x in 0..across {
                if x % 2 == 0 {
                    if y % 2 == 0 {
                        // One symbol predicts the endpoints of 2 x 2 blocks.
                        if repeats > 0 {
                            repeats -= 1;
                            pred_bits = last_symbol;
                        } else {
                            let symbol = self.tables.endpoint_pred.decode(bits);
                            let symbol = symbol.ok_or_else(|| broken("a prediction has no code"))?;
                            if symbol == REPEAT_LAST {
                                repeats = vlc(bits, 4).saturating_add(2);
                                pred_bits = last_symbol;
                            } else {
                                (pred_bits, last_symbol) = (symbol, symbol);
                            }
                        }
                        kept_bits[x / 2] = (pred_bits >> 4) as u8;
                    } else {
                        pred_bits = u32::from(kept_bits[x / 2]);
                    }
                }
                let index = y * across + x;
                let endpoint = match pred_bits & 3 {
                    0 if x > 0 => previous,
                    1 if y > 0 => usize::from(blocks[index - across].0),
                    2 if x > 0 && y > 0 => usize::from(blocks[index - across - 1].0),
                    3 => {
                        let delta = self.tables.endpoint_delta.decode(bits);
                        let delta = delta.ok_or_else(|| broken("an endpoint has no code"))? as usize;
                        let sum = previous + delta;
                        if sum >= self.endpoints.len() { sum - self.endpoints.len() } else { sum }
                    }
                    _ => return Err(broken("a block takes the endpoint of one outside of the image")),
                };
                pred_bits >>= 2;
                if endpoint >= self.endpoints.len() {
                    return Err(broken("there is no such endpoint"));
                }
                previous = endpoint;
                let selector = selectors.next(bits).map_err(broken)?;
                blocks.push((endpoint as u16, selector));
            }
            if bits.overran() {
                return Err(broken("it is cut off"));
            }
        }
        Ok(blocks)
    }
}

/// Selector indices, through the history of those used lately ("ETC1S Approximate Move to Front Routines").
struct SelectorReader<'a> {
    basis: &'a BasisLz,
    history: Vec<u16>,
    rover: usize,
    run: u32,
}

impl<'a> SelectorReader<'a> {
    fn new(basis: &'a BasisLz) -> Self {
        let size = basis.tables.history;
        Self { basis, history: vec![0; size], rover: size / 2, run: 0 }
    }

    fn next(&mut self, bits: &mut Bits) -> Result<u16, &'static str> {
        let count = self.basis.selectors.len();
        let mut symbol = count;
        if self.run > 0 {
            self.run -= 1;
        } else {
            symbol = self.basis.tables.selector.decode(bits).ok_or("a selector has no code")? as usize;
            if symbol == count + self.history.len() {
                let run = self.basis.tables.run_length.decode(bits).ok_or("a run has no code")?;
                // The longest run of the table stands for one that is written out.
                let run = if run == 63 { vlc(bits, 7) } else { run };
                self.run = run.saturating_add(3 - 1);
                symbol = count;
            }
        }
        if symbol < count {
            if !self.history.is_empty() {
                self.history[self.rover] = symbol as u16;
                self.rover += 1;
                if self.rover == self.history.len() {
                    self.rover /= 2;
                }
            }
            return Ok(symbol as u16);
        }
        let at = symbol - count;
        let selector = *self.history.get(at).ok_or("a selector is from behind the history")?;
        self.history.swap(at, at / 2);
        if usize::from(selector) >= count {
            return Err("there is no such selector");
        }
        Ok(selector)
    }
}

/// A number in chunks of `n` bits, each with one more that says whether another follows.
fn vlc(bits: &mut Bits, n: u32) -> u32 {
    let (mut value, mut shift) = (0u32, 0);
    while shift < 32 {
        let chunk = bits.read(n + 1);
        value |= (chunk & ((1 << n) - 1)) << shift;
        shift += n;
        if chunk >> n == 0 {
            break;
        }
    }
    value
}

fn read_endpoints(data: &[u8], count: usize) -> Result<Vec<Endpoint>, String> {
    let bits = &mut Bits::new(data);
    let color_models = [Huffman::read(bits)?, Huffman::read(bits)?, Huffman::read(bits)?];
    let table_model = Huffman::read(bits)?;
    let grayscale = bits.read(1) == 1;
    let broken = || "the ETC1S endpoints are broken or cut off".to_owned();
    let (mut color, mut table) = ([16u8; 3], 0u8);
    let mut endpoints = Vec::with_capacity(count);
    for _ in 0..count {
        table = (u32::from(table) + table_model.decode(bits).ok_or_else(broken)?) as u8 & 7;
        for channel in 0..if grayscale { 1 } else { 3 } {
            let previous = color[channel];
            let model = match previous {
                0..=9 => &color_models[0],
                10..=21 => &color_models[1],
                _ => &color_models[2],
            };
            color[channel] = (u32::from(previous) + model.decode(bits).ok_or_else(broken)?) as u8 & 31;
        }
        if grayscale {
            color = [color[0]; 3];
        }
        endpoints.push(Endpoint { color, table });
        if bits.overran() {
            return Err(broken());
        }
    }
    Ok(endpoints)
}

fn read_selectors(data: &[u8], count: usize) -> Result<Vec<[u8; 4]>, String> {
    let bits = &mut Bits::new(data);
    let broken = || "the ETC1S selectors are broken or cut off".to_owned();
    if bits.read(2) != 0 {
        return Err(broken());
    }
    let raw = bits.read(1) == 1;
    let model = if raw { None } else { Some(Huffman::read(bits)?) };
    let mut selectors: Vec<[u8; 4]> = Vec::with_capacity(count);
    for _ in 0..count {
        let mut rows = [0; 4];
        match (&model, selectors.last()) {
            (Some(model), Some(previous)) => {
                for (row, previous) in rows.iter_mut().zip(previous) {
                    *row = model.decode(bits).ok_or_else(broken)? as u8 ^ previous;
                }
            }
            _ => rows.iter_mut().for_each(|row| *row = bits.read(8) as u8),
        }
        selectors.push(rows);
        if bits.overran() {
            return Err(broken());
        }
    }
    Ok(selectors)
}

fn read_tables(data: &[u8]) -> Result<Tables, String> {
    let bits = &mut Bits::new(data);
    let tables = Tables {
        endpoint_pred: Huffman::read(bits)?,
        endpoint_delta: Huffman::read(bits)?,
        selector: Huffman::read(bits)?,
        run_length: Huffman::read(bits)?,
        history: bits.read(13) as usize,
    };
    if bits.overran() {
        return Err("the ETC1S tables are cut off".into());
    }
    Ok(tables)
}
