//! From text to schema, with the place of a fault.

use crate::import::{ImportFault, Place};
use crate::json_words::plain;
use crate::place::{At, push_key};
use serde::Deserialize;
use serde_path_to_error::Segment;

/// Parses JSON. The path of a fault is found by a second, slower pass, which good files never need.
pub fn parse<'a, T: Deserialize<'a>>(text: &'a str, at: &At<'_>) -> Result<T, (Place, ImportFault)> {
    serde_json::from_str(text).map_err(|error| {
        if error.is_syntax() || error.is_eof() {
            // There is no path to what is not JSON.
            let place = match at {
                At::Root => Place::Line { line: error.line(), column: error.column() },
                _ => at.place(),
            };
            return (place, ImportFault::Json(format!("this is not valid JSON: {}", plain(&error.to_string()))));
        }
        let mut deserializer = serde_json::Deserializer::from_str(text);
        let mut pointer = at.pointer();
        if let Err(found) = serde_path_to_error::deserialize::<_, T>(&mut deserializer) {
            for segment in found.path() {
                match segment {
                    Segment::Seq { index } => push_key(&mut pointer, &index.to_string()),
                    Segment::Map { key } => push_key(&mut pointer, key),
                    Segment::Enum { .. } | Segment::Unknown => {}
                }
            }
        }
        (Place::Pointer(pointer), ImportFault::Json(plain(&error.to_string())))
    })
}
