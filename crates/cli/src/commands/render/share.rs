//! A share of the work: sums of whole blocks of samples.

use super::Plan;
use crate::args::RenderArgs;
use crate::failure::Failure;
use crate::job::{Rendering, settings};
use crate::output::write_atomically;
use crate::share::{Header, ShareWriter};
use orthant_resident::Frame;
use orthant_resident::film::BLOCK;
use orthant_resident::frame::Tile;
use orthant_resident::tonemap::ToneMapper;

/// Blocks of a share that are held at a time, in bytes.
const SHARE_BUFFER: u64 = 256 << 20;

/// Renders a share in runs of whole blocks, so that no more than [`SHARE_BUFFER`] bytes of them are held.
///
/// # Errors
/// A file that cannot be read again or written; a backend that fails.
pub fn render_share(args: &RenderArgs, plan: &Plan, frame: &Frame, work: &mut Rendering<'_>) -> Result<(), Failure> {
    let Tile { x, y, width, height } = plan.tile;
    let choices = format!("{:?}", (args.scene, args.variant.as_deref(), super::moment(args)));
    let files: Vec<_> = std::iter::once(args.file.as_path()).chain(args.world.as_deref()).collect();
    let scene = work.subject.loaded.as_deref().map(|loaded| &loaded.scene);
    let settings = settings::hash(&files, scene, &choices, work.environment, frame)?;
    // Which processor it is does not matter: the program names its kind. Each device and driver rounds in its own way.
    let backend = match work.backend.name() {
        "cpu" => "cpu".to_owned(),
        name => format!("{name} on {}", work.backend.device()),
    };
    let header = Header {
        program: settings::program(),
        backend,
        width: plan.width,
        height: plan.height,
        tile: [x, y, width, height],
        samples: [plan.samples.start, plan.samples.end],
        spp: args.spp,
        seed: args.seed,
        settings,
        tonemap: ToneMapper::from(args.tonemap).name().into(),
        exposure: args.exposure,
    };
    let blocks_at_once = (SHARE_BUFFER / (12 * plan.pixels())).clamp(1, 1 << 20) as u32;
    write_atomically(&args.output, |file| {
        let io = |e: std::io::Error| Failure::io(&args.output, "write the file", &e);
        let mut writer = ShareWriter::new(file, header).map_err(io)?;
        let mut at = plan.samples.start;
        while at < plan.samples.end {
            let end = at.saturating_add(blocks_at_once * BLOCK).min(plan.samples.end);
            let part = Frame { samples: at..end, ..frame.clone() };
            let done = plan.pixels() * u64::from(at - plan.samples.start);
            for block in &work.render(&part, done, plan.total_samples())?.blocks {
                writer.block(block).map_err(io)?;
            }
            at = end;
        }
        writer.finish();
        Ok(())
    })
}
