//! Strategies that draw random scenes, cameras, settings and sizes. Extreme values are common.

use glam::{DVec3, dvec3};
use hbao::Settings;
use hbao::context::Backend;
use hbao::scene::{Lens, Mesh, View};
use hbao::settings::{
    AoFormat, Attenuation, BlurKernel, Clamp, DepthFormat, Edges, Exit, Grounding, Jitter, Method, NormalFormat,
    Normals, Quadrature, Radius, Snap, SsaoDepth, SsaoRotation, Toggle, Zenith,
};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;

/// One set of settings, which is compiled once, and everything that is rendered with it.
#[derive(Clone, Debug)]
pub(crate) struct Batch {
    pub(crate) backend: Backend,
    pub(crate) settings: Settings,
    pub(crate) size: (u32, u32),
    pub(crate) orthographic: bool,
    pub(crate) shots: Vec<Drawn>,
}

/// The largest number of scenes for each set of settings. The average is half of it.
pub(crate) const SHOTS: usize = 80;

/// A scene of about one unit, and the position from which it is seen.
#[derive(Clone, Debug)]
pub(crate) struct Drawn {
    pub(crate) scene: Vec<[DVec3; 3]>,
    /// R divided by the size of the scene. R is a setting, so it is the scene that is scaled.
    pub(crate) ratio: f64,
    /// The position of the scene's origin in the world, in scene units.
    pub(crate) offset: DVec3,
    pub(crate) eye: DVec3,
    pub(crate) target: DVec3,
    pub(crate) up: DVec3,
    /// The field of view in degrees. An orthographic view has `height` instead, as a multiple of the scene's size.
    pub(crate) fov: f64,
    pub(crate) height: f64,
    /// The near plane as a share of the far plane. With `None`, both are computed from the scene.
    pub(crate) near: Option<f64>,
}

