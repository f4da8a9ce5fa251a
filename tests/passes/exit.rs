//! The early exit: a method leaves surfaces open, whatever the scene is, where R covers too few texels for its steps.

use crate::rig;
use crate::rig::SIZE;
use crate::rig::by_hand::{ByHand, perspective, rubble};
use hbao::context::{Backend, Context};
use hbao::measure::Reach;
use hbao::scene::{Extents, Projection};
use hbao::settings::{Exit, Method, Radius};
use hbao::{AmbientOcclusion, Settings};

/// The methods that exit early.
fn methods() -> impl Iterator<Item = Method> {
    Method::ALL.iter().copied().filter(|method| method.reads("exit"))
}

/// Returns settings with so much strength that nearly every sample within R can be seen in A.
fn strong(method: Method, exit: Exit, radius: f64, steps: u32) -> Settings {
    Settings { exit, steps, directions: 16, strength: 100.0, ..rig::raw(method, radius) }
}

/// A view of hills at depths around 16.
fn hills(projection: Projection) -> ByHand {
    rubble(SIZE, projection, 9, 15.5..16.5)
}

/// A view whose texels are wider than high.
const WIDE: Projection = Projection::Perspective(Extents::centred(1.1, 0.5));
/// The height and width of a texel are 0.1.
const ORTHOGRAPHIC: Projection = Projection::Orthographic(Extents::centred(0.05 * SIZE.0 as f64, 0.05 * SIZE.1 as f64));

#[test]
fn methods_exit_beyond_the_depth_that_the_library_tells_and_nowhere_before() {
    let context = Context::open(Backend::Egl).unwrap();
    let view = hills(WIDE);
    for method in methods() {
        for (exit, half_res) in [(Exit::Paper, false), (Exit::Shorten, false), (Exit::Paper, true)] {
            // With this R the exit lies among the hills, at R W / (2 1.1 needed scale) = 16.
            let needed = if exit == Exit::Paper { 5.0 } else { 2.0 };
            let scale = if half_res { 2.0 } else { 1.0 };
            let radius = 16.0 * 2.2 * needed * scale / f64::from(SIZE.0);
            let settings = Settings { half_res, ..strong(method, exit, radius, 4) };
            let ao = AmbientOcclusion::new(context.gl().clone(), SIZE, &settings).unwrap();
            let depth = ao.exit_depth(view.projection);
            let text = format!("{} {exit:?} {half_res}", method.name());
            assert!((depth - 16.0).abs() < 1e-9, "{text}: {depth}");
            assert_eq!(settings.exit_depth(view.projection, SIZE).unwrap(), depth);

            let open = view.by_twin(&settings);
            let on_gpu = if half_res { open.map(|a| a as f32) } else { view.by_shader(context.gl(), &settings) };
            let (mut before, mut occluded, mut beyond) = (0.0, 0.0, 0.0);
            for (x, y) in (0..open.height).flat_map(|y| (0..open.width).map(move |x| (x, y))) {
                let z = f64::from(view.depth.at(scale as usize * x, scale as usize * y));
                if !z.is_finite() {
                    continue;
                }
                let open = [open.at(x, y) == 1.0, on_gpu.at(x, y) == 1.0];
                if z > depth {
                    beyond += 1.0;
                    assert_eq!(open, [true; 2], "{text}: z = {z}");
                } else {
                    before += 1.0;
                    occluded += f64::from(u8::from(open == [false; 2]));
                }
            }
            assert!(
                beyond > 100.0 && occluded > 0.5 * before,
                "{text}: {beyond} beyond, {occluded} of {before} before"
            );
            let reach = Reach::of(&view.depth, view.projection, &settings).unwrap();
            assert_eq!(reach.covered as f64, before + beyond, "{text}");
            assert_eq!((reach.exits, reach.past), (beyond / (before + beyond), 0.0), "{text}");
        }
    }
}

#[test]
fn an_orthographic_view_exits_everywhere_or_nowhere() {
    let view = hills(ORTHOGRAPHIC);
    for (texels, exit, exits) in
        [(4.9, Exit::Paper, true), (5.1, Exit::Paper, false), (1.9, Exit::Shorten, true), (2.1, Exit::Shorten, false)]
    {
        let settings = strong(Method::Hbao, exit, 0.1 * texels, 4);
        let depth = settings.exit_depth(view.projection, SIZE).unwrap();
        assert_eq!(depth, if exits { 0.0 } else { f64::INFINITY });
        assert_eq!(Reach::of(&view.depth, view.projection, &settings).unwrap().exits, if exits { 1.0 } else { 0.0 });
        assert_eq!(view.by_twin(&settings).texels.iter().all(|&a| a == 1.0), exits, "{texels} {exit:?}");
    }
}

