//! Measures the cases at the extremes.

use super::cases::{Case, SIZE, cases, float};
use crate::report::figure::Picture;
use crate::report::figures::{detail, grey};
use crate::report::scenes;
use hbao::image::Image;
use hbao::measure::precision::{Comparer, DepthPlanes, Precision, Spread, biased, unresolved_gap};
use hbao::settings::{DepthFormat, NormalFormat};
use hbao::{Error, Settings, glow};
use std::sync::Arc;

/// The result of one case.
pub(super) struct Extreme {
    /// The name of the axis.
    pub(super) axis: &'static str,
    pub(super) name: String,
    /// The value on the axis.
    pub(super) along: f64,
    /// The errors, or why the case is refused.
    pub(super) found: Result<Precision, String>,
}

/// The largest gaps between surfaces that the depth test does not resolve, relative to their depth.
pub(super) struct Gaps {
    pub(super) orthographic: bool,
    /// The near depth divided by the far depth.
    pub(super) near_far: f64,
    /// The gaps at the near end, in the middle and at the far end of the view.
    pub(super) at: [f64; 3],
}

/// The false occlusion of a floor, which nothing occludes.
pub(super) struct Floor {
    /// The formats of depth and normals.
    pub(super) formats: &'static str,
    /// The angle bias in degrees.
    pub(super) bias: f64,
    /// The mean of 1 - A.
    pub(super) mean: f64,
    /// The largest 1 - A.
    pub(super) max: f64,
}

/// Everything that was measured.
pub(in crate::report) struct Extremes {
    pub(super) cases: Vec<Extreme>,
    pub(super) gaps: Vec<Gaps>,
    pub(super) floors: Vec<Floor>,
    pub(super) pictures: Vec<Picture>,
}

/// Measures everything.
pub(in crate::report) fn measure(gl: &Arc<glow::Context>) -> Result<Extremes, Error> {
    let mut found_cases = Vec::new();
    let mut last: Option<(Settings, (u32, u32), Comparer)> = None;
    for Case { axis, name, along, size, mesh, view, settings } in cases()? {
        // Neighbouring cases with the same settings share their programs.
        if last.as_ref().is_none_or(|(known, of, _)| *known != settings || *of != size) {
            last = Some((settings.clone(), size, Comparer::new(gl, size, &settings)?));
        }
        let Some((.., comparer)) = &mut last else { continue };
        let found = mesh.and_then(|mesh| {
            let (camera, _) = view.camera(&mesh, size.0, size.1)?;
            Ok(comparer.measure(&mesh, &camera)?.0)
        });
        let found = match found {
            Err(Error::Usage(why)) => Err(why),
            other => Ok(other?),
        };
        found_cases.push(Extreme { axis, name, along, found });
    }
    let mut gaps = Vec::new();
    for orthographic in [false, true] {
        for k in [2, 4, 6, 8] {
            let near = 10f64.powi(-k);
            let at = |z: f64| unresolved_gap(gl, DepthPlanes { near, far: 1.0 }, z, orthographic);
            let at = [at(1.3 * near)?, at(near.sqrt())?, at(0.7)?];
            gaps.push(Gaps { orthographic, near_far: near, at });
        }
    }
    let (floors, pictures) = floors(gl)?;
    Ok(Extremes { cases: found_cases, gaps, floors, pictures })
}

/// Measures the false occlusion of a floor for each format and angle bias, and makes pictures of it.
fn floors(gl: &Arc<glow::Context>) -> Result<(Vec<Floor>, Vec<Picture>), Error> {
    let subject = scenes::floor()?;
    let camera = subject.camera(SIZE)?;
    let (mut floors, mut pictures) = (Vec::new(), Vec::new());
    for bias in [0.0, 1.0, 5.0, 30.0] {
        let base = Settings { bias: f64::to_radians(bias), ..float(subject.radius) };
        let mut put = |name, file, raw: &Image<f32>, depth: &Image<f32>| -> Result<(), Error> {
            let covered = (0..raw.texels.len()).filter(|&i| depth.texels[i].is_finite());
            let dark: Vec<f64> = covered.map(|i| 1.0 - f64::from(raw.texels[i])).collect();
            let mean = dark.iter().sum::<f64>() / dark.len().max(1) as f64;
            floors.push(Floor { formats: name, bias, mean, max: Spread::of(dark).max });
            if bias == 0.0 {
                let loud = raw.map(|a| (1.0 - LOUDER * (1.0 - a)).max(0.0));
                let size = (loud.width, loud.height);
                let file = format!("extremes-{file}");
                pictures.push(detail(&grey(&loud), (0, 0), size, 2, &file, name)?);
            }
            Ok(())
        };
        let formats = [
            ("R32F, RGBA16F", "float", base.clone()),
            ("R16F, RGBA16F", "r16f", Settings { depth_format: DepthFormat::R16f, ..base.clone() }),
            ("R32F, RGBA8_SNORM", "snorm", Settings { normal_format: NormalFormat::Rgba8Snorm, ..base.clone() }),
        ];
        for (name, file, settings) in formats {
            let (_, images) = Comparer::new(gl, SIZE, &settings)?.measure(&subject.mesh, &camera)?;
            put(name, file, &images.raw, &images.depth)?;
            if file == "float" {
                let coarse = biased(&images, &camera, &settings)?;
                put("R32F, biased RGBA8", "biased", &coarse, &images.depth)?;
            }
        }
    }
    Ok((floors, pictures))
}

/// The factor by which false occlusion is made darker in pictures.
pub(super) const LOUDER: f32 = 20.0;
