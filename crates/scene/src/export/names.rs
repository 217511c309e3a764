//! Names of the files beside a document, and the URIs that name them.

use crate::model::media_type;
use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, utf8_percent_encode};
use std::path::Path;

/// What RFC 3986 calls unreserved stays as it is, and so does the slash between names.
const ENCODED: &AsciiSet = &NON_ALPHANUMERIC.remove(b'-').remove(b'.').remove(b'_').remove(b'~').remove(b'/');

/// The URI reference of a file by its path relative to the document, with `/` between names.
pub fn uri(relative: &str) -> String {
    utf8_percent_encode(relative, ENCODED).to_string()
}

/// The stem of a document's name for the files beside it.
pub fn stem(document: &Path) -> String {
    let stem = document.file_stem().and_then(|stem| stem.to_str()).unwrap_or("scene");
    file_name(stem, "scene")
}

/// A text as (part of) a file name that every system takes.
pub fn file_name(text: &str, otherwise: &str) -> String {
    let is_bad = |c: char| c.is_control() || "/\\:*?\"<>|".contains(c);
    let name: String = text.chars().map(|c| if is_bad(c) { '_' } else { c }).take(100).collect();
    let name = name.trim().trim_matches('.');
    if name.is_empty() { otherwise.to_owned() } else { name.to_owned() }
}

/// `name-0123456789abcdef.ext`: by the content, so that it is never the name of anything else.
pub fn with_hash<'a>(relative: &str, pieces: impl IntoIterator<Item = &'a [u8]>) -> String {
    let mut hasher = blake3::Hasher::new();
    for piece in pieces {
        hasher.update(piece);
    }
    let hash = hasher.finalize().to_hex();
    let hash = &hash[..HASH_DIGITS];
    let (folder, name) = relative.rsplit_once('/').map_or(("", relative), |(folder, name)| (folder, name));
    let name = match name.rsplit_once('.').filter(|(stem, _)| !stem.is_empty()) {
        Some((stem, extension)) => format!("{stem}-{hash}.{extension}"),
        None => format!("{name}-{hash}"),
    };
    if folder.is_empty() { name } else { format!("{folder}/{name}") }
}

const HASH_DIGITS: usize = 16;

/// Whether a name is [`with_hash`] of `stem.extension`.
pub fn is_hashed(name: &str, stem: &str, extension: &str) -> bool {
    let hash =
        name.strip_prefix(stem).and_then(|rest| rest.strip_prefix('-')?.strip_suffix(extension)?.strip_suffix('.'));
    hash.is_some_and(|hash| hash.len() == HASH_DIGITS && hash.bytes().all(|b| b.is_ascii_hexdigit()))
}

/// The usual extension of an image file.
pub fn image_extension(data: &[u8]) -> &'static str {
    match media_type(data) {
        Some("image/png") => "png",
        Some("image/jpeg") => "jpg",
        Some("image/webp") => "webp",
        Some("image/ktx2") => "ktx2",
        Some("image/vnd-ms.dds") => "dds",
        Some("image/gif") => "gif",
        Some("image/bmp") => "bmp",
        _ => "img",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uris_are_percent_encoded_and_slashes_stay() {
        assert_eq!(uri("a b/ü#1%.png"), "a%20b/%C3%BC%231%25.png");
        assert_eq!(uri("plain-1_2~.bin"), "plain-1_2~.bin");
    }

    #[test]
    fn stems_are_names_that_every_system_takes() {
        assert_eq!(stem(Path::new("/x/my scene.gltf")), "my scene");
        assert_eq!(stem(Path::new("a:b\\c?.v2.gltf")), "a_b_c_.v2");
        assert_eq!(file_name("../../etc", "x"), "_.._etc");
        assert_eq!(file_name("..", "x"), "x");
        assert_eq!(file_name(" \n ", "x"), "_");
    }

    #[test]
    fn a_hashed_name_follows_from_the_content_alone() {
        let name = with_hash("t/a.b.png", [&b"ab"[..], b"c"]);
        assert_eq!(name, with_hash("t/a.b.png", [&b"abc"[..]]));
        assert_ne!(name, with_hash("t/a.b.png", [&b"abd"[..]]));
        assert!(name.starts_with("t/a.b-") && name.ends_with(".png"), "{name}");
        assert_eq!(with_hash("README", [&b""[..]]).len(), "README-".len() + HASH_DIGITS);
        assert!(is_hashed(&with_hash("s x.bin", [&b"1"[..]]), "s x", "bin"));
        for other in ["s x.bin", "s x-1.bin", "s x-0123456789abcdeg.bin", "s-0123456789abcdef.bin"] {
            assert!(!is_hashed(other, "s x", "bin"), "{other}");
        }
    }
}
