//! Everything else is measured against ray-traced ambient occlusion. These tests check that it matches closed forms
//! within the noise that it states, and that a brute-force tracer of another kind agrees with it ray by ray.

use crate::rig;
use crate::rig::random::Draw;
use glam::{DVec3, dvec3};
use hbao::Settings;
use hbao::reference::trace::Tracer;
use hbao::reference::truth::{Traced, Truth, Weight};
use hbao::scene::{Camera, Lens, Mesh, Scene, View};
use hbao::settings::{Attenuation, Method, Radius};
use std::f64::consts::{PI, TAU};

/// A distance that is large enough for a plane to count as infinite.
const FAR: f64 = 1e3;

fn mesh(quads: &[[DVec3; 4]]) -> Mesh {
    let positions: Vec<DVec3> = quads.iter().flatten().copied().collect();
    let triangles =
        (0..quads.len() as u32).flat_map(|i| [[4 * i, 4 * i + 1, 4 * i + 2], [4 * i, 4 * i + 2, 4 * i + 3]]);
    Mesh::new(positions, triangles.collect()).unwrap()
}

/// A camera with one pixel that looks from `eye` at `target`.
fn camera(mesh: &Mesh, eye: DVec3, target: DVec3) -> Camera {
    let lens = Some(Lens::FovY(10f64.to_radians()));
    let view = View { eye: Some(eye), target: Some(target), lens, near: Some(1e-3), ..View::default() };
    view.camera(mesh, 1, 1).unwrap().0
}

/// Returns A at one point, computed with this number of rays, and its noise.
fn at(mesh: &Mesh, eye: DVec3, target: DVec3, settings: &Settings, rays: u32) -> (f64, f64) {
    weighted(mesh, eye, target, settings, rays, Weight::Uniform)
}

/// Returns the same for directions that count differently.
fn weighted(mesh: &Mesh, eye: DVec3, target: DVec3, settings: &Settings, rays: u32, weight: Weight) -> (f64, f64) {
    let camera = camera(mesh, eye, target);
    let truth = Truth::new(mesh, &camera, (1, 1), settings, rays).unwrap().weighted(weight);
    let Traced { visibility, covered, .. } = truth.trace(&[0], |_| {});
    assert_eq!(covered, [true]);
    // The noise cannot be estimated from one pixel. For a share of N random rays it is at most 1/2 sqrt(1/N).
    (visibility[0], 0.5 / f64::from(rays).sqrt())
}

fn of(radius: f64, attenuation: Attenuation) -> Settings {
    Settings { radius: Radius::Units(radius), attenuation, ..Settings::default() }
}

/// A floor, and a wall that stands on it at x = 0.
fn corner() -> Mesh {
    mesh(&[
        [dvec3(-FAR, 0., -FAR), dvec3(FAR, 0., -FAR), dvec3(FAR, 0., FAR), dvec3(-FAR, 0., FAR)],
        [dvec3(0., 0., -FAR), dvec3(0., 0., FAR), dvec3(0., FAR, FAR), dvec3(0., FAR, -FAR)],
    ])
}

#[test]
fn a_floor_at_a_distance_from_a_wall_is_as_open_as_the_closed_form_says() {
    let corner = corner();
    for q in [0.05, 0.3, 0.7, 0.99, 1.2f64] {
        let radius = 2.0;
        let at_q = |attenuation| {
            let target = dvec3(q * radius, 0., 0.);
            at(&corner, target + dvec3(1.0, 3.0, 0.5), target, &of(radius, attenuation), 16384)
        };
        let inside = q.min(1.0);
        for (attenuation, expected) in [
            (Attenuation::None, (1.0 + inside) / 2.0),
            (Attenuation::Quadratic, 1.0 - (1.0 - inside).powi(2) / 2.0),
            (Attenuation::Linear, 1.0 - (1.0 - inside + inside * inside.ln()) / 2.0),
        ] {
            let (a, noise) = at_q(attenuation);
            assert!((a - expected).abs() < 3.0 * noise, "q = {q}, {attenuation:?}: {a}, not {expected}");
        }
    }
}

/// Seen from straight above, the directions that meet the wall within R fill the segment x >= q of the unit disc, and
/// a direction at x meets it at the distance q R / x. The cosine weight makes the disc's area the measure.
#[test]
fn a_floor_at_a_distance_from_a_wall_is_as_open_as_the_closed_form_says_with_the_cosine_too() {
    let corner = corner();
    for q in [0.05, 0.3, 0.7, 0.99, 1.2f64] {
        let radius = 2.0;
        let c = q.min(1.0);
        let (angle, s) = (c.acos(), (1.0 - c * c).sqrt());
        for (attenuation, occluded) in [
            (Attenuation::None, angle - c * s),
            (Attenuation::Quadratic, (1.0 + 2.0 * c * c) * angle - 3.0 * c * s),
            (Attenuation::Linear, angle + c * s - 2.0 * c * s.atanh()),
        ] {
            let expected = 1.0 - occluded / PI;
            let target = dvec3(q * radius, 0., 0.);
            let eye = target + dvec3(1.0, 3.0, 0.5);
            let (a, noise) = weighted(&corner, eye, target, &of(radius, attenuation), 16384, Weight::Cosine);
            assert!((a - expected).abs() < 3.0 * noise, "q = {q}, {attenuation:?}: {a}, not {expected}");
        }
    }
}

