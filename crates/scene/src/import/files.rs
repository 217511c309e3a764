//! The files that a scene file refers to, and the rule that they lie in its own folder tree.

use super::budget::{Budget, OverBudget};
use std::fs::File;
use std::io::{self, Read};
use std::path::{Component, Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Why a file is not read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FileFault {
    /// It is not there.
    #[error("the file {0} does not exist")]
    Missing(String),
    /// It lies elsewhere.
    #[error("\"{0}\" is not inside the folder of the scene; allow it with --allow-external-files")]
    Outside(String),
    /// It is not a file of this machine.
    #[error("\"{0}\" is not a file of this machine, and nothing is fetched from a network; download it")]
    Remote(String),
    /// A name that cannot be one.
    #[error("\"{0}\" is not a valid file name")]
    Name(String),
    /// The scene came without a folder.
    #[error("\"{0}\" cannot be looked for, because the scene was not read from a folder")]
    NoFolder(String),
    /// A folder, a device, ...
    #[error("{0} is not a regular file")]
    NotAFile(String),
    /// It does not fit.
    #[error("{path}: {fault}")]
    OverBudget {
        /// The file.
        path: String,
        /// By how much.
        fault: OverBudget,
    },
    /// The system says no.
    #[error("{path} cannot be read: {error}")]
    Io {
        /// The file.
        path: String,
        /// Why.
        error: io::Error,
    },
}

/// Reads a whole file; its length is charged first. A file that grows meanwhile is cut at that length. `at_most` bytes are
/// read, if given.
pub(crate) fn read_file(path: &Path, at_most: Option<u64>, budget: &Budget) -> Result<Vec<u8>, FileFault> {
    let name = || path.display().to_string();
    let io = |error: io::Error| match error.kind() {
        io::ErrorKind::NotFound | io::ErrorKind::NotADirectory => FileFault::Missing(name()),
        _ => FileFault::Io { path: name(), error },
    };
    // Before it is opened: opening a pipe would wait for its writer.
    if !std::fs::metadata(path).map_err(io)?.is_file() {
        return Err(FileFault::NotAFile(name()));
    }
    let file = File::open(path).map_err(io)?;
    let length = file.metadata().map_err(io)?.len().min(at_most.unwrap_or(u64::MAX));
    budget.charge(length).map_err(|fault| FileFault::OverBudget { path: name(), fault })?;
    let length_here = usize::try_from(length).unwrap_or(usize::MAX);
    if length_here >= 2 * PART
        && let Some(bytes) = read_in_parts(&file, length_here)
    {
        return Ok(bytes);
    }
    let mut bytes = Vec::new();
    let out_of_memory = |_| io(io::ErrorKind::OutOfMemory.into());
    bytes.try_reserve_exact(length_here).map_err(out_of_memory)?;
    file.take(length).read_to_end(&mut bytes).map_err(io)?;
    Ok(bytes)
}

/// Bytes that one thread reads at a time. A long file is copied from the system's cache, and most of that time goes into
/// memory that is touched for the first time, which threads do side by side.
const PART: usize = 4 << 20;

/// Reads the first `length` bytes of a file by all threads. `None` where that does not succeed, for whatever reason.
#[cfg(unix)]
fn read_in_parts(file: &File, length: usize) -> Option<Vec<u8>> {
    use rayon::prelude::*;
    use std::os::unix::fs::FileExt;
    // Memory that there is not is an error, not an abort. Zeros come from the allocator as they are, unwritten.
    Vec::<u8>::new().try_reserve_exact(length).ok()?;
    let mut bytes = vec![0; length];
    let read = |(i, part): (usize, &mut [u8])| file.read_exact_at(part, (i * PART) as u64);
    bytes.par_chunks_mut(PART).enumerate().try_for_each(read).ok()?;
    Some(bytes)
}

/// Elsewhere a file has one position for all threads.
#[cfg(not(unix))]
fn read_in_parts(_: &File, _: usize) -> Option<Vec<u8>> {
    None
}

/// The files beside a scene file.
pub(crate) struct Files<'a> {
    folder: Option<PathBuf>,
    allow_external: bool,
    budget: &'a Budget,
    /// Those that were asked for and found. Images are read by several threads.
    found: Mutex<Vec<PathBuf>>,
}

impl<'a> Files<'a> {
    /// `folder` is the scene file's.
    pub fn new(folder: Option<&Path>, allow_external: bool, budget: &'a Budget) -> Self {
        // The folder of "scene.gltf" is "".
        let folder = folder.map(|f| if f.as_os_str().is_empty() { PathBuf::from(".") } else { f.to_owned() });
        Self { folder, allow_external, budget, found: Mutex::default() }
    }

