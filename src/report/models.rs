//! Opens the scenes of the papers: the built-in ones, and the models that a folder may hold.

use super::subject::Subject;
use crate::terminal::say;
use glam::{DVec3, dvec3};
use hbao::scene::{CORNELL_BOX, Lens, Mesh, NAVE, Scene, View};
use hbao::settings::Method;
use hbao::{Error, Settings};
use std::collections::HashMap;
use std::path::Path;
use std::rc::Rc;

/// A model that the folder of models may hold, with a camera that the folder's README proposes.
struct Model {
    key: &'static str,
    name: &'static str,
    file: &'static str,
    eye: DVec3,
    target: DVec3,
    fov_y: f64,
    /// R in scene units; `None` means the command's default.
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

/// The available scenes.
pub(super) struct Opened {
    pub(super) subjects: Vec<Subject>,
    /// A line for each model that is missing.
    pub(super) missing: Vec<String>,
}

/// Opens the built-in scenes, and the models that `folder` holds. Prints what was left out of the models.
///
/// # Errors
/// [`Error::Input`] if a model in the folder cannot be read.
pub(super) fn open(folder: Option<&Path>) -> Result<Opened, Error> {
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
        let path = folder.map(|folder| folder.join(model.file));
        let Some(path) = path.filter(|path| path.is_file()) else {
            let place = if folder.is_some() { "the folder of --models has none" } else { "no --models was given" };
            missing.push(format!("{}: left out, for want of {} ({place})", model.name, model.file));
            continue;
        };
        let mesh = match read.get(model.file) {
            Some(mesh) => mesh.clone(),
            None => {
                let Scene { mesh, notices, .. } = Scene::open(path)?;
                notices.iter().for_each(|notice| say(notice));
                let mesh = Rc::new(mesh);
                read.insert(model.file, mesh.clone());
                mesh
            }
        };
        subjects.push(model.subject(mesh));
    }
    Ok(Opened { subjects, missing })
}

impl Model {
    fn subject(&self, mesh: Rc<Mesh>) -> Subject {
        let list = |v: DVec3| format!("{},{},{}", v.x, v.y, v.z);
        let Model { eye, target, fov_y, .. } = *self;
        let mut arguments = format!("{} --eye {} --target {} --fov-y {fov_y}", self.file, list(eye), list(target));
        if let Some(radius) = self.radius {
            arguments += &format!(" --radius {radius}");
        }
        let default = Settings::for_scene(Method::default()).resolved(mesh.diagonal());
        Subject {
            name: self.name.into(),
            key: self.key,
            radius: self.radius.or(default.radius.units()).unwrap_or(1.0),
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
