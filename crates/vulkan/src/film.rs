//! What the passes of a frame write on the device, and how it is read back as a film.

use crate::abi::CenterHit;
use crate::device::Device;
use crate::error::Result;
use crate::memory::{Buffer, Place, Queue, Stage};
use ash::vk;
use orthant_resident::frame::Aov;
use orthant_resident::{Film, Frame};
use std::sync::Arc;
use std::time::Duration;

/// Bytes of a pixel's sum.
const PIXEL: u64 = 16;

/// The sums over the samples of a frame, and what its pixel centres meet, where the frame asks for it.
pub(crate) struct FilmBuffers {
    pub sum: Buffer,
    pub albedo: Option<Buffer>,
    pub normal: Option<Buffer>,
    pub centers: Option<Buffer>,
}

impl FilmBuffers {
    /// `layers` are the sums of each AOV that is averaged: the first of them is that of the frame.
    pub fn new(device: &Arc<Device>, frame: &Frame, layers: u64) -> Result<Self> {
        let pixels = u64::from(frame.tile.width) * u64::from(frame.tile.height);
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER
            | vk::BufferUsageFlags::TRANSFER_SRC
            | vk::BufferUsageFlags::TRANSFER_DST;
        let make = |what, size| Buffer::new(device, what, size, usage, Place::Device);
        let averaged = |aov, what| frame.aovs.contains(&aov).then(|| make(what, layers * PIXEL * pixels)).transpose();
        let wants_centers = frame.aovs.iter().any(|aov| !matches!(aov, Aov::Albedo | Aov::Normal));
        let centers = size_of::<CenterHit>() as u64 * pixels;
        Ok(Self {
            sum: make("a film", PIXEL * pixels)?,
            albedo: averaged(Aov::Albedo, "the albedo of a frame")?,
            normal: averaged(Aov::Normal, "the normals of a frame")?,
            centers: wants_centers.then(|| make("pixel centres of a frame", centers)).transpose()?,
        })
    }

    /// The buffers that begin with zeros.
    pub fn sums(&self) -> impl Iterator<Item = &Buffer> {
        [Some(&self.sum), self.albedo.as_ref(), self.normal.as_ref()].into_iter().flatten()
    }

    /// Device addresses of albedo, normals and centres; 0 where there are none.
    pub fn addresses(&self) -> [u64; 3] {
        [&self.albedo, &self.normal, &self.centers].map(|buffer| buffer.as_ref().map_or(0, |buffer| buffer.address))
    }

    /// The film of a number of samples. All that was handed in before is done afterwards.
    pub fn read(
        &self,
        device: &Arc<Device>,
        queue: &mut Queue,
        frame: &Frame,
        samples: u32,
        has_centers: bool,
    ) -> Result<Film> {
        let mut read = |from: &Buffer| read(device, queue, from);
        let sum: Vec<[f32; 3]> = read(&self.sum)?.chunks_exact(4).map(rgb).collect();
        let centers: Vec<CenterHit> = match &self.centers {
            Some(centers) if has_centers => bytemuck::pod_collect_to_vec(&read(centers)?),
            _ => Vec::new(),
        };
        let count = samples.max(1) as f32;
        let mut aovs = Vec::with_capacity(frame.aovs.len());
        for &aov in &frame.aovs {
            let averaged = match aov {
                Aov::Albedo => self.albedo.as_ref(),
                Aov::Normal => self.normal.as_ref(),
                _ => None,
            };
            let values: Vec<f32> = match averaged {
                Some(buffer) => {
                    let sums = read(buffer)?;
                    sums.chunks_exact(4).take(sum.len()).flat_map(rgb).map(|value| value / count).collect()
                }
                None if centers.is_empty() => vec![0.0; sum.len() * aov.channels()],
                None => centers.iter().flat_map(|hit| hit.channels(aov)).collect(),
            };
            aovs.push((aov, values));
        }
        let &Frame { width, height, tile, .. } = frame;
        Ok(Film { width, height, tile, samples, sum, blocks: Vec::new(), aovs })
    }
}

/// The colour of a pixel's sum.
pub(crate) fn rgb(sum: &[f32]) -> [f32; 3] {
    [sum[0], sum[1], sum[2]]
}

/// Copies a buffer of floats back.
fn read(device: &Arc<Device>, queue: &mut Queue, from: &Buffer) -> Result<Vec<f32>> {
    let to = Buffer::new(device, "a film", from.size, vk::BufferUsageFlags::TRANSFER_DST, Place::Readback)?;
    let mut commands = queue.begin()?;
    commands.full_barrier();
    commands.stage(Stage::Readback);
    commands.copy(from.raw, to.raw, &[vk::BufferCopy { src_offset: 0, dst_offset: 0, size: from.size }]);
    commands.host_barrier();
    let number = queue.submit(commands)?;
    // SYNC: an explicit readback of the film.
    queue.wait(number, Duration::MAX)?;
    Ok(bytemuck::pod_collect_to_vec(&to.mapped()[..from.size as usize]))
}
