//! A reader of nodes as most are written: it knows the members of the core, strings without escapes, and numbers. Of
//! anything else, valid or not, it gives nothing, and the general parser reads the node again.

use crate::import::gltf::schema::{Int, Node};

/// A node, if it is plain.
pub fn node(text: &str) -> Option<Node<'_>> {
    let mut reader = Reader { text, at: 0 };
    let mut node = Node::default();
    let mut has_children = false;
    reader.members(|reader, key| match key {
        "name" => once(&mut node.name, reader.string()?.to_owned()),
        "children" => {
            if std::mem::replace(&mut has_children, true) {
                return None;
            }
            reader.list(|reader| {
                node.children.push(reader.index()?);
                Some(())
            })
        }
        "mesh" => once(&mut node.mesh, reader.index()?),
        "camera" => once(&mut node.camera, reader.index()?),
        "skin" => once(&mut node.skin, reader.index()?),
        "translation" => once(&mut node.translation, reader.numbers()?),
        "rotation" => once(&mut node.rotation, reader.numbers()?),
        "scale" => once(&mut node.scale, reader.numbers()?),
        "matrix" => once(&mut node.matrix, Box::new(reader.numbers()?)),
        _ => None,
    })?;
    reader.rest().is_empty().then_some(node)
}

/// A member may be there once.
fn once<T>(slot: &mut Option<T>, value: T) -> Option<()> {
    slot.replace(value).is_none().then_some(())
}

struct Reader<'a> {
    text: &'a str,
    at: usize,
}

