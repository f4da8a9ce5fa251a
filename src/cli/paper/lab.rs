//! Where the report's pictures and figures come from: the scenes at hand, ways to render them, and their truth.

use super::tables::Tables;
use glam::{DVec3, dvec3};
use hbao::image::Image;
use hbao::measure::decomposition::subset;
use hbao::measure::errors::{Comparison, Errors};
use hbao::reference::{self, truth::Truth};
use hbao::scene::{CORNELL_BOX, Camera, Lens, Mesh, NAVE, Projection, Scene, View};
use hbao::settings::{AoFormat, Method, NormalFormat, Radius};
use hbao::{Error, PassTime, Pipeline, Request, Settings, glow, rotation_tile};
use std::cell::{Cell, RefCell};
use std::collections::HashMap;
use std::path::Path;
use std::rc::Rc;
use std::sync::Arc;

/// Error against truth is taken over as many covered pixels, or all where there are fewer.
const SUBSET: usize = 60_000;

/// A scene and where it is seen from.
#[derive(Clone)]
pub(super) struct Subject {
    /// As tables and captions name it.
    pub(super) name: String,
    /// As file names hold it.
    pub(super) key: &'static str,
    pub(super) mesh: Rc<Mesh>,
    pub(super) view: View,
    /// R, scene units.
    pub(super) radius: f64,
    /// Scene and camera as the command line takes them; none of scenes that only the report has.
    pub(super) arguments: Option<String>,
}

impl Subject {
    pub(super) fn camera(&self, size: (u32, u32)) -> Result<Camera, Error> {
        Ok(self.view.camera(&self.mesh, size.0, size.1)?.0)
    }

    /// The method's defaults with this scene's radius.
    pub(super) fn settings(&self, method: Method) -> Settings {
        Settings { radius: Radius::Units(self.radius), ..Settings::for_method(method) }
    }

    /// The same with one sample a pixel and no 8-bit targets: what is left is the method's own.
    pub(super) fn exact(&self, method: Method) -> Settings {
        Settings { msaa: 1, ao_format: AoFormat::R32f, normal_format: NormalFormat::Rgba16f, ..self.settings(method) }
    }
}

/// A model that `--models` may hold, and a camera that its README proposes.
struct Model {
    key: &'static str,
    name: &'static str,
    file: &'static str,
    eye: DVec3,
    target: DVec3,
    fov_y: f64,
    /// Scene units; none is the command's default.
    radius: Option<f64>,
}

const MODELS: [Model; 5] = [
    Model {
        key: "sibenik",
        name: "Sibenik",
        file: "sibenik.obj",
        eye: dvec3(-15.5, -10.5, 0.0),
        target: dvec3(10.0, -9.0, 0.0),
        fov_y: 60.0,
        radius: Some(1.0),
    },
    Model {
        key: "sibenik-oblique",
        name: "Sibenik, oblique",
        file: "sibenik.obj",
        eye: dvec3(-16.0, -12.0, -3.0),
        target: dvec3(8.0, -8.0, 2.0),
        fov_y: 60.0,
        radius: Some(1.0),
    },
    Model {
        key: "sibenik-choir",
        name: "Sibenik, from the choir",
        file: "sibenik.obj",
        eye: dvec3(14.0, -12.5, 0.0),
        target: dvec3(-10.0, -8.0, 0.0),
        fov_y: 60.0,
        radius: Some(1.0),
    },
    Model {
        key: "dragon",
        name: "Dragon",
        file: "dragon.obj",
        eye: dvec3(-5.0, 8.0, 14.5),
        target: dvec3(0.0, 4.5, 0.0),
        fov_y: 45.0,
        radius: None,
    },
    Model {
        key: "sponza",
        name: "Sponza",
        file: "sponza.obj",
        eye: dvec3(7.2, 1.6, -0.35),
        target: dvec3(-10.0, 3.2, -0.35),
        fov_y: 60.0,
        radius: Some(1.0),
    },
];

/// What a view shows, read back: what the twins take.
pub(super) struct Seen {
    pub(super) depth: Image<f32>,
    pub(super) normals: Image<[f32; 3]>,
    tile: Image<[f32; 3]>,
    projection: Projection,
    near: f64,
}

