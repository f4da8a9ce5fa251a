//! How R fits a picture. Where it is too short for the method's steps, visibility is 1 whatever the scene is. Where it
//! is so long that even the first step leaves the picture, samples find the picture's border and nothing between.

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
    /// The share of these texels at which the first step leaves the picture on all four sides, so that every sample
    /// falls on its border. From 0 to 1; 0 if no texel holds a surface, and for a method that does not sample as the
    /// chapter's does, in `directions` and `steps` around the pixel.
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
        // R in texels, and the share of it at which the first sample lies.
        let step = match settings.exit_read() {
            Some(_) => {
                let first = (1.0 / f64::from(settings.steps + 1)).powf(settings.spacing_read());
                Some((settings.radius_px(projection, size)?, first))
            }
            None => None,
        };
        let extent = [depth.width, depth.height].map(|pixels| pixels as f64 / scale as f64);
        let [mut covered, mut exits, mut past] = [0_usize; 3];
        for (y, row) in depth.texels.chunks_exact(depth.width.max(1)).step_by(scale).enumerate() {
            for (x, &z) in row.iter().step_by(scale).enumerate().filter(|(_, z)| z.is_finite()) {
                let z = f64::from(z);
                let step = step.map_or([0.0; 2], |(radius, first)| radius.at(z).map(|radius| radius * first));
                let leaves = |axis: usize, position: f64| step[axis] > position.max(extent[axis] - position);
                covered += 1;
                exits += usize::from(z > exit);
                past += usize::from(leaves(0, x as f64 + 0.5) && leaves(1, y as f64 + 0.5));
            }
        }
        let share = |count: usize| count as f64 / covered.max(1) as f64;
        Ok(Reach { covered, exits: share(exits), past: share(past) })
    }
}
