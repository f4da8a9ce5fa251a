//! The combinations of settings that a search tries, and what is known about them before they are rendered.

use super::requirements::edge_kind;
use crate::measure::trade;
use crate::settings::{
    AoFormat, DepthFormat, Edges, Jitter, KNOBS, Kind, Knob, Method, NormalFormat, Settings, SsaoDepth, Toggle,
};

/// The numbers of directions and steps in the sweep, in addition to those of `trade`. The variations of the leaders try
/// the numbers between.
const DIRECTIONS: [u32; 4] = [2, 4, 8, 16];
const STEPS: [u32; 5] = [2, 4, 8, 16, 32];
/// The numbers of directions, rays and steps in the sweep if the method is pinned and reads rays.
const WITH_RAYS: ([u32; 4], [u32; 4], [u32; 3]) = ([2, 4, 8, 16], [1, 2, 4, 8], [4, 8, 16]);

/// The numbers of directions, steps and rays that are tried. Numbers that are nearer to each other hardly differ in
/// their results.
const COUNTS: [u32; 20] = [1, 2, 3, 4, 5, 6, 8, 10, 12, 14, 16, 20, 24, 32, 40, 48, 64, 96, 128, 256];
/// The widths of the blur that are tried; 0 is off.
const BLURS: [u32; 6] = [0, 5, 9, 13, 21, 31];

/// The combinations that may be searched. They agree with `base` in every pinned setting, and in the settings that
/// determine how the user's picture should look: the radius, attenuation, bias and number of depth samples.
pub(super) struct Space {
    pub(super) base: Settings,
    /// The settings that the search leaves as they are in `base`.
    pub(super) pinned: Vec<&'static Knob>,
    /// Whether any pixel is an edge, by the index that [`edge_kind`] returns.
    pub(super) edges: [bool; 3],
}

impl Space {
    pub(super) fn pins(&self, knob: &str) -> bool {
        self.pinned.iter().any(|pinned| pinned.name == knob)
    }

    /// Changes `settings` to a combination that may be searched: with the pinned settings of `base`, with those that
    /// determine the user's picture, and without a supersampled blur if no pixel is an edge. `None` if another method
    /// is pinned, if the image would stay at half size, or if the pinned settings exclude each other with this method.
    pub(super) fn admit(&self, settings: &Settings) -> Option<Settings> {
        let base = &self.base;
        if self.pins("method") && settings.method != base.method {
            return None;
        }
        let mut admitted = Settings {
            radius: base.radius,
            attenuation: base.attenuation,
            bias: base.bias,
            msaa: base.msaa,
            ..settings.clone()
        };
        if !self.edges[edge_kind(settings.method)] {
            admitted.edges = Edges::Off;
        }
        for knob in &self.pinned {
            knob.set(&mut admitted, &knob.text(base)).ok()?;
        }
        let whole = admitted.ao_scale() == 1 || admitted.blur > 0;
        (whole && admitted.check_steps().is_ok()).then_some(admitted)
    }

    /// Returns the combinations that the search begins with: the sweep of `trade`, a finer sweep of the pinned method
    /// (of `hbao` if none is pinned), and a finer sweep of `ssao`.
    pub(super) fn sweep(&self) -> Vec<Settings> {
        let method = if self.pins("method") { self.base.method } else { Method::Hbao };
        let of = Settings::for_method(method);
        let mut all = trade::sweep(&self.base);
        if method.reads("rays") {
            for (directions, rays) in WITH_RAYS.0.into_iter().flat_map(|d| WITH_RAYS.1.map(|r| (d, r))) {
                let with = |steps| Settings { directions, rays, steps, blur: 0, ..of.clone() };
                all.extend(WITH_RAYS.2.map(with));
            }
        } else if method.reads("directions") {
            for (directions, steps) in DIRECTIONS.into_iter().flat_map(|d| STEPS.map(|s| (d, s))) {
                for (blur, half_res) in [(0, false), (9, false), (9, true)] {
                    all.push(Settings { directions, steps, blur, half_res, ..of.clone() });
                }
            }
        }
        for ssao_samples in choices("ssao-samples") {
            for (ssao_normals, curve) in [Toggle::Off, Toggle::On].map(|n| [(n, Toggle::On), (n, Toggle::Off)]).concat()
            {
                let of = Settings::for_method(Method::Ssao);
                all.push(Settings { ssao_samples, ssao_normals, ssao_curve: Some(curve), ..of });
            }
        }
        all
    }