impl Seen {
    pub(super) fn inputs(&self) -> reference::Inputs<'_> {
        reference::Inputs {
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

    /// How many texels a scene unit covers at depth 1, up and down.
    pub(super) fn texels_at_depth_1(&self) -> f64 {
        let [_, half_height] = self.projection.half_extents();
        self.depth.height as f64 / (2.0 * half_height)
    }

    /// `count` covered pixels at random, from a fixed seed; all where there are fewer.
    pub(super) fn some_covered(&self, count: usize) -> Vec<(usize, usize)> {
        let width = self.depth.width;
        subset(&self.covered(), count).into_iter().map(|i| (i % width, i / width)).collect()
    }
}

/// Ray-traced ambient occlusion of some pixels of a view.
pub(super) struct Traced {
    /// Where it is known.
    pub(super) mask: Image<bool>,
    pub(super) visibility: Image<f32>,
    pub(super) noise: f64,
}

/// The scenes at hand and a context to render them in.
pub(super) struct Lab<'a> {
    pub(super) gl: &'a Arc<glow::Context>,
    pub(super) size: (u32, u32),
    pub(super) rays: u32,
    subjects: Vec<Subject>,
    /// A line for each model that is not there.
    pub(super) missing: Vec<String>,
    truths: RefCell<HashMap<String, Rc<Traced>>>,
    /// The noise of a truth and an error against it, RMS, of which the noise is the largest share so far.
    noisiest: Cell<[f64; 2]>,
}

