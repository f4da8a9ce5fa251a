//! What float32 and narrower formats do to an image: each pass against the same equations in float64.
//!
//! A pass is held to its twin twice. On the images that the GPU itself made the difference is the pass's own
//! arithmetic; on what rays meet in float64, where nothing was rounded on the way, it is all that went wrong up to
//! there.
#![doc = include_str!("extremes.md")]

use crate::image::Image;
use crate::reference::{self, gbuffer::Surface};
use crate::scene::{Camera, Mesh, Projection};
use crate::settings::{Normals, Radius, Settings};
use crate::{Error, Pipeline, Request, rotation_tile};
use glam::{DVec3, Vec3};

/// By how much, in pixels, the rasteriser may move a triangle's edge: it keeps 8 bits of a vertex's place in its pixel,
/// and twice that is left for what clipping and interpolation add.
const SNAPPED: f64 = 2.0 / 256.0;

/// How much, in radians, the normal drawn must differ from all that rays meet about a pixel to be of a side turned
/// away: more than any format rounds.
const SLIVER: f64 = 0.03;

/// How large the differences of some pixels are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spread {
    /// The root of the mean squared difference.
    pub rmse: f64,
    /// What 99.9 % of the pixels do not exceed.
    pub most: f64,
    /// The largest.
    pub max: f64,
    /// How many pixels were compared.
    pub pixels: usize,
}

impl Spread {
    /// Of differences of either sign; of none all is 0. What is no number counts as infinite.
    pub fn of(differences: impl IntoIterator<Item = f64>) -> Spread {
        let sizes = differences.into_iter().map(|d| if d.is_nan() { f64::INFINITY } else { d.abs() });
        let mut sizes: Vec<f64> = sizes.collect();
        sizes.sort_by(f64::total_cmp);
        let Some(&max) = sizes.last() else { return Spread::default() };
        let count = sizes.len();
        Spread {
            rmse: (sizes.iter().map(|d| d * d).sum::<f64>() / count as f64).sqrt(),
            most: sizes[(count * 999).div_ceil(1000) - 1],
            max,
            pixels: count,
        }
    }
}

/// How far one view's images are from float64, pass by pass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Precision {
    /// Pixels that hold a surface.
    pub covered: usize,
    /// Of those, where the rasteriser, within its grid of 1/256 pixel, took another surface than the ray through the
    /// pixel's centre meets. They are compared with that other surface; where it is a sliver of a side turned away,
    /// which no ray meets, with what was drawn.
    pub beside: usize,
    /// Depth, relative to the ray's.
    pub depth: Spread,
    /// Normals, in degrees.
    pub normals: Spread,
    /// Ambient occlusion before the blur against its twin on the same depth and normals: float32 arithmetic alone.
    /// Without the pixels that the twin calls ambiguous.
    pub arithmetic: Spread,
    /// How many those are.
    pub ambiguous: usize,
    /// Ambient occlusion before the blur against its twin on float64 depth and normals: formats, G-buffer and
    /// arithmetic. Without the pixels that are ambiguous there.
    pub whole: Spread,
    /// How many those are.
    pub whole_ambiguous: usize,
    /// What is shown, after the blur, against the same in float64 throughout; ambiguous pixels included.
    pub shown: Spread,
}

/// The view's images that are compared.
#[derive(Clone, Debug)]
pub struct Images {
    /// Depth as it was rendered; infinite on background.
    pub depth: Image<f32>,
    /// Normals as they were rendered.
    pub normals: Image<[f32; 3]>,
    /// Ambient occlusion as it was rendered, before the blur.
    pub raw: Image<f32>,
    /// The same after the blur.
    pub shown: Image<f32>,
    /// Depth and normals by ray casting in float64.
    pub seen: Image<Surface>,
    /// Ambient occlusion of those in float64, before the blur.
    pub exact: Image<f64>,
}

