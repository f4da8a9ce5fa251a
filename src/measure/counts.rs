//! The sample counts and the width of the blur in the form in which tables show them, which is the same for all
//! methods.

use crate::settings::{Method, MethodBlur, Settings};

/// The width of the blur of Crysis in texels.
const CRYSIS_BLUR: u32 = 4;

/// Returns the number of directions around a pixel, of rays in each direction, and of steps on each ray. If a method
/// has a single count, its samples are reported as the steps of one ray in one direction. A method without a pass has
/// [0, 0, 0].
pub fn directions_rays_steps(method: Method, settings: &Settings) -> [u32; 3] {
    match method.counts(settings)[..] {
        [samples] => [1, 1, samples],
        [directions, steps] => [directions, 1, steps],
        [directions, rays, steps] => [directions, rays, steps],
        _ => [0, 0, 0],
    }
}

/// Returns the width in texels of the blur that these settings ask for, or 0 if there is no blur.
pub fn blur_width(settings: &Settings) -> u32 {
    match settings.method.facts().blur {
        MethodBlur::None => 0,
        MethodBlur::Crysis if settings.blur > 0 => CRYSIS_BLUR,
        MethodBlur::Crysis | MethodBlur::Gaussian => settings.blur,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_method_has_as_many_samples_as_its_counts_say() {
        let settings = Settings { directions: 3, steps: 5, rays: 7, ssao_samples: 24, ..Settings::default() };
        for &method in Method::ALL {
            let product: u32 = directions_rays_steps(method, &settings).iter().product();
            assert_eq!(product, method.samples(&settings), "{}", method.name());
        }
        assert_eq!(directions_rays_steps(Method::Hbao, &settings), [3, 1, 5]);
        assert_eq!(directions_rays_steps(Method::RayMarch, &settings), [3, 7, 5]);
        assert_eq!(directions_rays_steps(Method::Ssao, &settings), [1, 1, 24]);
    }

    #[test]
    fn a_blur_of_fixed_width_is_on_or_off() {
        let width = |method, blur| blur_width(&Settings { method, blur, ..Settings::default() });
        assert_eq!([width(Method::Hbao, 21), width(Method::Hbao, 0)], [21, 0]);
        assert_eq!([width(Method::Ssao, 21), width(Method::Ssao, 0)], [4, 0]);
        assert_eq!(width(Method::None, 9), 0);
    }
}
