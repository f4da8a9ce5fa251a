//! Settings and sizes that change while an application runs.

use crate::rig;
use crate::rig::by_hand::{ByHand, Textures, perspective, read_red, rubble};
use crate::rig::every_switch;
use hbao::context::{Backend, Context};
use hbao::image::Image;
use hbao::scene::Projection;
use hbao::settings::{DepthFormat, Method, Radius};
use hbao::{AmbientOcclusion, Apply, NormalEncoding, Pipeline, Request, Settings, TextureTarget};

const SIZE: (u32, u32) = (45, 31);

fn view(size: (u32, u32)) -> ByHand {
    rubble(size, perspective(60.0, size), 5, 2.0..4.0)
}

fn textures(context: &Context, view: &ByHand) -> Textures {
    Textures::new(context.gl(), view, TextureTarget::Rectangle, NormalEncoding::Signed)
}

/// Renders, and reads back as many texels as the result has.
fn rendered(context: &Context, ao: &mut AmbientOcclusion, textures: &Textures) -> Vec<u32> {
    let visibility = ao.render(&textures.inputs).unwrap();
    let scale = if ao.settings().blur == 0 { ao.settings().ao_scale() } else { 1 };
    let (width, height) = ao.size();
    let texels = (width.div_ceil(scale) * height.div_ceil(scale)) as usize;
    read_red(context.gl(), visibility, texels).into_iter().map(f32::to_bits).collect()
}

/// Settings that differ in everything that shaders, images and passes depend on.
fn many() -> Vec<Settings> {
    let fits = |settings: Settings| Settings {
        radius: if settings.radius.units().is_some() { Radius::Units(1.0) } else { settings.radius },
        depth_format: DepthFormat::R32f,
        ..settings
    };
    every_switch().into_iter().map(fits).collect()
}

#[test]
fn changed_settings_render_what_a_new_object_renders() {
    let context = Context::open(Backend::Egl).unwrap();
    let view = view(SIZE);
    let textures = textures(&context, &view);
    let all = many();
    let mut changed = AmbientOcclusion::new(context.gl().clone(), SIZE, &all[0]).unwrap();
    // Forwards and backwards, so that each change is met in both directions.
    for settings in all.iter().chain(all.iter().rev()) {
        changed.set(settings).unwrap();
        assert_eq!(changed.settings(), settings);
        let got = rendered(&context, &mut changed, &textures);
        let mut new = AmbientOcclusion::new(context.gl().clone(), SIZE, settings).unwrap();
        assert!(got == rendered(&context, &mut new, &textures), "{}", settings.to_toml());
    }
}

#[test]
fn a_pipeline_that_changes_renders_what_a_new_one_renders() {
    let context = Context::open(Backend::Egl).unwrap();
    let shot = rig::scenes::box_on_a_floor();
    let request = Request { composite: Some(Apply::All), raw: true, edges: true, ..Request::default() };
    let all = every_switch();
    let mut changed = Pipeline::new(context.gl(), SIZE, &all[0], request).unwrap();
    let sizes = [SIZE, (64, 48), SIZE, (31, 45)];
    for (settings, size) in all.iter().zip(sizes.into_iter().cycle()) {
        changed.resize(size).unwrap();
        changed.set(settings).unwrap();
        assert!(!changed.set(settings).unwrap(), "{}", settings.to_toml());
        let got = rig::frame(&mut changed, &shot, size, settings);
        let expected = rig::render(context.gl(), &shot, size, settings);
        rig::assert_identical(&got, &expected, &format!("{size:?} {}", settings.to_toml()));
    }
    // What is refused leaves what was there.
    assert!(changed.resize((0, 8)).is_err() && changed.set(&Settings { steps: 0, ..all[0].clone() }).is_err());
    let (settings, size) = (&all[all.len() - 1], sizes[(all.len() - 1) % sizes.len()]);
    let got = rig::frame(&mut changed, &shot, size, settings);
    rig::assert_identical(&got, &rig::render(context.gl(), &shot, size, settings), "refused");
}

