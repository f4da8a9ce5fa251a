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
        let exits_early = Reach::exits_at(depth, projection, settings)?;
        // R in texels, and the share of it at which the first sample lies.
        let step = match settings.exit_read() {
            Some(_) => {
                let first = (1.0 / f64::from(settings.steps + 1)).powf(settings.spacing_read());
                Some((settings.radius_px(projection, size)?, first))
            }
            None => None,
        };
        let extent = [depth.width, depth.height].map(|pixels| pixels as f64 / scale as f64);
        let covered = exits_early.texels.iter().flatten().count();
        let exits = exits_early.texels.iter().flatten().filter(|&&exits| exits).count();
        let mut past = 0_usize;
        for (y, row) in depth.texels.chunks_exact(depth.width.max(1)).step_by(scale).enumerate() {
            for (x, &z) in row.iter().step_by(scale).enumerate().filter(|(_, z)| z.is_finite()) {
                let z = f64::from(z);
                let step = step.map_or([0.0; 2], |(radius, first)| radius.at(z).map(|radius| radius * first));
                let leaves = |axis: usize, position: f64| step[axis] > position.max(extent[axis] - position);
                past += usize::from(leaves(0, x as f64 + 0.5) && leaves(1, y as f64 + 0.5));
            }
        }
        let share = |count: usize| count as f64 / covered.max(1) as f64;
        Ok(Reach { covered, exits: share(exits), past: share(past) })
    }

    /// Returns at which texels of ambient occlusion the method exits early, so that visibility is 1; `None` on
    /// background. `depth` is the linear depth of the picture at full size, with +infinity for background.
    ///
    /// # Errors
    /// [`Error::Usage`] if the radius is in percent.
    pub fn exits_at(
        depth: &Image<f32>,
        projection: Projection,
        settings: &Settings,
    ) -> Result<Image<Option<bool>>, Error> {
        let exit = settings.exit_depth(projection, (depth.width as u32, depth.height as u32))?;
        let scale = settings.ao_scale() as usize;
        Ok(Image::from_fn(depth.width.div_ceil(scale), depth.height.div_ceil(scale), |x, y| {
            let z = f64::from(depth.at(scale * x, scale * y));
            // As everywhere, R counts as what it is short of by less than a millionth.
            z.is_finite().then_some(exit / z < 1.0 - 1e-6)
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::TwinInputs;
    use crate::reference::anatomy::Anatomy;
    use crate::reference::gbuffer::gbuffer;
    use crate::rotation_tile;
    use crate::scene::{NAVE, Scene};
    use crate::settings::{Exit, Method, Normals, Radius};

    #[test]
    fn the_texels_that_exit_early_are_those_of_the_twin() {
        let scene = Scene::open(NAVE).unwrap();
        let size = (61, 45);
        let (camera, _) = scene.view.camera(&scene.mesh, 61, 45).unwrap();
        let seen = gbuffer(&scene.mesh, &camera, size, Normals::Derivative, [0.0; 2]);
        let depth = seen.map(|surface| surface.depth as f32);
        let normals = seen.map(|surface| surface.normal.to_array().map(|x| x as f32));
        let mut some = 0;
        for (exit, half_res, radius) in [
            (Exit::Paper, false, 2.0),
            (Exit::Paper, true, 3.0),
            (Exit::Shorten, false, 0.4),
            (Exit::Paper, false, 9e9),
        ] {
            let settings = Settings { exit, half_res, radius: Radius::Units(radius), ..Settings::default() };
            let tile = rotation_tile(&settings);
            let (projection, near) = (camera.projection, camera.near);
            let inputs = TwinInputs { depth: &depth, normals: &normals, tile: &tile, projection, near };
            let anatomy = Anatomy::new(&inputs, &settings).unwrap();
            let exits = Reach::exits_at(&depth, projection, &settings).unwrap();
            let twin = Image::from_fn(exits.width, exits.height, |x, y| Some(anatomy.start((x, y))?.exits_early));
            assert_eq!(exits.texels, twin.texels);
            let count = exits.texels.iter().filter(|&&exits| exits == Some(true)).count();
            assert_eq!(count == 0, radius > 1e9, "{exit:?} {half_res}");
            some += usize::from(count < exits.texels.len());
        }
        assert_eq!(some, 4);
        // A method that never exits early has none.
        let settings = Settings { radius: Radius::Units(1e-3), ..Settings::for_method(Method::RayMarch) };
        let exits = Reach::exits_at(&depth, camera.projection, &settings).unwrap();
        assert!(exits.texels.iter().all(|&exits| exits != Some(true)));
    }
}
