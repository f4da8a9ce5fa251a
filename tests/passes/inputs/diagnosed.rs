//! What is plausible and still wrong is found, and nothing is found where all is right.

use super::*;
use glam::{DMat3, DVec3};
use hbao::{Finding, Hand, NormalSpace};

/// A scene as an engine would have it: hardware depth and normals.
struct Engine {
    view: ByHand,
    radius: f64,
    textures: Textures,
}

impl Engine {
    fn new(gl: &Arc<glow::Context>, shot: &Shot) -> Engine {
        Engine::of(gl, seen(gl, shot, SIZE), shot.radius)
    }

    fn of(gl: &Arc<glow::Context>, view: ByHand, radius: f64) -> Engine {
        Engine { textures: Textures::new(gl, &view, TextureTarget::Rectangle, NormalEncoding::Signed), view, radius }
    }

    fn found(&self, gl: &Arc<glow::Context>, inputs: &Inputs) -> Vec<Finding> {
        self.found_with(gl, inputs, &settings(self.radius))
    }

    fn found_with(&self, gl: &Arc<glow::Context>, inputs: &Inputs, settings: &Settings) -> Vec<Finding> {
        let ao = AmbientOcclusion::new(gl.clone(), self.view.size(), settings).unwrap();
        let found = ao.diagnose(inputs).unwrap();
        for finding in &found {
            let text = finding.to_string();
            assert!(!text.contains('\n') && text.len() > 20, "{text}");
        }
        found
    }

    /// The same view with other normals.
    fn with_normals(&self, gl: &Arc<glow::Context>, change: impl Fn([f32; 3]) -> [f32; 3]) -> Engine {
        Engine::of(gl, ByHand { normals: self.view.normals.map(change), ..self.view.clone() }, self.radius)
    }
}

fn shots() -> Vec<Shot> {
    let mut shots = vec![scenes::cornell_box(), scenes::nave(), scenes::box_on_a_floor(), scenes::ball()];
    shots.extend([scenes::cornell_box().orthographic(), scenes::box_on_a_floor().orthographic()]);
    shots
}

#[test]
fn nothing_is_found_where_inputs_are_right() {
    let context = Context::open(Backend::Egl).unwrap();
    let gl = context.gl();
    for shot in shots() {
        let engine = Engine::new(gl, &shot);
        assert_eq!(engine.found(gl, &engine.textures.inputs), [], "{}, linear", shot.name);
        for (name, encoding) in conventions(engine.view.projection, planes(&engine.view)) {
            for format in [Depths::Bits16, Depths::Bits24, Depths::Float] {
                let stored = Stored::new(gl, &engine.view, encoding, format, TextureTarget::Texture2d);
                for normals in [engine.textures.inputs.normals, None] {
                    let right =
                        Inputs { depth: stored.image, depth_encoding: encoding, normals, ..engine.textures.inputs };
                    let normals = if normals.is_some() { "normals" } else { "none" };
                    assert_eq!(engine.found(gl, &right), [], "{}, {name}, {format:?}, {normals}", shot.name);
                }
            }
        }
    }
}