#[test]
fn methods_that_never_exit_have_an_infinite_exit_depth() {
    for &method in Method::ALL.iter().filter(|method| !method.reads("exit")) {
        let settings = Settings { steps: 256, ..rig::raw(method, 1e-9) };
        assert_eq!(settings.exit_depth(WIDE, SIZE).unwrap(), f64::INFINITY, "{}", method.name());
    }
    let percent = Settings { radius: Radius::Percent(5.0), ..Settings::default() };
    assert!(percent.exit_depth(WIDE, SIZE).is_err());
}

/// Where R covers 7.5 texels everywhere, 6 steps are the most that are not shorter than a texel.
#[test]
fn shortened_steps_give_the_image_of_as_many_steps_as_fit() {
    let context = Context::open(Backend::Egl).unwrap();
    let view = hills(ORTHOGRAPHIC);
    for method in methods() {
        for (texels, steps, fit) in [(7.5, 64, 6), (7.5, 7, 6), (7.5, 6, 6), (7.5, 2, 2), (2.5, 33, 1), (40.5, 256, 39)]
        {
            let radius = 0.1 * texels;
            let short = strong(method, Exit::Shorten, radius, steps);
            let fitting = strong(method, Exit::Paper, radius, fit);
            let text = format!("{} {texels} {steps}", method.name());
            assert!(view.by_twin(&short).texels == view.by_twin(&fitting).texels, "{text}: twins");
            let [short, fitting] = [&short, &fitting].map(|settings| view.by_shader(context.gl(), settings));
            assert!(short.texels.iter().zip(&fitting.texels).all(|(a, b)| (a - b).abs() < 1e-4), "{text}: shaders");
            assert!(fitting.texels.iter().any(|&a| a < 0.9), "{text}");
        }
    }
}

#[test]
fn where_every_step_is_longer_than_a_texel_the_exit_changes_nothing() {
    let context = Context::open(Backend::Egl).unwrap();
    let view = hills(perspective(60.0, SIZE));
    for method in methods() {
        let [paper, shorten] = [Exit::Paper, Exit::Shorten].map(|exit| {
            let settings = strong(method, exit, 12.0, 8);
            assert_eq!(Reach::of(&view.depth, view.projection, &settings).unwrap().exits, 0.0);
            (view.by_twin(&settings).texels, view.by_shader(context.gl(), &settings).texels)
        });
        assert!(paper == shorten, "{}", method.name());
    }
}

#[test]
fn a_first_step_that_leaves_the_picture_on_all_sides_is_past_it() {
    let view = hills(ORTHOGRAPHIC);
    let (width, height) = (f64::from(SIZE.0), f64::from(SIZE.1));
    // From the middle, half the width is enough; from a corner, the whole width is needed.
    for (method, steps, texels, past) in [
        (Method::Hbao, 4, 5.0 * width, 1.0),
        (Method::Crease, 4, 5.0 * (width - 0.4), 1.0),
        (Method::Hbao, 4, 5.0 * (width / 2.0 - 0.1), 0.0),
        (Method::RayMarch, 4, 1e9, 0.0),
        (Method::Ssao, 4, 1e9, 0.0),
    ] {
        let settings = Settings { steps, ..rig::raw(method, 0.1 * texels) };
        let reach = Reach::of(&view.depth, view.projection, &settings).unwrap();
        assert_eq!(reach.past, past, "{} {texels}", method.name());
    }
    // A step of 3/4 of the width is longer than the height, and leaves the picture from the middle half of its columns.
    assert!(0.75 * width > height);
    let settings = Settings { steps: 4, ..rig::raw(Method::Hbao, 0.1 * 5.0 * 0.75 * width) };
    let reach = Reach::of(&view.depth, view.projection, &settings).unwrap();
    let covered = |x: usize| (0..view.depth.height).filter(|&y| view.depth.at(x, y).is_finite()).count();
    let within = |x: &usize| (*x as f64 + 0.5 - width / 2.0).abs() < width / 4.0;
    let middle: usize = (0..view.depth.width).filter(within).map(covered).sum();
    assert!((reach.past - middle as f64 / reach.covered as f64).abs() < 1e-12, "{reach:?}");
}
