//! What the papers say about the methods. Each statement is tested by a measurement that would fail if it were false.
//! The bounds are closed forms, derived by hand beside each test, and both the shader and the float64 twin must meet
//! them.
//!
//! That every plane is open with grounding by sample, and is not with grounding by direction, is tested in
//! `analytic.rs`.

use crate::rig;
use crate::rig::by_hand::{ByHand, PIT, columns, heights, perspective, pit};
use crate::rig::{SIZE, Shot, everywhere, hold, scenes};
use hbao::Settings;
use hbao::context::{Backend, Context};
use hbao::image::Image;
use hbao::reference::blur::blur;
use hbao::settings::{Attenuation, BlurKernel, Grounding, Jitter, Method, Snap};

/// The error that single precision leaves in a closed form.
const FLOAT: f64 = 2e-5;

/// With W = 1 and neither jitter nor blur, only the method's own geometry is left.
fn bare(method: Method, radius: f64) -> Settings {
    Settings {
        method,
        attenuation: Attenuation::None,
        snap: Snap::Step,
        jitter: Jitter::None,
        blur: 0,
        ..rig::float_settings(radius)
    }
}

/// Checks one pixel of the shader's and of the twin's result: its visibility must be within `tolerance` of `expected`.
/// Returns both values.
#[track_caller]
fn hold_pixel(
    context: &Context,
    view: &ByHand,
    settings: &Settings,
    (x, y): (usize, usize),
    expected: f64,
    tolerance: f64,
) -> [f64; 2] {
    view.by_both(context.gl(), settings).map(|(who, image)| {
        let got = image.at(x, y);
        let text = settings.to_toml();
        assert!((got - expected).abs() < tolerance, "{who}: {got}, not {expected}\n{text}");
        got
    })
}

/// Single columns of texels with these heights stand here and there, in no order.
fn hills(x: usize, y: usize) -> f64 {
    ((x * 7 + y * 13 + (x * y) % 5) % 11) as f64 * 0.6
}

/// The chapter on Shanmugam and Arikan: for large R micro-spheres over-occlude, and no uniform factor can correct that.
///
/// Two planes rise at 45 degrees from a crease between two columns. P lies on one of them, at distance d from the
/// crease. Ray-traced with W = 1, A = (1 + d/R)/2: however large R is, half of the sky stays visible.
///
/// A sphere fills pi/4 of its texel and faces P whatever the slope is. At height h over P's plane it adds (1/pi) (pi/4)
/// (h/|D|) / |D|^2, and in the image the wall covers sqrt(1/2) of its area. The integral over the half disc of the wall
/// within R is (arcosh(R/d) - sqrt(1 - (d/R)^2)) / (2 sqrt 2), which grows like log R.
#[test]
fn microsphere_closes_as_the_radius_grows_and_hbao_stays_with_the_rays() {
    let context = Context::open(Backend::Egl).unwrap();
    const HALF: usize = 72;
    let x_of = |x: usize| x as f64 + 0.5 - HALF as f64;
    let valley = heights((2 * HALF as u32, 2 * HALF as u32), |x, _| x_of(x).abs(), |x, _| [x_of(x).signum(), 0.0]);
    // The factors by which micro-spheres would have to be multiplied.
    let mut factors = Vec::new();
    // Each row has R/d, a pixel at which R is 54 to 62 texels, and by how much spheres must be darker than rays.
    for (r, away, least) in [(4.0f64, 9, 0.0), (8.0, 5, 0.15), (16.0, 2, 0.35)] {
        let pixel = (HALF + away, HALF);
        let d = x_of(pixel.0) * 2f64.sqrt();
        let traced = (1.0 + 1.0 / r) / 2.0;
        let closed = (r.acosh() - (1.0 - 1.0 / (r * r)).sqrt()) / (2.0 * 2f64.sqrt());
        // Steps are slightly longer than a texel, so that each sample stands for a texel of its own.
        let settings =
            |method| Settings { directions: 32, steps: (r * d) as u32 - 1, snap: Snap::Sample, ..bare(method, r * d) };
        // The last sample within R is up to one step short of R, which is at most 2 along the wall. For A = (1 + d/R)/2
        // this changes A by d/R^2, which is 0.0047 at the first R and less at the others.
        let [by_horizon, _] = hold_pixel(&context, &valley, &settings(Method::Hbao), pixel, traced, 0.005);
        // The sum over texels approximates an integrand that varies within the 2 texels to the wall. Its error is 0.005
        // at the last R and 0.0005 at the others.
        let spheres = settings(Method::Microsphere);
        let [by_spheres, twin] = hold_pixel(&context, &valley, &spheres, pixel, 1.0 - closed, 0.01);
        assert!(by_spheres.max(twin) <= traced - least, "R = {r} d: {by_spheres}, {twin}; rays {traced}");
        factors.push((1.0 - by_horizon) / (1.0 - by_spheres));
    }
    // The closed forms give 0.97, 0.7 and 0.54.
    assert!(factors[0] > 1.5 * factors[2], "{factors:?}");
}