    /// What files are charged to.
    pub fn budget(&self) -> &Budget {
        self.budget
    }

    /// Reads what a URI reference (RFC 3986) names: percent-encoding is undone first.
    pub fn read_uri(&self, uri: &str, at_most: Option<u64>) -> Result<Vec<u8>, FileFault> {
        self.refuse_scheme(uri)?;
        let decoded = percent_encoding::percent_decode_str(uri).decode_utf8();
        self.read(&decoded.map_err(|_| FileFault::Name(uri.to_owned()))?, at_most)
    }

    /// Reads a file by its path as the scene file has it: relative to the scene's folder, with `/` between names.
    pub fn read(&self, path: &str, at_most: Option<u64>) -> Result<Vec<u8>, FileFault> {
        let path = self.locate(path)?;
        let bytes = read_file(&path, at_most, self.budget)?;
        self.found.lock().unwrap_or_else(PoisonError::into_inner).push(path);
        Ok(bytes)
    }

    /// The files that have been read, sorted, each once.
    pub fn into_found(self) -> Vec<PathBuf> {
        let mut found = self.found.into_inner().unwrap_or_else(PoisonError::into_inner);
        found.sort_unstable();
        found.dedup();
        found
    }

    /// Where the file is. It exists and, unless external files are allowed, lies in the folder tree of the scene, symbolic
    /// links followed.
    fn locate(&self, path: &str) -> Result<PathBuf, FileFault> {
        let outside = || FileFault::Outside(path.to_owned());
        if path.is_empty() || path.contains('\0') {
            return Err(FileFault::Name(path.to_owned()));
        }
        // The decoded form again: "%68ttp:" is "http:".
        self.refuse_scheme(path)?;
        let plain = match scheme(path) {
            Some(s) if s.len() > 1 => {
                let after = &path[s.len() + 1..];
                after.strip_prefix("//").unwrap_or(after)
            }
            _ => path,
        };
        let Some(folder) = &self.folder else {
            return Err(FileFault::NoFolder(path.to_owned()));
        };
        let full = folder.join(plain);
        if self.allow_external {
            return Ok(full);
        }
        if plain.len() != path.len() || !is_inside(plain) {
            return Err(outside());
        }
        // What the names promise, the file system must keep.
        let missing = |_| FileFault::Missing(full.display().to_string());
        let real = full.canonicalize().map_err(missing)?;
        let root = folder.canonicalize().map_err(missing)?;
        if real.starts_with(root) { Ok(real) } else { Err(outside()) }
    }

    fn refuse_scheme(&self, uri: &str) -> Result<(), FileFault> {
        match scheme(uri) {
            // One letter is a drive, which `is_inside` judges.
            None => Ok(()),
            Some(s) if s.len() == 1 || s.eq_ignore_ascii_case("file") => Ok(()),
            Some(_) => Err(FileFault::Remote(shorten(uri))),
        }
    }
}

/// `http` of `http://...`; a letter before a colon may be a drive of Windows.
fn scheme(uri: &str) -> Option<&str> {
    let (scheme, _) = uri.split_once(':')?;
    let valid = scheme.starts_with(|c: char| c.is_ascii_alphabetic())
        && scheme.bytes().all(|c| c.is_ascii_alphanumeric() || b"+-.".contains(&c));
    valid.then_some(scheme)
}

/// Whether a relative path, by its names alone and on every system, stays below the folder where it begins.
fn is_inside(path: &str) -> bool {
    // On Windows `\` separates names and a colon follows a drive or precedes a stream; files with such names do not
    // travel, and are refused everywhere alike.
    if path.contains('\\') || path.as_bytes().get(1) == Some(&b':') {
        return false;
    }
    let mut depth = 0usize;
    for component in Path::new(path).components() {
        match component {
            Component::Normal(_) => depth += 1,
            Component::CurDir => {}
            Component::ParentDir => match depth.checked_sub(1) {
                Some(d) => depth = d,
                None => return false,
            },
            Component::RootDir | Component::Prefix(_) => return false,
        }
    }
    true
}

/// The path, relative to the document and with `/` between names, of a file that a URI reference names; `None` if that is
/// no file below the document's folder.
pub(crate) fn local_path(uri: &str) -> Option<String> {
    let path = percent_encoding::percent_decode_str(uri).decode_utf8().ok()?;
    let is_local = scheme(uri).is_none() && scheme(&path).is_none() && is_inside(&path);
    (is_local && !path.is_empty() && !path.contains('\0')).then(|| path.into_owned())
}

