//! The method about the view ray: what it owes to no paper must hold by its own closed forms and limits.

use crate::analytic::{FLOAT, tilts};
use crate::rig;
use crate::rig::by_hand::{ByHand, columns, heights, orthographic, perspective, plane, rubble};
use crate::rig::{SIZE, everywhere, hold, scenes, twin};
use hbao::context::{Backend, Context};
use hbao::image::Image;
use hbao::reference::gbuffer::gbuffer;
use hbao::reference::truth::{Traced, Truth};
use hbao::reference::{converged, visibility};
use hbao::scene::Projection;
use hbao::settings::{Attenuation, Clamp, Exit, Jitter, Method, Normals, Quadrature, Radius, Snap, Zenith};
use hbao::{AmbientOcclusion, Extents, Settings, rotation_tile};

fn raw(radius: f64) -> Settings {
    rig::raw(Method::HbaoView, radius)
}

#[test]
fn every_plane_is_open_from_every_view() {
    const SIZE: (u32, u32) = (33, 25);
    let context = Context::open(Backend::Egl).unwrap();
    let mut views = Vec::new();
    for n in tilts() {
        for fov in [20.0, 45.0, 90.0, 120.0] {
            views.push(plane(perspective(fov, SIZE), SIZE, n, -3.0 * n.z.abs()));
            // Texels that are three times as wide as high.
            let [half_width, half_height] = perspective(fov, SIZE).half_extents();
            let wide = Projection::Perspective(Extents::centred(half_width, half_height / 3.0));
            views.push(plane(wide, SIZE, n, -3.0 * n.z.abs()));
        }
        if n.z < 0.0 {
            views.push(plane(orthographic(0.1, SIZE), SIZE, n, 5.0 * n.z));
        }
    }
    views.retain(|view| view.covered().texels.contains(&true));
    assert!(views.iter().filter(|view| view.normals.at(0, 0)[2] > 0.0).count() >= 20);
    for settings in [
        raw(2.0),
        Settings { steps: 16, spacing: 2.0, quadrature: Quadrature::Mean, ..raw(2.0) },
        Settings { snap: Snap::Step, spacing: 1.0, exit: Exit::Paper, ..raw(2.0) },
        Settings { bias: 0.3, ..raw(2.0) },
        Settings { zenith: Zenith::Axis, ..raw(2.0) },
    ] {
        let mut ao = AmbientOcclusion::new(context.gl().clone(), SIZE, &settings).unwrap();
        for view in &views {
            let text = format!("{:?} n = {:?}\n{}", view.projection, view.normals.at(0, 0), settings.to_toml());
            let textures = rig::by_hand::Textures::new(
                context.gl(),
                view,
                hbao::TextureTarget::Rectangle,
                hbao::NormalEncoding::Signed,
            );
            let by_shader = textures.visibility(&mut ao, view).map(f64::from);
            for (who, got) in [("shader", by_shader), ("twin", view.by_twin(&settings))] {
                hold(who, &got, &got.map(|_| 1.0), &view.covered(), everywhere(1e-3), &text);
            }
        }
    }
}

/// With the Z axis as the zenith, even steps and the weight of the end, nothing is left that differs from the chapter.
#[test]
fn about_the_z_axis_with_even_steps_it_is_the_chapters_method() {
    let context = Context::open(Backend::Egl).unwrap();
    let views = [(perspective(60.0, SIZE), 1), (orthographic(0.1, SIZE), 2)];
    for (view, projection) in views.map(|(projection, seed)| (rubble(SIZE, projection, seed, 8.0..10.0), projection)) {
        for snap in [Snap::Sample, Snap::None, Snap::Step] {
            for (exit, bias, clamp) in [
                (Exit::Paper, 0.0, Clamp::Position),
                (Exit::Shorten, 0.4, Clamp::Depth),
                (Exit::Shorten, 0.0, Clamp::Position),
            ] {
                // The two methods have different tiles.
                let jitter = Jitter::None;
                let chapter = Settings { snap, exit, bias, clamp, jitter, steps: 12, ..rig::raw(Method::Hbao, 2.0) };
                let view_ray = Settings {
                    method: Method::HbaoView,
                    zenith: Zenith::Axis,
                    spacing: 1.0,
                    quadrature: Quadrature::End,
                    ..chapter.clone()
                };
                let text = format!("{projection:?} {snap:?} {exit:?} {bias} {clamp:?}");
                assert!(view.by_twin(&view_ray).texels == view.by_twin(&chapter).texels, "twins: {text}");
                let unsure = hbao::reference::ambiguous(&view.twin_inputs(&rotation_tile(&chapter)), &chapter).unwrap();
                let [got, expected] = [&view_ray, &chapter].map(|settings| view.by_shader(context.gl(), settings));
                hold("shaders", &got, &expected.map(f64::from), &unsure.map(|a| !a), everywhere(FLOAT), &text);
                assert!(expected.texels.iter().any(|&a| a < 0.9), "{text}");
            }
        }
    }
}

