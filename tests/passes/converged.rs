//! The result of a method converges as the number of samples grows, and the converged method is the limit. On surfaces
//! that a depth image shows completely, it equals the ray-traced truth.

use crate::rig;
use crate::rig::by_hand::{ByHand, heights, orthographic, perspective, plane};
use crate::rig::{SIZE, Shot, scenes};
use glam::DVec3;
use hbao::reference::{converged, converges, gbuffer, visibility};
use hbao::scene::{Mesh, View};
use hbao::settings::{Attenuation, Clamp, Grounding, Jitter, Method, Radius, Snap};
use hbao::{Settings, rotation_tile};

/// Returns the converged values of a view at these pixels (x, y).
fn at(view: &ByHand, settings: &Settings, pixels: &[(usize, usize)]) -> Vec<f64> {
    let indices: Vec<usize> = pixels.iter().map(|(x, y)| y * view.depth.width + x).collect();
    converged(&view.twin_inputs(&rotation_tile(settings)), settings, &indices).unwrap()
}

fn of(method: Method, radius: f64, attenuation: Attenuation) -> Settings {
    Settings { method, attenuation, ..rig::float_settings(radius) }
}

/// Two planes at 45 degrees that meet in a crease between two columns of texels, seen from straight above.
fn valley(half: usize) -> ByHand {
    let x_of = |x: usize| x as f64 + 0.5 - half as f64;
    heights((2 * half as u32, 2 * half as u32), |x, _| x_of(x).abs(), |x, _| [x_of(x).signum(), 0.0])
}

/// A floor that faces the eye, and to the right of `foot` another floor that is `high` above it.
fn step(foot: usize, high: f64) -> ByHand {
    heights((2 * foot as u32, 2 * foot as u32), |x, _| if x >= foot { high } else { 0.0 }, |_, _| [0.0; 2])
}

#[test]
fn every_plane_is_open() {
    const SIZE: (u32, u32) = (21, 15);
    let pixels: Vec<_> = (0..15).flat_map(|y| (0..21).map(move |x| (x, y))).collect();
    let mut surfaces = 0;
    for (tilt, turn) in [(0.0, 0.0), (20.0, 37.0), (45.0, 90.0), (70.0, 211.0), (80.0, 300.0), (110.0, 37.0f64)] {
        let ((sin, cos), (s, c)) = (f64::to_radians(tilt).sin_cos(), turn.to_radians().sin_cos());
        let n = DVec3::new(sin * c, sin * s, -cos);
        let mut views: Vec<ByHand> =
            [20.0, 60.0, 120.0].map(|fov| plane(perspective(fov, SIZE), SIZE, n, -3.0 * n.z.abs())).into();
        if n.z < 0.0 {
            views.push(plane(orthographic(0.1, SIZE), SIZE, n, 5.0 * n.z));
        }
        for view in views {
            surfaces += view.covered().texels.iter().filter(|&&covered| covered).count();
            // These are the methods that start from the surface's tangent.
            for method in rig::methods().filter(|&method| converges(method) && method.reads("bias")) {
                let settings = Settings { radius: Radius::Units(2.0), ..Settings::for_method(method) };
                let least = at(&view, &settings, &pixels).into_iter().fold(1.0, f64::min);
                assert!(least > 1.0 - 1e-3, "{}: {least} at {tilt} degrees, {:?}", method.name(), view.projection);
            }
        }
    }
    assert!(surfaces > 4_000, "{surfaces}");
}

