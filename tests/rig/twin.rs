//! Compares a frame with its float64 twins, pass by pass, within the tolerances that the project promises.

use super::{Frame, Limits, Shot, hold};
use glam::{DVec3, Vec3};
use hbao::Settings;
use hbao::image::Image;
use hbao::reference;
use hbao::reference::gbuffer::Surface;
use hbao::settings::{AoFormat, DepthFormat};

/// Compares coverage, depth, normals and colours with one ray per pixel. 99.5 % of the pixels must match. The others
/// lie at silhouettes and where triangles meet: there the rasteriser's fixed-point vertices may give another result
/// than the exact ones.
pub fn hold_gbuffer(frame: &Frame, shot: &Shot, size: (u32, u32), settings: &Settings, context: &str) {
    let size = (size.0 as usize, size.1 as usize);
    let camera = shot.camera((size.0 as u32, size.1 as u32));
    let at = |sample| reference::gbuffer::gbuffer(&shot.mesh, &camera, size, settings.normals, sample);
    let all: Vec<_> = frame.sample_positions().iter().map(|&sample| at(sample)).collect();
    let seen = &all[0];
    let both =
        Image::from_fn(size.0, size.1, |x, y| frame.depth.at(x, y).is_finite() && seen.at(x, y).depth.is_finite());
    let either =
        Image::from_fn(size.0, size.1, |x, y| frame.depth.at(x, y).is_finite() || seen.at(x, y).depth.is_finite());
    // In a very small picture, two pixels may differ even if that is more than 0.5 %.
    let share = 0.005f64.max(2.0 / either.texels.iter().filter(|&&e| e).count().max(1) as f64);
    let one = |covered: bool| f64::from(u8::from(covered));
    hold(
        "coverage",
        &frame.covered().map(one),
        &seen.map(|s| one(s.depth.is_finite())),
        &either,
        Limits { tolerance: 0.0, share },
        context,
    );

    let relative = Image::from_fn(size.0, size.1, |x, y| f64::from(frame.depth.at(x, y)) / seen.at(x, y).depth);
    let tolerance = match settings.depth_format {
        DepthFormat::R32f => 1e-5,
        // R16F has 11 significant bits, and the driver may truncate or round.
        _ => 1e-5 + 2f64.powi(-10),
    };
    let (zero, unit) = (both.map(|_| 0.0), both.map(|_| 1.0));
    hold("depth over that of the ray", &relative, &unit, &both, Limits { tolerance, share }, context);

    let degrees = Image::from_fn(size.0, size.1, |x, y| {
        let (n, expected) = (Vec3::from(frame.normals.at(x, y)).as_dvec3(), seen.at(x, y).normal);
        n.cross(expected).length().atan2(n.dot(expected)).to_degrees()
    });
    hold("normals off by degrees", &degrees, &zero, &both, Limits { tolerance: 1.0, share }, context);

    // Two fifths of the light is ambient. The rest comes from over the viewer's left shoulder.
    let light = DVec3::new(-2.0, 3.0, -3.5).normalize();
    for channel in 0..3 {
        let shade = |s: Surface| match s.depth.is_finite() {
            true => f64::from(s.diffuse[channel]) * (0.4 + 0.6 * s.normal.dot(light).max(0.0)),
            false => 1.0,
        };
        let shaded = Image::from_fn(size.0, size.1, |x, y| {
            all.iter().map(|seen| shade(seen.at(x, y))).sum::<f64>() / all.len() as f64
        });
        let got = frame.colour.map(|c| f64::from(c[channel]) / 255.0);
        // The tolerance covers the rounding of each sample to 8 bits, that of their mean, and the error of
        // interpolation.
        let roundings = if all.len() > 1 { 2.0 } else { 1.0 };
        let tolerance = (0.5 * roundings + 0.25) / 255.0;
        hold("colour", &got, &shaded, &both, Limits { tolerance, share }, context);
    }
    let background = either.map(|covered| !covered);
    if background.texels.contains(&true) {
        let clear = |n: [f32; 3]| if n == [0.0; 3] { 0.0 } else { 1.0 };
        hold("normals of background", &frame.normals.map(clear), &zero, &background, super::everywhere(0.0), context);
        let white = |c: [u8; 3]| if c == [255; 3] { 0.0 } else { 1.0 };
        let empty = Image::from_fn(size.0, size.1, |x, y| background.at(x, y) && !frame.edges.at(x, y));
        if empty.texels.contains(&true) {
            hold("colour of background", &frame.colour.map(white), &zero, &empty, super::everywhere(0.0), context);
        }
        if empty.texels.contains(&true) && (frame.ao.width, frame.ao.height) == size {
            hold("visibility of background", &frame.ao, &unit, &empty, super::everywhere(0.0), context);
        }
    }
}

