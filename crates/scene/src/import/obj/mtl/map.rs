//! Texture statements: options, and a file name that may hold spaces; names of `mtllib`.

use crate::import::obj::number;
use crate::import::obj::text::{is_blank, name, trim, word};

/// A texture and how it lies on the surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// With `/` between names.
    pub file: String,
    /// `-clamp on`.
    pub clamp: bool,
    /// `-o u v`.
    pub offset: [f64; 2],
    /// `-s u v`.
    pub scale: [f64; 2],
    /// `-bm`.
    pub multiplier: f64,
}

/// How many words an option takes at most; those of one to three must be numbers.
const OPTIONS: &[(&[u8], usize)] = &[
    (b"-blendu", 1),
    (b"-blendv", 1),
    (b"-boost", 1),
    (b"-bm", 1),
    (b"-cc", 1),
    (b"-clamp", 1),
    (b"-colorspace", 1),
    (b"-imfchan", 1),
    (b"-mm", 2),
    (b"-o", 3),
    (b"-s", 3),
    (b"-t", 3),
    (b"-texres", 1),
    (b"-type", 1),
];

fn option(token: &[u8]) -> Option<(&'static [u8], usize)> {
    OPTIONS.iter().find(|(name, _)| token.eq_ignore_ascii_case(name)).copied()
}

impl Map {
    /// Reads the statement's line into `out`.
    pub fn set(out: &mut Option<Self>, statement: &str, line: &[u8], warn: &mut impl FnMut(String)) {
        let mut map = Self { file: String::new(), clamp: false, offset: [0.0; 2], scale: [1.0; 2], multiplier: 1.0 };
        let mut rest = map.options(statement, trim(line), warn);
        // Some exporters write options after the name: it ends where one begins.
        let (mut end, mut position) = (rest.len(), 0);
        while let Some((token, after)) = word(&rest[position..]) {
            let start = rest.len() - after.len() - token.len();
            if start > 0 && option(token).is_some() {
                end = start;
                break;
            }
            position = rest.len() - after.len();
        }
        let trailing = &rest[end..];
        rest = &rest[..end];
        map.options(statement, trailing, warn);
        map.file = file_name(rest);
        if map.file.is_empty() {
            return warn(format!("{statement} names no file; it is ignored"));
        }
        *out = Some(map);
    }

    /// Reads options from the front and returns what follows them.
    fn options<'l>(&mut self, statement: &str, line: &'l [u8], warn: &mut impl FnMut(String)) -> &'l [u8] {
        let mut rest = trim(line);
        while let Some((token, after)) = word(rest)
            && let Some((name_of_option, most)) = option(token)
        {
            let mut values = [None; 3];
            let mut first_word: &[u8] = &[];
            rest = after;
            for i in 0..most {
                let Some((value, after)) = word(rest) else { break };
                let parsed = number::parse(value).filter(|v| v.is_finite());
                if i > 0 && parsed.is_none() {
                    break;
                }
                if i == 0 {
                    first_word = value;
                }
                values[i] = parsed;
                rest = after;
            }
            self.apply(statement, name_of_option, first_word, values, warn);
        }
        trim(rest)
    }

    fn apply(
        &mut self,
        statement: &str,
        option: &[u8],
        word: &[u8],
        values: [Option<f64>; 3],
        warn: &mut impl FnMut(String),
    ) {
        let pair = |default: f64| [values[0].unwrap_or(default), values[1].unwrap_or(default)];
        match option {
            b"-clamp" => self.clamp = word.eq_ignore_ascii_case(b"on"),
            b"-o" => self.offset = pair(0.0),
            b"-s" => self.scale = pair(1.0),
            b"-bm" => self.multiplier = values[0].unwrap_or(1.0),
            b"-t" | b"-mm" | b"-cc" => {
                let option = name(option);
                warn(format!("the option {option} of {statement} has no effect"));
            }
            b"-type" if !word.eq_ignore_ascii_case(b"sphere") || statement != "refl" => {
                warn(format!("the option -type of {statement} has no effect: the texture lies on the surface"));
            }
            // How a texture is filtered and where its values come from follows from its use.
            _ => {}
        }
    }
}

/// A file name as a line has it: quotes are taken off, `\ ` is a space, other backslashes separate folders.
pub fn file_name(text: &[u8]) -> String {
    let mut text = trim(text);
    if let [b'"', inner @ .., b'"'] = text {
        text = inner;
    }
    let mut plain = Vec::with_capacity(text.len());
    let mut bytes = text.iter().copied().peekable();
    while let Some(byte) = bytes.next() {
        plain.push(match byte {
            b'\\' if bytes.peek().is_some_and(|&next| is_blank(next)) => bytes.next().unwrap_or(b' '),
            b'\\' => b'/',
            other => other,
        });
    }
    name(&plain)
}

/// The names of a line that names several files: words, where quotes and `\ ` hold words together.
pub fn file_names(text: &[u8]) -> Vec<String> {
    let mut names = Vec::new();
    let mut rest = trim(text);
    while !rest.is_empty() {
        let end = if rest[0] == b'"'
            && let Some(length) = rest[1..].iter().position(|&b| b == b'"')
        {
            length + 2
        } else {
            let ends = |i: &usize| is_blank(rest[*i]) && (*i == 0 || rest[*i - 1] != b'\\');
            (0..rest.len()).find(ends).unwrap_or(rest.len())
        };
        names.push(file_name(&rest[..end]));
        rest = trim(&rest[end..]);
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(line: &str) -> (Map, Vec<String>) {
        let (mut out, mut warnings) = (None, Vec::new());
        Map::set(&mut out, "map_Kd", line.as_bytes(), &mut |w| warnings.push(w));
        (out.unwrap(), warnings)
    }

    #[test]
    fn options_before_and_after_a_name_with_spaces_are_read() {
        let (m, warnings) = map("-s 2 3 -o 0.5 0.25 0 -clamp on -blendu off -texres 512 my wood texture.png -bm 1.5");
        assert_eq!((m.file.as_str(), m.clamp, m.multiplier), ("my wood texture.png", true, 1.5));
        assert_eq!((m.offset, m.scale), ([0.5, 0.25], [2.0, 3.0]));
        assert!(warnings.is_empty(), "{warnings:?}");
        let (m, warnings) = map("-imfchan r -mm 0 1 -t 1 2 3 -type cube_top a.png");
        assert_eq!(m.file, "a.png");
        assert_eq!(warnings.len(), 3);
        assert_eq!(map("-o 0.1 diffuse-s.png").0.file, "diffuse-s.png");
        assert_eq!(map("-s 1 1 1 2.png").0.file, "2.png");
    }

    #[test]
    fn names_may_be_quoted_and_have_backslashes() {
        assert_eq!(map(r"textures\wood 1\a.png").0.file, "textures/wood 1/a.png");
        assert_eq!(map(r#"-bm 2 "a b.png""#).0.file, "a b.png");
        assert_eq!(map(r"a\ b.png").0.file, "a b.png");
        assert_eq!(file_names(br#"a.mtl  b\ c.mtl "d e.mtl" x\f.mtl"#), ["a.mtl", "b c.mtl", "d e.mtl", "x/f.mtl"]);
    }

    #[test]
    fn a_map_without_a_name_is_none() {
        for line in ["", "   ", "-s 1 1 1", "-clamp"] {
            let (mut out, mut warned) = (None, false);
            Map::set(&mut out, "map_Kd", line.as_bytes(), &mut |_| warned = true);
            assert!(out.is_none() && warned, "{line:?}");
        }
    }
}
