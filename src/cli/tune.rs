//! `hbao tune`: the settings that a view needs, and no dearer ones.

use super::flags::{self, Flags, Opened};
use super::trade::{settings_fields, words};
use super::truth::trace;
use super::{bar, print, say};
use clap::{Arg, ArgMatches, Command, value_parser};
use glow::HasContext as _;
use hbao::Error;
use hbao::context::Context;
use hbao::image::{Image, Outputs};
use hbao::measure::tune::choice::Goal;
use hbao::measure::tune::{Requirements, Tried, Tuned, Tuner, Verdict};
use hbao::settings::{Edges, Jitter, Method, Settings, SsaoDepth, Toggle};
use serde_json::json;
use std::fmt::Write as _;
use std::path::PathBuf;

/// How many rows the table has.
const SHOWN: usize = 11;

const EXPLANATION: &str = "\
The RMSE is that of the image that 'hbao render' makes of this scene, size and camera with --settings F.toml: ao.exr of
its --dump against the image of 'hbao truth' with the same --truth-rays, over the pixels that are finite in depth.exr. The
milliseconds are those of ambient occlusion and its blur, as 'hbao trade' counts them.

What is searched: method, directions, steps, rays, half-res, blur, edges, jitter, the formats, and of ssao its samples,
depth, normals and curve. Each of these flags pins what it sets, and so does each line of --settings: the search varies
only what is not given. The radius, attenuation, strength, bias, msaa and all other settings are never searched. An RMSE
over all pixels sees neither the pattern of 4x4 pixels that the jitter leaves, nor bands, nor jagged edges, which are few:
--jitter tile --blur 9 --edges supersample keeps what is there against them.

How: each setting is rendered once for its error, the least work first, and none that takes more of the same work than
one that already answers. What comes near the goal is varied knob by knob. Contenders are timed in interleaved rounds, the
best 4 of them in three times as many more. For --max-error the most accurate of those is taken whose median the slowest
quarter of the fastest one's runs exceeds, since that is noise; for --max-ms the most accurate whose median is within T.
Errors that differ by less than 0.0001 count as equal: the faster is taken. LP_NUM_THREADS=1 keeps llvmpipe to one thread;
the machine should have nothing else to do.

Examples:
  hbao tune nave --size 400x300 --max-error 0.15 -o fast.toml
  hbao tune sibenik.obj --eye -15.5,-10.5,0 --target 10,-9,0 --fov-y 60 --size 800x600 --max-ms 20 --method hbao -o t.toml
  hbao render nave --size 400x300 --settings fast.toml -o nave.png";

/// The verb's flags.
pub(crate) fn command() -> Command {
    let output = Arg::new("output").short('o').long("output").value_name("F.toml").required(true);
    let own = [
        flags::valued(
            "max-error",
            "E",
            "Find the cheapest settings with at most this RMSE against the truth [above 0]",
        ),
        flags::valued("max-ms", "T", "Find the most accurate settings within these milliseconds [above 0]"),
        output.value_parser(value_parser!(PathBuf)).help("The settings file to write, F.toml"),
        flags::path("json", "FILE.json", "Write all settings considered, and what became of each"),
        flags::valued("runs", "N", "Counted runs of a contender [1 to 1000; default: 5]"),
        flags::truth_rays(),
    ];
    Command::new("tune")
        .about("Find the settings that a view needs: the cheapest within an error, or the most accurate within a time")
        .args(own)
        .args(flags::arguments())
        .after_help(EXPLANATION)
}

