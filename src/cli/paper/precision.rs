//! 'Numbers at their extremes': what float32 and the narrower formats do, where each breaks, and what is done about it.

use super::drawing::{self, Axes, Series};
use super::figures::{detail, grey};
use super::page::{Drawing, Figure, Picture, Table};
use super::scenes;
use glam::{DVec3, dvec3};
use hbao::image::Image;
use hbao::measure::precision::{Bench, Precision, Spread, biased, untold};
use hbao::scene::{CORNELL_BOX, Lens, Mesh, Scene, View};
use hbao::settings::{AoFormat, DepthFormat, NormalFormat, Radius};
use hbao::{Error, Settings, glow};
use serde_json::{Value, json};
use std::sync::Arc;

/// Of the images, whatever the report's own: errors of rounding do not need many pixels.
const SIZE: (u32, u32) = (128, 96);
/// Where there are thousands of samples a pixel.
const SMALL: (u32, u32) = (48, 36);
/// As many rows as the papers' pictures have, of which a texel is as narrow.
const TALL: (u32, u32) = (16, 1200);

/// Into the Cornell box from above its front, along none of its axes.
const EYE: DVec3 = dvec3(100.0, 400.0, 20.0);
const TARGET: DVec3 = dvec3(330.0, 160.0, 420.0);
const FOV_Y: f64 = 60.0;
/// R, the scene's own.
const RADIUS: f64 = 150.0;

/// A row of a table: a view and settings.
struct Case {
    axis: &'static str,
    name: String,
    /// The number that is swept, for drawings.
    along: f64,
    size: (u32, u32),
    mesh: Result<Mesh, Error>,
    view: View,
    settings: Settings,
}

/// What was found: errors, or why it is refused.
struct Row {
    axis: &'static str,
    name: String,
    along: f64,
    found: Result<Precision, String>,
}

