//! Ambient occlusion that is written to images of an application.

use crate::rig;
use crate::rig::by_hand::{ByHand, Textures, perspective, read_red, rubble};
use crate::rig::process::in_own_process;
use glow::HasContext as _;
use hbao::context::{Backend, Context};
use hbao::settings::Method;
use hbao::{
    AmbientOcclusion, Destination, NormalEncoding, Output, Settings, TextureRef, TextureTarget, Viewport, Write,
};

const SIZE: (u32, u32) = (23, 17);
/// The size of the images that are written to, and where in them the view lies.
const OUTER: (u32, u32) = (40, 30);
const CORNER: (u32, u32) = (9, 5);
/// The colour that is in them at first, in whole 255ths.
const COLOUR: [f32; 4] = [0.8, 0.6, 0.4, 0.2];
pub(super) const KINDS: [TextureTarget; 4] =
    [TextureTarget::Texture2d, TextureTarget::Rectangle, TextureTarget::Layer(2), TextureTarget::Multisample(4)];

struct Scene {
    context: Context,
    view: ByHand,
    textures: Textures,
    ao: AmbientOcclusion,
    /// A of each pixel.
    visibility: Vec<f32>,
}

impl Scene {
    fn new(settings: &Settings) -> Scene {
        let context = Context::open(Backend::Egl).unwrap();
        let view = rubble(SIZE, perspective(60.0, SIZE), 5, 2.0..4.0);
        let textures = Textures::new(context.gl(), &view, TextureTarget::Rectangle, NormalEncoding::Signed);
        let mut ao = AmbientOcclusion::new(context.gl().clone(), SIZE, settings).unwrap();
        let scale = if settings.blur == 0 { settings.ao_scale() } else { 1 };
        let (width, height) = (SIZE.0.div_ceil(scale), SIZE.1.div_ceil(scale));
        let texels = (width * height) as usize;
        let texels = read_red(context.gl(), ao.render(&textures.inputs).unwrap(), texels);
        let at = |x: u32, y: u32| texels[(y / scale * width + x / scale) as usize];
        let visibility = (0..SIZE.0 * SIZE.1).map(|i| at(i % SIZE.0, i / SIZE.0)).collect::<Vec<_>>();
        assert!(visibility.iter().any(|&a| a < 0.7) && visibility.iter().any(|&a| a > 0.9));
        Scene { context, view, textures, ao, visibility }
    }

    /// Writes, and checks every pixel of the image: `expected` tells from A what the view holds, and around it is the
    /// first colour.
    fn hold(&mut self, image: TextureRef, write: Write, expected: impl Fn(usize, f32) -> [f32; 4], text: &str) {
        let output = Output::new(Destination::Texture(image), write).at(CORNER);
        self.ao.render_into(&self.textures.inputs, &output).unwrap();
        self.check(&read(self.context.gl(), image), expected, text);
    }

    fn check(&self, got: &[[f32; 4]], expected: impl Fn(usize, f32) -> [f32; 4], text: &str) {
        for (i, got) in got.iter().enumerate() {
            let (x, y) = ((i as u32 % OUTER.0).wrapping_sub(CORNER.0), (i as u32 / OUTER.0).wrapping_sub(CORNER.1));
            let inside = x < SIZE.0 && y < SIZE.1;
            let pixel = if inside { (y * SIZE.0 + x) as usize } else { 0 };
            let expected = if inside { expected(pixel, self.visibility[pixel]) } else { COLOUR };
            let apart = got.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            // The factor and the product are rounded by half a step each.
            assert!(apart <= 1.01 / 255.0, "{text} at {x},{y}: {got:?} {expected:?}");
        }
    }
}

