//! The JSON of glTF 2.0 as it is written, before any index is followed.
//!
//! Extensions and extras are kept as raw text, so that parsing a node costs no tree; who knows an extension parses its
//! text, and what nobody asked for becomes a [`serde_json::Value`] for export.

mod core;
mod de;
mod extensions;

pub use self::core::*;
pub use de::{Attributes, Extensions, Int, Rest, Text};
pub use extensions::*;