/// R = 8.8, 4 directions to the right, up, left and down, and no jitter, in an orthographic view from straight above.
fn right_angles(steps: u32, spacing: f64, quadrature: Quadrature) -> Settings {
    Settings { directions: 4, steps, spacing, quadrature, jitter: Jitter::None, ..raw(8.8) }
}

/// Compares the shader and the twin with a visibility that depends only on a texel's column.
#[track_caller]
fn hold_columns(view: &ByHand, settings: &Settings, skip: &[usize], expected: impl Fn(usize) -> f64) {
    let context = Context::open(Backend::Egl).unwrap();
    let expected = Image::from_fn(view.depth.width, view.depth.height, |x, _| expected(x));
    let mask = Image::from_fn(view.depth.width, view.depth.height, |x, _| !skip.contains(&x));
    for (who, got) in view.by_both(context.gl(), settings) {
        hold(who, &got, &expected, &mask, everywhere(FLOAT), &settings.to_toml().to_string());
    }
}

/// On a floor that faces the eye, t = 0, so a column of height h at m texels occludes by h / sqrt(m^2 + h^2) times W.
/// With 3 steps, samples are meant to be at 2.2, 4.4 and 6.6 texels, and q is 0, 1/2 and 2/3. With the spacing 2 they
/// are meant to be at 0.55, 2.2 and 4.95 texels. The first is moved to 1, and q is 0, 1/4 and 4/9.
#[test]
fn each_quadrature_weighs_a_rise_by_its_closed_form() {
    const H: f64 = 3.0;
    for (spacing, at) in [(1.0, [(2, 0.0), (4, 0.5), (7, 2.0 / 3.0)]), (2.0, [(1, 0.0), (2, 0.25), (5, 4.0 / 9.0)])] {
        for attenuation in [Attenuation::Quadratic, Attenuation::Linear, Attenuation::None] {
            for &quadrature in Quadrature::ALL {
                let settings = Settings { attenuation, ..right_angles(3, spacing, quadrature) };
                let w = |u: f64| match attenuation {
                    Attenuation::Quadratic => 1.0 - u * u,
                    Attenuation::Linear => 1.0 - u,
                    _ => 1.0,
                };
                hold_columns(&columns(0.0, &[(20, H)]), &settings, &[], |x| {
                    let m = x.abs_diff(20);
                    let Some((_, q)) = at.iter().find(|(place, _)| *place == m) else { return 1.0 };
                    let r = ((m * m) as f64 + H * H).sqrt();
                    let u = r / 8.8;
                    let ends = (w(q * u) + w(u)) / 2.0;
                    let weight = match quadrature {
                        Quadrature::End => w(u),
                        Quadrature::Mean => (1.0 + w(u)) / 2.0,
                        Quadrature::Interval => ends,
                        _ => ends * (1.0 + (1.0 - q * q) * (0.75 - H / r) / 4.0),
                    };
                    1.0 - weight * H / r / 4.0
                });
            }
        }
    }
}

