//! Files are whole or absent: written beside the final name, flushed to the disk, and renamed.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Writes a file by `fill`. Until everything is on the disk, what was at `path` before stays.
pub fn write<T>(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<T>) -> io::Result<T> {
    // A link is written through, and nothing but a regular file is replaced.
    let path = match std::fs::symlink_metadata(path) {
        Ok(metadata) if metadata.is_symlink() => std::fs::canonicalize(path)?,
        _ => path.to_owned(),
    };
    if std::fs::metadata(&path).is_ok_and(|metadata| !metadata.is_file()) {
        let what = "what is there is no regular file, and is not replaced; name another file";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, what));
    }
    let folder = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
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
    temporary.persist(&path).map_err(|e| e.error)?;
    // Makes the rename itself durable. Some file systems cannot flush a folder; the file is complete all the same.
    if let Err(error) = File::open(folder).and_then(|handle| handle.sync_all()) {
        tracing::debug!("cannot flush {}: {error}", folder.display());
    }
    Ok(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_no_litter() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("w.orw");
        write(&path, |w| w.write_all(b"old")).unwrap();
        let failed: io::Result<()> = write(&path, |w| {
            w.write_all(b"half of the new one")?;
            Err(io::ErrorKind::StorageFull.into())
        });
        assert_eq!(failed.unwrap_err().kind(), io::ErrorKind::StorageFull);
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        assert!(write(folder.path(), |_| Ok(())).is_err());
    }
}