#[test]
fn a_wedge_is_open_by_its_angle_and_with_the_cosine_by_what_it_covers_of_the_disc() {
    for degrees in [10.0, 45.0, 90.0, 135.0, 170.0f64] {
        let delta = degrees.to_radians();
        let up = FAR * dvec3(delta.cos(), delta.sin(), 0.0);
        let along = dvec3(0., 0., FAR);
        let wedge = mesh(&[
            [-along, dvec3(FAR, 0., -FAR), dvec3(FAR, 0., FAR), along],
            [-along, up - along, up + along, along],
        ]);
        let target = dvec3(1.0, 0., 0.);
        // The eye is inside the wedge.
        let eye = target + 0.4 * delta.sin().min(0.5) * dvec3((delta / 2.0).cos(), (delta / 2.0).sin(), 0.1);
        let (a, noise) = at(&wedge, eye, target, &of(1e6, Attenuation::None), 16384);
        let expected = delta / PI;
        assert!((a - expected).abs() < 3.0 * noise + 2e-3, "{degrees} degrees: {a}, not {expected}");
        let (a, noise) = weighted(&wedge, eye, target, &of(1e6, Attenuation::None), 16384, Weight::Cosine);
        let expected = (1.0 - delta.cos()) / 2.0;
        assert!((a - expected).abs() < 3.0 * noise + 2e-3, "{degrees} degrees, cosine: {a}, not {expected}");
    }
}

/// A sphere made of 64 rows of quads. It is slightly smaller than the true sphere.
fn sphere(centre: DVec3, radius: f64) -> Vec<[DVec3; 4]> {
    const ROWS: usize = 64;
    let point = |column: usize, row: usize| {
        let (a, b) = (column as f64 / ROWS as f64 * TAU, row as f64 / ROWS as f64 * PI);
        centre + radius * dvec3(b.sin() * a.cos(), b.cos(), b.sin() * a.sin())
    };
    let quad = |i: usize| {
        let (column, row) = (i % ROWS, i / ROWS);
        [point(column, row), point(column + 1, row), point(column + 1, row + 1), point(column, row + 1)]
    };
    (0..ROWS * ROWS).map(quad).collect()
}

#[test]
fn a_sphere_above_a_plane_hides_its_solid_angle() {
    for (s, l) in [(0.5, 2.0), (0.9, 1.0), (0.2, 3.0f64)] {
        let mut quads = vec![[dvec3(-9., 0., -9.), dvec3(9., 0., -9.), dvec3(9., 0., 9.), dvec3(-9., 0., 9.)]];
        // The sphere is not straight above the point, but still entirely above the plane.
        let centre = l * dvec3(0.3, (1.0f64 - 0.09).sqrt(), 0.0);
        assert!(centre.y > s);
        quads.extend(sphere(centre, s));
        let (mesh, eye, settings) = (mesh(&quads), dvec3(0.0, 0.02, 4.0), of(1e3, Attenuation::None));
        let (a, noise) = at(&mesh, eye, DVec3::ZERO, &settings, 16384);
        let expected = (1.0 - (s / l).powi(2)).sqrt();
        // 64 rows of quads cover a thousandth less than the sphere.
        assert!((a - expected).abs() < 3.0 * noise + 2e-3, "{s} at {l}: {a}, not {expected}");
        // With the cosine, what counts is the area of the sphere's shadow on the disc.
        let (a, noise) = weighted(&mesh, eye, DVec3::ZERO, &settings, 16384, Weight::Cosine);
        let expected = 1.0 - (s / l).powi(2) * centre.y / l;
        assert!((a - expected).abs() < 3.0 * noise + 2e-3, "{s} at {l}, cosine: {a}, not {expected}");
    }
}

#[test]
fn both_sides_of_a_triangle_occlude_and_are_seen() {
    let corner = corner();
    let turned = Mesh::new(corner.positions.clone(), corner.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect());
    let target = dvec3(0.6, 0., 0.);
    let settings = of(2.0, Attenuation::None);
    let see = |mesh: &Mesh, eye: DVec3| at(mesh, eye, target, &settings, 4096).0;
    let [above, below] = [dvec3(1.6, 3., 0.5), dvec3(1.6, -3., 0.5)];
    assert_eq!(see(&corner, above), see(&turned.unwrap(), above));
    assert_eq!(see(&corner, below), 1.0, "nothing occludes the underside of the floor");
}