/// The first column is met at 4 texels and the second, which rises above it, at 8. The mean of the second's rise takes
/// W at the first.
#[test]
fn the_mean_of_two_ends_takes_the_last_accepted_sample() {
    let (low, high) = (3.0, 10.0);
    let settings = Settings { radius: Radius::Units(16.0), ..right_angles(3, 1.0, Quadrature::Mean) };
    let met = |m: f64, h: f64| (h / m.hypot(h), 1.0 - (m * m + h * h) / 256.0);
    let ((s1, w1), (s2, w2)) = (met(4.0, low), met(8.0, high));
    assert!(s2 > s1);
    let occlusion = (1.0 + w1) / 2.0 * s1 + (w1 + w2) / 2.0 * (s2 - s1);
    let skip: Vec<usize> = (0..41).filter(|&x| x != 16).collect();
    hold_columns(&columns(0.0, &[(20, low), (24, high)]), &settings, &skip, |_| 1.0 - occlusion / 4.0);
}

/// A floor and a wall at right angles, both at 45 degrees, seen from straight above, in a picture of 2 `half` texels.
fn valley(half: usize) -> ByHand {
    let x_of = |x: usize| x as f64 + 0.5 - half as f64;
    heights((2 * half as u32, 2 * half as u32), |x, _| x_of(x).abs(), |x, _| [x_of(x).signum(), 0.0])
}

/// Returns the RMSE from rays on the slope of a valley of 90 `times` texels, from 2.5 to 26.5 texels from the crease
/// for every 45 of its half width.
fn error_in_the_valley(times: usize, settings: impl Fn(f64) -> Settings) -> f64 {
    let half = 45 * times;
    let radius = half as f64 * 8.0 / 9.0;
    let a = valley(half).by_twin(&settings(radius));
    let away = (2 * times..=26 * times).step_by(times);
    let differences = away.map(|away| {
        let q = (away as f64 + 0.5) * 2f64.sqrt() / radius;
        a.at(half + away, half) - (1.0 - (1.0 - q).max(0.0).powi(2) / 2.0)
    });
    (differences.map(|d| d * d).sum::<f64>() / 25.0).sqrt()
}

/// Nothing of the valley is hidden from the eye. The error falls to nothing as the work grows.
#[test]
fn with_more_samples_and_texels_a_valley_becomes_as_open_as_to_rays() {
    for quadrature in [Quadrature::Expected, Quadrature::Interval, Quadrature::End] {
        let of = |directions, steps, quadrature| {
            move |radius| Settings { directions, steps, quadrature, jitter: Jitter::None, ..raw(radius) }
        };
        let errors = [(1, 4, 4), (2, 16, 16), (4, 64, 64)]
            .map(|(times, directions, steps)| error_in_the_valley(times, of(directions, steps, quadrature)));
        assert!(
            errors[1] < 0.6 * errors[0] && errors[2] < 0.6 * errors[1] && errors[2] < 0.01,
            "{quadrature:?}: {errors:?}"
        );
    }
}

/// The mean over an interval loses its correction as the intervals shrink, and the mean of two ends where every sample
/// raises the horizon.
#[test]
fn the_quadratures_agree_in_the_limit() {
    const HALF: usize = 90;
    let view = valley(HALF);
    let spread = |steps: u32| {
        let of = |quadrature| view.by_twin(&Settings { steps, quadrature, ..raw(80.0) }).at(HALF + 10, HALF);
        let all = [Quadrature::End, Quadrature::Mean, Quadrature::Interval].map(of);
        all.iter().copied().fold(f64::MIN, f64::max) - all.iter().copied().fold(f64::MAX, f64::min)
    };
    let spreads = [4, 16, 64].map(spread);
    assert!(spreads[1] < 0.5 * spreads[0] && spreads[2] < 0.5 * spreads[1], "{spreads:?}");
}

