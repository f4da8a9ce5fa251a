//! Renders the same frames on every driver. Each driver is compared with the twins, and all with llvmpipe through EGL.

use crate::rig::process::WITHOUT_SHADER_CACHE;
use crate::rig::{self, Frame, Shot, every_switch, scenes, twin};
use glow::HasContext as _;
use hbao::Settings;
use hbao::context::{Backend, Context};
use hbao::image::Image;
use hbao::settings::{NormalFormat, Radius};
use std::fmt::Write as _;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::path::Path;
use std::process::{Child, Command, Stdio};

/// The size is small because softpipe is slow, and odd so that half resolution is rounded up.
const SIZE: (u32, u32) = (49, 37);

/// These are set for the processes that render: the file for their frames, and the name of their driver.
const TO: &str = "HBAO_FRAMES_TO";
const BY: &str = "HBAO_FRAMES_BY";

/// A driver, and the environment that selects it.
pub(crate) struct Driver {
    pub(crate) name: &'static str,
    backend: Backend,
    environment: &'static [(&'static str, &'static str)],
    /// The driver's description must contain this, or it is another driver.
    described: &'static str,
    /// Whether the driver may be missing.
    optional: bool,
    /// The driver renders each case whose number is a multiple of this.
    every: usize,
    pub(crate) limits: Limits,
}

/// For each of [`BUFFERS`], a tolerance and the share of pixels that may differ by more.
pub(crate) type Limits = [(f64, f64); BUFFERS.len()];

/// For the same driver. The library it is reached through, the number of its threads and the width of its vectors must
/// not change the image.
const SAME: Limits = [(0.0, 0.0); BUFFERS.len()];

/// For another driver with another rasteriser and interpreter, without multisampling, and with normals that fall back
/// to rgba16f. Each figure is about twice what was measured with Mesa 22.3.6. The measured values are in brackets.
const SOFTPIPE: Limits = [
    // Coverage: the rasterisers round vertices and edges differently, so a pixel whose centre lies within a fraction of
    // a pixel of a silhouette may show another surface (9 of 43,512 pixels; for each driver 99.5 % match the rays).
    (0.0, 5e-4),
    // Depth: the plane's equation is evaluated in another order, which differs by a rounding of float32 (0.21 % over
    // 1e-6). Planes that are seen edge-on multiply this, and where triangles meet, the plane may be that of the other
    // (4.4e-5 at worst).
    (1e-6, 5e-3),
    // Normals: a derivative that is rounded differently gives the next code of a half float, 2^-11 below 1. The
    // difference is larger where triangles meet, as above (0.004 %).
    (1e-3, 1e-4),
    // Colour, in steps of 8 bits: rounding, and silhouettes as above (0.023 %, all of them at silhouettes).
    (1.0, 5e-4),
    // Edges: both have one sample per pixel, and so no edges.
    (0.0, 0.0),
    // Before the blur: it is checked first that each driver matches its twin on its own depths and normals to 1e-3. So
    // these differences come from different depths and normals: a sample is just the highest so far on one driver and
    // just not on the other, or a silhouette within R is one pixel away (0.23 % over 0.01; 0.23 at worst in the talk's
    // method, where one sample decides a whole direction).
    (0.01, 5e-3),
    // After the blur: the same differences, spread over neighbours (0.087 % over 0.01).
    (0.01, 2e-3),
];

/// For llvmpipe's rasteriser with another compiler. The shaders are translated through SPIR-V and round differently.
const ZINK: Limits = [
    // Everything that is rasterised, interpolated and stored is the same to the bit.
    (0.0, 0.0),
    (0.0, 0.0),
    (0.0, 0.0),
    (0.0, 0.0),
    (0.0, 0.0),
    // Ambient occlusion: two roundings of float32 (2e-7), and more where an 8-bit target is about to round to the next
    // code (one of 25,464 texels, by one code).
    (1e-6, 2e-4),
    (1e-6, 2e-4),
];

const fn driver(
    name: &'static str,
    backend: Backend,
    described: &'static str,
    environment: &'static [(&'static str, &'static str)],
) -> Driver {
    Driver { name, backend, environment, described, optional: false, every: 1, limits: SAME }
}

