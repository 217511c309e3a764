//! Diagnostics as a line of JSON.

use orthant_render::world::live::{ArenaCounts, CompactionDiagnostics, Diagnostics, Occupancies, Occupancy};
use serde_json::{Value, json};

/// The line of a frame. Times are milliseconds.
pub fn line(frame: &Diagnostics) -> Value {
    json!({
        "frame": frame.frame,
        "revisions": {
            "world": frame.revisions.world,
            "mirror": frame.revisions.mirror,
            "resident": frame.revisions.resident,
        },
        "queue_length": frame.queue_length,
        "untidy_length": frame.untidy_length,
        "coalesced": frame.coalesced,
        "patches": frame.patches,
        "noop_patches": frame.noop_patches,
        "patches_waiting": frame.patches_waiting,
        "patch_ms": ms(frame.patch_ms),
        "edit_ms": ms(frame.edit_ms),
        "upload_bytes": frame.upload_bytes,
        "edits_applied": frame.edits_applied,
        "edits_deferred": frame.edits_deferred,
        "splits": frame.splits,
        "noop_edits": frame.noop_edits,
        "writes": counts(&frame.writes),
        "frees": counts(&frame.frees),
        "free_lists": occupancies(&frame.occupancy),
        "leaves": frame.leaves,
        "depth": frame.depth,
        "sah_growth": ms(frame.sah_growth),
        "compaction": compaction(&frame.compaction),
        "rebuilds": frame.rebuilds_total,
        "rebuild": frame.rebuild,
        "frame_ms": ms(frame.frame_ms),
        "mutation_ms": ms(frame.mutation_ms),
        "rays": {
            "rays": frame.rays.rays,
            "node_visits": frame.rays.node_visits,
            "leaf_visits": frame.rays.leaf_visits,
            "dda_steps": frame.rays.dda_steps,
            "exhausted": frame.rays.exhausted,
        },
    })
}

fn counts(counts: &ArenaCounts) -> Value {
    json!({
        "nodes": counts.nodes,
        "leaves": counts.leaves,
        "payload_words": counts.payload_words,
        "palette": counts.palette,
    })
}

fn occupancies(all: &Occupancies) -> Value {
    let of = |arena: &Occupancy| json!({"live": arena.live, "free": arena.free});
    json!({"nodes": of(&all.nodes), "leaves": of(&all.leaves), "payload_words": of(&all.payload)})
}

fn compaction(now: &CompactionDiagnostics) -> Value {
    json!({
        "state": now.state.name(),
        "started": now.started,
        "discarded": now.discarded,
        "swapped": now.swapped,
        "build_ms": now.build_ms.map(ms),
        "joined": now.joined,
        "upload_ms": ms(now.upload_ms),
        "upload_bytes": now.upload_bytes,
        "swap_ms": now.swap_ms.map(ms),
        "backlog": now.backlog,
        "replayed": now.replayed,
        "finished": now.finished_total,
        "given_up": now.discarded_total,
    })
}

/// To four decimals: a tenth of a microsecond.
fn ms(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}
