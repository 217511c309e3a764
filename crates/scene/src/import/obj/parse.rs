//! From text to plain arrays, in parallel and with a result that does not depend on how the text was cut.
//!
//! Two passes over pieces of whole lines. The first counts lines, positions, texture coordinates and normals. From then on
//! each piece knows its first line and what came before it, so that the second pass writes values to their final place,
//! resolves negative indices and names lines in errors without waiting for the pieces before.

use super::charged::ChargedVec;
use super::corner::{Corner, Indexer};
use super::text::{Lines, is_blank, pieces, trim, word};
use super::{Fault, ObjFault, number};
use crate::import::Place;
use crate::import::budget::{Budget, OverBudget};
use crate::import::warning::{WarningKind, Warnings};
use rayon::prelude::*;

/// What an element is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// `f`.
    Polygon,
    /// `l`.
    Line,
    /// `p`.
    Points,
}

/// A face, polyline or set of points: so many of the piece's corners, in order.
#[derive(Clone, Copy)]
pub struct Element {
    tag: u32,
    line: u32,
}

impl Element {
    const LIMIT: usize = 1 << 30;

    fn new(kind: Kind, corners: usize, line: usize) -> Self {
        Self { tag: (kind as u32) << 30 | corners as u32, line: u32::try_from(line).unwrap_or(u32::MAX) }
    }

    #[inline]
    pub fn kind(self) -> Kind {
        match self.tag >> 30 {
            0 => Kind::Polygon,
            1 => Kind::Line,
            _ => Kind::Points,
        }
    }

    #[inline]
    pub fn corners(self) -> usize {
        self.tag as usize & (Self::LIMIT - 1)
    }

    pub fn place(self) -> Place {
        line_place(self.line as usize)
    }
}

/// A statement that holds for the elements after it.
pub enum Change {
    /// `usemtl`.
    Material(Box<[u8]>),
    /// `s`; 0 is off.
    Smoothing(u32),
    /// `o`.
    Object(Box<[u8]>),
    /// `g`: names, as the line has them.
    Group(Box<[u8]>),
    /// `mtllib`.
    Library(Box<[u8]>),
}

/// A [`Change`] and where it takes effect.
pub struct Event {
    /// Elements of the piece that come before it.
    pub element: usize,
    /// Corners of these.
    pub corner: usize,
    pub line: usize,
    pub change: Change,
}

/// What a piece of the text holds besides values.
pub struct Piece<'b> {
    pub corners: ChargedVec<'b, Corner>,
    pub elements: ChargedVec<'b, Element>,
    pub events: ChargedVec<'b, Event>,
    /// Colours of the piece's first positions; NaN where a position has none. Positions after the last have none.
    colors: ChargedVec<'b, [f32; 3]>,
    has_zero_normal: bool,
    warnings: Warnings,
}

/// The whole file.
pub struct Parsed<'b> {
    pub positions: Vec<[f32; 3]>,
    /// None, or one per position: NaN where it has none.
    pub colors: Vec<[f32; 3]>,
    /// As the file has them: the origin is at the bottom left.
    pub uvs: Vec<[f32; 2]>,
    /// Of length 1, or 0.
    pub normals: Vec<[f32; 3]>,
    pub has_zero_normal: bool,
    pub pieces: Vec<Piece<'b>>,
}

/// How many of each there are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    pub positions: usize,
    pub uvs: usize,
    pub normals: usize,
}

pub fn line_place(line: usize) -> Place {
    Place::Line { line, column: 1 }
}

/// Pieces below this size are not worth a thread.
const SMALLEST_PIECE: usize = 1 << 18;

/// Parses a text. Values, corners and elements are charged; what the vectors of the result hold stays so.
pub fn parse<'b>(text: &[u8], budget: &'b Budget, warnings: &mut Warnings) -> Result<Parsed<'b>, Fault> {
    parse_pieces(&pieces(text, (text.len() / (8 * rayon::current_num_threads())).max(SMALLEST_PIECE)), budget, warnings)
}

