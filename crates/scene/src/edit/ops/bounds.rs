//! Bounds of numbers, as the JSON schemas of glTF 2.0 and of the extensions have them (and where a sentence of a
//! specification relates two numbers, that). Import tolerates what files have; an edit that sets a number is held to them.

use crate::edit::EditError;
use crate::model::Kind;
use serde_json::Value;
use std::f64::consts::{FRAC_PI_2, PI};
use std::fmt::{Display, Write};

/// What a number may be.
#[derive(Clone, Copy)]
enum Bound {
    /// 0 to 1, both included.
    Unit,
    /// This or more.
    AtLeast(f64),
    /// More than 0.
    Positive,
    /// More than 0, this or less.
    PositiveUpTo(f64),
    /// More than 0, less than this.
    PositiveBelow(f64),
    /// 0 or more, less than this.
    Below(f64),
    /// 0, or 1 and more.
    ZeroOrAtLeastOne,
    /// Anything but 0.
    NotZero,
}

use Bound::{AtLeast, Below, NotZero, Positive, PositiveBelow, PositiveUpTo, Unit, ZeroOrAtLeastOne};

const MATERIAL: &[(&str, Bound)] = &[
    ("/pbrMetallicRoughness/baseColorFactor", Unit),
    ("/pbrMetallicRoughness/metallicFactor", Unit),
    ("/pbrMetallicRoughness/roughnessFactor", Unit),
    ("/emissiveFactor", Unit),
    ("/alphaCutoff", AtLeast(0.0)),
    ("/occlusionTexture/strength", Unit),
    ("/extensions/KHR_materials_emissive_strength/emissiveStrength", AtLeast(0.0)),
    ("/extensions/KHR_materials_ior/ior", ZeroOrAtLeastOne),
    ("/extensions/KHR_materials_dispersion/dispersion", AtLeast(0.0)),
    ("/extensions/KHR_materials_clearcoat/clearcoatFactor", Unit),
    ("/extensions/KHR_materials_clearcoat/clearcoatRoughnessFactor", Unit),
    ("/extensions/KHR_materials_transmission/transmissionFactor", Unit),
    ("/extensions/KHR_materials_diffuse_transmission/diffuseTransmissionFactor", Unit),
    ("/extensions/KHR_materials_diffuse_transmission/diffuseTransmissionColorFactor", Unit),
    ("/extensions/KHR_materials_volume/thicknessFactor", AtLeast(0.0)),
    ("/extensions/KHR_materials_volume/attenuationDistance", Positive),
    ("/extensions/KHR_materials_volume/attenuationColor", Unit),
    ("/extensions/KHR_materials_specular/specularFactor", Unit),
    ("/extensions/KHR_materials_specular/specularColorFactor", AtLeast(0.0)),
    ("/extensions/KHR_materials_sheen/sheenColorFactor", Unit),
    ("/extensions/KHR_materials_sheen/sheenRoughnessFactor", Unit),
    ("/extensions/KHR_materials_iridescence/iridescenceFactor", Unit),
    ("/extensions/KHR_materials_iridescence/iridescenceIor", AtLeast(1.0)),
    ("/extensions/KHR_materials_iridescence/iridescenceThicknessMinimum", AtLeast(0.0)),
    ("/extensions/KHR_materials_iridescence/iridescenceThicknessMaximum", AtLeast(0.0)),
    ("/extensions/KHR_materials_anisotropy/anisotropyStrength", Unit),
    ("/extensions/KHR_materials_pbrSpecularGlossiness/diffuseFactor", Unit),
    ("/extensions/KHR_materials_pbrSpecularGlossiness/specularFactor", Unit),
    ("/extensions/KHR_materials_pbrSpecularGlossiness/glossinessFactor", Unit),
];

const LIGHT: &[(&str, Bound)] = &[
    ("/color", Unit),
    ("/intensity", AtLeast(0.0)),
    ("/range", Positive),
    ("/spot/innerConeAngle", Below(FRAC_PI_2)),
    ("/spot/outerConeAngle", PositiveUpTo(FRAC_PI_2)),
];

const CAMERA: &[(&str, Bound)] = &[
    ("/perspective/yfov", PositiveBelow(PI)),
    ("/perspective/aspectRatio", Positive),
    ("/perspective/znear", Positive),
    ("/perspective/zfar", Positive),
    ("/orthographic/xmag", NotZero),
    ("/orthographic/ymag", NotZero),
    ("/orthographic/znear", AtLeast(0.0)),
    ("/orthographic/zfar", Positive),
];