#[test]
fn normals_that_are_wrong_are_found_and_named() {
    let context = Context::open(Backend::Egl).unwrap();
    let gl = context.gl();
    for shot in shots() {
        let engine = Engine::new(gl, &shot);
        let other_hand = engine.with_normals(gl, |[x, y, z]| [x, y, -z]);
        assert_eq!(other_hand.found(gl, &other_hand.textures.inputs), [Finding::NormalsOfOtherHand], "{}", shot.name);
        let right = Inputs { normal_space: NormalSpace::Eye(Hand::Right), ..other_hand.textures.inputs };
        assert_eq!(other_hand.found(gl, &right), [], "{}", shot.name);

        let away = engine.with_normals(gl, |n| n.map(|c| -c));
        assert_eq!(away.found(gl, &away.textures.inputs), [Finding::NormalsFaceAway], "{}", shot.name);
        let down = engine.with_normals(gl, |[x, y, z]| [x, -y, z]);
        let found = down.found(gl, &down.textures.inputs);
        // Seen straight on without perspective, the Cornell box shows neither floor nor ceiling, and nothing is wrong.
        let shown = shot.name != "cornell-box" || engine.view.projection.is_perspective();
        assert!(
            if shown { found == [Finding::NormalsUpsideDown] } else { found.is_empty() },
            "{}: {found:?}",
            shot.name
        );

        let biased = engine.with_normals(gl, |n| n.map(|c| 0.5 * c + 0.5));
        assert_eq!(biased.found(gl, &biased.textures.inputs), [Finding::NormalsOfOtherEncoding], "{}", shot.name);
        let right = Inputs { normal_encoding: NormalEncoding::Biased, ..biased.textures.inputs };
        assert_eq!(biased.found(gl, &right), [], "{}", shot.name);
        let wrong = Inputs { normal_encoding: NormalEncoding::Biased, ..engine.textures.inputs };
        assert_eq!(engine.found(gl, &wrong), [Finding::NormalsOfOtherEncoding], "{}", shot.name);

        // World space, forgotten or with the matrix the wrong way round.
        let turn = DMat3::from_axis_angle(DVec3::new(0.9, 0.1, 0.3).normalize(), 2.1);
        let world =
            engine.with_normals(gl, |n| (turn.transpose() * DVec3::from(n.map(f64::from))).as_vec3().to_array());
        let found = world.found(gl, &world.textures.inputs);
        // On few surfaces another change may happen to fit as well, or another turn.
        let few = shot.name == "box-on-a-floor" || shot.name == "ball" || !engine.view.projection.is_perspective();
        let turned = matches!(found[..], [Finding::NormalsTurned(angle)] if (angle - 2.1).abs() < 0.05);
        assert!(turned || few && found.len() == 1, "{}: {found:?}", shot.name);
        // A camera that looks a little aside is enough.
        let little = DMat3::from_axis_angle(DVec3::new(0.4, 0.9, 0.1).normalize(), 0.2);
        let aside =
            engine.with_normals(gl, |n| (little.transpose() * DVec3::from(n.map(f64::from))).as_vec3().to_array());
        let found = aside.found(gl, &aside.textures.inputs);
        let turned = matches!(found[..], [Finding::NormalsTurned(angle)] if (angle - 0.2).abs() < 0.05);
        assert!(turned || few && found.len() == 1, "{}: {found:?}", shot.name);
        // Normals at random fit nothing.
        let draw = std::cell::RefCell::new(rig::random::Draw::new(7));
        let random = engine.with_normals(gl, |_| [0; 3].map(|_| draw.borrow_mut().signed() as f32));
        let found = random.found(gl, &random.textures.inputs);
        assert!(matches!(found[..], [Finding::NormalsDisagree(share)] if share > 0.8), "{}: {found:?}", shot.name);
        let space = |turn: DMat3| NormalSpace::World { view: turn.to_cols_array().map(|c| c as f32), eye: Hand::Left };
        let inputs = |turn| Inputs { normal_space: space(turn), ..world.textures.inputs };
        assert_eq!(world.found(gl, &inputs(turn)), [], "{}", shot.name);
        assert_eq!(world.found(gl, &inputs(turn.transpose())), [Finding::ViewMatrixTransposed], "{}", shot.name);
    }
}

#[test]
fn normals_that_are_zero_or_no_numbers_are_found() {
    let context = Context::open(Backend::Egl).unwrap();
    let gl = context.gl();
    let engine = Engine::new(gl, &scenes::cornell_box());
    let texel = 30 * SIZE.0 as usize + 40;
    assert!(engine.view.depth.texels[texel].is_finite());
    let planted = |n: [f32; 3]| {
        let mut view = engine.view.clone();
        view.normals.texels[texel] = n;
        let planted = Engine::of(gl, view, engine.radius);
        planted.found(gl, &planted.textures.inputs)
    };
    assert_eq!(planted([0.0; 3]), [Finding::NormalsZero(1)]);
    assert_eq!(planted([0.0, f32::NAN, 1.0]), [Finding::NormalsNotFinite(1)]);
}