fn parse_pieces<'b>(texts: &[&[u8]], budget: &'b Budget, warnings: &mut Warnings) -> Result<Parsed<'b>, Fault> {
    let counted: Vec<(usize, Counts)> = texts.par_iter().map(|text| count(text)).collect();
    let mut total = Counts::default();
    for (_, counts) in &counted {
        total.positions += counts.positions;
        total.uvs += counts.uvs;
        total.normals += counts.normals;
    }
    for (kind, count) in [("positions", total.positions), ("vt", total.uvs), ("vn", total.normals)] {
        // Generated normals are numbered after those of the file.
        let limit = u64::from(u32::MAX / 2);
        if count as u64 > limit {
            return Err((Place::Whole, ObjFault::TooMany { kind, limit }.into()));
        }
    }
    let bytes = 12 * (total.positions + total.normals) + 8 * total.uvs;
    budget.charge(bytes as u64).map_err(whole)?;
    let mut positions = vec![[0.0; 3]; total.positions];
    let mut uvs = vec![[0.0; 2]; total.uvs];
    let mut normals = vec![[0.0; 3]; total.normals];

    let mut tasks = Vec::with_capacity(texts.len());
    let (mut first_line, mut before) = (1, Counts::default());
    let (mut p, mut t, mut n) = (&mut positions[..], &mut uvs[..], &mut normals[..]);
    for (text, (lines, counts)) in texts.iter().zip(counted) {
        let (p0, p1) = p.split_at_mut(counts.positions);
        let (t0, t1) = t.split_at_mut(counts.uvs);
        let (n0, n1) = n.split_at_mut(counts.normals);
        (p, t, n) = (p1, t1, n1);
        tasks.push(PieceParser {
            text,
            first_line,
            total,
            before,
            own: Counts::default(),
            positions: p0,
            uvs: t0,
            normals: n0,
            piece: Piece {
                corners: ChargedVec::new(budget),
                elements: ChargedVec::new(budget),
                events: ChargedVec::new(budget),
                colors: ChargedVec::new(budget),
                has_zero_normal: false,
                warnings: Warnings::default(),
            },
            budget,
        });
        first_line += lines;
        before.positions += counts.positions;
        before.uvs += counts.uvs;
        before.normals += counts.normals;
    }
    let starts: Vec<usize> = tasks.iter().map(|task| task.before.positions).collect();
    // The first error of the text is reported, not the first that a thread meets.
    let parsed: Vec<Result<Piece<'b>, Fault>> = tasks.into_par_iter().map(PieceParser::run).collect();
    let mut pieces = parsed.into_iter().collect::<Result<Vec<_>, Fault>>()?;

    let mut colors = Vec::new();
    if pieces.iter().any(|piece| !piece.colors.is_empty()) {
        budget.charge(12 * total.positions as u64).map_err(whole)?;
        colors = vec![[f32::NAN; 3]; total.positions];
        for (piece, start) in pieces.iter().zip(starts) {
            colors[start..start + piece.colors.len()].copy_from_slice(&piece.colors);
        }
    }
    let mut has_zero_normal = false;
    for piece in &mut pieces {
        warnings.append(std::mem::take(&mut piece.warnings));
        piece.colors = ChargedVec::new(budget);
        has_zero_normal |= piece.has_zero_normal;
    }
    let corners: u64 = pieces.iter().map(|piece| piece.corners.len() as u64).sum();
    let limit = u64::from(u32::MAX / 4);
    if corners > limit {
        return Err((Place::Whole, ObjFault::TooMany { kind: "corners", limit }.into()));
    }
    Ok(Parsed { positions, colors, uvs, normals, has_zero_normal, pieces })
}

fn whole(over: OverBudget) -> Fault {
    (Place::Whole, over.into())
}