/// The valley is a floor and a wall at right angles, and nothing of it is hidden. The converged method therefore has
/// the same closed forms as ray tracing, with q = d/R. No sample is nearer to the crease than half a texel, and none is
/// farther away than R minus half a texel.
#[test]
fn a_wall_on_a_floor_is_as_open_as_to_rays() {
    const HALF: usize = 72;
    let valley = valley(HALF);
    for away in [3, 8, 16, 30, 45] {
        let d = (away as f64 + 0.5) * 2f64.sqrt();
        let q = d / 64.0;
        for (attenuation, rays) in [
            (Attenuation::None, (1.0 + q) / 2.0),
            (Attenuation::Quadratic, 1.0 - (1.0 - q).powi(2) / 2.0),
            (Attenuation::Linear, 1.0 - (1.0 - q + q * q.ln()) / 2.0),
        ] {
            let a = at(&valley, &of(Method::Hbao, 64.0, attenuation), &[(HALF + away, HALF)])[0];
            // With W = 1 a whole texel at R is missing; with the others its weight is 0. Near the crease, snapping
            // moves samples.
            assert!((a - rays).abs() < 0.004, "q = {q}, {attenuation:?}: {a}, rays {rays}");
        }
    }
}

/// This shows why the converged method compares how far samples rise above their own tangents. One sample per texel,
/// each snapped on its own and compared with the tangent of its direction, makes the valley too open, and a finer image
/// does not help.
#[test]
fn a_sample_every_texel_over_the_directions_tangent_leaves_a_valley_too_open() {
    for (half, away) in [(45, 5), (90, 10)] {
        let view = valley(half);
        let radius = half as f64 * 8.0 / 9.0;
        let settings = Settings {
            directions: 64,
            steps: radius as u32 - 1,
            snap: Snap::Sample,
            jitter: Jitter::None,
            blur: 0,
            ..of(Method::Hbao, radius, Attenuation::Quadratic)
        };
        let pixel = (half + away, half);
        let by_samples = view.by_twin(&settings).at(pixel.0, pixel.1);
        let rays = 1.0 - (1.0 - (away as f64 + 0.5) * 2f64.sqrt() / radius).powi(2) / 2.0;
        let limit = at(&view, &settings, &[pixel])[0];
        assert!(by_samples > rays + 0.01 && (limit - rays).abs() < 0.004, "{by_samples}, {limit}; rays {rays}");
    }
}

/// The top of the wall is h high and m texels away. In direction theta it is met at m / cos(theta), which is within R
/// if sin(theta) is below u = sqrt(1 - m^2/(R^2 - h^2)). With W = 1, A = 1 - asin(u h / sqrt(h^2 + m^2)) / pi.
///
/// On a floor that faces the eye, t = 0 and each direction has one occluder, so the talk's horizon equals the
/// chapter's.
#[test]
fn a_step_on_a_floor_has_its_closed_form() {
    const FOOT: usize = 64;
    let (h, radius) = (9.0, 40.0f64);
    let view = step(FOOT, h);
    for m in [4, 8, 16, 30] {
        let pixel = [(FOOT - m, FOOT)];
        let closed = |m: f64| {
            let u = (1.0 - m * m / (radius * radius - h * h)).sqrt();
            1.0 - (u * h / (h * h + m * m).sqrt()).asin() / std::f64::consts::PI
        };
        // Two effects move the result. A sample is snapped to the wall's first texel from half a texel before that
        // texel's centre. And the outermost of 64 directions that meet the wall stands for a range of directions, not
        // all of which meet it.
        let (least, most) = (closed(m as f64 - 0.5) - 0.004, closed(m as f64) + 0.004);
        let [chapter, talk] =
            [Method::Hbao, Method::HbaoTalk].map(|method| at(&view, &of(method, radius, Attenuation::None), &pixel)[0]);
        assert!((least..most).contains(&chapter), "{m}: {chapter}, not from {least} to {most}");
        assert!((chapter - talk).abs() < 1e-12, "{m}: {chapter} and {talk}");
        // A radius that ends before the wall meets nothing.
        assert!(at(&view, &of(Method::Hbao, m as f64 - 1.0, Attenuation::None), &pixel)[0] == 1.0);
    }
}

