//! Inputs that cannot be right are refused in one line that says why, and leave the object usable.

use super::*;
use hbao::{Hand, NormalSpace};

#[test]
fn what_cannot_be_right_is_refused_in_one_line() {
    let context = Context::open(Backend::Egl).unwrap();
    let gl = context.gl();
    let projection = by_hand::perspective(60.0, SIZE);
    let view = by_hand::plane(projection, SIZE, glam::DVec3::NEG_Z, -4.0);
    let textures = Textures::new(gl, &view, TextureTarget::Texture2d, NormalEncoding::Signed);
    let right = textures.inputs;
    let standard = DepthEncoding::standard(1.0, 100.0);
    let hardware = |format, target| Stored::new(gl, &view, standard, format, target).image;
    let flat = TextureTarget::Texture2d;
    let depth = hardware(Depths::Float, flat);
    let encoded = Inputs { depth, depth_encoding: standard, ..right };
    let with = |depth_encoding| Inputs { depth_encoding, ..encoded };
    let matrix_of = |change: &dyn Fn(&mut [f32; 16])| {
        let range = ClipRange::MinusOneToOne;
        let mut projection = matrix(projection, [1.0, 100.0], false, range, -1.0);
        change(&mut projection);
        with(DepthEncoding::Matrix { projection, range })
    };
    let orthographic = by_hand::orthographic(0.1, SIZE);
    let texture = |format: (u32, u32, u32), bytes: usize| {
        let (width, height) = (SIZE.0 as usize, SIZE.1 as usize);
        let texels = Image { width, height, texels: vec![vec![0; bytes]; width * height] };
        upload(gl, flat, format, &texels, &[], (0, 0), (width, height))
    };
    let normals = |image, normal_encoding| Inputs { normals: Some(image), normal_encoding, ..right };
    let viewport = |x, y, width, height| Inputs { viewport: Some(Viewport { x, y, width, height }), ..right };
    let world = |view| Inputs { normal_space: NormalSpace::World { view, eye: Hand::Right }, ..right };
    // The name of a renderbuffer is that of no texture, unless the two happen to be the same.
    let renderbuffer = glow::NativeTexture(std::num::NonZeroU32::new(1_000_000).unwrap());
    let samples = draw_samples(gl, SIZE, standard);
    let (hardware_samples, linear_samples, count) = samples;
    let multisample = |texture, samples| TextureRef { texture, target: TextureTarget::Multisample(samples) };
    let cases = [
        // Depth.
        (Inputs { depth, ..right }, "has a depth format, which holds no linear depth"),
        (Inputs { depth: texture((glow::R16, glow::RED, glow::UNSIGNED_SHORT), 2), ..right }, "needs a float format"),
        (
            Inputs { depth: texture((glow::R32UI, glow::RED_INTEGER, glow::UNSIGNED_INT), 4), ..encoded },
            "depth texture has a format that holds no depth",
        ),
        (Inputs { depth: TextureRef { texture: renderbuffer, target: flat }, ..right }, "a renderbuffer is none"),
        (with(DepthEncoding::standard(100.0, 1.0)), "near 100 must be below far 1: they may be swapped"),
        (with(DepthEncoding::reversed(1.0, 1.0)), "near 1 must be below far 1"),
        (with(DepthEncoding::standard(0.0, 1.0)), "near must be above 0, not 0"),
        (with(DepthEncoding::standard(-1.0, 1.0)), "near must be above 0, not -1"),
        (with(DepthEncoding::standard(f64::NAN, 1.0)), "must be numbers"),
        (with(DepthEncoding::standard(1.0, f64::NAN)), "must be numbers"),
        (with(DepthEncoding::Logarithmic { c: 0.0, far: 1.0 }), "C and far of logarithmic depth"),
        (with(DepthEncoding::Logarithmic { c: 1.0, far: f64::INFINITY }), "C and far of logarithmic depth"),
        (
            Inputs { projection: orthographic, ..with(DepthEncoding::reversed(1.0, f64::INFINITY)) },
            "far must be finite in an orthographic view",
        ),
        (
            Inputs { projection: orthographic, ..with(DepthEncoding::standard(-1.0, 1.0)) },
            "near must be at least 0, not -1",
        ),
        (matrix_of(&|m| m[10] = f32::NAN), "not finite numbers"),
        (matrix_of(&|m| m[2] = 0.1), "oblique"),
        (matrix_of(&|m| m.swap(11, 14)), "looks transposed"),
        (matrix_of(&|m| m[15] = 1.0), "moves the eye"),
        (matrix_of(&|m| m[14] = 0.0), "no near plane in front of the eye"),
        (
            Inputs { projection: orthographic, ..matrix_of(&|_| ()) },
            "is perspective, and the projection of the view is not",
        ),
        // Kinds of textures.
        (
            Inputs { depth: TextureRef { target: TextureTarget::Rectangle, ..right.depth }, ..right },
            "depth texture is not of the declared kind",
        ),
        (Inputs { depth: hardware(Depths::Float, TextureTarget::Layer(1)), ..encoded }, ""),
        (
            Inputs {
                depth: TextureRef {
                    target: TextureTarget::Layer(3),
                    ..hardware(Depths::Float, TextureTarget::Layer(1))
                },
                ..encoded
            },
            "depth: there is no layer 3, the texture has 3",
        ),
        (
            Inputs { depth: multisample(hardware_samples, 2 * count), ..encoded },
            "samples per pixel, but 8 were declared",
        ),
        (Inputs { depth: multisample(hardware_samples, count), ..right }, "has a depth format"),
        (
            Inputs {
                depth: multisample(linear_samples, count),
                samples: Some(DepthSamples { texture: linear_samples, samples: count }),
                ..right
            },
            "samples must be None",
        ),
        (
            Inputs { samples: Some(DepthSamples { texture: hardware_samples, samples: count }), ..right },
            "the samples texture has a depth format",
        ),
        // Viewports.
        (
            viewport(0, 0, SIZE.0 - 1, SIZE.1),
            "the viewport has 96x61 pixels, but ambient occlusion is set up for 97x61",
        ),
        (viewport(1, 0, SIZE.0, SIZE.1), "the viewport of 97x61 at 1,0 reaches past the depth texture"),
        (viewport(0, u32::MAX, SIZE.0, SIZE.1), "reaches past the depth texture"),
        // Normals.
        (
            normals(texture((glow::RGBA8, glow::RGBA, glow::UNSIGNED_BYTE), 4), NormalEncoding::Signed),
            "a format without negative numbers: say that its encoding is biased",
        ),
        (
            normals(texture((glow::RG16F, glow::RG, glow::FLOAT), 8), NormalEncoding::Signed),
            "no third channel: only an octahedral encoding has two",
        ),
        (
            normals(texture((glow::RGBA8UI, glow::RGBA_INTEGER, glow::UNSIGNED_BYTE), 4), NormalEncoding::Biased),
            "a format that holds no normals",
        ),
        (normals(depth, NormalEncoding::Biased), "a format that holds no normals"),
        (world([0.0; 9]), "the view matrix is no rotation"),
        (world([1.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 1.0]), "the view matrix is no rotation"),
        (world([1.0, 0.0, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0, 1.0]), "the view matrix is no rotation"),
        (world([f32::NAN; 9]), "the view matrix is no rotation"),
    ];
    let mut ao = AmbientOcclusion::new(gl.clone(), SIZE, &settings(1.0)).unwrap();
    for (inputs, part) in cases {
        match (ao.render(&inputs), part) {
            (Ok(_), "") => {}
            (Ok(_), part) => panic!("accepted, and not refused with: {part}"),
            (Err(error), part) => {
                let error = error.to_string();
                assert!(!part.is_empty() && error.contains(part) && !error.contains('\n'), "{part}: {error}");
                assert_eq!(ao.diagnose(&inputs).unwrap_err().to_string(), error);
            }
        }
        ao.render(&right).unwrap();
        ao.render(&encoded).unwrap();
    }
}

