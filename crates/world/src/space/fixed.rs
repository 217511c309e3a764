//! Coordinates: fixed point numbers that are the same everywhere.

use serde::de::{self, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use std::str::FromStr;

/// A coordinate in world units: a signed 48.16 fixed point number, exact in steps of 1/65,536.
///
/// Arithmetic that could leave the range is checked and gives `None`; nothing ever wraps.
#[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(transparent)]
pub struct Fixed(i64);

/// A number that is no coordinate.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FixedError {
    /// Beyond the range of the type, or not finite.
    #[error("{0} is out of range; coordinates run from -2^47 to 2^47")]
    Range(String),
    /// Between two steps.
    #[error("{0} is no multiple of 1/65536; coordinates have 16 binary digits after the point")]
    Inexact(String),
    /// Not a decimal number.
    #[error("{0:?} is no decimal number")]
    Syntax(String),
}

impl Fixed {
    /// Binary digits after the point.
    pub const FRACTION_BITS: u32 = 16;
    /// 0.
    pub const ZERO: Self = Self(0);
    /// 1 world unit.
    pub const ONE: Self = Self(1 << Self::FRACTION_BITS);
    /// The least difference of two coordinates: 1/65,536.
    pub const STEP: Self = Self(1);

    /// From a count of steps of 1/65,536.
    pub const fn from_raw(raw: i64) -> Self {
        Self(raw)
    }

    /// The count of steps of 1/65,536.
    pub const fn raw(self) -> i64 {
        self.0
    }

    /// A whole number of units.
    pub const fn from_int(units: i32) -> Self {
        Self((units as i64) << Self::FRACTION_BITS)
    }

    /// A whole number of units, if it is in range.
    pub const fn from_i64(units: i64) -> Option<Self> {
        match units.checked_mul(Self::ONE.0) {
            Some(raw) => Some(Self(raw)),
            None => None,
        }
    }

    /// The coordinate that equals the number exactly.
    ///
    /// # Errors
    /// [`FixedError::Range`], [`FixedError::Inexact`].
    pub fn from_f64(value: f64) -> Result<Self, FixedError> {
        let raw = value * 65_536.0;
        // 2^63 itself is out of range, and so is NaN.
        if !(raw >= i64::MIN as f64 && raw < i64::MAX as f64) {
            return Err(FixedError::Range(value.to_string()));
        }
        if raw.fract() != 0.0 {
            return Err(FixedError::Inexact(value.to_string()));
        }
        Ok(Self(raw as i64))
    }

    /// The nearest `f64`.
    pub fn to_f64(self) -> f64 {
        // Dividing by a power of two rounds nothing.
        self.0 as f64 / 65_536.0
    }

    /// The greatest whole number of units that is not above.
    pub const fn floor(self) -> i64 {
        self.0 >> Self::FRACTION_BITS
    }

    /// The sum, if it is in range.
    pub const fn checked_add(self, other: Self) -> Option<Self> {
        match self.0.checked_add(other.0) {
            Some(raw) => Some(Self(raw)),
            None => None,
        }
    }

    /// The difference, if it is in range.
    pub const fn checked_sub(self, other: Self) -> Option<Self> {
        match self.0.checked_sub(other.0) {
            Some(raw) => Some(Self(raw)),
            None => None,
        }
    }

    /// `index * edge`: a corner of a lattice cell, if it is in range.
    pub const fn of_lattice(index: i64, edge: Self) -> Option<Self> {
        match index.checked_mul(edge.0) {
            Some(raw) => Some(Self(raw)),
            None => None,
        }
    }
}

/// The exact decimal number.
impl fmt::Display for Fixed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let magnitude = self.0.unsigned_abs();
        if self.0 < 0 {
            f.write_str("-")?;
        }
        write!(f, "{}", magnitude >> 16)?;
        // n / 2^16 = n * 5^16 / 10^16: at most sixteen digits.
        let fraction = (magnitude & 0xffff) * 152_587_890_625;
        if fraction != 0 {
            let digits = format!("{fraction:016}");
            write!(f, ".{}", digits.trim_end_matches('0'))?;
        }
        Ok(())
    }
}

impl fmt::Debug for Fixed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// An exact decimal number: an optional sign, digits, an optional point with more digits.
impl FromStr for Fixed {
    type Err = FixedError;

