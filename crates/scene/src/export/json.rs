//! Writing JSON text, without a tree in between: a scene of a million nodes is written as fast as it is read.

use serde_json::Value;
use std::io::Write;

/// A JSON text that grows.
#[derive(Default)]
pub struct Json {
    text: Vec<u8>,
    /// The member whose value is no number that JSON can write (NaN, infinity), if there was one.
    not_finite: Option<&'static str>,
}

impl Json {
    /// The text, or the name of the first member whose number is NaN or infinite.
    pub fn finish(self) -> Result<Vec<u8>, &'static str> {
        self.not_finite.map_or(Ok(self.text), Err)
    }

    /// Writes an object.
    pub fn object(&mut self, fill: impl FnOnce(&mut Object<'_>)) {
        self.text.push(b'{');
        fill(&mut Object { json: self, is_empty: true });
        self.text.push(b'}');
    }

    /// Writes a number, integers without a fraction, others with the fewest digits that give the same f64 again.
    pub fn number(&mut self, value: f64) {
        /// Up to here every integer is an f64 of its own.
        const EXACT: f64 = 9007199254740992.0;
        let is_integer = value.fract() == 0.0 && value.abs() <= EXACT && (value != 0.0 || value.is_sign_positive());
        if is_integer { self.serialize(&(value as i64)) } else { self.serialize(&value) }
    }

    /// Writes any value.
    pub fn serialize(&mut self, value: &(impl serde::Serialize + ?Sized)) {
        serde_json::to_writer(&mut self.text, value)
            .expect("plain values have a JSON form, and memory takes every byte");
    }

    fn byte(&mut self, byte: u8) {
        self.text.push(byte);
    }
}

/// The members of an object that is being written.
pub struct Object<'j> {
    json: &'j mut Json,
    is_empty: bool,
}

