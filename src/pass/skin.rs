//! The textures of a mesh, as the G-buffer's shader reads them: level 0 of plain two-dimensional textures.

use crate::Error;
use crate::gl::{Program, check, not_made};
use crate::scene::{Map, Mesh, Skin, Texture, Wrap};
use glow::HasContext;
use std::sync::Arc;

/// The name of the place that is given in errors while textures are uploaded.
const PLACE: &str = "gbuffer: textures";

/// What of a mesh's textures and colours a G-buffer needs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Needs {
    /// Textures of the colour.
    pub(crate) textured: bool,
    /// Textures that cut the surface away.
    pub(crate) cut: bool,
    /// Colours of the vertices.
    pub(crate) vertex_colours: bool,
}

impl Needs {
    /// Returns what a G-buffer of this mesh needs. `colour` is true if it holds colours.
    pub(crate) fn of(mesh: &Mesh, colour: bool) -> Needs {
        Needs {
            textured: colour && mesh.skins().iter().any(|skin| skin.colour.is_some()),
            cut: mesh.skins().iter().any(|skin| skin.cut.is_some()),
            vertex_colours: colour && !mesh.vertex_colours().is_empty(),
        }
    }
}

/// The textures that are uploaded to OpenGL. They stay there for later frames of the same mesh.
pub(crate) struct Textures {
    gl: Arc<glow::Context>,
    held: Vec<Held>,
}

/// A texture that is uploaded.
struct Held {
    texture: glow::Texture,
    channels: usize,
    /// What it holds, or none if it is a single texel of ones.
    of: Option<Arc<Texture>>,
    /// True if the last mesh uses it.
    used: bool,
}

impl Textures {
    pub(crate) fn new(gl: &Arc<glow::Context>) -> Textures {
        Textures { gl: gl.clone(), held: Vec::new() }
    }

    /// Returns the bytes of all textures.
    pub(crate) fn bytes(&self) -> u64 {
        let texels = |held: &Held| held.of.as_ref().map_or(held.channels, |of| of.texels.len());
        self.held.iter().map(|held| texels(held) as u64).sum()
    }

    /// Returns the number of a texture, which is uploaded if it is not there yet.
    fn number(&mut self, of: Option<&Arc<Texture>>, channels: usize) -> Result<usize, Error> {
        let same = |held: &Held| match (&held.of, of) {
            (Some(held), Some(of)) => Arc::ptr_eq(held, of),
            (None, None) => held.channels == channels,
            _ => false,
        };
        if let Some(number) = self.held.iter().position(same) {
            self.held[number].used = true;
            return Ok(number);
        }
        match of {
            None => self.upload(None, channels, &[u8::MAX; 3][..channels], (1, 1))?,
            Some(texture) => {
                let size = (texture.width, texture.height);
                // SAFETY: the context is current.
                let limit = unsafe { self.gl.get_parameter_i32(glow::MAX_TEXTURE_SIZE) }.max(0) as u32;
                if size.0.max(size.1) > limit {
                    let (name, (width, height)) = (Error::shown(&texture.name), size);
                    return Err(Error::gl(
                        "gbuffer",
                        format!(
                            "the texture {name} has {width}x{height} texels, and this driver takes {limit}x{limit}: \
                             scale it down"
                        ),
                    ));
                }
                self.upload(Some(texture), channels, &texture.texels, size)?;
            }
        }
        Ok(self.held.len() - 1)
    }

    fn upload(
        &mut self,
        of: Option<&Arc<Texture>>,
        channels: usize,
        texels: &[u8],
        (width, height): (u32, u32),
    ) -> Result<(), Error> {
        let gl = &self.gl;
        let (internal, format) = if channels == 3 { (glow::RGB8, glow::RGB) } else { (glow::R8, glow::RED) };
        // SAFETY: the context is current, and `texels` holds `width * height` texels without padding between rows.
        unsafe {
            let texture = gl.create_texture().map_err(|_| not_made(gl, PLACE))?;
            self.held.push(Held { texture, channels, of: of.cloned(), used: true });
            gl.active_texture(glow::TEXTURE0);
            gl.bind_texture(glow::TEXTURE_2D, Some(texture));
            gl.pixel_store_i32(glow::UNPACK_ALIGNMENT, 1);
            let data = glow::PixelUnpackData::Slice(Some(texels));
            let (width, height) = (width as i32, height as i32);
            gl.tex_image_2d(glow::TEXTURE_2D, 0, internal as i32, width, height, 0, format, glow::UNSIGNED_BYTE, data);
            gl.pixel_store_i32(glow::UNPACK_ALIGNMENT, 4);
            for parameter in [glow::TEXTURE_MIN_FILTER, glow::TEXTURE_MAG_FILTER] {
                gl.tex_parameter_i32(glow::TEXTURE_2D, parameter, glow::NEAREST as i32);
            }
            gl.tex_parameter_i32(glow::TEXTURE_2D, glow::TEXTURE_MAX_LEVEL, 0);
        }
        check(gl, PLACE).inspect_err(|_| {
            // What it holds is not known.
            if let Some(held) = self.held.pop() {
                // SAFETY: the texture is ours, and the context is current.
                unsafe { self.gl.delete_texture(held.texture) };
            }
        })
    }

