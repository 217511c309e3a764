//! Transforms, visibility, new nodes, and moves through the hierarchy.

use super::skins;
use crate::edit::EditError;
use crate::edit::plan::{Plan, Result};
use crate::edit::step::{NodeField, Place, Step};
use crate::model::*;
use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3, DVec4};

/// How far from right angles the axes of a transform may be, as the cosine, before it counts as sheared. Rounding of
/// matrices that were composed and inverted in f64 stays far below.
const SHEAR_TOLERANCE: f64 = 1e-6;

/// Whether renderers, which take numbers of 32 bits, can use all of them.
fn representable(values: &[f64]) -> bool {
    values.iter().all(|&v| (v as f32).is_finite())
}

const TOO_LARGE: &str = "every number must be finite, and at most 3.4e38";

/// Checks a transform that comes from outside, and makes its rotation one. Of `now`, the transform before it, members
/// that stay what they are are not judged, and stay to the bit: a file may have what an edit may not set.
pub fn checked(transform: Transform, now: Option<&Transform>) -> Result<Transform> {
    if now == Some(&transform) {
        return Ok(transform);
    }
    match &transform {
        &Transform::Trs { translation, rotation, scale } => {
            let stays = match now {
                Some(Transform::Trs { translation: t, rotation: r, scale: s }) => {
                    [*t == translation, *r == rotation, *s == scale]
                }
                _ => [false; 3],
            };
            let members = [("translation", &translation[..]), ("rotation", &rotation), ("scale", &scale)];
            for (&(key, values), _) in members.iter().zip(stays).filter(|(_, stays)| !stays) {
                if !representable(values) {
                    return Err(EditError::value(format!("/{key}"), TOO_LARGE));
                }
            }
            if stays[1] {
                return Ok(transform);
            }
            let length = DVec4::from_array(rotation).length();
            let Some(unit) = DVec4::from_array(rotation).try_normalize() else {
                return Err(EditError::value("/rotation", "a quaternion of length 0 is no rotation"));
            };
            // What is one up to rounding stays what it is, to the bit.
            let rotation = if (length - 1.0).abs() < 1e-6 { rotation } else { unit.to_array() };
            Ok(Transform::Trs { translation, rotation, scale })
        }
        Transform::Matrix(m) => {
            if !representable(&m[..]) {
                return Err(EditError::value("/matrix", TOO_LARGE));
            }
            let m = &**m;
            if [m[3], m[7], m[11], m[15]] != [0.0, 0.0, 0.0, 1.0] {
                return Err(EditError::value("/matrix", "the last row must be 0, 0, 0, 1 (matrices are column-major)"));
            }
            let map = transform.to_affine();
            // A flat matrix has parts, but readers of the file take it for one that has none (the Khronos validator among
            // them: NODE_MATRIX_NON_TRS).
            let is_flat = !(map.matrix3.determinant() as f32).is_normal();
            match decompose(&map) {
                Some(parts) if is_flat => Ok(parts),
                Some(_) => Ok(transform),
                None => Err(EditError::value("/matrix", "it shears, which glTF nodes cannot")),
            }
        }
    }
}

/// The length of a vector, also where its square is no normal number.
fn length(v: DVec3) -> f64 {
    let squared = v.length_squared();
    let largest = v.abs().max_element();
    if squared.is_normal() || largest == 0.0 { squared.sqrt() } else { largest * (v / largest).length() }
}

/// A matrix whose columns have a largest component of 1, and these components. A column of zeros stays.
fn equalized(matrix: &DMat3) -> (DMat3, DVec3) {
    let factor = |axis: DVec3| if axis == DVec3::ZERO { 1.0 } else { axis.abs().max_element() };
    let factors = DVec3::new(factor(matrix.x_axis), factor(matrix.y_axis), factor(matrix.z_axis));
    let [x, y, z] = [matrix.x_axis / factors.x, matrix.y_axis / factors.y, matrix.z_axis / factors.z];
    (DMat3::from_cols(x, y, z), factors)
}

/// The determinant, or, where it is no normal number, one of the same sign.
fn determinant(matrix: &DMat3) -> f64 {
    let determinant = matrix.determinant();
    if determinant.is_normal() { determinant } else { equalized(matrix).0.determinant() }
}

/// The inverse of an affine map, or `None` if there is none. A determinant that underflows is no hindrance.
fn inverse(map: &DAffine3) -> Option<DAffine3> {
    if map.matrix3.determinant().is_normal() {
        return Some(map.inverse());
    }
    let (equal, factors) = equalized(&map.matrix3);
    if !equal.determinant().is_normal() {
        return None;
    }
    let rows = DMat3::from_diagonal(factors.recip()) * equal.inverse();
    Some(DAffine3 { matrix3: rows, translation: -(rows * map.translation) })
}