/// LIBGL_ALWAYS_SOFTWARE keeps EGL from using a GPU.
const SOFTWARE: (&str, &str) = ("LIBGL_ALWAYS_SOFTWARE", "true");

/// Every driver that Mesa has for a machine without a GPU. The others are compared with the first.
pub(crate) const DRIVERS: [Driver; 10] = [
    driver("llvmpipe, EGL", Backend::Egl, "llvmpipe", &[SOFTWARE]),
    Driver { every: 3, ..driver("llvmpipe, OSMesa", Backend::Osmesa, "llvmpipe", &[]) },
    Driver {
        every: 5,
        ..driver("llvmpipe, no thread", Backend::Egl, "llvmpipe", &[SOFTWARE, ("LP_NUM_THREADS", "0")])
    },
    Driver { every: 5, ..driver("llvmpipe, 1 thread", Backend::Egl, "llvmpipe", &[SOFTWARE, ("LP_NUM_THREADS", "1")]) },
    Driver {
        every: 5,
        ..driver("llvmpipe, 2 threads", Backend::Egl, "llvmpipe", &[SOFTWARE, ("LP_NUM_THREADS", "2")])
    },
    Driver {
        every: 3,
        ..driver("llvmpipe, 128 bits", Backend::Egl, "128 bits", &[SOFTWARE, ("LP_NATIVE_VECTOR_WIDTH", "128")])
    },
    Driver {
        every: 3,
        ..driver(
            "llvmpipe, OpenGL 3.3",
            Backend::Egl,
            "OpenGL 3.3",
            &[
                SOFTWARE,
                ("MESA_GL_VERSION_OVERRIDE", "3.3FC"),
                ("MESA_GLSL_VERSION_OVERRIDE", "330"),
                ("MESA_EXTENSION_OVERRIDE", HIDDEN),
            ],
        )
    },
    Driver {
        limits: SOFTPIPE,
        ..driver("softpipe, EGL", Backend::Egl, "softpipe", &[SOFTWARE, ("GALLIUM_DRIVER", "softpipe")])
    },
    Driver {
        limits: SOFTPIPE,
        ..driver("softpipe, OSMesa", Backend::Osmesa, "softpipe", &[("GALLIUM_DRIVER", "softpipe")])
    },
    Driver {
        optional: true,
        limits: ZINK,
        ..driver("zink, EGL", Backend::Egl, "zink", &[SOFTWARE, ("MESA_LOADER_DRIVER_OVERRIDE", "zink")])
    },
];

/// Extensions that are not part of OpenGL 3.3 and that a shader or a call might come to depend on.
const HIDDEN: &str = "-GL_KHR_debug -GL_ARB_timer_query -GL_ARB_texture_storage -GL_ARB_direct_state_access \
    -GL_ARB_explicit_uniform_location -GL_ARB_shading_language_420pack -GL_ARB_explicit_attrib_location \
    -GL_ARB_gpu_shader5 -GL_ARB_clear_texture -GL_ARB_copy_image -GL_ARB_stencil_texturing -GL_ARB_texture_gather \
    -GL_ARB_ES3_compatibility -GL_ARB_internalformat_query -GL_ARB_invalidate_subdata -GL_ARB_robustness";

/// The cases that are rendered, by name. The camera is tilted to one side, because otherwise one tie would be a tie of
/// a whole row.
fn cases() -> Vec<(String, Shot, Settings)> {
    let mut cases = Vec::new();
    for (i, settings) in every_switch().into_iter().enumerate() {
        // The radii were chosen for a picture with twice as many pixels along each side.
        let settings = rig::scaled(&settings, 2.0);
        let shot = scenes::cornell_box().rolled();
        let shot = if i % 2 == 0 { shot } else { shot.orthographic() };
        cases.push((format!("{} {i}", settings.method.name()), shot, settings));
    }
    for shot in [scenes::nave(), scenes::ball(), scenes::box_on_a_floor(), scenes::two_layers(), scenes::pole()] {
        let settings = Settings { radius: Radius::Units(shot.radius), ..Settings::default() };
        cases.push((shot.name.into(), shot.rolled(), settings));
    }
    cases
}

