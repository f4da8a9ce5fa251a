//! The materials of a glTF file: the base colour, its texture, and where alpha cuts the surface away.

use super::data::{Data, Picture};
use super::json::{AlphaMode, Material, Root, TextureInfo};
use crate::Error;
use crate::scene::mtl::WHITE;
use crate::scene::notices::{Kind, Notices};
use crate::scene::texture::{self, Map, Pictures, Placed, Skin, Wrap};
use glam::DVec2;
use image::DynamicImage;
use std::collections::HashMap;
use std::io::Cursor;

/// Surfaces with less alpha are cut away, unless a material says otherwise.
const CUTOFF: f64 = 0.5;

/// How a material looks.
#[derive(Clone, Default)]
pub(super) struct Look {
    pub(super) colour: [f32; 3],
    pub(super) skin: Skin,
    /// The texture coordinates that the skin is laid by, if it has a texture.
    pub(super) coordinates: Option<Coordinates>,
    /// False if the surface is left out.
    pub(super) visible: bool,
    /// The alpha without that of the texture and of the vertices.
    pub(super) alpha: f64,
    /// The least alpha that is not cut away.
    pub(super) least_alpha: f64,
}

/// Which texture coordinates a texture is laid by, and how they are transformed (`KHR_texture_transform`).
#[derive(Clone, Copy)]
pub(super) struct Coordinates {
    pub(super) set: u32,
    offset: DVec2,
    rotation: f64,
    scale: DVec2,
}

impl Coordinates {
    fn of(info: &TextureInfo) -> Coordinates {
        let transform = info.extensions.transform.as_deref();
        Coordinates {
            set: transform.and_then(|transform| transform.tex_coord).unwrap_or(info.tex_coord),
            offset: transform.map_or(DVec2::ZERO, |transform| transform.offset.into()),
            rotation: transform.map_or(0.0, |transform| transform.rotation),
            scale: transform.map_or(DVec2::ONE, |transform| transform.scale.into()),
        }
    }

    /// Returns the place in a texture, with v up. In glTF v points down.
    ///
    /// The rotation is counterclockwise as it is seen with v down. The listing in the extension's text turns the other
    /// way; its words, its example and all viewers turn this way (github.com/KhronosGroup/glTF, issue 1563).
    pub(super) fn placed(self, at: DVec2) -> DVec2 {
        let (sine, cosine) = (libm::sin(self.rotation), libm::cos(self.rotation));
        let DVec2 { x, y } = at * self.scale;
        let turned = DVec2::new(cosine * x + sine * y, cosine * y - sine * x) + self.offset;
        DVec2::new(turned.x, 1.0 - turned.y)
    }
}

/// The materials of a file. Each is read when it is first needed.
pub(super) struct Materials<'a> {
    root: &'a Root,
    pictures: Pictures,
    looks: HashMap<u32, Look>,
}

