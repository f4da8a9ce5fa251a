//! Notices about results that the user hardly meant: an empty picture, or ambient occlusion that is 1 because R does
//! not fit the picture. Each is one line that says what happened, why, and what to type.

use super::flags::Flags;
use crate::picture::Kept;
use crate::report::tables::cells::percent;
use glam::DVec3;
use hbao::image::Image;
use hbao::measure::Reach;
use hbao::reference::gbuffer::gbuffer;
use hbao::scene::{Camera, Lens, Mesh, NOTHING_IN_VIEW, View};
use hbao::settings::{Exit, Normals, Radius, Settings};
use hbao::{Error, Pipeline, Projection};

/// The largest share of a picture's surface at which something may be wrong without a notice.
const UNNOTICED: f64 = 0.05;

/// The width and height of the picture in which what the planes clip is looked for.
const LOOKED_FOR: (usize, usize) = (160, 120);

/// Returns the notice about a picture without surfaces, or about visibility of 1 that the user hardly meant. `depth` is
/// the picture's, and `kept` the part of it that is written, if that is not all of it. `nothing` says that no pixel
/// holds a surface.
pub(crate) fn of(
    pipeline: &Pipeline,
    depth: &Image<f32>,
    projection: Projection,
    settings: &Settings,
    kept: Option<&Kept>,
    nothing: impl FnOnce() -> Option<String>,
) -> Result<Option<String>, Error> {
    let covered = |depth: &Image<f32>| depth.texels.iter().any(|z| z.is_finite());
    if !kept.map_or_else(|| covered(depth), |kept| covered(&kept.of(depth))) {
        return Ok(nothing());
    }
    if !pipeline.makes_ao() || !settings.method.computes() {
        return Ok(None);
    }
    let radius = radius(settings, "--radius or --size", |settings| Reach::of(depth, projection, settings))?;
    let visibility = pipeline.ao()?;
    let visibility = kept.map_or_else(|| visibility.clone(), |kept| kept.of(&visibility));
    Ok(radius.or(open(&visibility, settings, settings.method.reads("radius"))))
}

/// Says why no pixel of a picture holds a surface, and what to do about it.
pub(crate) fn empty(flags: &Flags, mesh: &Mesh, camera: &Camera) -> String {
    let View { eye, target, up, lens, near, far, .. } = &flags.view;
    let names = |flags: &[(&str, bool)]| -> Vec<String> {
        flags.iter().filter(|(_, given)| *given).map(|(name, _)| format!("--{name}")).collect()
    };
    let planes = names(&[("near", near.is_some()), ("far", far.is_some())]);
    // What the same camera would see with planes that clip nothing.
    let unclipped = Camera { near: 1e-15, far: 1e15, ..*camera };
    let seen = gbuffer(mesh, &unclipped, LOOKED_FOR, Normals::Derivative, [0.0; 2]);
    let depths = seen.texels.iter().map(|surface| surface.depth).filter(|depth| depth.is_finite());
    let (nearest, farthest) = depths.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), z| (a.min(z), b.max(z)));
    if nearest <= farthest {
        let remedy = if planes.is_empty() { "give --near and --far".into() } else { leave_out(&planes) };
        return format!(
            "{NOTHING_IN_VIEW}: the planes at {} and {} clip all that would be, at depths of {} to {}; {remedy}",
            camera.near as f32, camera.far as f32, nearest as f32, farthest as f32
        );
    }
    let area = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|i| mesh.positions[i as usize]);
        (b - a).cross(c - a).length()
    };
    if mesh.triangles.iter().all(|corners| area(corners) == 0.0) {
        return format!("{NOTHING_IN_VIEW}: no face of the model has an area");
    }
    let in_the_picture = |position: &DVec3| {
        let at = camera.to_eye(*position);
        let seen = camera.project(at);
        at.z > 0.0 && seen.min_element() >= 0.0 && seen.max_element() <= 1.0
    };
    if mesh.positions.iter().any(in_the_picture) {
        return format!(
            "{NOTHING_IN_VIEW}: what lies in the picture is smaller than a pixel; show less with a nearer --eye, or a smaller \
             --fov-y or --ortho, or a narrower --frustum"
        );
    }
    let given = names(&[
        ("eye", eye.is_some()),
        ("target", target.is_some()),
        ("up", up.is_some()),
        ("fov-y", matches!(lens, Some(Lens::FovY(_)))),
        ("ortho", matches!(lens, Some(Lens::Height(_)))),
        ("frustum", matches!(lens, Some(Lens::Frustum(_)))),
        ("ortho-frustum", matches!(lens, Some(Lens::OrthoFrustum(_)))),
    ]);
    let remedy = if given.is_empty() {
        "give another --eye and --target".into()
    } else {
        leave_out(&given) + " to see all of it"
    };
    format!("{NOTHING_IN_VIEW}: no part of the scene lies in the picture; {remedy}")
}

