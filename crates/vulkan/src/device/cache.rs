//! Compiled pipelines, kept in a file between runs: the first compilation of a path tracer takes seconds.
//!
//! A file is of one device. It begins with a magic word, the key (what the device, its driver and the shaders are) and a
//! checksum; one that is damaged or of another key is passed over and written anew. It is written beside its final name and
//! renamed. Whatever goes wrong with it, nothing fails: pipelines are compiled again.

use ash::vk;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// Where the file is.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum CacheFolder {
    /// Nowhere: everything is compiled anew.
    #[default]
    None,
    /// The user's folder for such things: `$XDG_CACHE_HOME/orthant`, `~/.cache/orthant`, `~/Library/Caches/orthant` or
    /// `%LOCALAPPDATA%\\orthant`; nowhere, if the system has none of them.
    User,
    /// A folder, which is made when it is needed.
    At(PathBuf),
}

/// First bytes of a file: what it is, and the version of its layout.
const MAGIC: [u8; 8] = *b"ORTPIPE1";
/// Bytes of a hash.
const HASH: usize = 32;
/// Where the driver's data begins.
const HEADER: usize = MAGIC.len() + 2 * HASH;
/// A file that is larger than this is none of ours.
const LARGEST: u64 = 256 << 20;
/// What the modules are compiled from and by: every module's hash is in it.
const SHADERS: &[u8] = include_bytes!("../../shaders/manifest.json");

impl CacheFolder {
    fn path(&self) -> Option<PathBuf> {
        match self {
            Self::None => None,
            Self::At(folder) => Some(folder.clone()),
            Self::User => user_folder(|name| std::env::var_os(name).map(PathBuf::from)),
        }
    }
}

/// The user's folder, by the variables that say where it is. The XDG specification has relative paths ignored.
fn user_folder(variable: impl Fn(&str) -> Option<PathBuf>) -> Option<PathBuf> {
    let absolute = |name: &str| variable(name).filter(|path| path.is_absolute());
    let xdg = absolute("XDG_CACHE_HOME");
    let home = || {
        if cfg!(windows) {
            absolute("LOCALAPPDATA")
        } else {
            absolute("HOME").map(|home| home.join(if cfg!(target_os = "macos") { "Library/Caches" } else { ".cache" }))
        }
    };
    xdg.or_else(home).map(|folder| folder.join("orthant"))
}

/// The cache of a device's pipelines, and the file that it came from.
pub(crate) struct PipelineCache {
    raw: vk::PipelineCache,
    file: Option<PathBuf>,
    key: [u8; HASH],
    /// Hash of the data as it lies in the file.
    kept: Mutex<Option<[u8; HASH]>>,
}

impl PipelineCache {
    /// With what the file of this device holds, if it is sound.
    pub fn open(device: &ash::Device, properties: &vk::PhysicalDeviceProperties, folder: &CacheFolder) -> Self {
        let mut key = blake3::Hasher::new();
        for number in [properties.vendor_id, properties.device_id, properties.driver_version, properties.api_version] {
            key.update(&number.to_le_bytes());
        }
        key.update(&properties.pipeline_cache_uuid).update(SHADERS);
        let key = *key.finalize().as_bytes();
        let name: String = properties.pipeline_cache_uuid.iter().map(|byte| format!("{byte:02x}")).collect();
        let file = folder.path().map(|folder| folder.join(format!("pipelines-{name}.bin")));
        let data = file.as_deref().and_then(|file| read(file, &key));
        let make = |data: &[u8]| {
            let info = vk::PipelineCacheCreateInfo::default().initial_data(data);
            // SAFETY: the device lives; the data are what its driver wrote, by their checksum and key.
            unsafe { device.create_pipeline_cache(&info, None) }
        };
        let (raw, kept) = match data.as_deref().map(|data| (make(data), data)) {
            Some((Ok(raw), data)) => (raw, Some(*blake3::hash(data).as_bytes())),
            // Without a cache at all pipelines are compiled as well.
            _ => (make(&[]).unwrap_or_default(), None),
        };
        tracing::debug!(?file, found = kept.is_some(), "pipelines of earlier runs");
        Self { raw, file, key, kept: Mutex::new(kept) }
    }

    /// The handle, for compilations; null if the driver refused to make one.
    pub fn raw(&self) -> vk::PipelineCache {
        self.raw
    }

