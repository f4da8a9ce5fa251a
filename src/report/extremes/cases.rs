//! The cases at the extremes: views and settings.

use glam::{DVec3, dvec3};
use hbao::scene::{CORNELL_BOX, Lens, Mesh, Scene, View};
use hbao::settings::{AoFormat, DepthFormat, NormalFormat, Radius};
use hbao::{Error, Settings};

/// The size of the images in pixels. It does not depend on the size of the report, because rounding errors can be
/// measured on few pixels.
pub(super) const SIZE: (u32, u32) = (128, 96);
/// The size of images with thousands of samples per pixel, in pixels.
pub(super) const SMALL: (u32, u32) = (48, 36);
/// A size in pixels with as many rows as the papers' pictures, so that a texel covers an angle as small as theirs.
const TALL: (u32, u32) = (16, 1200);

/// The eye looks into the Cornell box from above its front, along none of its axes.
pub(super) const EYE: DVec3 = dvec3(100.0, 400.0, 20.0);
pub(super) const TARGET: DVec3 = dvec3(330.0, 160.0, 420.0);
pub(super) const FOV_Y: f64 = 60.0;
/// R, which is the default radius of the scene.
pub(super) const RADIUS: f64 = 150.0;

/// A view and a combination of settings, which are measured for one row of a table.
pub(super) struct Case {
    /// The name of the axis.
    pub(super) axis: &'static str,
    pub(super) name: String,
    /// The value on the axis, for drawings.
    pub(super) along: f64,
    pub(super) size: (u32, u32),
    /// The mesh, or the error with which it is refused.
    pub(super) mesh: Result<Mesh, Error>,
    pub(super) view: View,
    pub(super) settings: Settings,
}

/// Returns settings with one depth sample per pixel and float targets.
pub(super) fn float(radius: f64) -> Settings {
    Settings {
        msaa: 1,
        radius: Radius::Units(radius),
        ao_format: AoFormat::R32f,
        normal_format: NormalFormat::Rgba16f,
        ..Settings::default()
    }
}

fn lens(degrees: f64) -> Option<Lens> {
    Some(Lens::FovY(degrees.to_radians()))
}

fn looking(eye: DVec3, target: DVec3, lens: Option<Lens>) -> View {
    View { eye: Some(eye), target: Some(target), lens, ..View::default() }
}

/// Scales a mesh, and moves it away from the origin together with the view. The mesh is an error if it reaches further
/// than a mesh may.
fn moved(mesh: &Mesh, scale: f64, offset: DVec3) -> (Result<Mesh, Error>, View) {
    let place = |p: DVec3| scale * p + offset;
    let positions = mesh.positions.iter().map(|&p| place(p)).collect();
    (Mesh::new(positions, mesh.triangles.clone()), looking(place(EYE), place(TARGET), lens(FOV_Y)))
}

/// Returns the corners of a floor whose sides are twice as long as `half`.
fn floor(half: f64) -> Vec<DVec3> {
    [(-half, -half), (half, -half), (half, half), (-half, half)].map(|(x, z)| dvec3(x, 0.0, z)).into()
}

/// Makes a floor that reaches just beyond the picture, with a wall on it. The view is orthographic, at this angle above
/// the floor.
fn grazing(degrees: f64) -> (Result<Mesh, Error>, View) {
    let angle = degrees.to_radians();
    let wall = [(-20.0, 0.0), (15.0, 0.0), (15.0, 30.0), (-20.0, 30.0)].map(|(x, y)| dvec3(x, y, -0.3 * x));
    let corners = floor(100.0 / angle.sin()).into_iter().chain(wall).collect();
    let mesh = Mesh::new(corners, vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]);
    let eye = (200.0 + 60.0 / angle.tan()) * dvec3(0.2, 1.02 * angle.tan(), 1.0);
    (mesh, looking(eye, DVec3::ZERO, Some(Lens::Height(80.0))))
}

/// Makes a large floor. The picture shows a small part of it, seen from a height of 1.
fn large(half: f64) -> (Result<Mesh, Error>, View) {
    let view = looking(dvec3(0.3, 1.0, 1.0), DVec3::ZERO, lens(40.0));
    (Mesh::new(floor(half), vec![[0, 1, 2], [0, 2, 3]]), View { near: Some(0.1), far: Some(100.0), ..view })
}

