//! Computes ambient occlusion from depth and normals that a test makes up, in textures of its own.

use super::random::Draw;
use glam::DVec3;
use glow::HasContext as _;
use hbao::image::Image;
use hbao::reference;
use hbao::rotation_tile;
use hbao::scene::{Extents, Projection};
use hbao::{AmbientOcclusion, BACKGROUND_R32F, Inputs, NormalEncoding, Settings, TextureRef, TextureTarget};
use std::sync::Arc;

/// The near plane, which is nearer than any of the made-up surfaces.
const NEAR: f64 = 0.01;

/// A view of a made-up surface.
#[derive(Clone)]
pub struct ByHand {
    /// The depth, which is infinite on background.
    pub depth: Image<f32>,
    pub normals: Image<[f32; 3]>,
    pub projection: Projection,
}

impl ByHand {
    pub fn size(&self) -> (u32, u32) {
        (self.depth.width as u32, self.depth.height as u32)
    }

    pub fn covered(&self) -> Image<bool> {
        self.depth.map(f32::is_finite)
    }

    /// Computes it with the shaders, from rectangle textures.
    pub fn by_shader(&self, gl: &Arc<glow::Context>, settings: &Settings) -> Image<f32> {
        self.by_shader_from(gl, settings, TextureTarget::Rectangle, NormalEncoding::Signed)
    }

    /// Computes it with the shaders, from textures of this kind.
    pub fn by_shader_from(
        &self,
        gl: &Arc<glow::Context>,
        settings: &Settings,
        target: TextureTarget,
        encoding: NormalEncoding,
    ) -> Image<f32> {
        let mut ao = AmbientOcclusion::new(gl.clone(), self.size(), settings).unwrap();
        Textures::new(gl, self, target, encoding).visibility(&mut ao, self)
    }

    pub fn twin_inputs<'a>(&'a self, tile: &'a Image<[f32; 3]>) -> reference::TwinInputs<'a> {
        reference::TwinInputs {
            depth: &self.depth,
            normals: &self.normals,
            tile,
            projection: self.projection,
            near: NEAR,
        }
    }

    /// Computes it with the float64 twins.
    pub fn by_twin(&self, settings: &Settings) -> Image<f64> {
        let raw = reference::visibility(&self.twin_inputs(&rotation_tile(settings)), settings).unwrap();
        reference::blur::blur(&raw, &self.depth, &[], self.projection, settings).unwrap()
    }

    /// Computes it with the shaders and with the twins, so that a test can compare both with the same closed form.
    pub fn by_both(&self, gl: &Arc<glow::Context>, settings: &Settings) -> [(&'static str, Image<f64>); 2] {
        [("shader", self.by_shader(gl, settings).map(f64::from)), ("twin", self.by_twin(settings))]
    }
}

/// The textures of an application.
pub struct Textures {
    gl: Arc<glow::Context>,
    pub inputs: Inputs,
}

impl Textures {
    /// Uploads the textures through unit 0. Their filters and wrap modes stay at OpenGL's defaults, because the passes
    /// use samplers of their own.
    pub fn new(gl: &Arc<glow::Context>, view: &ByHand, target: TextureTarget, encoding: NormalEncoding) -> Textures {
        let depth: Vec<f32> = view.depth.texels.iter().map(|&z| z.min(BACKGROUND_R32F)).collect();
        let stored = |c: f32| if encoding == NormalEncoding::Biased { 0.5 * c + 0.5 } else { c };
        let normals: Vec<f32> =
            view.normals.texels.iter().flat_map(|n| [stored(n[0]), stored(n[1]), stored(n[2]), 0.0]).collect();
        let upload = |internal: u32, external: u32, floats: &[f32]| {
            let bytes: Vec<u8> = floats.iter().flat_map(|f| f.to_ne_bytes()).collect();
            let kind = if target == TextureTarget::Rectangle { glow::TEXTURE_RECTANGLE } else { glow::TEXTURE_2D };
            let (width, height) = view.size();
            // SAFETY: the context is current, and the number of bytes matches the size and format.
            unsafe {
                let texture = gl.create_texture().unwrap();
                gl.active_texture(glow::TEXTURE0);
                gl.bind_texture(kind, Some(texture));
                let data = glow::PixelUnpackData::Slice(Some(&bytes));
                gl.tex_image_2d(kind, 0, internal as i32, width as i32, height as i32, 0, external, glow::FLOAT, data);
                assert_eq!(gl.get_error(), glow::NO_ERROR);
                texture
            }
        };
        let depth = upload(glow::R32F, glow::RED, &depth);
        let normals = upload(glow::RGBA32F, glow::RGBA, &normals);
        let inputs = Inputs::new(depth, normals, target, view.projection);
        let inputs = Inputs { normal_encoding: encoding, near: NEAR, ..inputs };
        Textures { gl: gl.clone(), inputs }
    }