/// A number and its default, if it has one.
type Member = (&'static str, Option<f64>);

/// Pairs of which the first has to be less than the second.
const ORDERED: &[(Kind, Member, Member)] = &[
    (Kind::Light, ("/spot/innerConeAngle", Some(0.0)), ("/spot/outerConeAngle", Some(FRAC_PI_2 / 2.0))),
    (Kind::Camera, ("/perspective/znear", None), ("/perspective/zfar", None)),
    (Kind::Camera, ("/orthographic/znear", None), ("/orthographic/zfar", None)),
];

impl Bound {
    fn has(self, v: f64) -> bool {
        match self {
            Unit => (0.0..=1.0).contains(&v),
            AtLeast(least) => v >= least,
            Positive => v > 0.0,
            PositiveUpTo(most) => v > 0.0 && v <= most,
            PositiveBelow(end) => v > 0.0 && v < end,
            Below(end) => (0.0..end).contains(&v),
            ZeroOrAtLeastOne => v == 0.0 || v >= 1.0,
            NotZero => v != 0.0,
        }
    }

    fn says(self) -> String {
        match self {
            Unit => "it has to be from 0 to 1".to_owned(),
            AtLeast(least) => format!("it has to be {least} or more"),
            Positive => "it has to be more than 0".to_owned(),
            PositiveUpTo(most) => format!("it has to be more than 0 and at most {most}"),
            PositiveBelow(end) => format!("it has to be more than 0 and less than {end}"),
            Below(end) => format!("it has to be 0 or more and less than {end}"),
            ZeroOrAtLeastOne => "it has to be 0, or 1 or more".to_owned(),
            NotZero => "it may not be 0".to_owned(),
        }
    }
}

/// Checks the numbers that a patch sets. `value` is the whole object with the patch in it; `base` is where the patch is in
/// the edit.
///
/// # Errors
/// The first number that is out of its bounds, with its JSON pointer.
pub fn check(kind: Kind, value: &Value, patch: &Value, base: &str) -> Result<(), EditError> {
    let bounds = match kind {
        Kind::Material => MATERIAL,
        Kind::Light => LIGHT,
        Kind::Camera => CAMERA,
        _ => &[],
    };
    Patch { bounds, base, path: String::new() }.numbers(patch, value)?;
    let is_set = |pointer: &str| patch.pointer(pointer).is_some();
    for &(of, (less, less_default), (more, more_default)) in ORDERED {
        if of != kind || !(is_set(less) || is_set(more)) {
            continue;
        }
        let number = |pointer: &str, default: Option<f64>| value.pointer(pointer).and_then(Value::as_f64).or(default);
        if let (Some(a), Some(b)) = (number(less, less_default), number(more, more_default))
            && a >= b
        {
            let (at, name) = if is_set(less) { (less, more) } else { (more, less) };
            let name = name.rsplit('/').next().unwrap_or_default();
            let than = if is_set(less) { "less" } else { "more" };
            let what = format!("it has to be {than} than {name}, which is {}", if is_set(less) { b } else { a });
            return Err(EditError::value(format!("{base}{at}"), what));
        }
    }
    Ok(())
}

/// A walk over what a patch sets: the patch is short, the table of what could be set is not.
struct Patch<'b> {
    bounds: &'b [(&'b str, Bound)],
    base: &'b str,
    /// JSON pointer into the object.
    path: String,
}

impl Patch<'_> {
    /// `value` is what the object has, with the patch in it, where the patch has `patch`.
    fn numbers(&mut self, patch: &Value, value: &Value) -> Result<(), EditError> {
        if let Some(&(_, bound)) = self.bounds.iter().find(|(pointer, _)| *pointer == self.path) {
            let outside = |v: &Value| v.as_f64().is_some_and(|v| !bound.has(v));
            if outside(value) {
                return Err(self.refused("", bound.says()));
            }
            if let Some(i) = value.as_array().and_then(|list| list.iter().position(outside)) {
                return Err(self.refused(&format!("/{i}"), bound.says()));
            }
        }
        match patch {
            // Renderers take numbers of 32 bits.
            Value::Number(number) if number.as_f64().is_some_and(|v| !(v as f32).is_finite()) => {
                Err(self.refused("", "the number is too large; at most 3.4e38 can be used".to_owned()))
            }
            Value::Array(list) => list.iter().enumerate().try_for_each(|(i, v)| self.member(i, v, &Value::Null)),
            Value::Object(members) => {
                members.iter().try_for_each(|(key, v)| self.member(key, v, value.get(key).unwrap_or(&Value::Null)))
            }
            _ => Ok(()),
        }
    }

    fn member(&mut self, key: impl Display, patch: &Value, value: &Value) -> Result<(), EditError> {
        let length = self.path.len();
        // A string takes everything.
        let _ = write!(self.path, "/{key}");
        self.numbers(patch, value)?;
        self.path.truncate(length);
        Ok(())
    }

    fn refused(&self, below: &str, what: String) -> EditError {
        EditError::value(format!("{}{}{below}", self.base, self.path), what)
    }
}
