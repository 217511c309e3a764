//! Outputs are whole or absent: a file is written beside its final name, flushed to the disk, and renamed.

use crate::failure::{Exit, Failure};
use std::fs::File;
use std::io::{BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// A file of the command line, and what it is there: `-o`, `--stats`, `the scene`.
pub type Named<'p> = (&'p str, &'p Path);

/// Checks before the work begins what would otherwise be found at its end: that every output has a folder to lie in, and is
/// no folder, no pipe or device, none of `inputs` and no other output. An input that may be written over is left out of
/// `inputs`.
///
/// # Errors
/// The output, and the other file or the folder (usage).
pub fn check_outputs(outputs: &[Named<'_>], inputs: &[Named<'_>]) -> Result<(), Failure> {
    for (i, &(name, path)) in outputs.iter().enumerate() {
        let refuse = |what: String| Err(Failure::usage(format!("{name} {}: {what}", path.display())));
        let folder = folder(path);
        if !folder.is_dir() {
            let is = if folder.exists() { "is no folder" } else { "does not exist" };
            return refuse(format!("its folder {} {is}: make it, or check the path", folder.display()));
        }
        if path.is_dir() {
            return refuse("is a folder: name a file in it".to_owned());
        }
        if is_of_a_process(path) {
            let what =
                "is an open file of this process and no place for an output, which is renamed into place: name a file";
            return refuse(what.to_owned());
        }
        if std::fs::symlink_metadata(path).is_ok() && !path.is_file() {
            let what = if path.exists() { "is no regular file" } else { "is a link that leads nowhere" };
            return refuse(format!("{what}: name another file"));
        }
        let identity = identity(path);
        let is_same = |other: &&Named<'_>| self::identity(other.1) == identity;
        if let Some((other, there)) = outputs[..i].iter().chain(inputs).find(is_same) {
            return refuse(format!("is the same file as {other} {}: name another one", there.display()));
        }
    }
    Ok(())
}

/// Checks, as soon as it is known which files an input refers to, that no output is one of them.
///
/// # Errors
/// The output, and the input that refers to it (usage).
pub fn check_not_read(outputs: &[Named<'_>], files: &[PathBuf], input: &Path) -> Result<(), Failure> {
    let files: Vec<PathBuf> = files.iter().map(|file| identity(file)).collect();
    for &(name, path) in outputs {
        if files.contains(&identity(path)) {
            let what = format!("{name} {}: {} reads that file: name another one", path.display(), input.display());
            return Err(Failure::usage(what));
        }
    }
    Ok(())
}

/// Whether a path is `/dev/stdout` or another name for what a process has open: a rename would put a file there that whoever
/// reads the other end never sees.
fn is_of_a_process(path: &Path) -> bool {
    let mut path = path.to_owned();
    // As many links as Linux follows.
    for _ in 0..40 {
        let place = folder(&path).to_owned();
        if place.canonicalize().is_ok_and(|place| place.starts_with("/proc")) {
            return true;
        }
        match std::fs::read_link(&path) {
            Ok(next) => path = place.join(next),
            Err(_) => return false,
        }
    }
    false
}

/// What a path leads to, whatever leads there; of a file that is not there yet, by its folder.
fn identity(path: &Path) -> PathBuf {
    let of_folder = || Some(std::fs::canonicalize(folder(path)).ok()?.join(path.file_name()?));
    std::fs::canonicalize(path).ok().or_else(of_folder).unwrap_or_else(|| path.to_owned())
}

/// The folder in which a file lies.
fn folder(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

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
    let folder = folder(path);
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
    fn an_output_has_a_folder_and_is_no_input_and_no_other_output() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("in.glb"), "").expect("a file");
        let check = |outputs: &[&str], inputs: &[&str]| {
            let paths = |name, files: &[&str]| files.iter().map(|file| (name, at(file))).collect::<Vec<_>>();
            let (outputs, inputs) = (paths("-o", outputs), paths("the scene", inputs));
            let outputs: Vec<Named<'_>> = outputs.iter().map(|(name, path)| (*name, path.as_path())).collect();
            let inputs: Vec<Named<'_>> = inputs.iter().map(|(name, path)| (*name, path.as_path())).collect();
            check_outputs(&outputs, &inputs)
        };
        assert_eq!(check(&["a.png", "b.json"], &["in.glb"]), Ok(()));
        for (outputs, words) in [
            (&["a.png", "none/b.json"][..], ["none/b.json", "none does not exist"]),
            (&["in.glb/b.json"], ["in.glb/b.json", "in.glb is no folder"]),
            (&["."], ["-o", "is a folder"]),
            (&["in.glb"], ["-o", "the scene"]),
            (&["./in.glb"], ["-o", "the scene"]),
            (&["new.png", "./new.png"], ["./new.png", "same file as -o"]),
        ] {
            let failure = check(outputs, &["in.glb"]).expect_err("refused");
            assert_eq!(failure.exit, Exit::Usage);
            assert!(words.iter().all(|word| failure.line().contains(word)), "{failure}");
        }
        #[cfg(unix)]
        {
            let link = |to: &Path, name: &str| std::os::unix::fs::symlink(to, at(name)).expect("a link");
            link(&at("in.glb"), "link.png");
            assert!(check(&["link.png"], &["in.glb"]).is_err(), "what a link leads to would be replaced");
            link(&at("nowhere/out.png"), "dangling.png");
            let failure = check(&["dangling.png"], &[]).expect_err("the file could not be made");
            assert!(failure.line().contains("leads nowhere"), "{failure}");
            let _listener = std::os::unix::net::UnixListener::bind(at("socket.png")).expect("a socket");
            assert!(check(&["socket.png"], &[]).expect_err("a socket").line().contains("no regular file"));
        }
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn what_a_process_has_open_is_no_output() {
        for path in ["/dev/stdout", "/dev/fd/1", "/proc/self/fd/1", "/dev/null"] {
            let failure = check_outputs(&[("--stats", Path::new(path))], &[]).expect_err(path);
            assert_eq!(failure.exit, Exit::Usage);
            assert!(failure.line().contains(path), "{failure}");
        }
    }

    #[test]
    fn a_file_that_an_input_refers_to_is_no_output() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("a.bin"), "").expect("a file");
        let check = |output: &str| check_not_read(&[("--stats", &at(output))], &[at("a.bin")], Path::new("a.gltf"));
        assert_eq!(check("b.bin"), Ok(()));
        let failure = check("./a.bin").expect_err("refused");
        assert_eq!(failure.exit, Exit::Usage);
        assert!(["--stats", "a.bin", "a.gltf"].iter().all(|word| failure.line().contains(word)), "{failure}");
    }

    #[test]
    fn a_missing_folder_is_bad_input_that_names_the_file() {
        let failure = write_bytes(Path::new("/nonexistent/x.png"), b"").expect_err("no such folder");
        assert_eq!(failure.exit, Exit::BadInput);
        assert!(failure.line().starts_with("/nonexistent/x.png: cannot write the file"), "{failure}");
    }
}
