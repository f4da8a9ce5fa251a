//! `hbao compare`: measures the difference of two pictures, and fails if it is larger than allowed.

use super::flags;
use crate::heat;
use crate::report::fields::object;
use crate::terminal::{print, say};
use clap::{Arg, ArgMatches, Command, value_parser};
use hbao::Error;
use hbao::image::{Channels, Outputs, png, read_channels};
use hbao::measure::difference::Difference;
use std::fmt::Write as _;
use std::path::PathBuf;

const EXPLANATION: &str = "\
A and B are PNG or EXR files of any kind and of the same size. Values are compared as the files hold them: in a PNG from
0 to 1, whatever the number of bits, and in an EXR as they are. No gamma is applied. A file with one channel is grey,
and grey is the same as RGB with three equal values. A file without alpha is opaque, and alpha is compared unless both
files are opaque. Of an EXR with several layers, the first is compared. Equal infinities are equal, and so are two NaNs.
All other samples that are not finite are left out of the measures, but they are reported: they exceed every --max-rmse,
and their pixels differ by more than every --tolerance.

The errors are those of A relative to B, over the samples of all channels. The bias is the mean of A - B. PSNR is for a
peak of 1, and inf if the files are equal. FLIP compares them as 8-bit pictures that are seen at 67 pixels per degree.
It is left out if they are neither grey nor RGB, or if a value lies outside 0 to 1.

The exit code is 1 if a bound is exceeded: if the RMSE is above --max-rmse, or if more than --max-pixels pixels differ
by more than --tolerance in some channel. --tolerance alone allows no such pixel, and --max-pixels alone counts every
difference. A channel that only one file has exceeds every bound. Without bounds the exit code is 0. A number may be a
fraction such as 2/255.

The heat map shows the largest difference of each pixel's channels in steps of 1/255:
  black  0             green   over 4, up to 16       magenta  a sample that is not finite and not equal
  navy   up to 1       yellow  over 16, up to 64
  blue   over 1 to 4   red     over 64

The fields of FILE.json are size, channels, rmse, mae, max, bias, psnr (null if infinite), flip (null if left out),
tolerance, pixels, pixels_over_tolerance, pixels_not_finite and within_bounds.

Examples:
  hbao compare new.png golden.png --max-rmse 0.002
  hbao compare new.exr golden.exr --max-pixels 20 --tolerance 2/255 --heat heat.png";

/// Makes the verb's flags.
pub(crate) fn command() -> Command {
    let file = |name, help| Arg::new(name).required(true).value_parser(value_parser!(PathBuf)).help(help);
    let own = [
        file("A", "The picture to judge, a PNG or EXR file"),
        file("B", "The picture that it is compared with, a PNG or EXR file"),
        flags::valued("max-rmse", "E", "Fail if the RMSE is above this number [0 or above]"),
        flags::valued("max-pixels", "N", "Fail if more pixels than this differ [default with --tolerance: 0]"),
        flags::valued("tolerance", "T", "The difference up to which a pixel counts as equal [0 or above; default: 0]"),
        flags::path("heat", "OUT.png", "Write a picture of where the two differ"),
        flags::path("json", "FILE.json", "Write the measures"),
    ];
    Command::new("compare")
        .about("Compare two pictures, and fail if they differ by more than allowed")
        .args(own)
        .after_help(EXPLANATION)
}

/// The bounds that the user gave.
struct Bounds {
    max_rmse: Option<f64>,
    max_pixels: Option<usize>,
    tolerance: f64,
}

impl Bounds {
    fn read(matches: &ArgMatches) -> Result<Bounds, Error> {
        let tolerance = number(matches, "tolerance")?;
        let max_pixels =
            match flags::text(matches, "max-pixels") {
                None => tolerance.map(|_| 0),
                Some(text) => Some(text.trim().parse().map_err(|_| {
                    Error::Usage(format!("--max-pixels: '{text}' is not a whole number of at least 0"))
                })?),
            };
        Ok(Bounds { max_rmse: number(matches, "max-rmse")?, max_pixels, tolerance: tolerance.unwrap_or(0.0) })
    }

    /// Says which bounds a difference exceeds. The list is empty if it is within all of them.
    fn exceeded(&self, difference: &Difference) -> Vec<String> {
        let mut all = Vec::new();
        if !difference.unmatched.is_empty() && (self.max_rmse.is_some() || self.max_pixels.is_some()) {
            all.push(format!("only one of them has {}, which no bound allows", difference.unmatched.join(", ")));
        }
        let not_finite = difference.unequal_non_finite;
        if let Some(most) = self.max_rmse {
            let rmse = difference.errors.rmse;
            if rmse > most {
                all.push(format!("its RMSE {} is above --max-rmse {}", short(rmse), short(most)));
            }
            if not_finite > 0 {
                all.push(format!("{not_finite} pixels are not finite in one of them, which no --max-rmse allows"));
            }
        }
        if let Some(most) = self.max_pixels {
            let over = difference.pixels_over(self.tolerance);
            if over > most {
                let tolerance = short(self.tolerance);
                all.push(format!("{over} pixels differ by more than {tolerance}, and --max-pixels is {most}"));
            }
        }
        all
    }
}