/// For spheres these are the closed forms of `claims.rs`. For creases it is the mean along R of h/|D| on the wall's
/// top.
#[test]
fn spheres_and_creases_converge_to_their_integrals() {
    const HALF: usize = 72;
    let (away, r) = (9, 4.0f64);
    let d = (away as f64 + 0.5) * 2f64.sqrt();
    let spheres = (r.acosh() - (1.0 - 1.0 / (r * r)).sqrt()) / (2.0 * 2f64.sqrt());
    let a = at(&valley(HALF), &of(Method::Microsphere, r * d, Attenuation::None), &[(HALF + away, HALF)])[0];
    assert!((a - (1.0 - spheres)).abs() < 0.005, "{a}, not {}", 1.0 - spheres);

    let (h, m, radius) = (9.0f64, 8, 40.0f64);
    let reach = (radius * radius - h * h).sqrt();
    const ANGLES: u32 = 10_000;
    let closed = |m: f64| {
        let along = |k: u32| {
            let cosine = (std::f64::consts::TAU * (f64::from(k) + 0.5) / f64::from(ANGLES)).cos();
            let met = if cosine > 0.0 { m / cosine } else { f64::INFINITY };
            if met < reach { h / radius * ((reach / h).asinh() - (met / h).asinh()) } else { 0.0 }
        };
        1.0 - 2.0 * (0..ANGLES).map(along).sum::<f64>() / f64::from(ANGLES)
    };
    let view = step(64, h);
    let a = at(&view, &of(Method::Crease, radius, Attenuation::None), &[(64 - m, 64)])[0];
    let (least, most) = (closed(m as f64 - 0.5) - 0.002, closed(m as f64) + 0.002);
    assert!((least..most).contains(&a), "{a}, not from {least} to {most}");
}

/// Returns what a camera sees of a shot, with one ray per pixel.
fn seen(shot: &Shot, size: (u32, u32)) -> ByHand {
    let camera = shot.camera(size);
    let (width, height) = (size.0 as usize, size.1 as usize);
    let surfaces = gbuffer::gbuffer(&shot.mesh, &camera, (width, height), Settings::default().normals, [0.0; 2]);
    ByHand {
        depth: surfaces.map(|s| s.depth as f32),
        normals: surfaces.map(|s| s.normal.as_vec3().to_array()),
        projection: camera.projection,
    }
}

#[test]
fn error_against_it_falls_as_samples_grow() {
    let size = (120, 90);
    for (shot, radius) in [(scenes::nave(), 6.0), (scenes::box_on_a_floor(), 3.0)] {
        let view = seen(&shot, size);
        let base = Settings { jitter: Jitter::None, snap: Snap::Sample, ..rig::float_settings(radius) };
        // The limit takes long to compute, so every second pixel is compared, in the pattern of a chessboard.
        let all: Vec<(usize, usize)> = (0..90).flat_map(|y| (y % 2..120).step_by(2).map(move |x| (x, y))).collect();
        let limit = at(&view, &base, &all);
        assert!(limit.iter().filter(|&&a| a < 0.9).count() > 1000, "{}", shot.name);
        let mut previous = f64::INFINITY;
        for n in [2, 4, 8, 16] {
            let settings = Settings { directions: n, steps: n, ..base.clone() };
            let tile = rotation_tile(&settings);
            let got = visibility(&view.twin_inputs(&tile), &settings).unwrap();
            // Pixels of the chapter's early exit do not converge and are left out. Nearer than `deepest`, R covers more
            // than 17 texels, so that 16 steps are at least a texel long each.
            let tan = match view.projection {
                hbao::scene::Projection::Perspective(extents) => extents.half()[1],
                other => panic!("{other:?}"),
            };
            let deepest = (radius * 90.0 / (2.0 * tan * 17.0)) as f32;
            let counted = all.iter().zip(&limit).filter(|(at, _)| view.depth.at(at.0, at.1) < deepest);
            let squares: Vec<f64> = counted.map(|(at, limit)| (got.at(at.0, at.1) - limit).powi(2)).collect();
            assert!(squares.len() > 2000, "{}: {}", shot.name, squares.len());
            let rmse = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
            assert!(rmse < 0.75 * previous, "{} {n}: {rmse} after {previous}", shot.name);
            previous = rmse;
        }
    }
}