#[test]
fn only_what_is_compiled_in_compiles_and_only_once() {
    let context = Context::open(Backend::Egl).unwrap();
    let view = view(SIZE);
    let textures = textures(&context, &view);
    for method in rig::methods() {
        let base = Settings { blur: 9, bias: 0.1, ..rig::raw(method, 1.0) };
        let mut ao = AmbientOcclusion::new(context.gl().clone(), SIZE, &base).unwrap();
        ao.render(&textures.inputs).unwrap();
        let name = method.name();
        for numbers in [
            Settings { radius: Radius::Units(1.5), ..base.clone() },
            Settings { strength: 0.5, ..base.clone() },
            Settings { bias: 0.2, ..base.clone() },
            base.clone(),
        ] {
            let before = rendered(&context, &mut ao, &textures);
            let compiled = ao.set(&numbers).unwrap();
            assert!(!compiled, "{name}");
            let after = rendered(&context, &mut ao, &textures);
            assert_eq!(before == after, !changes(&numbers, &base), "{name}: {numbers:?}");
            ao.set(&base).unwrap();
        }
        let sigma = |sigma| Settings { blur_depth_sigma: Some(sigma), ..base.clone() };
        ao.set(&sigma(0.1)).unwrap();
        assert!(!ao.set(&sigma(0.2)).unwrap(), "{name}");
        // The blur alone is compiled where the blur alone changes, and the method's shader is kept.
        if !base.method.facts().blur.eq(&hbao::settings::MethodBlur::Crysis) {
            assert!(ao.set(&Settings { blur: 5, ..base.clone() }).unwrap(), "{name}");
        }
        let compiled_in = Settings { jitter: hbao::settings::Jitter::None, ..base.clone() };
        assert!(ao.set(&compiled_in).unwrap(), "{name}");
        for earlier in [&base, &compiled_in, &base] {
            assert!(!ao.set(earlier).unwrap(), "{name}: earlier shaders are kept");
        }
    }
}

/// Returns whether the numbers change what the method computes.
fn changes(numbers: &Settings, base: &Settings) -> bool {
    numbers.radius != base.radius && base.method.reads("radius")
        || numbers.strength != base.strength && base.method.reads("strength")
        || numbers.bias != base.bias && base.method.reads("bias")
}

#[test]
fn the_shaders_that_are_kept_have_a_bound() {
    let context = Context::open(Backend::Egl).unwrap();
    let view = view((5, 5));
    let textures = textures(&context, &view);
    let with = |steps| Settings { steps, ..rig::raw(Method::Hbao, 1.0) };
    let mut ao = AmbientOcclusion::new(context.gl().clone(), (5, 5), &with(1)).unwrap();
    ao.render(&textures.inputs).unwrap();
    for steps in 2..=40 {
        assert!(ao.set(&with(steps)).unwrap());
    }
    assert!(!ao.set(&with(39)).unwrap(), "the last ones are kept");
    assert!(ao.set(&with(1)).unwrap(), "the first ones are not");
}

#[test]
fn a_new_size_renders_what_a_new_object_renders_and_compiles_nothing() {
    let context = Context::open(Backend::Egl).unwrap();
    for settings in many().into_iter().step_by(3) {
        let mut resized = AmbientOcclusion::new(context.gl().clone(), SIZE, &settings).unwrap();
        for size in [SIZE, (8, 61), (1, 1), (90, 62), SIZE] {
            resized.resize(size).unwrap();
            assert_eq!(resized.size(), size);
            let view = view(size);
            let textures = textures(&context, &view);
            let mut new = AmbientOcclusion::new(context.gl().clone(), size, &settings).unwrap();
            let expected = rendered(&context, &mut new, &textures);
            assert!(rendered(&context, &mut resized, &textures) == expected, "{size:?} {}", settings.to_toml());
            assert!(!resized.set(&settings).unwrap());
        }
    }
}

#[test]
fn settings_and_sizes_that_are_refused_leave_the_earlier_ones() {
    let context = Context::open(Backend::Egl).unwrap();
    let view = view(SIZE);
    let textures = textures(&context, &view);
    let settings = rig::raw(Method::Hbao, 1.0);
    let mut ao = AmbientOcclusion::new(context.gl().clone(), SIZE, &settings).unwrap();
    let expected = rendered(&context, &mut ao, &textures);
    for wrong in [
        Settings { steps: 0, ..settings.clone() },
        Settings { radius: Radius::Percent(5.0), ..settings.clone() },
        Settings { bias: 2.0, ..settings.clone() },
    ] {
        assert!(ao.set(&wrong).unwrap_err().is_usage());
        assert_eq!(ao.settings(), &settings);
    }
    for size in [(0, 1), (1 << 20, 1)] {
        assert!(ao.resize(size).unwrap_err().is_usage());
        assert_eq!(ao.size(), SIZE);
    }
    assert!(rendered(&context, &mut ao, &textures) == expected);
}

#[test]
fn what_was_prepared_compiles_nothing_more() {
    let context = Context::open(Backend::Egl).unwrap();
    let view = view(SIZE);
    let textures = textures(&context, &view);
    let [a, b] = [Method::Hbao, Method::HbaoView].map(|method| Settings { blur: 9, ..rig::raw(method, 1.0) });
    let mut ao = AmbientOcclusion::new(context.gl().clone(), SIZE, &a).unwrap();
    assert!(!ao.set(&b).unwrap(), "before the first inputs nothing is known that could be compiled");
    ao.prepare(&textures.inputs).unwrap();
    assert!(ao.set(&a).unwrap());
    for settings in [&b, &a, &b] {
        assert!(!ao.set(settings).unwrap());
        ao.render(&textures.inputs).unwrap();
    }
}

