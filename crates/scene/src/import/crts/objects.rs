//! Objects: nodes in world space, all of them roots.

use super::images::{mark, orthant};
use super::lights::{self, QUAD_INDICES, QuadLight};
use super::meshes::Geometry;
use super::schema::{self, Header, ObjectKind};
use super::{Converter, Result, at, index, invalid, name, nth};
use crate::import::Place;
use crate::model::*;
use serde_json::json;
use std::collections::HashMap;

/// The key of what a camera's file says about its angle, under `orthant` in its `extras`: degrees. The angle of the camera is
/// right at [`DEFAULT_ASPECT`]; for others see [`Camera::vertical_fov`].
const FOV_Y: &str = "fov_y";

/// The aspect at which the angle in the file is the true one: that of the exporter's sensor, 36 by 24 mm.
pub const DEFAULT_ASPECT: f64 = 1.5;

/// How far the last row of a matrix may be from (0, 0, 0, 1).
const AFFINE_TOLERANCE: f64 = 1e-5;

/// The format has no near plane; this one is out of the way.
const NEAR: f64 = 0.001;

impl Converter<'_> {
    pub(super) fn objects(&mut self, header: &Header, geometries: &[Geometry]) -> Result<()> {
        let pairs = self.meshes(header, geometries)?;
        self.scene.nodes.reserve(header.objects.len());
        let mut roots = Vec::with_capacity(header.objects.len());
        for (i, object) in header.objects.iter().enumerate() {
            let matrix = matrix(object, i)?;
            let mut node =
                Node { name: name(&object.name), transform: Transform::Matrix(Box::new(matrix)), ..Node::default() };
            match object.kind {
                ObjectKind::Mesh => node.mesh = Some(pairs[i]),
                ObjectKind::Light => self.light(object, header, &matrix, &mut node, i)?,
                ObjectKind::Camera => node.camera = Some(self.camera(object, i)?),
            }
            roots.push(self.scene.nodes.insert_nth(i, node));
        }
        let scene = SceneRoots { roots: Children::from(roots), ..SceneRoots::default() };
        self.scene.default_scene = Some(self.scene.scenes.insert_nth(0, scene));
        Ok(())
    }

    /// The mesh of each object. Mesh number i is mesh number i of the file with the material of its first object; what
    /// other objects need follows.
    fn meshes(&mut self, header: &Header, geometries: &[Geometry]) -> Result<Vec<MeshId>> {
        let mut first: Vec<Option<MaterialId>> = vec![None; geometries.len()];
        let mut wanted = Vec::with_capacity(header.objects.len());
        for (i, object) in header.objects.iter().enumerate() {
            if object.kind != ObjectKind::Mesh {
                wanted.push(None);
                continue;
            }
            let mesh = required(object.mesh, "mesh", i)?;
            let mesh = index(mesh, "mesh", geometries.len(), || at("objects", i, "mesh"))?;
            let materials = header.materials.len();
            let material: MaterialId = nth(match object.material {
                // The default material has been put behind the others.
                None | Some(-1) => materials,
                Some(m) => index(m, "material", materials, || at("objects", i, "material"))?,
            });
            first[mesh].get_or_insert(material);
            wanted.push(Some((mesh, material)));
        }
        self.scene.meshes.reserve(geometries.len());
        let mut known = HashMap::new();
        for (i, geometry) in geometries.iter().enumerate() {
            let id = self.scene.meshes.insert_nth(i, geometry.mesh(first[i]));
            if let Some(material) = first[i] {
                known.insert((i, material), id);
            }
        }
        let meshes = &mut self.scene.meshes;
        let id = |pair: Option<(usize, MaterialId)>| match pair {
            // Nobody asks.
            None => nth(0),
            Some(pair) => *known.entry(pair).or_insert_with(|| meshes.insert(geometries[pair.0].mesh(Some(pair.1)))),
        };
        Ok(wanted.into_iter().map(id).collect())
    }

    fn light(
        &mut self,
        object: &schema::Object,
        header: &Header,
        matrix: &[f64; 16],
        node: &mut Node,
        i: usize,
    ) -> Result<()> {
        let light = QuadLight {
            color: required(object.color, "color", i)?,
            energy: required(object.energy, "energy", i)?,
            size: required(object.size, "size", i)?,
        };
        if light.size.iter().any(|&s| s < 0.0) {
            return invalid(at("objects", i, "size"), "the size of a light cannot be negative");
        }
        if light.color.iter().any(|&c| c * light.energy < 0.0) {
            self.tolerate("a light with less than no light is black", || at("objects", i, ""));
        }
        let Some((matrix, size)) = lights::frame(matrix, light.size, header.light_origin, header.light_emits) else {
            self.tolerate("the axes of the light span no area; it does not shine", || at("objects", i, "matrix"));
            node.extra = light.mark();
            return Ok(());
        };
        let light = QuadLight { size, ..light };
        node.transform = Transform::Matrix(Box::new(matrix));
        node.extra = light.mark();
        node.mesh = Some(self.quad(&light, || at("objects", i, ""))?);
        Ok(())
    }

    fn quad(&mut self, light: &QuadLight, place: impl Fn() -> Place) -> Result<MeshId> {
        let corners = light.corners();
        let start = self.make_room(size_of_val(&corners), &place)?;
        self.generated.bytes.extend(corners.as_flattened().iter().flat_map(|c| c.to_le_bytes()));
        let positions = self.generated_view(start);
        let start = self.make_room(size_of_val(&QUAD_INDICES), &place)?;
        self.generated.bytes.extend(QUAD_INDICES.iter().flat_map(|i| i.to_le_bytes()));
        let indices = self.generated_view(start);
        let mut positions = Accessor::packed(positions, ComponentType::F32, ElementType::Vec3, 4);
        if corners.as_flattened().iter().all(|c| c.is_finite()) {
            positions.min = Some(corners[0].map(f64::from).to_vec());
            positions.max = Some(corners[2].map(f64::from).to_vec());
        }
        let positions = self.scene.accessors.insert(positions);
        let indices = Accessor::packed(indices, ComponentType::U32, ElementType::Scalar, 6);
        let indices = self.scene.accessors.insert(indices);
        let primitive = Primitive {
            attributes: Attributes(vec![("POSITION".to_owned(), positions)]),
            indices: Some(indices),
            mode: PrimitiveMode::Triangles,
            targets: Vec::new(),
            material: Some(self.scene.materials.insert(light.material())),
            variants: Vec::new(),
            extra: Extra::default(),
        };
        Ok(self.scene.meshes.insert(Mesh { primitives: vec![primitive], ..Mesh::default() }))
    }

    fn camera(&mut self, object: &schema::Object, i: usize) -> Result<CameraId> {
        let fov_y = required(object.fov_y, "fov_y", i)?;
        if !(fov_y > 0.0 && fov_y < 180.0) {
            return invalid(
                at("objects", i, "fov_y"),
                format!("an angle of {fov_y} degrees must be between 0 and 180"),
            );
        }
        let projection = CameraProjection::Perspective {
            aspect_ratio: Some(DEFAULT_ASPECT),
            yfov: fov_y.to_radians(),
            znear: NEAR,
            zfar: None,
            extra: Extra::default(),
        };
        Ok(self.scene.cameras.insert(Camera { name: None, projection, extra: orthant(json!({ FOV_Y: fov_y })) }))
    }
}

