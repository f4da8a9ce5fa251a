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
mod gltf;
mod guard;
mod masonry;
mod mesh;
mod motion;
mod mtl;
mod nave;
mod notices;
mod obj;
mod open;
mod parts;
mod path;
mod ply;
mod polygon;
mod skin;
mod source;
mod statement;
mod stl;
mod texture;
mod view;

pub use crate::projection::{Extents, Projection};
pub use camera::Camera;
pub use mesh::{Group, Mesh};
pub use motion::CameraMotion;
pub use path::{CameraPath, Interpolation, Key, Turntable};
pub(crate) use texture::{Map, Skin, Texture, Wrap};
pub use view::{Lens, NOTHING_IN_VIEW, View};

use crate::Error;
use source::Contents;
use std::io::BufRead;
use std::path::{Path, PathBuf};

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
    /// The cameras of a glTF file, with their names.
    pub cameras: Vec<(String, View)>,
    /// How the cameras move that a glTF file animates, with their names.
    pub motions: Vec<(String, CameraMotion)>,
    /// The files from which the scene was read: the model first, then its materials, textures and buffers. One that the
    /// model names and that is not there is listed too, where it was looked for first. Empty for a built-in scene.
    pub files: Vec<PathBuf>,
    /// The scene's own AO radius R in scene units. It is `None` for a scene from a file.
    pub radius: Option<f64>,
    /// What was left out of the model's files because it could not be read, in words: material files, colours, normals.
    /// There is one line for each kind of thing, which begins with the path of the file. See [`Mesh::load_obj`].
    pub notices: Vec<String>,
}

impl Scene {
    /// Opens a built-in scene by its name, `cornell-box` or `nave`, or reads a file by its path, which need not be
    /// UTF-8. The file is an OBJ, PLY, STL or glTF file, or a GLB file. Its format is found by its content.
    ///
    /// # Errors
    /// [`Error::Input`] if there is no such file, or if it is not a model. See [`Mesh::load_obj`].
    pub fn open(name_or_path: impl AsRef<Path>) -> Result<Scene, Error> {
        Scene::open_with(name_or_path, &|_, _| {})
    }

    /// Opens a scene as [`Scene::open`] does. While the file is read, `progress` is called with the number of bytes
    /// that have been read, and with how many there are. If that is not known, as for a pipe, it is 0.
    ///
    /// # Errors
    /// The same as for [`Scene::open`].
    pub fn open_with(name_or_path: impl AsRef<Path>, progress: &dyn Fn(u64, u64)) -> Result<Scene, Error> {
        let path = name_or_path.as_ref();
        match path.to_str() {
            Some(CORNELL_BOX) => cornell_box::scene(),
            Some(NAVE) => nave::scene(),
            _ => Scene::from_file(path, progress),
        }
    }

    /// Returns the view of the camera that has this name in the scene's file.
    ///
    /// # Errors
    /// [`Error::Usage`] if there is no such camera. The message names those that there are.
    pub fn camera(&self, name: &str) -> Result<&View, Error> {
        if let Some((_, view)) = self.cameras.iter().find(|(known, _)| known == name) {
            return Ok(view);
        }
        let there_are = match &names(&self.cameras)[..] {
            "" => "this scene has no cameras; glTF files have them".into(),
            names => format!("there are {names}"),
        };
        Err(Error::Usage(format!("--camera '{}' is no camera of the scene: {there_are}", Error::shown(name))))
    }

    /// Returns the motion of the camera that has this name in the scene's file.
    ///
    /// # Errors
    /// [`Error::Usage`] if no animation moves it. The message names the cameras that are moved.
    pub fn motion(&self, name: &str) -> Result<&CameraMotion, Error> {
        if let Some((_, motion)) = self.motions.iter().find(|(known, _)| known == name) {
            return Ok(motion);
        }
        let moved = match &names(&self.motions)[..] {
            "" => String::new(),
            names => format!("; those that are moved are {names}"),
        };
        let what = format!("is not moved by an animation of the scene: give --path or --turntable{moved}");
        Err(Error::Usage(format!("--camera '{}' {what}", Error::shown(name))))
    }

    fn from_file(path: &Path, progress: &dyn Fn(u64, u64)) -> Result<Scene, Error> {
        match path.try_exists() {
            Ok(true) => {}
            _ => {
                let what = format!(
                    "no such file; give a model (OBJ, PLY, STL, glTF), or the built-in scene {CORNELL_BOX} or {NAVE}"
                );
                return Err(Error::input(path, what));
            }
        }
        open::read(path, progress).map(|contents| Scene::of(path, contents))
    }

    /// Reads a model from memory or from a stream, as [`Scene::open`] reads the file of this path. Files that the model
    /// names are looked for beside that path.
    ///
    /// # Errors
    /// The same as for [`Scene::open`].
    pub fn read(model: impl BufRead, path: &Path) -> Result<Scene, Error> {
        open::read_from(model, path, None).map(|contents| Scene::of(path, contents))
    }

    fn of(path: &Path, contents: Contents) -> Scene {
        let Contents { mesh, cameras, motions, files, notices } = contents;
        let files = [path.to_path_buf()].into_iter().chain(files).collect();
        let name = path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        Scene { name, mesh, view: View::default(), cameras, motions, files, radius: None, notices }
    }
}

/// Lists the names of cameras for a message, or at least the first of many.
fn names<T>(cameras: &[(String, T)]) -> String {
    let names: Vec<_> = cameras.iter().take(20).map(|(name, _)| format!("'{}'", Error::shown(name))).collect();
    match cameras.len() - names.len() {
        0 => names.join(", "),
        more => format!("{} and {more} more", names.join(", ")),
    }
}