impl<'a> Lab<'a> {
    /// Opens the built-in scenes, and what `models` holds.
    ///
    /// # Errors
    /// A model that is there and cannot be read.
    pub(super) fn open(
        gl: &'a Arc<glow::Context>,
        size: (u32, u32),
        rays: u32,
        models: Option<&Path>,
    ) -> Result<Lab<'a>, Error> {
        let mut subjects = Vec::new();
        for (key, name) in [(CORNELL_BOX, "Cornell box"), (NAVE, "nave")] {
            let Scene { mesh, view, radius, .. } = Scene::open(key)?;
            let radius = radius.unwrap_or(mesh.diagonal() / 20.0);
            let (mesh, name) = (Rc::new(mesh), name.into());
            subjects.push(Subject { name, key, mesh, view, radius, arguments: Some(key.into()) });
        }
        let mut missing = Vec::new();
        let mut read: HashMap<&str, Rc<Mesh>> = HashMap::new();
        for model in &MODELS {
            let path = models.map(|folder| folder.join(model.file));
            let Some(path) = path.filter(|path| path.is_file()) else {
                let place = models.map_or("no --models was given".into(), |m| format!("{} holds none", m.display()));
                missing.push(format!("{}: left out, for want of {} ({place})", model.name, model.file));
                continue;
            };
            let mesh = match read.get(model.file) {
                Some(mesh) => mesh.clone(),
                None => {
                    let mesh = Rc::new(Scene::open(&path.to_string_lossy())?.mesh);
                    read.insert(model.file, mesh.clone());
                    mesh
                }
            };
            subjects.push(model.subject(mesh));
        }
        Ok(Lab { gl, size, rays, subjects, missing, truths: RefCell::default(), noisiest: Cell::new([0.0, 1.0]) })
    }

    /// The scene of this key, where it is at hand.
    pub(super) fn subject(&self, key: &str) -> Option<&Subject> {
        self.subjects.iter().find(|subject| subject.key == key)
    }

    /// The first of these that is at hand; the built-in nave where none is.
    pub(super) fn first_of(&self, keys: &[&str]) -> &Subject {
        let found = keys.iter().find_map(|key| self.subject(key)).or_else(|| self.subject(NAVE));
        found.unwrap_or(&self.subjects[0])
    }

    /// Sibenik, or the nave in its place.
    pub(super) fn church(&self) -> &Subject {
        self.first_of(&["sibenik"])
    }

    /// Half the width and height: of pictures of which there are many, and of images that are traced whole.
    pub(super) fn small(&self) -> (u32, u32) {
        (self.size.0.div_ceil(2), self.size.1.div_ceil(2))
    }

    /// The papers' data sets, as far as they are at hand: Sibenik, in whose place the nave stands in, the Dragon, and the
    /// Cornell box.
    pub(super) fn data_sets(&self) -> Vec<&Subject> {
        [Some(self.church()), self.subject("dragon"), self.subject(CORNELL_BOX)].into_iter().flatten().collect()
    }

    /// Renders, and returns what holds the images, and what the passes took where that was asked for.
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

    /// Ambient occlusion after the blur, at full size.
    pub(super) fn ao(&self, subject: &Subject, settings: &Settings) -> Result<Image<f32>, Error> {
        self.render(subject, self.size, settings, Request::default())?.0.ao()
    }

    /// What a view shows.
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

    /// The truth of a view at full size, for the settings' radius and attenuation.
    pub(super) fn truth(&self, subject: &Subject, settings: &Settings) -> Result<Rc<Traced>, Error> {
        let key = format!("{} {:?} {:?}", subject.key, settings.radius, settings.attenuation);
        if let Some(known) = self.truths.borrow().get(&key) {
            return Ok(known.clone());
        }
        let (width, height) = (self.size.0 as usize, self.size.1 as usize);
        let seen = self.see(subject, self.size, settings)?;
        let pixels = subset(&seen.covered(), SUBSET);
        let camera = subject.camera(self.size)?;
        let traced = Truth::new(&subject.mesh, &camera, (width, height), settings, self.rays)?.trace(&pixels, |_| ());
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

    /// The largest noise of the truths asked for so far, RMS.
    pub(super) fn noise(&self) -> f64 {
        self.truths.borrow().values().map(|traced| traced.noise).fold(0.0, f64::max)
    }

    /// What there is to say where the truth's noise is more than a fifth of an error quoted.
    pub(super) fn noise_is_much(&self, tables: &Tables) -> Option<String> {
        let swept = tables.trades.iter().flat_map(|swept| swept.rows.iter().map(|row| [swept.noise, row.errors.rmse]));
        let all = swept.chain([self.noisiest.get()]);
        let [noise, error] = all.max_by(|a, b| (a[0] / a[1]).total_cmp(&(b[0] / b[1])))?;
        (noise > error / 5.0).then(|| {
            format!(
                "The truth's noise of {noise:.4} is more than a fifth of an error against it, {error:.4}: give more --truth-rays"
            )
        })
    }

    /// Errors of an image against the truth of the settings' radius and attenuation.
    pub(super) fn errors_of(
        &self,
        subject: &Subject,
        image: &Image<f32>,
        settings: &Settings,
    ) -> Result<Errors, Error> {
        let truth = self.truth(subject, settings)?;
        let errors = compare(image, &truth.visibility, &truth.mask)?;
        let [noise, error] = self.noisiest.get();
        if truth.noise * error > noise * errors.rmse {
            self.noisiest.set([truth.noise, errors.rmse]);
        }
        Ok(errors)
    }

    /// Errors of what these settings render.
    pub(super) fn errors(&self, subject: &Subject, settings: &Settings) -> Result<Errors, Error> {
        self.errors_of(subject, &self.ao(subject, settings)?, settings)
    }
}

impl Model {
    fn subject(&self, mesh: Rc<Mesh>) -> Subject {
        let list = |v: DVec3| format!("{},{},{}", v.x, v.y, v.z);
        let Model { eye, target, fov_y, .. } = *self;
        let mut arguments = format!("{} --eye {} --target {} --fov-y {fov_y}", self.file, list(eye), list(target));
        if let Some(radius) = self.radius {
            arguments += &format!(" --radius {radius}");
        }
        let default = Settings::default().resolved(mesh.diagonal()).radius_units();
        Subject {
            name: self.name.into(),
            key: self.key,
            radius: self.radius.or(default.ok()).unwrap_or(1.0),
            mesh,
            view: View {
                eye: Some(eye),
                target: Some(target),
                lens: Some(Lens::FovY(fov_y.to_radians())),
                ..View::default()
            },
            arguments: Some(arguments),
        }
    }
}

/// How far an image is from another where the mask is true.
pub(super) fn compare(got: &Image<f32>, truth: &Image<f32>, mask: &Image<bool>) -> Result<Errors, Error> {
    Comparison::without_flip(got, truth)?.over(mask)?.ok_or_else(Errors::of_nothing)
}
