//! A radius that is a share of the view's height: R(P) = 2 f P.z tan(fov_y/2), or f times the height of an orthographic
//! view.

use crate::rig;
use crate::rig::by_hand::{ByHand, Textures, perspective, rubble};
use crate::rig::{SIZE, everywhere, hold, scenes};
use hbao::context::{Backend, Context};
use hbao::image::Image;
use hbao::measure::Reach;
use hbao::reference::{self, truth::Truth};
use hbao::scene::{Extents, Projection};
use hbao::settings::{Exit, Length, Method, Radius};
use hbao::{AmbientOcclusion, NormalEncoding, Settings, TextureTarget};

const SHARE: f64 = 0.15;

/// An off-centre view whose axes have different scales.
const OFF_CENTRE: Projection = Projection::Perspective(Extents::new(-0.5, 1.2, -0.9, 0.3));

fn of_view(settings: Settings) -> Settings {
    Settings { radius: Radius::OfView(SHARE), ..settings }
}

#[test]
fn it_is_the_default_and_the_default_renders_without_a_scene() {
    assert_eq!(Settings::default().radius, Radius::OfView(0.05));
    let context = Context::open(Backend::Egl).unwrap();
    // Of so many rows, 5 % are more than 9 texels, which 8 steps need.
    let size = (160, 200);
    let view = rubble(size, perspective(60.0, size), 3, 1.0..2.0);
    for method in rig::methods() {
        let mut ao = AmbientOcclusion::new(context.gl().clone(), size, &Settings::for_method(method)).unwrap();
        let textures = Textures::new(context.gl(), &view, TextureTarget::Rectangle, NormalEncoding::Signed);
        assert!(textures.visibility(&mut ao, &view).texels.iter().any(|&a| a < 0.9), "{}", method.name());
    }
}

#[test]
fn it_is_that_share_of_the_height_at_the_depth_of_the_pixel() {
    let settings = of_view(Settings::default());
    let fov = 1.1_f64;
    let height = 2.0 * (fov / 2.0).tan();
    assert_eq!(settings.radius_in(Projection::perspective(fov, 1.5)).unwrap(), Length::OfDepth(SHARE * height));
    assert_eq!(settings.radius_in(Projection::orthographic(7.0, 1.5)).unwrap(), Length::Units(SHARE * 7.0));
    // A tile has the radius of the picture that it is a part of.
    for projection in [OFF_CENTRE, Projection::orthographic(7.0, 1.5)] {
        let part = projection.part((640, 480), (64, 32), (72, 88));
        let [whole, part] = [projection, part].map(|projection| settings.radius_in(projection).unwrap().at(3.0));
        assert!((whole / part - 1.0).abs() < 1e-12);
    }
    // The depth sigma of the blur is the method's share of it.
    let sigma = settings.depth_sigma(OFF_CENTRE).unwrap();
    assert_eq!(sigma, settings.radius_in(OFF_CENTRE).unwrap().times(0.25));
}

#[test]
fn every_method_and_its_blur_match_their_twins() {
    let context = Context::open(Backend::Egl).unwrap();
    for projection in [perspective(70.0, SIZE), OFF_CENTRE, Projection::orthographic(5.0, 1.3)] {
        // Depths that differ by far, so that an R of the wrong depth would be noticed.
        let view = rubble(SIZE, projection, 11, 2.0..40.0);
        let textures = Textures::new(context.gl(), &view, TextureTarget::Rectangle, NormalEncoding::Signed);
        for method in rig::methods() {
            for half_res in [false, true] {
                let settings = of_view(Settings { half_res, exit: Exit::Shorten, ..rig::raw(method, 1.0) });
                let text = format!("{} {half_res} {projection:?}", method.name());
                let tile = hbao::rotation_tile(&settings);
                let inputs = view.twin_inputs(&tile);
                let expected = reference::visibility(&inputs, &settings).unwrap();
                let clear = reference::ambiguous(&inputs, &settings).unwrap().map(|unsure| !unsure);
                let count = clear.texels.iter().filter(|&&clear| clear).count();
                assert!(count * 10 > clear.texels.len() * 8, "{text}: too many are ambiguous");
                let mut ao = AmbientOcclusion::new(context.gl().clone(), SIZE, &settings).unwrap();
                ao.render(&textures.inputs).unwrap();
                let raw = ao.image().unwrap();
                hold("raw", &raw, &expected, &clear, everywhere(1e-3), &text);
                // The blur of the shader's own visibility.
                let blurs = Settings { blur: 5, ..settings };
                ao.set(&blurs).unwrap();
                ao.render(&textures.inputs).unwrap();
                let raw = raw.map(f64::from);
                let expected = reference::blur::blur(&raw, &view.depth, &[], projection, &blurs).unwrap();
                let unsure = reference::blur::ambiguous(&raw, &view.depth, &[], projection, &blurs).unwrap();
                let clear = unsure.map(|unsure| !unsure);
                hold("blurred", &ao.image().unwrap(), &expected, &clear, everywhere(1e-3), &text);
            }
        }
    }
}

