//! Every pass on the GPU is compared with its float64 twin, over scenes, projections, drivers and settings.

use crate::rig;
use crate::rig::by_hand::{self, ByHand, Textures, rubble};
use crate::rig::random::Draw;
use crate::rig::{Frame, SIZE, Shot, everywhere, hold, scenes, twin};
use glam::DVec3;
use hbao::context::{Backend, Context};
use hbao::image::Image;
use hbao::scene::{Extents, Projection};
use hbao::settings::{
    AoFormat, Attenuation, BlurKernel, Clamp, DepthFormat, Edges, Exit, Grounding, Jitter, KNOBS, Kind, Knob, Method,
    NormalFormat, Normals, Quadrature, Radius, Snap, SsaoDepth, SsaoRotation, Toggle, Zenith,
};
use hbao::{AmbientOcclusion, Apply, Inputs, NormalEncoding, Settings, TextureTarget, rotation_tile};
use std::collections::BTreeSet;

/// One frame that is compared with its twins.
struct Case {
    backend: Backend,
    shot: Shot,
    size: (u32, u32),
    settings: Settings,
    apply: Apply,
}

impl Case {
    fn text(&self) -> String {
        let Case { backend, shot, size, settings, .. } = self;
        let camera = shot.camera(*size);
        format!("{}, {} at {size:?}\n{camera:?}\n{}", backend.name(), shot.name, settings.to_toml())
    }
}

/// The number of cases of the chapter's method.
const CASES: usize = 64;
/// The number of cases of each of the other methods except ssao.
const OTHERS: usize = 8;
/// The number of cases of ssao, which has knobs of its own.
const SSAO: usize = 32;

/// All methods except the chapter's and ssao.
fn others() -> Vec<Method> {
    Method::ALL.iter().copied().filter(|&method| method != Method::Hbao && method != Method::Ssao).collect()
}

