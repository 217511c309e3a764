//! The decoders of compressed geometry: Draco, and meshopt in all its modes and filters.
#![no_main]

use orthant_scene::codec::{draco, meshopt};

const MAX_BYTES: u64 = 64 << 20;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let [kind, count, stride, filter, data @ ..] = bytes else { return };
    if kind % 2 == 0 {
        let _ = draco::decode(data, &draco::DecodeLimits::new(MAX_BYTES));
        return;
    }
    let (modes, filters) = (["ATTRIBUTES", "TRIANGLES", "INDICES"], ["NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"]);
    let view = meshopt::View {
        mode: meshopt::Mode::from_name(modes[usize::from(kind / 2) % 3]).expect("a mode of the extension"),
        filter: meshopt::Filter::from_name(filters[usize::from(*filter) % 5]).expect("a filter of the extension"),
        count: usize::from(*count) * 3,
        stride: usize::from(*stride),
    };
    let checked = meshopt::check(view, data);
    let decoded = meshopt::decode(view, data, MAX_BYTES);
    assert!(checked.is_ok() || decoded.is_err(), "what the check refuses is not decoded");
});