/// The same section: micro-spheres and creases are seen through each other. A wall of height 3 stands 4 texels from P
/// and hides another one of height 3.5, which is 2 texels behind it. HBAO's horizon does not see the second wall. The
/// other two methods add it in full.
#[test]
fn a_hidden_layer_counts_for_spheres_and_creases_and_not_for_hbao() {
    use std::f64::consts::TAU;
    let (alone, hiding) = (columns(0.0, &[(20, 3.0)]), columns(0.0, &[(20, 3.0), (22, 3.5)]));
    // With R = 8 and 3 steps of 2 texels in 4 directions, the walls are the second and the third sample.
    let settings = |method| Settings { directions: 4, steps: 3, ..bare(method, 8.0) };
    let (pixel, context) = ((16, 6), Context::open(Backend::Egl).unwrap());
    let squared = 6.0 * 6.0 + 3.5 * 3.5;
    let cosine = 3.5 / f64::sqrt(squared);
    // rho = 1/2, and the third sample stands for 2 pi 3 2^2 / 4 texels.
    let omega = TAU * (1.0 - (1.0 - 0.25 / squared).sqrt());
    let sphere = TAU * 3.0 * omega * cosine / (TAU / 2.0);
    let crease = TAU / 12.0 * cosine / (TAU / 2.0);
    for (method, added) in [(Method::Hbao, 0.0), (Method::Microsphere, sphere), (Method::Crease, crease)] {
        let [one, two] = [&alone, &hiding].map(|view| view.by_both(context.gl(), &settings(method)));
        for ((who, one), (_, two)) in one.into_iter().zip(two) {
            let (one, two) = (one.at(pixel.0, pixel.1), two.at(pixel.0, pixel.1));
            assert!((one - two - added).abs() < FLOAT, "{who}, {}: {one} {two}, not {added}", method.name());
            assert!(one < 0.99 && two > 0.0);
        }
    }
}

/// Figure 6.2.4: points over the outer floor are above the height field, but the rim hides them from P. The horizon
/// stays at the rim, which is met at (6, 0) and (6, 6) texels, so A = 1 - (sin h_0 + sin h_45)/2.
///
/// Rays at sines of 1/8 and 3/8 hit the rim, and those at 5/8 and 7/8 pass over it, since 4/sqrt(4^2 + 6^2) = 0.55. Ray
/// marching therefore gives A = 1/2.
#[test]
fn a_point_above_the_height_field_that_a_rim_hides_is_closed() {
    let context = Context::open(Backend::Egl).unwrap();
    const RIM: f64 = 4.0;
    let view = pit(RIM);
    let middle = (PIT, PIT);
    // S is the point of the figure: 10 texels away and 2 high.
    let depth = |x: usize| f64::from(view.depth.at(PIT + x, PIT));
    let (s, h) = (10, 2.0);
    assert!(depth(0) - h < depth(s), "S must be above the height field");
    assert!(depth(0) - h * 6.0 / s as f64 > depth(6), "the line of sight to S must meet the rim");

    let sine = |squared: f64| RIM / (squared + RIM * RIM).sqrt();
    let closed = 1.0 - (sine(36.0) + sine(72.0)) / 2.0;
    // R = 16 and 7 steps give steps of 2 texels, and of (1, 1) on the diagonals.
    for method in [Method::Hbao, Method::HbaoTalk] {
        let settings = Settings { directions: 8, steps: 7, ..bare(method, 16.0) };
        hold_pixel(&context, &view, &settings, middle, closed, FLOAT);
        hold_pixel(&context, &pit(0.0), &settings, middle, 1.0, FLOAT);
        // The floor behind the rim may be far below, and this opens nothing.
        let outside = |x: usize, y: usize| x.abs_diff(PIT).max(y.abs_diff(PIT)) > 7;
        let mut cliff = pit(RIM);
        let width = cliff.depth.width;
        (0..cliff.depth.texels.len())
            .filter(|i| outside(i % width, i / width))
            .for_each(|i| cliff.depth.texels[i] += 1000.0);
        hold_pixel(&context, &cliff, &settings, middle, closed, FLOAT);
    }
    // Steps are at most half a texel long, so they cannot pass through the rim.
    let rays = Settings { directions: 8, steps: 31, rays: 4, ..bare(Method::RayMarch, 16.0) };
    hold_pixel(&context, &view, &rays, middle, 0.5, FLOAT);
    hold_pixel(&context, &pit(0.0), &rays, middle, 1.0, FLOAT);
}

