//! Outputs are whole or absent: a file is written beside its final name, flushed to the disk, and renamed.

use std::fs::File;
use std::io::{self, BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

/// The folder of a file.
pub fn folder(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// The file that is to be replaced: where a link leads, and nothing but a regular file.
fn target(path: &Path) -> io::Result<PathBuf> {
    let path = match std::fs::symlink_metadata(path) {
        Ok(metadata) if metadata.is_symlink() => std::fs::canonicalize(path)?,
        _ => path.to_owned(),
    };
    match std::fs::metadata(&path) {
        Ok(metadata) if !metadata.is_file() => {
            let what = "what is there is no regular file, and is not replaced; name another file";
            Err(io::Error::new(io::ErrorKind::InvalidInput, what))
        }
        _ => Ok(path),
    }
}

/// Writes a file by `fill`. Until everything is on the disk, what was at `path` before stays.
pub fn write<T, E: From<io::Error>>(path: &Path, fill: impl FnOnce(&mut dyn Write) -> Result<T, E>) -> Result<T, E> {
    let target = target(path)?;
    let path = target.as_path();
    let folder = folder(path);
    let mut builder = tempfile::Builder::new();
    builder.prefix(".orthant-").suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // Temporary files are private by default; an output is an ordinary file, and the umask applies to it.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let mut temporary = builder.tempfile_in(folder)?;
    let mut buffered = BufWriter::with_capacity(1 << 20, temporary.as_file_mut());
    let value = fill(&mut buffered)?;
    buffered.flush()?;
    drop(buffered);
    temporary.as_file().sync_all()?;
    temporary.persist(path).map_err(|e| e.error)?;
    // Makes the rename itself durable. Some file systems cannot flush a folder; the file is complete all the same.
    if let Ok(handle) = File::open(folder)
        && let Err(error) = handle.sync_all()
    {
        tracing::debug!("cannot flush {}: {error}", folder.display());
    }
    Ok(value)
}

/// Whether a regular file has exactly these bytes.
pub fn has_content<'a>(path: &Path, pieces: impl IntoIterator<Item = &'a [u8]> + Clone) -> io::Result<bool> {
    let length: u64 = pieces.clone().into_iter().map(|piece| piece.len() as u64).sum();
    let file = match std::fs::metadata(path) {
        Ok(metadata) if metadata.is_file() && metadata.len() == length => File::open(path)?,
        Ok(_) => return Ok(false),
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(false),
        Err(error) => return Err(error),
    };
    let mut reader = BufReader::new(file);
    let mut block = vec![0; 1 << 16];
    for piece in pieces {
        for part in piece.chunks(block.len()) {
            let block = &mut block[..part.len()];
            match reader.read_exact(block) {
                Ok(()) if block == part => {}
                Ok(()) => return Ok(false),
                // It was cut meanwhile.
                Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => return Ok(false),
                Err(error) => return Err(error),
            }
        }
    }
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_no_litter() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.gltf");
        write(&path, |w| w.write_all(b"old")).unwrap();
        let failed: io::Result<()> = write(&path, |w| {
            w.write_all(b"half of the new one")?;
            Err(io::ErrorKind::StorageFull.into())
        });
        assert_eq!(failed.unwrap_err().kind(), io::ErrorKind::StorageFull);
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn content_is_compared_across_pieces() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x");
        let same = |pieces: &[&[u8]]| has_content(&path, pieces.iter().copied()).unwrap();
        assert!(!same(&[b""]), "there is no file");
        write(&path, |w| w.write_all(b"abcdef")).unwrap();
        assert!(same(&[b"abc", b"", b"def"]));
        assert!(!same(&[b"abc", b"deg"]) && !same(&[b"abc", b"defg"]) && !same(&[b"abc"]));
        assert!(!has_content(folder.path(), [&b""[..]]).unwrap(), "a folder is no file");
    }
}