/// Makes a texture of the size OUTER, or of the view's, whose texels are all of one colour.
pub(super) fn texture(
    gl: &glow::Context,
    target: TextureTarget,
    size: (u32, u32),
    texel: impl Fn(u32, u32) -> [f32; 4],
) -> TextureRef {
    let (width, height) = (size.0 as i32, size.1 as i32);
    let texels = (0..size.1).flat_map(|y| (0..size.0).map(move |x| (x, y))).flat_map(|(x, y)| texel(x, y));
    let texels: Vec<u8> = texels.flat_map(f32::to_ne_bytes).collect();
    let data = || glow::PixelUnpackData::Slice(Some(&texels));
    let (internal, format) = (glow::RGBA8 as i32, glow::RGBA);
    // SAFETY: the context is current, and the bytes match the sizes.
    unsafe {
        let texture = gl.create_texture().unwrap();
        match target {
            TextureTarget::Texture2d | TextureTarget::Rectangle => {
                let kind = if target == TextureTarget::Texture2d { glow::TEXTURE_2D } else { glow::TEXTURE_RECTANGLE };
                gl.bind_texture(kind, Some(texture));
                gl.tex_image_2d(kind, 0, internal, width, height, 0, format, glow::FLOAT, data());
                // A texture without mipmaps is complete only with such a filter.
                gl.tex_parameter_i32(kind, glow::TEXTURE_MIN_FILTER, glow::NEAREST as i32);
            }
            TextureTarget::Layer(layer) => {
                let kind = glow::TEXTURE_2D_ARRAY;
                gl.bind_texture(kind, Some(texture));
                let none = glow::PixelUnpackData::Slice(None);
                gl.tex_image_3d(kind, 0, internal, width, height, 4, 0, format, glow::FLOAT, none);
                gl.tex_sub_image_3d(kind, 0, 0, 0, layer as i32, width, height, 1, format, glow::FLOAT, data());
                gl.tex_parameter_i32(kind, glow::TEXTURE_MIN_FILTER, glow::NEAREST as i32);
            }
            TextureTarget::Multisample(samples) => {
                let kind = glow::TEXTURE_2D_MULTISAMPLE;
                gl.bind_texture(kind, Some(texture));
                gl.tex_image_2d_multisample(kind, samples as i32, internal, width, height, true);
                let framebuffer = gl.create_framebuffer().unwrap();
                gl.bind_framebuffer(glow::FRAMEBUFFER, Some(framebuffer));
                gl.framebuffer_texture_2d(glow::FRAMEBUFFER, glow::COLOR_ATTACHMENT0, kind, Some(texture), 0);
                // Only one colour can be cleared to.
                let first: [f32; 4] =
                    std::array::from_fn(|i| f32::from_ne_bytes(std::array::from_fn(|byte| texels[4 * i + byte])));
                gl.clear_buffer_f32_slice(glow::COLOR, 0, &first);
                gl.bind_framebuffer(glow::FRAMEBUFFER, None);
                gl.delete_framebuffer(framebuffer);
            }
        }
        assert_eq!(gl.get_error(), glow::NO_ERROR);
        TextureRef { texture, target }
    }
}

/// Reads an image of the size OUTER. Of several samples the mean is read.
fn read(gl: &glow::Context, image: TextureRef) -> Vec<[f32; 4]> {
    let (width, height) = (OUTER.0 as i32, OUTER.1 as i32);
    let mut bytes = vec![0; 4 * OUTER.0 as usize * OUTER.1 as usize];
    // SAFETY: the context is current, and the vector holds every texel.
    unsafe {
        let [from, to] = [(); 2].map(|()| gl.create_framebuffer().unwrap());
        let point = glow::COLOR_ATTACHMENT0;
        gl.bind_framebuffer(glow::FRAMEBUFFER, Some(from));
        match image.target {
            TextureTarget::Layer(layer) => {
                gl.framebuffer_texture_layer(glow::FRAMEBUFFER, point, Some(image.texture), 0, layer as i32);
            }
            _ => gl.framebuffer_texture(glow::FRAMEBUFFER, point, Some(image.texture), 0),
        }
        if let TextureTarget::Multisample(_) = image.target {
            let plain = texture(gl, TextureTarget::Rectangle, OUTER, |_, _| COLOUR);
            gl.bind_framebuffer(glow::FRAMEBUFFER, Some(to));
            gl.framebuffer_texture(glow::FRAMEBUFFER, point, Some(plain.texture), 0);
            gl.bind_framebuffer(glow::READ_FRAMEBUFFER, Some(from));
            gl.blit_framebuffer(0, 0, width, height, 0, 0, width, height, glow::COLOR_BUFFER_BIT, glow::NEAREST);
            gl.bind_framebuffer(glow::FRAMEBUFFER, Some(to));
        }
        let into = glow::PixelPackData::Slice(Some(&mut bytes));
        gl.read_pixels(0, 0, width, height, glow::RGBA, glow::UNSIGNED_BYTE, into);
        gl.bind_framebuffer(glow::FRAMEBUFFER, None);
        [from, to].into_iter().for_each(|framebuffer| gl.delete_framebuffer(framebuffer));
        assert_eq!(gl.get_error(), glow::NO_ERROR);
    }
    bytes.chunks_exact(4).map(|c| std::array::from_fn(|i| f32::from(c[i]) / 255.0)).collect()
}