/// The lines of a text, and how many values it defines.
fn count(text: &[u8]) -> (usize, Counts) {
    let mut counts = Counts::default();
    let mut lines = Lines::new(text, 0);
    for line in lines.by_ref() {
        let text = &line.text[..];
        let start = text.iter().position(|&b| !is_blank(b)).unwrap_or(text.len());
        match &text[start..] {
            [b'v'] => counts.positions += 1,
            [b'v', b, ..] if is_blank(*b) => counts.positions += 1,
            [b'v', b't'] => counts.uvs += 1,
            [b'v', b't', b, ..] if is_blank(*b) => counts.uvs += 1,
            [b'v', b'n'] => counts.normals += 1,
            [b'v', b'n', b, ..] if is_blank(*b) => counts.normals += 1,
            _ => {}
        }
    }
    (lines.next_number(), counts)
}

struct PieceParser<'t, 'o, 'b> {
    text: &'t [u8],
    first_line: usize,
    total: Counts,
    /// Values of the pieces before.
    before: Counts,
    /// Values of this piece so far.
    own: Counts,
    positions: &'o mut [[f32; 3]],
    uvs: &'o mut [[f32; 2]],
    normals: &'o mut [[f32; 3]],
    piece: Piece<'b>,
    budget: &'b Budget,
}

impl<'b> PieceParser<'_, '_, 'b> {
    fn run(mut self) -> Result<Piece<'b>, Fault> {
        for line in Lines::new(self.text, self.first_line) {
            let Some((keyword, rest)) = word(&line.text) else { continue };
            let done = match keyword {
                b"v" => self.position(rest),
                b"vt" => self.uv(rest),
                b"vn" => self.normal(rest),
                b"f" | b"fo" => self.element(Kind::Polygon, rest, line.number),
                _ => self.rare(keyword, rest, line.number),
            };
            done.map_err(|fault| fault.at(&line.text, line.number))?;
        }
        Ok(self.piece)
    }

    fn position(&mut self, rest: &[u8]) -> Result<(), Refusal> {
        // Four numbers: the last is the weight of a rational curve. Six or more: a colour follows the position.
        let mut numbers = [0.0; 6];
        let found = read_numbers(rest, "v", 3, &mut numbers)?;
        let [x, y, z, r, g, b] = numbers;
        self.positions[self.own.positions] = [x, y, z];
        if found == 6 {
            while self.piece.colors.len() < self.own.positions {
                self.piece.colors.push([f32::NAN; 3])?;
            }
            self.piece.colors.push([r, g, b])?;
        }
        self.own.positions += 1;
        Ok(())
    }

    fn uv(&mut self, rest: &[u8]) -> Result<(), Refusal> {
        let mut uv = [0.0; 2];
        read_numbers(rest, "vt", 1, &mut uv)?;
        self.uvs[self.own.uvs] = uv;
        self.own.uvs += 1;
        Ok(())
    }

    fn normal(&mut self, rest: &[u8]) -> Result<(), Refusal> {
        let mut normal = [0.0; 3];
        read_numbers(rest, "vn", 3, &mut normal)?;
        let [x, y, z] = normal.map(f64::from);
        let squared = x * x + y * y + z * z;
        if (squared - 1.0).abs() > 1e-6 {
            let scale = 1.0 / squared.sqrt();
            if scale.is_finite() {
                normal = [x * scale, y * scale, z * scale].map(|c| c as f32);
            } else {
                normal = [0.0; 3];
                self.piece.has_zero_normal = true;
            }
        }
        self.normals[self.own.normals] = normal;
        self.own.normals += 1;
        Ok(())
    }

    fn element(&mut self, kind: Kind, rest: &[u8], line: usize) -> Result<(), Refusal> {
        let indexer = Indexer { total: self.total, before: self.counts() };
        let start = self.piece.corners.len();
        let mut rest = rest;
        while let Some((token, after)) = word(rest) {
            if token[0] == b'#' {
                break;
            }
            let corner = indexer.corner(token).map_err(|fault| Refusal::of(fault, token))?;
            self.piece.corners.push(corner)?;
            rest = after;
        }
        let count = self.piece.corners.len() - start;
        let (needed, what) = match kind {
            Kind::Polygon => (3, "a face has fewer than three corners; it is left out"),
            Kind::Line => (2, "a line element has fewer than two vertices; it is left out"),
            Kind::Points => (1, "a point element has no vertices; it is left out"),
        };
        if count < needed {
            self.piece.corners.truncate(start);
            self.warn(what, line);
            return Ok(());
        }
        if count >= Element::LIMIT {
            return Err(Refusal::whole_line(ObjFault::TooMany { kind: "corners", limit: Element::LIMIT as u64 }));
        }
        self.piece.elements.push(Element::new(kind, count, line))?;
        Ok(())
    }

    #[cold]
    fn rare(&mut self, keyword: &[u8], rest: &[u8], line: usize) -> Result<(), Refusal> {
        if keyword[0] == b'#' {
            return Ok(());
        }
        let name = trim(rest);
        let change = match keyword {
            b"l" => return self.element(Kind::Line, rest, line),
            b"p" => return self.element(Kind::Points, rest, line),
            b"usemtl" => Change::Material(name.into()),
            b"mtllib" => Change::Library(name.into()),
            b"o" => Change::Object(name.into()),
            b"g" => Change::Group(name.into()),
            b"s" => match smoothing_group(name) {
                Some(group) => Change::Smoothing(group),
                None => {
                    self.warn("a smoothing group is neither a number nor \"off\"; it is taken as off", line);
                    Change::Smoothing(0)
                }
            },
            _ if FREE_FORM.contains(&keyword) => {
                self.warn("free-form curves and surfaces are not read; export them as polygons", line);
                return Ok(());
            }
            _ if DISPLAY.contains(&keyword) => return Ok(()),
            _ => {
                self.warn("a statement that OBJ does not define is ignored", line);
                return Ok(());
            }
        };
        self.budget.charge(name.len() as u64)?;
        let (element, corner) = (self.piece.elements.len(), self.piece.corners.len());
        self.piece.events.push(Event { element, corner, line, change })?;
        Ok(())
    }

    fn counts(&self) -> Counts {
        Counts {
            positions: self.before.positions + self.own.positions,
            uvs: self.before.uvs + self.own.uvs,
            normals: self.before.normals + self.own.normals,
        }
    }

    fn warn(&mut self, what: &'static str, line: usize) {
        self.piece.warnings.push(WarningKind::Tolerated(what), || line_place(line));
    }
}