/// The images of a frame as numbers.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Buffers {
    /// The name of the case, and the number of samples and the format of normals that the driver gave for it.
    key: String,
    buffers: Vec<Vec<f32>>,
}

/// The images of a frame, and how many numbers each has per pixel.
pub(crate) const BUFFERS: [(&str, usize); 7] =
    [("coverage", 1), ("depth", 1), ("normals", 3), ("colour", 3), ("edges", 1), ("raw AO", 1), ("AO", 1)];

fn buffers(name: &str, frame: &Frame, settings: &Settings) -> Buffers {
    let format = match frame.notices.is_empty() {
        true => settings.normal_format.name(),
        false => NormalFormat::Rgba16f.name(),
    };
    let one = |image: &Image<bool>| image.texels.iter().map(|&b| f32::from(u8::from(b))).collect();
    Buffers {
        key: format!("{name}, {} samples, {format}", frame.samples.len().max(1)),
        buffers: vec![
            one(&frame.covered()),
            frame.depth.texels.clone(),
            frame.normals.texels.concat(),
            frame.colour.texels.iter().flatten().map(|&c| f32::from(c)).collect(),
            one(&frame.edges),
            frame.raw.texels.clone(),
            frame.ao.texels.clone(),
        ],
    }
}

/// Runs in a process of the driver's own. Renders every case, compares it with its twins, and writes it to the file.
fn render_to(path: &Path, driver: &Driver) {
    let mut file = std::fs::File::create(path).unwrap();
    let context = match Context::open(driver.backend) {
        Ok(context) => context,
        Err(error) => return writeln!(file, "none: {error}").unwrap(),
    };
    writeln!(file, "{}", context.describe()).unwrap();
    if driver.optional && !context.describe().contains(driver.described) {
        return;
    }
    if driver.environment.iter().any(|&(_, value)| value == HIDDEN) {
        assert!(!context.gl().supported_extensions().contains("GL_KHR_debug"), "the extensions are not hidden");
    }
    for (name, shot, settings) in cases().into_iter().step_by(driver.every) {
        let lesser = Settings { msaa: 1, normal_format: NormalFormat::Rgba16f, ..settings.clone() };
        // The first driver also renders what other drivers fall back to, so that it can be compared.
        let all = if driver.name == DRIVERS[0].name { vec![settings, lesser] } else { vec![settings] };
        for settings in all {
            let frame = rig::render(context.gl(), &shot, SIZE, &settings);
            let text = format!("{}\n{name}\n{}", context.describe(), settings.to_toml());
            twin::hold_gbuffer(&frame, &shot, SIZE, &settings, &text);
            twin::hold_raw(&frame, &settings, &text);
            twin::hold_edges(&frame, &settings, &text);
            twin::hold_blur(&frame, &settings, &text);
            let Buffers { key, buffers } = buffers(&name, &frame, &settings);
            writeln!(file, "{key}").unwrap();
            for buffer in buffers {
                writeln!(file, "{}", buffer.len()).unwrap();
                file.write_all(&buffer.iter().flat_map(|f| f.to_le_bytes()).collect::<Vec<u8>>()).unwrap();
            }
        }
    }
}

/// Reads what a process wrote: the description of its driver, and the frames.
fn read(path: &Path) -> (String, Vec<Buffers>) {
    let mut file = BufReader::new(std::fs::File::open(path).unwrap());
    let line = |file: &mut BufReader<_>| {
        let mut text = String::new();
        file.read_line(&mut text).unwrap();
        text.trim_end().to_string()
    };
    let described = line(&mut file);
    let mut frames = Vec::new();
    loop {
        let key = line(&mut file);
        if key.is_empty() {
            return (described, frames);
        }
        let buffers = BUFFERS.map(|_| {
            let mut bytes = vec![0; 4 * line(&mut file).parse::<usize>().unwrap()];
            file.read_exact(&mut bytes).unwrap();
            bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
        });
        frames.push(Buffers { key, buffers: buffers.into() });
    }
}

