//! Takes a pixel apart with the twin of its method, from the depth and the normals of the image on the screen.

use super::worker::Inspected;
use glam::{DVec2, DVec3, dvec2};
use hbao::Error;
use hbao::reference::TwinInputs;
use hbao::reference::anatomy::{Anatomy, Fate, SampleAnatomy, Slice, Start};
use hbao::rotation_tile;
use hbao::settings::{Method, Zenith};

/// How far the surface is drawn to both sides, in R.
const DRAWN: f64 = 1.6;
/// The largest number of texels to each side for which it is drawn.
const MOST_TEXELS: f64 = 4096.0;

/// Which pixel is taken apart, and what was found.
#[derive(Default)]
pub(super) struct Inspection {
    pub(super) is_on: bool,
    /// The pixel of the full image, y up; the middle one until one is chosen.
    pub(super) pixel: Option<(u32, u32)>,
    /// The direction that is shown.
    pub(super) direction: u32,
    /// Whether the image, the pixel or the direction has changed since it was taken apart.
    pub(super) stale: bool,
    /// The side that was taken apart.
    pub(super) side: usize,
    pub(super) found: Option<Result<Section, String>>,
}

/// What becomes of a sample, as its mark shows it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Kind {
    /// It occludes: it raises the horizon, stops a ray, or hides a point.
    Occludes,
    /// It lies below the horizon, or the ray or the point is open there.
    Open,
    /// It is further away than R, or the range check replaces it.
    Beyond,
    /// It reads the pixel's own texel, or background.
    Ignored,
}

/// A sample in the image.
pub(super) struct Mark {
    /// The way from the pixel in texels of ambient occlusion, y up.
    pub(super) at: DVec2,
    pub(super) kind: Kind,
    /// Whether it belongs to the direction that is shown.
    pub(super) is_shown: bool,
}

/// A slice, and where its points lie in it: the way from P across and up, in units of R.
pub(super) struct Cut {
    pub(super) slice: Slice,
    /// The surface along the slice, one list for each part of it without background; each point with one behind it, as
    /// seen from the eye.
    pub(super) surface: Vec<Vec<[DVec2; 2]>>,
    /// The samples that found a surface.
    pub(super) samples: Vec<(DVec2, SampleAnatomy)>,
}

/// A pixel that was taken apart.
pub(super) struct Section {
    /// The texel of ambient occlusion, y up, and how many there are in x and y.
    pub(super) texel: (usize, usize),
    pub(super) texels: (usize, usize),
    pub(super) start: Start,
    /// R at the pixel, in scene units.
    pub(super) radius: Option<f64>,
    /// A before the blur, of the twin and of the shader.
    pub(super) twin: f64,
    pub(super) shader: Option<f32>,
    /// The number of directions, or of azimuths for `ray-march`, or 1 for `ssao`; 0 if the method has none of these.
    pub(super) directions: u32,
    pub(super) direction: u32,
    pub(super) marks: Vec<Mark>,
    /// The slice of the direction that is shown, for a method with a horizon.
    pub(super) cut: Option<Cut>,
    /// What each direction adds.
    pub(super) occlusions: Vec<f64>,
    /// The number of rays of `ray-march`.
    pub(super) rays: usize,
    pub(super) strength: f64,
    pub(super) method: Method,
}

impl Kind {
    pub(super) fn of(fate: Fate) -> Kind {
        match fate {
            Fate::Raises => Kind::Occludes,
            Fate::BelowHorizon => Kind::Open,
            Fate::BeyondRadius => Kind::Beyond,
            Fate::OwnTexel | Fate::Background => Kind::Ignored,
        }
    }
}

impl Section {
    /// Takes a pixel of an image of `size` apart.
    pub(super) fn of(
        inspected: &Inspected,
        pixel: (u32, u32),
        size: (u32, u32),
        direction: u32,
    ) -> Result<Section, String> {
        let Inspected { depth, normals, camera, settings, .. } = inspected;
        let tile = rotation_tile(settings);
        let (projection, near) = (camera.projection, camera.near);
        let inputs = TwinInputs { depth, normals, tile: &tile, projection, near };
        let anatomy = Anatomy::new(&inputs, settings).map_err(|error: Error| error.to_string())?;
        let scale = if settings.half_res { 2 } else { 1 };
        let texels = (depth.width.div_ceil(scale), depth.height.div_ceil(scale));
        let at = |pixel: u32, size: u32, texels: usize| {
            let share = (f64::from(pixel) + 0.5) / f64::from(size.max(1));
            ((share * texels as f64) as usize).min(texels - 1)
        };
        let texel = (at(pixel.0, size.0, texels.0), at(pixel.1, size.1, texels.1));
        let (Some(start), Some(twin)) = (anatomy.start(texel), anatomy.visibility(texel)) else {
            return Err("This pixel shows background: there is nothing to take apart. Click a surface.".into());
        };
        let shader = inspected.raw.as_ref().filter(|raw| (raw.width, raw.height) == texels);
        let mut section = Section {
            texel,
            texels,
            radius: settings.radius_in(projection).ok().map(|radius| radius.at(start.P.z)),
            twin,
            shader: shader.map(|raw| raw.at(texel.0, texel.1)),
            directions: 0,
            direction: 0,
            marks: Vec::new(),
            cut: None,
            occlusions: Vec::new(),
            rays: 0,
            strength: settings.strength,
            method: settings.method,
            start,
        };
        let slices: Vec<Slice> = (0..settings.directions).map_while(|k| anatomy.slice(texel, k)).collect();
        if !slices.is_empty() {
            section.take_slices(&anatomy, slices, direction, settings.zenith);
        } else if settings.method == Method::RayMarch {
            section.take_rays(&anatomy, settings.directions, direction);
        } else {
            section.take_points(&anatomy, inspected);
        }
        Ok(section)
    }