impl<'a> Reader<'a> {
    fn rest(&self) -> &'a [u8] {
        &self.text.as_bytes()[self.at..]
    }

    fn peek(&self) -> Option<u8> {
        self.text.as_bytes().get(self.at).copied()
    }

    fn skip_space(&mut self) {
        while matches!(self.peek(), Some(b' ' | b'\t' | b'\n' | b'\r')) {
            self.at += 1;
        }
    }

    /// One byte of syntax, and the white space behind it.
    fn take(&mut self, byte: u8) -> Option<()> {
        if self.peek() != Some(byte) {
            return None;
        }
        self.at += 1;
        self.skip_space();
        Some(())
    }

    /// Whether a comma follows; else the closing bracket has to.
    fn goes_on(&mut self, close: u8) -> Option<bool> {
        self.skip_space();
        match self.peek()? {
            b',' => self.take(b',').map(|()| true),
            b if b == close => {
                self.at += 1;
                Some(false)
            }
            _ => None,
        }
    }

    /// An object. `value` reads that of the key, beginning at it and ending behind it.
    fn members(&mut self, mut value: impl FnMut(&mut Self, &str) -> Option<()>) -> Option<()> {
        self.take(b'{')?;
        if self.peek()? == b'}' {
            self.at += 1;
            return Some(());
        }
        loop {
            let key = self.string()?;
            self.skip_space();
            self.take(b':')?;
            value(self, key)?;
            if !self.goes_on(b'}')? {
                return Some(());
            }
        }
    }

    fn list(&mut self, mut element: impl FnMut(&mut Self) -> Option<()>) -> Option<()> {
        self.take(b'[')?;
        if self.peek()? == b']' {
            self.at += 1;
            return Some(());
        }
        loop {
            element(self)?;
            if !self.goes_on(b']')? {
                return Some(());
            }
        }
    }

    /// A string without escapes.
    fn string(&mut self) -> Option<&'a str> {
        if self.peek()? != b'"' {
            return None;
        }
        let start = self.at + 1;
        let length = self.text.as_bytes()[start..].iter().position(|&b| b == b'"' || b == b'\\' || b < b' ')?;
        let end = start + length;
        if self.text.as_bytes()[end] != b'"' {
            return None;
        }
        self.at = end + 1;
        Some(&self.text[start..end])
    }

    /// A non-negative integer without fraction or exponent.
    fn index(&mut self) -> Option<Int> {
        let start = self.at;
        let mut value = 0u64;
        while let Some(digit @ b'0'..=b'9') = self.peek() {
            value = value * 10 + u64::from(digit - b'0');
            self.at += 1;
            // What is longer is no index.
            if self.at - start > 18 {
                return None;
            }
        }
        let digits = self.at - start;
        let is_plain = digits > 0 && (digits == 1 || self.text.as_bytes()[start] != b'0');
        (is_plain && !matches!(self.peek(), Some(b'.' | b'e' | b'E'))).then_some(Int(value))
    }

    fn numbers<const N: usize>(&mut self) -> Option<[f64; N]> {
        let mut numbers = [0.0; N];
        let mut count = 0;
        self.list(|reader| {
            *numbers.get_mut(count)? = reader.number()?;
            count += 1;
            Some(())
        })?;
        (count == N).then_some(numbers)
    }

    /// The double that is nearest to what is written.
    fn number(&mut self) -> Option<f64> {
        /// Powers of ten that doubles hold exactly.
        const POWERS: [f64; 23] = [
            1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18,
            1e19, 1e20, 1e21, 1e22,
        ];
        let start = self.at;
        let is_negative = self.peek()? == b'-';
        self.at += usize::from(is_negative);
        // A mantissa that wraps has more than 18 digits, and is not used.
        let mut mantissa = 0u64;
        let integer = self.digits(&mut mantissa);
        if integer == 0 || (integer > 1 && self.text.as_bytes()[self.at - integer] == b'0') {
            return None;
        }
        let mut fraction = 0;
        if self.peek() == Some(b'.') {
            self.at += 1;
            fraction = self.digits(&mut mantissa);
            if fraction == 0 {
                return None;
            }
        }
        let has_exponent = matches!(self.peek(), Some(b'e' | b'E'));
        // Both operands are exact, so the quotient is rounded once (Clinger 1990, "How to Read Floating Point Numbers
        // Accurately").
        if !has_exponent && integer + fraction <= 18 && mantissa <= 1 << 53 {
            let value = mantissa as f64 / POWERS[fraction];
            return Some(if is_negative { -value } else { value });
        }
        if has_exponent {
            self.at += 1;
            if matches!(self.peek(), Some(b'+' | b'-')) {
                self.at += 1;
            }
            if self.digits(&mut mantissa) == 0 {
                return None;
            }
        }
        self.text[start..self.at].parse().ok().filter(|value: &f64| value.is_finite())
    }

    /// Appends digits to a number and gives how many there were.
    fn digits(&mut self, number: &mut u64) -> usize {
        let start = self.at;
        while let Some(digit @ b'0'..=b'9') = self.peek() {
            *number = number.wrapping_mul(10).wrapping_add(u64::from(digit - b'0'));
            self.at += 1;
        }
        self.at - start
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Both readers, as text: [`Node`] holds raw text, which does not compare.
    fn both(text: &str) -> (Option<String>, Option<String>) {
        let show = |node: Node<'_>| format!("{node:?}");
        (node(text).map(show), serde_json::from_str::<Node>(text).ok().map(show))
    }

    #[test]
    fn a_plain_node_is_read_as_the_general_parser_reads_it() {
        for text in [
            "{}",
            " { } ".trim(),
            r#"{"name":"ä b","children":[1,2, 30 ],"mesh":0,"camera":7,"skin":12}"#,
            r#"{ "translation" : [ 1 , -2.5 , 3e-2 ], "rotation":[0,0,0.38268343,-0.9238795],"scale":[1E+2,1.0,-0]}"#,
            r#"{"translation":[0.1234567890123456789,123456789012345678901234567890,9007199254740993]}"#,
            r#"{"translation":[5e-324,1.7976931348623157e308,2.2250738585072011e-308],"children":[]}"#,
            r#"{"matrix":[1,0,0,0, 0,1,0,0, 0,0,1,0, 1e3,-0.0,0.5,1]}"#,
        ] {
            let (plain, general) = both(text);
            assert!(plain.is_some(), "{text}");
            assert_eq!(plain, general, "{text}");
        }
    }

    #[test]
    fn what_is_not_plain_is_left_to_the_general_parser() {
        for text in [
            r#"{"name":"a\n"}"#,
            r#"{"extras":{}}"#,
            r#"{"extensions":{}}"#,
            r#"{"weights":[1]}"#,
            r#"{"unknown":1}"#,
            r#"{"mesh":1.0}"#,
            r#"{"name":null}"#,
        ] {
            let (plain, general) = both(text);
            assert!(plain.is_none() && general.is_some(), "{text}");
        }
    }

    #[test]
    fn nothing_is_read_that_the_general_parser_refuses() {
        for text in [
            "",
            "{",
            "{}}",
            "{,}",
            r#"{"mesh":1,}"#,
            r#"{"mesh":01}"#,
            r#"{"mesh":-1}"#,
            r#"{"mesh":1,"mesh":1}"#,
            r#"{"children":[1],"children":[]}"#,
            r#"{"children":[1,]}"#,
            r#"{"children":[1 2]}"#,
            "{\"name\":\"a\nb\"}",
            r#"{"name":"a}"#,
            r#"{"name" "a"}"#,
            r#"{"translation":[1,2]}"#,
            r#"{"translation":[1,2,3,4]}"#,
            r#"{"translation":[1,2,.5]}"#,
            r#"{"translation":[1,2,5.]}"#,
            r#"{"translation":[1,2,+5]}"#,
            r#"{"translation":[1,2,00]}"#,
            r#"{"translation":[1,2,1e]}"#,
            r#"{"translation":[1,2,1e999]}"#,
            r#"{"translation":[1,2,NaN]}"#,
            r#"{"translation":[1,2,--1]}"#,
        ] {
            let (plain, general) = both(text);
            assert!(plain.is_none() && general.is_none(), "{text}");
        }
    }

    #[test]
    fn doubles_are_the_nearest_ones() {
        let mut random = 7u64;
        for i in 0..20_000u32 {
            random = random.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            let value = f64::from_bits(random);
            let text = match i % 4 {
                _ if !value.is_finite() => continue,
                0 => format!("{value}"),
                1 => format!("{value:e}"),
                2 => format!("{}", f32::from_bits(random as u32 & 0xbfff_ffff)),
                _ => format!("{}.{}", (random >> 40) % 100_000, random % 10_000_000_000),
            };
            if let Some(number) = (Reader { text: &text, at: 0 }).number() {
                assert_eq!(number.to_bits(), text.parse::<f64>().unwrap().to_bits(), "{text}");
            } else {
                assert!(text.contains("NaN") || text.contains("inf"), "{text}");
            }
        }
    }
}
