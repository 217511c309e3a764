//! Numbers as OBJ files have them: `1`, `-.5`, `+3`, `1.`, `1e5`.

/// Powers of ten that a double holds exactly.
const TENS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20,
    1e21, 1e22,
];

/// The number that a word is, to the nearest double; `None` if it is none. It may be infinite (`inf`, `1e999`) or NaN,
/// which callers refuse.
#[inline]
pub fn parse(word: &[u8]) -> Option<f64> {
    parse_short(word).or_else(|| parse_any(word))
}

/// Up to 19 digits whose value and power of ten are exact as doubles: then one operation rounds correctly (Clinger,
/// "How to Read Floating Point Numbers Accurately", 1990, fast path).
#[inline]
fn parse_short(word: &[u8]) -> Option<f64> {
    let (is_negative, digits) = match word {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        _ => (false, word),
    };
    if digits.is_empty() || digits.len() > 20 {
        return None;
    }
    let (mut mantissa, mut fraction, mut seen_point, mut count) = (0u64, 0usize, false, 0);
    for &byte in digits {
        match byte {
            b'0'..=b'9' => {
                mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(byte - b'0'));
                fraction += usize::from(seen_point);
                count += 1;
            }
            b'.' if !seen_point => seen_point = true,
            _ => return None,
        }
    }
    if count == 0 || count > 19 || mantissa > 1 << 53 {
        return None;
    }
    let value = mantissa as f64 / TENS[fraction];
    Some(if is_negative { -value } else { value })
}

#[cold]
fn parse_any(word: &[u8]) -> Option<f64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_way_to_write_a_number_is_read_as_the_standard_library_reads_it() {
        for text in [
            "0",
            "-0",
            "1",
            "+3",
            "-.5",
            "1.",
            "0.1",
            "123456.789012",
            "1e5",
            "1E-7",
            "-2.5e+03",
            "9007199254740993",
            "0.30000000000000004",
            "1234567890123456789",
            "0.0000000000000000001",
            "1e22",
            "3.402823e38",
        ] {
            assert_eq!(
                parse(text.as_bytes()).map(f64::to_bits),
                Some(text.parse::<f64>().unwrap().to_bits()),
                "{text}"
            );
        }
    }

    #[test]
    fn other_words_are_no_numbers() {
        for text in ["", "-", "+", ".", "1..2", "1.2.3", "x", "1x", "--1", "0x10", "1,5", "e5"] {
            assert_eq!(parse(text.as_bytes()), None, "{text}");
        }
        assert!(parse(b"nan").unwrap().is_nan() && parse(b"-inf").unwrap().is_infinite());
    }
}