/// A share so small that its inverse is beyond float32.
#[test]
fn a_tiny_share_leaves_every_pixel_a_number() {
    let context = Context::open(Backend::Egl).unwrap();
    let view = rubble(SIZE, perspective(70.0, SIZE), 11, 0.1..0.5);
    for method in rig::methods() {
        for share in [1e-30, 1e-37, 1e-38, 1e-40, 1e-300] {
            let radius = Radius::OfView(share);
            let settings = Settings { radius, exit: Exit::Shorten, blur: 5, ..rig::raw(method, 1.0) };
            let got = view.by_shader(context.gl(), &settings);
            assert!(got.texels.iter().all(|a| (0.0..=1.0).contains(a)), "{} {share}", method.name());
        }
    }
}

/// Where R is exactly as many texels as the steps need, rounding may not decide for the whole picture.
#[test]
fn shader_twin_and_library_agree_where_the_steps_are_one_texel_long() {
    let context = Context::open(Backend::Egl).unwrap();
    let size = (60, 180);
    for degrees in [30.0, 50.0, 60.0, 75.0, 90.0, 110.0] {
        for projection in [perspective(degrees, size), Projection::orthographic(degrees / 13.0, 60.0 / 180.0)] {
            let view = rubble(size, projection, 11, 2.0..4.0);
            for height_share in [0.05, 0.04999] {
                let radius = Radius::OfView(height_share);
                let settings = Settings { radius, ..rig::raw(Method::Hbao, 1.0) };
                let open = |image: &Image<f64>| image.texels.iter().all(|&a| a == 1.0);
                let exits = height_share < 0.05;
                let text = format!("{degrees} {projection:?} {height_share}");
                for (name, image) in view.by_both(context.gl(), &settings) {
                    assert_eq!(open(&image), exits, "{name} {text}");
                }
                let depth = settings.exit_depth(projection, size).unwrap();
                assert_eq!(depth, if exits { 0.0 } else { f64::INFINITY }, "{text}");
            }
        }
    }
}

/// Where all depths are the same, it is the same as a length in scene units.
#[test]
fn at_one_depth_it_equals_a_length() {
    let context = Context::open(Backend::Egl).unwrap();
    let projection = perspective(60.0, SIZE);
    let depth = Image::from_fn(SIZE.0 as usize, SIZE.1 as usize, |x, y| {
        // Walls in front of a floor, so that something occludes the floor at depth 8.
        if (x / 8 + y / 8) % 2 == 0 { 8.0f32 } else { 7.5 }
    });
    let normals = depth.map(|_| [0.0, 0.0, -1.0]);
    let view = ByHand { depth, normals, projection };
    for method in rig::methods().filter(|method| method.reads("radius")) {
        let settings = of_view(rig::raw(method, 1.0));
        let at_8 = settings.radius_in(projection).unwrap().at(8.0);
        let units = Settings { radius: Radius::Units(at_8), ..settings.clone() };
        let images = [&settings, &units].map(|settings| view.by_shader(context.gl(), settings));
        let floor = view.depth.map(|z| z == 8.0);
        let text = method.name();
        hold("floor", &images[0], &images[1].map(f64::from), &floor, everywhere(1e-4), text);
        assert!((0..floor.texels.len()).any(|i| floor.texels[i] && images[1].texels[i] < 0.97), "{text}");
        // Another length shows.
        let other = Settings { radius: Radius::Units(at_8 * 1.2), ..settings.clone() };
        assert!(view.by_shader(context.gl(), &other) != images[1], "{text}");
    }
}

