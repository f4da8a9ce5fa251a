//! The textures of a mesh, as the G-buffer's shader reads them: level 0 of plain two-dimensional textures.

use crate::Error;
use crate::gl::{Program, check, not_made};
use crate::scene::{Map, Mesh};
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

/// The textures of a mesh, uploaded to OpenGL.
pub(crate) struct Skins {
    gl: Arc<glow::Context>,
    needs: Needs,
    /// The textures, and what each holds.
    textures: Vec<(glow::Texture, Held)>,
    /// For each group of the mesh, the textures that the shader reads: their numbers, and how they are laid.
    groups: Vec<Vec<Laid>>,
}

/// What a texture holds: its number of channels, and the address of its texels, or none if it is a single white texel.
type Held = (usize, Option<*const u8>);

/// A texture that the shader reads: its number, the scale and offset of its coordinates, and whether it is clamped.
type Laid = (usize, [f32; 4], bool);

/// The uniforms of each texture that the shader may read, in the order of the units.
const UNIFORMS: [[&str; 3]; 2] =
    [["colour_map", "colour_placed", "colour_clamped"], ["cut_map", "cut_placed", "cut_clamped"]];

impl Skins {
    /// Uploads the textures that are needed.
    pub(crate) fn upload(gl: &Arc<glow::Context>, mesh: &Mesh, needs: Needs) -> Result<Skins, Error> {
        let mut skins = Skins { gl: gl.clone(), needs, textures: Vec::new(), groups: Vec::new() };
        for skin in mesh.skins().iter().filter(|_| needs.textured || needs.cut) {
            let maps = [(needs.textured, skin.colour.as_ref(), 3), (needs.cut, skin.cut.as_ref(), 1)];
            let mut laid = Vec::new();
            for (needed, map, channels) in maps {
                laid.push(if needed { skins.laid(map, channels)? } else { (0, [0.0; 4], false) });
            }
            skins.groups.push(laid);
        }
        Ok(skins)
    }

    /// Uploads a texture, if it is not there yet. Without one this is a single white or opaque texel.
    fn laid(&mut self, map: Option<&Map>, channels: usize) -> Result<Laid, Error> {
        let Some(Map { texture, placed }) = map else {
            return Ok((self.texture(&[255; 3][..channels], (1, 1), (channels, None))?, [0.0; 4], true));
        };
        let (width, height) = (texture.width, texture.height);
        // SAFETY: the context is current.
        let limit = unsafe { self.gl.get_parameter_i32(glow::MAX_TEXTURE_SIZE) }.max(0) as u32;
        if width.max(height) > limit {
            return Err(Error::gl(
                "gbuffer",
                format!(
                    "the texture {} has {width}x{height} texels, and this driver takes {limit}x{limit}: scale it down",
                    Error::shown(&texture.name)
                ),
            ));
        }
        let number = self.texture(&texture.texels, (width, height), (channels, Some(texture.texels.as_ptr())))?;
        let [scale, offset] = [placed.scale, placed.offset].map(|v| v.as_vec2());
        Ok((number, [scale.x, scale.y, offset.x, offset.y], placed.clamp))
    }

    fn texture(&mut self, texels: &[u8], (width, height): (u32, u32), held: Held) -> Result<usize, Error> {
        if let Some(number) = self.textures.iter().position(|(_, known)| *known == held) {
            return Ok(number);
        }
        let gl = &self.gl;
        let (internal, format) = if held.0 == 3 { (glow::RGB8, glow::RGB) } else { (glow::R8, glow::RED) };
        // SAFETY: the context is current, and `texels` holds `width * height` texels without padding between rows.
        unsafe {
            let texture = gl.create_texture().map_err(|_| not_made(gl, PLACE))?;
            self.textures.push((texture, held));
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
        check(gl, PLACE)?;
        Ok(self.textures.len() - 1)
    }

    /// Binds the textures of a group, for a program that is in use.
    pub(crate) fn bind(&self, program: &Program, group: usize) {
        let Some(laid) = self.groups.get(group) else { return };
        let needed = [self.needs.textured, self.needs.cut];
        for (unit, (names, (number, placed, clamped))) in UNIFORMS.iter().zip(laid).enumerate() {
            if !needed[unit] {
                continue;
            }
            // SAFETY: the context is current and the texture ours. The pipeline has the context to itself, and binds
            // every texture again before it reads one.
            unsafe {
                self.gl.active_texture(glow::TEXTURE0 + unit as u32);
                self.gl.bind_texture(glow::TEXTURE_2D, Some(self.textures[*number].0));
                self.gl.bind_sampler(unit as u32, None);
            }
            program.unit(names[0], unit as u32).vec4(names[1], *placed).int(names[2], i32::from(*clamped));
        }
    }
}

impl Drop for Skins {
    fn drop(&mut self) {
        // SAFETY: the textures are ours, and the context is current by the contract of `gl`.
        unsafe { self.textures.iter().for_each(|(texture, _)| self.gl.delete_texture(*texture)) };
    }
}
