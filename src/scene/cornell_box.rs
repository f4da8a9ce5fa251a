//! The built-in Cornell box. Its mesh is read from the files in `models/`, which are compiled in. Its camera is the one
//! that was published with the measurements.

use super::{Lens, Mesh, Scene, View};
use crate::Error;
use glam::DVec3;
use std::path::Path;

const OBJ: &[u8] = include_bytes!("../../models/cornell_box.obj");
const MTL: &[u8] = include_bytes!("../../models/cornell_box.mtl");

/// The focal length and the film's height of the published camera, both in millimetres. They give a vertical field of
/// view of 39.3077 degrees.
const FOCAL_LENGTH: f64 = 35.0;
const FILM: f64 = 25.0;

pub(super) fn scene() -> Result<Scene, Error> {
    Ok(Scene {
        name: super::CORNELL_BOX.into(),
        mesh: mesh()?,
        view: View {
            eye: Some(DVec3::new(278.0, 273.0, -800.0)),
            target: Some(DVec3::new(278.0, 273.0, 0.0)),
            up: Some(DVec3::Y),
            lens: Some(Lens::FovY(2.0 * (FILM / (2.0 * FOCAL_LENGTH)).atan())),
            ..View::default()
        },
        // This is a little less than the height of the short block, 165. With this radius the creases darken, and the
        // middles of the walls stay light.
        radius: Some(150.0),
        notices: Vec::new(),
        cameras: Vec::new(),
        motions: Vec::new(),
        files: Vec::new(),
    })
}

fn mesh() -> Result<Mesh, Error> {
    Mesh::read_obj(OBJ, Path::new("models/cornell_box.obj"), |_| Ok(MTL)).map(|(mesh, _)| mesh)
}