fn read_goal(matches: &ArgMatches) -> Result<Goal, Error> {
    let limit = |name: &str| {
        let Some(text) = flags::text(matches, name) else { return Ok(None) };
        let limit = text.trim().parse().ok().filter(|limit: &f64| limit.is_finite() && *limit > 0.0);
        limit.map(Some).ok_or_else(|| Error::Usage(format!("--{name}: '{text}' is no finite number above 0")))
    };
    match (limit("max-error")?, limit("max-ms")?) {
        (Some(error), None) => Ok(Goal::MaxError(error)),
        (None, Some(ms)) => Ok(Goal::MaxMs(ms)),
        (None, None) => Err(Error::Usage("give what to tune for: --max-error E, or --max-ms T".into())),
        (Some(_), Some(_)) => {
            Err(Error::Usage("--max-error and --max-ms: give one, and the other is made the least".into()))
        }
    }
}

/// Looks at the view, traces the truth, searches, prints what was found, and writes it.
pub(crate) fn run(matches: &ArgMatches) -> Result<(), Error> {
    let flags = Flags::read(matches)?;
    let goal = read_goal(matches)?;
    let (rays, runs) = (flags::read_truth_rays(matches)?, flags::read_runs(matches, 5)?);
    let output = flags::path_of(matches, "output", "toml")?.unwrap_or_default();
    let json = flags::path_of(matches, "json", "json")?;
    Outputs::check(json.iter().chain([&output]).cloned())?;
    let Opened { scene, settings, camera, notices } = flags.open()?;
    notices.iter().for_each(|notice| say(notice));
    let base = settings.resolved(scene.mesh.diagonal());
    let failed = |what: String| Error::Input { path: flags.scene.clone().into(), what };

    let context = Context::open(flags.backend)?;
    let gl = context.gl();
    context.passed_over().into_iter().for_each(say);
    say(&context.describe());
    let pinned = flags.knobs_pinned();
    let tuner = Tuner::new(gl, (&scene.mesh, &camera), flags.size, &base, &pinned)?;
    let requirements = tuner.requirements().clone();
    if !requirements.covered.texels.contains(&true) {
        return Err(failed(
            "no pixel of this view holds a surface, so there is nothing to tune: move the camera".into(),
        ));
    }
    asked(&requirements, &base).iter().for_each(|line| say(line));
    let traced = trace(&scene.mesh, &camera, flags.size, &base, rays)?;
    let (width, height) = (flags.size.0 as usize, flags.size.1 as usize);
    let truth = Image { width, height, texels: traced.visibility.iter().map(|&a| a as f32).collect() };
    let progress = bar(1, "settings and timed runs");
    let tuned = tuner.run(&truth, goal, runs, |done, of| {
        progress.set_length(of as u64);
        progress.set_position(done as u64);
    })?;
    progress.finish_and_clear();
    let Some(best) = tuned.best.map(|i| &tuned.tried[i]) else { return Err(failed(nothing(&tuned, goal))) };
    let rmse = best.rmse().unwrap_or(f64::NAN);
    let against = if let Goal::MaxError(limit) = goal { limit } else { rmse };
    if traced.noise_rmse > against / 5.0 {
        say(&format!(
            "the truth's noise of {:.5} is more than a fifth of an error of {against:.5}: give more --truth-rays",
            traced.noise_rmse
        ));
    }
    let idle = flags.knobs_given().filter(|knob| !best.settings.method.reads(knob));
    let method = best.settings.method.name();
    idle.for_each(|knob| say(&format!("--{knob} has no effect on the settings found, of --method {method}")));

    print(&format!("{}{}", summary(&tuned, goal), table(&tuned, goal, &requirements)))?;
    // SAFETY: the context is current on this thread, and these are core parameters.
    let [renderer, opengl] =
        [glow::RENDERER, glow::VERSION].map(|parameter| unsafe { gl.get_parameter_string(parameter) });
    let mut render = flags.seen(&camera);
    let mut put = |key: &str, value: toml::Value| render.insert(key.into(), value);
    match goal {
        Goal::MaxError(limit) => put("max-error", limit.into()),
        Goal::MaxMs(limit) => put("max-ms", limit.into()),
    };
    put("rmse", rmse.into());
    put("ms", best.ms().unwrap_or(f64::NAN).into());
    put("truth-rays", i64::from(rays).into());
    put("noise_rmse", traced.noise_rmse.into());
    put("samples", i64::from(requirements.samples).into());
    put("renderer", renderer.clone().into());
    put("opengl", opengl.into());
    let all = flags::with_origin(&best.settings, render);
    let header = "# Written by hbao tune, for hbao render --settings and Settings::read_toml. [render] tells what for.";
    let mut outputs = Outputs::new();
    outputs.stage(output, format!("{header}\n{all}").as_bytes())?;
    if let Some(path) = json {
        let report = json!({
            "renderer": renderer,
            "scene": scene.name,
            "size": [flags.size.0, flags.size.1],
            "truth": { "rays": rays, "noise_rmse": traced.noise_rmse },
            "max_error": if let Goal::MaxError(limit) = goal { Some(limit) } else { None },
            "max_ms": if let Goal::MaxMs(limit) = goal { Some(limit) } else { None },
            "pinned": pinned,
            "view": {
                "covered": requirements.covered.texels.iter().filter(|&&covered| covered).count(),
                "samples": requirements.samples,
                "edge_pixels": requirements.edge_pixels[0],
                "radius_px": [requirements.radius_px.0, requirements.radius_px.1],
            },
            "rows": tuned.tried.iter().map(as_json).collect::<Vec<_>>(),
        });
        outputs.stage(path, format!("{report:#}\n").as_bytes())?;
    }
    outputs.commit()
}

