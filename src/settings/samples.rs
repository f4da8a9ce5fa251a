//! Computes the number of samples that a method takes per pixel.

use super::Settings;
use super::knobs::Knob;
use super::method::Method;

impl Method {
    /// Returns the values of the settings that determine how many samples the method takes per pixel, in the order of
    /// [`MethodFacts::samples`](super::MethodFacts::samples). For 8 directions of 8 steps they are 8 and 8.
    #[must_use]
    pub fn counts(self, settings: &Settings) -> Vec<u32> {
        self.count_knobs().filter_map(|knob| knob.count(settings)).collect()
    }

    /// Returns the settings with these counts, given in the order of
    /// [`MethodFacts::samples`](super::MethodFacts::samples). A count out of range is left as it was.
    #[must_use]
    pub fn with_counts(self, mut settings: Settings, counts: &[u32]) -> Settings {
        for (knob, count) in self.count_knobs().zip(counts) {
            let _ = knob.set(&mut settings, &count.to_string());
        }
        settings
    }

    fn count_knobs(self) -> impl Iterator<Item = &'static Knob> {
        self.facts().samples.iter().filter_map(|name| Knob::named(name))
    }

    /// Whether the method has a pass that computes A. With `none`, A = 1 everywhere.
    #[must_use]
    pub fn computes(self) -> bool {
        !self.facts().samples.is_empty()
    }

    /// Returns the number of depth samples that the method takes at a pixel where it does not exit early; 0 for `none`.
    #[must_use]
    pub fn samples(self, settings: &Settings) -> u32 {
        if self.computes() { self.counts(settings).iter().product() } else { 0 }
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
            (Method::HbaoView, 15),
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

    #[test]
    fn counts_that_are_set_are_read_back() {
        for &method in Method::ALL {
            let wanted: Vec<u32> = method.counts(&Settings { ssao_samples: 8, ..Settings::for_method(method) });
            let wanted: Vec<u32> = wanted.iter().map(|count| if *count == 8 { 24 } else { count + 1 }).collect();
            let settings = method.with_counts(Settings::for_method(method), &wanted);
            assert_eq!(method.counts(&settings), wanted, "{}", method.name());
        }
    }

    #[test]
    fn a_method_that_computes_has_a_shader_and_a_blur_and_others_have_neither() {
        for method in Method::ALL {
            let facts = method.facts();
            assert_eq!(method.computes(), !facts.shader.is_empty(), "{}", method.name());
            assert_eq!(method.computes(), facts.blur != crate::settings::MethodBlur::None, "{}", method.name());
        }
    }
}