/// Cases that cover every value of every switch, and many combinations.
fn cases() -> Vec<Case> {
    let mut draw = Draw::new(20_080_602);
    // Knobs that were added later are drawn from sequences of their own, so that the earlier choices stay the same.
    let mut later = Draw::new(20_090_216);
    let mut latest = Draw::new(1_963);
    let mut newest = Draw::new(2_026);
    let (shots, others) = (scenes::all(), others());
    let plain = CASES + OTHERS * others.len();
    let case = |i: usize| {
        let shot = shots[i % shots.len()].clone();
        let shot = if (i / shots.len()).is_multiple_of(2) { shot } else { shot.orthographic() };
        // In a row of a floor all pixels have the same depth, and every fourth pixel has the same offsets of ssao. One
        // tie would be a tie of all these, so the camera is rolled.
        let shot = if i < plain { shot } else { shot.rolled() };
        // The radius is about a texel or far less, or usual, or larger than the scene.
        let radius = shot.radius * draw.one(&[0.03, 0.5, 1.0, 1.0, 100.0]);
        let spacing = *newest.one(&[1.0, 1.5, 1.5, 2.0, 1.3, 4.0]);
        let settings = Settings {
            radius: Radius::Units(radius),
            directions: *draw.one(&[1, 2, 3, 5, 8, 8, 16, 64]),
            steps: *draw.one(&[1, 2, 4, 8, 8, 33, 256]),
            bias: draw.one(&[0.0, 0.0, 10.0, 45.0, 89.0f64]).to_radians(),
            strength: *draw.one(&[0.5, 1.0, 1.0, 3.0]),
            attenuation: *draw.one(&[Attenuation::Quadratic, Attenuation::Linear, Attenuation::None]),
            snap: *draw.one(&[Snap::Step, Snap::Sample, Snap::None]),
            clamp: *draw.one(&[Clamp::Position, Clamp::Depth]),
            grounding: *draw.one(&[Grounding::Sample, Grounding::Direction]),
            normals: *draw.one(&[Normals::Derivative, Normals::Vertex]),
            jitter: *draw.one(&[Jitter::Tile, Jitter::Tile, Jitter::None]),
            blur: *draw.one(&[0, 3, 9, 9, 21, 41]),
            blur_kernel: *draw.one(&[BlurKernel::Separable, BlurKernel::Full]),
            blur_depth_sigma: *draw.one(&[None, Some(0.02 * shot.radius), Some(1e30)]),
            ao_format: *draw.one(&[AoFormat::R32f, AoFormat::R32f, AoFormat::R16f, AoFormat::R8]),
            normal_format: *draw.one(&[NormalFormat::Rgba8Snorm, NormalFormat::Rgba16f]),
            depth_format: *draw.one(&[DepthFormat::R32f, DepthFormat::R32f, DepthFormat::R16f]),
            method: match i {
                _ if i < CASES => Method::Hbao,
                _ if i < plain => others[i % others.len()],
                _ => Method::Ssao,
            },
            rays: [1, 2, 4, 7][i % 4],
            msaa: *later.one(&[1, 4, 4, 2, 8]),
            edges: *later.one(&[Edges::Supersample, Edges::Supersample, Edges::Off]),
            half_res: *later.one(&[false, false, true]),
            exit: *latest.one(&[Exit::Paper, Exit::Shorten]),
            zenith: *newest.one(&[Zenith::View, Zenith::View, Zenith::Axis]),
            spacing,
            quadrature: *newest.one(Quadrature::ALL),
            ssao_samples: *later.one(&[8, 16, 24]),
            ssao_rotation: *later.one(&[SsaoRotation::Matrix, SsaoRotation::Mirror]),
            ssao_depth: *later.one(&[SsaoDepth::Full, SsaoDepth::Half]),
            ssao_normals: *later.one(&[Toggle::Off, Toggle::On]),
            ssao_curve: *later.one(&[None, Some(Toggle::Off), Some(Toggle::On)]),
        };
        let settings = rig::evenly_if_stepping(settings);
        // The twin takes time in proportion to the number of samples.
        let size = if settings.method.samples(&settings) > 300 { (33, 21) } else { SIZE };
        // The ambient share of an edge pixel is the mean over its samples, which this test does not read back.
        let applies = if settings.msaa == 1 { &[Apply::All, Apply::Ambient][..] } else { &[Apply::All] };
        Case { backend: *draw.one(&rig::BOTH), shot, size, settings, apply: *draw.one(applies) }
    };
    (0..plain + SSAO).map(case).collect()
}

fn hold_composite(frame: &Frame, case: &Case) {
    // The ambient part of a shade is what remains where no light falls. Its share follows from the normal and the
    // light.
    let light = DVec3::new(-2.0, 3.0, -3.5).normalize();
    for channel in 0..3 {
        let expected = Image::from_fn(frame.depth.width, frame.depth.height, |x, y| {
            let n = DVec3::from(frame.normals.at(x, y).map(f64::from));
            let share = match case.apply {
                Apply::All => 1.0,
                Apply::Ambient => 0.4 / (0.4 + 0.6 * n.dot(light).max(0.0)),
            };
            // At half resolution without a blur, the image is not brought to full size.
            let texel = if frame.ao.width == frame.depth.width { [x, y] } else { [x / 2, y / 2] };
            let ao = frame.ao.at(texel[0], texel[1]);
            let visibility = 1.0 - share * (1.0 - f64::from(ao));
            f64::from(frame.colour.at(x, y)[channel]) / 255.0 * visibility
        });
        let got = frame.composite.map(|c| f64::from(c[channel]) / 255.0);
        // Three values are rounded to 8 bits: the image, the ambient share, and the normal that is read back here.
        let limits = everywhere(2.0 / 255.0);
        hold("composite", &got, &expected, &got.map(|_| true), limits, &case.text());
    }
}