    /// Writes the file anew where the cache has changed.
    pub fn keep(&self, device: &ash::Device) {
        let Some(file) = self.file.as_deref().filter(|_| self.raw != vk::PipelineCache::null()) else { return };
        // SAFETY: the cache is of this device.
        let Ok(data) = (unsafe { device.get_pipeline_cache_data(self.raw) }) else { return };
        let hash = *blake3::hash(&data).as_bytes();
        let mut kept = self.kept.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if *kept == Some(hash) || data.len() as u64 > LARGEST - HEADER as u64 {
            return;
        }
        match write(file, &self.key, &data) {
            Ok(()) => *kept = Some(hash),
            Err(error) => tracing::debug!(?file, %error, "pipelines cannot be kept"),
        }
    }

    /// Ends it with its device.
    pub fn destroy(&mut self, device: &ash::Device) {
        // SAFETY: the device ends after this, and nothing is compiled any more. A null handle is let pass.
        unsafe { device.destroy_pipeline_cache(std::mem::take(&mut self.raw), None) };
    }
}

/// The driver's data of a file, if the file is sound and of this key.
fn read(file: &Path, key: &[u8; HASH]) -> Option<Vec<u8>> {
    // Opening a pipe would wait for whoever writes to it.
    if !std::fs::metadata(file).ok()?.is_file() {
        return None;
    }
    let opened = std::fs::File::open(file).ok()?;
    let mut bytes = Vec::new();
    opened.take(LARGEST + 1).read_to_end(&mut bytes).ok()?;
    let (header, data) = bytes.split_at_checked(HEADER)?;
    let (magic, hashes) = header.split_at(MAGIC.len());
    let (of, checksum) = hashes.split_at(HASH);
    let is_sound = magic == MAGIC && of == key && checksum == blake3::hash(data).as_bytes();
    (is_sound && bytes.len() as u64 <= LARGEST).then(|| data.to_vec())
}

/// Writes a file as a whole: whoever reads it finds the old one or the new one.
fn write(file: &Path, key: &[u8; HASH], data: &[u8]) -> std::io::Result<()> {
    let folder = file.parent().unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder)?;
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    // Processes and devices of one process write at the same time.
    let number = std::sync::atomic::AtomicU32::fetch_add(&WRITTEN, 1, std::sync::atomic::Ordering::Relaxed);
    let part = folder.join(format!(".{name}.{}-{number}.part", std::process::id()));
    let bytes = [&MAGIC[..], key, blake3::hash(data).as_bytes(), data].concat();
    let written = std::fs::write(&part, bytes).and_then(|()| std::fs::rename(&part, file));
    if written.is_err() {
        let _absent = std::fs::remove_file(&part);
    }
    written
}

static WRITTEN: std::sync::atomic::AtomicU32 = std::sync::atomic::AtomicU32::new(0);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_damaged_cut_off_or_of_another_key_is_passed_over() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("made/when/needed/pipelines.bin");
        let (key, data) = ([7; HASH], b"compiled".to_vec());
        assert_eq!(read(&file, &key), None);
        write(&file, &key, &data).expect("it can be written");
        assert_eq!(read(&file, &key), Some(data.clone()));
        assert_eq!(read(&file, &[8; HASH]), None);
        let sound = std::fs::read(&file).expect("the file");
        for at in 0..sound.len() {
            let mut damaged = sound.clone();
            damaged[at] ^= 1;
            std::fs::write(&file, &damaged).expect("the file");
            assert_eq!(read(&file, &key), None, "byte {at}");
            std::fs::write(&file, &sound[..at]).expect("the file");
            assert_eq!(read(&file, &key), None, "cut off at {at}");
        }
        write(&file, &key, &data).expect("it is written anew");
        assert_eq!(read(&file, &key), Some(data));
        let left: Vec<_> = std::fs::read_dir(file.parent().expect("a folder")).expect("it is there").collect();
        assert_eq!(left.len(), 1, "{left:?}");
    }

    #[cfg(unix)]
    #[test]
    fn the_folder_is_where_xdg_says_or_in_the_home() {
        let of = |pairs: &[(&str, &str)]| {
            user_folder(|name| pairs.iter().find(|(key, _)| *key == name).map(|(_, path)| PathBuf::from(path)))
        };
        let home =
            if cfg!(target_os = "macos") { "/home/me/Library/Caches/orthant" } else { "/home/me/.cache/orthant" };
        assert_eq!(of(&[("XDG_CACHE_HOME", "/cache"), ("HOME", "/home/me")]), Some("/cache/orthant".into()));
        assert_eq!(of(&[("XDG_CACHE_HOME", "relative"), ("HOME", "/home/me")]), Some(home.into()));
        assert_eq!(of(&[("HOME", "")]), None);
    }
}