impl Object<'_> {
    fn key(&mut self, key: &str) -> &mut Json {
        if !std::mem::replace(&mut self.is_empty, false) {
            self.json.byte(b',');
        }
        self.json.serialize(key);
        self.json.byte(b':');
        self.json
    }

    /// A number.
    pub fn number(&mut self, key: &'static str, value: f64) {
        self.note_not_finite(key, &[value]);
        self.key(key).number(value);
    }

    /// A number, if there is one.
    pub fn optional_number(&mut self, key: &'static str, value: Option<f64>) {
        if let Some(value) = value {
            self.number(key, value);
        }
    }

    /// An array of numbers.
    pub fn numbers(&mut self, key: &'static str, values: &[f64]) {
        self.note_not_finite(key, values);
        self.array(key, values, |json, &value| json.number(value));
    }

    fn note_not_finite(&mut self, key: &'static str, values: &[f64]) {
        if values.iter().any(|value| !value.is_finite()) {
            self.json.not_finite.get_or_insert(key);
        }
    }

    /// An index, a count or a code.
    pub fn integer(&mut self, key: &str, value: u64) {
        self.key(key).serialize(&value);
    }

    /// A text.
    pub fn string(&mut self, key: &str, value: &str) {
        self.key(key).serialize(value);
    }

    /// A text, if there is one.
    pub fn optional_string(&mut self, key: &str, value: &Option<String>) {
        if let Some(value) = value {
            self.string(key, value);
        }
    }

    /// True or false.
    pub fn boolean(&mut self, key: &str, value: bool) {
        self.key(key).serialize(&value);
    }

    /// A value that is kept as JSON.
    pub fn value(&mut self, key: &str, value: &Value) {
        self.key(key).serialize(value);
    }

    /// Members of an object that is kept as JSON.
    pub fn values<'v>(&mut self, members: impl IntoIterator<Item = (&'v String, &'v Value)>) {
        for (key, value) in members {
            self.value(key, value);
        }
    }

    /// An object.
    pub fn object(&mut self, key: &str, fill: impl FnOnce(&mut Object<'_>)) {
        self.key(key).object(fill);
    }

    /// An array.
    pub fn array<T>(&mut self, key: &str, items: impl IntoIterator<Item = T>, mut write: impl FnMut(&mut Json, T)) {
        let json = self.key(key);
        json.byte(b'[');
        for (i, item) in items.into_iter().enumerate() {
            if i > 0 {
                json.byte(b',');
            }
            write(json, item);
        }
        json.byte(b']');
    }

    /// An array of objects, if there are any, each on a line of its own.
    pub fn lines<T>(
        &mut self,
        key: &str,
        items: impl IntoIterator<Item = T>,
        mut write: impl FnMut(&mut Object<'_>, T),
    ) {
        let mut items = items.into_iter().peekable();
        if items.peek().is_none() {
            return;
        }
        self.array(key, items, |json, item| {
            json.byte(b'\n');
            json.object(|o| write(o, item));
        });
    }

    /// An array of objects, if there are any.
    pub fn objects<T>(
        &mut self,
        key: &str,
        items: impl IntoIterator<Item = T>,
        mut write: impl FnMut(&mut Object<'_>, T),
    ) {
        let mut items = items.into_iter().peekable();
        if items.peek().is_some() {
            self.array(key, items, |json, item| json.object(|o| write(o, item)));
        }
    }

    /// A text that is a data URI of these bytes.
    pub fn data_uri(&mut self, key: &str, media_type: &str, data: &[u8]) {
        use base64::Engine;
        use base64::engine::general_purpose::STANDARD;
        let json = self.key(key);
        json.byte(b'"');
        // A media type comes from a URI, but that may have been a JSON string with escapes.
        let escaped = serde_json::to_string(media_type).expect("a string has a JSON form");
        let text = &mut json.text;
        write!(text, "data:{};base64,", &escaped[1..escaped.len() - 1]).expect("memory takes every byte");
        text.reserve(data.len().div_ceil(3) * 4);
        // Chunks of a multiple of 3 bytes are encoded as if they were one.
        let mut encoded = String::with_capacity(4 * 1024);
        for chunk in data.chunks(3 * 1024) {
            encoded.clear();
            STANDARD.encode_string(chunk, &mut encoded);
            text.extend_from_slice(encoded.as_bytes());
        }
        json.byte(b'"');
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(value: f64) -> String {
        let mut json = Json::default();
        json.number(value);
        String::from_utf8(json.finish().unwrap()).unwrap()
    }

    #[test]
    fn numbers_do_not_grow() {
        for text in ["0", "1", "-3", "0.1", "0.3333333432674408", "1e-7", "9007199254740992", "-0.0", "1.5e+300"] {
            assert_eq!(number(text.parse().unwrap()), text);
        }
        assert_eq!(number(1.0), "1");
        assert_eq!(number(1e20).parse::<f64>().unwrap(), 1e20);
    }

    #[test]
    fn a_number_that_json_cannot_write_is_named() {
        let mut json = Json::default();
        json.object(|o| {
            o.number("fine", 1.0);
            o.numbers("bad", &[0.0, f64::NAN]);
            o.number("worse", f64::INFINITY);
        });
        assert_eq!(json.finish(), Err("bad"));
    }

    #[test]
    fn what_is_written_is_json() {
        let mut json = Json::default();
        json.object(|o| {
            o.string("a\"b", "\u{1}\n");
            o.data_uri("uri", "text/x\"", &vec![7; 5000]);
            o.objects("none", [0; 0], |_, _| {});
            o.lines("some", [1, 2], |o, i| o.integer("i", i));
        });
        let value: Value = serde_json::from_slice(&json.finish().unwrap()).unwrap();
        assert_eq!(value["a\"b"], "\u{1}\n");
        assert_eq!(value["some"][1]["i"], 2);
        assert!(value.get("none").is_none());
        let budget = crate::import::budget::Budget::new(1 << 20);
        let (media_type, data) =
            crate::import::data_uri::decode(value["uri"].as_str().unwrap(), &budget).unwrap().unwrap();
        assert_eq!((media_type, data), ("text/x\"", vec![7; 5000]));
    }
}