/// Checks every fourth case from `start`, so that four tests can run side by side.
fn hold_cases_from(start: usize) {
    let (mut frames, mut occluded) = (0, 0);
    for case in cases().into_iter().skip(start).step_by(4) {
        let context = Context::open(case.backend).unwrap();
        let frame = rig::render_applied(context.gl(), &case.shot, case.size, &case.settings, case.apply);
        frames += usize::from(rig::computes(case.settings.method));
        occluded += usize::from(frame.raw.texels.iter().any(|&a| a < 0.98));
        let text = case.text();
        twin::hold_gbuffer(&frame, &case.shot, case.size, &case.settings, &text);
        twin::hold_raw(&frame, &case.settings, &text);
        twin::hold_edges(&frame, &case.settings, &text);
        twin::hold_blur(&frame, &case.settings, &text);
        hold_composite(&frame, &case);
    }
    // Comparing images that are 1 everywhere would show little.
    assert!(occluded * 4 >= frames, "{occluded} of {frames} frames have any occlusion");
}

#[test]
fn all_passes_match_their_twins_first_quarter() {
    hold_cases_from(0);
}

#[test]
fn all_passes_match_their_twins_second_quarter() {
    hold_cases_from(1);
}

#[test]
fn all_passes_match_their_twins_third_quarter() {
    hold_cases_from(2);
}

#[test]
fn all_passes_match_their_twins_last_quarter() {
    hold_cases_from(3);
}

#[test]
fn the_cases_cover_every_value_of_every_switch() {
    let cases = cases();
    for knob in KNOBS {
        let used: BTreeSet<String> = cases.iter().map(|case| knob.text(&case.settings)).collect();
        let wanted: Vec<String> = match (knob.name, knob.kind) {
            (_, Kind::Word(names)) => names.iter().map(|&name| name.into()).collect(),
            ("bias", _) => ["0.0", "10.0", "45.0", "89.0"].map(String::from).to_vec(),
            ("directions", _) => ["1", "2", "3", "5", "8", "16", "64"].map(String::from).to_vec(),
            ("steps", _) => ["1", "2", "4", "8", "33", "256"].map(String::from).to_vec(),
            ("rays", _) => ["1", "2", "4", "7"].map(String::from).to_vec(),
            ("blur", _) => ["0", "3", "9", "21", "41"].map(String::from).to_vec(),
            ("ssao-samples", _) => ["8", "16", "24"].map(String::from).to_vec(),
            ("strength", _) => ["0.5", "1.0", "3.0"].map(String::from).to_vec(),
            _ => continue,
        };
        for value in wanted {
            assert!(used.contains(&value), "no case has {} = {value}", knob.name);
        }
    }
    // The knobs that only ssao reads must vary in its cases: each value of each of them with each value of every other.
    let own: Vec<&Knob> = KNOBS.iter().filter(|knob| knob.name.starts_with("ssao-")).collect();
    let values = |knob: &Knob| match knob.kind {
        Kind::Word(names) => names.iter().map(|&name| name.into()).collect(),
        Kind::OneOf(values) => values.iter().map(u32::to_string).collect::<Vec<String>>(),
        _ => panic!("{} takes something else", knob.name),
    };
    let ssao: Vec<&Case> = cases.iter().filter(|case| case.settings.method == Method::Ssao).collect();
    for (i, a) in own.iter().enumerate() {
        for b in &own[..i] {
            for (x, y) in values(a).iter().flat_map(|x| values(b).into_iter().map(move |y| (x, y))) {
                let both = |case: &&Case| a.text(&case.settings) == *x && b.text(&case.settings) == y;
                assert!(ssao.iter().any(both), "no case of ssao has {} = {x} and {} = {y}", a.name, b.name);
            }
        }
    }
    let perspective = |case: &&Case| matches!(case.shot.camera(SIZE).projection, Projection::Perspective { .. });
    for backend in rig::BOTH {
        let on_backend = cases.iter().filter(|case| case.backend == backend);
        let (yes, no): (Vec<&Case>, Vec<&Case>) = on_backend.partition(perspective);
        assert!(yes.len() > 8 && no.len() > 8);
    }
    // The formats that round are less strict tests, so many cases must use R32F.
    assert!(cases.iter().filter(|case| case.settings.ao_format == AoFormat::R32f).count() > CASES / 3);
}