/// In perspective too: of a floor and a wall that the camera sees completely, the converged method is as open as to
/// rays.
#[test]
fn converged_in_perspective_it_meets_rays_on_what_the_eye_sees() {
    const SIZE: (usize, usize) = (160, 120);
    let shot = scenes::floor_and_wall();
    let camera = shot.camera((SIZE.0 as u32, SIZE.1 as u32));
    let surfaces = gbuffer(&shot.mesh, &camera, SIZE, Normals::Derivative, [0.0; 2]);
    let depth = surfaces.map(|s| s.depth as f32);
    let normals = surfaces.map(|s| s.normal.as_vec3().to_array());
    let view = ByHand { depth, normals, projection: camera.projection };
    let settings = Settings { attenuation: Attenuation::Quadratic, ..raw(0.4) };
    // Pixels whose R lies inside the picture, where neither the wall's top nor the floor behind it is near.
    let pixels: Vec<usize> = (0..SIZE.0 * SIZE.1)
        .filter(|i| {
            let (x, y) = (i % SIZE.0, i / SIZE.0);
            (53..107).contains(&x) && (40..63).contains(&y) && x % 4 == 0 && y % 3 == 0
        })
        .filter(|&i| view.depth.texels[i].is_finite())
        .collect();
    assert!(pixels.len() > 50, "{}", pixels.len());
    let truth = Truth::new(&shot.mesh, &camera, SIZE, &settings, 1024).unwrap();
    let Traced { visibility: traced, .. } = truth.trace(&pixels, |_| {});
    let by = |settings: &Settings| converged(&view.twin_inputs(&rotation_tile(settings)), settings, &pixels).unwrap();
    let rmse =
        |all: &[f64]| (all.iter().zip(&traced).map(|(a, t)| (a - t).powi(2)).sum::<f64>() / all.len() as f64).sqrt();
    let mean = traced.iter().sum::<f64>() / traced.len() as f64;
    assert!(mean < 0.95, "these pixels are hardly occluded: {mean}");
    let (about_v, about_z) = (by(&settings), by(&Settings { zenith: Zenith::Axis, ..settings.clone() }));
    assert!(rmse(&about_v) < 0.02, "{} about v, {} about z", rmse(&about_v), rmse(&about_z));
}

#[test]
fn steps_rounded_at_once_with_a_spacing_are_refused_everywhere() {
    let context = Context::open(Backend::Egl).unwrap();
    let view = rubble((4, 3), perspective(60.0, (4, 3)), 1, 8.0..9.0);
    let settings = Settings { snap: Snap::Step, spacing: 2.0, ..raw(1.0) };
    let refusals = [
        settings.validate().unwrap_err(),
        AmbientOcclusion::new(context.gl().clone(), (4, 3), &settings).err().unwrap(),
        visibility(&view.twin_inputs(&rotation_tile(&settings)), &settings).unwrap_err(),
    ];
    for error in refusals {
        assert!(error.is_usage() && error.to_string().contains("give --snap sample, or --spacing 1"), "{error}");
    }
    for allowed in [
        Settings { spacing: 1.0, ..settings.clone() },
        Settings { snap: Snap::None, ..settings.clone() },
        // A method that reads no spacing has even steps.
        Settings { method: Method::Hbao, ..settings.clone() },
    ] {
        allowed.validate().unwrap();
        AmbientOcclusion::new(context.gl().clone(), (4, 3), &allowed).unwrap();
    }
}

#[test]
fn random_heights_match_the_twin_under_every_way_to_take_and_weigh_samples() {
    let context = Context::open(Backend::Osmesa).unwrap();
    // The texels are wider than high.
    let wide = Projection::Perspective(Extents::centred(1.1, 0.5));
    for (seed, projection) in [(3, wide), (4, orthographic(0.1, SIZE))] {
        let view = rubble(SIZE, projection, seed, 8.0..10.0);
        for (snap, spacing) in
            [(Snap::Step, 1.0), (Snap::Sample, 1.5), (Snap::None, 1.5), (Snap::Sample, 2.7), (Snap::None, 1.0)]
        {
            for clamp in [Clamp::Position, Clamp::Depth] {
                for (zenith, quadrature, attenuation) in [
                    (Zenith::View, Quadrature::Expected, Attenuation::Linear),
                    (Zenith::View, Quadrature::Mean, Attenuation::Quadratic),
                    (Zenith::Axis, Quadrature::Expected, Attenuation::Quadratic),
                    (Zenith::Axis, Quadrature::End, Attenuation::None),
                ] {
                    let few = Settings { directions: 6, steps: 6, ..raw(2.0) };
                    let settings = Settings { snap, spacing, clamp, zenith, quadrature, attenuation, ..few };
                    let got = view.by_shader(context.gl(), &settings);
                    let tile = rotation_tile(&settings);
                    twin::hold_visibility(&got, &view.twin_inputs(&tile), &settings, &settings.to_toml());
                }
            }
        }
    }
}
