//! `seed ASSETS CORPUS`: fills the corpus of each target from a folder of scenes. Only small files: a fuzzer's progress is
//! measured in inputs a second.

use orthant_scene::export::{ExportOptions, crts, gltf};
use orthant_scene::import::{ImportOptions, import_path};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::{env, fs, io};

const MOST_BYTES: usize = 64 << 10;

fn main() -> io::Result<()> {
    let arguments: Vec<PathBuf> = env::args_os().skip(1).map(PathBuf::from).collect();
    let [assets, corpus] = &arguments[..] else {
        return Err(io::Error::other("usage: seed ASSETS CORPUS"));
    };
    for target in ["gltf", "obj", "crts", "images", "compressed"] {
        fs::create_dir_all(corpus.join(target))?;
    }
    let mut folders = vec![assets.clone()];
    let mut seeds = Seeds { corpus: corpus.clone(), count: 0 };
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder)? {
            let path = entry?.path();
            if path.is_dir() { folders.push(path) } else { seeds.file(&path)? }
        }
    }
    println!("{} seeds", seeds.count);
    Ok(())
}

struct Seeds {
    corpus: PathBuf,
    count: usize,
}

impl Seeds {
    fn put(&mut self, target: &str, bytes: &[u8]) -> io::Result<()> {
        if bytes.len() > MOST_BYTES {
            return Ok(());
        }
        self.count += 1;
        fs::write(self.corpus.join(target).join(format!("seed-{}", self.count)), bytes)
    }

    fn file(&mut self, path: &Path) -> io::Result<()> {
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        match extension.as_str() {
            "gltf" | "glb" => {
                self.put("gltf", &fs::read(path)?)?;
                self.scene(path)?;
                self.compressed_views(path)
            }
            "obj" => self.put("obj", &fs::read(path)?),
            "png" => self.image(0, path),
            "jpg" | "jpeg" => self.image(1, path),
            "webp" => self.image(2, path),
            "ktx2" => self.image(3, path),
            "dds" => self.image(4, path),
            _ => Ok(()),
        }
    }

    fn image(&mut self, kind: u8, path: &Path) -> io::Result<()> {
        self.put("images", &[&[kind], &fs::read(path)?[..]].concat())
    }

    /// A scene as one file: targets have no folder.
    fn scene(&mut self, path: &Path) -> io::Result<()> {
        if fs::metadata(path)?.len() > 1 << 20 {
            return Ok(());
        }
        let Ok(imported) = import_path(path, &ImportOptions::default()) else { return Ok(()) };
        let mut embedded = ExportOptions::default();
        embedded.images = orthant_scene::export::Images::Embed;
        if let Ok(files) = gltf::to_glb(&imported.scene, &embedded) {
            self.put("gltf", &files.document)?;
        }
        let mut file = Vec::new();
        if crts::write(&imported.scene, &mut file).is_ok() {
            self.put("crts", &file)?;
            self.put("crts", &file[8..])?;
        }
        Ok(())
    }

    /// The compressed parts of a document's buffers.
    fn compressed_views(&mut self, path: &Path) -> io::Result<()> {
        let bytes = fs::read(path)?;
        let (json, bin) = match bytes.strip_prefix(b"glTF") {
            Some(rest) if rest.len() > 16 => {
                let length = u32::from_le_bytes([rest[8], rest[9], rest[10], rest[11]]) as usize;
                (rest.get(16..16 + length), rest.get(24 + length..))
            }
            _ => (Some(&bytes[..]), None),
        };
        let Some(document) = json.and_then(|json| serde_json::from_slice::<Value>(json).ok()) else { return Ok(()) };
        let slice = |view: &Value| -> Option<Vec<u8>> {
            let number = |key: &str| view.get(key).and_then(Value::as_u64).unwrap_or(0) as usize;
            let span = number("byteOffset")..number("byteOffset") + number("byteLength");
            match document["buffers"][number("buffer")]["uri"].as_str() {
                None => bin?.get(span).map(<[u8]>::to_vec),
                Some(uri) => fs::read(path.with_file_name(uri)).ok()?.get(span).map(<[u8]>::to_vec),
            }
        };
        let array = |value: &Value| value.as_array().cloned().unwrap_or_default();
        for primitive in array(&document["meshes"]).iter().flat_map(|mesh| array(&mesh["primitives"])) {
            let view = &primitive["extensions"]["KHR_draco_mesh_compression"]["bufferView"];
            if let Some(data) = view.as_u64().and_then(|view| slice(&document["bufferViews"][view as usize])) {
                self.put("compressed", &[&[0; 4], &data[..]].concat())?;
            }
        }
        for view in array(&document["bufferViews"]) {
            let extensions = &view["extensions"];
            let compressed = [&extensions["EXT_meshopt_compression"], &extensions["KHR_meshopt_compression"]];
            for view in compressed.into_iter().filter(|view| view.is_object()) {
                let position = |names: &[&str], key: &str| names.iter().position(|&name| view[key] == name).unwrap_or(0);
                let mode = position(&["ATTRIBUTES", "TRIANGLES", "INDICES"], "mode");
                let filter = position(&["NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"], "filter");
                let count = view["count"].as_u64().unwrap_or(0).div_ceil(3).min(255);
                let stride = view["byteStride"].as_u64().unwrap_or(0).min(255);
                if let Some(data) = slice(view) {
                    let head = [mode as u8 * 2 + 1, count as u8, stride as u8, filter as u8];
                    self.put("compressed", &[&head, &data[..]].concat())?;
                }
            }
        }
        Ok(())
    }
}
