//! Converts measurements to JSON.

use super::tables::bench::{Growth, Times};
use super::tables::cells::spread;
use hbao::Settings;
use hbao::measure::bench::{Change, InputCost, Measurement};
use hbao::measure::decomposition::{Decomposition, ErrorPart};
use hbao::measure::median;
use hbao::measure::ratios::Ratio;
use serde_json::{Map, Value, json};

/// Converts what changing a setting adds to JSON.
pub(crate) fn change(one: &Change) -> Value {
    json!({ "setting": one.setting, "added_ms": median(&one.added_ms), "runs": one.added_ms })
}

/// Converts the cost of a form of inputs to JSON.
pub(crate) fn input_cost(one: &InputCost) -> Value {
    json!({
        "inputs": one.inputs,
        "linear_depth_ms": median(&one.linear_depth_ms),
        "rebuilt_normals_ms": median(&one.rebuilt_normals_ms),
        "ao_ms": median(&one.ao_ms),
    })
}

/// Converts one case of the bench to JSON.
pub(crate) fn measurement(one: &Measurement) -> Value {
    let case = &one.case;
    let [directions, rays, steps] = case.samples();
    let mut spreads = Map::new();
    let all: [(&str, Times); 5] = [
        ("frame_ms", |one| &one.frame_ms),
        ("gbuffer_ms", |one| &one.gbuffer_ms),
        ("ao_ms", |one| &one.ao_ms),
        ("floor_ms", |one| &one.floor_ms),
        ("blur_ms", |one| &one.blur_ms),
    ];
    for (name, times) in all.iter().filter(|(_, times)| !times(one).is_empty()) {
        let (low, high) = spread(times(one));
        spreads.insert((*name).into(), json!([low, high]));
    }
    // The median of times that were not measured is NaN, which JSON writes as null.
    json!({
        "mode": case.mode,
        "column": case.column,
        "method": case.method().name(),
        "directions": directions,
        "rays": rays,
        "steps": steps,
        "msaa": one.samples,
        "exit": case.settings.exit.name(),
        "exit_share": one.reach.exits,
        "half_res": case.settings.half_res,
        "blur": case.blur(),
        "ssao_depth": case.settings.ssao_depth.name(),
        "ssao_rotation": case.settings.ssao_rotation.name(),
        "size": [case.size.0, case.size.1],
        "triangles": one.triangles,
        "frame_ms": median(&one.frame_ms),
        "gbuffer_ms": median(&one.gbuffer_ms),
        "ao_ms": median(&one.ao_ms),
        "floor_ms": median(&one.floor_ms),
        "ao_to_floor": one.ao_to_floor(),
        "fetches_per_pixel": case.fetches(),
        "ns_per_sample": one.ns_per_sample(&one.ao_ms),
        "floor_ns_per_fetch": one.ns_per_sample(&one.floor_ms),
        "blur_ms": median(&one.blur_ms),
        "fps": one.fps(),
        "mpixels_per_s": one.mpixels_per_s(),
        "spread": spreads,
        "compile_ms": one.compile_ms,
    })
}

/// Converts a ratio of times to JSON.
pub(crate) fn ratio(ratio: &Ratio) -> Value {
    let papers: Map<_, _> = ratio.papers.iter().map(|&(card, x)| (card.to_string(), json!(x))).collect();
    json!({ "ratio": ratio.what, "here": ratio.ours, "papers": papers })
}

/// Converts the growth of a time along a series to JSON.
pub(crate) fn growth(growth: &Growth) -> Value {
    json!({ "series": growth.series, "of": growth.of, "exponent": growth.exponent })
}

/// Converts the decomposed error of a combination of settings to JSON.
pub(crate) fn decomposition(s: &Settings, parts: &Decomposition) -> Value {
    let of = |part: &ErrorPart| json!({ "rmse": part.rmse, "bias": part.bias, "max": part.max });
    json!({
        "method": s.method.name(),
        "directions": s.directions,
        "steps": s.steps,
        "half_res": s.half_res,
        "blur": s.blur,
        "model": of(&parts.model),
        "sampling": of(&parts.sampling),
        "filtering": of(&parts.filtering),
        "quantisation": of(&parts.quantisation),
        "total": of(&parts.total),
        "cross": parts.cross,
        "pixels": parts.pixels,
    })
}