/// A URI for a message.
pub(crate) fn shorten(uri: &str) -> String {
    match uri.char_indices().nth(80) {
        Some((end, _)) => format!("{}...", &uri[..end]),
        None => uri.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tree() -> tempfile::TempDir {
        let dir = tempfile::tempdir().unwrap();
        let scene = dir.path().join("scene");
        std::fs::create_dir_all(scene.join("textures")).unwrap();
        std::fs::write(scene.join("textures/a b.png"), b"inside").unwrap();
        std::fs::write(scene.join("top.bin"), b"top").unwrap();
        std::fs::write(dir.path().join("secret"), b"outside").unwrap();
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(dir.path().join("secret"), scene.join("link")).unwrap();
            std::os::unix::fs::symlink(dir.path(), scene.join("up")).unwrap();
            std::os::unix::fs::symlink("textures/a b.png", scene.join("inner")).unwrap();
        }
        dir
    }

    fn read(dir: &Path, uri: &str, allow: bool) -> Result<Vec<u8>, FileFault> {
        let budget = Budget::new(1 << 20);
        Files::new(Some(&dir.join("scene")), allow, &budget).read_uri(uri, None)
    }

    #[test]
    fn files_of_the_folder_tree_are_read() {
        let dir = tree();
        for uri in
            ["textures/a b.png", "textures/a%20b.png", "./textures/./a%20b.png", "textures/../textures/a%20b.png"]
        {
            assert_eq!(read(dir.path(), uri, false).unwrap(), b"inside", "{uri}");
        }
        #[cfg(unix)]
        assert_eq!(read(dir.path(), "inner", false).unwrap(), b"inside");
    }

    #[test]
    fn whatever_leaves_the_folder_tree_is_refused() {
        let dir = tree();
        let absolute = dir.path().join("secret");
        let absolute = absolute.to_str().unwrap();
        let file_uri = format!("file://{absolute}");
        let mut uris = vec![
            "../secret",
            "%2e%2e/secret",
            "..%2Fsecret",
            "textures/../../secret",
            "..\\secret",
            "..%5csecret",
            "C:\\secret",
            "C:secret",
            "c%3A/secret",
            "\\\\host\\share\\secret",
            "//host/secret",
            "/etc/passwd",
            "file:///etc/passwd",
            "FILE:///etc/passwd",
            absolute,
            &file_uri,
        ];
        if cfg!(unix) {
            uris.extend(["link", "up/secret", "textures/../up/secret"]);
        }
        for uri in uris {
            let fault = read(dir.path(), uri, false).unwrap_err();
            assert!(matches!(fault, FileFault::Outside(_)), "{uri}: {fault}");
            assert!(fault.to_string().contains("--allow-external-files"), "{fault}");
        }
    }

    #[test]
    fn external_files_are_read_if_allowed() {
        let dir = tree();
        let absolute = dir.path().join("secret");
        for uri in ["../secret", "%2e%2e/secret", absolute.to_str().unwrap(), &format!("file://{}", absolute.display())]
        {
            assert_eq!(read(dir.path(), uri, true).unwrap(), b"outside", "{uri}");
        }
    }

    #[test]
    fn nothing_is_fetched_from_a_network() {
        let dir = tree();
        for uri in ["http://host/a.png", "https://host/a.png", "HTTP:a", "ftp://host/a", "%68ttp://host/a"] {
            for allow in [false, true] {
                let fault = read(dir.path(), uri, allow).unwrap_err();
                assert!(matches!(fault, FileFault::Remote(_)), "{uri}: {fault}");
            }
        }
    }

    #[test]
    fn what_is_no_file_is_an_error_of_its_own() {
        let dir = tree();
        assert!(matches!(read(dir.path(), "textures", false), Err(FileFault::NotAFile(_))));
        assert!(matches!(read(dir.path(), "absent.bin", false), Err(FileFault::Missing(_))));
        assert!(matches!(read(dir.path(), "top.bin/below", false), Err(FileFault::Missing(_))));
        assert!(matches!(read(dir.path(), "a%00b", false), Err(FileFault::Name(_))));
        assert!(matches!(read(dir.path(), "a%ff", false), Err(FileFault::Name(_))));
        assert!(matches!(read(dir.path(), "", false), Err(FileFault::Name(_))));
        let budget = Budget::new(1 << 20);
        assert!(matches!(Files::new(None, true, &budget).read("a", None), Err(FileFault::NoFolder(_))));
    }

    #[test]
    fn a_file_larger_than_the_budget_is_refused_before_it_is_read() {
        let dir = tree();
        let budget = Budget::new(2);
        let files = Files::new(Some(&dir.path().join("scene")), false, &budget);
        assert!(matches!(files.read("top.bin", None), Err(FileFault::OverBudget { .. })));
        assert_eq!(files.read("top.bin", Some(2)).unwrap(), b"to");
    }
}