/// Compares the pictures, prints the measures, writes the files that were asked for, and fails past a bound.
pub(crate) fn run(matches: &ArgMatches) -> Result<(), Error> {
    let bounds = Bounds::read(matches)?;
    let heat = flags::path_of(matches, "heat", "png")?;
    let json = flags::path_of(matches, "json", "json")?;
    Outputs::check(heat.iter().chain(&json))?;
    let [a, b] = ["A", "B"].map(|name| matches.get_one::<PathBuf>(name).cloned().unwrap_or_default());
    let real = |path: &PathBuf| path.canonicalize().ok();
    if let Some(heat) =
        heat.as_ref().filter(|heat| real(heat).is_some_and(|heat| [&a, &b].map(real).contains(&Some(heat))))
    {
        return Err(Error::Usage(format!("--heat {}: this is one of the pictures to compare", heat.display())));
    }
    let (got, truth) = (read_channels(&a)?, read_channels(&b)?);
    let refused = |what: String| Error::Input { path: a.clone(), what };
    let difference =
        Difference::of(&got, &truth).map_err(|e| refused(format!("compared with {}: {e}", b.display())))?;
    for (path, picture) in [(&a, &got), (&b, &truth)] {
        if picture.layers > 1 {
            say(&format!("{}: only the first of its {} layers is compared", path.display(), picture.layers));
        }
    }
    if !difference.unmatched.is_empty() {
        let (names, compared) = (difference.unmatched.join(", "), difference.compared.join(", "));
        say(&format!("only one of the files has {names}: only {compared} is compared"));
    }

    print(&text(&difference, &got, bounds.tolerance))?;
    let exceeded = bounds.exceeded(&difference);
    let mut outputs = Outputs::new();
    if let Some(path) = heat {
        outputs.stage(path, &png::encode(&difference.largest.map(heat::colour), &[])?)?;
    }
    if let Some(path) = json {
        let fields = json_fields(&difference, &got, bounds.tolerance, exceeded.is_empty());
        outputs.stage(path, format!("{fields:#}\n").as_bytes())?;
    }
    outputs.commit()?;
    if exceeded.is_empty() {
        return Ok(());
    }
    Err(refused(format!("it differs from {}: {}", b.display(), exceeded.join("; "))))
}

/// Returns the measures as lines of text.
fn text(difference: &Difference, picture: &Channels, tolerance: f64) -> String {
    let errors = &difference.errors;
    let mut text = String::new();
    let mut line = |name: &str, value: String| _ = writeln!(text, "{name:<24}{value}");
    let channels = difference.compared.join(" ");
    line("compared", format!("{}x{} pixels, {channels}", picture.width, picture.height));
    line("RMSE", short(errors.rmse));
    line("mean absolute", short(errors.mae));
    line("maximum", short(errors.max));
    line("bias, mean of A - B", short(errors.bias));
    line("PSNR", format!("{:.2} dB", difference.psnr()).replace("inf dB", "inf"));
    line("FLIP", errors.flip.map_or(without_flip().into(), short));
    let over = difference.pixels_over(tolerance);
    line(
        "pixels that differ",
        match tolerance {
            0.0 => format!("{over} of {}", errors.pixels),
            _ => format!("{over} of {} by more than {}", errors.pixels, short(tolerance)),
        },
    );
    if difference.unequal_non_finite > 0 {
        line("not finite in A or B", format!("{} pixels, left out of the measures", difference.unequal_non_finite));
    }
    text
}

/// Says why there is no FLIP.
fn without_flip() -> &'static str {
    if cfg!(feature = "flip") {
        "left out: the files are neither grey nor RGB, or a value lies outside 0 to 1"
    } else {
        "left out: this hbao was built without the feature flip"
    }
}

/// Returns the measures as a JSON object.
fn json_fields(difference: &Difference, picture: &Channels, tolerance: f64, within: bool) -> serde_json::Value {
    let errors = &difference.errors;
    object(vec![
        ("size", vec![picture.width, picture.height].into()),
        ("channels", difference.compared.clone().into()),
        ("rmse", errors.rmse.into()),
        ("mae", errors.mae.into()),
        ("max", errors.max.into()),
        ("bias", errors.bias.into()),
        ("psnr", difference.psnr().into()),
        ("flip", errors.flip.into()),
        ("tolerance", tolerance.into()),
        ("pixels", errors.pixels.into()),
        ("pixels_over_tolerance", difference.pixels_over(tolerance).into()),
        ("pixels_not_finite", difference.unequal_non_finite.into()),
        ("within_bounds", within.into()),
    ])
}

/// Formats a number with five digits.
fn short(value: f64) -> String {
    match value.abs() {
        0.0 => "0".into(),
        size if (1e-3..1e5).contains(&size) => format!("{value:.5}"),
        _ if value.is_nan() => "none".into(),
        _ => format!("{value:.4e}"),
    }
}

/// Reads the value of a flag: a finite number of at least 0, or a fraction such as 2/255.
fn number(matches: &ArgMatches, name: &str) -> Result<Option<f64>, Error> {
    let Some(text) = flags::text(matches, name) else { return Ok(None) };
    let part = |text: &str| text.trim().parse::<f64>().ok();
    let value = match text.split_once('/') {
        Some((numerator, denominator)) => part(numerator).zip(part(denominator)).map(|(a, b)| a / b),
        None => part(text),
    };
    let value = value.filter(|value| value.is_finite() && *value >= 0.0);
    let refused = || Error::Usage(format!("--{name}: '{text}' is not a number of at least 0, such as 0.01 or 2/255"));
    value.map(Some).ok_or_else(refused)
}
