//! Provides what the report's pictures and figures are made from: the available scenes, ways to render them, and their
//! truth.

use super::models::{self, Opened};
use super::subject::Subject;
use glam::DVec3;
use hbao::image::Image;
use hbao::measure::decomposition::subset;
use hbao::measure::errors::{Comparison, Errors};
use hbao::reference::{self, truth::Truth, truth::Weight};
use hbao::scene::{CORNELL_BOX, Camera, NAVE, Projection};
use hbao::{Error, PassTime, Pipeline, Request, Settings, glow, rotation_tile};
use std::cell::{Cell, RefCell};
use std::collections::HashMap;
use std::path::Path;
use std::rc::Rc;
use std::sync::Arc;

/// The largest number of covered pixels over which errors are measured.
const SUBSET: usize = 60_000;

/// A view's depth and normals, read back: the inputs of the twins.
pub(super) struct Seen {
    pub(super) depth: Image<f32>,
    pub(super) normals: Image<[f32; 3]>,
    tile: Image<[f32; 3]>,
    pub(super) projection: Projection,
    near: f64,
}

impl Seen {
    pub(super) fn inputs(&self) -> reference::TwinInputs<'_> {
        reference::TwinInputs {
            depth: &self.depth,
            normals: &self.normals,
            tile: &self.tile,
            projection: self.projection,
            near: self.near,
        }
    }

    pub(super) fn covered(&self) -> Image<bool> {
        self.depth.map(f32::is_finite)
    }

    /// Returns how many texels a scene unit covers vertically at depth 1.
    pub(super) fn texels_at_depth_1(&self) -> f64 {
        let [_, half_height] = self.projection.half_extents();
        self.depth.height as f64 / (2.0 * half_height)
    }

    /// Returns the covered pixels whose surface point, in world space, is wanted. `camera` is the camera of the view.
    pub(super) fn pixels_where(&self, camera: &Camera, wanted: impl Fn(DVec3) -> bool) -> Vec<(usize, usize)> {
        let (width, height) = (self.depth.width, self.depth.height);
        let is_wanted = |&(x, y): &(usize, usize)| {
            let (u, v) = ((x as f64 + 0.5) / width as f64, (y as f64 + 0.5) / height as f64);
            let ((origin, r), z) = (camera.ray(u, v), f64::from(self.depth.at(x, y)));
            z.is_finite() && wanted(to_world(camera, origin + z * r))
        };
        (0..width * height).map(|i| (i % width, i / width)).filter(is_wanted).collect()
    }

    /// Chooses `count` covered pixels at random, the same in every run. If there are fewer, it returns all covered
    /// pixels.
    pub(super) fn some_covered(&self, count: usize) -> Vec<(usize, usize)> {
        let width = self.depth.width;
        subset(&self.covered(), count).into_iter().map(|i| (i % width, i / width)).collect()
    }
}

/// Converts a point from eye space to world space.
pub(super) fn to_world(camera: &Camera, p: DVec3) -> DVec3 {
    camera.eye + camera.direction_to_world(p)
}

/// The ray-traced ambient occlusion of some pixels of a view.
pub(super) struct Traced {
    /// True at the pixels that were traced.
    pub(super) mask: Image<bool>,
    pub(super) visibility: Image<f32>,
    /// The noise of the truth, as a root mean square.
    pub(super) noise: f64,
}

/// The noise of a truth, as a root mean square, and an error that was measured relative to this truth.
#[derive(Clone, Copy)]
pub(super) struct Noise {
    pub(super) noise: f64,
    pub(super) error: f64,
}

impl Noise {
    const NONE: Noise = Noise { noise: 0.0, error: 1.0 };
}

/// The available scenes, and a context in which they are rendered.
pub(super) struct Lab<'a> {
    pub(super) gl: &'a Arc<glow::Context>,
    pub(super) size: (u32, u32),
    pub(super) rays: u32,
    subjects: Vec<Subject>,
    /// A line for each model that is missing.
    pub(super) missing: Vec<String>,
    truths: RefCell<HashMap<String, Rc<Traced>>>,
    /// The error measured so far for which the noise of the truth is the largest share of the error.
    noisiest: Cell<Noise>,
}

