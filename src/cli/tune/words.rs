//! The texts in which `hbao tune` describes the view, combinations of settings and their verdicts.

use crate::report::words::words;
use hbao::measure::tune::choice::Goal;
use hbao::measure::tune::{Requirements, Tried, Tuned, Verdict};
use hbao::settings::{Edges, Jitter, MethodBlur, Settings, SsaoDepth, Toggle};
use std::fmt::Write as _;

/// What the user can do so that the search has more combinations to choose from.
const REMEDY: &str = "set fewer settings by flags and --settings, so that more combinations are tried";

/// Describes the view's requirements in one line each.
pub(super) fn requirements(requirements: &Requirements, base: &Settings) -> Vec<String> {
    let Requirements { covered, samples, radius_px: (least, most), .. } = requirements;
    let pixels = covered.texels.iter().filter(|&&covered| covered).count();
    let edges = requirements.edges_of(base.method);
    let mut lines = vec![format!(
        "view: {pixels} of {} pixels hold a surface, {edges} are edges ({samples} samples per pixel); R covers {least:.1} to \
         {most:.1} texels",
        covered.texels.len()
    )];
    if edges == 0 {
        lines.push("no pixel is an edge: edges = \"off\", unless --edges is given".into());
    }
    if *most < 2.0 {
        lines.push(
            "R covers less than 2 texels: every step is below a texel, so visibility is 1 everywhere; a larger --radius or \
             --size helps"
                .into(),
        );
    }
    lines
}

/// Returns the message for a goal that nothing meets. It says which combination came nearest.
pub(super) fn nothing(tuned: &Tuned, goal: Goal) -> String {
    let value = |tried: &Tried| match goal {
        Goal::MaxError(_) => tried.rmse(),
        Goal::MaxMs(_) => tried.ms(),
    };
    let all = tuned.tried.iter().filter_map(|tried| Some((tried, value(tried)?)));
    let count = tuned.tried.len();
    let Some((nearest, least)) = all.min_by(|a, b| a.1.total_cmp(&b.1)) else {
        let verdict = tuned.tried.first().map_or(Verdict::Open, |tried| tried.verdict);
        let remedy = match verdict {
            Verdict::StepsBelowTexel => "leave out --exit paper, or give a larger --radius or --size, or fewer --steps",
            _ => REMEDY,
        };
        return format!(
            "all {count} combinations of settings were rejected before rendering: {}: {remedy}",
            why(verdict, goal)
        );
    };
    let settings = described(&nearest.settings, true);
    match goal {
        Goal::MaxError(limit) => format!(
            "none of {count} combinations of settings has an RMSE of at most {limit}: the least is {least:.5}, of {settings}: \
             raise --max-error, or {REMEDY}"
        ),
        Goal::MaxMs(limit) => format!(
            "none of {count} combinations of settings takes at most {limit} ms: the fastest takes {least:.3} ms, {settings}: \
             raise --max-ms, or {REMEDY}"
        ),
    }
}

/// Describes a combination in a few words. `edges` says whether any pixel in view is an edge.
pub(super) fn described(settings: &Settings, edges: bool) -> String {
    let s = settings;
    let mut text = format!("{} {}", s.method.name(), words(s)).split_whitespace().collect::<Vec<_>>().join(" ");
    let reads = |knob| s.method.reads(knob);
    for (applies, words) in [
        (reads("jitter") && s.jitter == Jitter::None, "no jitter"),
        (reads("edges") && edges && s.edges == Edges::Off && s.blur > 0, "edges off"),
        (s.method.facts().blur == MethodBlur::Crysis && s.blur == 0, "no blur"),
        (reads("ssao-normals") && s.ssao_normals == Toggle::On, "normals"),
        (reads("ssao-curve") && s.curve() == Toggle::Off, "no curve"),
        (reads("ssao-depth") && s.ssao_depth == SsaoDepth::Half, "half depth"),
    ] {
        if applies {
            let _ = write!(text, ", {words}");
        }
    }
    text
}

/// Says how many combinations were considered, and how many of them got each verdict.
pub(super) fn summary(tuned: &Tuned, goal: Goal) -> String {
    let of = |verdict: Verdict| tuned.tried.iter().filter(move |tried| tried.verdict == verdict);
    let mut text = format!("{:>6} settings considered, of which\n", tuned.tried.len());
    let mut line = |count: usize, what: &str| {
        if count > 0 {
            let _ = writeln!(text, "{count:>6} {what}");
        }
    };
    let unrendered = [Verdict::StepsBelowTexel, Verdict::DepthFormat, Verdict::MoreWork, Verdict::Refused];
    for verdict in unrendered {
        line(of(verdict).count(), &format!("not rendered: {}", why(verdict, goal)));
    }
    let least = of(Verdict::TooInaccurate).min_by(|a, b| a.rmse().unwrap_or(1.0).total_cmp(&b.rmse().unwrap_or(1.0)));
    if let (Some(least), Goal::MaxError(limit)) = (least, goal) {
        let rmse = least.rmse().unwrap_or(1.0);
        let best = described(&least.settings, true);
        line(of(Verdict::TooInaccurate).count(), &format!("with an RMSE above {limit}, at best {rmse:.5} ({best})"));
    }
    for verdict in [Verdict::NoGain, Verdict::WiderThanNeeded] {
        line(of(verdict).count(), &format!("not timed: {}", why(verdict, goal)));
    }
    let timed = tuned.tried.iter().filter(|tried| !tried.times.is_empty()).count();
    let rest = [Verdict::Best, Verdict::Slower, Verdict::LessAccurate, Verdict::TooSlow].into_iter();
    let rest = rest.map(|verdict| of(verdict).count()).sum::<usize>();
    line(rest, &format!("timed, {timed} settings in interleaved runs"));
    text
}

/// Says why a combination lost or won.
pub(super) fn why(verdict: Verdict, goal: Goal) -> &'static str {
    let for_error = matches!(goal, Goal::MaxError(_));
    match verdict {
        Verdict::Open => "",
        Verdict::Best if for_error => "the cheapest",
        Verdict::Best => "the most accurate",
        Verdict::StepsBelowTexel => "at more than half of the texels a step is below a texel, so visibility is 1 there",
        Verdict::DepthFormat => "depth-format r16f does not hold depths from the near to the far plane",
        Verdict::MoreWork if for_error => "no less work than settings that reach the error",
        Verdict::MoreWork => "no less work than settings that take over twice the time",
        Verdict::Refused => "the driver refuses these settings",
        Verdict::TooInaccurate => "error too large",
        Verdict::NoGain => "fewer samples or less blur are as accurate",
        Verdict::WiderThanNeeded => "settings with the usual formats reach the error",
        Verdict::TooSlow => "too slow",
        Verdict::Slower => "slower",
        Verdict::LessAccurate if for_error => "as fast, less accurate",
        Verdict::LessAccurate => "less accurate",
    }
}