/// Returns all cases. Cases with the same settings stand next to each other.
pub(super) fn cases() -> Result<Vec<Case>, Error> {
    let cornell = Scene::open(CORNELL_BOX)?.mesh;
    let base = || looking(EYE, TARGET, lens(FOV_Y));
    let mut cases = Vec::new();
    let mut add = |axis, name: String, along, (mesh, view): (Result<Mesh, Error>, View), settings| {
        cases.push(Case { axis, name, along, size: SIZE, mesh, view, settings });
    };
    let cornell_box = |view: View| (Ok(cornell.clone()), view);
    let middle = dvec3(278.0, 273.0, 280.0);
    let along = dvec3(0.3, -0.25, 1.0).normalize();
    let beside = |distance: f64, lens| looking(middle - distance * along, middle, lens);

    for k in [2, 6, 8] {
        let ratio = 10f64.powi(-k);
        let planes = |view: View, far: f64| View { near: Some(ratio * far), far: Some(far), ..view };
        add("near-far", format!("1e-{k}, perspective"), ratio, cornell_box(planes(base(), 1e3)), float(RADIUS));
        let parallel = beside(1.2e3, Some(Lens::Height(600.0)));
        add("near-far", format!("1e-{k}, orthographic"), ratio, cornell_box(planes(parallel, 1e4)), float(RADIUS));
    }
    for z in [5.0, 60.0, 200.0] {
        let fov = 2.0 * (2.0_f64 / z).atan().to_degrees();
        let view = beside(z * RADIUS, lens(fov));
        add("distance", format!("{z}, field of view {fov:.1}"), z, cornell_box(view), float(RADIUS));
    }
    let view = beside(300.0 / 0.5f64.to_radians().tan(), lens(1.0));
    add("distance", "229, field of view 1, 1200 rows".into(), 229.0, cornell_box(view), float(RADIUS));
    for k in 1..=6 {
        let view = beside(RADIUS * 10f64.powi(k), Some(Lens::Height(600.0)));
        add("distance", format!("1e{k}, orthographic"), 10f64.powi(k), cornell_box(view), float(RADIUS));
    }
    for k in [6, 9, 12, 14, 15] {
        let offset = 10f64.powi(k);
        add("offset", format!("1e{k}"), offset, moved(&cornell, 1.0, offset * dvec3(1.0, -0.7, 0.3)), float(RADIUS));
    }
    for k in [-15, -9, -6, 6, 12, 13] {
        let scale = 10f64.powi(k);
        add("scale", format!("1e{k}"), scale, moved(&cornell, scale, DVec3::ZERO), float(RADIUS * scale));
    }
    for k in [-3, 0, 1, 2, 12] {
        let factor = 10f64.powi(k);
        add("radius", format!("1e{k}"), factor, cornell_box(base()), float(RADIUS * factor));
    }
    for fov in [1.0, 20.0, 120.0, 160.0, 175.0] {
        add("fov", format!("{fov}"), fov, cornell_box(looking(EYE, TARGET, lens(fov))), float(RADIUS));
    }
    for angle in [30.0, 3.0, 0.3, 0.03] {
        add("grazing", format!("{angle}"), angle, grazing(angle), float(15.0));
    }
    for k in [1, 3, 4, 5, 6, 7] {
        let half = 10f64.powi(k);
        add("extent", format!("1e{k}"), half, large(half), float(0.3));
    }
    for (directions, steps) in [(1, 1), (4, 4), (8, 8), (16, 16), (64, 64), (8, 256)] {
        // R covers at least as many texels as there are steps.
        let settings = Settings { directions, steps, ..float(if steps > 64 { 30.0 * RADIUS } else { 6.0 * RADIUS }) };
        let name = format!("{directions} x {steps}");
        add("samples", name, f64::from(directions * steps), cornell_box(base()), settings);
    }
    let depth = |settings| Settings { depth_format: DepthFormat::R16f, ..settings };
    let normals = |settings| Settings { normal_format: NormalFormat::Rgba8Snorm, ..settings };
    let float_of = |factor: f64| float(RADIUS * factor);
    for (name, settings) in [
        ("float throughout (RGBA16F normals)", float_of(1.0)),
        ("depth R16F", depth(float_of(1.0))),
        ("depth R16F, R / 3", depth(float_of(1.0 / 3.0))),
        ("depth R16F, 3 R", depth(float_of(3.0))),
        ("depth R16F, bias 10 degrees", Settings { bias: 10f64.to_radians(), ..depth(float_of(1.0)) }),
        ("normals RGBA8_SNORM", normals(float_of(1.0))),
        ("ambient occlusion R16F", Settings { ao_format: AoFormat::R16f, ..float_of(1.0) }),
        ("ambient occlusion R8", Settings { ao_format: AoFormat::R8, ..float_of(1.0) }),
        ("the default: RGBA8_SNORM, R32F, R8", Settings { ao_format: AoFormat::R8, ..normals(float_of(1.0)) }),
    ] {
        add("formats", name.into(), 1.0, cornell_box(base()), settings);
    }
    for k in [-3, -4, -9, 2] {
        let scale = 10f64.powi(k);
        let name = format!("depth R16F, the scene times 1e{k}");
        add("formats", name, scale, moved(&cornell, scale, DVec3::ZERO), depth(float(RADIUS * scale)));
    }
    for case in &mut cases {
        match case.axis {
            "samples" => case.size = SMALL,
            _ if case.name.ends_with("1200 rows") => case.size = TALL,
            _ => {}
        }
    }
    Ok(cases)
}
