//! Computes the number of samples that a method takes per pixel.

use super::Settings;
use super::knobs::KNOBS;
use super::method::Method;

impl Method {
    /// Returns the values of the settings that determine how many samples the method takes per pixel, in the order of
    /// [`MethodFacts::samples`]. For 8 directions of 8 steps they are 8 and 8.
    #[must_use]
    pub fn counts(self, settings: &Settings) -> Vec<u32> {
        let knobs = self.facts().samples.iter().filter_map(|name| KNOBS.iter().find(|knob| knob.name == *name));
        knobs.filter_map(|knob| knob.count(settings)).collect()
    }

    /// Returns the number of depth samples that the method takes at a pixel where it does not exit early; 0 for `none`.
    #[must_use]
    pub fn samples(self, settings: &Settings) -> u32 {
        let counts = self.counts(settings);
        if counts.is_empty() { 0 } else { counts.iter().product() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_the_product_of_the_counts() {
        let settings = Settings { directions: 3, steps: 5, rays: 7, ssao_samples: 24, ..Settings::default() };
        for (method, samples) in [
            (Method::Hbao, 15),
            (Method::HbaoTalk, 15),
            (Method::RayMarch, 105),
            (Method::Microsphere, 15),
            (Method::Crease, 15),
            (Method::Ssao, 24),
            (Method::None, 0),
        ] {
            assert_eq!(method.samples(&settings), samples, "{}", method.name());
        }
        assert_eq!(Method::RayMarch.counts(&settings), [3, 7, 5]);
    }
}