/// Compares two blurred images at covered pixels. Returns the largest difference, and the root of the mean square.
fn difference(a: &Image<f64>, b: &Image<f64>, depth: &Image<f32>) -> (f64, f64) {
    let differences: Vec<f64> = (0..a.texels.len())
        .filter(|&i| depth.texels[i].is_finite())
        .map(|i| (a.texels[i] - b.texels[i]).abs())
        .collect();
    let squares: f64 = differences.iter().map(|d| d * d).sum();
    (differences.iter().copied().fold(0.0, f64::max), (squares / differences.len() as f64).sqrt())
}

/// The section on the cross-bilateral filter: it is not separable, but a separated filter is said to look nearly the
/// same.
///
/// The differences were measured over the scenes, in perspective and orthographic, at 97x61. For a 9x9 blur the largest
/// is 0.056, and the root of the mean square is 0.0038 in the worst scene. For a 21x21 blur they are 0.112 and 0.0118.
/// (The blurs themselves change A by 0.28 and 0.033, and by 0.36 and 0.060.) The differences occur next to corners of
/// silhouettes, around parts that are thinner than the kernel, and along creases that run diagonally through the
/// picture. Where depth changes along one axis of the image only, there are none, as the next test shows.
#[test]
fn the_separated_blur_stays_near_the_full_one() {
    let context = Context::open(Backend::Egl).unwrap();
    for (size, most, most_rms) in [(9, 0.06, 0.004), (21, 0.12, 0.0125)] {
        let mut worst = [(0.0f64, 0.0f64); 2];
        for shot in scenes::all().into_iter().chain(scenes::all().into_iter().map(Shot::orthographic)) {
            let [(separable, by_x_y), (full, by_square)] =
                [BlurKernel::Separable, BlurKernel::Full].map(|blur_kernel| {
                    let settings = Settings { blur: size, blur_kernel, ..rig::float_settings(shot.radius) };
                    let frame = rig::render(context.gl(), &shot, SIZE, &settings);
                    let twin =
                        blur(&frame.raw.map(f64::from), &frame.depth, &frame.samples, frame.projection, &settings)
                            .unwrap();
                    (frame, twin)
                });
            let by_shader = difference(&separable.ao.map(f64::from), &full.ao.map(f64::from), &full.depth);
            let by_twin = difference(&by_x_y, &by_square, &full.depth);
            for (worst, (max, rms)) in worst.iter_mut().zip([by_shader, by_twin]) {
                assert!(max < most && rms < most_rms, "{size} on {}: {max}, {rms}", shot.name);
                *worst = (worst.0.max(max), worst.1.max(rms));
            }
        }
        // The two filters do differ: the bounds are close to the measured differences.
        for (max, rms) in worst {
            assert!(max > 0.8 * most && rms > 0.8 * most_rms, "{size}: {max}, {rms}");
        }
    }
}

