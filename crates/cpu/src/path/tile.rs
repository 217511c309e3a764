//! Blocks of samples of small tiles: the unit of work.

use super::PathTracer;
use super::aov::{is_averaged, trace_center};
use super::integrator::{PathCounts, trace_path};
use crate::world::image::sample_layers;
use glam::{Vec2, Vec3};
use orthant_resident::frame::{Aov, Tile};
use orthant_resident::sampling::{DimensionSet, Sampler, sample_pixel_filter};
use std::ops::Range;

/// The sums of one block of samples over one tile.
#[derive(Clone, Debug, Default)]
pub struct TileSums {
    /// Radiance, row by row.
    pub radiance: Vec<[f32; 3]>,
    /// Averaged AOVs in the frame's order, row by row each.
    pub averaged: Vec<Vec<[f32; 3]>>,
    /// The other AOVs in the frame's order; filled with the first block only.
    pub centers: Vec<Vec<f32>>,
    /// Work.
    pub counts: PathCounts,
}

/// Renders samples `samples` of the pixels of `tile`; with `centers` also what the rays through the centres hit. The
/// sums' buffers are used again.
pub fn render_tile(tracer: &PathTracer, tile: Tile, samples: Range<u32>, centers: bool, sums: &mut TileSums) {
    let aovs = &tracer.frame.aovs;
    let averaged: usize = aovs.iter().filter(|&&aov| is_averaged(aov)).count();
    sums.counts = PathCounts::default();
    sums.radiance.clear();
    sums.averaged.resize(averaged, Vec::new());
    sums.averaged.iter_mut().for_each(Vec::clear);
    for y in tile.y..tile.y + tile.height {
        for x in tile.x..tile.x + tile.width {
            let (mut radiance, mut albedo, mut normal) = (Vec3::ZERO, Vec3::ZERO, Vec3::ZERO);
            for index in samples.clone() {
                let sampler = Sampler::new(tracer.frame.seed, x, y, index);
                let [f0, f1, l0, l1] = sampler.set(0, DimensionSet::Camera);
                let center = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                let film = center + sample_pixel_filter(tracer.frame.filter, Vec2::new(f0, f1));
                let lens = Vec2::new(l0, l1);
                let sample = match tracer.world {
                    Some(world) => sample_layers(tracer, world, [x, y, index], film, lens, &mut sums.counts),
                    None => {
                        let (ray, cone) = tracer.view.camera_ray(film, lens);
                        trace_path(tracer, None, &sampler, ray, cone, &mut sums.counts)
                    }
                };
                radiance += sample.radiance;
                albedo += sample.albedo;
                normal += sample.normal;
            }
            sums.radiance.push(radiance.to_array());
            let mut buffers = sums.averaged.iter_mut();
            for aov in aovs.iter().filter(|&&aov| is_averaged(aov)) {
                let value = if *aov == Aov::Albedo { albedo } else { normal };
                buffers.next().expect("one buffer for each averaged AOV").push(value.to_array());
            }
        }
    }
    sums.centers.clear();
    if centers && averaged < aovs.len() {
        sums.centers.resize(aovs.len() - averaged, Vec::new());
        for y in tile.y..tile.y + tile.height {
            for x in tile.x..tile.x + tile.width {
                let hit = trace_center(tracer, x, y, &mut sums.counts.world);
                for (buffer, &aov) in sums.centers.iter_mut().zip(aovs.iter().filter(|&&aov| !is_averaged(aov))) {
                    hit.write(aov, buffer);
                }
            }
        }
    }
}
