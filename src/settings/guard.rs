//! Tells how much must be rendered around a part of a picture, so that ambient occlusion there is that of the picture.

use super::{MethodBlur, Settings, Snap, SsaoDepth, ssao_length};
use crate::Error;
use crate::projection::Projection;

impl Settings {
    /// Returns the guard band of a part of a picture, in pixels on the left and right, and below and above: how far
    /// from a pixel lie the pixels that its ambient occlusion is computed from, up to the picture's border.
    /// `projection` and `size` (width, height) are those of the picture, or of any part of it. `nearest` is the
    /// smallest depth of a surface in the part and in the [`Settings::blur_reach`] around it, or infinity if there is
    /// no surface. The near plane's depth is safe, and far too small.
    ///
    /// The band is R in pixels at that depth, and for `ssao` the largest offset of a sample, with what rounding to
    /// whole texels adds; and the blur's reach. See [`Projection::part`].
    ///
    /// # Errors
    /// [`Error::Usage`] for `ray-march`, whose rays may lead anywhere in the picture, and if the radius is in percent.
    pub fn guard_band(&self, projection: Projection, size: (u32, u32), nearest: f64) -> Result<[u32; 2], Error> {
        if self.method.facts().reads_near {
            return Err(Error::Usage(format!(
                "a part of a picture cannot be rendered by {}, whose rays may lead anywhere in the picture: use another \
                 method",
                self.method.name()
            )));
        }
        let scale = f64::from(self.ao_scale());
        let texels = if !self.method.computes() || nearest.is_infinite() {
            [0.0; 2]
        } else if self.method.reads("ssao-samples") {
            let longest = ssao_length(self.ssao_samples, self.ssao_samples);
            let [width, height] = projection.whole();
            let half_depth = if self.ssao_depth == SsaoDepth::Half { 1.0 } else { 0.0 };
            [f64::from(size.0) * width, f64::from(size.1) * height]
                .map(|side| longest * side / scale + 1.0 + half_depth)
        } else {
            // With `snap = step` every step and the jitter's offset are rounded by up to half a texel.
            let rounded = if self.snap == Snap::Step { f64::from(self.steps + 1) } else { 1.0 } / 2.0;
            self.radius_px(projection, size)?.at(nearest).map(|radius| radius + rounded)
        };
        // Texel i of half resolution stands for the pixel 2i. A number too large for u32 becomes the largest one.
        Ok(texels.map(|texels| ((texels.ceil() * scale) as u32).saturating_add(self.blur_reach())))
    }

    /// Returns how far from a pixel lie the pixels whose ambient occlusion the blur mixes into it, in pixels.
    #[must_use]
    pub fn blur_reach(&self) -> u32 {
        match self.method.facts().blur {
            _ if self.blur == 0 => 0,
            MethodBlur::None => 0,
            MethodBlur::Gaussian => self.blur / 2,
            // The 4x4 texels reach two texels to one side. A pixel beside its texel's own is one pixel farther.
            MethodBlur::Crysis => 3 * self.ao_scale(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::projection::Extents;
    use crate::settings::{Method, Radius};

    const SIZE: (u32, u32) = (400, 200);

    /// A pixel is 0.01 wide and 0.02 high at depth 1.
    fn view(perspective: bool) -> Projection {
        let extents = Extents::centred(2.0, 2.0);
        if perspective { Projection::Perspective(extents) } else { Projection::Orthographic(extents) }
    }

    #[test]
    fn the_band_is_the_radius_in_pixels_of_each_axis_and_the_blur() {
        let settings = Settings { radius: Radius::Units(1.0), blur: 9, snap: Snap::Sample, ..Settings::default() };
        assert_eq!(settings.guard_band(view(false), SIZE, 5.0).unwrap(), [101 + 4, 51 + 4]);
        assert_eq!(settings.guard_band(view(true), SIZE, 5.0).unwrap(), [21 + 4, 11 + 4]);
        assert_eq!(settings.guard_band(view(true), SIZE, f64::INFINITY).unwrap(), [4, 4]);
        let half = Settings { half_res: true, ..settings.clone() };
        assert_eq!(half.guard_band(view(false), SIZE, 5.0).unwrap(), [2 * 51 + 4, 2 * 26 + 4]);
        let stepped = Settings { snap: Snap::Step, blur: 0, ..settings.clone() };
        assert_eq!(stepped.guard_band(view(false), SIZE, 5.0).unwrap(), [105, 55]);
        let huge = Settings { radius: Radius::Units(1e12), ..settings };
        assert_eq!(huge.guard_band(view(false), SIZE, 5.0).unwrap(), [u32::MAX; 2]);
    }

    #[test]
    fn the_band_of_ssao_is_its_largest_offset_of_the_whole_picture() {
        let settings = Settings { ssao_samples: 8, ..Settings::for_method(Method::Ssao) };
        // The longest offset is 0.01 * 1.3^8 = 8.16 % of the width and height.
        let whole = settings.guard_band(view(true), SIZE, 5.0).unwrap();
        assert_eq!(whole, [34 + 3, 18 + 3]);
        let part = view(true).part(SIZE, (64, 8), (32, 16));
        assert_eq!(settings.guard_band(part, (32, 16), 5.0).unwrap(), whole);
    }

    #[test]
    fn a_method_whose_rays_lead_anywhere_has_no_band() {
        let settings = Settings { radius: Radius::Units(1.0), ..Settings::for_method(Method::RayMarch) };
        assert!(settings.guard_band(view(true), SIZE, 5.0).unwrap_err().to_string().contains("ray-march"));
        let none = Settings { blur: 9, ..Settings::for_method(Method::None) };
        assert_eq!(none.guard_band(view(true), SIZE, 5.0).unwrap(), [0, 0]);
    }
}
