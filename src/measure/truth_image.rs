//! The ray-traced truth as images. Renderings are compared with them.

use crate::image::Image;
use crate::reference::truth::Traced;

/// The ray-traced ambient occlusion of every pixel of a view.
#[derive(Clone, Debug)]
pub struct TruthImage {
    /// Visibility; 1 on background.
    pub visibility: Image<f32>,
    /// True at pixels whose ray meets a surface.
    pub covered: Image<bool>,
}

impl TruthImage {
    /// Makes the images from a truth that was traced at every pixel, in the order of the pixels.
    pub fn new(traced: &Traced, (width, height): (u32, u32)) -> TruthImage {
        let (width, height) = (width as usize, height as usize);
        TruthImage {
            visibility: Image { width, height, texels: traced.visibility.iter().map(|&a| a as f32).collect() },
            covered: Image { width, height, texels: traced.covered.clone() },
        }
    }
}
