//! What the working tree may hold.

use std::path::Path;

/// Committed assets stay small: scenes come from `orthant generate`.
const MAX_ASSET_BYTES: u64 = 5_000_000;

/// Visits every file below a folder.
fn walk(folder: &Path, visit: &mut dyn FnMut(&Path, u64)) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let path = entry.path();
        match entry.metadata() {
            Ok(m) if m.is_dir() => walk(&path, visit),
            Ok(m) => visit(&path, m.len()),
            Err(_) => {}
        }
    }
}

/// The folder `assets` is within its limit.
pub fn check_asset_size() -> Vec<String> {
    let mut total = 0;
    walk(&crate::root().join("assets"), &mut |_, len| total += len);
    if total > MAX_ASSET_BYTES {
        return vec![format!("assets/ holds {total} bytes, over the limit of {MAX_ASSET_BYTES}")];
    }
    Vec::new()
}

/// Every file that allows `unsafe` gives its reason in the attribute.
pub fn check_unsafe_files() -> Vec<String> {
    let mut problems = Vec::new();
    for folder in ["crates", "xtask"] {
        walk(&crate::root().join(folder), &mut |path, _| {
            if path.extension().is_none_or(|e| e != "rs") {
                return;
            }
            let text = std::fs::read_to_string(path).unwrap_or_default();
            let code = || text.lines().filter(|l| !l.trim_start().starts_with("//"));
            let keyword = concat!("unsafe", " {");
            let uses = code().any(|l| l.contains(keyword));
            let allows = text.contains(concat!("allow(", "unsafe_code, reason"));
            let above = path.with_file_name("mod.rs");
            let allowed_above =
                std::fs::read_to_string(above).is_ok_and(|t| t.contains(concat!("allow(", "unsafe_code, reason")));
            if uses && !allows && !allowed_above {
                problems.push(format!("{} uses unsafe without allowing it with a reason", path.display()));
            }
        });
    }
    problems
}

#[cfg(test)]
mod tests {
    #[test]
    fn committed_assets_stay_small() {
        assert_eq!(super::check_asset_size(), Vec::<String>::new());
    }

    #[test]
    fn files_with_unsafe_say_why() {
        assert_eq!(super::check_unsafe_files(), Vec::<String>::new());
    }
}