/// How far a driver's images of one kind are from those of the first driver.
#[derive(Clone, Debug, Default)]
pub(crate) struct Difference {
    /// The number of pixels that were compared, and of those that differ at all.
    pub(crate) compared: usize,
    pub(crate) differ: usize,
    /// The differences, with the largest last.
    all: Vec<f64>,
    worst: String,
}

impl Difference {
    /// Returns the share of pixels that differ by more than `tolerance`.
    pub(crate) fn share_over(&self, tolerance: f64) -> f64 {
        self.all.iter().filter(|&&d| d > tolerance).count() as f64 / self.compared.max(1) as f64
    }

    pub(crate) fn worst(&self) -> f64 {
        self.all.last().copied().unwrap_or(0.0)
    }
}

/// Compares each of [`BUFFERS`] over all frames. Relative depth, normals and ambient occlusion are compared at pixels
/// that show a surface in both. Colours are compared in steps of 8 bits.
fn differences(got: &[Buffers], expected: &[Buffers]) -> [Difference; BUFFERS.len()] {
    let mut found: [Difference; BUFFERS.len()] = Default::default();
    for got in got {
        let expected = expected.iter().find(|e| e.key == got.key).unwrap_or_else(|| panic!("no frame {}", got.key));
        for (k, (name, channels)) in BUFFERS.into_iter().enumerate() {
            let (a, b) = (&got.buffers[k], &expected.buffers[k]);
            assert_eq!(a.len(), b.len(), "{}: {name}", got.key);
            let pixels = a.len() / channels;
            // Ambient occlusion at half size is compared at all pixels, covered or not.
            let both = |i: usize| {
                pixels != got.buffers[0].len() || (got.buffers[0][i] == 1.0 && expected.buffers[0][i] == 1.0)
            };
            for i in (0..pixels).filter(|&i| ["coverage", "colour", "edges"].contains(&name) || both(i)) {
                let difference = (0..channels).map(|c| (a[channels * i + c], b[channels * i + c])).map(|(a, b)| {
                    let difference = f64::from(a) - f64::from(b);
                    if name == "depth" { (difference / f64::from(b)).abs() } else { difference.abs() }
                });
                let difference = difference.fold(0.0, f64::max);
                let found = &mut found[k];
                found.compared += 1;
                if difference > 0.0 {
                    if difference > found.all.iter().copied().fold(0.0, f64::max) {
                        let width = if pixels == got.buffers[0].len() { SIZE.0 } else { SIZE.0.div_ceil(2) } as usize;
                        found.worst = format!("{} at ({}, {})", got.key, i % width, i / width);
                    }
                    found.differ += 1;
                    found.all.push(difference);
                }
            }
        }
    }
    found.iter_mut().for_each(|found| found.all.sort_by(f64::total_cmp));
    found
}