/// Translation, rotation and scale of an affine map, or `None` if it shears or is not finite.
pub fn decompose(map: &DAffine3) -> Option<Transform> {
    let axes = [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis];
    let lengths = axes.map(length);
    if !map.is_finite() || !lengths.iter().all(|length| length.is_finite()) {
        return None;
    }
    let mirrored = determinant(&map.matrix3) < 0.0;
    let scale = [if mirrored { -lengths[0] } else { lengths[0] }, lengths[1], lengths[2]];
    // An axis of length zero has a direction that nothing shows: any that is square to the others will do.
    let mut unit = [0, 1, 2].map(|i| if lengths[i] > 0.0 { axes[i] / scale[i] } else { DVec3::ZERO });
    for (i, k) in [(0, 1), (0, 2), (1, 2)] {
        if unit[i].dot(unit[k]).abs() > SHEAR_TOLERANCE {
            return None;
        }
    }
    for i in 0..3 {
        if lengths[i] == 0.0 {
            let (a, b) = (unit[(i + 1) % 3], unit[(i + 2) % 3]);
            let square = if a.length_squared() > 0.5 && b.length_squared() > 0.5 {
                a.cross(b)
            } else if a.length_squared() > 0.5 {
                a.any_orthonormal_vector()
            } else if b.length_squared() > 0.5 {
                b.any_orthonormal_vector()
            } else {
                [DVec3::X, DVec3::Y, DVec3::Z][i]
            };
            unit[i] = square;
        }
    }
    let rotation = DQuat::from_mat3(&DMat3::from_cols(unit[0], unit[1], unit[2])).normalize();
    Some(Transform::Trs { translation: map.translation.to_array(), rotation: rotation.to_array(), scale })
}

/// Whether an animation moves a node: then its transform may not be a matrix (glTF 2.0, section 3.5.3).
fn is_animated(p: &mut Plan<'_>, node: NodeId) -> bool {
    p.referrers(node).iter().any(|owner| matches!(owner, AnyId::Animation(_)))
}

pub fn set_transform(p: &mut Plan<'_>, node: NodeId, transform: Transform) -> Result<()> {
    let mut transform = checked(transform, Some(&p.node(node)?.transform))?;
    if matches!(transform, Transform::Matrix(_)) && is_animated(p, node) {
        transform = decompose(&transform.to_affine()).ok_or(EditError::Shear(node))?;
    }
    p.set(node, NodeField::Transform(transform));
    Ok(())
}

pub fn set_visible(p: &mut Plan<'_>, node: NodeId, visible: bool) -> Result<()> {
    p.node(node)?;
    p.set(node, NodeField::Visible(Some(visible)));
    Ok(())
}

pub fn add_node(p: &mut Plan<'_>, parent: Option<NodeId>, name: Option<String>, transform: Transform) -> Result<()> {
    let transform = checked(transform, Some(&Transform::default()))?;
    let node = p.add_node(Node { name, transform, ..Node::default() });
    p.made = Some(node.into());
    p.attach_last(node, parent)
}

pub fn reparent(
    p: &mut Plan<'_>,
    node: NodeId,
    parent: Option<NodeId>,
    index: Option<usize>,
    keep_world: bool,
) -> Result<()> {
    let old = p.places(node)?;
    let mut above = parent;
    while let Some(id) = above {
        if id == node {
            return Err(EditError::Cycle { node, parent: parent.unwrap_or(node) });
        }
        above = p.node(id)?.parent;
        p.visited += 1;
    }
    if keep_world && let Some(transform) = kept(p, node, parent)? {
        p.set(node, NodeField::Transform(transform));
    }
    let new = match parent {
        Some(parent) => Place::Under(parent),
        None => p.root_place(node),
    };
    skins::keep(p, node, &new)?;
    for place in old {
        p.step(Step::Detach { node, place });
    }
    p.step(Step::Attach { node, place: new, index: index.unwrap_or(usize::MAX) });
    Ok(())
}

/// The local transform that keeps a node where it is in the world, below another parent; `None` is the one it has. A matrix
/// stays one, and may shear if it did.
fn kept(p: &mut Plan<'_>, node: NodeId, parent: Option<NodeId>) -> Result<Option<Transform>> {
    let (now, old_parent) = p.node(node).map(|node| (node.transform.clone(), node.parent))?;
    let mut world = |id: Option<NodeId>| id.map_or(Ok(DAffine3::IDENTITY), |id| p.world(id));
    let (before, after) = (world(old_parent)?, world(parent)?);
    if before == after {
        return Ok(None);
    }
    let map = now.to_affine();
    if !after.is_finite() || !(before * map).is_finite() {
        return Err(EditError::missing(node, "its place in the world is too far or too large to be kept"));
    }
    let Some(from_world) = inverse(&after) else {
        let what = "the new parent is scaled to nothing, so no place in the world can be kept below it";
        return Err(EditError::missing(node, what));
    };
    let local = from_world * (before * map);
    if !local.to_cols_array().iter().all(|&v| (v as f32).is_finite()) {
        let what = "to keep its place in the world, its transform would need numbers over 3.4e38; move it without";
        return Err(EditError::missing(node, what));
    }
    let parts = decompose(&local);
    let was_sheared = || decompose(&map).is_none();
    let is_matrix = matches!(now, Transform::Matrix(_)) && !is_animated(p, node);
    if is_matrix && (parts.is_some() || was_sheared()) {
        return Ok(Some(Transform::Matrix(Box::new(DMat4::from(local).to_cols_array()))));
    }
    parts.map(Some).ok_or(EditError::Shear(node))
}
