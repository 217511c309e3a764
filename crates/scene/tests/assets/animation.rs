//! Every animation of the assets plays, and its values are those of key frames that the crate `gltf` decodes, interpolated
//! by another implementation of glTF 2.0, appendix C.

use crate::corpus::*;
use glam::{DQuat, DVec3, DVec4};
use gltf::animation::Interpolation;
use gltf::animation::util::ReadOutputs;
use orthant_scene::animation::{Evaluator, Pose, Posed, Property, Target, Value};
use orthant_scene::model::NodeId;
use std::path::Path;

/// Keys as the peer reads them: times, and for each key as many rows as the interpolation has (1 or 3).
struct Keys {
    times: Vec<f64>,
    rows: Vec<Vec<f64>>,
    interpolation: Interpolation,
    is_rotation: bool,
}

impl Keys {
    fn read(channel: &gltf::animation::Channel<'_>, buffers: &[gltf::buffer::Data]) -> Self {
        let reader = channel.reader(|buffer| Some(&buffers[buffer.index()]));
        let times: Vec<f64> = reader.read_inputs().unwrap().map(f64::from).collect();
        let wide = |row: &[f32]| row.iter().map(|&v| f64::from(v)).collect::<Vec<f64>>();
        let interpolation = channel.sampler().interpolation();
        let parts = if interpolation == Interpolation::CubicSpline { 3 } else { 1 };
        let mut is_rotation = false;
        let rows = match reader.read_outputs().unwrap() {
            ReadOutputs::Translations(rows) => rows.map(|row| wide(&row)).collect(),
            ReadOutputs::Scales(rows) => rows.map(|row| wide(&row)).collect(),
            ReadOutputs::Rotations(rows) => {
                is_rotation = true;
                rows.into_f32().map(|row| wide(&row)).collect()
            }
            ReadOutputs::MorphTargetWeights(all) => {
                let all: Vec<f32> = all.into_f32().collect();
                all.chunks_exact(all.len() / (times.len() * parts)).map(wide).collect()
            }
        };
        Self { times, rows, interpolation, is_rotation }
    }

    fn at(&self, seconds: f64) -> Vec<f64> {
        let cubic = self.interpolation == Interpolation::CubicSpline;
        let row = |key: usize, part: usize| if cubic { &self.rows[3 * key + part] } else { &self.rows[key] };
        let last = self.times.len() - 1;
        let quaternion = |row: &[f64]| DQuat::from_vec4(DVec4::from_slice(row)).normalize();
        let found = match self.times.windows(2).position(|pair| pair[0] <= seconds && seconds < pair[1]) {
            None => row(if seconds < self.times[0] { 0 } else { last }, 1).clone(),
            Some(key) => {
                let step = self.times[key + 1] - self.times[key];
                let t = (seconds - self.times[key]) / step;
                match self.interpolation {
                    Interpolation::Step => row(key, 0).clone(),
                    Interpolation::Linear if self.is_rotation => {
                        let (a, b) = (quaternion(row(key, 0)), quaternion(row(key + 1, 0)));
                        a.slerp(b, t).to_array().to_vec()
                    }
                    Interpolation::Linear => {
                        row(key, 0).iter().zip(row(key + 1, 0)).map(|(a, b)| a + (b - a) * t).collect()
                    }
                    Interpolation::CubicSpline => (0..row(key, 1).len())
                        .map(|c| {
                            // By de Casteljau's construction over the Bezier points of the same cubic.
                            let (v0, v1) = (row(key, 1)[c], row(key + 1, 1)[c]);
                            let (m0, m1) = (row(key, 2)[c] * step / 3.0, row(key + 1, 0)[c] * step / 3.0);
                            let mut points = vec![v0, v0 + m0, v1 - m1, v1];
                            while points.len() > 1 {
                                points = points.windows(2).map(|p| p[0] + (p[1] - p[0]) * t).collect();
                            }
                            points[0]
                        })
                        .collect(),
                }
            }
        };
        if self.is_rotation { quaternion(&found).to_array().to_vec() } else { found }
    }
}

fn values(pose: &Pose, node: NodeId, property: Property) -> Vec<f64> {
    let target = Target { object: node.into(), property };
    let found = pose.values().iter().find(|(found, _)| *found == target);
    match &found.expect("the channel is played").1 {
        Value::Numbers(numbers) => numbers.to_vec(),
        Value::Weights(weights) => weights.to_vec(),
        Value::Flag(_) => panic!("a flag"),
    }
}