/// The angle that a file gave for a camera, in degrees, unless the camera has been changed since.
pub fn written_fov_y(camera: &Camera) -> Option<f64> {
    let fov_y = mark(&camera.extra, FOV_Y)?.as_f64()?;
    match camera.projection {
        CameraProjection::Perspective { yfov, .. } if yfov == fov_y.to_radians() => Some(fov_y),
        _ => None,
    }
}

/// What the tangent of half the angle in the file has to be multiplied with for a picture of an aspect: the exporter
/// writes the angle of a sensor 24 mm high, but the sensor, 36 mm wide, is fitted to the larger side of the picture.
pub fn fit(aspect: f64) -> f64 {
    DEFAULT_ASPECT / aspect.max(1.0)
}

fn required<T>(value: Option<T>, key: &'static str, i: usize) -> Result<T> {
    match value {
        Some(value) => Ok(value),
        None => invalid(at("objects", i, ""), format!("the object has no {key}; export the scene again")),
    }
}

/// The matrix as the f32 that the format means.
fn matrix(object: &schema::Object, i: usize) -> Result<[f64; 16]> {
    let place = || at("objects", i, "matrix");
    let mut matrix = [0.0; 16];
    for (to, from) in matrix.iter_mut().zip(object.matrix) {
        match from.map(|value| f64::from(value as f32)).filter(|value| value.is_finite()) {
            Some(value) => *to = value,
            None => {
                return invalid(place(), "the matrix has a value that is not finite; repair the object's transform");
            }
        }
    }
    let last_row = [matrix[3], matrix[7], matrix[11], matrix[15] - 1.0];
    if last_row.iter().any(|v| v.abs() > AFFINE_TOLERANCE) {
        return invalid(place(), "the last row of the matrix must be 0, 0, 0, 1");
    }
    Ok(matrix)
}