    /// Returns the combinations that differ from this one in one setting, or that have more directions and fewer steps,
    /// or the reverse. If `wide` is true, they include those with a wider format.
    pub(super) fn around(&self, settings: &Settings, wide: bool) -> Vec<Settings> {
        let s = settings;
        let mut all = Vec::new();
        let [directions, steps, rays] = ["directions", "steps", "rays"].map(|name| next_to(name, s));
        all.extend(directions.iter().map(|&directions| Settings { directions, ..s.clone() }));
        all.extend(steps.iter().map(|&steps| Settings { steps, ..s.clone() }));
        if s.method.reads("rays") {
            all.extend(rays.iter().map(|&rays| Settings { rays, ..s.clone() }));
        }
        for (&directions, &steps) in directions.iter().zip(steps.iter().rev()) {
            all.push(Settings { directions, steps, ..s.clone() });
        }
        all.extend(BLURS.map(|blur| Settings { blur, ..s.clone() }));
        // An image of half size needs a blur, which brings it to full size.
        all.push(Settings { half_res: !s.half_res, blur: s.blur.max(5), ..s.clone() });
        let other = |toggle| if toggle == Toggle::On { Toggle::Off } else { Toggle::On };
        all.push(Settings { edges: if s.edges == Edges::Off { Edges::Supersample } else { Edges::Off }, ..s.clone() });
        all.push(Settings { jitter: if s.jitter == Jitter::None { Jitter::Tile } else { Jitter::None }, ..s.clone() });
        all.push(Settings { depth_format: DepthFormat::R16f, ..s.clone() });
        if s.method.reads("ssao-samples") {
            all.extend(choices("ssao-samples").map(|ssao_samples| Settings { ssao_samples, ..s.clone() }));
            // The curve stays as it is when the normals are turned on or off.
            let ssao_curve = Some(s.curve());
            all.push(Settings { ssao_normals: other(s.ssao_normals), ssao_curve, ..s.clone() });
            all.push(Settings { ssao_curve: Some(other(s.curve())), ..s.clone() });
            all.push(Settings { ssao_depth: SsaoDepth::Half, ..s.clone() });
        }
        if wide {
            all.push(Settings { ao_format: AoFormat::R32f, ..s.clone() });
            all.push(Settings { normal_format: NormalFormat::Rgba16f, ..s.clone() });
        }
        all
    }

    /// Returns whether a format is wider than the usual one and the user did not pin it.
    pub(super) fn is_wide(&self, settings: &Settings) -> bool {
        settings.ao_format != AoFormat::R8 && !self.pins("ao-format")
            || settings.normal_format != NormalFormat::Rgba8Snorm && !self.pins("normal-format")
    }
}

/// Returns the numbers that the setting of this name may have.
fn choices(name: &str) -> impl Iterator<Item = u32> {
    Knob::named(name).into_iter().flat_map(Knob::choices).copied()
}

/// Returns the numbers next to the setting's own in [`COUNTS`]: the lower one, then the higher one if it is in the
/// setting's range.
fn next_to(name: &str, settings: &Settings) -> Vec<u32> {
    let Some((knob, count)) = Knob::named(name).and_then(|knob| Some((knob, knob.count(settings)?))) else {
        return Vec::new();
    };
    let in_range = |count: &u32| matches!(knob.kind, Kind::Count(_, most) if *count <= most);
    let lower = COUNTS.into_iter().rfind(|&other| other < count);
    let higher = COUNTS.into_iter().find(|&other| other > count).filter(in_range);
    lower.into_iter().chain(higher).collect()
}

/// Returns the values of the settings that determine the image, as one text. Combinations that render the same image
/// have the same text.
pub(super) fn key(settings: &Settings) -> String {
    let s = &Settings { ssao_curve: Some(settings.curve()), ..settings.clone() };
    // If no method draws, visibility is 1 everywhere, whatever the formats are.
    let matters = |knob: &str| s.idle(knob).is_none() && (s.method.computes() || !knob.ends_with("-format"));
    let values = KNOBS.iter().filter(|knob| matters(knob.name)).map(|knob| knob.text(s));
    values.chain([s.method.name().into(), (s.blur > 0).to_string()]).collect::<Vec<_>>().join(" ")
}

/// Returns whether `a` certainly takes no more work than `b`: either `a` has no pass at all, or they differ only in
/// numbers of samples, in the strength and in the blur, and `a` has no larger number and no more blur. `exits` says
/// whether `b` may exit early at some pixel. If so, `a` must not have fewer steps: with fewer steps each is longer, so
/// `a` may have to compute pixels at which `b` exits.
pub(super) fn no_more_work(a: &Settings, b: &Settings, exits: bool) -> bool {
    if !a.method.computes() {
        return true;
    }
    let less_blur = a.blur == 0
        || a.blur <= b.blur && a.blur_kernel == b.blur_kernel && (a.edges == b.edges || a.edges == Edges::Off);
    let of_b = |a: &Settings| Settings {
        directions: b.directions,
        steps: b.steps,
        rays: b.rays,
        ssao_samples: b.ssao_samples,
        strength: b.strength,
        blur: b.blur,
        blur_kernel: b.blur_kernel,
        edges: b.edges,
        ..a.clone()
    };
    less_blur
        && a.directions <= b.directions
        && (a.steps == b.steps || a.steps < b.steps && !exits)
        && a.rays <= b.rays
        && a.ssao_samples <= b.ssao_samples
        && of_b(a) == *b
}