#[test]
fn depth_that_is_wrong_is_found_and_named() {
    let context = Context::open(Backend::Egl).unwrap();
    let gl = context.gl();
    for shot in shots() {
        let engine = Engine::new(gl, &shot);
        let [near, far] = planes(&engine.view);
        let perspective = engine.view.projection.is_perspective();
        let pairs = [
            (DepthEncoding::standard(near, far), DepthEncoding::reversed(near, far)),
            (DepthEncoding::reversed(near, far), DepthEncoding::standard(near, far)),
        ];
        for (stored_as, said) in pairs {
            let stored = Stored::new(gl, &engine.view, stored_as, Depths::Float, TextureTarget::Texture2d);
            let wrong = Inputs { depth: stored.image, depth_encoding: said, ..engine.textures.inputs };
            let found = engine.found(gl, &wrong);
            assert!(found.contains(&Finding::DepthLooksReversed), "{}, {stored_as:?}: {found:?}", shot.name);
            // Without normals, perspective or background tells.
            if perspective || engine.view.depth.texels.contains(&f32::INFINITY) {
                let found = engine.found(gl, &Inputs { normals: None, ..wrong });
                assert!(found.contains(&Finding::DepthLooksReversed), "{}, {stored_as:?}: {found:?}", shot.name);
            }
        }
        // A copy of a depth buffer that is said to be linear.
        if engine.view.depth.texels.contains(&f32::INFINITY) {
            let encoding = DepthEncoding::standard(near, far);
            let stored = Stored::new(gl, &engine.view, encoding, Depths::Copied, TextureTarget::Texture2d);
            let found = engine.found(gl, &Inputs { depth: stored.image, ..engine.textures.inputs });
            assert!(found.contains(&Finding::DepthLooksEncoded), "{}: {found:?}", shot.name);
        }
    }
}

#[test]
fn depth_of_background_alone_below_zero_or_without_a_number_is_found() {
    let context = Context::open(Backend::Egl).unwrap();
    let gl = context.gl();
    let engine = Engine::new(gl, &scenes::box_on_a_floor());
    let of = |change: &dyn Fn(f32) -> f32| {
        let view = ByHand { depth: engine.view.depth.map(change), ..engine.view.clone() };
        let planted = Engine::of(gl, view, engine.radius);
        planted.found(gl, &planted.textures.inputs)
    };
    assert_eq!(of(&|_| f32::INFINITY), [Finding::OnlyBackground]);
    let covered = engine.view.covered().texels.iter().filter(|&&c| c).count();
    assert_eq!(of(&|z| if z.is_finite() { -z } else { z }), [Finding::DepthNotPositive(covered)]);
    let first = engine.view.depth.texels[40];
    let same = engine.view.depth.texels.iter().filter(|&&z| z == first).count();
    // `Textures` makes the minimum of NaN and the depth of background, which is the latter, so the depth is -infinity.
    assert_eq!(of(&|z| if z == first { f32::NEG_INFINITY } else { z }), [Finding::DepthNotFinite(same)]);
}

#[test]
fn a_radius_that_does_not_fit_the_picture_is_found() {
    let context = Context::open(Backend::Egl).unwrap();
    let gl = context.gl();
    let engine = Engine::new(gl, &scenes::cornell_box());
    let found = |radius: f64| engine.found_with(gl, &engine.textures.inputs, &settings(radius));
    assert!(matches!(found(0.01 * engine.radius)[..], [Finding::RadiusBelowTexels(share)] if share > 0.9));
    assert!(matches!(found(1000.0 * engine.radius)[..], [Finding::RadiusBeyondPicture(share)] if share > 0.9));
    // Crysis' method has no radius.
    let ssao = Settings { radius: Radius::Units(1e-9), ..rig::raw(Method::Ssao, 1.0) };
    assert_eq!(engine.found_with(gl, &engine.textures.inputs, &ssao), []);
}
