//! `orthant compare`: how far two images are apart.

use crate::args::{Common, CompareArgs};
use crate::failure::{Exit, Failure};
use crate::image_io::read;
use crate::metrics::{METRICS, compare, error::EPSILON};
use crate::output::{print, print_json};
use serde_json::json;

/// Prints the metrics, and fails where one exceeds its threshold.
///
/// # Errors
/// A bad image, images of different sizes (bad input), or an exceeded threshold (check failed).
pub fn run(args: &CompareArgs, common: &Common) -> Result<(), Failure> {
    let limit = common.max_memory() / 2;
    let (a, b) = (read(&args.a, limit)?, read(&args.b, limit)?);
    if (a.width, a.height) != (b.width, b.height) {
        let what =
            format!("{} x {} pixels, but {} has {} x {}", a.width, a.height, args.b.display(), b.width, b.height);
        return Err(Failure::bad_input(&args.a, what).remedy("compare images of one size"));
    }
    let (width, height) = (a.width, a.height);
    let result = compare(a, b);
    let exceeded: Vec<(&str, f64, f64)> = args
        .fail_above
        .iter()
        .filter_map(|t| {
            let value = result.get(&t.metric)?;
            // A metric that is not a number is above every threshold.
            (value.is_nan() || value > t.value).then_some((t.metric.as_str(), value, t.value))
        })
        .collect();

    if args.json {
        let number = |v: f64| if v.is_finite() { json!(v) } else { json!(v.to_string()) };
        print_json(&json!({
            "a": args.a.display().to_string(),
            "b": args.b.display().to_string(),
            "width": width,
            "height": height,
            "rmse": number(result.rmse),
            "rel_mse": number(result.rel_mse),
            "rel_mse_epsilon": EPSILON,
            "max": number(result.max),
            "flip": number(result.flip),
            "flip_kind": if result.hdr { "hdr" } else { "ldr" },
            "values": if result.hdr { "linear" } else { "srgb" },
            "exceeded": exceeded.iter().map(|e| e.0).collect::<Vec<_>>(),
        }))?;
    } else {
        let lines: Vec<String> =
            METRICS.iter().map(|m| format!("{m:<8} {:.6}\n", result.get(m).unwrap_or(f64::NAN))).collect();
        print(&lines.concat())?;
    }
    if exceeded.is_empty() {
        return Ok(());
    }
    let list: Vec<String> = exceeded.iter().map(|(m, v, most)| format!("{m} is {v:.6}, above {most}")).collect();
    Err(Failure::new(Exit::CheckFailed, list.join("; ")).in_file(&args.a))
}
