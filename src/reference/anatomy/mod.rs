//! The intermediate results of the twins at single pixels, for the figures and claims about them, and for whoever wants
//! to see how a pixel got its value. The twins themselves tell them while they compute.

mod rays;
mod slice;

pub use rays::{Point, Ray, RayStep};
pub use slice::{Fate, Found, SampleAnatomy, Slice};

use super::inputs::TwinInputs;
use super::observer::Observer;
use super::sampling::{EXACT, MethodScene, Pixel};
use super::terms::Terms;
use crate::Error;
use crate::projection::Projection;
use crate::settings::{Length, Settings};
use crate::threads::on_all_cores;
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::ops::RangeInclusive;

/// The twin of one method on one view. Pixels are given as (x, y), with y up, and are texels of the result: at half
/// resolution there are half as many in x and y. On background, and outside the image, all results are `None`.
pub struct Anatomy<'a> {
    scene: MethodScene<'a>,
    method: Option<Terms>,
}

/// What a method knows of a pixel before it takes a sample.
#[allow(non_snake_case)]
#[derive(Clone, Debug, PartialEq)]
pub struct Start {
    /// The surface point that the pixel shows, in eye space.
    pub P: DVec3,
    /// The unit normal, turned towards the eye; zero if the image holds none.
    pub normal: DVec3,
    /// R projected to the image, in texels in x and y (Figure 6.2.11); 0 for methods that read no radius.
    pub radius_px: DVec2,
    /// The number of samples in each direction: N_s, or fewer if `exit` is `shorten`.
    pub steps: u32,
    /// The step between two samples before any rounding, in texels in x and y.
    pub step_px: DVec2,
    /// The texel of the rotation tile: (cos a, sin a, b), or for `ssao` a unit vector.
    pub jitter: [f64; 3],
    /// Whether A = 1 because the steps are too short (6.2, Variable step size).
    pub exits_early: bool,
}