/// Checks the ambient occlusion before the blur. Returns how many pixels are ambiguous.
pub fn hold_raw(frame: &Frame, settings: &Settings, context: &str) -> usize {
    let inputs = frame.inputs();
    hold_visibility(&frame.raw, &inputs, settings, context)
}

/// Checks which pixels hold several surfaces against the depth samples that were read back.
pub fn hold_edges(frame: &Frame, settings: &Settings, context: &str) {
    let one = |edge: bool| f64::from(u8::from(edge));
    let expected = match frame.samples.as_slice() {
        [] => frame.depth.map(|_| false),
        samples => reference::edges::edges(samples, frame.projection, settings).unwrap(),
    };
    let all = frame.depth.map(|_| true);
    hold("edges", &frame.edges.map(one), &expected.map(one), &all, super::everywhere(0.0), context);
}

/// Compares visibility that was made from `inputs` with the twin. 99.9 % of the pixels must be within the tolerance,
/// and so must every pixel that the twin does not call ambiguous. At most 0.5 % of the pixels, or two, may be
/// ambiguous. Returns how many are.
pub fn hold_visibility(got: &Image<f32>, inputs: &reference::TwinInputs, settings: &Settings, context: &str) -> usize {
    // Each texel of ambient occlusion stands for one of these pixels.
    let scale = settings.ao_scale() as usize;
    let covered = Image::from_fn(got.width, got.height, |x, y| inputs.depth.at(scale * x, scale * y).is_finite());
    let pixels = covered.texels.iter().filter(|&&c| c).count();
    let expected = reference::visibility(inputs, settings).unwrap();
    let ambiguous = reference::ambiguous(inputs, settings).unwrap();
    let count = ambiguous.texels.iter().filter(|&&a| a).count();
    // In ray-march each of some 256 samples of a pixel may be about to round to another texel, and one hit changes A by
    // 1/32. More pixels are therefore ambiguous: at most 4.8 %, on the Dragon. The last comparison below still requires
    // 99.9 % to match.
    let share = if settings.method.reads("rays") { 20 } else { 200 };
    assert!(count <= (pixels / share).max(2), "{count} of {pixels} pixels are ambiguous\n{context}");
    let tolerance = match settings.ao_format {
        AoFormat::R32f => 1e-3,
        // This adds half a step between half floats below 1, or a whole step if the driver truncates.
        AoFormat::R16f => 1e-3 + 2f64.powi(-11),
        _ => 1.0 / 255.0,
    };
    let clear = Image::from_fn(covered.width, covered.height, |x, y| covered.at(x, y) && !ambiguous.at(x, y));
    hold(
        "raw ambient occlusion where it is not ambiguous",
        got,
        &expected,
        &clear,
        super::everywhere(tolerance),
        context,
    );
    // In a small image, two pixels may differ even if that is more than 0.1 %.
    let share = 0.001f64.max(2.0 / pixels as f64);
    hold("raw ambient occlusion", got, &expected, &covered, Limits { tolerance, share }, context);
    let background = covered.map(|c| !c);
    if background.texels.contains(&true) {
        hold("background", got, &background.map(|_| 1.0), &background, super::everywhere(0.0), context);
    }
    assert!(got.texels.iter().all(|a| (0.0..=1.0).contains(a)), "outside [0, 1]\n{context}");
    count
}

/// Checks the blur, applied to the ambient occlusion that the GPU itself has made.
pub fn hold_blur(frame: &Frame, settings: &Settings, context: &str) {
    let raw = frame.raw.map(f64::from);
    let expected = reference::blur::blur(&raw, &frame.depth, &frame.samples, frame.projection, settings).unwrap();
    let tolerance = match settings.ao_format {
        AoFormat::R32f => 1e-4,
        // Each of the two passes rounds by half a step, or by a whole one if the driver truncates.
        AoFormat::R16f => 1e-4 + 2.0 * 2f64.powi(-11),
        // Each of the two passes rounds by half a step.
        _ => 1.0 / 255.0 + 1e-4,
    };
    let all = frame.ao.map(|_| true);
    hold("blurred ambient occlusion", &frame.ao, &expected, &all, super::everywhere(tolerance), context);
}
