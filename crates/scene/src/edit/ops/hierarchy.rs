//! Transforms, visibility, new nodes, and moves through the hierarchy.

use crate::edit::EditError;
use crate::edit::plan::{Plan, Result};
use crate::edit::step::{NodeField, Place, Step};
use crate::model::*;
use glam::{DAffine3, DMat3, DQuat, DVec4};

/// How far from right angles the axes of a transform may be, as the cosine, before it counts as sheared. Rounding of
/// matrices that were composed and inverted in f64 stays far below.
const SHEAR_TOLERANCE: f64 = 1e-6;

/// Checks a transform that comes from outside, and makes its rotation one.
pub fn checked(transform: Transform) -> Result<Transform> {
    match &transform {
        &Transform::Trs { translation, rotation, scale } => {
            for (key, values) in [("translation", &translation[..]), ("rotation", &rotation), ("scale", &scale)] {
                if !values.iter().all(|v| v.is_finite()) {
                    return Err(EditError::value(format!("/{key}"), "every number must be finite"));
                }
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
            if !m.iter().all(|v| v.is_finite()) {
                return Err(EditError::value("/matrix", "every number must be finite"));
            }
            let m = &**m;
            if [m[3], m[7], m[11], m[15]] != [0.0, 0.0, 0.0, 1.0] {
                return Err(EditError::value("/matrix", "the last row must be 0, 0, 0, 1 (matrices are column-major)"));
            }
            match decompose(&transform.to_affine()) {
                Some(_) => Ok(transform),
                None => Err(EditError::value("/matrix", "it shears, which glTF nodes cannot")),
            }
        }
    }
}

/// Translation, rotation and scale of an affine map, or `None` if it shears.
pub fn decompose(map: &DAffine3) -> Option<Transform> {
    let axes = [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis];
    let lengths = axes.map(|axis| axis.length());
    for (i, k) in [(0, 1), (0, 2), (1, 2)] {
        if axes[i].dot(axes[k]).abs() > SHEAR_TOLERANCE * lengths[i] * lengths[k] {
            return None;
        }
    }
    let mirrored = map.matrix3.determinant() < 0.0;
    let scale = [if mirrored { -lengths[0] } else { lengths[0] }, lengths[1], lengths[2]];
    // An axis of length zero has a direction that nothing shows: any that is square to the others will do.
    let mut unit = [0, 1, 2].map(|i| if lengths[i] > 0.0 { axes[i] / scale[i] } else { glam::DVec3::ZERO });
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
                [glam::DVec3::X, glam::DVec3::Y, glam::DVec3::Z][i]
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
    p.node(node)?;
    let mut transform = checked(transform)?;
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
    let transform = checked(transform)?;
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
    if keep_world {
        let world = p.world(node)?;
        let parent_world = parent.map_or(Ok(DAffine3::IDENTITY), |parent| p.world(parent))?;
        if parent_world.matrix3.determinant() == 0.0 {
            let what = "the new parent is scaled to nothing, so no place in the world can be kept below it";
            return Err(EditError::missing(node, what));
        }
        let local = parent_world.inverse() * world;
        let transform = decompose(&local).ok_or(EditError::Shear(node))?;
        p.set(node, NodeField::Transform(transform));
    }
    let new = match parent {
        Some(parent) => Place::Under(parent),
        None => p.root_place(),
    };
    for place in old {
        p.step(Step::Detach { node, place });
    }
    p.step(Step::Attach { node, place: new, index: index.unwrap_or(usize::MAX) });
    Ok(())
}