    fn take_slices(&mut self, anatomy: &Anatomy, slices: Vec<Slice>, direction: u32, zenith: Zenith) {
        self.directions = slices.len() as u32;
        self.direction = direction % self.directions;
        self.occlusions = slices.iter().map(|slice| slice.occlusion).collect();
        for (k, slice) in slices.iter().enumerate() {
            self.marks.extend(slice.samples.iter().map(|sample| Mark {
                at: sample.taken,
                kind: Kind::of(sample.fate),
                is_shown: k == self.direction as usize,
            }));
        }
        let about_view = self.method == Method::HbaoView && zenith == Zenith::View;
        self.cut = slices.into_iter().nth(self.direction as usize).and_then(|slice| {
            let up = if about_view { -self.start.P.normalize_or(DVec3::Z) } else { DVec3::NEG_Z };
            Cut::of(anatomy, self.texel, &self.start, self.radius?, up, slice)
        });
    }

    fn take_rays(&mut self, anatomy: &Anatomy, azimuths: u32, direction: u32) {
        self.directions = azimuths;
        self.direction = direction % azimuths.max(1);
        for azimuth in 0..azimuths {
            let rays = anatomy.rays(self.texel, azimuth).unwrap_or_default();
            // An empty sum would be -0.
            self.occlusions.push(rays.iter().filter_map(|ray| ray.weight).fold(0.0, |sum, weight| sum + weight));
            self.rays += rays.len();
            for step in rays.iter().flat_map(|ray| &ray.steps) {
                let kind = match step.surface {
                    None => Kind::Ignored,
                    Some(_) if step.stops => Kind::Occludes,
                    Some(_) => Kind::Open,
                };
                self.marks.push(Mark { at: step.taken, kind, is_shown: azimuth == self.direction });
            }
        }
    }

    fn take_points(&mut self, anatomy: &Anatomy, inspected: &Inspected) {
        let texels = dvec2(self.texels.0 as f64, self.texels.1 as f64);
        let middle = dvec2(self.texel.0 as f64 + 0.5, self.texel.1 as f64 + 0.5);
        for point in anatomy.points(self.texel).unwrap_or_default() {
            let kind = match point.open {
                _ if point.range >= 0.5 => Kind::Beyond,
                true => Kind::Open,
                false => Kind::Occludes,
            };
            let at = inspected.camera.project(point.position) * texels - middle;
            self.occlusions.push(1.0 - point.accessibility);
            self.marks.push(Mark { at, kind, is_shown: true });
        }
        self.directions = u32::from(!self.marks.is_empty());
    }
}

impl Cut {
    #[allow(non_snake_case)]
    fn of(
        anatomy: &Anatomy,
        texel: (usize, usize),
        start: &Start,
        radius: f64,
        up: DVec3,
        slice: Slice,
    ) -> Option<Cut> {
        let across = |D: DVec3| D - D.dot(up) * up;
        let heading = across(anatomy.tangent(texel, slice.direction)?);
        let at = |D: DVec3| {
            let flat = across(D);
            dvec2(flat.length().copysign(flat.dot(heading)), D.dot(up)) / radius
        };
        let reach = (DRAWN * start.radius_px.max_element()).clamp(8.0, MOST_TEXELS) as i32;
        let profile = anatomy.profile(texel, slice.direction, -reach..=reach)?;
        let behind = |D: DVec3| at(D + 10.0 * radius * (start.P + D).normalize_or(DVec3::Z));
        let surface = profile.split(Option::is_none).filter(|part| part.len() > 1);
        let surface = surface.map(|part| part.iter().flatten().map(|&D| [at(D), behind(D)]).collect()).collect();
        let found = |sample: &SampleAnatomy| {
            let found = sample.found?;
            // The angle is the one that the method uses, also where the sample lies a little beside the slice.
            let level = (1.0 - found.sin_phi * found.sin_phi).max(0.0).sqrt();
            let way = dvec2(level.copysign(across(found.D).dot(heading)), found.sin_phi);
            Some((found.D.length() / radius * way, sample.clone()))
        };
        let samples = slice.samples.iter().filter_map(found).collect();
        Some(Cut { surface, samples, slice })
    }
}
