//! From the types of compressed data to those that accessors declare.

use crate::codec::draco::{Component, DracoAttribute};
use crate::model::ComponentType;

/// Why a value cannot be converted.
type Refusal = String;

/// Appends indices in the type of their accessor.
pub fn append_indices(indices: &[u32], to: ComponentType, out: &mut Vec<u8>) -> Result<(), Refusal> {
    let limit = match to {
        ComponentType::U8 => u32::from(u8::MAX),
        ComponentType::U16 => u32::from(u16::MAX),
        ComponentType::U32 => u32::MAX,
        other => return Err(format!("indices cannot be {other:?}")),
    };
    if let Some(max) = indices.iter().max().filter(|&&max| max > limit) {
        return Err(format!("index {max} of the compressed mesh does not fit {to:?}"));
    }
    match to {
        ComponentType::U8 => out.extend(indices.iter().map(|&i| i as u8)),
        ComponentType::U16 => out.extend(indices.iter().flat_map(|&i| (i as u16).to_le_bytes())),
        _ => out.extend(indices.iter().flat_map(|i| i.to_le_bytes())),
    }
    Ok(())
}

/// Appends the values of an attribute in the type of its accessor, `stride` bytes apart. Between integers the value is
/// kept; between an integer that stands for 0..1 or -1..1 and a float, what it stands for.
pub fn append_attribute(
    attribute: &DracoAttribute,
    to: ComponentType,
    normalized: bool,
    stride: usize,
    out: &mut Vec<u8>,
) -> Result<(), Refusal> {
    let components = usize::from(attribute.components);
    let size = to.size() * components;
    if is_same(attribute.component, to) {
        if stride == size {
            out.extend_from_slice(&attribute.data);
            return Ok(());
        }
        for value in attribute.data.chunks_exact(size) {
            out.extend_from_slice(value);
            out.resize(out.len() + stride - size, 0);
        }
        return Ok(());
    }
    let from = attribute.component;
    for value in attribute.data.chunks_exact(from.size() * components) {
        for bytes in value.chunks_exact(from.size()) {
            let number = read(from, bytes);
            let number = match (integer_range(from), target_range(to)) {
                (Some(max), None) if attribute.normalized || normalized => (number / max).max(-1.0),
                (None, Some((_, max))) if attribute.normalized || normalized => (number * max).round(),
                _ => number,
            };
            write(number, to, out).ok_or_else(|| {
                format!("the compressed value {number} of {from:?} does not fit the accessor's {to:?}")
            })?;
        }
        out.resize(out.len() + stride - size, 0);
    }
    Ok(())
}

/// Brings floats that stand for colours into the range that glTF asks for, which quantisation leads out of by a step.
pub fn clamp_colors(floats: &mut [u8]) {
    for bytes in floats.as_chunks_mut::<4>().0 {
        // NaN stays what it is.
        *bytes = f32::from_le_bytes(*bytes).clamp(0.0, 1.0).to_le_bytes();
    }
}

/// The least and the greatest value of each component; `None` where a component has no number.
#[derive(Debug, PartialEq)]
pub struct Bounds {
    pub min: Option<Vec<f64>>,
    pub max: Option<Vec<f64>>,
}

/// The bounds of elements that are `stride` bytes apart.
pub fn bounds(elements: &[u8], component: ComponentType, components: usize, stride: usize) -> Bounds {
    let mut min = vec![f64::INFINITY; components];
    let mut max = vec![f64::NEG_INFINITY; components];
    let from = match component {
        ComponentType::I8 => Component::I8,
        ComponentType::U8 => Component::U8,
        ComponentType::I16 => Component::I16,
        ComponentType::U16 => Component::U16,
        ComponentType::U32 => Component::U32,
        ComponentType::F32 => Component::F32,
    };
    for element in elements.chunks_exact(stride) {
        for (c, bytes) in element.chunks_exact(from.size()).take(components).enumerate() {
            let number = read(from, bytes);
            min[c] = min[c].min(number);
            max[c] = max[c].max(number);
        }
    }
    let finite = |values: Vec<f64>| values.iter().all(|v| v.is_finite()).then_some(values);
    Bounds { min: finite(min), max: finite(max) }
}