#[test]
fn the_default_settings_match_on_every_scene_projection_and_driver() {
    for backend in rig::BOTH {
        let context = Context::open(backend).unwrap();
        let mut shots = scenes::all();
        shots.extend(scenes::all().into_iter().map(Shot::orthographic));
        for shot in shots {
            let settings = Settings { radius: Radius::Units(shot.radius), ..Settings::default() };
            let case = Case { backend, shot, size: SIZE, settings, apply: Apply::All };
            let text = case.text();
            let frame = rig::render(context.gl(), &case.shot, SIZE, &case.settings);
            twin::hold_gbuffer(&frame, &case.shot, SIZE, &case.settings, &text);
            twin::hold_raw(&frame, &case.settings, &text);
            twin::hold_edges(&frame, &case.settings, &text);
            twin::hold_blur(&frame, &case.settings, &text);
        }
    }
}

/// The nave has thousands of triangles, most of them small, and surfaces at all angles.
#[test]
fn the_nave_matches_on_every_driver() {
    for backend in rig::BOTH {
        let context = Context::open(backend).unwrap();
        let (shot, size) = (scenes::nave(), (200, 150));
        let settings = Settings { radius: Radius::Units(shot.radius), ..Settings::default() };
        let frame = rig::render(context.gl(), &shot, size, &settings);
        twin::hold_gbuffer(&frame, &shot, size, &settings, "nave");
        twin::hold_edges(&frame, &settings, "nave");
        twin::hold_raw(&frame, &settings, "nave");
        twin::hold_blur(&frame, &settings, "nave");
    }
}

/// Hills of random height with random normals and holes.
fn hills(projection: Projection, seed: u128) -> ByHand {
    rubble(SIZE, projection, seed, 8.0..10.0)
}

#[test]
fn an_applications_own_textures_of_either_kind_and_encoding_match_the_twin() {
    let context = Context::open(Backend::Egl).unwrap();
    // The texels are wider than high, in perspective too.
    let projections =
        [Projection::Perspective(Extents::centred(1.1, 0.5)), Projection::Orthographic(Extents::centred(9.0, 4.0))];
    for (seed, projection) in (1..).zip(projections) {
        let view = hills(projection, seed);
        for target in [TextureTarget::Rectangle, TextureTarget::Texture2d] {
            for encoding in [NormalEncoding::Signed, NormalEncoding::Biased] {
                let settings = Settings { blur: 0, ..rig::float_settings(2.0) };
                let got = view.by_shader_from(context.gl(), &settings, target, encoding);
                let tile = rotation_tile(&settings);
                let text = format!("{projection:?} {target:?} {encoding:?}");
                twin::hold_visibility(&got, &view.twin_inputs(&tile), &settings, &text);
            }
        }
    }
}

#[test]
fn depth_and_normals_may_come_in_different_kinds_of_textures() {
    let context = Context::open(Backend::Egl).unwrap();
    let view = hills(by_hand::perspective(60.0, SIZE), 5);
    let settings = Settings { blur: 0, ..rig::float_settings(2.0) };
    let expected = view.by_shader(context.gl(), &settings);
    let [rectangles, flat] = [TextureTarget::Rectangle, TextureTarget::Texture2d]
        .map(|target| Textures::new(context.gl(), &view, target, NormalEncoding::Signed));
    for (depth, normals) in [(&rectangles, &flat), (&flat, &rectangles)] {
        let inputs = Inputs { normals: normals.inputs.normals, ..depth.inputs };
        let mut ao = AmbientOcclusion::new(context.gl().clone(), view.size(), &settings).unwrap();
        let visibility = ao.render(&inputs).unwrap();
        let got = by_hand::read_red(context.gl(), visibility, view.depth.texels.len());
        assert_eq!(got, expected.texels);
    }
}