/// Formats, the angle bias in degrees, and the false occlusion of a floor: its mean and its largest.
type Floor = (&'static str, f64, [f64; 2]);

/// All that was measured.
pub(super) struct Extremes {
    rows: Vec<Row>,
    /// Orthographic, near over far, and the largest gap not told apart at the near end, in the middle and at the far end.
    gaps: Vec<(bool, f64, [f64; 3])>,
    floors: Vec<Floor>,
    pictures: Vec<Picture>,
}

/// An axis: its name, how its table is titled, and what is to be said.
const AXES: [[&str; 3]; 10] = [
    [
        "near-far",
        "Near and far planes",
        "Nothing depends on the planes but the depth test, whose resolution stands in the next table.",
    ],
    [
        "distance",
        "Distance of the surface from the eye, in R",
        "Depth in R32F has steps of 6e-8 of itself. Under perspective they stay below a texel, since R must be several texels or \
         the chapter exits early. An orthographic eye may be anywhere: from 1e4 R on the steps are seen, a stated limit: move \
         the eye towards the scene, which changes nothing else. Normals hold on longer, since positions are taken from the near \
         plane.",
    ],
    [
        "offset",
        "Distance of the scene from the origin",
        "Positions are made relative to the camera in float64. What float64 itself cannot tell apart there is lost to \
         the twin too; past 1e15 positions are refused.",
    ],
    [
        "scale",
        "Scale of the scene",
        "Everything is relative, and squares fit float32 from 1e-15 to 1e15, past which positions are refused.",
    ],
    [
        "radius",
        "R over the scene's own",
        "Below some texels the chapter exits early and A = 1. Far above the scene every sample lies at the border of the picture.",
    ],
    [
        "fov",
        "Vertical field of view, degrees",
        "Near 180 degrees a plane of the picture's border is met far away, by rays almost along it: depth is extrapolated.",
    ],
    [
        "grazing",
        "A floor with a wall on it, by the angle at which it is seen, degrees",
        "z = (n.Q)/(n.r) divides by the sine of this angle, and what moves z onto the ray is no longer than a pixel. From some angle \
         on a pixel's neighbours on the floor lie farther away than R.",
    ],
    [
        "extent",
        "Half the side of a floor of two triangles, in heights of the eye",
        "A corner at a distance L is placed to 6e-8 L, wherever in the triangle one looks. A triangle of 1e4 times what is looked \
         at is seen at a depth that is off by as much, of 1e7 times in part or not at all: a stated limit; cut it into smaller \
         ones. It stays a plane, so that it does not occlude itself.",
    ],
    ["samples", "Directions x steps", "Rounding adds up like the root of the samples, far below a step of 8 bits."],
    [
        "formats",
        "Formats",
        "Half floats have 11 bits: neighbours on a tilted plane rise and fall by a step of depth that is a share of R, so that planes \
         occlude themselves, which on an open floor an angle bias hides; the smaller R, the more. Eight bits of a normal are up to 0.3 degrees. \
         Below a near plane of 6.1e-5 half floats lose their bits, and past 60000 their range: both are refused.",
    ],
];

fn float(radius: f64) -> Settings {
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

/// A scene as large and as far from the origin as is said; refused where no mesh may be.
fn moved(mesh: &Mesh, scale: f64, offset: DVec3) -> (Result<Mesh, Error>, View) {
    let place = |p: DVec3| scale * p + offset;
    let positions = mesh.positions.iter().map(|&p| place(p)).collect();
    (Mesh::new(positions, mesh.triangles.clone()), looking(place(EYE), place(TARGET), lens(FOV_Y)))
}

/// A floor of this half size.
fn floor(half: f64) -> Vec<DVec3> {
    [(-half, -half), (half, -half), (half, half), (-half, half)].map(|(x, z)| dvec3(x, 0.0, z)).into()
}

/// A floor as long as the picture shows of it and a wall on it, seen in parallel rays at an angle above the floor.
fn grazing(degrees: f64) -> (Result<Mesh, Error>, View) {
    let angle = degrees.to_radians();
    let wall = [(-20.0, 0.0), (15.0, 0.0), (15.0, 30.0), (-20.0, 30.0)].map(|(x, y)| dvec3(x, y, -0.3 * x));
    let corners = floor(100.0 / angle.sin()).into_iter().chain(wall).collect();
    let mesh = Mesh::new(corners, vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]);
    let eye = (200.0 + 60.0 / angle.tan()) * dvec3(0.2, 1.02 * angle.tan(), 1.0);
    (mesh, looking(eye, DVec3::ZERO, Some(Lens::Height(80.0))))
}

/// A large floor, of which a little is seen from a height of 1.
fn large(half: f64) -> (Result<Mesh, Error>, View) {
    let view = looking(dvec3(0.3, 1.0, 1.0), DVec3::ZERO, lens(40.0));
    (Mesh::new(floor(half), vec![[0, 1, 2], [0, 2, 3]]), View { near: Some(0.1), far: Some(100.0), ..view })
}

fn cases() -> Result<Vec<Case>, Error> {
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
        // As many texels as there are steps.
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

/// Measures all of it.
pub(super) fn measure(gl: &Arc<glow::Context>) -> Result<Extremes, Error> {
    let mut rows = Vec::new();
    let mut bench: Option<(Settings, (u32, u32), Bench)> = None;
    for Case { axis, name, along, size, mesh, view, settings } in cases()? {
        // Neighbours share their programs.
        if bench.as_ref().is_none_or(|(known, of, _)| *known != settings || *of != size) {
            bench = Some((settings.clone(), size, Bench::new(gl, size, &settings)?));
        }
        let Some((.., bench)) = &mut bench else { continue };
        let found = mesh.and_then(|mesh| {
            let (camera, _) = view.camera(&mesh, size.0, size.1)?;
            Ok(bench.measure(&mesh, &camera)?.0)
        });
        let found = match found {
            Err(Error::Usage(why)) => Err(why),
            other => Ok(other?),
        };
        rows.push(Row { axis, name, along, found });
    }
    let mut gaps = Vec::new();
    for orthographic in [false, true] {
        for k in [2, 4, 6, 8] {
            let near = 10f64.powi(-k);
            let at = |z: f64| untold(gl, (near, 1.0), z, orthographic);
            gaps.push((orthographic, near, [at(1.3 * near)?, at(near.sqrt())?, at(0.7)?]));
        }
    }
    let (floors, pictures) = floors(gl)?;
    Ok(Extremes { rows, gaps, floors, pictures })
}

/// False occlusion of a floor in each format, by angle bias, and pictures of it.
fn floors(gl: &Arc<glow::Context>) -> Result<(Vec<Floor>, Vec<Picture>), Error> {
    let subject = scenes::floor()?;
    let camera = subject.camera(SIZE)?;
    let (mut floors, mut pictures) = (Vec::new(), Vec::new());
    for bias in [0.0, 1.0, 5.0, 30.0] {
        let base = Settings { bias: f64::to_radians(bias), ..float(subject.radius) };
        let mut put = |name, file, raw: &Image<f32>, depth: &Image<f32>| -> Result<(), Error> {
            let covered = (0..raw.texels.len()).filter(|&i| depth.texels[i].is_finite());
            let dark: Vec<f64> = covered.map(|i| 1.0 - f64::from(raw.texels[i])).collect();
            let mean = dark.iter().sum::<f64>() / dark.len().max(1) as f64;
            floors.push((name, bias, [mean, Spread::of(dark).max]));
            if bias == 0.0 {
                let loud = raw.map(|a| (1.0 - LOUDER * (1.0 - a)).max(0.0));
                let size = (loud.width, loud.height);
                let file = format!("extremes-{file}");
                pictures.push(detail(&grey(&loud), (0, 0), size, 2, (&file, name))?);
            }
            Ok(())
        };
        let formats = [
            ("R32F, RGBA16F", "float", base.clone()),
            ("R16F, RGBA16F", "r16f", Settings { depth_format: DepthFormat::R16f, ..base.clone() }),
            ("R32F, RGBA8_SNORM", "snorm", Settings { normal_format: NormalFormat::Rgba8Snorm, ..base.clone() }),
        ];
        for (name, file, settings) in formats {
            let (_, images) = Bench::new(gl, SIZE, &settings)?.measure(&subject.mesh, &camera)?;
            put(name, file, &images.raw, &images.depth)?;
            if file == "float" {
                let coarse = biased(&images, &camera, &settings)?;
                put("R32F, biased RGBA8", "biased", &coarse, &images.depth)?;
            }
        }
    }
    Ok((floors, pictures))
}

/// How many times false occlusion is made darker in pictures.
const LOUDER: f32 = 20.0;

fn tiny(value: f64) -> String {
    if value == 0.0 { "0".into() } else { format!("{value:.1e}") }
}

const HEAD: [&str; 12] = [
    "",
    "pixels",
    "depth, 99.9 %",
    "normals, degrees, 99.9 %",
    "AO arithmetic, max",
    "ambiguous",
    "AO end to end, RMSE",
    "99.9 %",
    "max",
    "ambiguous",
    "shown, RMSE",
    "max",
];

impl Row {
    fn cells(&self) -> Vec<String> {
        let mut cells = vec![self.name.clone()];
        match &self.found {
            Err(why) => cells.push(format!("refused: {why}")),
            Ok(p) => cells.extend([
                p.covered.to_string(),
                tiny(p.depth.most),
                tiny(p.normals.most),
                tiny(p.arithmetic.max),
                p.ambiguous.to_string(),
                tiny(p.whole.rmse),
                tiny(p.whole.most),
                tiny(p.whole.max),
                p.whole_ambiguous.to_string(),
                tiny(p.shown.rmse),
                tiny(p.shown.max),
            ]),
        }
        cells
    }

    fn json(&self) -> Value {
        let spread = |s: &Spread| json!({ "rmse": s.rmse, "most": s.most, "max": s.max, "pixels": s.pixels });
        match &self.found {
            Err(why) => json!({ "axis": self.axis, "case": self.name, "refused": why }),
            Ok(p) => json!({
                "axis": self.axis,
                "case": self.name,
                "along": self.along,
                "covered": p.covered,
                "beside": p.beside,
                "depth": spread(&p.depth),
                "normals": spread(&p.normals),
                "arithmetic": spread(&p.arithmetic),
                "ambiguous": p.ambiguous,
                "whole": spread(&p.whole),
                "whole_ambiguous": p.whole_ambiguous,
                "shown": spread(&p.shown),
            }),
        }
    }
}

impl Extremes {
    pub(super) fn json(&self) -> Value {
        let gaps = self.gaps.iter().map(|(orthographic, ratio, [near, middle, far])| {
            json!({ "orthographic": orthographic, "near_far": ratio, "near": near, "middle": middle, "far": far })
        });
        let floors = self
            .floors
            .iter()
            .map(|(formats, bias, [mean, max])| json!({ "formats": formats, "bias": bias, "mean": mean, "max": max }));
        json!({
            "size": [SIZE.0, SIZE.1],
            "view": { "eye": EYE.to_array(), "target": TARGET.to_array(), "fov_y": FOV_Y, "radius": RADIUS },
            "rows": self.rows.iter().map(Row::json).collect::<Vec<_>>(),
            "told_apart": gaps.collect::<Vec<_>>(),
            "floor": floors.collect::<Vec<_>>(),
        })
    }

    /// As a part of the page.
    pub(super) fn figures(&self) -> Result<Vec<Figure>, Error> {
        let mut tables = Vec::new();
        for [axis, title, says] in AXES {
            tables.push(Table {
                caption: title.into(),
                head: HEAD.map(String::from).into(),
                rows: self.rows.iter().filter(|row| row.axis == axis).map(Row::cells).collect(),
                notes: vec![says.into()],
            });
        }
        tables.insert(1, self.gap_table());
        tables.push(self.floor_table());
        let line = |of: fn(&Precision) -> f64, wanted: &dyn Fn(&Row) -> bool| {
            let points = self.rows.iter().filter(|row| row.axis == "distance" && wanted(row));
            points
                .filter_map(|row| row.found.as_ref().ok().map(|p| (row.along, of(p))))
                .filter(|point| point.1 > 0.0)
                .collect::<Vec<_>>()
        };
        let parallel = |row: &Row| row.name.ends_with("orthographic");
        let series: Vec<Series> = vec![
            ("AO end to end, orthographic".into(), line(|p| p.whole.most, &parallel)),
            ("AO end to end, perspective".into(), line(|p| p.whole.most, &|row| !parallel(row))),
            ("AO arithmetic alone, orthographic".into(), line(|p| p.arithmetic.most, &parallel)),
        ];
        let axes = Axes { x: "distance from the eye, in R", y: "what 99.9 % of the pixels keep", logarithmic: true };
        Ok(vec![Figure {
            id: "extremes".into(),
            title: "Numbers at their extremes".into(),
            text: format!(
                "Each pass against the same equations in float64, over covered pixels of {}x{} ({}x{} for the counts of samples): depth \
                 relative to that of a ray, normals in degrees, ambient occlusion on the GPU's own depth and normals (its \
                 arithmetic alone), on what rays meet in float64 (end to end), and after the blur (shown). Pixels where a shift of \
                 1e-5 decides otherwise are counted apart, and are in what is shown. The Cornell box from {EYE} to {TARGET}, \
                 {FOV_Y} degrees, R = {RADIUS}, unless said.",
                SIZE.0, SIZE.1, SMALL.0, SMALL.1
            ),
            tables,
            drawings: vec![Drawing {
                file: "extremes-distance.svg".into(),
                caption: "Ambient occlusion against distance".into(),
                svg: drawing::lines(&series, &axes)?,
            }],
            pictures: self.pictures.clone(),
        }])
    }

    fn gap_table(&self) -> Table {
        Table {
            caption: "Surfaces one behind the other: the largest gap, relative to their depth, that is not told apart".into(),
            head: ["near / far", "at 1.3 near", "at sqrt(near far)", "at 0.7 far"].map(String::from).into(),
            rows: self
                .gaps
                .iter()
                .map(|(orthographic, ratio, gaps)| {
                    let kind = if *orthographic { "orthographic" } else { "perspective" };
                    [format!("{ratio:e}, {kind}")].into_iter().chain(gaps.map(tiny)).collect()
                })
                .collect(),
            notes: vec![
                "The view is drawn in slices of depth, each with a far end at most 100 times as far as its near one, orthographic \
                 views too."
                    .into(),
            ],
        }
    }

    fn floor_table(&self) -> Table {
        let mut biases: Vec<f64> = self.floors.iter().map(|floor| floor.1).collect();
        biases.dedup();
        let names: Vec<&str> = self.floors.iter().take_while(|floor| floor.1 == 0.0).map(|floor| floor.0).collect();
        let cell = |name: &str, bias: f64| {
            let found = self.floors.iter().find(|floor| floor.0 == name && floor.1 == bias);
            found.map_or(String::new(), |(.., [mean, max])| format!("{}, {}", tiny(*mean), tiny(*max)))
        };
        Table {
            caption: "False occlusion of a floor, which is open: mean and largest 1 - A, by angle bias".into(),
            head: ["depth, normals".into()].into_iter().chain(biases.iter().map(|b| format!("{b} degrees"))).collect(),
            rows: names
                .iter()
                .map(|name| [name.to_string()].into_iter().chain(biases.iter().map(|&b| cell(name, b))).collect())
                .collect(),
            notes: vec![format!(
                "R is 1, the eye 10 away. Biased RGBA8 is what a driver gets that renders neither signed format: computed by the \
                 twin. In the pictures what is missing to 1 is {LOUDER} times as dark."
            )],
        }
    }
}
