//! Outputs are whole or absent: a file is written beside its final name, flushed to the disk, and renamed.

use crate::failure::{Exit, Failure};
use std::fs::File;
use std::io::{BufWriter, ErrorKind, Write};
use std::path::Path;

/// Writes a file by `fill`. Until everything is on the disk, what was at `path` before stays; on an error, or if the
/// program is killed, nothing of the new file is ever seen under that name.
///
/// # Errors
/// Whatever `fill` fails with, or an I/O error that names `path`.
pub fn write_atomically<T>(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<&mut File>) -> Result<T, Failure>,
) -> Result<T, Failure> {
    let target = match std::fs::symlink_metadata(path) {
        // What a link leads to is replaced, not the link.
        Ok(metadata) if metadata.is_symlink() => {
            std::fs::canonicalize(path).map_err(|e| Failure::io(path, "follow the link", &e))?
        }
        _ => path.to_owned(),
    };
    let path = target.as_path();
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    if path.is_dir() {
        return Err(Failure::bad_input(path, "is a folder").remedy("name a file"));
    }
    if path.exists() && !path.is_file() {
        return Err(Failure::bad_input(path, "is no regular file, and is not replaced").remedy("name another file"));
    }
    let doing = "write the file";
    let io = |e: &std::io::Error| Failure::io(path, doing, e);
    let mut builder = tempfile::Builder::new();
    builder.prefix(".orthant-").suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // Temporary files are private by default; an output is an ordinary file, and the umask applies to it.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let mut temporary = builder.tempfile_in(folder).map_err(|e| io(&e))?;
    let mut buffered = BufWriter::with_capacity(1 << 20, temporary.as_file_mut());
    let value = fill(&mut buffered)?;
    buffered.flush().map_err(|e| io(&e))?;
    drop(buffered);
    temporary.as_file().sync_all().map_err(|e| io(&e))?;
    temporary.persist(path).map_err(|e| io(&e.error))?;
    sync_folder(folder);
    Ok(value)
}

/// Makes the rename itself durable. Some file systems cannot flush a folder; the file is complete all the same.
fn sync_folder(folder: &Path) {
    if let Ok(handle) = File::open(folder)
        && let Err(error) = handle.sync_all()
    {
        tracing::debug!("cannot flush {}: {error}", folder.display());
    }
}

/// Writes bytes to a file, whole or not at all.
///
/// # Errors
/// An I/O error that names `path`.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    write_atomically(path, |w| w.write_all(bytes).map_err(|e| Failure::io(path, "write the file", &e)))
}

/// Prints a result on stdout. A reader that has gone away is no error.
///
/// # Errors
/// Any other failure to write.
pub fn print(text: &str) -> Result<(), Failure> {
    let mut stdout = std::io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => {
            Err(Failure::new(Exit::BadInput, format!("cannot write to stdout: {e}")))
        }
        _ => Ok(()),
    }
}

/// Prints one JSON document, indented, with a final newline.
///
/// # Errors
/// See [`print`].
pub fn print_json(value: &serde_json::Value) -> Result<(), Failure> {
    print(&format!("{value:#}\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_no_litter() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("out.png");
        write_bytes(&path, b"old").expect("first write");
        let failed: Result<(), _> = write_atomically(&path, |w| {
            w.write_all(b"half of the new one").expect("buffered");
            Err(Failure::usage("stop"))
        });
        assert_eq!(failed, Err(Failure::usage("stop")));
        assert_eq!(std::fs::read(&path).expect("still there"), b"old");
        assert_eq!(std::fs::read_dir(folder.path()).expect("folder").count(), 1);
        write_bytes(&path, b"new").expect("second write");
        assert_eq!(std::fs::read(&path).expect("replaced"), b"new");
    }

    #[cfg(unix)]
    #[test]
    fn links_are_followed_and_devices_are_left_alone() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let (file, link) = (folder.path().join("file"), folder.path().join("link"));
        write_bytes(&file, b"old").expect("first write");
        std::os::unix::fs::symlink(&file, &link).expect("a link");
        write_bytes(&link, b"new").expect("second write");
        assert!(std::fs::symlink_metadata(&link).expect("link").is_symlink());
        assert_eq!(std::fs::read(&file).expect("file"), b"new");
        let socket = folder.path().join("socket");
        let _listener = std::os::unix::net::UnixListener::bind(&socket).expect("a socket");
        let failure = write_bytes(&socket, b"x").expect_err("no regular file");
        assert_eq!(failure.exit, Exit::BadInput);
        assert!(!std::fs::symlink_metadata(&socket).expect("socket").is_file());
    }

    #[test]
    fn a_missing_folder_is_bad_input_that_names_the_file() {
        let failure = write_bytes(Path::new("/nonexistent/x.png"), b"").expect_err("no such folder");
        assert_eq!(failure.exit, Exit::BadInput);
        assert!(failure.line().starts_with("/nonexistent/x.png: cannot write the file"), "{failure}");
    }
}
