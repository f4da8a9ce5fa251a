//! The float64 twin of `glsl/shared/attenuation.glsl`: the attenuation W of ShaderX7 6.2.

use crate::settings::Attenuation;

/// Returns W(r) = 1 - r^2/R^2, 1 - r/R or 1, which is how much a sample at the distance r from P occludes. `r` and
/// `radius` are in the same unit.
pub(super) fn weight(attenuation: Attenuation, r: f64, radius: f64) -> f64 {
    match attenuation {
        Attenuation::Quadratic => 1.0 - (r / radius).powi(2),
        Attenuation::Linear => 1.0 - r / radius,
        Attenuation::None => 1.0,
    }
}

/// Returns the mean of W(q r) and W(r), with q from 0 to 1.
pub(super) fn mean_weight(attenuation: Attenuation, q: f64, r: f64, radius: f64) -> f64 {
    match attenuation {
        Attenuation::Quadratic => 1.0 - (r / radius).powi(2) * (1.0 + q * q) / 2.0,
        Attenuation::Linear => 1.0 - r / radius * (1.0 + q) / 2.0,
        Attenuation::None => 1.0,
    }
}