fn leave_out(flags: &[String]) -> String {
    format!("leave out {}", flags.join(" and "))
}

/// Returns the notice for an R that does not fit the steps or the picture. `larger` names the flags that make R longer
/// in the picture, and `reach_of` tells how R fits with some settings.
pub(crate) fn radius(
    settings: &Settings,
    larger: &str,
    reach_of: impl Fn(&Settings) -> Result<Reach, Error>,
) -> Result<Option<String>, Error> {
    let reach = reach_of(settings)?;
    if reach.past > UNNOTICED {
        return Ok(Some(format!("at {} of the surface {PAST}", percent(reach.past))));
    }
    if reach.exits <= UNNOTICED {
        return Ok(None);
    }
    let shorter = reach_of(&Settings { exit: Exit::Shorten, ..settings.clone() })?;
    let larger = format!("a larger {larger}{}", if settings.half_res { ", or no --half-res" } else { "" });
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

/// What happens at a surface whose first step leaves the picture, and what to do about it.
const PAST: &str = "all samples fall on the picture's border and find nothing between, because the first step leaves the \
                    picture: give a smaller --radius or more --steps";

/// Returns the notices for combinations of settings, each with how R fits it, of which some exit early or reach past
/// the picture.
pub(crate) fn radius_of_many<'a>(all: impl Iterator<Item = (&'a Settings, Reach)> + Clone) -> Vec<String> {
    let total = all.clone().count();
    let most = |share: fn(Reach) -> f64| {
        let noticed = all.clone().map(|(_, reach)| share(reach)).filter(|share| *share > UNNOTICED);
        let most = noticed.clone().fold(0.0, f64::max);
        (most > 0.0)
            .then(|| format!("{} of {total} renderings, at up to {} of the surface,", noticed.count(), percent(most)))
    };
    let shorten = all.clone().any(|(settings, reach)| settings.exit == Exit::Paper && reach.exits > UNNOTICED);
    let shorten = if shorten { "--exit shorten, or " } else { "" };
    let exits = most(|reach| reach.exits).map(|which| {
        format!(
            "{which} exit early with visibility 1, because R covers too few texels for their steps there: give {shorten}a larger \
             --radius or --size"
        )
    });
    let past = most(|reach| reach.past).map(|which| format!("in {which} {PAST}"));
    exits.into_iter().chain(past).collect()
}

/// Returns the notice for visibility that is 1 at every pixel. `reads_radius` says whether R matters for it.
pub(crate) fn open(visibility: &Image<f32>, settings: &Settings, reads_radius: bool) -> Option<String> {
    if visibility.texels.iter().any(|&a| a < 1.0) {
        return None;
    }
    let radius = match settings.radius {
        Radius::Units(radius) => format!("R = {}", radius as f32),
        _ => "R".into(),
    };
    let looked = match reads_radius {
        true => format!("no sample within {radius} occludes enough to be seen; a larger --radius reaches farther"),
        _ => "no sample occludes enough to be seen".into(),
    };
    let strength = if settings.strength < 1.0 { ", and a larger --strength shows more" } else { "" };
    Some(format!("visibility is 1 at every pixel: {looked}{strength}"))
}