#[test]
fn every_animation_plays_and_its_values_are_those_of_another_implementation() {
    let Some(assets) = assets() else { return };
    let (mut files, mut channels) = (0, 0);
    for path in models(&assets) {
        let Ok(imported) = import(&path) else { continue };
        let scene = imported.scene;
        if scene.animations().is_empty() {
            continue;
        }
        files += 1;
        let nodes: Vec<NodeId> = scene.nodes().ids().collect();
        let evaluators: Vec<Evaluator> = scene
            .animations()
            .ids()
            .map(|id| Evaluator::new(&scene, id, 1 << 30).unwrap_or_else(|e| panic!("{}: {e}", path.display())))
            .collect();
        for evaluator in &evaluators {
            for warning in evaluator.warnings() {
                println!("{}: {warning}", path.display());
            }
        }
        let bytes = std::fs::read(&path).unwrap();
        // It knows no pointers, and refuses files that have them.
        let Ok(gltf::Gltf { document, blob }) = gltf::Gltf::from_slice_without_validation(&bytes) else { continue };
        let Ok(buffers) = gltf::import_buffers(&document, path.parent(), blob) else { continue };
        for (animation, evaluator) in document.animations().zip(&evaluators) {
            for channel in animation.channels() {
                compare(&channel, &nodes, evaluator, &buffers, &path);
                channels += 1;
            }
        }
    }
    println!("{channels} channels of {files} files agree");
    assert!(files > 30 && channels > 400, "{channels} channels of {files} files");
}

fn compare(
    channel: &gltf::animation::Channel<'_>,
    nodes: &[NodeId],
    evaluator: &Evaluator,
    buffers: &[gltf::buffer::Data],
    path: &Path,
) {
    use gltf::animation::Property as Peer;
    let property = match channel.target().property() {
        Peer::Translation => Property::Translation,
        Peer::Rotation => Property::Rotation,
        Peer::Scale => Property::Scale,
        Peer::MorphTargetWeights => Property::Weights,
    };
    let keys = Keys::read(channel, buffers);
    let (first, last) = (keys.times[0], keys.times[keys.times.len() - 1]);
    assert!(evaluator.duration() >= last);
    let between = (0..=12).map(|i| first + (last - first) * f64::from(i) / 12.0);
    for seconds in between.chain([first - 1.0, last + 1.0]) {
        let node = nodes[channel.target().node().index()];
        let (found, expected) = (values(&evaluator.pose(seconds), node, property), keys.at(seconds));
        let sign = match property {
            // A quaternion and its negative are the same rotation.
            Property::Rotation if found.iter().zip(&expected).map(|(a, b)| a * b).sum::<f64>() < 0.0 => -1.0,
            _ => 1.0,
        };
        let near = |(a, b): (&f64, &f64)| (a * sign - b).abs() <= 1e-5 * (1.0 + b.abs());
        assert!(
            found.len() >= expected.len() && found.iter().zip(&expected).all(near),
            "{}: channel {} at {seconds} s: {found:?} and {expected:?}",
            path.display(),
            channel.index()
        );
    }
}

#[test]
fn the_milk_trucks_wheels_roll_about_their_axles() {
    let Some(assets) = assets() else { return };
    let scene = import(&assets.join("gltf-khronos/CesiumMilkTruck/CesiumMilkTruck.glb")).unwrap().scene;
    let evaluator = Evaluator::new(&scene, scene.animations().ids().next().unwrap(), 1 << 20).unwrap();
    // Both go round once in the file's 1.25 s, but for the 10.15 degrees at which they begin.
    assert_eq!(evaluator.duration(), 1.25);
    for wheel in [2, 4].map(|slot| scene.nodes().id_in_slot(slot).unwrap()) {
        for i in 0..=10u32 {
            let seconds = f64::from(i) / 8.0;
            let pose = evaluator.pose(seconds);
            let local = Posed::new(&scene, &pose).local(wheel);
            assert!((local.matrix3.z_axis - DVec3::Z).length() < 1e-6, "the axle: {}", local.matrix3.z_axis);
            let turned = local.matrix3.x_axis.y.atan2(local.matrix3.x_axis.x).to_degrees();
            let expected = (360.0 - 10.15) * (1.0 - seconds / 1.25);
            let off = (turned - expected).rem_euclid(360.0);
            assert!(off.min(360.0 - off) < 1.0, "{turned} degrees at {seconds} s, and not {expected}");
        }
    }
}