fn settings() -> Settings {
    Settings { blur: 5, steps: 3, ..rig::raw(Method::Hbao, 2.0) }
}

#[test]
fn a_texture_of_every_kind_takes_visibility_or_is_multiplied_by_it() {
    let mut scene = Scene::new(&settings());
    for kind in KINDS {
        let image = |scene: &Scene| texture(scene.context.gl(), kind, OUTER, |_, _| COLOUR);
        let text = format!("{kind:?}");
        let to = image(&scene);
        scene.hold(to, Write::Visibility, |_, a| [a, a, a, 1.0], &text);
        let [r, g, b, alpha] = COLOUR;
        for share in [0.0, 0.3, 1.0] {
            let to = image(&scene);
            let factor = |a: f32| 1.0 - share * (1.0 - a);
            let expected = |_, a| [r * factor(a), g * factor(a), b * factor(a), alpha];
            scene.hold(to, Write::Multiplied(share), expected, &format!("{text} {share}"));
        }
    }
}

#[test]
fn each_pixel_can_have_a_share_of_ambient_light_of_its_own() {
    let mut scene = Scene::new(&settings());
    let share = |x: u32, y: u32| (x * 7 + y * 3) as f32 % 11.0 / 10.0;
    let [r, g, b, alpha] = COLOUR;
    for kind in KINDS {
        // A multisample texture has one share everywhere here.
        let uniform = matches!(kind, TextureTarget::Multisample(_));
        let at = move |x: u32, y: u32| if uniform { 0.7 } else { share(x, y) };
        let expected = |i: usize, a: f32| {
            let factor = 1.0 - at(i as u32 % SIZE.0, i as u32 / SIZE.0) * (1.0 - a);
            [r * factor, g * factor, b * factor, alpha]
        };
        let shares = texture(scene.context.gl(), kind, SIZE, |x, y| [0.0, 0.0, 0.0, at(x, y)]);
        let to = texture(scene.context.gl(), TextureTarget::Texture2d, OUTER, |_, _| COLOUR);
        scene.hold(to, Write::MultipliedByShare(shares), expected, &format!("{kind:?}"));
    }
}

#[test]
fn shares_lie_in_the_viewport_of_the_inputs() {
    let mut scene = Scene::new(&settings());
    // The view's textures are larger by this border on all sides.
    let border = 3;
    let outer = (SIZE.0 + 2 * border, SIZE.1 + 2 * border);
    let larger = ByHand {
        depth: hbao::image::Image::from_fn(outer.0 as usize, outer.1 as usize, |x, y| {
            let inside = |at: usize, side: u32| (at as u32).wrapping_sub(border) < side;
            if inside(x, SIZE.0) && inside(y, SIZE.1) { scene.view.depth.at(x - 3, y - 3) } else { 1.0 }
        }),
        normals: hbao::image::Image::from_fn(outer.0 as usize, outer.1 as usize, |x, y| {
            let inside = |at: usize, side: u32| (at as u32).wrapping_sub(border) < side;
            if inside(x, SIZE.0) && inside(y, SIZE.1) { scene.view.normals.at(x - 3, y - 3) } else { [0.0, 0.0, -1.0] }
        }),
        projection: scene.view.projection,
    };
    scene.textures = Textures::new(scene.context.gl(), &larger, TextureTarget::Rectangle, NormalEncoding::Signed);
    scene.textures.inputs.viewport = Some(Viewport { x: border, y: border, width: SIZE.0, height: SIZE.1 });
    // (x, y) are those of the larger textures.
    let share = |x: u32, y: u32| ((x * 5 + y) % 7) as f32 / 6.0;
    let shares = texture(scene.context.gl(), TextureTarget::Texture2d, outer, |x, y| [0.0, 0.0, 0.0, share(x, y)]);
    let to = texture(scene.context.gl(), TextureTarget::Rectangle, OUTER, |_, _| COLOUR);
    let expected = |i: usize, a: f32| {
        let factor = 1.0 - share(i as u32 % SIZE.0 + border, i as u32 / SIZE.0 + border) * (1.0 - a);
        [COLOUR[0] * factor, COLOUR[1] * factor, COLOUR[2] * factor, COLOUR[3]]
    };
    scene.hold(to, Write::MultipliedByShare(shares), expected, "viewport");
}

#[test]
fn half_resolution_without_a_blur_fills_the_whole_view() {
    let mut scene = Scene::new(&Settings { half_res: true, steps: 3, ..rig::raw(Method::Hbao, 2.0) });
    let to = texture(scene.context.gl(), TextureTarget::Texture2d, OUTER, |_, _| COLOUR);
    scene.hold(to, Write::Visibility, |_, a| [a, a, a, 1.0], "half");
}

