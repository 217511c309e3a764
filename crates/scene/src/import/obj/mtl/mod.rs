//! MTL: the materials of an OBJ file, as their file has them.
//!
//! What a statement says is kept here; `convert` says what it means for a metallic-roughness material. Nothing in a
//! material library is an error: a statement that cannot be read is left out with a warning.

mod bump;
mod convert;
mod map;

pub use convert::{Converter, matte};
pub use map::{Map, file_name, file_names};

use super::number;
use super::parse::line_place;
use super::text::{Lines, name, trim, word};
use crate::import::budget::{Budget, OverBudget};
use crate::import::warning::{WarningKind, Warnings};
use crate::model;

/// One `newmtl`. `None` is what the file leaves open.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Definition {
    pub name: String,
    pub line: usize,
    /// `Kd`, linear.
    pub diffuse: Option<[f64; 3]>,
    /// `Ks`, linear.
    pub specular: Option<[f64; 3]>,
    /// `Ke`, linear.
    pub emission: Option<[f64; 3]>,
    /// `Tf`: what passes through.
    pub filter: Option<[f64; 3]>,
    /// `Ns`: the exponent of a Blinn-Phong lobe.
    pub exponent: Option<f64>,
    /// `Ni`: index of refraction.
    pub ior: Option<f64>,
    /// `d`, or 1 - `Tr`.
    pub dissolve: Option<f64>,
    /// `illum`.
    pub model: Option<u32>,
    /// `Pr`.
    pub roughness: Option<f64>,
    /// `Pm`.
    pub metallic: Option<f64>,
    /// `Ps`.
    pub sheen: Option<f64>,
    /// `Pc`.
    pub clearcoat: Option<f64>,
    /// `Pcr`.
    pub clearcoat_roughness: Option<f64>,
    /// `aniso`.
    pub anisotropy: Option<f64>,
    /// `anisor`: a part of a turn.
    pub anisotropy_rotation: Option<f64>,
    pub map_diffuse: Option<Map>,
    pub map_emission: Option<Map>,
    pub map_dissolve: Option<Map>,
    pub map_normal: Option<Map>,
    pub map_bump: Option<Map>,
    pub map_roughness: Option<Map>,
    pub map_metallic: Option<Map>,
}

/// What a definition and its material take at most while vectors double.
const DEFINITION_BYTES: u64 = 3 * size_of::<Definition>() as u64 + 2 * size_of::<model::Material>() as u64;

/// Reads a library. `file` is its name for warnings.
pub fn parse(text: &[u8], file: &str, budget: &Budget, warnings: &mut Warnings) -> Result<Vec<Definition>, OverBudget> {
    let mut definitions: Vec<Definition> = Vec::new();
    for line in Lines::new(text, 1) {
        let Some((keyword, rest)) = word(&line.text) else { continue };
        if keyword[0] == b'#' {
            continue;
        }
        let mut warn = |what: String| {
            let kind = WarningKind::MaterialLibrary { file: file.to_owned(), what };
            warnings.push(kind, || line_place(line.number));
        };
        if keyword.eq_ignore_ascii_case(b"newmtl") {
            budget.charge(DEFINITION_BYTES)?;
            definitions.push(Definition { name: name(trim(rest)), line: line.number, ..Definition::default() });
            continue;
        }
        match definitions.last_mut() {
            None => warn("a statement before the first newmtl is ignored".to_owned()),
            Some(definition) => {
                // A map keeps its file's name.
                budget.charge(2 * rest.len() as u64)?;
                definition.statement(keyword, rest, &mut warn);
            }
        }
    }
    Ok(definitions)
}