    /// Deletes the textures that the last mesh does not use.
    fn delete_unused(&mut self) {
        // SAFETY: the textures are ours, and the context is current by the contract of `gl`.
        self.held.iter().filter(|held| !held.used).for_each(|held| unsafe { self.gl.delete_texture(held.texture) });
        self.held.retain(|held| held.used);
    }
}

impl Drop for Textures {
    fn drop(&mut self) {
        self.held.iter_mut().for_each(|held| held.used = false);
        self.delete_unused();
    }
}

/// The textures that the groups of a mesh have.
pub(crate) struct Skins {
    gl: Arc<glow::Context>,
    /// For each group of the mesh, the textures that the shader reads, in the order of the units. None is one that the
    /// shader does not read.
    groups: Vec<[Option<Laid>; 2]>,
}

/// A texture that the shader reads: the scale and offset of its coordinates, and how they are wrapped.
struct Laid {
    texture: glow::Texture,
    placed: [f32; 4],
    wrap: [Wrap; 2],
}

/// The uniforms of each texture that the shader may read, in the order of the units.
const UNIFORMS: [[&str; 3]; 2] =
    [["colour_map", "colour_placed", "colour_wrap"], ["cut_map", "cut_placed", "cut_wrap"]];

impl Skins {
    /// Makes the skins of a mesh, and uploads those textures that they need and that are not among `textures` yet.
    pub(crate) fn new(mesh: &Mesh, needs: Needs, textures: &mut Textures) -> Result<Skins, Error> {
        textures.held.iter_mut().for_each(|held| held.used = false);
        let mut numbers = Vec::new();
        for skin in mesh.skins().iter().filter(|_| needs.textured || needs.cut) {
            let mut number = |needed: bool, map: Option<&Map>, channels| match needed {
                true => textures.number(map.map(|map| &map.texture), channels).map(Some),
                false => Ok(None),
            };
            numbers.push([number(needs.textured, skin.colour.as_ref(), 3)?, number(needs.cut, skin.cut.as_ref(), 1)?]);
        }
        let texture = |number: usize| textures.held[number].texture;
        let of_group = |([colour, cut], skin): (&[Option<usize>; 2], &Skin)| {
            [(colour, &skin.colour), (cut, &skin.cut)].map(|(number, map)| {
                let texture = texture((*number)?);
                Some(map.as_ref().map_or(Laid { texture, placed: [0.0; 4], wrap: [Wrap::Clamp; 2] }, |map| {
                    let [scale, offset] = [map.placed.scale, map.placed.offset].map(|v| v.as_vec2());
                    Laid { texture, placed: [scale.x, scale.y, offset.x, offset.y], wrap: map.placed.wrap }
                }))
            })
        };
        let groups = numbers.iter().zip(mesh.skins()).map(of_group).collect();
        textures.delete_unused(); // this changes the numbers, which are not needed any more
        Ok(Skins { gl: textures.gl.clone(), groups })
    }

    /// Binds the textures of a group, for a program that is in use.
    pub(crate) fn bind(&self, program: &Program, group: usize) {
        let Some(laid) = self.groups.get(group) else { return };
        for (unit, (names, laid)) in UNIFORMS.iter().zip(laid).enumerate() {
            let Some(Laid { texture, placed, wrap }) = laid else { continue };
            // SAFETY: the context is current and the texture ours. The pipeline has the context to itself, and binds
            // every texture again before it reads one.
            unsafe {
                self.gl.active_texture(glow::TEXTURE0 + unit as u32);
                self.gl.bind_texture(glow::TEXTURE_2D, Some(*texture));
                self.gl.bind_sampler(unit as u32, None);
            }
            program.unit(names[0], unit as u32).vec4(names[1], *placed).ivec2(names[2], wrap.map(|wrap| wrap as i32));
        }
    }
}