impl<'a> Lab<'a> {
    /// Opens the built-in scenes, and those of the papers' models that the folder `models` holds.
    ///
    /// # Errors
    /// [`Error::Input`] if a model in the folder cannot be read.
    pub(super) fn open(
        gl: &'a Arc<glow::Context>,
        size: (u32, u32),
        rays: u32,
        models: Option<&Path>,
    ) -> Result<Lab<'a>, Error> {
        let Opened { subjects, missing } = models::open(models)?;
        Ok(Lab { gl, size, rays, subjects, missing, truths: RefCell::default(), noisiest: Cell::new(Noise::NONE) })
    }

    /// Returns the scene with this key, if it is available.
    pub(super) fn subject(&self, key: &str) -> Option<&Subject> {
        self.subjects.iter().find(|subject| subject.key == key)
    }

    /// Returns the first of these scenes that is available, or the built-in nave if none is.
    pub(super) fn first_of(&self, keys: &[&str]) -> &Subject {
        let found = keys.iter().find_map(|key| self.subject(key)).or_else(|| self.subject(NAVE));
        found.unwrap_or(&self.subjects[0])
    }

    /// Returns Sibenik if it is available, and the nave otherwise.
    pub(super) fn church(&self) -> &Subject {
        self.first_of(&["sibenik"])
    }

    /// Returns half the width and height of the report's pictures. Pictures that occur in large numbers have this size,
    /// and so do images of which every pixel is traced.
    pub(super) fn small(&self) -> (u32, u32) {
        (self.size.0.div_ceil(2), self.size.1.div_ceil(2))
    }

    /// Returns the available data sets of the papers: Sibenik (or the nave, if Sibenik is missing), the Dragon, and the
    /// Cornell box.
    pub(super) fn data_sets(&self) -> Vec<&Subject> {
        [Some(self.church()), self.subject("dragon"), self.subject(CORNELL_BOX)].into_iter().flatten().collect()
    }

    /// Renders a scene. Returns the pipeline, which holds the images, and the times of the passes if the request asks
    /// for them.
    pub(super) fn render(
        &self,
        subject: &Subject,
        size: (u32, u32),
        settings: &Settings,
        request: Request,
    ) -> Result<(Pipeline, Vec<PassTime>), Error> {
        let mut pipeline = Pipeline::new(self.gl, size, settings, request)?;
        let camera = subject.camera(size)?;
        let mut times = pipeline.render(&subject.mesh, &camera)?;
        if request.timings {
            // The first run compiles the shaders.
            times = pipeline.render(&subject.mesh, &camera)?;
        }
        Ok((pipeline, times))
    }

    /// Renders ambient occlusion at full size, and returns it after the blur.
    pub(super) fn ao(&self, subject: &Subject, settings: &Settings) -> Result<Image<f32>, Error> {
        self.render(subject, self.size, settings, Request::default())?.0.ao()
    }

    /// Renders a view's G-buffer, and returns its depth and normals.
    pub(super) fn see(&self, subject: &Subject, size: (u32, u32), settings: &Settings) -> Result<Seen, Error> {
        let request = Request { gbuffer_only: true, ..Request::default() };
        let (pipeline, _) = self.render(subject, size, &Settings { msaa: 1, ..settings.clone() }, request)?;
        let camera = subject.camera(size)?;
        Ok(Seen {
            depth: pipeline.depth()?,
            normals: pipeline.normals()?,
            tile: rotation_tile(settings),
            projection: camera.projection,
            near: camera.near,
        })
    }

    /// Returns the truth of a view at full size, traced with the radius and attenuation of the settings. The truth is
    /// traced at the first call and kept.
    pub(super) fn truth(&self, subject: &Subject, settings: &Settings) -> Result<Rc<Traced>, Error> {
        self.truth_weighted(subject, settings, Weight::Uniform)
    }

    /// Does the same as [`Lab::truth`], with directions that count differently. The pixels are the same.
    pub(super) fn truth_weighted(
        &self,
        subject: &Subject,
        settings: &Settings,
        weight: Weight,
    ) -> Result<Rc<Traced>, Error> {
        let key = format!("{} {:?} {:?} {weight:?}", subject.key, settings.radius, settings.attenuation);
        if let Some(known) = self.truths.borrow().get(&key) {
            return Ok(known.clone());
        }
        let (width, height) = (self.size.0 as usize, self.size.1 as usize);
        let seen = self.see(subject, self.size, settings)?;
        let pixels = subset(&seen.covered(), SUBSET);
        let camera = subject.camera(self.size)?;
        let truth = Truth::new(&subject.mesh, &camera, (width, height), settings, self.rays)?.weighted(weight);
        let traced = truth.trace(&pixels, |_| ());
        let mut mask = Image::filled(width, height, false);
        let mut visibility = Image::filled(width, height, 1.0);
        for ((&pixel, a), covered) in pixels.iter().zip(&traced.visibility).zip(&traced.covered) {
            mask.texels[pixel] = *covered;
            visibility.texels[pixel] = *a as f32;
        }
        let truth = Rc::new(Traced { mask, visibility, noise: traced.noise_rmse });
        self.truths.borrow_mut().insert(key, truth.clone());
        Ok(truth)
    }

    /// Returns the largest noise of all truths traced so far, as a root mean square.
    pub(super) fn noise(&self) -> f64 {
        self.truths.borrow().values().map(|traced| traced.noise).fold(0.0, f64::max)
    }

    /// The error measured so far for which the noise of the truth is the largest share of the error.
    pub(super) fn noisiest(&self) -> Noise {
        self.noisiest.get()
    }

    /// Measures the errors of an image relative to the truth with the radius and attenuation of the settings.
    pub(super) fn errors_of(
        &self,
        subject: &Subject,
        image: &Image<f32>,
        settings: &Settings,
    ) -> Result<Errors, Error> {
        let truth = self.truth(subject, settings)?;
        let errors = compare(image, &truth.visibility, &truth.mask)?;
        let Noise { noise, error } = self.noisiest.get();
        if truth.noise * error > noise * errors.rmse {
            self.noisiest.set(Noise { noise: truth.noise, error: errors.rmse });
        }
        Ok(errors)
    }

    /// Renders with these settings, and measures the errors of the image.
    pub(super) fn errors(&self, subject: &Subject, settings: &Settings) -> Result<Errors, Error> {
        self.errors_of(subject, &self.ao(subject, settings)?, settings)
    }
}

/// Measures the errors of one image relative to another over the pixels where the mask is true.
pub(super) fn compare(got: &Image<f32>, truth: &Image<f32>, mask: &Image<bool>) -> Result<Errors, Error> {
    Comparison::without_flip(got, truth)?.over(mask)?.ok_or_else(Errors::of_nothing)
}