/// What the view asks of settings, in words.
fn asked(requirements: &Requirements, base: &Settings) -> Vec<String> {
    let Requirements { covered, samples, edge_pixels, radius_px: (least, most) } = requirements;
    let pixels = covered.texels.iter().filter(|&&covered| covered).count();
    let edges = edge_pixels[usize::from(base.method == Method::Ssao)];
    let mut lines = vec![format!(
        "view: {pixels} of {} pixels hold a surface, {edges} are edges ({samples} samples a pixel); R covers {least:.1} to \
         {most:.1} texels",
        covered.texels.len()
    )];
    if edges == 0 {
        lines.push("no pixel is an edge: edges = \"off\", unless --edges is given".into());
    }
    if *most < 2.0 {
        lines.push("R covers less than 2 texels: every step is below a texel, where A = 1".into());
    }
    lines
}

/// What came nearest where nothing meets the goal.
fn nothing(tuned: &Tuned, goal: Goal) -> String {
    let value = |tried: &Tried| match goal {
        Goal::MaxError(_) => tried.rmse(),
        Goal::MaxMs(_) => tried.ms(),
    };
    let all = tuned.tried.iter().filter_map(|tried| Some((tried, value(tried)?)));
    let count = tuned.tried.len();
    let Some((nearest, least)) = all.min_by(|a, b| a.1.total_cmp(&b.1)) else {
        let verdict = tuned.tried.first().map_or(Verdict::Open, |tried| tried.verdict);
        return format!("all {count} settings are rejected unrendered: {}: pin less", why(verdict, goal));
    };
    let settings = described(&nearest.settings, true);
    match goal {
        Goal::MaxError(limit) => format!(
            "none of {count} settings has an RMSE of at most {limit}: the least is {least:.5}, of {settings}: allow as much, or \
             pin less"
        ),
        Goal::MaxMs(limit) => format!(
            "none of {count} settings takes at most {limit} ms: the fastest takes {least:.3}, {settings}: allow as much, or \
             pin less"
        ),
    }
}

/// Settings in a few words. `edges`: whether there are any in view.
fn described(settings: &Settings, edges: bool) -> String {
    let s = settings;
    let mut text = format!("{} {}", s.method.name(), words(s)).split_whitespace().collect::<Vec<_>>().join(" ");
    let ssao = s.method == Method::Ssao;
    for (said, words) in [
        (s.jitter == Jitter::None && s.method != Method::None, "no jitter"),
        (edges && s.edges == Edges::Off && s.blur > 0 && s.method != Method::None, "edges off"),
        (ssao && s.blur == 0, "no blur"),
        (ssao && s.ssao_normals == Toggle::On, "normals"),
        (ssao && s.ssao_curve == Toggle::Off, "no curve"),
        (ssao && s.ssao_depth == SsaoDepth::Half, "half depth"),
    ] {
        if said {
            let _ = write!(text, ", {words}");
        }
    }
    text
}