impl<'a> Anatomy<'a> {
    /// Prepares the twin of the method that `settings` name.
    ///
    /// # Errors
    /// [`Error::Usage`] if the radius is in percent, or if the images have different sizes.
    pub fn new<F: Copy + Into<f64>>(inputs: &TwinInputs<'a, F>, settings: &'a Settings) -> Result<Anatomy<'a>, Error> {
        Ok(Anatomy { scene: MethodScene::new(inputs, settings)?, method: Terms::of(settings) })
    }

    /// Returns the surface point P that the pixel shows, in eye space.
    #[must_use]
    pub fn position(&self, pixel: (usize, usize)) -> Option<DVec3> {
        Some(self.pixel(pixel)?.P)
    }

    /// Returns the surface point of the pixel, and the lengths and angles that the method starts with.
    #[must_use]
    pub fn start(&self, pixel: (usize, usize)) -> Option<Start> {
        let pixel = self.pixel(pixel)?;
        Some(Start {
            P: pixel.P,
            normal: pixel.n.normalize_or_zero(),
            radius_px: self.scene.radius_in_texels(pixel.P.z),
            steps: pixel.steps,
            step_px: pixel.step_px,
            jitter: pixel.jitter,
            exits_early: pixel.exits_early(EXACT),
        })
    }

    /// Returns A before any blur: the same number as [`super::visibility`], in [0, 1].
    #[must_use]
    pub fn visibility(&self, pixel: (usize, usize)) -> Option<f64> {
        let pixel = self.pixel(pixel)?;
        Some(self.method.as_ref().map_or(1.0, |method| method.at(&self.scene, &pixel)))
    }

    /// Changes the twin so that it also counts samples beyond R, which 6.2 ignores. The attenuation must be W = 1,
    /// because the others are not meant for distances beyond R.
    #[must_use]
    pub fn with_outliers(mut self) -> Anatomy<'a> {
        self.scene.reach = Length::Units(f64::INFINITY);
        self
    }

    /// Changes the twin of `ssao` so that it has no depth range check (6.1): a surface occludes however far it is in
    /// front of P. Other methods do not change.
    #[must_use]
    pub fn without_range_check(mut self) -> Anatomy<'a> {
        self.scene.range_check = false;
        self
    }

    /// Changes the twin of `ssao` so that its offsets have the same length in texels as in a picture of another size,
    /// in texels of the result: `ssao` measures them in widths and heights of the picture. Other methods do not change.
    #[must_use]
    pub fn with_offsets_of(mut self, (width, height): (usize, usize)) -> Anatomy<'a> {
        self.scene.extent = DVec2::new(width as f64, height as f64);
        self
    }

    /// Returns direction k = 0..N_d with its samples, and what each adds to the occlusion. If S is the sum over the
    /// directions, A = clamp(1 - S strength / N_d, 0, 1), unless the method exits early at the pixel
    /// ([`Start::exits_early`]). It is `None` too for methods that have no horizon.
    #[must_use]
    pub fn slice(&self, pixel: (usize, usize), k: u32) -> Option<Slice> {
        let (scene, pixel) = (&self.scene, self.pixel(pixel)?);
        let direction = scene.direction(&pixel, k, EXACT);
        let samples = (1..=pixel.steps).map(|index| {
            let place = scene.place(&pixel, &direction, index, EXACT);
            let fate = if place.taken == DVec2::ZERO { Fate::OwnTexel } else { Fate::Background };
            SampleAnatomy { index, meant: place.meant, taken: place.taken, fate, found: None, contribution: 0.0 }
        });
        let attenuation = |r| scene.attenuation(&pixel, r);
        let mut told = slice::Collector { samples: samples.collect(), sin_t: None, attenuation: &attenuation };
        let occlusion = self.observe(&pixel, k, &mut told);
        Some(Slice {
            direction: scene.turned(&pixel, k),
            stride: direction.stride,
            sin_t: told.sin_t?,
            samples: told.samples,
            occlusion,
        })
    }

    /// Returns the rays of `ray-march` at azimuth j = 0..N_d about the normal, from the lowest zenith cosine to the
    /// highest. For other methods there are none.
    #[must_use]
    pub fn rays(&self, pixel: (usize, usize), j: u32) -> Option<Vec<Ray>> {
        let pixel = self.pixel(pixel)?;
        let mut told = self.collector(&pixel);
        self.observe(&pixel, j, &mut told);
        Some(told.rays)
    }

    /// Returns the points that `ssao` compares with the depth image around the surface point of the pixel, with the
    /// offsets and the depths that the settings say. For other methods there are none.
    #[must_use]
    pub fn points(&self, pixel: (usize, usize)) -> Option<Vec<Point>> {
        let pixel = self.pixel(pixel)?;
        let mut told = self.collector(&pixel);
        for index in 0..self.method.as_ref().map_or(0, |method| method.count) {
            self.observe(&pixel, index, &mut told);
        }
        Some(told.points)
    }

    /// Returns a slice through the depth image along a line through the pixel: surface points minus P, in eye space.
    /// `towards` is the line's direction in texels, of any length above 0. Along its larger component there is one
    /// point for each texel, from number `texels.start()` to number `texels.end()`; number 0 is P itself. Background
    /// and places outside the image are `None`.
    ///
    /// The line runs between the centres of two texels. If their depths differ by less than 8 times the width of a
    /// texel, the depth on the line is interpolated so that planes stay planes; otherwise it is that of the nearer
    /// centre.
    #[must_use]
    pub fn profile(
        &self,
        pixel: (usize, usize),
        towards: DVec2,
        texels: RangeInclusive<i32>,
    ) -> Option<Vec<Option<DVec3>>> {
        let (scene, pixel) = (&self.scene, self.pixel(pixel)?);
        let step = towards / towards.abs().max_element();
        let depth = |q: DVec2| {
            let inside = q == scene.clamped(q);
            if inside { scene.depth(q.x as usize, q.y as usize) } else { f64::INFINITY }
        };
        let of = |i: i32| {
            let offset = f64::from(i) * step;
            let nearer = depth(pixel.p + EXACT.round(offset));
            let [low, high] = [offset.floor(), offset.ceil()].map(|texel| depth(pixel.p + texel));
            let share = (offset - offset.floor()).max_element();
            let width =
                scene.pixel_extent().max_element() * if scene.projection.is_perspective() { nearer } else { 1.0 };
            // A comparison with NaN, the difference of two infinite depths, is false.
            let smooth = nearer.is_finite() && (high - low).abs() < 8.0 * width;
            let z = if !smooth {
                nearer
            } else if scene.projection.is_perspective() {
                // On a plane 1/z is linear in the image.
                1.0 / ((1.0 - share) / low + share / high)
            } else {
                (1.0 - share) * low + share * high
            };
            z.is_finite().then(|| scene.position(pixel.p + offset, z) - pixel.P)
        };
        Some(texels.map(of).collect())
    }

    /// Returns the tangent T of Eq. 6.2.11 in eye space, for an offset in texels. Its length has no meaning.
    #[must_use]
    pub fn tangent(&self, pixel: (usize, usize), offset: DVec2) -> Option<DVec3> {
        Some(self.scene.tangent(&self.pixel(pixel)?, offset))
    }

    /// Returns the same tangent as Figure 6.2.12 constructs it: from P to the point where the ray through the offset's
    /// texel meets the tangent plane. It is `None` also if the ray does not meet the plane in front of the eye.
    #[allow(non_snake_case)]
    #[must_use]
    pub fn tangent_by_ray(&self, pixel: (usize, usize), offset: DVec2) -> Option<DVec3> {
        let pixel = self.pixel(pixel)?;
        let (origin, ray) = match self.scene.projection {
            Projection::Perspective { .. } => (DVec3::ZERO, self.scene.ray(pixel.p + offset)),
            Projection::Orthographic { .. } => (self.scene.position(pixel.p + offset, 0.0), DVec3::Z),
        };
        let z = pixel.n.dot(pixel.P - origin) / pixel.n.dot(ray);
        (z > 0.0 && z.is_finite()).then(|| origin + z * ray - pixel.P)
    }

    /// Returns [`Anatomy::visibility`] of several pixels, computed on all cores.
    #[must_use]
    pub fn visibilities(&self, pixels: &[(usize, usize)]) -> Vec<Option<f64>> {
        on_all_cores(|| pixels.par_iter().map(|&pixel| self.visibility(pixel)).collect())
    }

    fn pixel(&self, (x, y): (usize, usize)) -> Option<Pixel> {
        let (width, height) = self.scene.size();
        (x < width && y < height).then(|| self.scene.pixel(x, y))?
    }

    /// Has the twin compute direction or sample k, and tell the observer. Returns the occlusion.
    fn observe(&self, pixel: &Pixel, k: u32, observer: &mut dyn Observer) -> f64 {
        self.method.as_ref().map_or(0.0, |method| (method.occlusion)(&self.scene, pixel, k, EXACT, observer))
    }

    fn collector<'b>(&'b self, pixel: &'b Pixel) -> rays::Collector<'b> {
        rays::Collector { scene: &self.scene, pixel, rays: Vec::new(), points: Vec::new() }
    }
}

