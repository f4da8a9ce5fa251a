//! A scene that the report renders.

use hbao::scene::{Camera, Mesh, View};
use hbao::settings::{AoFormat, Method, NormalFormat, Radius};
use hbao::{Error, Settings};
use std::rc::Rc;

/// A scene, and the view in which it is rendered.
#[derive(Clone)]
pub(super) struct Subject {
    /// The name in tables and captions.
    pub(super) name: String,
    /// The name in file names.
    pub(super) key: &'static str,
    pub(super) mesh: Rc<Mesh>,
    pub(super) view: View,
    /// R in scene units.
    pub(super) radius: f64,
    /// The scene and the camera as arguments of the command line; `None` for scenes that only the report has.
    pub(super) arguments: Option<String>,
}

impl Subject {
    pub(super) fn camera(&self, size: (u32, u32)) -> Result<Camera, Error> {
        Ok(self.view.camera(&self.mesh, size.0, size.1)?.0)
    }

    /// Returns the method's default settings, with the radius of this scene.
    pub(super) fn settings(&self, method: Method) -> Settings {
        Settings { radius: Radius::Units(self.radius), ..Settings::for_method(method) }
    }

    /// Returns the same settings with one depth sample per pixel and without 8-bit targets, so that the remaining error
    /// is the method's own.
    pub(super) fn exact(&self, method: Method) -> Settings {
        Settings { msaa: 1, ao_format: AoFormat::R32f, normal_format: NormalFormat::Rgba16f, ..self.settings(method) }
    }
}
