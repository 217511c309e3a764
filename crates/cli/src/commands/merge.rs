//! `orthant merge`: shares to an image.

use crate::args::{Common, MergeArgs};
use crate::failure::{Exit, Failure};
use crate::image_io::{Display, Format, write};
use crate::output::check_outputs;
use crate::share::merge;
use orthant_resident::tonemap::ToneMapper;

/// Writes the image that the shares are parts of: the bytes that one run over the whole gives.
///
/// # Errors
/// Another image format (usage), shares that are damaged or do not make one whole image (bad input), or an I/O error.
pub fn run(args: &MergeArgs, common: &Common) -> Result<(), Failure> {
    Format::of(&args.output).map_err(|e| Failure::usage(e.to_string()))?;
    let shares: Vec<_> = args.shares.iter().map(|share| ("the share", share.as_path())).collect();
    check_outputs(&[("-o", &args.output)], &shares)?;
    let merged = merge(&args.shares, common.max_memory())?;
    let h = &merged.header;
    let (_, tonemap) = ToneMapper::ALL.into_iter().find(|(name, _)| *name == h.tonemap).ok_or_else(|| {
        Failure::new(Exit::BadInput, format!("the tone mapper {:?} of the shares is not known", h.tonemap))
            .in_file(&args.shares[0])
            .remedy("merge with the program that rendered them")
    })?;
    write(&args.output, h.width, h.height, &merged.pixels, Display { tonemap, exposure: h.exposure })
}
