//! Notices about results that the user hardly meant: an empty picture, or ambient occlusion that is 1 because R does not
//! fit the picture. Each is one line that says what happened, why, and what to type.

use crate::report::tables::cells::percent;
use hbao::Error;
use hbao::image::Image;
use hbao::measure::Reach;
use hbao::scene::{Camera, Mesh};
use hbao::settings::{Exit, Settings};

/// The largest share of a picture's surface at which something may be wrong without a notice.
const UNNOTICED: f64 = 0.05;

/// The end of a camera's notice that no surface is in view.
const NOTHING_IN_VIEW: &str = "nothing is in view";

/// Returns the notice for a picture in which no pixel holds a surface. `told` are the camera's own notices, which may
/// have told it already.
pub(crate) fn empty(mesh: &Mesh, camera: &Camera, told: &[String]) -> Option<String> {
    if told.iter().any(|notice| notice.contains(NOTHING_IN_VIEW)) {
        return None;
    }
    let depths = mesh.positions.iter().map(|&p| camera.to_eye(p).z);
    let (nearest, farthest) = depths.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), z| (a.min(z), b.max(z)));
    let Camera { near, far, .. } = *camera;
    Some(if nearest > far || farthest < near {
        format!(
            "{NOTHING_IN_VIEW}: the planes at {near} and {far} clip the whole scene, whose depths are {} to {}; leave out \
             --near and --far",
            nearest as f32, farthest as f32
        )
    } else {
        format!("{NOTHING_IN_VIEW}: the scene lies beside the picture; leave out --eye and --target to see all of it")
    })
}

/// Returns the notice for an R that does not fit the steps or the picture. `reach_of` tells how R fits with some settings.
pub(crate) fn radius(
    settings: &Settings,
    reach_of: impl Fn(&Settings) -> Result<Reach, Error>,
) -> Result<Option<String>, Error> {
    let reach = reach_of(settings)?;
    if reach.past > UNNOTICED {
        return Ok(Some(past(reach.past)));
    }
    if reach.exits <= UNNOTICED {
        return Ok(None);
    }
    let shorter = reach_of(&Settings { exit: Exit::Shorten, ..settings.clone() })?;
    let larger =
        if settings.half_res { "a larger --radius or --size, or no --half-res" } else { "a larger --radius or --size" };
    let remedy = if shorter.exits <= UNNOTICED {
        "give --exit shorten, which takes fewer steps there".into()
    } else if shorter.exits < reach.exits {
        format!("give --exit shorten, which takes fewer steps there, and {larger}")
    } else {
        format!("give {larger}")
    };
    let too_short = match settings.exit {
        Exit::Paper => format!("{} steps to R are shorter than a texel there", settings.steps),
        _ => "R is shorter than 2 texels there".into(),
    };
    Ok(Some(format!("visibility is 1 at {} of the surface, because {too_short}: {remedy}", percent(reach.exits))))
}

/// Returns the notice for a picture that R exceeds at this share of its surface.
fn past(share: f64) -> String {
    format!(
        "at {} of the surface every sample falls on the picture's border, because a step is longer than the picture: give a \
         smaller --radius",
        percent(share)
    )
}

/// Returns the notice for combinations of settings, each with how R fits it, of which some exit early or reach past the
/// picture.
pub(crate) fn radius_of_many<'a>(all: impl Iterator<Item = (&'a Settings, Reach)> + Clone) -> Option<String> {
    let most_past = all.clone().map(|(_, reach)| reach.past).fold(0.0, f64::max);
    if most_past > UNNOTICED {
        return Some(past(most_past));
    }
    let exiting = all.clone().filter(|(_, reach)| reach.exits > UNNOTICED);
    let (count, total) = (exiting.clone().count(), all.count());
    let most = exiting.clone().map(|(_, reach)| reach.exits).fold(0.0, f64::max);
    let shorten =
        if exiting.clone().any(|(settings, _)| settings.exit == Exit::Paper) { "--exit shorten, or " } else { "" };
    (count > 0).then(|| {
        format!(
            "{count} of {total} renderings exit early, with visibility 1, at up to {} of the surface, because their steps are \
             shorter than a texel there: give {shorten}a larger --radius or --size",
            percent(most)
        )
    })
}

/// Returns the notice for visibility that is 1 at every pixel.
pub(crate) fn open(visibility: &Image<f32>, settings: &Settings) -> Option<String> {
    let open = visibility.texels.iter().all(|&a| a == 1.0);
    let looked = match settings.radius_units() {
        Ok(radius) if settings.method.reads("radius") => {
            format!("nothing occludes within R = {radius}; a larger --radius reaches farther")
        }
        _ => "nothing occludes the surfaces in view".into(),
    };
    (open && settings.method.computes()).then(|| format!("visibility is 1 at every pixel: {looked}"))
}
