use super::*;
use crate::accessor::{read_f32, read_indices};
use crate::model::*;

#[test]
fn a_triangle_keeps_its_geometry_and_its_place() {
    let scene = load(&triangle());
    let (_, mesh) = scene.meshes().iter().next().unwrap();
    let primitive = &mesh.primitives[0];
    let position = primitive.attributes.get("POSITION").unwrap();
    assert_eq!(read_f32::<3>(&scene, position).unwrap(), [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    assert_eq!(read_indices(&scene, primitive.indices.unwrap()).unwrap(), [0, 1, 2]);
    assert_eq!(primitive.mode, PrimitiveMode::Triangles);
    let accessor = &scene.accessors()[position];
    assert_eq!((accessor.min.as_deref(), accessor.max.as_deref()), (Some(&[0.0; 3][..]), Some(&[1.0, 1.0, 0.0][..])));
    assert_eq!(scene.buffer_views().iter().map(|(_, v)| v.target).collect::<Vec<_>>(), [Some(34962), Some(34963)]);
    let roots = &scene.scenes()[scene.default_scene().unwrap()].roots;
    assert_eq!(roots.iter().collect::<Vec<_>>(), scene.nodes().ids().collect::<Vec<_>>());
}

#[test]
fn ids_are_in_the_order_of_the_file() {
    let nodes: Vec<Value> = (0..100).map(|i| json!({ "name": format!("n{i}") })).collect();
    let scene = load(&document(json!({ "nodes": nodes })));
    for (i, (id, node)) in scene.nodes().iter().enumerate() {
        assert_eq!(Store::<NodeId, Node>::slot(id), i);
        assert_eq!(node.name.as_deref(), Some(format!("n{i}").as_str()));
    }
}

#[test]
fn children_come_before_and_after_their_parents_in_the_file() {
    let scene = load(&document(json!({
        "nodes": [{ "name": "leaf" }, { "children": [2, 0] }, { "name": "other" }],
    })));
    let ids: Vec<NodeId> = scene.nodes().ids().collect();
    assert_eq!(scene.nodes()[ids[1]].children.iter().collect::<Vec<_>>(), [ids[2], ids[0]]);
    assert_eq!(scene.nodes()[ids[0]].parent, Some(ids[1]));
    assert_eq!(scene.nodes()[ids[1]].parent, None);
}

#[test]
fn a_matrix_is_kept_as_a_matrix_and_trs_as_trs() {
    let matrix: Vec<f64> = (0..16).map(|i| if i % 4 == 3 { f64::from(i / 15) } else { f64::from(i) }).collect();
    let scene = load(&document(json!({
        "nodes": [{ "matrix": matrix }, { "rotation": [0, 1, 0, 0], "scale": [2, 3, 4] }, {}],
    })));
    let transforms: Vec<Transform> = scene.nodes().iter().map(|(_, n)| n.transform.clone()).collect();
    assert_eq!(transforms[0], Transform::Matrix(matrix.try_into().unwrap()));
    let Transform::Trs { translation, rotation, scale } = transforms[1].clone() else { panic!() };
    assert_eq!((translation, rotation, scale), ([0.0; 3], [0.0, 1.0, 0.0, 0.0], [2.0, 3.0, 4.0]));
    assert_eq!(transforms[2], Transform::default());
}

#[test]
fn several_scenes_or_none_are_kept() {
    let two = document(json!({ "nodes": [{}, {}], "scenes": [{ "nodes": [0] }, { "nodes": [1, 0], "name": "b" }] }));
    let scene = load(&two);
    assert_eq!(scene.scenes().iter().map(|(_, s)| s.roots.len()).collect::<Vec<_>>(), [1, 2]);
    assert_eq!(scene.default_scene(), None);
    let none = load(&document(json!({ "nodes": [{}] })));
    assert!(none.scenes().is_empty());
    assert_eq!(none.nodes().len(), 1);
}

#[test]
fn sparse_and_view_less_accessors_read_as_declared() {
    let bytes = [floats(&[7.0]), vec![2]].concat();
    let scene = load(&document(json!({
        "buffers": [{ "byteLength": 5, "uri": data_uri(&bytes) }],
        "bufferViews": [{ "buffer": 0, "byteLength": 4 }, { "buffer": 0, "byteOffset": 4, "byteLength": 1 }],
        "accessors": [
            {
                "componentType": 5126, "count": 4, "type": "SCALAR",
                "sparse": {
                    "count": 1, "extras": 1,
                    "indices": { "bufferView": 1, "componentType": 5121, "extras": 2 },
                    "values": { "bufferView": 0, "extras": 3 },
                },
            },
            { "componentType": 5126, "count": 2, "type": "VEC2" },
        ],
    })));
    let ids: Vec<AccessorId> = scene.accessors().ids().collect();
    assert_eq!(read_f32::<1>(&scene, ids[0]).unwrap(), [[0.0], [0.0], [7.0], [0.0]]);
    assert_eq!(read_f32::<2>(&scene, ids[1]).unwrap(), [[0.0; 2]; 2]);
    let sparse = scene.accessors()[ids[0]].sparse.as_ref().unwrap();
    let extras = [&sparse.extra, &sparse.indices_extra, &sparse.values_extra].map(|e| e.extras.as_deref().cloned());
    assert_eq!(extras, [Some(json!(1)), Some(json!(2)), Some(json!(3))]);
}

#[test]
fn skins_morph_targets_and_animations_are_kept() {
    let mut bytes = floats(&[0.0; 9]);
    bytes.extend(floats(&[1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]));
    let scene = load(&document(json!({
        "buffers": [{ "byteLength": 100, "uri": data_uri(&bytes) }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }, { "buffer": 0, "byteOffset": 36, "byteLength": 64 }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" },
            { "bufferView": 1, "componentType": 5126, "count": 1, "type": "MAT4" },
            { "componentType": 5121, "count": 3, "type": "VEC4" },
            { "componentType": 5126, "count": 3, "type": "VEC4" },
            { "componentType": 5126, "count": 2, "type": "SCALAR" },
            { "componentType": 5126, "count": 6, "type": "VEC3" },
        ],
        "meshes": [{
            "weights": [0.25],
            "primitives": [{
                "attributes": { "POSITION": 0, "JOINTS_0": 2, "WEIGHTS_0": 3, "_FOO": 0 },
                "targets": [{ "POSITION": 0 }],
                "mode": 5,
            }],
        }],
        "skins": [{ "joints": [1], "inverseBindMatrices": 1, "skeleton": 1, "name": "skin" }],
        "nodes": [{ "mesh": 0, "skin": 0, "weights": [0.5] }, {}],
        "animations": [{
            "name": "walk",
            "samplers": [{ "input": 4, "output": 5, "interpolation": "CUBICSPLINE" }],
            "channels": [
                { "sampler": 0, "target": { "node": 1, "path": "scale" } },
                {
                    "sampler": 0,
                    "target": {
                        "path": "pointer",
                        "extensions": { "KHR_animation_pointer": { "pointer": "/nodes/0/scale" } },
                    },
                },
            ],
        }],
    })));
    let nodes: Vec<NodeId> = scene.nodes().ids().collect();
    let (_, mesh) = scene.meshes().iter().next().unwrap();
    assert_eq!((mesh.weights.as_slice(), mesh.primitives[0].targets.len()), (&[0.25][..], 1));
    assert_eq!(mesh.primitives[0].mode, PrimitiveMode::TriangleStrip);
    let names: Vec<&str> = mesh.primitives[0].attributes.0.iter().map(|(n, _)| n.as_str()).collect();
    assert_eq!(names, ["POSITION", "JOINTS_0", "WEIGHTS_0", "_FOO"]);
    let (_, skin) = scene.skins().iter().next().unwrap();
    assert_eq!((skin.joints.as_slice(), skin.skeleton), (&nodes[1..], Some(nodes[1])));
    assert_eq!(scene.nodes()[nodes[0]].weights.as_deref(), Some(&[0.5][..]));
    let (_, animation) = scene.animations().iter().next().unwrap();
    assert_eq!(animation.samplers[0].interpolation, Interpolation::CubicSpline);
    let channels: Vec<_> = animation.channels.iter().map(|c| (c.node, c.path)).collect();
    assert_eq!(channels, [(Some(nodes[1]), AnimationPath::Scale), (None, AnimationPath::Pointer)]);
    let kept = animation.channels[1].target_extra.extensions.as_ref().unwrap();
    assert_eq!(kept["KHR_animation_pointer"]["pointer"], "/nodes/0/scale");
}

#[test]
fn cameras_have_their_projection() {
    let scene = load(&document(json!({
        "cameras": [
            { "type": "perspective", "perspective": { "yfov": 0.5, "znear": 0.1, "extras": { "a": 1 } } },
            { "type": "orthographic", "orthographic": { "xmag": 2, "ymag": 3, "znear": 0, "zfar": 9 } },
        ],
        "nodes": [{ "camera": 1 }],
    })));
    let cameras: Vec<&Camera> = scene.cameras().iter().map(|(_, c)| c).collect();
    let extra = Extra { extras: Some(Box::new(json!({ "a": 1 }))), ..Extra::default() };
    let expected = CameraProjection::Perspective { aspect_ratio: None, yfov: 0.5, znear: 0.1, zfar: None, extra };
    assert_eq!(cameras[0].projection, expected);
    assert!(matches!(cameras[1].projection, CameraProjection::Orthographic { xmag: 2.0, ymag: 3.0, .. }));
    assert_eq!(scene.nodes().iter().next().unwrap().1.camera, scene.cameras().ids().nth(1));
}

#[test]
fn images_stay_encoded_wherever_they_come_from() {
    let png = b"\x89PNG\r\n\x1a\nrest";
    let scene = load(&document(json!({
        "buffers": [{ "byteLength": 12, "uri": data_uri(png) }],
        "bufferViews": [{ "buffer": 0, "byteLength": 12 }],
        "images": [
            { "bufferView": 0, "mimeType": "image/png" },
            { "uri": data_uri(png).replace("application/octet-stream", "image/png"), "name": "inline" },
        ],
        "samplers": [{ "magFilter": 9728, "minFilter": 9987, "wrapS": 33071, "wrapT": 33648 }],
        "textures": [{ "source": 1, "sampler": 0 }, {}],
    })));
    let images: Vec<&Image> = scene.images().iter().map(|(_, i)| i).collect();
    assert_eq!(images[0].source, ImageSource::View(scene.buffer_views().ids().next().unwrap()));
    assert_eq!(images[1].source, ImageSource::DataUri("image/png".to_owned()));
    assert!(images.iter().all(|i| i.data.as_deref() == Some(png)));
    let (_, texture) = scene.textures().iter().next().unwrap();
    assert_eq!(texture.source, scene.images().ids().nth(1));
    let sampler = &scene.samplers()[texture.sampler.unwrap()];
    assert_eq!(
        (sampler.mag_filter, sampler.min_filter),
        (Some(MagFilter::Nearest), Some(MinFilter::LinearMipmapLinear))
    );
    assert_eq!((sampler.wrap_s, sampler.wrap_t), (Some(WrapMode::ClampToEdge), Some(WrapMode::MirroredRepeat)));
}

#[test]
fn integers_may_be_written_as_decimals() {
    let text = triangle().to_string().replace("\"componentType\":5126", "\"componentType\":5.126e3");
    let text = text.replace("\"byteLength\":36", "\"byteLength\":36.0");
    import_slice(text, None, "a.gltf", &ImportOptions::default()).unwrap();
}

#[test]
fn extras_and_unknown_extensions_are_kept_everywhere() {
    let marked = json!({ "extras": { "x": [1, { "y": null }] }, "extensions": { "ZZZ_b": {}, "AAA_a": { "k": 1 } } });
    let mark = |mut object: Value| {
        merge(&mut object, marked.clone());
        object
    };
    let mut doc = triangle();
    for at in [
        "",
        "/asset",
        "/buffers/0",
        "/bufferViews/0",
        "/accessors/0",
        "/meshes/0",
        "/meshes/0/primitives/0",
        "/nodes/0",
        "/scenes/0",
    ] {
        let object = doc.pointer_mut(at).unwrap();
        *object = mark(object.take());
    }
    merge(
        &mut doc,
        json!({
            "images": [mark(json!({ "uri": "data:image/png;base64,iVBORw==" }))],
            "samplers": [mark(json!({}))],
            "textures": [mark(json!({ "source": 0 }))],
            "materials": [mark(json!({
                "pbrMetallicRoughness": mark(json!({ "baseColorTexture": mark(json!({ "index": 0 })) })),
            }))],
            "skins": [mark(json!({ "joints": [0] }))],
            "animations": [mark(json!({
                "samplers": [mark(json!({ "input": 0, "output": 0 }))],
                "channels": [mark(json!({ "sampler": 0, "target": mark(json!({ "path": "scale" })) }))],
            }))],
            "cameras": [mark(json!({ "type": "perspective", "perspective": mark(json!({ "yfov": 1, "znear": 1 })) }))],
        }),
    );
    let scene = load(&doc);
    let material = scene.materials().iter().next().unwrap().1;
    let animation = scene.animations().iter().next().unwrap().1;
    let camera = scene.cameras().iter().next().unwrap().1;
    let CameraProjection::Perspective { extra: perspective, .. } = &camera.projection else { panic!() };
    for extra in [
        &scene.extra,
        &scene.asset.extra,
        &scene.buffers().iter().next().unwrap().1.extra,
        &scene.buffer_views().iter().next().unwrap().1.extra,
        &scene.accessors().iter().next().unwrap().1.extra,
        &scene.meshes().iter().next().unwrap().1.extra,
        &scene.meshes().iter().next().unwrap().1.primitives[0].extra,
        &scene.nodes().iter().next().unwrap().1.extra,
        &scene.scenes().iter().next().unwrap().1.extra,
        &scene.images().iter().next().unwrap().1.extra,
        &scene.samplers().iter().next().unwrap().1.extra,
        &scene.textures().iter().next().unwrap().1.extra,
        &scene.skins().iter().next().unwrap().1.extra,
        &material.extra,
        &material.pbr_extra,
        &material.base_color_texture.as_ref().unwrap().extra,
        &animation.extra,
        &animation.samplers[0].extra,
        &animation.channels[0].extra,
        &animation.channels[0].target_extra,
        &camera.extra,
        perspective,
    ] {
        assert_eq!(extra.extras.as_deref(), Some(&marked["extras"]));
        let extensions = extra.extensions.as_deref().unwrap();
        assert_eq!(extensions.keys().collect::<Vec<_>>(), ["ZZZ_b", "AAA_a"]);
        assert_eq!(Value::Object(extensions.clone()), marked["extensions"]);
    }
}
