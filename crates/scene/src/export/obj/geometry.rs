//! Vertices and elements.

use crate::export::surface::{Surface, is_surface, triangles};
use crate::model::PrimitiveMode;
use glam::DAffine3;
use std::collections::HashMap;
use std::hash::Hash;
use std::io::{self, Write};

/// Writes objects. Positions, texture coordinates and normals that are equal to the bit are written once for each object,
/// so that faces which share a corner share it in the file too.
pub struct Geometry<'w> {
    out: &'w mut dyn Write,
    positions: Numbers<[u32; 6]>,
    texcoords: Numbers<[u32; 2]>,
    normals: Numbers<[u32; 3]>,
    material: Option<String>,
    is_smooth: bool,
    /// Elements that were left out, because a position of theirs is not finite.
    pub left_out: u64,
    /// Whether a vertex colour has an alpha, which is left out.
    pub has_alpha: bool,
}

/// The numbers that the file gives to values: from 1, over all objects.
struct Numbers<K> {
    known: HashMap<K, u64>,
    count: u64,
}

impl<K: Hash + Eq> Numbers<K> {
    fn new() -> Self {
        Self { known: HashMap::new(), count: 0 }
    }

    /// The number of a value, and whether it is new.
    fn of(&mut self, key: K) -> (u64, bool) {
        let mut is_new = false;
        let number = *self.known.entry(key).or_insert_with(|| {
            is_new = true;
            self.count += 1;
            self.count
        });
        (number, is_new)
    }
}

/// A vertex in the file; 0 is what it does not have.
#[derive(Clone, Copy, Default)]
struct Corner {
    v: u64,
    t: u64,
    n: u64,
}

/// Points that one statement lists.
const POINTS_A_LINE: usize = 32;

impl<'w> Geometry<'w> {
    pub fn new(out: &'w mut dyn Write) -> Self {
        Self {
            out,
            positions: Numbers::new(),
            texcoords: Numbers::new(),
            normals: Numbers::new(),
            material: None,
            is_smooth: false,
            left_out: 0,
            has_alpha: false,
        }
    }

    /// Begins an object. One without a name is called by the number of its node.
    pub fn object(&mut self, name: &str, node: usize) -> io::Result<()> {
        self.positions.known.clear();
        self.texcoords.known.clear();
        self.normals.known.clear();
        match super::materials::line_name(name).as_str() {
            "" => writeln!(self.out, "o node{node}"),
            name => writeln!(self.out, "o {name}"),
        }
    }

    /// Writes a primitive, placed by `world`.
    pub fn primitive(
        &mut self,
        mode: PrimitiveMode,
        surface: &Surface,
        world: &DAffine3,
        material: &str,
    ) -> io::Result<()> {
        let placed;
        let surface = if *world == DAffine3::IDENTITY {
            surface
        } else {
            let mut moved = Surface {
                positions: surface.positions.clone(),
                normals: surface.normals.clone(),
                texcoords: None,
                colors: None,
                indices: Vec::new(),
            };
            moved.transform(world);
            placed = Surface {
                texcoords: surface.texcoords.clone(),
                colors: surface.colors.clone(),
                indices: surface.indices.clone(),
                ..moved
            };
            &placed
        };
        let has_faces = is_surface(mode);
        let corners = self.corners(surface, has_faces)?;
        if self.material.as_deref() != Some(material) && !material.is_empty() {
            writeln!(self.out, "usemtl {material}")?;
            self.material = Some(material.to_owned());
        }
        if !has_faces {
            return self.lines_and_points(mode, &corners, &surface.indices);
        }
        let is_smooth = surface.normals.is_some();
        if is_smooth != self.is_smooth {
            writeln!(self.out, "s {}", if is_smooth { "1" } else { "off" })?;
            self.is_smooth = is_smooth;
        }
        // A map that mirrors turns the front of a triangle to its back.
        let is_mirrored = world.matrix3.determinant() < 0.0;
        for triangle in triangles(mode, surface.indices.clone()).as_chunks::<3>().0 {
            let [a, b, c] = triangle.map(|i| corners[i as usize]);
            self.face(if is_mirrored { [a, c, b] } else { [a, b, c] })?;
        }
        Ok(())
    }