    fn from_str(text: &str) -> Result<Self, FixedError> {
        let syntax = || FixedError::Syntax(text.to_owned());
        let range = || FixedError::Range(text.to_owned());
        let inexact = || FixedError::Inexact(text.to_owned());
        let (negative, digits) = match text.strip_prefix('-') {
            Some(rest) => (true, rest),
            None => (false, text),
        };
        let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
        let all_digits = |part: &str| part.bytes().all(|b| b.is_ascii_digit());
        if whole.is_empty() || !all_digits(whole) || !all_digits(fraction) || (digits.ends_with('.')) {
            return Err(syntax());
        }
        let whole: u64 = whole.parse().map_err(|_| range())?;
        let fraction = fraction.trim_end_matches('0');
        if fraction.len() > 16 {
            return Err(inexact());
        }
        let scaled: u64 = format!("{fraction:0<16}").parse().map_err(|_| syntax())?;
        if !scaled.is_multiple_of(152_587_890_625) {
            return Err(inexact());
        }
        let magnitude = i128::from(whole) * 65_536 + i128::from(scaled / 152_587_890_625);
        let raw = if negative { -magnitude } else { magnitude };
        i64::try_from(raw).map(Self).map_err(|_| range())
    }
}

/// A JSON number where that is exact, otherwise a decimal string.
impl Serialize for Fixed {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if self.0 & 0xffff == 0 {
            return serializer.serialize_i64(self.floor());
        }
        // All 64 bits have to survive the 53 bits of a double.
        if self.0 as f64 as i128 == i128::from(self.0) {
            return serializer.serialize_f64(self.to_f64());
        }
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Fixed {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Coordinate;
        impl Visitor<'_> for Coordinate {
            type Value = Fixed;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a coordinate: a number, or an exact decimal number as a string")
            }
            fn visit_i64<E: de::Error>(self, value: i64) -> Result<Fixed, E> {
                Fixed::from_i64(value).ok_or_else(|| E::custom(FixedError::Range(value.to_string())))
            }
            fn visit_u64<E: de::Error>(self, value: u64) -> Result<Fixed, E> {
                let out_of_range = || E::custom(FixedError::Range(value.to_string()));
                i64::try_from(value).ok().and_then(Fixed::from_i64).ok_or_else(out_of_range)
            }
            fn visit_f64<E: de::Error>(self, value: f64) -> Result<Fixed, E> {
                Fixed::from_f64(value).map_err(E::custom)
            }
            fn visit_str<E: de::Error>(self, text: &str) -> Result<Fixed, E> {
                text.parse().map_err(E::custom)
            }
        }
        deserializer.deserialize_any(Coordinate)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_number_between_two_steps_is_refused() {
        assert!(matches!(Fixed::from_f64(0.1), Err(FixedError::Inexact(_))));
        assert!(matches!("0.1".parse::<Fixed>(), Err(FixedError::Inexact(_))));
        assert_eq!("0.5".parse(), Ok(Fixed::from_raw(32_768)));
        assert_eq!("-0.0000152587890625".parse(), Ok(Fixed::from_raw(-1)));
    }

    #[test]
    fn overflow_is_an_error_and_never_wraps() {
        assert_eq!(Fixed::from_i64(1 << 47), None);
        assert_eq!(Fixed::from_i64(-(1 << 47)), Some(Fixed::from_raw(i64::MIN)));
        assert!(matches!(Fixed::from_f64(2.0_f64.powi(47)), Err(FixedError::Range(_))));
        assert!(matches!(Fixed::from_f64(f64::NAN), Err(FixedError::Range(_))));
        assert!(matches!("140737488355328".parse::<Fixed>(), Err(FixedError::Range(_))));
        assert_eq!(Fixed::from_raw(i64::MAX).checked_add(Fixed::STEP), None);
        assert!(serde_json::from_str::<Fixed>("18446744073709551615").is_err());
    }

    #[test]
    fn what_is_no_number_is_refused() {
        for text in ["", "-", ".", "1.", ".5", "+1", "1e3", " 1", "0x10", "--1", "1.5.0"] {
            assert!(matches!(text.parse::<Fixed>(), Err(FixedError::Syntax(_))), "{text:?}");
        }
    }

    proptest! {
        #[test]
        fn text_and_json_come_back_exactly(raw in any::<i64>()) {
            let value = Fixed::from_raw(raw);
            prop_assert_eq!(value.to_string().parse::<Fixed>(), Ok(value));
            let json = serde_json::to_string(&value).unwrap();
            prop_assert_eq!(serde_json::from_str::<Fixed>(&json).unwrap(), value);
        }

        #[test]
        fn small_fractions_are_json_numbers(raw in -(1i64 << 53)..(1i64 << 53)) {
            let json = serde_json::to_string(&Fixed::from_raw(raw)).unwrap();
            prop_assert!(!json.contains('"'));
        }
    }
}