/// Attaches colour textures to a framebuffer, which draws into all of them.
fn framebuffer(gl: &glow::Context, images: &[TextureRef]) -> glow::Framebuffer {
    // SAFETY: the context is current.
    unsafe {
        let framebuffer = gl.create_framebuffer().unwrap();
        gl.bind_framebuffer(glow::FRAMEBUFFER, Some(framebuffer));
        let points: Vec<u32> = (0..images.len() as u32).map(|i| glow::COLOR_ATTACHMENT0 + i).collect();
        for (&point, image) in points.iter().zip(images) {
            gl.framebuffer_texture(glow::FRAMEBUFFER, point, Some(image.texture), 0);
        }
        gl.draw_buffers(&points);
        gl.bind_framebuffer(glow::FRAMEBUFFER, None);
        framebuffer
    }
}

#[test]
fn a_framebuffer_is_multiplied() {
    let mut scene = Scene::new(&settings());
    let image = texture(scene.context.gl(), TextureTarget::Texture2d, OUTER, |_, _| COLOUR);
    let framebuffer = framebuffer(scene.context.gl(), &[image]);
    let output = Output::multiplied(Some(framebuffer)).at(CORNER);
    scene.ao.render_into(&scene.textures.inputs, &output).unwrap();
    let [r, g, b, alpha] = COLOUR;
    scene.check(&read(scene.context.gl(), image), |_, a| [r * a, g * a, b * a, alpha], "framebuffer");
    // SAFETY: the context is current.
    unsafe { scene.context.gl().bind_framebuffer(glow::DRAW_FRAMEBUFFER, Some(framebuffer)) };
    let output = Output::new(Destination::Bound, Write::Visibility).at(CORNER);
    scene.ao.render_into(&scene.textures.inputs, &output).unwrap();
    scene.check(&read(scene.context.gl(), image), |_, a| [a, a, a, 1.0], "bound");
}

#[test]
fn colours_in_srgb_are_multiplied_as_light_where_the_application_lets_them() {
    in_own_process("output::colours_in_srgb_are_multiplied_as_light_where_the_application_lets_them", &[], || {
        let mut scene = Scene::new(&settings());
        let gl = scene.context.gl().clone();
        let image = texture(&gl, TextureTarget::Texture2d, OUTER, |_, _| COLOUR);
        // SAFETY: the context is current, and nothing is uploaded that has a length.
        unsafe {
            gl.bind_texture(glow::TEXTURE_2D, Some(image.texture));
            let texels = vec![128u8; 4 * OUTER.0 as usize * OUTER.1 as usize];
            let (data, internal) = (glow::PixelUnpackData::Slice(Some(&texels)), glow::SRGB8_ALPHA8 as i32);
            let (w, h) = (OUTER.0 as i32, OUTER.1 as i32);
            gl.tex_image_2d(glow::TEXTURE_2D, 0, internal, w, h, 0, glow::RGBA, glow::UNSIGNED_BYTE, data);
        }
        let to = Destination::Texture(image);
        let output = Output::new(to, Write::Multiplied(1.0)).at(CORNER);
        let light = |c: f32| ((c + 0.055) / 1.055).powf(2.4);
        let stored = |l: f32| if l <= 0.0031308 { 12.92 * l } else { 1.055 * l.powf(1.0 / 2.4) - 0.055 };
        let first = 128.0 / 255.0;
        for (srgb, darkened) in [
            (true, Box::new(move |a: f32| stored(light(first) * a)) as Box<dyn Fn(f32) -> f32>),
            // The image is as the turn before has left it.
            (false, Box::new(move |a: f32| stored(light(first) * a) * a)),
        ] {
            // SAFETY: the context is current.
            unsafe { if srgb { gl.enable(glow::FRAMEBUFFER_SRGB) } else { gl.disable(glow::FRAMEBUFFER_SRGB) } }
            scene.ao.render_into(&scene.textures.inputs, &output).unwrap();
            // SAFETY: the context is current.
            unsafe {
                assert_eq!(gl.is_enabled(glow::FRAMEBUFFER_SRGB), srgb);
                gl.disable(glow::FRAMEBUFFER_SRGB);
            }
            let got = read(&gl, image);
            for y in 0..SIZE.1 {
                for x in 0..SIZE.0 {
                    let a = scene.visibility[(y * SIZE.0 + x) as usize];
                    let got = got[((y + CORNER.1) * OUTER.0 + x + CORNER.0) as usize][0];
                    assert!((got - darkened(a)).abs() < 2.0 / 255.0, "{srgb} {got} {}", darkened(a));
                }
            }
        }
    });
}