/// The limit must not depend on directions, steps, jitter, snapping, the blur, formats or half resolution.
#[test]
fn it_reads_the_method_and_nothing_of_its_samples() {
    let view = seen(&scenes::ball(), SIZE);
    let pixels: Vec<(usize, usize)> = (0..61).map(|y| (y + 17, y)).collect();
    let base = rig::float_settings(0.8);
    let limit = at(&view, &base, &pixels);
    assert!(limit.iter().any(|&a| a < 0.9) && limit.contains(&1.0), "{limit:?}");
    let same = Settings {
        directions: 3,
        steps: 100,
        rays: 1,
        snap: Snap::None,
        jitter: Jitter::None,
        half_res: true,
        blur: 0,
        msaa: 8,
        grounding: Grounding::Direction,
        ..base.clone()
    };
    assert_eq!(at(&view, &same, &pixels), limit);
    for other in [
        Settings { strength: 0.5, ..base.clone() },
        Settings { bias: 0.3, ..base.clone() },
        Settings { attenuation: Attenuation::Linear, ..base.clone() },
        Settings { clamp: Clamp::Depth, radius: Radius::Units(2.0), ..base.clone() },
        Settings { method: Method::HbaoTalk, ..base.clone() },
    ] {
        assert_ne!(at(&view, &other, &pixels), limit, "{}", other.to_toml());
    }
    assert!(at(&view, &Settings { method: Method::None, ..base }, &pixels).iter().all(|&a| a == 1.0));
}

/// Beyond the farthest corner of the image no sample raises a horizon, so R may be arbitrarily long.
#[test]
fn a_radius_far_beyond_the_scene_takes_no_longer_and_stays_finite() {
    let view = seen(&scenes::nave(), (33, 21));
    let pixels: Vec<(usize, usize)> = (0..21).map(|y| (y + 6, y)).collect();
    let [large, larger] =
        [1e4, 1e30].map(|radius| at(&view, &of(Method::Hbao, radius, Attenuation::Quadratic), &pixels));
    assert!(large.iter().zip(&larger).all(|(a, b)| (a - b).abs() < 1e-4 && (0.0..=1.0).contains(a)));
    assert!(large.iter().any(|&a| a < 0.7), "{large:?}");
}

#[test]
fn what_has_no_converged_form_is_refused_and_so_is_a_pixel_outside() {
    let view = seen(&scenes::ball(), (16, 12));
    let of = |settings: &Settings, pixels: &[usize]| {
        converged(&view.twin_inputs(&rotation_tile(settings)), settings, pixels)
    };
    let base = rig::float_settings(1.0);
    for &method in Method::ALL.iter().filter(|&&method| !converges(method)) {
        let error = of(&Settings { method, ..base.clone() }, &[0]).unwrap_err().to_string();
        assert!(error.starts_with(&format!("{} has no converged form", method.name())) && error.lines().count() == 1);
    }
    assert!(of(&base, &[16 * 12]).unwrap_err().to_string().contains("outside the image of 16x12"));
    assert!(
        of(&Settings { radius: Radius::Percent(5.0), ..base.clone() }, &[0]).is_err(),
        "a radius in percent is refused"
    );
    assert!(of(&base, &[]).unwrap().is_empty());
    // Background is open.
    let nothing = Mesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], vec![[0, 1, 2]]).unwrap();
    let view =
        View { eye: Some(DVec3::new(0.0, 0.0, 5.0)), target: Some(DVec3::new(0.0, 0.0, 9.0)), ..View::default() };
    let empty = seen(&Shot::new("nothing", nothing, view, 1.0), (16, 12));
    assert!(empty.depth.texels.iter().all(|z| z.is_infinite()));
    assert_eq!(at(&empty, &base, &[(3, 4)]), [1.0]);
}