/// Statements of free-form geometry.
const FREE_FORM: &[&[u8]] = &[
    b"vp", b"cstype", b"deg", b"bmat", b"step", b"curv", b"curv2", b"surf", b"parm", b"trim", b"hole", b"scrv", b"sp",
    b"end", b"con",
];

/// Statements about display and grouping that have no effect on a path-traced image.
const DISPLAY: &[&[u8]] = &[
    b"mg",
    b"bevel",
    b"c_interp",
    b"d_interp",
    b"lod",
    b"maplib",
    b"usemap",
    b"shadow_obj",
    b"trace_obj",
    b"ctech",
    b"stech",
];

/// Whether a word begins a statement of the format.
pub fn is_keyword(word: &[u8]) -> bool {
    const COMMON: &[&[u8]] = &[b"v", b"vt", b"vn", b"f", b"fo", b"l", b"p", b"usemtl", b"mtllib", b"o", b"g", b"s"];
    [COMMON, FREE_FORM, DISPLAY].iter().any(|list| list.contains(&word))
}

fn smoothing_group(text: &[u8]) -> Option<u32> {
    let (word, _) = word(text)?;
    if word.eq_ignore_ascii_case(b"off") {
        return Some(0);
    }
    if word.eq_ignore_ascii_case(b"on") {
        return Some(1);
    }
    let value: i64 = std::str::from_utf8(word).ok()?.parse().ok()?;
    // Some exporters number groups by bits of a signed word.
    u32::try_from(value).or(i32::try_from(value).map(|v| v as u32)).ok()
}