    /// Writes the values of all vertices that an element names, in the order of the vertices.
    fn corners(&mut self, surface: &Surface, is_shaded: bool) -> io::Result<Vec<Corner>> {
        let mut corners = vec![Corner::default(); surface.positions.len()];
        let mut is_used = vec![false; corners.len()];
        surface.indices.iter().for_each(|&i| is_used[i as usize] = true);
        for v in (0..corners.len()).filter(|&v| is_used[v]) {
            corners[v].v = self.position(surface, v)?;
            if !is_shaded {
                continue;
            }
            if let Some(&[u, t]) = surface.texcoords.as_ref().map(|t| &t[v])
                && u.is_finite()
                && t.is_finite()
            {
                // OBJ measures v from the bottom.
                let uv = [u, 1.0 - t];
                let (number, is_new) = self.texcoords.of(uv.map(f32::to_bits));
                corners[v].t = number;
                if is_new {
                    writeln!(self.out, "vt {} {}", uv[0], uv[1])?;
                }
            }
            if let Some(&normal) = surface.normals.as_ref().map(|n| &n[v])
                && normal.iter().all(|c| c.is_finite())
                && normal != [0.0; 3]
            {
                let (number, is_new) = self.normals.of(normal.map(f32::to_bits));
                corners[v].n = number;
                if is_new {
                    writeln!(self.out, "vn {} {} {}", normal[0], normal[1], normal[2])?;
                }
            }
        }
        Ok(corners)
    }

    fn position(&mut self, surface: &Surface, v: usize) -> io::Result<u64> {
        let [x, y, z] = surface.positions[v];
        if ![x, y, z].iter().all(|c| c.is_finite()) {
            return Ok(0);
        }
        let color = surface.colors.as_ref().map(|colors| colors[v]).filter(|c| c.iter().all(|c| c.is_finite()));
        // No colour of a file is this one.
        let [r, g, b, a] = color.unwrap_or([f32::NAN, f32::NAN, f32::NAN, 1.0]);
        self.has_alpha |= a != 1.0;
        let (number, is_new) = self.positions.of([x, y, z, r, g, b].map(f32::to_bits));
        if is_new {
            match color {
                Some(_) => writeln!(self.out, "v {x} {y} {z} {r} {g} {b}")?,
                None => writeln!(self.out, "v {x} {y} {z}")?,
            }
        }
        Ok(number)
    }

    /// All corners of a face have the same form, as the format asks.
    fn face(&mut self, corners: [Corner; 3]) -> io::Result<()> {
        if corners.iter().any(|c| c.v == 0) {
            self.left_out += 1;
            return Ok(());
        }
        let has_texcoords = corners.iter().all(|c| c.t != 0);
        let has_normals = corners.iter().all(|c| c.n != 0);
        self.out.write_all(b"f")?;
        for Corner { v, t, n } in corners {
            match (has_texcoords, has_normals) {
                (false, false) => write!(self.out, " {v}")?,
                (true, false) => write!(self.out, " {v}/{t}")?,
                (false, true) => write!(self.out, " {v}//{n}")?,
                (true, true) => write!(self.out, " {v}/{t}/{n}")?,
            }
        }
        self.out.write_all(b"\n")
    }

    fn lines_and_points(&mut self, mode: PrimitiveMode, corners: &[Corner], indices: &[u32]) -> io::Result<()> {
        let numbers: Vec<u64> = indices.iter().map(|&i| corners[i as usize].v).collect();
        let looped;
        let (step, length) = match mode {
            PrimitiveMode::Points => {
                let known: Vec<u64> = numbers.iter().copied().filter(|&v| v != 0).collect();
                self.left_out += (numbers.len() - known.len()) as u64;
                return known.chunks(POINTS_A_LINE).try_for_each(|points| self.element("p", points));
            }
            PrimitiveMode::Lines => (2, &numbers[..]),
            PrimitiveMode::LineLoop if numbers.len() > 1 => {
                looped = [&numbers[..], &numbers[..1]].concat();
                (1, &looped[..])
            }
            _ => (1, &numbers[..]),
        };
        for line in length.windows(2).step_by(step) {
            if line.contains(&0) {
                self.left_out += 1;
            } else {
                self.element("l", line)?;
            }
        }
        Ok(())
    }

    fn element(&mut self, statement: &str, numbers: &[u64]) -> io::Result<()> {
        self.out.write_all(statement.as_bytes())?;
        numbers.iter().try_for_each(|number| write!(self.out, " {number}"))?;
        self.out.write_all(b"\n")
    }
}