#[test]
fn the_noise_said_is_the_noise_there_is_and_falls_with_more_rays() {
    let scene = Scene::open("cornell-box").unwrap();
    let camera = scene.view.camera(&scene.mesh, 24, 18).unwrap().0;
    let settings = of(150.0, Attenuation::Quadratic);
    let pixels: Vec<usize> = (0..24 * 18).collect();
    let traced = |rays| Truth::new(&scene.mesh, &camera, (24, 18), &settings, rays).unwrap().trace(&pixels, |_| {});
    let best = traced(16384);
    let mut previous = f64::INFINITY;
    for rays in [16, 64, 256, 1024] {
        let some = traced(rays);
        assert_eq!(some.covered, best.covered);
        let squares = some.visibility.iter().zip(&best.visibility).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        let covered = best.covered.iter().filter(|&&covered| covered).count();
        let noise = (squares / covered as f64).sqrt();
        // From some 240 pixels, the variance is known to about a tenth.
        assert!((noise / some.noise_rmse - 1.0).abs() < 0.3, "{rays}: {noise}, but {} is stated", some.noise_rmse);
        // Four times as many independent random rays would halve the noise. Stratified rays reduce it further.
        assert!(some.noise_rmse < 0.5 * previous, "{rays}: {} after {previous}", some.noise_rmse);
        previous = some.noise_rmse;
    }
}

#[test]
fn a_subset_of_pixels_in_any_order_gives_the_same_numbers() {
    let scene = Scene::open("cornell-box").unwrap();
    let camera = scene.view.camera(&scene.mesh, 24, 18).unwrap().0;
    let truth = Truth::new(&scene.mesh, &camera, (24, 18), &of(150.0, Attenuation::Linear), 16).unwrap();
    let all: Vec<usize> = (0..24 * 18).collect();
    let whole = truth.trace(&all, |_| {});
    let some: Vec<usize> = all.iter().rev().copied().step_by(7).collect();
    let part = truth.trace(&some, |_| {});
    assert!(some.iter().zip(&part.visibility).all(|(&i, a)| whole.visibility[i] == *a));
    assert!(
        whole.visibility.iter().all(|a| (0.0..=1.0).contains(a))
            && whole.covered.contains(&false)
            && whole.covered.contains(&true)
    );
}

#[test]
fn an_odd_number_of_rays_and_a_radius_in_percent_are_refused() {
    let scene = Scene::open("cornell-box").unwrap();
    let camera = scene.view.camera(&scene.mesh, 4, 4).unwrap().0;
    for rays in [0, 1, 7] {
        assert!(Truth::new(&scene.mesh, &camera, (4, 4), &of(1.0, Attenuation::None), rays).is_err());
    }
    assert!(Truth::new(&scene.mesh, &camera, (4, 4), &Settings::for_scene(Method::Hbao), 4).is_err());
}

/// Intersects triangles in another way: with edges and determinants (Moller and Trumbore 1997), and without a
/// hierarchy.
fn brute_force(mesh: &Mesh, origin: DVec3, ray: DVec3, farthest: f64, but: usize) -> Option<f64> {
    let meet = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
        let (e1, e2) = (b - a, c - a);
        let p = ray.cross(e2);
        let determinant = e1.dot(p);
        let t = origin - a;
        let u = t.dot(p) / determinant;
        let q = t.cross(e1);
        let (v, distance) = (ray.dot(q) / determinant, e2.dot(q) / determinant);
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 1e-9 && distance <= farthest).then_some(distance)
    };
    let hits = mesh.triangles.iter().enumerate().filter(|&(i, _)| i != but).filter_map(|(_, triangle)| meet(triangle));
    hits.min_by(f64::total_cmp)
}

#[test]
fn a_brute_force_tracer_agrees_ray_by_ray() {
    let shots = [rig::scenes::cornell_box(), rig::scenes::ball(), rig::scenes::box_on_a_floor()];
    for shot in shots {
        let camera = shot.camera((8, 8));
        let truth = Truth::new(&shot.mesh, &camera, (8, 8), &of(shot.radius, Attenuation::None), 2).unwrap();
        let tracer = Tracer::new(&shot.mesh);
        let mut draw = Draw::new(11);
        let (mut rays, mut hits) = (0, 0);
        for _ in 0..20_000 {
            // The ray starts anywhere on a triangle, visible to the camera or not, and has any direction.
            let own = (draw.unit() * shot.mesh.triangles.len() as f64) as usize;
            let [a, b, c] = shot.mesh.triangles[own].map(|i| shot.mesh.positions[i as usize]);
            let (u, v) = (draw.unit(), draw.unit());
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let point = a + u * (b - a) + v * (c - a);
            let ray = DVec3::new(draw.signed(), draw.signed(), draw.signed());
            // For a ray in the plane of its own triangle, rounding would decide the result.
            if ray.length() < 0.1 || ray.normalize().dot(tracer.normal(own)).abs() < 1e-3 {
                continue;
            }
            let ray = ray.normalize();
            let got = truth.occluder(point, ray, own).map(|hit| hit.t);
            let expected = brute_force(&shot.mesh, point, ray, shot.radius, own);
            rays += 1;
            hits += usize::from(got.is_some());
            match (got, expected) {
                (Some(got), Some(expected)) => assert!((got - expected).abs() < 1e-9 * shot.radius.max(1.0)),
                (got, expected) => assert_eq!(got, expected, "{}: from {point} along {ray}", shot.name),
            }
        }
        assert!(hits > 1000 && rays - hits > 1000, "{}: {hits} of {rays}", shot.name);
    }
}