/// How many settings were considered, and what became of them.
fn summary(tuned: &Tuned, goal: Goal) -> String {
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

fn why(verdict: Verdict, goal: Goal) -> &'static str {
    let for_error = matches!(goal, Goal::MaxError(_));
    match verdict {
        Verdict::Open => "",
        Verdict::Best if for_error => "the cheapest",
        Verdict::Best => "the most accurate",
        Verdict::StepsBelowTexel => "every step is below a texel, where A = 1 as with --method none",
        Verdict::DepthFormat => "depth-format r16f does not hold depths from the near to the far plane",
        Verdict::MoreWork if for_error => "more work than settings that reach the error",
        Verdict::MoreWork => "more work than settings that take over twice the time",
        Verdict::Refused => "the driver refuses them",
        Verdict::TooInaccurate => "error too large",
        Verdict::NoGain => "fewer samples or less blur are as accurate",
        Verdict::WiderThanNeeded => "usual formats reach the error",
        Verdict::TooSlow => "too slow",
        Verdict::Slower => "slower",
        Verdict::LessAccurate if for_error => "as fast, less accurate",
        Verdict::LessAccurate => "less accurate",
    }
}

fn table(tuned: &Tuned, goal: Goal, requirements: &Requirements) -> String {
    let mut text = format!("\n  {:<52}{:>9}{:>18}{:>9}  verdict\n", "settings", "ms", "of runs", "RMSE");
    let edges = requirements.edge_pixels != [0, 0];
    for i in tuned.nearest(goal, SHOWN) {
        let tried = &tuned.tried[i];
        let (low, high) = spread(tried);
        let spread = if tried.times.is_empty() { "2 in a row".into() } else { format!("{low:.2} to {high:.2}") };
        let _ = writeln!(
            text,
            "{} {:<52}{:>9.2}{:>18}{:>9.4}  {}",
            if tuned.best == Some(i) { '*' } else { ' ' },
            described(&tried.settings, edges),
            tried.ms().unwrap_or(f64::NAN),
            spread,
            tried.rmse().unwrap_or(f64::NAN),
            why(tried.verdict, goal)
        );
    }
    text
}

/// The fastest and the slowest run.
fn spread(tried: &Tried) -> (f64, f64) {
    tried.times.iter().fold((f64::INFINITY, 0.0), |(low, high), &ms| (low.min(ms), high.max(ms)))
}

fn as_json(tried: &Tried) -> serde_json::Value {
    let (s, e) = (&tried.settings, tried.errors.as_ref());
    let timed = !tried.times.is_empty();
    let (low, high) = spread(tried);
    let mut fields = settings_fields(s);
    fields.extend([
        ("jitter", s.jitter.name().into()),
        ("edges", s.edges.name().into()),
        ("ssao_depth", s.ssao_depth.name().into()),
        ("ssao_normals", s.ssao_normals.name().into()),
        ("ssao_curve", s.ssao_curve.name().into()),
        ("ms", tried.ms().into()),
        ("runs", tried.times.len().into()),
        ("ms_min", timed.then_some(low).into()),
        ("ms_max", timed.then_some(high).into()),
        ("rmse", tried.rmse().into()),
        ("mae", e.map(|e| e.mae).into()),
        ("bias", e.map(|e| e.bias).into()),
        ("max", e.map(|e| e.max).into()),
        ("flip", e.and_then(|e| e.flip).into()),
        ("verdict", tried.verdict.name().into()),
    ]);
    serde_json::Value::Object(fields.into_iter().map(|(name, value)| (name.to_string(), value)).collect())
}