#[test]
fn inputs_of_another_kind_or_size_and_projections_without_extent_are_refused() {
    let context = Context::open(Backend::Egl).unwrap();
    let view = hills(by_hand::perspective(60.0, SIZE), 5);
    let textures = Textures::new(context.gl(), &view, TextureTarget::Rectangle, NormalEncoding::Signed);
    let refused = |size: (u32, u32), inputs: Inputs, part: &str| {
        let mut ao = AmbientOcclusion::new(context.gl().clone(), size, &rig::float_settings(2.0)).unwrap();
        let error = ao.render(&inputs).unwrap_err().to_string();
        assert!(error.contains(part) && !error.contains('\n'), "{error}");
        // The object can still be used after the error.
        assert_eq!(ao.render(&textures.inputs).is_ok(), size == SIZE);
    };
    refused((SIZE.0 + 1, SIZE.1), textures.inputs, "the depth texture has 97x61 texels");
    let mut flat = textures.inputs;
    flat.normals.iter_mut().for_each(|normals| normals.target = TextureTarget::Texture2d);
    refused(SIZE, flat, "the normals texture is not of the declared kind");
    for tan_half_fov_x in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let projection = Projection::Perspective(Extents::centred(tan_half_fov_x, 1.0));
        refused(SIZE, Inputs { projection, ..textures.inputs }, "must be finite and above 0");
    }
    let marched = Settings { method: Method::RayMarch, ..rig::float_settings(2.0) };
    let mut ao = AmbientOcclusion::new(context.gl().clone(), SIZE, &marched).unwrap();
    for near in [0.0, -1.0, f64::NAN] {
        let error = ao.render(&Inputs { near, ..textures.inputs }).unwrap_err().to_string();
        assert!(error.contains("near must be above 0"), "{error}");
    }
    assert!(ao.render(&textures.inputs).is_ok());
}

#[test]
fn random_heights_match_the_twin_under_every_way_to_take_samples() {
    let context = Context::open(Backend::Osmesa).unwrap();
    let view = hills(by_hand::perspective(60.0, SIZE), 3);
    for snap in [Snap::Step, Snap::Sample, Snap::None] {
        for clamp in [Clamp::Position, Clamp::Depth] {
            for grounding in [Grounding::Sample, Grounding::Direction] {
                let settings = Settings { snap, clamp, grounding, blur: 0, ..rig::float_settings(2.0) };
                let got = view.by_shader(context.gl(), &settings);
                let tile = rotation_tile(&settings);
                let text = settings.to_toml().to_string();
                twin::hold_visibility(&got, &view.twin_inputs(&tile), &settings, &text);
            }
        }
    }
}

#[test]
fn random_heights_match_the_twin_under_every_variant_of_ssao() {
    let context = Context::open(Backend::Osmesa).unwrap();
    for (seed, projection) in [(7, by_hand::perspective(60.0, SIZE)), (8, by_hand::orthographic(0.1, SIZE))] {
        let view = hills(projection, seed);
        for ssao_rotation in [SsaoRotation::Matrix, SsaoRotation::Mirror] {
            for ssao_depth in [SsaoDepth::Full, SsaoDepth::Half] {
                for ssao_normals in [Toggle::Off, Toggle::On] {
                    let settings = Settings {
                        method: Method::Ssao,
                        ssao_samples: 24,
                        ssao_rotation,
                        ssao_depth,
                        ssao_normals,
                        ssao_curve: Some(Toggle::Off),
                        blur: 0,
                        ..rig::float_settings(2.0)
                    };
                    let text = format!("{projection:?}\n{}", settings.to_toml());
                    let tile = rotation_tile(&settings);
                    for target in [TextureTarget::Rectangle, TextureTarget::Texture2d] {
                        let got = view.by_shader_from(context.gl(), &settings, target, NormalEncoding::Signed);
                        twin::hold_visibility(&got, &view.twin_inputs(&tile), &settings, &text);
                    }
                }
            }
        }
    }
}