impl Definition {
    /// Keywords are compared without regard to case: exporters write `map_Bump`, `map_bump`, `map_kd`.
    fn statement(&mut self, keyword: &[u8], rest: &[u8], warn: &mut impl FnMut(String)) {
        let lower = keyword.to_ascii_lowercase();
        match &lower[..] {
            b"kd" => color(&mut self.diffuse, "Kd", rest, warn),
            b"ks" => color(&mut self.specular, "Ks", rest, warn),
            b"ke" => color(&mut self.emission, "Ke", rest, warn),
            b"tf" => color(&mut self.filter, "Tf", rest, warn),
            b"ns" => scalar(&mut self.exponent, "Ns", rest, warn),
            b"ni" => scalar(&mut self.ior, "Ni", rest, warn),
            b"d" => scalar(&mut self.dissolve, "d", rest, warn),
            b"tr" => {
                let mut transparency = None;
                scalar(&mut transparency, "Tr", rest, warn);
                // `d` is what the format defines; where a file has both, they do not always agree.
                self.dissolve = self.dissolve.or(transparency.map(|t: f64| 1.0 - t));
            }
            b"illum" => {
                let mut model = None;
                scalar(&mut model, "illum", rest, warn);
                self.model = model.map(|m: f64| m.clamp(0.0, 100.0) as u32).or(self.model);
            }
            b"pr" => scalar(&mut self.roughness, "Pr", rest, warn),
            b"pm" => scalar(&mut self.metallic, "Pm", rest, warn),
            b"ps" => scalar(&mut self.sheen, "Ps", rest, warn),
            b"pc" => scalar(&mut self.clearcoat, "Pc", rest, warn),
            b"pcr" => scalar(&mut self.clearcoat_roughness, "Pcr", rest, warn),
            b"aniso" => scalar(&mut self.anisotropy, "aniso", rest, warn),
            b"anisor" => scalar(&mut self.anisotropy_rotation, "anisor", rest, warn),
            b"map_kd" => Map::set(&mut self.map_diffuse, "map_Kd", rest, warn),
            b"map_ke" => Map::set(&mut self.map_emission, "map_Ke", rest, warn),
            b"map_d" => Map::set(&mut self.map_dissolve, "map_d", rest, warn),
            b"norm" | b"map_norm" | b"map_kn" => Map::set(&mut self.map_normal, "norm", rest, warn),
            b"map_pr" => Map::set(&mut self.map_roughness, "map_Pr", rest, warn),
            b"map_pm" => Map::set(&mut self.map_metallic, "map_Pm", rest, warn),
            b"bump" | b"map_bump" => Map::set(&mut self.map_bump, "bump", rest, warn),
            // Ambient light is what a path tracer computes. Kt is no statement of the format, and what it says is in Tf.
            b"ka" | b"kt" | b"map_ka" | b"sharpness" | b"map_aat" | b"ao" => {}
            b"map_ks" | b"map_ns" | b"map_tr" | b"map_ps" | b"map_pc" | b"map_pcr" | b"map_rma" | b"map_orm"
            | b"refl" | b"map_refl" | b"disp" | b"map_disp" | b"decal" => {
                warn(format!("{} is not rendered", name(keyword)));
            }
            _ => warn("a statement that MTL does not define is ignored".to_owned()),
        }
    }
}

/// One number stands for grey. Spectral curves and CIE XYZ are other forms of the statement.
fn color(out: &mut Option<[f64; 3]>, statement: &str, rest: &[u8], warn: &mut impl FnMut(String)) {
    let mut values = [0.0; 3];
    let mut found = 0;
    let mut rest = rest;
    while found < 3
        && let Some((token, after)) = word(rest)
        && token[0] != b'#'
    {
        if found == 0 && (token == b"spectral" || token == b"xyz") {
            return warn(format!("{statement} is given as {}, which is not read; write RGB", name(token)));
        }
        match number::parse(token).filter(|value| value.is_finite()) {
            Some(value) => values[found] = value.max(0.0),
            None => return warn(format!("{statement} has a value that is no finite number; it is ignored")),
        }
        found += 1;
        rest = after;
    }
    match found {
        1 => *out = Some([values[0]; 3]),
        3 => *out = Some(values),
        _ => warn(format!("{statement} needs one or three numbers; it is ignored")),
    }
}

/// The first number of a line; words before it are options, such as `-halo`.
fn scalar(out: &mut Option<f64>, statement: &str, rest: &[u8], warn: &mut impl FnMut(String)) {
    let mut rest = rest;
    while let Some((token, after)) = word(rest) {
        match number::parse(token) {
            Some(value) if value.is_finite() => return *out = Some(value),
            None if token == b"-halo" => rest = after,
            _ => break,
        }
    }
    warn(format!("{statement} needs a finite number; it is ignored"));
}