/// An application that sets a bias in radians reads of radians.
#[test]
fn an_angle_out_of_range_is_told_in_radians() {
    let message = Settings { bias: 2.0, ..Settings::default() }.validate().unwrap_err().to_string();
    assert_eq!(message, "bias: 2.0000 is not an angle from 0 to 1.5533 radians");
    let knob = hbao::settings::Knob::named("bias").unwrap();
    let message = knob.set(&mut Settings::default(), "90").unwrap_err().to_string();
    assert!(message.contains("0 to 89 degrees"), "{message}");
}

/// After a change nothing is read back as if it were a result.
#[test]
fn there_is_no_image_before_a_frame_nor_after_a_change() {
    let context = Context::open(Backend::Egl).unwrap();
    let gl = context.gl();
    let shot = rig::scenes::box_on_a_floor();
    // With several depth samples the result is in another image than without.
    let settings = Settings { msaa: 4, ..rig::float_settings(shot.radius) };
    let request = Request { gbuffer_only: true, ..Request::default() };
    let mut pipeline = Pipeline::new(gl, SIZE, &settings, request).unwrap();
    let camera = shot.camera(SIZE);
    pipeline.render(&shot.mesh, &camera).unwrap();
    let inputs = pipeline.inputs(&camera);
    assert!(inputs.samples.is_some());
    let mut ao = AmbientOcclusion::new(gl.clone(), SIZE, &settings).unwrap();
    let nothing = |ao: &AmbientOcclusion| {
        let message = ao.image().unwrap_err().to_string();
        assert!(message.contains("call render first"), "{message}");
        assert_eq!((ao.linear_depth(), ao.rebuilt_normals()), (None, None));
    };
    nothing(&ao);
    ao.render(&inputs).unwrap();
    let first = ao.image().unwrap();
    ao.set(&Settings { ao_format: hbao::settings::AoFormat::R16f, ..settings.clone() }).unwrap();
    nothing(&ao);
    ao.render(&inputs).unwrap();
    ao.image().unwrap();
    ao.set(&settings).unwrap();
    ao.render(&inputs).unwrap();
    ao.resize((7, 9)).unwrap();
    nothing(&ao);
    // Without several samples, the new images have one in the place of the result.
    ao.resize(SIZE).unwrap();
    ao.render(&hbao::Inputs { samples: None, ..inputs }).unwrap();
    ao.resize((7, 9)).unwrap();
    nothing(&ao);
    ao.resize(SIZE).unwrap();
    ao.render(&inputs).unwrap();
    assert!(ao.image().unwrap() == first);
    // A frame that is refused leaves none either.
    ao.render(&hbao::Inputs { near: -1.0, background: f32::NAN, viewport: None, ..inputs }).ok();
    let wrong = hbao::Inputs { projection: Projection::perspective(0.0, 1.0), ..inputs };
    ao.render(&wrong).unwrap_err();
    nothing(&ao);
}

/// A headset renders two views in turns, which may be of two kinds.
#[test]
fn every_kind_of_inputs_so_far_is_compiled_at_once() {
    let context = Context::open(Backend::Egl).unwrap();
    let view = view(SIZE);
    let textures = textures(&context, &view);
    let flat = Textures::new(context.gl(), &view, TextureTarget::Texture2d, NormalEncoding::Signed);
    let [a, b] = [3, 4].map(|steps| Settings { steps, ..rig::raw(Method::Hbao, 1.0) });
    let mut ao = AmbientOcclusion::new(context.gl().clone(), SIZE, &a).unwrap();
    for textures in [&textures, &flat] {
        ao.prepare(&textures.inputs).unwrap();
    }
    assert!(ao.set(&b).unwrap());
    // Setting the same settings for one kind after the other finds everything compiled.
    for textures in [&textures, &flat] {
        ao.render(&textures.inputs).unwrap();
        assert!(!ao.set(&Settings { blur: 0, ..b.clone() }).unwrap());
    }
    assert!(!ao.set(&a).unwrap());
}

#[test]
fn images_of_the_wrong_size_are_refused() {
    let context = Context::open(Backend::Egl).unwrap();
    let good = Image::filled(4, 3, 1.0f32);
    let short = Image { texels: vec![1.0; 11], ..good.clone() };
    for (depth, normals) in [(&short, None), (&good, Some(Image { width: 4, height: 3, texels: vec![[0.0; 3]; 13] }))] {
        let error = hbao::InputTextures::new(context.gl(), depth, normals.as_ref()).err().unwrap();
        assert!(error.is_usage() && error.to_string().contains("4x3"), "{error}");
    }
    hbao::InputTextures::new(context.gl(), &good, None).unwrap();
}
