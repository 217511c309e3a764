//! A sky as geometry: an emissive dome with a gradient, and the sun as an emissive disc, so that a scene brings its own
//! daylight.

use super::document::{Document, Node};
use super::shapes::{disc, inverted, sphere};
use super::textures::{mix, opaque, paint};
use glam::{Quat, Vec3};
use serde_json::json;

/// What the sky looks like. Colours are linear.
pub struct Sky {
    /// From the scene to the sun.
    pub sun_direction: Vec3,
    /// Colour of the sun, its largest channel 1.
    pub sun_colour: [f32; 3],
    /// Illuminance of the sun on a surface that faces it, in units of radiance times steradian.
    pub sun_illuminance: f32,
    /// sRGB colour at the zenith.
    pub zenith: [f32; 3],
    /// sRGB colour at the horizon, away from the sun.
    pub horizon: [f32; 3],
    /// sRGB colour at the horizon below the sun.
    pub glow: [f32; 3],
    /// Radiance of a white texel.
    pub strength: f32,
}

/// Adds a dome of the given radius about `centre`, and the sun inside it.
pub fn add(doc: &mut Document, sky: &Sky, centre: Vec3, radius: f32) {
    let sun = sky.sun_direction.normalize();
    // Texture coordinates of a sphere from `lathe`: u runs from +Z towards +X, v from the top.
    let texels = paint(256, 128, |u, v| {
        let (sin, cos) = (u * std::f32::consts::TAU).sin_cos();
        let elevation = (0.5 - v) * std::f32::consts::PI;
        let direction = Vec3::new(sin * elevation.cos(), elevation.sin(), cos * elevation.cos());
        let height = elevation.sin().max(0.0);
        let near_sun = direction.dot(sun).max(0.0).powf(6.0) * (1.0 - height * height);
        let low = mix(sky.horizon, sky.glow, near_sun);
        opaque(mix(low, sky.zenith, height.powf(0.45) * (1.0 - 0.5 * near_sun)))
    });
    let texture = doc.texture("sky", 256, 128, &texels, false);
    let material = doc.material(json!({
        "name": "sky",
        "pbrMetallicRoughness": { "baseColorFactor": [0.0, 0.0, 0.0, 1.0], "metallicFactor": 0.0 },
        "emissiveTexture": { "index": texture },
        "emissiveFactor": [1.0, 1.0, 1.0],
        "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": sky.strength } },
    }));
    let dome = doc.mesh("sky", &[(&inverted(sphere(1.0, 32, 16)), material)]);
    doc.root(Node::mesh(dome).called("sky").at(centre).scaled(Vec3::splat(radius)));

    // The disc is six times as wide as the sun of Earth: penumbras show, and the light is as strong as asked.
    let angular_radius = 1.6f32.to_radians();
    let solid_angle = std::f32::consts::PI * angular_radius.sin().powi(2);
    let material = doc.emissive_material("sun", sky.sun_colour, sky.sun_illuminance / solid_angle);
    let mesh = doc.mesh("sun", &[(&disc(1.0, 24), material)]);
    let distance = radius * 0.9;
    let node = Node::mesh(mesh)
        .called("sun")
        .at(centre + sun * distance)
        .turned(Quat::from_rotation_arc(Vec3::NEG_Z, -sun))
        .scaled(Vec3::splat(distance * angular_radius.tan()));
    doc.root(node);
}