/// A driver, and its difference in each of [`BUFFERS`], or `None` if it is not installed.
pub(crate) type Compared = (&'static Driver, Option<[Difference; BUFFERS.len()]>);

/// Renders the frames on every driver, each in a process of its own and two at a time. Returns what was found for each.
/// Only `test` may call this, because `test` is what the processes run; in such a process this returns `None`.
pub(crate) fn compared(test: &str) -> Option<Vec<Compared>> {
    if let (Some(to), Ok(by)) = (std::env::var_os(TO), std::env::var(BY)) {
        render_to(Path::new(&to), DRIVERS.iter().find(|driver| driver.name == by).unwrap());
        return None;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = |i: usize| folder.path().join(i.to_string());
    let start = |i: usize| {
        let driver = &DRIVERS[i];
        let mut child = Command::new(std::env::current_exe().unwrap());
        child.args([test, "--nocapture"]).envs(driver.environment.iter().copied());
        child.env(TO, path(i)).env(BY, driver.name);
        // All drivers but the first compile their own shaders, so that none are taken from the driver that they are
        // compared with.
        if i > 0 {
            let (name, value) = WITHOUT_SHADER_CACHE;
            child.env(name, value);
        }
        child.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
    };
    let end = |child: Child, driver: &Driver| {
        let output = child.wait_with_output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && text.contains("ok. 1 passed"), "{}: {}\n{text}", driver.name, output.status);
    };
    for pair in (0..DRIVERS.len()).collect::<Vec<_>>().chunks(2) {
        let children: Vec<(Child, &Driver)> = pair.iter().map(|&i| (start(i), &DRIVERS[i])).collect();
        children.into_iter().for_each(|(child, driver)| end(child, driver));
    }
    let (_, expected) = read(&path(0));
    assert_eq!(expected.len(), 2 * cases().len());
    let of = |(i, driver): (usize, &'static Driver)| {
        let (described, frames) = read(&path(i));
        if driver.optional && !described.contains(driver.described) {
            return (driver, None);
        }
        assert!(described.contains(driver.described), "{}: this is {described}", driver.name);
        assert_eq!(frames.len(), cases().len().div_ceil(driver.every), "{}", driver.name);
        (driver, Some(differences(&frames, &expected)))
    };
    Some(DRIVERS.iter().enumerate().skip(1).map(of).collect())
}

impl Driver {
    /// Returns a message for each image that differs by more than it may.
    pub(crate) fn complaints(&self, found: &[Difference; BUFFERS.len()]) -> Vec<String> {
        let mut complaints = Vec::new();
        for (((name, _), (tolerance, share)), d) in BUFFERS.into_iter().zip(self.limits).zip(found) {
            let over = d.share_over(tolerance);
            if over > share {
                complaints.push(format!(
                    "{}, {name}: {over:.2e} of {} pixels differ by more than {tolerance}, where {share} may; by {:.3e} in {}",
                    self.name, d.compared, d.worst(), d.worst
                ));
            }
        }
        complaints
    }
}

/// Returns the table of `src/measure/drivers.md`, and below it where each difference is largest.
pub(crate) fn table(all: &[Compared]) -> String {
    let names = BUFFERS.map(|(name, _)| format!(" {name} |")).concat();
    let mut text = format!("| driver |{names}\n|---|{}\n", "---|".repeat(BUFFERS.len()));
    let mut places = String::new();
    for (driver, found) in all {
        let Some(found) = found else { continue };
        let _ = write!(text, "| {} |", driver.name);
        for ((name, _), d) in BUFFERS.into_iter().zip(found) {
            if d.differ == 0 {
                text += " same |";
                continue;
            }
            let _ = write!(text, " {:.2} %, {} |", 100.0 * d.differ as f64 / d.compared as f64, short(d.worst()));
            let shares = [1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0]
                .map(|t| format!(" {t:.0e}: {:.4} %", 100.0 * d.share_over(t)));
            let _ = writeln!(
                places,
                "{}, {name}: of {}, over{}; worst {:.3e} in {}",
                driver.name,
                d.compared,
                shares.join(","),
                d.worst(),
                d.worst
            );
        }
        text += "\n";
    }
    text + "\n" + &places
}

/// Formats a number with few digits.
fn short(x: f64) -> String {
    match x {
        x if x >= 1.0 => format!("{x:.0}"),
        x if x >= 0.001 => format!("{x:.3}"),
        x => format!("{x:.0e}"),
    }
}

/// Compares made-up frames, in one of which a texel of each image is off.
pub(crate) fn find_a_planted_difference() {
    let texels = (SIZE.0 * SIZE.1) as usize;
    let made_up = BUFFERS.map(|(_, channels)| vec![1.0; texels * channels]).to_vec();
    let expected = [Buffers { key: "made up".into(), buffers: made_up }];
    let same = differences(&expected, &expected);
    assert!(same.iter().all(|d| d.differ == 0 && d.compared == texels));
    assert!(DRIVERS[1].complaints(&same).is_empty());
    for (k, (name, channels)) in BUFFERS.into_iter().enumerate() {
        let mut got = expected.clone();
        let texel = 3 * SIZE.0 as usize + 5;
        got[0].buffers[k][texel * channels] = 0.75;
        let found = differences(&got, &expected);
        assert_eq!((found[k].differ, found[k].worst()), (1, 0.25), "{name}");
        assert_eq!(found[k].worst, "made up at (5, 3)");
        assert_eq!(DRIVERS[1].complaints(&found).len(), 1, "{name}");
    }
}
