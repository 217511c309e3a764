//! The Cornell box, as measured by the Cornell University Program of Computer Graphics (1998), in metres.

use super::document::{Document, Node};
use super::shapes::Geometry;
use glam::Vec3;

/// Millimetres, as the data are published, to metres.
fn m(x: f32, y: f32, z: f32) -> Vec3 {
    Vec3::new(x, y, z) * 1e-3
}

/// Builds the scene. The walls' colours are the measured reflectances, integrated to linear Rec. 709; the light has the
/// customary colour for them, and fills the range of a display.
pub fn cornell() -> Document {
    let mut doc = Document::default();
    let white = doc.plain_material("white", [0.725, 0.71, 0.68], 0.0, 1.0);
    let red = doc.plain_material("red", [0.63, 0.065, 0.05], 0.0, 1.0);
    let green = doc.plain_material("green", [0.14, 0.45, 0.091], 0.0, 1.0);
    let lamp = doc.emissive_material("lamp", [1.0, 0.76, 0.37], 28.0);

    let walls: [(&str, u32, [Vec3; 4]); 5] = [
        ("floor", white, [m(552.8, 0., 0.), m(0., 0., 0.), m(0., 0., 559.2), m(549.6, 0., 559.2)]),
        ("ceiling", white, [m(556., 548.8, 559.2), m(0., 548.8, 559.2), m(0., 548.8, 0.), m(556., 548.8, 0.)]),
        ("back wall", white, [m(549.6, 0., 559.2), m(0., 0., 559.2), m(0., 548.8, 559.2), m(556., 548.8, 559.2)]),
        ("right wall", green, [m(0., 0., 559.2), m(0., 0., 0.), m(0., 548.8, 0.), m(0., 548.8, 559.2)]),
        ("left wall", red, [m(552.8, 0., 0.), m(549.6, 0., 559.2), m(556., 548.8, 559.2), m(556., 548.8, 0.)]),
    ];
    let room = doc.root(Node::named("room"));
    for (name, material, corners) in walls {
        let mut g = Geometry::default();
        g.quad(corners);
        let mesh = doc.mesh(name, &[(&g, material)]);
        doc.child(room, Node::mesh(mesh).called(name));
    }

    let short = block(165., [[130., 65.], [82., 225.], [240., 272.], [290., 114.]]);
    let tall = block(330., [[423., 247.], [265., 296.], [314., 456.], [472., 406.]]);
    for (name, geometry) in [("short block", short), ("tall block", tall)] {
        let mesh = doc.mesh(name, &[(&geometry, white)]);
        doc.root(Node::mesh(mesh).called(name));
    }

    // The real lamp hangs in a hole of the ceiling; here it is a millimetre below, so that the two do not coincide.
    let mut g = Geometry::default();
    g.quad([m(343., 547.8, 332.), m(213., 547.8, 332.), m(213., 547.8, 227.), m(343., 547.8, 227.)]);
    let mesh = doc.mesh("lamp", &[(&g, lamp)]);
    doc.root(Node::mesh(mesh).called("lamp"));

    // A lens of 35 mm before a film of 25 mm
    doc.look_at("camera", m(278., 273., -800.), m(278., 273., 0.), 2.0 * (12.5f32 / 35.0).atan().to_degrees());
    doc
}

/// A block with a quadrilateral base; `base` are its (x, z) corners, clockwise as seen from above with z up the page.
fn block(height: f32, base: [[f32; 2]; 4]) -> Geometry {
    let mut g = Geometry::default();
    let low = base.map(|[x, z]| m(x, 0., z));
    let high = base.map(|[x, z]| m(x, height, z));
    g.quad(high);
    for i in 0..4 {
        let j = (i + 1) % 4;
        g.quad([low[i], low[j], high[j], high[i]]);
    }
    g
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_blocks_are_seen_from_outside() {
        let g = block(165., [[130., 65.], [82., 225.], [240., 272.], [290., 114.]]);
        let centre = m(185., 82., 169.);
        for t in g.indices.as_chunks::<3>().0 {
            let [a, b, c] = t.map(|i| Vec3::from(g.positions[i as usize]));
            assert!((b - a).cross(c - a).dot((a + b + c) / 3.0 - centre) > 0.0);
        }
    }
}