/// The scene as the rasteriser may have taken it: at each pixel that of the surfaces within its grid about the centre
/// which is nearest to the depth and normal drawn, or what was drawn where it is none of several. Second, at how many
/// pixels that is another than at the centre.
fn as_drawn(
    (mesh, camera, from): (&Mesh, &Camera, Normals),
    depth: &Image<f32>,
    normals: &Image<[f32; 3]>,
) -> (Image<Surface>, usize) {
    let size = (depth.width, depth.height);
    let at = |x: f64, y: f64| reference::gbuffer::gbuffer(mesh, camera, size, from, [x * SNAPPED, y * SNAPPED]);
    let mut seen = at(0.0, 0.0);
    // Where two surfaces meet they differ in their normals alone, and parallel ones in their depths.
    let off = |a: &Surface, z: f64, n: DVec3| match (a.depth.is_finite(), z.is_finite()) {
        (true, true) => 1e3 * (z / a.depth - 1.0).abs() + (a.normal - n).length(),
        (false, false) => 0.0,
        _ => f64::INFINITY,
    };
    let same = |a: &Surface, b: &Surface| off(a, b.depth, b.normal) < 1e-9;
    let (mut beside, mut several) = (vec![false; seen.texels.len()], vec![false; seen.texels.len()]);
    for [x, y] in [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]] {
        for (i, other) in at(x, y).texels.into_iter().enumerate() {
            let (z, n) = (f64::from(depth.texels[i]), Vec3::from(normals.texels[i]).as_dvec3());
            let known = &mut seen.texels[i];
            let another = !same(&other, known);
            several[i] |= another;
            // All of one plane are the same but for rounding.
            if another && off(&other, z, n) < off(known, z, n) {
                beside[i] = true;
                *known = other;
            }
        }
    }
    for (i, known) in seen.texels.iter_mut().enumerate().filter(|&(i, _)| several[i]) {
        let (z, n) = (depth.texels[i], Vec3::from(normals.texels[i]).as_dvec3());
        if z.is_finite() && known.depth.is_finite() && (known.normal - n).length() > SLIVER {
            beside[i] = true;
            *known = Surface { depth: z.into(), normal: n, ..*known };
        }
    }
    (seen, beside.into_iter().filter(|&b| b).count())
}

/// The angle between two directions, in degrees.
fn degrees(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b)).to_degrees()
}

/// A way to render and measure views with one choice of settings, which must have one sample a pixel, full resolution
/// and a radius in scene units.
pub struct Bench {
    pipeline: Pipeline,
    settings: Settings,
}

impl Bench {
    /// Compiles and allocates for images of `size`.
    ///
    /// # Errors
    /// As [`Pipeline::new`]; or settings of another kind.
    pub fn new(gl: &std::sync::Arc<glow::Context>, size: (u32, u32), settings: &Settings) -> Result<Bench, Error> {
        if settings.msaa != 1 || settings.ao_scale() != 1 {
            return Err(Error::Usage("precision is measured with one sample a pixel, at full resolution".into()));
        }
        let request = Request { raw: true, ..Request::default() };
        Ok(Bench { pipeline: Pipeline::new(gl, size, settings, request)?, settings: settings.clone() })
    }

    /// Renders a view and compares it, pass by pass.
    ///
    /// # Errors
    /// As [`Pipeline::render`].
    pub fn measure(&mut self, mesh: &Mesh, camera: &Camera) -> Result<(Precision, Images), Error> {
        let settings = &self.settings;
        self.pipeline.render(mesh, camera)?;
        let (depth, normals) = (self.pipeline.depth()?, self.pipeline.normals()?);
        let shown = self.pipeline.ao()?;
        let raw = self.pipeline.ao_raw().cloned().unwrap_or_else(|| shown.clone());
        let (seen, beside) = as_drawn((mesh, camera, settings.normals), &depth, &normals);

        let (tile, projection, near) = (rotation_tile(settings), camera.projection, camera.near);
        let own = reference::Inputs { depth: &depth, normals: &normals, tile: &tile, projection, near };
        let on_own = (reference::visibility(&own, settings)?, reference::ambiguous(&own, settings)?);
        let (z, n) = (seen.map(|s| s.depth), seen.map(|s| s.normal.to_array()));
        let unrounded = reference::Inputs { depth: &z, normals: &n, tile: &tile, projection, near };
        let on_exact = (reference::visibility(&unrounded, settings)?, reference::ambiguous(&unrounded, settings)?);
        let exact_shown = reference::blur::blur(&on_exact.0, &z, &[], settings)?;

        let covered: Vec<usize> = (0..depth.texels.len()).filter(|&i| depth.texels[i].is_finite()).collect();
        let both: Vec<usize> = covered.iter().copied().filter(|&i| z.texels[i].is_finite()).collect();
        let between = |got: &Image<f32>, expected: &Image<f64>, but: Option<&Image<bool>>| {
            let kept = covered.iter().filter(|&&i| but.is_none_or(|but| !but.texels[i]));
            Spread::of(kept.map(|&i| f64::from(got.texels[i]) - expected.texels[i]))
        };
        let count = |ambiguous: &Image<bool>| covered.iter().filter(|&&i| ambiguous.texels[i]).count();
        let precision = Precision {
            covered: covered.len(),
            beside,
            depth: Spread::of(both.iter().map(|&i| f64::from(depth.texels[i]) / z.texels[i] - 1.0)),
            normals: Spread::of(
                both.iter().map(|&i| degrees(Vec3::from(normals.texels[i]).as_dvec3(), seen.texels[i].normal)),
            ),
            arithmetic: between(&raw, &on_own.0, Some(&on_own.1)),
            ambiguous: count(&on_own.1),
            whole: between(&raw, &on_exact.0, Some(&on_exact.1)),
            whole_ambiguous: count(&on_exact.1),
            shown: between(&shown, &exact_shown, None),
        };
        Ok((precision, Images { depth, normals, raw, shown, seen, exact: on_exact.0 }))
    }
}

