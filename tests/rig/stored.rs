//! Depth and normals as engines store them: depth buffers of every format and convention, in textures of every kind.

use super::by_hand::ByHand;
use glow::HasContext as _;
use hbao::image::Image;
use hbao::scene::Projection;
use hbao::{ClipRange, DepthEncoding, TextureRef, TextureTarget, reference};
use std::sync::Arc;

/// The formats of depth buffers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Depths {
    Bits16,
    Bits24,
    Bits24AndStencil,
    Float,
    FloatAndStencil,
    /// A copy in a colour texture.
    Copied,
}

impl Depths {
    pub const ALL: [Depths; 6] = [
        Depths::Bits16,
        Depths::Bits24,
        Depths::Bits24AndStencil,
        Depths::Float,
        Depths::FloatAndStencil,
        Depths::Copied,
    ];

    /// The largest integer that the format stores; `None` for floats.
    fn largest(self) -> Option<f64> {
        match self {
            Depths::Bits16 => Some(65_535.0),
            Depths::Bits24 | Depths::Bits24AndStencil => Some(16_777_215.0),
            _ => None,
        }
    }

    /// The value that a shader reads where d was written.
    pub fn rounded(self, d: f64) -> f32 {
        self.largest().map_or(d as f32, |largest| ((d * largest).round() / largest) as f32)
    }

    /// How far a stored value may be from d.
    pub fn error(self, d: f64) -> f64 {
        // A shader reads float32 in all cases.
        d * 2f64.powi(-24) + self.largest().map_or(0.0, |largest| 0.5 / largest)
    }

    /// The internal format, the format, the type and the bytes of a texel.
    fn texel(self, d: f64) -> (u32, u32, u32, Vec<u8>) {
        let integer = self.largest().map_or(0, |largest| (d * largest).round() as u32);
        let float = (d as f32).to_ne_bytes();
        match self {
            Depths::Bits16 => {
                let bytes = (integer as u16).to_ne_bytes().to_vec();
                (glow::DEPTH_COMPONENT16, glow::DEPTH_COMPONENT, glow::UNSIGNED_SHORT, bytes)
            }
            Depths::Bits24 => {
                let wide = (integer << 8) | (integer >> 16);
                (glow::DEPTH_COMPONENT24, glow::DEPTH_COMPONENT, glow::UNSIGNED_INT, wide.to_ne_bytes().to_vec())
            }
            Depths::Bits24AndStencil => {
                let packed = ((integer << 8) | 0x5a).to_ne_bytes().to_vec();
                (glow::DEPTH24_STENCIL8, glow::DEPTH_STENCIL, glow::UNSIGNED_INT_24_8, packed)
            }
            Depths::Float => (glow::DEPTH_COMPONENT32F, glow::DEPTH_COMPONENT, glow::FLOAT, float.to_vec()),
            Depths::FloatAndStencil => {
                let packed = [float, 0x5au32.to_ne_bytes()].concat();
                (glow::DEPTH32F_STENCIL8, glow::DEPTH_STENCIL, glow::FLOAT_32_UNSIGNED_INT_24_8_REV, packed)
            }
            Depths::Copied => (glow::R32F, glow::RED, glow::FLOAT, float.to_vec()),
        }
    }
}

/// A projection matrix of OpenGL, column by column, as engines write it in float32. `z_axis` is -1 in a right-handed
/// eye space and 1 in a left-handed one. Far may be infinite in perspective.
pub fn matrix(
    projection: Projection,
    [near, far]: [f64; 2],
    reversed: bool,
    range: ClipRange,
    z_axis: f64,
) -> [f32; 16] {
    let [x, y] = projection.half_extents().map(|half| (1.0 / half) as f32);
    // ndc at the near and at the far plane.
    let [n, f] = match (range, reversed) {
        (ClipRange::MinusOneToOne, false) => [-1.0, 1.0],
        (ClipRange::MinusOneToOne, true) => [1.0, -1.0],
        (ClipRange::ZeroToOne, false) => [0.0, 1.0],
        (ClipRange::ZeroToOne, true) => [1.0, 0.0],
    };
    let mut m = [0.0; 16];
    (m[0], m[5]) = (x, y);
    if projection.is_perspective() {
        // ndc = a + b/z.
        let b = (n - f) / (1.0 / near - 1.0 / far);
        let a = f - b / far;
        (m[10], m[11], m[14]) = ((a * z_axis) as f32, z_axis as f32, b as f32);
    } else {
        let b = (f - n) / (far - near);
        (m[10], m[14], m[15]) = ((b * z_axis) as f32, (n - b * near) as f32, 1.0);
    }
    m
}