/// Returns roughly how much work a combination takes, in depth samples per pixel. It only determines the order in which
/// combinations are tried.
pub(super) fn work(settings: &Settings) -> f64 {
    let s = settings;
    match s.method.samples(s) {
        0 => 0.0,
        samples => f64::from(samples) / f64::from(s.ao_scale().pow(2)) + f64::from(s.blur),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    fn space(base: Settings, pinned: &[&str], edges: [bool; 3]) -> Space {
        let pinned = KNOBS.iter().filter(|knob| pinned.contains(&knob.name)).collect();
        Space { base, pinned, edges }
    }

    fn admitted(space: &Space) -> Vec<Settings> {
        let sweep = space.sweep();
        let around = sweep.iter().flat_map(|settings| space.around(settings, true));
        sweep.iter().cloned().chain(around).filter_map(|settings| space.admit(&settings)).collect()
    }

    #[test]
    fn the_search_holds_the_sweep_of_trade_and_keeps_to_the_ranges() {
        let base = Settings { msaa: 1, edges: Edges::Off, ..Settings::default() };
        let keys: HashSet<String> = admitted(&space(base.clone(), &[], [false; 3])).iter().map(key).collect();
        for settings in trade::sweep(&base) {
            assert!(keys.contains(&key(&settings)), "{}", settings.to_toml());
        }
        for settings in admitted(&space(base, &[], [true; 3])) {
            settings.validate().unwrap();
            assert!(!settings.half_res || settings.blur > 0, "half size cannot be compared");
        }
    }

    #[test]
    fn pins_and_the_picture_are_kept() {
        let base = Settings { bias: 0.5, strength: 1.5, blur: 9, jitter: Jitter::None, ..Settings::default() };
        let space = space(base, &["method", "blur", "jitter", "strength"], [true; 3]);
        let all = admitted(&space);
        assert!(all.len() > 100);
        for s in all {
            assert_eq!((s.method, s.blur, s.jitter), (Method::Hbao, 9, Jitter::None));
            assert_eq!((s.bias, s.strength, s.msaa), (0.5, 1.5, 4));
        }
    }

    #[test]
    fn without_edges_no_blur_goes_around_samples_unless_it_was_asked_for() {
        let base = Settings::default();
        let wanted = |space: Space| admitted(&space).iter().any(|s| s.edges == Edges::Supersample);
        assert!(wanted(space(base.clone(), &[], [true; 3])));
        assert!(!wanted(space(base.clone(), &[], [false; 3])));
        assert!(wanted(space(base, &["edges"], [false; 3])));
    }

    #[test]
    fn less_work_is_claimed_only_where_it_is_certain() {
        let base = Settings::default();
        let with = |directions, steps, blur| Settings { directions, steps, blur, ..base.clone() };
        let b = with(8, 8, 9);
        for (a, expected) in [
            (b.clone(), true),
            (with(4, 8, 9), true),
            (with(8, 4, 0), true),
            (with(9, 1, 0), false),
            (with(8, 8, 13), false),
            (Settings { edges: Edges::Off, ..b.clone() }, true),
            (Settings { half_res: true, ..b.clone() }, false),
            (Settings { jitter: Jitter::None, ..b.clone() }, false),
            (Settings { method: Method::Crease, directions: 1, ..b.clone() }, false),
            (Settings { method: Method::None, directions: 64, ..b.clone() }, true),
        ] {
            assert_eq!(no_more_work(&a, &b, false), expected, "{}", a.to_toml());
        }
        assert!(!no_more_work(&with(8, 4, 9), &b, true) && no_more_work(&with(4, 8, 9), &b, true));
        assert!(!no_more_work(&b, &Settings { edges: Edges::Off, ..b.clone() }, false));
    }

    #[test]
    fn what_renders_alike_is_one() {
        let base = Settings::default();
        let alike = |a: Settings, b: Settings| key(&a) == key(&b);
        let blurless = Settings { blur: 0, ..base.clone() };
        assert!(alike(blurless.clone(), Settings { edges: Edges::Off, ..blurless.clone() }));
        assert!(!alike(base.clone(), blurless));
        assert!(!alike(base.clone(), Settings { edges: Edges::Off, ..base.clone() }));
        let ssao = Settings::for_method(Method::Ssao);
        assert!(alike(ssao.clone(), Settings { blur: 21, directions: 3, ..ssao.clone() }));
        assert!(!alike(ssao.clone(), Settings { blur: 0, ..ssao.clone() }));
        // What follows from another setting is the same as what is given.
        assert!(alike(ssao.clone(), Settings { ssao_curve: Some(Toggle::On), ..ssao.clone() }));
        let normals = Settings { ssao_normals: Toggle::On, ..ssao };
        assert!(alike(normals.clone(), Settings { ssao_curve: Some(Toggle::Off), ..normals.clone() }));
        assert!(!alike(normals.clone(), Settings { ssao_curve: Some(Toggle::On), ..normals }));
    }
}