#[cfg(test)]
mod tests {
    //! What the anatomy shows must be what the twins compute.

    use super::*;
    use crate::image::Image;
    use crate::projection::{Extents, Projection};
    use crate::reference::visibility;
    use crate::rotation_tile;
    use crate::settings::{Clamp, Exit, Grounding, Method, Radius, Snap, Toggle, Zenith};
    use rand_pcg::Pcg64Mcg;
    use rand_pcg::rand_core::Rng;

    const SIZE: (usize, usize) = (37, 29);

    /// A view of slanted slabs and rough ground, with holes through which the background is seen.
    struct View {
        depth: Image<f64>,
        normals: Image<[f64; 3]>,
        projection: Projection,
    }

    fn uniform(random: &mut Pcg64Mcg) -> f64 {
        (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn view(random: &mut Pcg64Mcg) -> View {
        let mut slab = || {
            let mut within = |low: f64, high: f64| low + (high - low) * uniform(random);
            (within(0.0, 37.0), within(0.0, 29.0), within(3.0, 12.0), within(2.0, 5.0), within(-0.05, 0.05))
        };
        let slabs: Vec<_> = (0..6).map(|_| slab()).collect();
        let depth = Image::from_fn(SIZE.0, SIZE.1, |x, y| {
            let over = |&&(left, bottom, size, _, _): &&(f64, f64, f64, f64, f64)| {
                (x as f64 - left).abs() < size && (y as f64 - bottom).abs() < size
            };
            let slant = |&(left, _, _, z, slant): &(f64, f64, f64, f64, f64)| z + slant * (x as f64 - left);
            let nearest = slabs.iter().filter(over).map(slant).fold(f64::INFINITY, f64::min);
            nearest + 0.02 * uniform(random)
        });
        let mut component = |low: f64| low + (1.0 - low) * uniform(random);
        let normals = Image::from_fn(SIZE.0, SIZE.1, |_, _| [component(-1.0), component(-1.0), -component(0.1)]);
        let projection = if random.next_u64().is_multiple_of(3) {
            Projection::Orthographic(Extents::centred(1.8, 1.4))
        } else {
            Projection::Perspective(Extents::centred(0.6, 0.5))
        };
        View { depth, normals, projection }
    }

    fn inputs<'a>(view: &'a View, tile: &'a Image<[f32; 3]>) -> TwinInputs<'a, f64> {
        TwinInputs { depth: &view.depth, normals: &view.normals, tile, projection: view.projection, near: 0.1 }
    }

    fn pixels(image: &Image<f64>) -> impl Iterator<Item = (usize, usize)> {
        let width = image.width;
        (0..image.texels.len()).map(move |i| (i % width, i / width))
    }

    #[test]
    fn the_contributions_of_all_samples_add_up_to_the_twins_visibility_to_the_bit() {
        let mut random = Pcg64Mcg::new(13);
        let (mut raised, mut open, mut seen) = (0, 0, Vec::new());
        for case in 0..48 {
            let view = view(&mut random);
            let one = |of: u32| of.is_multiple_of(2);
            let method = [Method::Hbao, Method::HbaoTalk, Method::HbaoView][case as usize / 3 % 3];
            let settings = Settings {
                radius: Radius::Units(0.2 + 2.0 * uniform(&mut random)),
                directions: 3 + case % 5,
                steps: 1 + case % 7,
                exit: if one(case / 2) { Exit::Paper } else { Exit::Shorten },
                grounding: if one(case / 4) { Grounding::Sample } else { Grounding::Direction },
                clamp: if one(case / 8) { Clamp::Position } else { Clamp::Depth },
                snap: [Snap::Step, Snap::Sample, Snap::None][case as usize % 3],
                half_res: case % 5 == 4,
                bias: if one(case / 16) { 0.0 } else { 0.2 },
                // Steps that are rounded at once need samples that are evenly spaced.
                spacing: if case.is_multiple_of(3) { 1.0 } else { 1.5 },
                zenith: if one(case / 3) { Zenith::View } else { Zenith::Axis },
                ..Settings::for_method(method)
            };
            let tile = rotation_tile(&settings);
            let inputs = inputs(&view, &tile);
            let twin = visibility(&inputs, &settings).unwrap();
            let anatomy = Anatomy::new(&inputs, &settings).unwrap();
            for pixel in pixels(&twin) {
                let a = twin.at(pixel.0, pixel.1);
                let Some(start) = anatomy.start(pixel) else {
                    assert!(a == 1.0 && anatomy.slice(pixel, 0).is_none());
                    continue;
                };
                assert_eq!(anatomy.visibility(pixel), Some(a));
                let mut sum = 0.0;
                for k in 0..settings.directions {
                    let slice = anatomy.slice(pixel, k).unwrap();
                    let contributions: f64 = slice.samples.iter().fold(0.0, |sum, sample| sum + sample.contribution);
                    assert_eq!(contributions, slice.occlusion, "{settings:?} {pixel:?} {k}");
                    assert_eq!(slice.samples.len(), start.steps as usize);
                    seen.extend(slice.samples.iter().map(|sample| sample.fate));
                    seen.sort_by_key(|fate| *fate as u32);
                    seen.dedup();
                    sum += contributions;
                }
                let mut summed = (1.0 - settings.strength / f64::from(settings.directions) * sum).clamp(0.0, 1.0);
                if start.exits_early {
                    open += 1;
                    summed = 1.0;
                }
                raised += usize::from(summed < 1.0);
                assert_eq!(summed, a, "{settings:?} {pixel:?}");
            }
        }
        assert!(raised > 5000 && open > 1000, "{raised} {open}");
        let all = [Fate::OwnTexel, Fate::Background, Fate::BeyondRadius, Fate::BelowHorizon, Fate::Raises];
        assert_eq!(seen, all, "some fates of samples do not occur here");
    }

    #[test]
    fn a_slice_tells_the_running_maximum_and_where_each_sample_was_taken() {
        let mut random = Pcg64Mcg::new(14);
        let view = view(&mut random);
        for method in [Method::Hbao, Method::HbaoTalk] {
            let settings =
                Settings { radius: Radius::Units(1.0), exit: Exit::Shorten, steps: 6, ..Settings::for_method(method) };
            let tile = rotation_tile(&settings);
            let inputs = inputs(&view, &tile);
            let anatomy = Anatomy::new(&inputs, &settings).unwrap();
            let mut compared = 0;
            for pixel in pixels(&view.depth) {
                for k in 0..settings.directions {
                    let (Some(start), Some(slice)) = (anatomy.start(pixel), anatomy.slice(pixel, k)) else { continue };
                    let mut horizon = slice.sin_t;
                    for sample in &slice.samples {
                        let texel = DVec2::new(pixel.0 as f64, pixel.1 as f64) + sample.taken;
                        let z = view.depth.at(texel.x as usize, texel.y as usize);
                        assert_eq!(sample.found.is_none(), z.is_infinite() || sample.taken == DVec2::ZERO);
                        let Some(found) = sample.found else { continue };
                        assert!((start.P.z + found.D.z - z).abs() < 1e-12);
                        assert!((found.sin_phi + found.D.z / found.D.length()).abs() < 1e-12);
                        assert_eq!(found.sin_before, horizon);
                        let [within, higher] = [found.D.length() <= 1.0, found.sin_phi > horizon];
                        let fate = match (within, higher) {
                            (false, _) => Fate::BeyondRadius,
                            (true, false) => Fate::BelowHorizon,
                            (true, true) => Fate::Raises,
                        };
                        assert_eq!(sample.fate, fate);
                        if fate == Fate::Raises {
                            horizon = found.sin_phi;
                            compared += 1;
                        } else {
                            assert_eq!(sample.contribution, 0.0);
                        }
                    }
                    assert_eq!(slice.sin_h(), horizon);
                }
            }
            assert!(compared > 1000, "{method:?}: {compared}");
        }
    }

    #[test]
    fn rays_and_points_add_up_to_their_twins_visibility() {
        let mut random = Pcg64Mcg::new(15);
        let view = view(&mut random);
        let radius = Radius::Units(1.0);
        let march = Settings { radius, ..Settings::for_method(Method::RayMarch) };
        let points = Settings { radius, ssao_curve: Some(Toggle::Off), ..Settings::for_method(Method::Ssao) };
        let flipped = Settings { ssao_normals: Toggle::On, ..points.clone() };
        for settings in [march, points, flipped] {
            let tile = rotation_tile(&settings);
            let inputs = inputs(&view, &tile);
            let twin = visibility(&inputs, &settings).unwrap();
            let anatomy = Anatomy::new(&inputs, &settings).unwrap();
            for pixel in pixels(&view.depth) {
                let Some(points) = anatomy.points(pixel) else { continue };
                let rays: Vec<_> = (0..settings.directions).flat_map(|j| anatomy.rays(pixel, j).unwrap()).collect();
                let sum = if settings.method == Method::RayMarch {
                    assert_eq!(rays.len(), (settings.directions * settings.rays) as usize);
                    for ray in &rays {
                        assert_eq!(ray.weight.is_some(), ray.steps.last().is_some_and(|step| step.stops));
                        // Each point lies on the ray from P to E.
                        assert!(ray.steps.iter().all(|s| s.on_ray.cross(ray.direction).length() < 1e-9));
                    }
                    1.0 - rays.iter().filter_map(|ray| ray.weight).sum::<f64>() / rays.len() as f64
                } else {
                    assert_eq!(points.len(), settings.ssao_samples as usize);
                    points.iter().map(|point| point.accessibility).sum::<f64>() / points.len() as f64
                };
                assert!((sum - twin.at(pixel.0, pixel.1)).abs() < 1e-12, "{:?} {pixel:?}", settings.method);
            }
        }
    }

    #[test]
    fn a_profile_passes_through_the_pixel_and_ends_at_the_images_border() {
        let view = view(&mut Pcg64Mcg::new(16));
        let settings = Settings { radius: Radius::Units(1.0), ..Settings::default() };
        let tile = rotation_tile(&settings);
        let inputs = inputs(&view, &tile);
        let anatomy = Anatomy::new(&inputs, &settings).unwrap();
        let pixel = pixels(&view.depth).find(|&(x, y)| x > 15 && y > 12 && view.depth.at(x, y).is_finite()).unwrap();
        let profile = anatomy.profile(pixel, DVec2::new(-2.0, 1.0), -40..=40).unwrap();
        assert_eq!((profile.len(), profile[40]), (81, Some(DVec3::ZERO)));
        assert!(profile[0].is_none() && profile[80].is_none());
        let p = anatomy.position(pixel).unwrap();
        let mut met = 0;
        // At every second texel the line meets a centre.
        for (i, point) in (-40..=40).zip(&profile).step_by(2) {
            if let Some(point) = point {
                let (x, y) = (pixel.0 as i32 - i, pixel.1 as i32 + i / 2);
                assert!((p.z + point.z - view.depth.at(x as usize, y as usize)).abs() < 1e-12);
                met += 1;
            }
        }
        assert!(met > 5);
        assert!(anatomy.position((SIZE.0, 0)).is_none());
    }

    #[test]
    fn only_methods_with_a_horizon_have_slices() {
        let (view, tile) = (view(&mut Pcg64Mcg::new(5)), rotation_tile(&Settings::default()));
        for &method in Method::ALL {
            let settings = Settings { radius: Radius::Units(2.0), ..Settings::for_method(method) };
            let anatomy = Anatomy::new(&inputs(&view, &tile), &settings).unwrap();
            let sliced = pixels(&view.depth).any(|pixel| (0..8).any(|k| anatomy.slice(pixel, k).is_some()));
            assert_eq!(sliced, matches!(method, Method::Hbao | Method::HbaoTalk | Method::HbaoView), "{method:?}");
        }
    }

    #[test]
    fn a_profile_of_a_plane_is_straight_in_every_direction() {
        let settings = Settings { radius: Radius::Units(1.0), ..Settings::default() };
        let tile = rotation_tile(&settings);
        let (n, pixel) = (DVec3::new(0.5, -0.4, -0.6), (18, 14));
        for projection in
            [Projection::Perspective(Extents::centred(0.6, 0.5)), Projection::Orthographic(Extents::centred(1.8, 1.4))]
        {
            let [half_x, half_y] = projection.half_extents();
            let depth = Image::from_fn(SIZE.0, SIZE.1, |x, y| {
                let of = |i: usize, count: usize, half: f64| ((2 * i + 1) as f64 / count as f64 - 1.0) * half;
                let (x, y) = (of(x, SIZE.0, half_x), of(y, SIZE.1, half_y));
                // The plane n.p = 4 n.z, which is 4 before the eye in the middle.
                if projection.is_perspective() {
                    4.0 * n.z / n.dot(DVec3::new(x, y, 1.0))
                } else {
                    4.0 - n.dot(DVec3::new(x, y, 0.0)) / n.z
                }
            });
            let view = View { depth, normals: Image::filled(SIZE.0, SIZE.1, n.to_array()), projection };
            let inputs = inputs(&view, &tile);
            let anatomy = Anatomy::new(&inputs, &settings).unwrap();
            for turn in 0..16 {
                let towards = DVec2::from_angle(f64::from(turn) * 0.39);
                let profile = anatomy.profile(pixel, towards, -9..=9).unwrap();
                assert!(profile.iter().all(|point| n.dot(point.unwrap()).abs() < 1e-12), "{projection:?} {towards}");
            }
        }
    }
}