fn is_same(from: Component, to: ComponentType) -> bool {
    matches!(
        (from, to),
        (Component::I8, ComponentType::I8)
            | (Component::U8 | Component::Bool, ComponentType::U8)
            | (Component::I16, ComponentType::I16)
            | (Component::U16, ComponentType::U16)
            | (Component::U32, ComponentType::U32)
            | (Component::F32, ComponentType::F32)
    )
}

/// Integers up to 2^53 are exact; larger ones fit no type that an accessor has.
fn read(from: Component, bytes: &[u8]) -> f64 {
    let mut b = [0; 8];
    b[..bytes.len()].copy_from_slice(bytes);
    match from {
        Component::I8 => f64::from(b[0] as i8),
        Component::U8 | Component::Bool => f64::from(b[0]),
        Component::I16 => f64::from(i16::from_le_bytes([b[0], b[1]])),
        Component::U16 => f64::from(u16::from_le_bytes([b[0], b[1]])),
        Component::I32 => f64::from(i32::from_le_bytes([b[0], b[1], b[2], b[3]])),
        Component::U32 => f64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]])),
        Component::F32 => f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])),
        Component::I64 => i64::from_le_bytes(b) as f64,
        Component::U64 => u64::from_le_bytes(b) as f64,
        Component::F64 => f64::from_le_bytes(b),
    }
}

/// The integer that stands for 1.
fn integer_range(component: Component) -> Option<f64> {
    Some(match component {
        Component::I8 => f64::from(i8::MAX),
        Component::U8 => f64::from(u8::MAX),
        Component::I16 => f64::from(i16::MAX),
        Component::U16 => f64::from(u16::MAX),
        Component::I32 => f64::from(i32::MAX),
        Component::U32 => f64::from(u32::MAX),
        Component::I64 => i64::MAX as f64,
        Component::U64 => u64::MAX as f64,
        Component::Bool => 1.0,
        Component::F32 | Component::F64 => return None,
    })
}

/// The least and the greatest integer. `None` for floats.
fn target_range(component: ComponentType) -> Option<(f64, f64)> {
    Some(match component {
        ComponentType::I8 => (f64::from(i8::MIN), f64::from(i8::MAX)),
        ComponentType::U8 => (0.0, f64::from(u8::MAX)),
        ComponentType::I16 => (f64::from(i16::MIN), f64::from(i16::MAX)),
        ComponentType::U16 => (0.0, f64::from(u16::MAX)),
        ComponentType::U32 => (0.0, f64::from(u32::MAX)),
        ComponentType::F32 => return None,
    })
}