impl Drawn {
    /// Returns the mesh and the view in the units of the settings' radius, or `None` if a coordinate would be larger
    /// than a mesh may have.
    pub(crate) fn view(&self, orthographic: bool, radius: f64) -> Option<(Mesh, View)> {
        let scale = radius / self.ratio;
        let place = |p: DVec3| (p + 0.0) * scale + self.offset;
        let positions: Vec<DVec3> = self.scene.iter().flatten().map(|&p| place(p)).collect();
        let triangles = (0..self.scene.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let lens = if orthographic { Lens::Height(self.height * scale) } else { Lens::FovY(self.fov.to_radians()) };
        let far = 30.0 * scale;
        let view = View {
            eye: Some(place(self.eye)),
            target: Some(place(self.target)),
            up: Some(self.up),
            lens: Some(lens),
            near: self.near.map(|near| (near * far).max(1e-15)),
            far: self.near.map(|_| far),
            ..View::default()
        };
        Mesh::new(positions, triangles).ok().map(|mesh| (mesh, view))
    }
}

fn unit() -> impl Strategy<Value = f64> {
    -1.0..1.0f64
}

fn point() -> impl Strategy<Value = DVec3> {
    (unit(), unit(), unit()).prop_map(|(x, y, z)| dvec3(x, y, z))
}

fn direction() -> impl Strategy<Value = DVec3> {
    point().prop_map(|p| p.try_normalize().unwrap_or(DVec3::Z))
}

/// The parallelogram that two edges span.
fn quad(corner: DVec3, a: DVec3, b: DVec3) -> Vec<[DVec3; 3]> {
    vec![[corner, corner + a, corner + a + b], [corner, corner + a + b, corner + b]]
}

/// The parallelogram around a point, given by halves of its two edges.
fn about(middle: DVec3, a: DVec3, b: DVec3) -> Vec<[DVec3; 3]> {
    quad(middle - a - b, 2.0 * a, 2.0 * b)
}

fn floor() -> Vec<[DVec3; 3]> {
    about(DVec3::ZERO, 2.0 * DVec3::X, 2.0 * DVec3::Z)
}

/// Scenes for a camera near the origin to look at.
fn scene() -> impl Strategy<Value = Vec<[DVec3; 3]>> {
    let soup = vec([point(), point(), point()], 1..20).boxed();
    let plane = (point(), direction(), direction(), 0.1..3.0f64)
        .prop_map(|(middle, a, b, size)| about(0.3 * middle, size * a, size * b))
        .boxed();
    // Two half planes that meet in a line, convex or concave, sharp or nearly flat.
    let fold = (direction(), direction(), prop_oneof![0.0..360.0f64, Just(90.0), Just(179.9), 0.0..5.0f64])
        .prop_map(|(axis, other, degrees)| {
            let a = axis.cross(other).try_normalize().unwrap_or(axis.any_orthonormal_vector());
            let b = axis.cross(a);
            let angle = degrees.to_radians();
            let mut all = quad(-2.0 * axis, 4.0 * axis, 2.0 * a);
            all.extend(quad(-2.0 * axis, 4.0 * axis, 2.0 * (angle.cos() * a + angle.sin() * b)));
            all
        })
        .boxed();
    // Spikes on a floor, some of them thinner than a pixel.
    let spikes = vec((unit(), unit(), 1e-4..0.03f64, 0.05..1.5f64), 1..12)
        .prop_map(|spikes| {
            let mut all = floor();
            for (x, z, width, height) in spikes {
                let foot = dvec3(x, 0.0, z);
                all.push([foot - width * DVec3::X, foot + width * DVec3::X, foot + height * DVec3::Y]);
                all.push([foot - width * DVec3::Z, foot + width * DVec3::Z, foot + height * DVec3::Y]);
            }
            all
        })
        .boxed();
    // Walls in one plane that is nearly parallel to the line of sight: cameras look along -z from about x = 0.
    let edge_on = (vec((unit(), unit(), 0.02..0.5f64), 1..6), prop_oneof![Just(0.0), 1e-8..1e-1f64], unit())
        .prop_map(|(walls, lean, x)| {
            let away = dvec3(lean, 0.0, -1.0).normalize();
            let foot = dvec3(0.2 * x, 0.0, 1.5);
            let wall = |(y, z, size)| about(foot + 1.5 * (1.0 + z) * away + y * DVec3::Y, size * away, size * DVec3::Y);
            walls.into_iter().flat_map(wall).chain(about(-DVec3::Z, 2.0 * DVec3::X, 2.0 * DVec3::Y)).collect()
        })
        .boxed();
    // A room around the eye. Its normals point in all directions, so some have n.z >= 0.
    let room = (0.1..4.0f64, 0.1..4.0f64, 0.1..4.0f64)
        .prop_map(|(x, y, z)| {
            let [x, y, z] = [x * DVec3::X, y * DVec3::Y, z * DVec3::Z];
            let pairs = [(x, y, z), (y, z, x), (z, x, y)];
            pairs.into_iter().flat_map(|(a, b, c)| [about(c, a, b), about(-c, a, b)]).flatten().collect()
        })
        .boxed();
    // Plates behind each other, some of them very close together.
    let layers = vec((point(), 0.05..1.0f64), 2..6)
        .prop_map(|plates| {
            let plate = |(p, size): (DVec3, f64)| about(p, size * DVec3::X, size * dvec3(0.1, 1.0, 0.1));
            plates.into_iter().flat_map(plate).collect()
        })
        .boxed();
    // A floor that reaches the horizon and extends beyond anything in view.
    let horizon = (1e-4..1.0f64, prop_oneof![Just(1e1), Just(1e3), Just(1e5)])
        .prop_map(|(below, size)| about(-below * DVec3::Y, size * DVec3::X, size * DVec3::Z))
        .boxed();
    let nothing = Just(about(dvec3(0.0, 0.0, 50.0), DVec3::X, DVec3::Y)).boxed();
    prop_oneof![
        6 => soup, 3 => plane, 4 => fold, 4 => spikes, 3 => edge_on, 3 => room, 2 => layers, 2 => horizon, 1 => nothing
    ]
}

fn drawn() -> impl Strategy<Value = Drawn> {
    let ratio = prop_oneof![
        6 => 0.05..2.0f64, 1 => 1e-4..0.05f64, 1 => Just(1e-5), 1 => 2.0..100.0f64, 1 => Just(1e6), 1 => Just(0.25)
    ];
    let offset = prop_oneof![3 => Just(DVec3::ZERO), 1 => direction().prop_map(|d| 1e6 * d)];
    let eye = prop_oneof![
        3 => (unit(), unit(), 1.0..3.0f64).prop_map(|(x, y, z)| dvec3(0.5 * x, 0.5 * y, z)),
        2 => point().prop_map(|p| 0.5 * p + dvec3(0.0, 0.01, 0.0)),
        1 => (direction(), 2.0..9.0f64).prop_map(|(d, far)| far * d),
        1 => Just(dvec3(0.0, 0.0, 2.0)),
    ];
    // The target is the middle of a triangle, or any point.
    let target =
        prop_oneof![4 => any::<u8>().prop_map(Err), 1 => point().prop_map(Ok), 1 => Just(Ok(dvec3(0.0, 0.0, -0.5)))];
    let up = prop_oneof![2 => Just(DVec3::Y), 1 => direction()];
    // Exactly 90 degrees is left out: with a wall at 45 degrees, each of 6.1's offsets along it would be a tie.
    let fov = prop_oneof![1 => Just(1.0), 1 => Just(175.0), 6 => 20.0..120.0f64, 1 => 120.0..175.0f64];
    let height = prop_oneof![3 => 0.5..4.0f64, 1 => 1e-3..0.5f64, 1 => 4.0..100.0f64, 1 => Just(2.0)];
    let near = prop_oneof![3 => Just(None), 1 => Just(Some(1e-6)), 1 => (1e-6..0.3f64).prop_map(Some)];
    (scene(), ratio, offset, eye, target, up, (fov, height, near)).prop_map(
        |(scene, ratio, offset, eye, target, up, (fov, height, near))| {
            let middle = |i: u8| scene[usize::from(i) % scene.len()].iter().sum::<DVec3>() / 3.0;
            let target = target.unwrap_or_else(middle);
            Drawn { scene, ratio, offset, eye, target, up, fov, height, near }
        },
    )
}

fn size() -> impl Strategy<Value = (u32, u32)> {
    prop_oneof![
        1 => Just((1, 1)),
        1 => (1..65u32).prop_map(|n| (1, n)),
        1 => (1..65u32).prop_map(|n| (n, 1)),
        2 => select(vec![(31, 17), (13, 47), (2, 2), (3, 2), (37, 37), (64, 5)]),
        5 => (12..40u32, 12..40u32),
        3 => (40..65u32, 40..65u32),
    ]
}

fn radius() -> impl Strategy<Value = f64> {
    prop_oneof![3 => Just(1.0), 1 => Just(1e-6), 1 => Just(1e6), 1 => 0.01..100.0f64]
}

/// Settings with these methods and random values of every switch.
fn settings(methods: Vec<Method>) -> impl Strategy<Value = Settings> {
    let counts =
        (select(&[1u32, 2, 3, 4, 5, 8, 8, 8, 16, 64][..]), select(&[1u32, 2, 3, 4, 4, 8, 8, 8, 16, 33, 64][..]));
    let bias = prop_oneof![2 => Just(0.0), 1 => Just(89.0), 1 => 0.0..89.0f64, 1 => Just(30.0)];
    let sampling = (
        select(methods),
        radius(),
        counts,
        select(&[1u32, 1, 2, 4, 7][..]),
        bias,
        select(&[0.5, 1.0, 1.0, 3.0, 1e-3][..]),
    );
    let switches = (
        select(&[Attenuation::Quadratic, Attenuation::Linear, Attenuation::None][..]),
        select(&[Snap::Step, Snap::Step, Snap::Sample, Snap::None][..]),
        select(&[Clamp::Position, Clamp::Depth][..]),
        select(&[Grounding::Sample, Grounding::Direction][..]),
        select(&[Normals::Derivative, Normals::Derivative, Normals::Vertex][..]),
        select(&[Jitter::Tile, Jitter::Tile, Jitter::None][..]),
        select(&[NormalFormat::Rgba8Snorm, NormalFormat::Rgba16f][..]),
    );
    let blur = (
        select(&[0u32, 3, 9, 9, 21, 41][..]),
        select(&[BlurKernel::Separable, BlurKernel::Full][..]),
        select(&[None, None, Some(1e-3), Some(1e-30), Some(1e30)][..]),
        select(&[1u32, 1, 4, 8][..]),
        select(&[Edges::Supersample, Edges::Off][..]),
        any::<bool>(),
    );
    let ssao = (
        select(&[8u32, 16, 24][..]),
        select(&[SsaoRotation::Matrix, SsaoRotation::Mirror][..]),
        select(&[SsaoDepth::Full, SsaoDepth::Half][..]),
        select(&[Toggle::Off, Toggle::On][..]),
        select(&[Toggle::Off, Toggle::On][..]),
    );
    (sampling, switches, blur, ssao).prop_map(|(sampling, switches, blur, ssao)| {
        let (method, radius, (directions, steps), rays, bias, strength) = sampling;
        let (attenuation, snap, clamp, grounding, normals, jitter, normal_format) = switches;
        let (blur, blur_kernel, sigma, msaa, edges, half_res) = blur;
        let (ssao_samples, ssao_rotation, ssao_depth, ssao_normals, ssao_curve) = ssao;
        // What only `hbao-view` reads follows from what it does not read, so that whatever else is drawn stays as it
        // was before there was this method.
        let spacing = match rays {
            1 => 1.5,
            2 => 1.0,
            4 => 2.0,
            _ => 1.3,
        };
        Settings {
            method,
            radius: Radius::Units(radius),
            directions,
            // The twin takes time in proportion to the number of samples.
            steps: steps.min(512 / directions),
            rays,
            bias: bias.to_radians(),
            strength,
            attenuation,
            snap,
            clamp,
            grounding,
            zenith: if grounding == Grounding::Sample { Zenith::View } else { Zenith::Axis },
            // Steps that are rounded at once need samples that are evenly spaced.
            spacing: if snap == Snap::Step { 1.0 } else { spacing },
            quadrature: match ssao_samples {
                8 => Quadrature::Interval,
                16 => Quadrature::Mean,
                _ => Quadrature::End,
            },
            normals,
            jitter,
            blur,
            blur_kernel,
            blur_depth_sigma: sigma.map(|sigma| sigma * radius),
            msaa,
            edges,
            half_res,
            // The batch decides.
            exit: Exit::Paper,
            ssao_samples,
            ssao_rotation,
            ssao_depth,
            ssao_normals,
            ssao_curve: Some(ssao_curve),
            ao_format: AoFormat::R32f,
            normal_format,
            depth_format: DepthFormat::R32f,
        }
    })
}

/// Settings with these methods, and what is rendered with them.
pub(crate) fn batch(methods: Vec<Method>) -> impl Strategy<Value = Batch> {
    let backend = select(&[Backend::Egl, Backend::Osmesa][..]);
    let orthographic = prop::bool::weighted(0.3);
    (backend, settings(methods), size(), orthographic, vec(drawn(), 1..=SHOTS)).prop_map(
        |(backend, settings, size, orthographic, shots)| {
            // This setting was added later. It is not drawn, so that the seeds of earlier failures still draw the same.
            // In an orthographic view all pixels have the same number of steps, and would be ambiguous together.
            let shortens = !orthographic && (settings.directions + settings.steps) % 2 == 1;
            let exit = if shortens { Exit::Shorten } else { Exit::Paper };
            let settings = Settings { exit, ..settings };
            // Images with many samples are small.
            let samples = settings.method.samples(&settings);
            let side = |n: u32| {
                if samples > 600 {
                    n.min(17)
                } else if samples > 150 {
                    n.min(31)
                } else {
                    n
                }
            };
            let size = (side(size.0), side(size.1));
            Batch { backend, settings, size, orthographic, shots }
        },
    )
}
