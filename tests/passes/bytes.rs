//! The bytes that a pipeline says it holds are those of the objects in its context.

use crate::rig::{every_switch, scenes};
use glow::HasContext as _;
use hbao::context::{Backend, Context};
use hbao::settings::{AoFormat, NormalFormat, Normals};
use hbao::{Apply, Pipeline, Request, Settings};
use std::num::NonZeroU32;

const SIZE: (u32, u32) = (33, 21);

/// More than the largest name of an object that the tests here make.
const NAMES: std::ops::Range<u32> = 1..2000;

/// The bytes of all textures of a context, as the driver reports them.
fn textures(gl: &glow::Context) -> u64 {
    let mut bytes = 0;
    for texture in NAMES.map(|name| glow::NativeTexture(NonZeroU32::new(name).unwrap())) {
        // SAFETY: the context is current. A name that is no texture is passed over, and binding a texture to a target
        // that is not its own is an error without effect.
        unsafe {
            if !gl.is_texture(texture) {
                continue;
            }
            for target in [glow::TEXTURE_RECTANGLE, glow::TEXTURE_2D, glow::TEXTURE_2D_MULTISAMPLE] {
                gl.bind_texture(target, Some(texture));
                if gl.get_error() != glow::NO_ERROR {
                    continue;
                }
                let get = |parameter| gl.get_tex_level_parameter_i32(target, 0, parameter) as u64;
                let channels = [
                    glow::TEXTURE_RED_SIZE,
                    glow::TEXTURE_GREEN_SIZE,
                    glow::TEXTURE_BLUE_SIZE,
                    glow::TEXTURE_ALPHA_SIZE,
                ];
                let bits: u64 = channels.into_iter().map(get).sum();
                bytes +=
                    get(glow::TEXTURE_WIDTH) * get(glow::TEXTURE_HEIGHT) * get(glow::TEXTURE_SAMPLES).max(1) * bits / 8;
                gl.bind_texture(target, None);
            }
        }
    }
    bytes
}

/// The bytes of all renderbuffers of a context, as the driver reports them.
fn renderbuffers(gl: &glow::Context) -> u64 {
    let mut bytes = 0;
    for buffer in NAMES.map(|name| glow::NativeRenderbuffer(NonZeroU32::new(name).unwrap())) {
        // SAFETY: the context is current, and a name that is no renderbuffer is passed over.
        unsafe {
            if gl.is_renderbuffer(buffer) {
                gl.bind_renderbuffer(glow::RENDERBUFFER, Some(buffer));
                let get = |parameter| gl.get_renderbuffer_parameter_i32(glow::RENDERBUFFER, parameter) as u64;
                let bits = get(glow::RENDERBUFFER_DEPTH_SIZE) + get(glow::RENDERBUFFER_STENCIL_SIZE);
                let pixels = get(glow::RENDERBUFFER_WIDTH) * get(glow::RENDERBUFFER_HEIGHT);
                bytes += pixels * get(glow::RENDERBUFFER_SAMPLES).max(1) * bits / 8;
                gl.bind_renderbuffer(glow::RENDERBUFFER, None);
            }
        }
    }
    bytes
}

#[test]
fn a_pipeline_holds_the_bytes_that_it_says() {
    let mut all = every_switch();
    let wide = Settings { ao_format: AoFormat::R16f, normal_format: NormalFormat::Rgba16f, ..all[0].clone() };
    all.extend([Settings { msaa: 4, ..wide.clone() }, Settings { half_res: true, ..wide.clone() }, wide]);
    let context = Context::open(Backend::Egl).unwrap();
    let (gl, shot) = (context.gl(), scenes::cornell_box());
    let mut different = std::collections::BTreeSet::new();
    for (at, settings) in all.iter().enumerate() {
        let composite = (at % 2 == 0).then_some(Apply::All);
        let request = Request { composite, raw: true, edges: at % 3 == 0, ..Request::default() };
        let mut pipeline = Pipeline::new(gl, SIZE, settings, request).unwrap();
        pipeline.render(&shot.mesh, &shot.camera(SIZE)).unwrap();
        let held = pipeline.texture_bytes();
        assert_eq!(held, textures(gl) + renderbuffers(gl), "{}", settings.to_toml());
        pipeline.resize((SIZE.0 + 10, SIZE.1 + 7)).unwrap();
        pipeline.render(&shot.mesh, &shot.camera((SIZE.0 + 10, SIZE.1 + 7))).unwrap();
        assert_eq!(pipeline.texture_bytes(), textures(gl) + renderbuffers(gl), "resized: {}", settings.to_toml());
        different.insert(held);
    }
    assert!(different.len() > 5, "{different:?}");
    assert_eq!(textures(gl) + renderbuffers(gl), 0);
}

#[test]
fn a_frame_uploads_the_bytes_that_it_says() {
    let context = Context::open(Backend::Egl).unwrap();
    let shot = scenes::cornell_box();
    let (points, triangles) = (shot.mesh.positions.len() as u64, shot.mesh.triangles.len() as u64);
    for (normals, per_point) in [(Normals::Derivative, 12), (Normals::Vertex, 24)] {
        let settings = Settings { normals, ..every_switch()[0].clone() };
        let mut pipeline = Pipeline::new(context.gl(), SIZE, &settings, Request::default()).unwrap();
        assert_eq!(pipeline.triangle_bytes(), 0);
        pipeline.render(&shot.mesh, &shot.camera(SIZE)).unwrap();
        assert_eq!(pipeline.triangle_bytes(), per_point * points + 12 * triangles);
    }
}
