//! From layers to one colour.

use super::super::combine::LayerSum;
use glam::Vec3;
use orthant_resident::world::Combine;

fn combined(combine: Combine, layers: &[(Vec3, Option<f32>)]) -> Vec3 {
    let mut sum = LayerSum::new(combine);
    layers.iter().for_each(|&(radiance, weight)| sum.add(radiance, weight));
    sum.color()
}

#[test]
fn the_mean_of_one_layer_is_itself() {
    let color = Vec3::new(0.1, 0.7, 3.3);
    assert_eq!(combined(Combine::Mean, &[(color, None)]), color);
    assert_eq!(combined(Combine::Mean, &[(color, Some(0.0)), (Vec3::ZERO, None)]), color / 2.0);
}

#[test]
fn hits_and_sky_are_mixed_by_the_logarithm_of_the_share_of_weight() {
    let (red, green, sky) = (Vec3::X, Vec3::Y, Vec3::Z);
    let layers = [(red, Some(3.0)), (green, Some(1.0)), (sky, None), (sky, None)];
    let p = 4.0_f32 / 6.0;
    let share = (1.0 + 8.0 * p).ln() / 9.0_f32.ln();
    let color = combined(Combine::Integral { mix: 8.0 }, &layers);
    assert!(color.distance(Vec3::new(0.75 * share, 0.25 * share, 1.0 - share)) < 1e-6, "{color}");
    let linear = combined(Combine::Integral { mix: 0.0 }, &layers);
    assert!(linear.distance(Vec3::new(0.75 * p, 0.25 * p, 1.0 - p)) < 1e-6, "{linear}");
}

#[test]
fn hits_alone_sky_alone_and_hits_without_weight() {
    let mode = Combine::Integral { mix: 8.0 };
    assert!(combined(mode, &[(Vec3::X, Some(2.0)), (Vec3::Y, Some(2.0))]).distance(Vec3::new(0.5, 0.5, 0.0)) < 1e-6);
    assert_eq!(combined(mode, &[(Vec3::Z, None), (Vec3::Z, None)]), Vec3::Z);
    assert_eq!(combined(mode, &[(Vec3::X, Some(0.0)), (Vec3::Z, None)]), Vec3::Z);
    assert_eq!(combined(mode, &[(Vec3::X, Some(0.0))]), Vec3::ZERO);
}