#[test]
fn a_method_exits_everywhere_or_nowhere_and_the_guard_band_is_the_same_at_every_depth() {
    let view = rubble(SIZE, OFF_CENTRE, 9, 2.0..40.0);
    let texels = SHARE * f64::from(SIZE.1);
    // A texel may be wider than high, or higher than wide.
    let wide = (1.7 / f64::from(SIZE.0)) / (1.2 / f64::from(SIZE.1));
    let least = texels * (1.0 / wide).min(1.0);
    for (steps, exits) in [(least as u32 - 2, false), (least as u32 + 2, true)] {
        let settings = of_view(Settings { steps, ..rig::raw(Method::Hbao, 1.0) });
        let depth = settings.exit_depth(OFF_CENTRE, SIZE).unwrap();
        assert_eq!(depth, if exits { 0.0 } else { f64::INFINITY }, "{steps} steps of {least}");
        assert_eq!(view.by_twin(&settings).texels.iter().all(|&a| a == 1.0), exits);
        let reach = Reach::of(&view.depth, OFF_CENTRE, &settings).unwrap();
        assert_eq!(reach.exits, if exits { 1.0 } else { 0.0 });
    }
    let settings = of_view(rig::raw(Method::Hbao, 1.0));
    let [near, far] = [0.1, 1e6].map(|z| settings.guard_band(OFF_CENTRE, SIZE, z).unwrap());
    assert_eq!(near, far);
    assert!(f64::from(near[1]) >= texels && f64::from(near[1]) < texels + 12.0, "{near:?}");
}

/// Ray-traced truth has the R of each pixel's depth, too: with f times as large a view it is as if R grew.
#[test]
fn the_truth_takes_it_at_each_pixel() {
    let shot = scenes::box_on_a_floor();
    let camera = shot.camera(SIZE);
    let size = (SIZE.0 as usize, SIZE.1 as usize);
    let settings = of_view(Settings::default());
    let truth = |settings: &Settings| Truth::new(&shot.mesh, &camera, size, settings, 64).unwrap();
    let of_view = truth(&settings);
    let length = settings.radius_in(camera.projection).unwrap();
    let depth = rig::render(Context::open(Backend::Egl).unwrap().gl(), &shot, SIZE, &rig::float_settings(1.0)).depth;
    let mut seen = 0;
    for pixel in (0..depth.texels.len()).step_by(13).filter(|&pixel| depth.texels[pixel].is_finite()) {
        let radius = Radius::Units(length.at(depth.texels[pixel].into()));
        let alone = truth(&Settings { radius, ..settings.clone() });
        let [a, b] = [&of_view, &alone].map(|truth| truth.trace(&[pixel], |_| {}).visibility[0]);
        // Float32 depth moves R by some 1e-7 of itself.
        assert!((a - b).abs() < 0.02, "{a} {b}");
        seen += usize::from(a < 0.99);
    }
    assert!(seen > 5);
}

#[test]
fn it_is_written_and_read_as_a_percentage_of_the_view() {
    let knob = hbao::settings::Knob::named("radius").unwrap();
    let mut settings = Settings::default();
    for (text, share) in [("5%view", 0.05), ("12.5 %view", 0.125), ("0.3%view", 0.003), ("130%view", 1.3)] {
        knob.set(&mut settings, text).unwrap();
        assert_eq!(settings.radius, Radius::OfView(share));
        let written = settings.to_toml();
        assert!(written.contains(&format!("radius = \"{}\"", text.replace(' ', ""))), "{written}");
        let mut read = Settings::default();
        read.read_toml(&written).unwrap();
        assert_eq!(read, settings);
    }
    // Every share is written so that the same number is read.
    for share in [1.0 / 3.0, 0.123_456_789_012_345_6, 1e-13, 1e-300, 7e5] {
        let settings = Settings { radius: Radius::OfView(share), ..Settings::default() };
        settings.validate().unwrap();
        let mut read = Settings::default();
        read.read_toml(&settings.to_toml()).unwrap();
        assert_eq!(read.radius, settings.radius);
    }
    for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let settings = Settings { radius: Radius::OfView(wrong), ..Settings::default() };
        let message = settings.validate().unwrap_err().to_string();
        assert!(message.contains("OfView") && message.contains("above 0"), "{message}");
    }
    for wrong in ["0%view", "-1%view", "%view", "-5view", "nan%view", "inf%view"] {
        let message = knob.set(&mut settings, wrong).unwrap_err().to_string();
        assert!(message.contains("5%view"), "{message}");
    }
}