/// Where depth depends on x alone, the weights are a product of one in x and one in y, so both forms are the same.
#[test]
fn the_separated_blur_is_exact_where_depth_changes_along_one_axis() {
    let context = Context::open(Backend::Egl).unwrap();
    let steps = columns(0.3, &[(7, 2.0), (15, 1.0), (16, 1.5), (25, -2.0)]);
    // The AO of these steps does not vary in y. The twin therefore also blurs a made-up image that does.
    let ao = steps.depth.map(|_| 0.0);
    let ao = Image::from_fn(ao.width, ao.height, |x, y| hills(x, y) / 6.6);
    for size in [9, 21] {
        let of = |blur_kernel| Settings { blur: size, blur_kernel, steps: 3, ..bare(Method::Hbao, 8.0) };
        let [(shader, x_y), (shader_full, square)] = [BlurKernel::Separable, BlurKernel::Full].map(|kernel| {
            (
                steps.by_shader(context.gl(), &of(kernel)),
                blur(&ao, &steps.depth, &[], steps.projection, &of(kernel)).unwrap(),
            )
        });
        hold("twin", &x_y, &square, &ao.map(|_| true), everywhere(1e-12), "");
        hold("shader", &shader, &shader_full, &ao.map(|_| true), everywhere(FLOAT), "");
        assert!(shader.texels.iter().any(|&a| a < 0.9));
    }
}

/// The section on snapping texture coordinates: S.xy must be where S.z was read. The plane here falls away to the right
/// by g per texel. With 2 directions and steps of 2.4 texels, unsnapped samples at 2.4, 4.8 and 7.2 texels read the
/// depths at 2, 5 and 7. The plane seems to fall by only 5/6 g at the first, and to rise to the left by 25/24 g at the
/// second. The tangents cancel, which leaves
///
/// A = 1 - [S(25/24 g) - S(5/6 g)]/2, where S(g) = g / sqrt(1 + g^2) is the sine of a slope.
#[test]
fn unsnapped_samples_darken_a_plane_and_snapped_ones_do_not() {
    let context = Context::open(Backend::Egl).unwrap();
    let sine = |slope: f64| slope / (1.0 + slope * slope).sqrt();
    for g in [0.25, 0.5, 1.0f64] {
        let plane = columns(g, &[]);
        let false_occlusion = (sine(25.0 / 24.0 * g) - sine(5.0 / 6.0 * g)) / 2.0;
        assert!(false_occlusion > 0.005);
        for (snap, expected) in [(Snap::None, 1.0 - false_occlusion), (Snap::Step, 1.0), (Snap::Sample, 1.0)] {
            let settings = Settings { directions: 2, steps: 3, snap, ..bare(Method::Hbao, 9.6) };
            hold_pixel(&context, &plane, &settings, (20, 6), expected, FLOAT);
        }
    }
}

/// The section on integrating the ambient occlusion: Eq. 6.2.8 is correct if all samples of a direction have the same
/// angle. They do if the step is snapped and nothing moves the first sample. Then t_i = t, and Eq. 6.2.9 gives the same
/// result. Samples that are snapped one by one have different angles, and the two equations differ.
#[test]
fn both_groundings_agree_where_samples_share_their_angle_and_only_there() {
    let context = Context::open(Backend::Egl).unwrap();
    let orthographic = heights(SIZE, hills, |_, _| [0.5, -0.3]);
    let depth = orthographic.depth.map(|z| z - 90.0);
    let perspective = ByHand { depth, projection: perspective(60.0, SIZE), normals: orthographic.normals.clone() };
    // A sample that is clamped to the border leaves its direction, so a margin is left out. R is 12 texels, and in
    // perspective at most 17.
    let inside = Image::from_fn(SIZE.0 as usize, SIZE.1 as usize, |x, y| {
        (18..SIZE.0 as usize - 18).contains(&x) && (18..SIZE.1 as usize - 18).contains(&y)
    });
    for (view, radius) in [(&orthographic, 12.0), (&perspective, 1.25)] {
        for (snap, agree) in [(Snap::Step, true), (Snap::Sample, false)] {
            let settings = |grounding| Settings {
                grounding,
                snap,
                directions: 7,
                steps: 4,
                attenuation: Attenuation::Quadratic,
                ..bare(Method::Hbao, radius)
            };
            let by = |grounding| view.by_both(context.gl(), &settings(grounding));
            for ((who, sample), (_, direction)) in by(Grounding::Sample).into_iter().zip(by(Grounding::Direction)) {
                let closeness = rig::compare(&sample, &direction, &inside, everywhere(FLOAT));
                assert_eq!(closeness.is_ok(), agree, "{who}, {snap:?}, {:?}: {closeness:?}", view.projection);
                assert!(sample.texels.iter().any(|&a| a < 0.8));
            }
        }
    }
}

