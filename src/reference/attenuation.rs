//! The float64 twin of `glsl/shared/attenuation.glsl`.

use crate::settings::Attenuation;

/// W(r), the weight of an occluder at distance r of a radius R, both in the same units.
pub(super) fn weight(attenuation: Attenuation, r: f64, radius: f64) -> f64 {
    match attenuation {
        Attenuation::Quadratic => 1.0 - (r / radius).powi(2),
        Attenuation::Linear => 1.0 - r / radius,
        Attenuation::None => 1.0,
    }
}