/// Makes a texture of the view's size with this internal format and format.
fn uninitialised(gl: &glow::Context, internal: u32, format: u32) -> TextureRef {
    let (kind, width, height) = (glow::TEXTURE_2D, SIZE.0 as i32, SIZE.1 as i32);
    // SAFETY: the context is current, and nothing is uploaded.
    unsafe {
        let texture = gl.create_texture().unwrap();
        gl.bind_texture(kind, Some(texture));
        let (nothing, number) = (glow::PixelUnpackData::Slice(None), glow::UNSIGNED_INT);
        gl.tex_image_2d(kind, 0, internal as i32, width, height, 0, format, number, nothing);
        assert_eq!(gl.get_error(), glow::NO_ERROR);
        TextureRef { texture, target: TextureTarget::Texture2d }
    }
}

#[test]
fn what_cannot_be_written_is_refused_in_words() {
    let mut scene = Scene::new(&settings());
    let gl = scene.context.gl().clone();
    let image = |size| texture(&gl, TextureTarget::Texture2d, size, |_, _| COLOUR);
    let (first, small) = (image(OUTER), image((SIZE.0 - 1, SIZE.1)));
    let several = framebuffer(&gl, &[first, image(OUTER)]);
    let none = framebuffer(&gl, &[]);
    let fitting = image(SIZE);
    let shared = framebuffer(&gl, &[fitting]);
    let whole = uninitialised(&gl, glow::RGBA8UI, glow::RGBA_INTEGER);
    let red = uninitialised(&gl, glow::R8, glow::RED);
    let depth = uninitialised(&gl, glow::DEPTH_COMPONENT24, glow::DEPTH_COMPONENT);
    let own = scene.ao.render(&scene.textures.inputs).unwrap();
    let scene_inputs = scene.textures.inputs;
    let mut refused = |to, corner, write, words: &[&str]| {
        let error = scene.ao.render_into(&scene.textures.inputs, &Output::new(to, write).at(corner)).unwrap_err();
        let message = error.to_string();
        assert!(words.iter().all(|word| message.contains(word)), "{message}");
        assert!(!message.contains('\n'));
        // The next call works.
        let output = Output::new(Destination::Texture(first), Write::Visibility).at(CORNER);
        scene.ao.render_into(&scene.textures.inputs, &output).unwrap();
    };
    let texture = Destination::Texture;
    refused(texture(small), (0, 0), Write::Visibility, &["output", "22x17"]);
    refused(texture(first), (20, 0), Write::Visibility, &["reaches past", "output"]);
    for to in [texture(first), Destination::Framebuffer(None)] {
        refused(to, (u32::MAX, 0), Write::Visibility, &["corner", "past every image"]);
        refused(to, (0, 1 << 31), Write::Visibility, &["corner", "past every image"]);
    }
    let rectangle = TextureRef { target: TextureTarget::Rectangle, ..first };
    refused(texture(rectangle), (0, 0), Write::Visibility, &["output", "declared kind"]);
    refused(Destination::Framebuffer(Some(several)), (0, 0), Write::Visibility, &["draw buffer", "2", "glDrawBuffers"]);
    refused(Destination::Framebuffer(Some(none)), (0, 0), Write::Visibility, &["output", "no attachment"]);
    for input in [scene_inputs.depth, scene_inputs.normals.unwrap()] {
        refused(texture(input), (0, 0), Write::Visibility, &["output", "one of the inputs"]);
    }
    for share in [-0.1, 1.5, f32::NAN] {
        refused(texture(first), (0, 0), Write::Multiplied(share), &["share", "0 to 1"]);
    }
    refused(texture(first), CORNER, Write::MultipliedByShare(first), &["shares", "written to"]);
    refused(texture(first), CORNER, Write::MultipliedByShare(small), &["shares", "22x17"]);
    for to in [whole, depth] {
        refused(texture(to), (0, 0), Write::Visibility, &["output", "format", "R8"]);
    }
    for shares in [whole, depth, red] {
        refused(texture(first), CORNER, Write::MultipliedByShare(shares), &["shares", "alpha"]);
    }
    refused(texture(own), (0, 0), Write::Visibility, &["output", "own"]);
    let of_shared = Write::MultipliedByShare(fitting);
    refused(Destination::Framebuffer(Some(shared)), (0, 0), of_shared, &["shares", "written to"]);
}