impl<'a> Materials<'a> {
    pub(super) fn new(root: &'a Root) -> Materials<'a> {
        Materials { root, pictures: Pictures::default(), looks: HashMap::new() }
    }

    /// Returns how a material looks. What cannot be read of it is told to `notices`, in lines that `notice` makes.
    ///
    /// # Errors
    /// There is no such material.
    pub(super) fn look(
        &mut self,
        number: Option<u32>,
        data: &mut Data,
        notices: &mut Notices,
        notice: &dyn Fn(String) -> String,
    ) -> Result<Look, String> {
        let Some(number) = number else {
            let least_alpha = f64::NEG_INFINITY;
            return Ok(Look { colour: WHITE, visible: true, least_alpha, ..Look::default() });
        };
        if let Some(look) = self.looks.get(&number) {
            return Ok(look.clone());
        }
        let material = self.root.materials.get(number as usize);
        let material = material.ok_or_else(|| format!("there is no material {number}"))?;
        let look = self.read(number, material, data, notices, notice);
        self.looks.insert(number, look.clone());
        Ok(look)
    }

    fn read(
        &mut self,
        number: u32,
        material: &Material,
        data: &mut Data,
        notices: &mut Notices,
        notice: &dyn Fn(String) -> String,
    ) -> Look {
        let called = match material.name.as_deref() {
            Some(name) => format!("material {number} '{}'", Error::shown(name)),
            None => format!("material {number}"),
        };
        let surface = &material.pbr_metallic_roughness;
        let (factor, texture) = match &material.extensions.specular_glossiness {
            Some(surface) => (&surface.diffuse_factor, &surface.diffuse_texture),
            None => (&surface.base_color_factor, &surface.base_color_texture),
        };
        let [r, g, b, alpha] = factor.as_deref().copied().unwrap_or([1.0; 4]);
        // The least alpha that is not cut.
        let least = match material.alpha_mode {
            AlphaMode::Mask => material.alpha_cutoff.unwrap_or(CUTOFF),
            AlphaMode::Blend => CUTOFF,
            AlphaMode::Opaque | AlphaMode::Other => f64::NEG_INFINITY,
        };
        let mut look =
            Look { colour: [r, g, b].map(encoded), visible: true, alpha, least_alpha: least, ..Look::default() };
        if let Some(info) = texture {
            match self.skin(info, alpha, least, data) {
                Ok(skin) => (look.skin, look.coordinates) = (skin, Some(Coordinates::of(info))),
                Err(why) => notices.add(Kind::Picture, || notice(format!("{called}: {why}"))),
            }
        }
        if look.coordinates.is_none() && alpha < least {
            look.visible = false;
            notices.add(Kind::Invisible, || notice(format!("{called}: alpha {alpha} is below {least}")));
        } else if material.alpha_mode == AlphaMode::Blend {
            notices.add(Kind::Blend, || notice(format!("{called}: its alphaMode is BLEND")));
        }
        look
    }

    /// Reads the texture of a base colour, whose alpha is multiplied by `factor`, and cuts below `least`.
    fn skin(&mut self, info: &TextureInfo, factor: f64, least: f64, data: &mut Data) -> Result<Skin, String> {
        let (root, index) = (self.root, info.index);
        let of = root.textures.get(index as usize).ok_or_else(|| format!("there is no texture {index}"))?;
        let Some(source) = of.source else {
            return Err(format!("texture {index} has no PNG or JPEG picture; export the textures as PNG"));
        };
        let image = root.images.get(source as usize).ok_or_else(|| format!("there is no image {source}"))?;
        let sampler = of.sampler.and_then(|sampler| root.samplers.get(sampler as usize));
        let wrap = |of: Option<u32>| match of {
            Some(33_071) => Wrap::Clamp,
            Some(33_648) => Wrap::Mirror,
            _ => Wrap::Repeat,
        };
        let placed = Placed {
            scale: DVec2::ONE,
            offset: DVec2::ZERO,
            wrap: [wrap(sampler.and_then(|of| of.wrap_s)), wrap(sampler.and_then(|of| of.wrap_t))],
        };
        let name = format!("image {source}");
        let mut made = |how: String, make: &dyn Fn(&DynamicImage) -> Option<texture::Texture>| {
            let decode = || match data.picture(image).map_err(|what| format!("{name}: {what}"))? {
                Picture::File(path, shown) => texture::decode(&path).map_err(|why| format!("{name}: {shown} {why}")),
                Picture::Bytes(bytes, within) => {
                    texture::decode_from(Cursor::new(&bytes[within]), false).map_err(|why| format!("{name} {why}"))
                }
            };
            let texture = self.pictures.texture(&name, how, decode, make)?;
            Ok::<_, String>(texture.map(|texture| Map { texture, placed }))
        };
        let colour =
            made("colours".into(), &|image| Some(texture::colours(image, texture::Reading::PLAIN, name.clone())))?;
        let is_cut = |alpha: u8| factor * f64::from(alpha) / 255.0 < least;
        let cut = match least > f64::NEG_INFINITY {
            true => made(format!("alpha {factor} {least}"), &|image| texture::cut_where(image, is_cut, name.clone()))?,
            false => None,
        };
        Ok(Skin { colour, cut })
    }
}

/// Converts a linear colour as glTF has it to one that is shown as it is, as `Kd` is: by the curve of sRGB. Textures
/// are in sRGB already. The two are multiplied as they are shown, which differs a little from the product of the linear
/// colours.
pub(super) fn encoded(linear: f64) -> f32 {
    let x = if linear >= 0.0 { linear.min(1.0) } else { 0.0 }; // NaN is 0
    let encoded = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * libm::pow(x, 1.0 / 2.4) - 0.055 };
    (encoded as f32).clamp(0.0, 1.0)
}