/// The value d that a depth buffer holds at depth z, which is the cleared value on background.
pub fn encode(encoding: DepthEncoding, perspective: bool, z: f64) -> f64 {
    match encoding {
        DepthEncoding::Linear => z,
        DepthEncoding::Planes { near, far, reversed } => {
            let d = match (perspective, far.is_infinite()) {
                _ if z.is_infinite() => 1.0,
                (true, true) => 1.0 - near / z,
                (true, false) => far * (z - near) / ((far - near) * z),
                (false, _) => (z - near) / (far - near),
            };
            if reversed { 1.0 - d } else { d }
        }
        DepthEncoding::Matrix { projection, range } => {
            let m = projection.map(f64::from);
            let at = |z: f64| {
                let ndc = (m[10] * z + m[14]) / (m[11] * z + m[15]);
                if range == ClipRange::MinusOneToOne { ndc / 2.0 + 0.5 } else { ndc }
            };
            // In an orthographic view both planes lie in front of the eye, and so does the middle between them.
            let middle = if range == ClipRange::MinusOneToOne { 0.0 } else { 0.5 };
            let hand = if m[11] != 0.0 { m[11] } else { ((middle - m[14]) / m[10]).signum() };
            let rises = at(hand * 20.0) > at(hand * 10.0);
            if z.is_infinite() { f64::from(u8::from(rises)) } else { at(hand * z) }
        }
        DepthEncoding::Logarithmic { .. } if z.is_infinite() => 1.0,
        DepthEncoding::Logarithmic { c, far } => (c * z + 1.0).ln() / (c * far + 1.0).ln(),
        _ => unreachable!(),
    }
}

/// Uploads texels of one format into a texture of this kind, with its lower left corner at `corner` of a texture of
/// size `of`, which is otherwise filled with `around`. Other layers are filled with it too.
#[allow(clippy::too_many_arguments)]
pub fn upload(
    gl: &glow::Context,
    target: TextureTarget,
    (internal, external, kind): (u32, u32, u32),
    texels: &Image<Vec<u8>>,
    around: &[u8],
    corner: (usize, usize),
    of: (usize, usize),
) -> TextureRef {
    let layers = if let TextureTarget::Layer(layer) = target { layer as usize + 2 } else { 1 };
    let mut bytes = Vec::new();
    for layer in 0..layers {
        let filled = layers == 1 || layer + 2 == layers;
        for y in 0..of.1 {
            for x in 0..of.0 {
                let (i, j) = (x.wrapping_sub(corner.0), y.wrapping_sub(corner.1));
                let inside = filled && i < texels.width && j < texels.height;
                bytes.extend_from_slice(if inside { &texels.texels[j * texels.width + i] } else { around });
            }
        }
    }
    let (width, height) = (of.0 as i32, of.1 as i32);
    // SAFETY: the context is current, and the number of bytes matches the size and format.
    unsafe {
        let texture = gl.create_texture().unwrap();
        gl.active_texture(glow::TEXTURE0);
        gl.pixel_store_i32(glow::UNPACK_ALIGNMENT, 1);
        let data = glow::PixelUnpackData::Slice(Some(&bytes));
        let internal = internal as i32;
        match target {
            TextureTarget::Layer(_) => {
                let kind_of = glow::TEXTURE_2D_ARRAY;
                gl.bind_texture(kind_of, Some(texture));
                gl.tex_image_3d(kind_of, 0, internal, width, height, layers as i32, 0, external, kind, data);
            }
            _ => {
                let kind_of =
                    if target == TextureTarget::Rectangle { glow::TEXTURE_RECTANGLE } else { glow::TEXTURE_2D };
                gl.bind_texture(kind_of, Some(texture));
                gl.tex_image_2d(kind_of, 0, internal, width, height, 0, external, kind, data);
            }
        }
        assert_eq!(gl.get_error(), glow::NO_ERROR);
        TextureRef { texture, target }
    }
}

/// A texture of hardware depth, and the linear depth of what it stores.
pub struct Stored {
    pub image: TextureRef,
    /// The linear depth of the stored values, by the float64 twin.
    pub linear: ByHand,
}

impl Stored {
    pub fn new(
        gl: &Arc<glow::Context>,
        view: &ByHand,
        encoding: DepthEncoding,
        format: Depths,
        target: TextureTarget,
    ) -> Stored {
        let perspective = view.projection.is_perspective();
        let d = |z: f32| encode(encoding, perspective, f64::from(z));
        let texels = Image {
            width: view.depth.width,
            height: view.depth.height,
            texels: view.depth.texels.iter().map(|&z| format.texel(d(z)).3).collect(),
        };
        let (internal, external, kind, around) = format.texel(0.5);
        let size = (texels.width, texels.height);
        let image = upload(gl, target, (internal, external, kind), &texels, &around, (0, 0), size);
        let stored = view.depth.map(|z| format.rounded(d(z)));
        let depth = reference::linear_depth(&stored, encoding, view.projection).unwrap().map(|z| z as f32);
        Stored { image, linear: ByHand { depth, ..view.clone() } }
    }
}
