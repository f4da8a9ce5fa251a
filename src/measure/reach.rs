//! How R fits a picture. If it is too short for the method's steps, or longer than the picture, visibility is 1
//! whatever the scene is.

use crate::Error;
use crate::image::Image;
use crate::projection::Projection;
use crate::settings::Settings;

/// The largest share of texels at which a method may exit early if its image is to count as its result. Beyond it,
/// [`super::trade`] does not mark a combination as on the Pareto front, and [`super::tune`] does not pick it.
pub const MOST_EXITS: f64 = 0.5;

/// How R fits the steps of a method and the size of a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reach {
    /// The number of texels of ambient occlusion that hold a surface.
    pub covered: usize,
    /// The share of these texels at which the method exits early, so that visibility is 1: they lie beyond
    /// [`Settings::exit_depth`]. From 0 to 1; 0 if no texel holds a surface.
    pub exits: f64,
    /// The share of these texels at which a step is longer than the picture, so that every sample falls on its border.
    /// From 0 to 1; 0 if no texel holds a surface, and for a method without steps.
    pub past: f64,
}

impl Reach {
    /// Finds how R fits. `depth` is the linear depth of the picture at full size, with +infinity for background.
    ///
    /// # Errors
    /// [`Error::Usage`] if the radius is in percent.
    pub fn of(depth: &Image<f32>, projection: Projection, settings: &Settings) -> Result<Reach, Error> {
        let size = (depth.width as u32, depth.height as u32);
        let scale = settings.ao_scale() as usize;
        let exit = settings.exit_depth(projection, size)?;
        // R over the length of N_s + 1 steps that are as long as the picture.
        let past = if settings.method.reads("steps") {
            let picture = f64::from(size.0.max(size.1)) / scale as f64;
            settings.radius_in_texels(projection, size)? / f64::from(settings.steps + 1) / picture
        } else {
            0.0
        };
        let mut counts = [0_u32; 3];
        for row in depth.texels.chunks_exact(depth.width.max(1)).step_by(scale) {
            for &z in row.iter().step_by(scale).filter(|z| z.is_finite()) {
                let z = f64::from(z);
                let past = past > if projection.is_perspective() { z } else { 1.0 };
                counts[0] += 1;
                counts[1] += u32::from(z > exit);
                counts[2] += u32::from(past);
            }
        }
        let [covered, exits, past] = counts.map(f64::from);
        let share = |count: f64| count / covered.max(1.0);
        Ok(Reach { covered: counts[0] as usize, exits: share(exits), past: share(past) })
    }
}
