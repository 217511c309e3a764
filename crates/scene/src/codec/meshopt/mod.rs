//! EXT_meshopt_compression and KHR_meshopt_compression: the bitstreams of appendix A and the filters of appendix B of
//! the KHR extension's specification, of which the EXT extension's are a subset.
//!
//! A compressed buffer view says what it holds ([`View`]), and [`decode`] gives its bytes. Bad input is an error with
//! the byte offset; memory is taken only after the data was found long enough to hold what it declares.

mod attributes;
mod error;
mod filters;
mod indices;
mod reader;
#[cfg(test)]
mod tests;
mod triangles;

pub use error::MeshoptError;

/// `mode`: the bitstream.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Mode {
    /// `ATTRIBUTES`: elements of any kind, by byte-wise differences.
    Attributes,
    /// `TRIANGLES`: indices of a triangle list, by shared edges.
    Triangles,
    /// `INDICES`: indices of another kind.
    Indices,
}

impl Mode {
    /// The mode of a name in the document.
    pub fn from_name(name: &str) -> Option<Self> {
        [Self::Attributes, Self::Triangles, Self::Indices].into_iter().find(|mode| mode.name() == name)
    }

    /// The name in the document.
    pub fn name(self) -> &'static str {
        match self {
            Self::Attributes => "ATTRIBUTES",
            Self::Triangles => "TRIANGLES",
            Self::Indices => "INDICES",
        }
    }
}

impl std::fmt::Display for Mode {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

/// `filter`: what is done to decoded attributes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Filter {
    /// `NONE`.
    #[default]
    None,
    /// `OCTAHEDRAL`: unit vectors of 4 x 8 or 4 x 16 bits.
    Octahedral,
    /// `QUATERNION`: unit quaternions of 4 x 16 bits.
    Quaternion,
    /// `EXPONENTIAL`: floats of an 8-bit exponent and a 24-bit mantissa.
    Exponential,
    /// `COLOR` (KHR only): RGBA of 4 x 8 or 4 x 16 bits, from YCoCg.
    Color,
}

impl Filter {
    const ALL: [Self; 5] = [Self::None, Self::Octahedral, Self::Quaternion, Self::Exponential, Self::Color];

    /// The filter of a name in the document.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|filter| filter.name() == name)
    }

    /// The name in the document.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "NONE",
            Self::Octahedral => "OCTAHEDRAL",
            Self::Quaternion => "QUATERNION",
            Self::Exponential => "EXPONENTIAL",
            Self::Color => "COLOR",
        }
    }
}

impl std::fmt::Display for Filter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

/// What a compressed buffer view holds, as its extension object says it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct View {
    /// The bitstream.
    pub mode: Mode,
    /// The filter.
    pub filter: Filter,
    /// Elements (indices in the modes of indices).
    pub count: usize,
    /// Bytes of an element.
    pub stride: usize,
}

impl View {
    /// Decoded bytes: count x stride.
    pub fn byte_length(&self) -> Option<usize> {
        self.count.checked_mul(self.stride)
    }

    /// Checks the rules of the extension object that concern the stride, the count and the filter.
    ///
    /// # Errors
    /// Names the rule that is broken.
    pub fn check(&self) -> Result<(), MeshoptError> {
        let Self { mode, filter, count, stride } = *self;
        match mode {
            Mode::Attributes if stride == 0 || stride % 4 != 0 || stride > 256 => {
                return Err(MeshoptError::StrideOfMode { stride, mode, allowed: "a multiple of 4 in 4..=256" });
            }
            Mode::Triangles | Mode::Indices if stride != 2 && stride != 4 => {
                return Err(MeshoptError::StrideOfMode { stride, mode, allowed: "2 or 4" });
            }
            Mode::Triangles if count % 3 != 0 => return Err(MeshoptError::CountOfTriangles { count }),
            _ => {}
        }
        if mode != Mode::Attributes && filter != Filter::None {
            return Err(MeshoptError::FilterOfMode { filter, mode });
        }
        match filter {
            Filter::Octahedral | Filter::Color if stride != 4 && stride != 8 => {
                Err(MeshoptError::StrideOfFilter { stride, filter, allowed: "4 or 8" })
            }
            Filter::Quaternion if stride != 8 => Err(MeshoptError::StrideOfFilter { stride, filter, allowed: "8" }),
            _ => Ok(()),
        }
    }
}

/// Checks that data of this length and first byte can hold a view, before memory is taken for it.
///
/// # Errors
/// If the view breaks a rule of its extension object, or the data is too short for its count whatever it holds.
pub fn check(view: View, data: &[u8]) -> Result<(), MeshoptError> {
    view.check()?;
    match view.mode {
        Mode::Attributes => attributes::check(data, view.count, view.stride).map(|_| ()),
        Mode::Triangles => triangles::body(data, view.count).map(|_| ()),
        Mode::Indices => indices::body(data, view.count).map(|_| ()),
    }
}

/// Decodes a view to count x stride bytes. All numbers in them are little-endian, as in every glTF buffer.
///
/// Both versions of the attribute stream are understood in either extension.
///
/// # Errors
/// If the view breaks a rule, needs more than `max_bytes`, or its data is not such a stream, whole and without rest.
pub fn decode(view: View, data: &[u8], max_bytes: u64) -> Result<Vec<u8>, MeshoptError> {
    let over_budget = MeshoptError::OverBudget { count: view.count, stride: view.stride, limit: max_bytes };
    let length = view.byte_length().filter(|&n| n as u64 <= max_bytes).ok_or(over_budget)?;
    check(view, data)?;
    let mut out = vec![0; length];
    decode_into(view, data, &mut out)?;
    Ok(out)
}

/// [`decode`] into memory that is there already. After an error, what it holds is of no use.
///
/// # Errors
/// As [`decode`].
///
/// # Panics
/// If `out` does not have [`View::byte_length`] bytes.
pub fn decode_into(view: View, data: &[u8], out: &mut [u8]) -> Result<(), MeshoptError> {
    view.check()?;
    assert_eq!(Some(out.len()), view.byte_length(), "the memory is not of the size of the view");
    let View { mode, filter, count, stride } = view;
    match mode {
        Mode::Attributes => attributes::decode(data, count, stride, out)?,
        Mode::Triangles => triangles::decode(data, count, stride, out)?,
        Mode::Indices => indices::decode(data, count, stride, out)?,
    }
    filters::apply(filter, stride, out);
    Ok(())
}
