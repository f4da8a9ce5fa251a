//! Tells from which depth on a method exits early.

use super::{Exit, Length, Method, Settings};
use crate::Error;
use crate::projection::Projection;

impl Settings {
    /// Returns the depth beyond which the method exits early: at surfaces with a greater z, visibility is 1, because R
    /// covers too few texels there (6.2, Variable step size). The depth is in scene units, for a picture of `size`
    /// (width, height) pixels.
    ///
    /// R covers R_px = R H / (2 z tan(fov_y/2)) texels of ambient occlusion at the depth z, or the same with the width,
    /// if that is less. With [`Exit::Paper`] the method exits where R_px < N_s + 1, with [`Exit::Shorten`] where R_px <
    /// 2. An orthographic view has the same R_px everywhere, and so has a radius that is a share of the view: the
    /// result is 0 if the method exits at every pixel, and infinite if it exits at none. It is also infinite for a
    /// method that never exits early.
    ///
    /// # Errors
    /// [`Error::Usage`] if the radius is in percent.
    pub fn exit_depth(&self, projection: Projection, size: (u32, u32)) -> Result<f64, Error> {
        let needed = match self.exit_read() {
            None => return Ok(f64::INFINITY),
            Some(Exit::Paper) => f64::from(self.steps + 1),
            Some(Exit::Shorten) => 2.0,
        };
        let radius_px = self.radius_px(projection, size)?;
        let depth = radius_px.least(1.0) / needed;
        Ok(match radius_px.shrinks {
            true => depth,
            // As everywhere, R counts as what it is short of by less than a millionth.
            false if depth < 1.0 - 1e-6 => 0.0,
            false => f64::INFINITY,
        })
    }

    /// Returns how the method exits early; `None` if it never does.
    pub(crate) fn exit_read(&self) -> Option<Exit> {
        self.method.reads("exit").then_some(self.exit)
    }

    /// Returns the early exit for another method with which these settings are compared: the settings' own, if it is
    /// not the default of their method, and otherwise the default of the other method.
    pub(crate) fn exit_for(&self, method: Method) -> Exit {
        let default = |method| Settings::for_method(method).exit;
        if self.exit == default(self.method) { default(method) } else { self.exit }
    }

    /// Returns how many texels of ambient occlusion R covers in a picture of `size` (width, height) pixels.
    ///
    /// # Errors
    /// [`Error::Usage`] if the radius is in percent.
    pub(crate) fn radius_px(&self, projection: Projection, size: (u32, u32)) -> Result<RadiusPx, Error> {
        let [half_width, half_height] = projection.half_extents();
        let radius = self.radius_in(projection)?;
        let texel = f64::from(self.ao_scale()) * 2.0 / radius.at(1.0);
        Ok(RadiusPx {
            at_1: [f64::from(size.0) / (half_width * texel), f64::from(size.1) / (half_height * texel)],
            shrinks: projection.is_perspective() && matches!(radius, Length::Units(_)),
        })
    }
}

/// R in texels of ambient occlusion.
#[derive(Clone, Copy)]
pub(crate) struct RadiusPx {
    /// In x and in y, at the depth 1.
    at_1: [f64; 2],
    /// Whether it shrinks with depth: so does a length in scene units, in perspective.
    shrinks: bool,
}

impl RadiusPx {
    /// Returns R in texels in x and in y, at depth z.
    pub(crate) fn at(self, z: f64) -> [f64; 2] {
        self.at_1.map(|texels| if self.shrinks { texels / z } else { texels })
    }

    /// Returns the lesser of the two.
    pub(crate) fn least(self, z: f64) -> f64 {
        let [x, y] = self.at(z);
        x.min(y)
    }
}