/// Reads up to `N` numbers, of which the first `needed` must be there. A comment may follow.
#[inline]
fn read_numbers<const N: usize>(
    mut rest: &[u8],
    statement: &'static str,
    needed: usize,
    out: &mut [f32; N],
) -> Result<usize, Refusal> {
    let mut found = 0;
    while found < N
        && let Some((token, after)) = word(rest)
        && token[0] != b'#'
    {
        let Some(value) = number::parse(token) else {
            return Err(Refusal::of(ObjFault::NotANumber(excerpt(token)), token));
        };
        out[found] = value as f32;
        if !out[found].is_finite() {
            return Err(Refusal::of(ObjFault::NotFinite(excerpt(token)), token));
        }
        found += 1;
        rest = after;
    }
    if found < needed {
        return Err(Refusal::whole_line(ObjFault::TooFewNumbers { statement, needed, found }));
    }
    Ok(found)
}

/// A word for a message.
pub fn excerpt(token: &[u8]) -> String {
    const LONGEST: usize = 40;
    let text = String::from_utf8_lossy(&token[..token.len().min(LONGEST)]);
    if token.len() > LONGEST { format!("{text}...") } else { text.into_owned() }
}

/// Why a line is refused, and which word of it.
enum Refusal {
    /// The address of the word is compared with that of the line to find its column.
    Line(ObjFault, Option<*const u8>),
    OverBudget(OverBudget),
}

impl Refusal {
    fn of(fault: ObjFault, token: &[u8]) -> Self {
        Self::Line(fault, Some(token.as_ptr()))
    }

    fn whole_line(fault: ObjFault) -> Self {
        Self::Line(fault, None)
    }

    #[cold]
    fn at(self, text: &[u8], line: usize) -> Fault {
        match self {
            Self::Line(fault, token) => {
                let column = token.map_or(1, |token| (token as usize).saturating_sub(text.as_ptr() as usize) + 1);
                (Place::Line { line, column }, fault.into())
            }
            Self::OverBudget(over) => (line_place(line), over.into()),
        }
    }
}

impl From<OverBudget> for Refusal {
    fn from(over: OverBudget) -> Self {
        Self::OverBudget(over)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn how_the_text_is_cut_changes_nothing() {
        let mut text = String::new();
        for i in 0..40 {
            text += &format!("v {i} 0 \\\n {i}.5\nvt 0.{i} 1\nvn 0 {} 1\n", i + 1);
            if i % 7 == 3 {
                text += &format!("v 1 2 3 .1 .2 .3\nusemtl m{i}\ns {i}\n");
            }
            text += "f -1/-1/-1 1/1/1 2/1/1 -1\n";
            text += if i % 5 == 0 { "l 1 -1\n" } else { "\n" };
        }
        // The first line needs a second position.
        let text = format!("v 0 0 0\nv 1 0 0\n{text}");
        let budget = Budget::new(1 << 20);
        let all = |size: usize| {
            let mut warnings = Warnings::default();
            let parsed = parse_pieces(&pieces(text.as_bytes(), size), &budget, &mut warnings).unwrap();
            let corners: Vec<Corner> = parsed.pieces.iter().flat_map(|p| p.corners.iter().copied()).collect();
            let elements: Vec<(u32, u32)> =
                parsed.pieces.iter().flat_map(|p| p.elements.iter().map(|e| (e.tag, e.line))).collect();
            let events: Vec<usize> = parsed.pieces.iter().flat_map(|p| p.events.iter().map(|e| e.line)).collect();
            let colors: Vec<_> = parsed.colors.iter().map(|c| c.map(f32::to_bits)).collect();
            (parsed.positions, parsed.uvs, parsed.normals, colors, corners, elements, events)
        };
        let whole = all(usize::MAX);
        assert_eq!(whole.0.len(), 2 + 40 + 6);
        assert_eq!(whole.5.len(), 48);
        for size in [1, 30, 100, 1000] {
            assert!(all(size) == whole, "pieces of {size} bytes");
        }
    }
}
