//! Punctual lights (KHR_lights_punctual), by node in hierarchy order.

use super::hierarchy::{DerivedNode, Hierarchy};
use glam::DVec3;
use orthant_resident::rows::{LightKind as Kind, LightRow};
use orthant_scene::animation::Posed;
use orthant_scene::model::{LightKind, Store};

/// One row for each visible node that carries a light which is not black. The nodes get their rows.
pub fn derive(posed: Posed<'_>, hierarchy: &mut Hierarchy, origin: DVec3) -> Vec<LightRow> {
    let mut rows = Vec::new();
    if posed.scene.lights().is_empty() {
        return rows;
    }
    for node in &mut hierarchy.nodes {
        if let Some(row) = row(posed, node, origin) {
            node.light = rows.len() as u32;
            rows.push(row);
        }
    }
    rows
}

/// The light of a node; `None` if it is hidden, has none, or a black one.
pub(super) fn row(posed: Posed<'_>, node: &DerivedNode, origin: DVec3) -> Option<LightRow> {
    let light = posed.scene.nodes()[node.node].light.filter(|_| node.visible).map(|id| posed.light(id))?;
    if light.intensity <= 0.0 || light.color.iter().all(|&c| c <= 0.0) {
        return None;
    }
    let (kind, angle_scale, angle_offset) = match light.kind {
        LightKind::Directional => (Kind::Directional, 0.0, 1.0),
        LightKind::Point => (Kind::Point, 0.0, 1.0),
        LightKind::Spot { inner_cone_angle, outer_cone_angle } => {
            // KHR_lights_punctual, "Inner and Outer Cone Angles".
            let scale = 1.0 / (inner_cone_angle.cos() - outer_cone_angle.cos()).max(0.001);
            (Kind::Spot, scale, -outer_cone_angle.cos() * scale)
        }
    };
    // Lights are placed by position and direction; a node's scale does not touch their intensity.
    let direction = node.world.transform_vector3(DVec3::NEG_Z).normalize_or(DVec3::NEG_Z);
    Some(LightRow {
        position: (node.world.translation - origin).as_vec3().to_array(),
        kind: kind as u32,
        direction: direction.as_vec3().to_array(),
        range: light.range.map_or(f32::INFINITY, |r| r as f32),
        color: light.color.map(|c| (c.max(0.0) * light.intensity) as f32),
        angle_scale: angle_scale as f32,
        angle_offset: angle_offset as f32,
        node: Store::<_, ()>::slot(node.node) as u32,
        reserved: [0; 2],
    })
}
