//! A scene of the report, as it is rendered.

use hbao::scene::{Camera, Mesh, View};
use hbao::settings::{AoFormat, Method, NormalFormat, Radius};
use hbao::{Error, Settings};
use std::rc::Rc;

/// A scene, and where it is seen from.
#[derive(Clone)]
pub(super) struct Subject {
    /// Its name in tables and captions.
    pub(super) name: String,
    /// Its name in file names.
    pub(super) key: &'static str,
    pub(super) mesh: Rc<Mesh>,
    pub(super) view: View,
    /// R in scene units.
    pub(super) radius: f64,
    /// Scene and camera as the command line takes them; none for scenes that only the report has.
    pub(super) arguments: Option<String>,
}

impl Subject {
    pub(super) fn camera(&self, size: (u32, u32)) -> Result<Camera, Error> {
        Ok(self.view.camera(&self.mesh, size.0, size.1)?.0)
    }

    /// The method's defaults, with this scene's radius.
    pub(super) fn settings(&self, method: Method) -> Settings {
        Settings { radius: Radius::Units(self.radius), ..Settings::for_method(method) }
    }

    /// The same with one sample a pixel and without 8-bit targets, so that the remaining error is the method's own.
    pub(super) fn exact(&self, method: Method) -> Settings {
        Settings { msaa: 1, ao_format: AoFormat::R32f, normal_format: NormalFormat::Rgba16f, ..self.settings(method) }
    }
}
