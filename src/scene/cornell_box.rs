//! The built-in Cornell box: the files of `models/`, compiled in, and the camera published with the measurements.

use super::{Lens, Mesh, Scene, View};
use crate::Error;
use glam::DVec3;
use std::path::Path;

const OBJ: &[u8] = include_bytes!("../../models/cornell_box.obj");
const MTL: &[u8] = include_bytes!("../../models/cornell_box.mtl");

/// The focal length and the film's height, both in millimetres, of the published camera: 39.3077 degrees.
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
        // As deep as the short block is high: the creases darken, the middle of the walls stays open.
        radius: Some(150.0),
    })
}

fn mesh() -> Result<Mesh, Error> {
    Mesh::read_obj(OBJ, Path::new("models/cornell_box.obj"), |_| Ok(MTL))
}