    /// Renders ambient occlusion from these textures and reads it back.
    pub fn visibility(&self, ao: &mut AmbientOcclusion, view: &ByHand) -> Image<f32> {
        let visibility = ao.render(&self.inputs).unwrap();
        let (width, height) = (view.depth.width, view.depth.height);
        Image { width, height, texels: read_red(&self.gl, visibility, width * height) }
    }
}

impl Drop for Textures {
    fn drop(&mut self) {
        // SAFETY: both textures belong to this object, and tests drop it before the context.
        unsafe {
            self.gl.delete_texture(self.inputs.depth.texture);
            self.inputs.normals.iter().for_each(|normals| self.gl.delete_texture(normals.texture));
        }
    }
}

/// Reads the red channel of a rectangle texture that has `texels` texels.
pub fn read_red(gl: &glow::Context, image: TextureRef, texels: usize) -> Vec<f32> {
    assert_eq!(image.target, TextureTarget::Rectangle);
    let mut bytes = vec![0; 4 * texels];
    // SAFETY: the context is current, and the vector holds one float for each texel.
    unsafe {
        gl.bind_texture(glow::TEXTURE_RECTANGLE, Some(image.texture));
        let into = glow::PixelPackData::Slice(Some(&mut bytes[..]));
        gl.get_tex_image(glow::TEXTURE_RECTANGLE, 0, glow::RED, glow::FLOAT, into);
        assert_eq!(gl.get_error(), glow::NO_ERROR);
    }
    bytes.chunks_exact(4).map(|b| f32::from_ne_bytes([b[0], b[1], b[2], b[3]])).collect()
}

/// A perspective with this vertical field of view in degrees, and with square pixels.
pub fn perspective(fov_y: f64, (width, height): (u32, u32)) -> Projection {
    let tan_half_fov_y = (fov_y.to_radians() / 2.0).tan();
    let tan_half_fov_x = tan_half_fov_y * f64::from(width) / f64::from(height);
    Projection::Perspective(Extents::centred(tan_half_fov_x, tan_half_fov_y))
}

/// An orthographic view in which texels have this size in scene units.
pub fn orthographic(texel: f64, (width, height): (u32, u32)) -> Projection {
    Projection::Orthographic(Extents::centred(texel * f64::from(width) / 2.0, texel * f64::from(height) / 2.0))
}

/// Returns x' and y' of a texel's centre.
pub fn slope(projection: Projection, (width, height): (u32, u32), x: usize, y: usize) -> [f64; 2] {
    let [u, v] = [(x as f64 + 0.5) / f64::from(width), (y as f64 + 0.5) / f64::from(height)];
    let ([half_x, half_y], [x, y]) = (projection.half_extents(), projection.middle_at(1.0));
    [x + (2.0 * u - 1.0) * half_x, y + (2.0 * v - 1.0) * half_y]
}

/// The depth and normals of the plane n.X = distance, in float32.
pub fn plane(projection: Projection, size: (u32, u32), n: DVec3, distance: f64) -> ByHand {
    let depth = |x: usize, y: usize| {
        let [sx, sy] = slope(projection, size, x, y);
        let z = if projection.is_perspective() {
            distance / n.dot(DVec3::new(sx, sy, 1.0))
        } else {
            (distance - n.x * sx - n.y * sy) / n.z
        };
        if z > 0.05 && z < 1e4 { z as f32 } else { f32::INFINITY }
    };
    let depth = Image::from_fn(size.0 as usize, size.1 as usize, depth);
    let normals = depth.map(|_| n.as_vec3().to_array());
    ByHand { depth, normals, projection }
}

/// An orthographic floor with texels of size 1. It faces the eye, or with a `rise` it falls away from the eye to the
/// right by that much per texel. On the floor stand columns, each one texel wide: (x, height towards the eye).
pub fn columns(rise: f64, columns: &[(usize, f64)]) -> ByHand {
    const WIDTH: usize = 41;
    const HEIGHT: usize = 13;
    let depth = Image::from_fn(WIDTH, HEIGHT, |x, _| {
        let height: f64 = columns.iter().filter(|column| column.0 == x).map(|column| column.1).sum();
        (100.0 + rise * x as f64 - height) as f32
    });
    let normal = DVec3::new(rise, 0.0, -1.0).normalize().as_vec3().to_array();
    let projection = orthographic(1.0, (WIDTH as u32, HEIGHT as u32));
    ByHand { normals: depth.map(|_| normal), depth, projection }
}

/// A surface of height h(x, y) above the plane z = 100, seen from straight above with texels of size 1. The normals are
/// computed from the gradient.
pub fn heights(
    (width, height): (u32, u32),
    h: impl Fn(usize, usize) -> f64,
    gradient: impl Fn(usize, usize) -> [f64; 2],
) -> ByHand {
    let (columns, rows) = (width as usize, height as usize);
    ByHand {
        depth: Image::from_fn(columns, rows, |x, y| (100.0 - h(x, y)) as f32),
        normals: Image::from_fn(columns, rows, |x, y| {
            let [dx, dy] = gradient(x, y);
            DVec3::new(-dx, -dy, -1.0).normalize().as_vec3().to_array()
        }),
        projection: orthographic(1.0, (width, height)),
    }
}

/// Half the width and height of [`pit`], rounded down. The texel in the middle is (PIT, PIT).
pub const PIT: usize = 20;

/// Figure 6.2.4 of the chapter, in all directions from the middle. A floor faces the eye. Six texels from the middle
/// there is a rim, two texels thick and `rim` high, and behind it the floor continues at its low height. A point above
/// the outer floor and below the line of sight over the rim is above the height field, but hidden from the middle.
pub fn pit(rim: f64) -> ByHand {
    let size = 2 * PIT as u32 + 1;
    let height = |x: usize, y: usize| match x.abs_diff(PIT).max(y.abs_diff(PIT)) {
        6 | 7 => rim,
        _ => 0.0,
    };
    heights((size, size), height, |_, _| [0.0; 2])
}

/// A surface that no G-buffer would contain. The depths are random in a range, evenly distributed in their logarithm,
/// with a twentieth of background among them. The normals have any length and direction, and a tenth of them are zero.
pub fn rubble(size: (u32, u32), projection: Projection, seed: u128, depths: std::ops::Range<f64>) -> ByHand {
    let mut draw = Draw::new(seed);
    let (width, height) = (size.0 as usize, size.1 as usize);
    // The first column is never background, so that a picture of one pixel shows something.
    let depth = Image::from_fn(width, height, |x, _| {
        let z = depths.start * (depths.end / depths.start).powf(draw.unit());
        if x > 0 && draw.unit() < 0.05 { f32::INFINITY } else { z as f32 }
    });
    let normals = Image::from_fn(width, height, |_, _| {
        let n = DVec3::new(draw.signed(), draw.signed(), draw.signed() - 0.7);
        if draw.unit() < 0.1 { [0.0; 3] } else { n.as_vec3().to_array() }
    });
    ByHand { depth, normals, projection }
}