fn write(number: f64, to: ComponentType, out: &mut Vec<u8>) -> Option<()> {
    if let Some((min, max)) = target_range(to) {
        // NaN is in no range.
        if !(min..=max).contains(&number) || number.fract() != 0.0 {
            return None;
        }
    }
    match to {
        ComponentType::I8 => out.extend((number as i8).to_le_bytes()),
        ComponentType::U8 => out.extend((number as u8).to_le_bytes()),
        ComponentType::I16 => out.extend((number as i16).to_le_bytes()),
        ComponentType::U16 => out.extend((number as u16).to_le_bytes()),
        ComponentType::U32 => out.extend((number as u32).to_le_bytes()),
        ComponentType::F32 => out.extend((number as f32).to_le_bytes()),
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::codec::draco::AttributeKind;

    fn attribute(component: Component, components: u8, normalized: bool, data: Vec<u8>) -> DracoAttribute {
        DracoAttribute { unique_id: 0, kind: AttributeKind::Generic, component, components, normalized, data }
    }

    fn converted(a: &DracoAttribute, to: ComponentType, normalized: bool, stride: usize) -> Result<Vec<u8>, String> {
        let mut out = Vec::new();
        append_attribute(a, to, normalized, stride, &mut out).map(|()| out)
    }

    fn floats(values: &[f32]) -> Vec<u8> {
        values.iter().flat_map(|v| v.to_le_bytes()).collect()
    }

    #[test]
    fn values_of_the_same_type_are_copied_and_padded_to_their_stride() {
        let a = attribute(Component::U8, 3, false, vec![1, 2, 3, 4, 5, 6]);
        assert_eq!(converted(&a, ComponentType::U8, true, 4).unwrap(), [1, 2, 3, 0, 4, 5, 6, 0]);
        assert_eq!(converted(&a, ComponentType::U8, true, 3).unwrap(), [1, 2, 3, 4, 5, 6]);
    }

    #[test]
    fn integers_keep_their_value_or_are_refused() {
        let a = attribute(Component::U32, 1, false, [7_u32, 300].iter().flat_map(|v| v.to_le_bytes()).collect());
        assert_eq!(converted(&a, ComponentType::U16, false, 4).unwrap(), [7, 0, 0, 0, 44, 1, 0, 0]);
        let message = converted(&a, ComponentType::U8, false, 4).unwrap_err();
        assert!(message.contains("300"), "{message}");
        let negative = attribute(Component::I8, 1, false, vec![0xff]);
        assert!(converted(&negative, ComponentType::U16, false, 4).is_err());
        assert_eq!(converted(&negative, ComponentType::I16, false, 4).unwrap(), [0xff, 0xff, 0, 0]);
    }

    #[test]
    fn normalized_integers_stand_for_fractions() {
        let bytes = attribute(Component::U8, 2, true, vec![255, 51]);
        assert_eq!(converted(&bytes, ComponentType::F32, false, 8).unwrap(), floats(&[1.0, 0.2]));
        let signed = attribute(Component::I8, 2, true, vec![0x80, 127]);
        assert_eq!(converted(&signed, ComponentType::F32, false, 8).unwrap(), floats(&[-1.0, 1.0]));
        let plain = attribute(Component::U8, 2, false, vec![255, 51]);
        assert_eq!(converted(&plain, ComponentType::F32, false, 8).unwrap(), floats(&[255.0, 51.0]));
        let fractions = attribute(Component::F32, 2, false, floats(&[1.0, 0.2]));
        assert_eq!(converted(&fractions, ComponentType::U8, true, 4).unwrap(), [255, 51, 0, 0]);
        for odd in [f32::NAN, f32::INFINITY, 1.5, -0.5] {
            let odd = attribute(Component::F32, 1, false, floats(&[odd]));
            assert!(converted(&odd, ComponentType::U8, true, 4).is_err());
        }
    }

    #[test]
    fn colours_are_brought_into_range() {
        let mut colors = floats(&[1.0007, -0.1, 0.5, f32::NAN]);
        clamp_colors(&mut colors);
        assert_eq!(colors, floats(&[1.0, 0.0, 0.5, f32::NAN]));
    }

    #[test]
    fn bounds_are_of_each_component_and_leave_out_what_is_no_number() {
        let elements = floats(&[1.0, 5.0, f32::NAN, 4.0, -2.0, 6.0]);
        let expected = Bounds { min: Some(vec![-2.0, 4.0]), max: Some(vec![1.0, 6.0]) };
        assert_eq!(bounds(&elements, ComponentType::F32, 2, 8), expected);
        let nothing = bounds(&floats(&[f32::NAN]), ComponentType::F32, 1, 4);
        assert_eq!(nothing, Bounds { min: None, max: None });
        let padded = bounds(&[1, 2, 3, 99, 4, 1, 0, 99], ComponentType::U8, 3, 4);
        assert_eq!(padded, Bounds { min: Some(vec![1.0, 1.0, 0.0]), max: Some(vec![4.0, 2.0, 3.0]) });
    }

    #[test]
    fn indices_fit_the_type_of_their_accessor_or_are_refused() {
        let mut out = Vec::new();
        append_indices(&[0, 255], ComponentType::U8, &mut out).unwrap();
        append_indices(&[256], ComponentType::U16, &mut out).unwrap();
        append_indices(&[65536], ComponentType::U32, &mut out).unwrap();
        assert_eq!(out, [0, 255, 0, 1, 0, 0, 1, 0]);
        assert!(append_indices(&[256], ComponentType::U8, &mut out).is_err());
        assert!(append_indices(&[65536], ComponentType::U16, &mut out).is_err());
        assert!(append_indices(&[0], ComponentType::F32, &mut out).is_err());
    }
}
