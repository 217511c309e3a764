//! What an import says that it takes is at least what it takes. Counted by an allocator of this test's own.

mod counting;

use counting::peak_of;
use orthant_scene::import::{ImportOptions, import_slice};
use std::sync::Mutex;

/// The counters are of the whole process: a test holds this from its first allocation to its last, or the documents that
/// the other builds are counted as its own.
static MEASURING: Mutex<()> = Mutex::new(());

/// Bytes that an import held at its peak, its input included, and bytes that it charged, whether or not it succeeded.
fn peak_and_charge(document: &str) -> (u64, u64) {
    let (peak, imported) = peak_of(|| {
        let bytes = document.as_bytes().to_vec();
        import_slice(bytes, None, "a.gltf", &ImportOptions::default()).unwrap()
    });
    (peak, imported.charged_bytes)
}

fn document(members: &str) -> String {
    format!("{{\"asset\":{{\"version\":\"2.0\"}},{members}}}")
}

fn list(item: &str, count: usize) -> String {
    vec![item; count].join(",")
}

#[test]
fn no_document_takes_more_than_it_is_charged_for() {
    const N: usize = 20_000;
    let _alone = MEASURING.lock().unwrap_or_else(|e| e.into_inner());
    let node_extension = r#"{"extensions":{"A":{"b":{}}},"extras":{}}"#;
    for (what, members) in [
        ("empty nodes", format!("\"nodes\":[{}]", list("{}", N))),
        // Long enough to be read apart from the rest.
        ("many empty nodes", format!("\"nodes\":[{}]", list("{}", 10 * N))),
        ("many nodes with extras", format!("\"nodes\":[{}]", list(node_extension, N))),
        ("many named nodes", format!("\"nodes\":[{}]", list(r#"{"name":"a name","scale":[1,2,3]}"#, N))),
        ("nodes with extras", format!("\"nodes\":[{}]", list(node_extension, N))),
        ("children", {
            let children: Vec<String> = (1..=N).map(|i| i.to_string()).collect();
            format!("\"nodes\":[{{\"children\":[{}]}},{}]", children.join(","), list("{}", N))
        }),
        ("empty materials", format!("\"materials\":[{}]", list("{}", N))),
        ("materials with a lobe", {
            let lobe = r#"{"extensions":{"KHR_materials_iridescence":{}}}"#;
            format!("\"materials\":[{}]", list(lobe, N))
        }),
        ("empty meshes", format!("\"meshes\":[{}]", list(r#"{"primitives":[]}"#, N))),
        ("primitives", format!("\"meshes\":[{{\"primitives\":[{}]}}]", list(r#"{"attributes":{}}"#, N))),
        ("targets", {
            format!("\"meshes\":[{{\"primitives\":[{{\"attributes\":{{}},\"targets\":[{}]}}]}}]", list("{}", N))
        }),
        ("scenes", format!("\"scenes\":[{}]", list("{}", N))),
        ("samplers", format!("\"samplers\":[{}]", list("{}", N))),
        ("textures", format!("\"textures\":[{}]", list("{}", N))),
        ("images", format!("\"images\":[{}]", list(r#"{"uri":"data:,"}"#, N))),
        ("strings", format!("\"extensionsUsed\":[{}]", list("\"\"", N))),
        ("arrays in extras", format!("\"extras\":[{}]", list("[]", N))),
        ("nested arrays in extras", format!("\"extras\":[{}]", list("[[[[[[]]]]]]", N))),
        ("objects in extras", format!("\"extras\":[{}]", list("{}", N))),
        ("members in extras", {
            let members: Vec<String> = (0..N).map(|i| format!("\"{i}\":0")).collect();
            format!("\"extras\":{{{}}}", members.join(","))
        }),
        ("small objects in extras", format!("\"extras\":[{}]", list(r#"{"a":{"b":0}}"#, N))),
        ("weights", format!("\"nodes\":[{{\"weights\":[{}]}}]", list("0", N))),
        ("a data URI", format!("\"images\":[{{\"uri\":\"data:image/png;base64,{}\"}}]", "AAAA".repeat(N))),
    ] {
        let (peak, charged) = peak_and_charge(&document(&members));
        println!("{what}: peak {peak}, charged {charged}");
        assert!(peak <= charged, "{what}: took {peak} bytes, charged {charged}");
    }
}

#[test]
fn geometry_is_held_once() {
    let _alone = MEASURING.lock().unwrap_or_else(|e| e.into_inner());
    // A GLB with a megabyte of geometry: its bytes stay where they were read.
    let size = 1 << 20;
    let json = document(&format!(
        "\"buffers\":[{{\"byteLength\":{size}}}],\"bufferViews\":[{{\"buffer\":0,\"byteLength\":{size}}}],\
         \"accessors\":[{{\"bufferView\":0,\"componentType\":5126,\"count\":{},\"type\":\"SCALAR\"}}]",
        size / 4
    ));
    let json = format!("{json:width$}", width = json.len().next_multiple_of(4));
    let mut glb = [b"glTF".as_slice(), &2u32.to_le_bytes()].concat();
    glb.extend(((28 + json.len() + size) as u32).to_le_bytes());
    glb.extend((json.len() as u32).to_le_bytes());
    glb.extend(b"JSON");
    glb.extend(json.as_bytes());
    glb.extend((size as u32).to_le_bytes());
    glb.extend(b"BIN\0");
    glb.resize(glb.len() + size, 0);

    let (grown, imported) = peak_of(|| import_slice(glb, None, "a.glb", &ImportOptions::default()).unwrap());
    assert_eq!(imported.scene.accessors().len(), 1);
    assert!(grown < size as u64 / 10, "the import took {grown} bytes besides the file");
}