/// OpenGL 4.3 can read a texture's stencil in place of its depth. Where the driver has that mode, it is refused.
#[test]
fn a_texture_that_is_read_as_its_stencil_is_refused_where_that_can_be_asked() {
    let context = Context::open(Backend::Egl).unwrap();
    let gl = context.gl();
    let version = gl.version();
    assert!((version.major, version.minor) >= (4, 3), "this driver has no such mode: {version:?}");
    let view = by_hand::plane(by_hand::perspective(60.0, SIZE), SIZE, glam::DVec3::NEG_Z, -4.0);
    let textures = Textures::new(gl, &view, TextureTarget::Texture2d, NormalEncoding::Signed);
    let depth_encoding = DepthEncoding::standard(1.0, 100.0);
    let stored = Stored::new(gl, &view, depth_encoding, Depths::Bits24AndStencil, TextureTarget::Texture2d);
    let inputs = Inputs { depth: stored.image, depth_encoding, ..textures.inputs };
    let mut ao = AmbientOcclusion::new(gl.clone(), SIZE, &settings(1.0)).unwrap();
    let mut mode = |mode: u32| {
        // SAFETY: the context is current, and the texture exists.
        unsafe {
            gl.bind_texture(glow::TEXTURE_2D, Some(stored.image.texture));
            gl.tex_parameter_i32(glow::TEXTURE_2D, glow::DEPTH_STENCIL_TEXTURE_MODE, mode as i32);
        }
        ao.render(&inputs).map(|_| ()).map_err(|error| error.to_string())
    };
    assert!(mode(glow::STENCIL_INDEX).unwrap_err().contains("is read as its stencil"));
    assert_eq!(mode(glow::DEPTH_COMPONENT), Ok(()));
}