/// Ambient occlusion before the blur, by the twin, of the depth drawn with the normals as biased RGBA8 would hold them:
/// the format of last resort, which no setting asks for.
///
/// # Errors
/// A radius in percent.
pub fn biased(images: &Images, camera: &Camera, settings: &Settings) -> Result<Image<f32>, Error> {
    let stored = |c: f32| 2.0 * ((0.5 * c + 0.5) * 255.0).round() / 255.0 - 1.0;
    let normals = images.normals.map(|n| n.map(stored));
    let (tile, projection, near) = (rotation_tile(settings), camera.projection, camera.near);
    let inputs = reference::Inputs { depth: &images.depth, normals: &normals, tile: &tile, projection, near };
    Ok(reference::visibility(&inputs, settings)?.map(|a| a as f32))
}

/// The gaps that [`untold`] looks at, relative to the depth: four to each power of ten.
const GAPS: [f64; 2] = [1e-1, 1e-7];

/// How near one behind the other two surfaces at the depth z may lie, relative to z, for the farther one to be drawn
/// over the nearer at some pixel: the largest such gap, 0 where there is none. Before a plate that is tilted both ways
/// and drawn first, strips parallel to it stand at gaps that shrink from one to the next.
///
/// # Errors
/// As [`Pipeline::render`].
pub fn untold(
    gl: &std::sync::Arc<glow::Context>,
    (near, far): (f64, f64),
    z: f64,
    orthographic: bool,
) -> Result<f64, Error> {
    const STRIP: usize = 4;
    let strips = (4.0 * (GAPS[0] / GAPS[1]).log10()).round() as usize + 1;
    let (width, height) = (strips * STRIP, 16);
    let tan = 0.1;
    let half = DVec3::new(width as f64 / height as f64, 1.0, 0.0) * tan;
    let projection = if orthographic {
        Projection::Orthographic { half_width: half.x * z, half_height: half.y * z }
    } else {
        Projection::Perspective { tan_half_fov_x: half.x, tan_half_fov_y: half.y }
    };
    let axes = [DVec3::X, DVec3::Y, DVec3::NEG_Z];
    let camera = Camera { eye: DVec3::ZERO, right: axes[0], up: axes[1], forward: axes[2], projection, near, far };
    let gap = |strip: usize| GAPS[0] * 10f64.powf(-0.25 * strip as f64);
    // The point of the plate z = z0 + 0.1 x + 0.2 y at (x, y), in shares of the picture's half size, moved to the eye.
    let point = |x: f64, y: f64, gap: f64| {
        let (x, y) = (x * half.x, y * half.y);
        let p = match projection {
            Projection::Perspective { .. } => DVec3::new(x, y, 1.0) * z * (1.0 - gap) / (1.0 - 0.1 * x - 0.2 * y),
            Projection::Orthographic { .. } => z * DVec3::new(x, y, 1.0 - gap + 0.1 * x + 0.2 * y),
        };
        DVec3::new(p.x, p.y, -p.z)
    };
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    let mut plate = |left: f64, right: f64, gap: f64| {
        let start = positions.len() as u32;
        positions.extend([(left, -1.5), (right, -1.5), (right, 1.5), (left, 1.5)].map(|(x, y)| point(x, y, gap)));
        triangles.extend([[start, start + 1, start + 2], [start, start + 2, start + 3]]);
    };
    plate(-1.5, 1.5, 0.0);
    let at = |strip: usize| 2.0 * strip as f64 / strips as f64 - 1.0;
    (0..strips).for_each(|strip| plate(at(strip), at(strip + 1), gap(strip)));
    let mesh = Mesh::new(positions, triangles)?;

    let settings = Settings { msaa: 1, radius: Radius::Units(z), ..Settings::default() };
    let request = Request { gbuffer_only: true, ..Request::default() };
    let mut pipeline = Pipeline::new(gl, (width as u32, height as u32), &settings, request)?;
    pipeline.render(&mesh, &camera)?;
    let depth = pipeline.depth()?;
    let seen = reference::gbuffer::gbuffer(&mesh, &camera, (width, height), settings.normals, [0.0; 2]);
    let wrong = (0..depth.texels.len()).filter(|&i| {
        let off = f64::from(depth.texels[i]) / seen.texels[i].depth - 1.0;
        off.abs() > 0.5 * gap(i % width / STRIP)
    });
    Ok(wrong.map(|i| gap(i % width / STRIP)).fold(0.0, f64::max))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_is_of_the_sizes_and_its_most_leaves_a_thousandth_out() {
        let mut all = vec![-1.0; 998];
        all.extend([2.0, -7.0]);
        let spread = Spread::of(all);
        assert_eq!((spread.most, spread.max, spread.pixels), (2.0, 7.0, 1000));
        assert!((spread.rmse - ((998.0 + 4.0 + 49.0) / 1000.0f64).sqrt()).abs() < 1e-12);
        assert_eq!(Spread::of([]), Spread::default());
        assert_eq!(Spread::of([0.0, f64::NAN]).max, f64::INFINITY);
    }
}