/// The section on the attenuation function: one W at the horizon is the lowest of all samples of its direction and
/// over-attenuates.
///
/// On a floor that faces the eye all accepted sines are above 0. As the sines and |D.xy| grow, so does |D|, and W
/// falls. Summation by parts gives sum W_i (s_i - s_i-1) >= W_n s_n, so the talk's method is never darker there. It is
/// lighter where two samples are met: a wall of height 2 at 4 texels and one of height 6 at 8 texels add W_1 s_1 + W_2
/// (s_2 - s_1) in the chapter's method and W_2 s_2 in the talk's, in one direction of 4.
#[test]
fn the_talk_attenuates_more_than_the_chapter_on_what_faces_the_eye() {
    let context = Context::open(Backend::Egl).unwrap();
    let settings =
        |method| Settings { directions: 4, steps: 3, attenuation: Attenuation::Quadratic, ..bare(method, 16.0) };
    let met = |away: f64, high: f64| {
        let squared = away * away + high * high;
        (high / squared.sqrt(), 1.0 - squared / 256.0)
    };
    let ((s1, w1), (s2, w2)) = (met(4.0, 2.0), met(8.0, 6.0));
    let walls = columns(0.0, &[(20, 2.0), (24, 6.0)]);
    let chapter = 1.0 - (w1 * s1 + w2 * (s2 - s1)) / 4.0;
    let talk = 1.0 - w2 * s2 / 4.0;
    assert!(s2 > s1 && talk > chapter + 0.03);
    hold_pixel(&context, &walls, &settings(Method::Hbao), (16, 6), chapter, FLOAT);
    hold_pixel(&context, &walls, &settings(Method::HbaoTalk), (16, 6), talk, FLOAT);

    let view = heights(SIZE, hills, |_, _| [0.0; 2]);
    let by = |method| view.by_both(context.gl(), &Settings { directions: 8, steps: 7, ..settings(method) });
    for ((who, chapter), (_, talk)) in by(Method::Hbao).into_iter().zip(by(Method::HbaoTalk)) {
        let lighter: Vec<f64> = talk.texels.iter().zip(&chapter.texels).map(|(talk, chapter)| talk - chapter).collect();
        assert!(lighter.iter().all(|&l| l > -FLOAT), "{who}");
        assert!(lighter.iter().any(|&l| l > 0.02), "{who}");
    }
}

/// That sentence does not hold everywhere. Below P, a higher sample may be nearer to P, so W rises towards the horizon.
/// On a floor that falls by 8 per texel, the sample at 4 texels lies 14 deeper than P, and the one at 8 texels is as
/// deep as P. W is 1 - 212/256 and then 1 - 64/256. The talk's method uses the latter for both and is darker.
#[test]
fn the_talk_attenuates_less_than_the_chapter_where_the_horizon_is_nearer_than_what_lies_below_it() {
    let context = Context::open(Backend::Egl).unwrap();
    let cliff = columns(8.0, &[(20, 32.0 - 14.0), (24, 64.0)]);
    let settings =
        |method| Settings { directions: 4, steps: 3, attenuation: Attenuation::Quadratic, ..bare(method, 16.0) };
    let t = -8.0 / 65f64.sqrt();
    let (s1, w1) = (-14.0 / 212f64.sqrt(), 1.0 - 212.0 / 256.0);
    let (s2, w2) = (0.0, 1.0 - 64.0 / 256.0);
    let chapter = 1.0 - (w1 * (s1 - t) + w2 * (s2 - s1)) / 4.0;
    let talk = 1.0 - w2 * (s2 - t) / 4.0;
    assert!(s1 > t && talk < chapter - 100.0 * FLOAT);
    hold_pixel(&context, &cliff, &settings(Method::Hbao), (16, 6), chapter, FLOAT);
    hold_pixel(&context, &cliff, &settings(Method::HbaoTalk), (16, 6), talk, FLOAT);
}
