//! Models, the built-in scenes, and cameras.
//!
//! World space is right-handed with y up, as in OBJ files. [`Camera::to_eye`] transforms it to the left-handed eye
//! space of the papers: x right, y up, z forward. Everything here is float64. Positions are rounded to float32 only
//! after they are relative to the camera, so that a scene far from the origin renders as it would at the origin.
#![doc = include_str!("files.md")]

mod camera;
mod cornell_box;
mod find;
mod foreign;
mod guard;
mod masonry;
mod mesh;
mod mtl;
mod nave;
mod notices;
mod obj;
mod path;
mod polygon;
mod skin;
mod statement;
mod texture;
mod view;

pub use crate::projection::{Extents, Projection};
pub use camera::Camera;
pub use mesh::{Group, Mesh};
pub use path::{CameraPath, Interpolation, Key, Turntable};
pub(crate) use texture::Map;
pub use view::{Lens, NOTHING_IN_VIEW, View};

use crate::Error;
use std::path::Path;

/// The name of the built-in Cornell box, the default scene.
pub const CORNELL_BOX: &str = "cornell-box";

/// The name of the built-in church interior.
pub const NAVE: &str = "nave";

/// A model, with the camera and the radius that suit it.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Scene {
    /// A built-in scene's name, or the model's file name without its extension.
    pub name: String,
    /// The triangles.
    pub mesh: Mesh,
    /// The scene's own camera. It is empty for a scene from a file. [`View::or`] lays a user's choices over it.
    pub view: View,
    /// The scene's own AO radius R in scene units. It is `None` for a scene from a file.
    pub radius: Option<f64>,
    /// What was left out of the model's files because it could not be read, in words: material files, colours, normals.
    /// There is one line for each kind of thing, which begins with the path of the file. See [`Mesh::load_obj`].
    pub notices: Vec<String>,
}

impl Scene {
    /// Opens a built-in scene by its name, `cornell-box` or `nave`, or reads an OBJ file by its path, which need not be
    /// UTF-8.
    ///
    /// # Errors
    /// [`Error::Input`] if there is no such file, or if it is not a model. See [`Mesh::load_obj`].
    pub fn open(name_or_path: impl AsRef<Path>) -> Result<Scene, Error> {
        let path = name_or_path.as_ref();
        match path.to_str() {
            Some(CORNELL_BOX) => cornell_box::scene(),
            Some(NAVE) => nave::scene(),
            _ => Scene::from_file(path),
        }
    }

    fn from_file(path: &Path) -> Result<Scene, Error> {
        match path.try_exists() {
            Ok(true) => {}
            _ => {
                let what = format!("no such file; give an OBJ file, or the built-in scene {CORNELL_BOX} or {NAVE}");
                return Err(Error::input(path, what));
            }
        }
        let name = path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        let (mesh, notices) = Mesh::load_obj(path)?;
        Ok(Scene { name, mesh, view: View::default(), radius: None, notices })
    }
}
