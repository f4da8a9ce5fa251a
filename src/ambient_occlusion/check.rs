//! Refuses inputs with which a result could be computed, but a meaningless one.

use super::inputs::{Inputs, Viewport};
use super::programs::InputKind;
use crate::Error;
use crate::encoding::{Curve, NormalEncoding};
use crate::gl;
use crate::pass::linear_depth::{SamplesInput, SamplesVariant};
use crate::pass::method::{NormalsInput, NormalsVariant};
use crate::pass::{BACKGROUND_R32F, DepthInput, ImageVariant, Part, TextureTarget};
#[cfg(doc)]
use crate::projection::Projection;
use crate::settings::Method;
use glow::HasContext;

/// Inputs that hold nothing that cannot be right, as passes read them.
pub(super) struct Checked {
    /// The texture of depth, which may still be encoded.
    pub(super) depth: DepthInput,
    pub(super) curve: Curve,
    /// The precision of the stored depth.
    pub(super) precision: Precision,
    /// `None` if normals are rebuilt from depth.
    pub(super) normals: Option<NormalsInput>,
    pub(super) samples: Option<SamplesInput>,
}

impl Checked {
    /// Returns the properties of the inputs that programs are compiled for. `edges` says whether the caller asks which
    /// pixels are edges.
    pub(super) fn kind(&self, inputs: &Inputs, edges: bool) -> InputKind {
        let viewport = inputs.viewport.is_some();
        let depth = ImageVariant::new(inputs.depth.target, viewport);
        let multisample = matches!(inputs.depth.target, TextureTarget::Multisample(_));
        let encoded = (self.curve != Curve::Linear || multisample).then(|| (depth, self.curve.into()));
        InputKind {
            perspective: inputs.projection.is_perspective(),
            encoded,
            depth: if encoded.is_some() { ImageVariant::RECTANGLE } else { depth },
            normals: self.normals_variant(inputs),
            samples: self.samples.map(|samples| SamplesVariant {
                count: samples.image.samples,
                curve: self.curve.into(),
                viewport,
            }),
            edges,
        }
    }

    /// Returns how shaders read the normals.
    pub(super) fn normals_variant(&self, inputs: &Inputs) -> NormalsVariant {
        self.normals.map_or(NormalsVariant::Rebuilt, |normals| NormalsVariant::Given {
            image: ImageVariant::new(normals.image.target, inputs.viewport.is_some()),
            encoding: inputs.normal_encoding,
            turned: normals.to_eye.is_some(),
        })
    }
}

/// How precisely a format stores a depth d: whether it is a float format, and the number of bits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Precision {
    pub(super) float: bool,
    pub(super) bits: i32,
}

/// The types of channels whose numbers need not be whole.
const FRACTIONS: [u32; 3] = [glow::FLOAT, glow::UNSIGNED_NORMALIZED, glow::SIGNED_NORMALIZED];

/// What OpenGL tells of a texture.
pub(super) struct Found {
    size: (u32, u32),
    samples: u32,
    layers: u32,
    depth_bits: i32,
    depth_type: u32,
    red_bits: i32,
    red_type: u32,
    blue_bits: i32,
    alpha_bits: i32,
    alpha_type: u32,
}

impl Found {
    /// Binds the texture to the active unit and queries it. `name` names it in errors.
    pub(super) fn of(
        gl: &glow::Context,
        name: &str,
        texture: glow::Texture,
        target: TextureTarget,
    ) -> Result<Found, Error> {
        // SAFETY: the context is current.
        let exists = unsafe { gl.is_texture(texture) };
        check(gl, name, "")?;
        if !exists {
            return usage(format!(
                "{name}: there is no texture {}: a renderbuffer is none, attach a texture in its place",
                texture.0
            ));
        }
        let kind = target.gl();
        // SAFETY: the context is current; to bind a texture of another kind is a GL error without further effect, and
        // these are core parameters.
        let found = unsafe {
            gl.bind_texture(kind, Some(texture));
            check(gl, name, " is not of the declared kind")?;
            let parameter = |parameter| gl.get_tex_level_parameter_i32(kind, 0, parameter);
            let count = |value: i32| value.max(0) as u32;
            Found {
                size: (count(parameter(glow::TEXTURE_WIDTH)), count(parameter(glow::TEXTURE_HEIGHT))),
                samples: count(parameter(glow::TEXTURE_SAMPLES)),
                layers: count(parameter(glow::TEXTURE_DEPTH)),
                depth_bits: parameter(glow::TEXTURE_DEPTH_SIZE),
                depth_type: count(parameter(glow::TEXTURE_DEPTH_TYPE)),
                red_bits: parameter(glow::TEXTURE_RED_SIZE),
                red_type: count(parameter(glow::TEXTURE_RED_TYPE)),
                blue_bits: parameter(glow::TEXTURE_BLUE_SIZE),
                alpha_bits: parameter(glow::TEXTURE_ALPHA_SIZE),
                alpha_type: count(parameter(glow::TEXTURE_ALPHA_TYPE)),
            }
        };
        check(gl, name, "'s size")?;
        match target {
            TextureTarget::Layer(layer) if layer >= found.layers => {
                return usage(format!("{name}: there is no layer {layer}, the texture has {}", found.layers));
            }
            // The number of samples is compiled into the shaders, so it must be that of the texture.
            TextureTarget::Multisample(samples) if samples != found.samples => {
                return usage(format!(
                    "the {name} texture has {} samples per pixel, but {samples} were declared",
                    found.samples
                ));
            }
            _ => {}
        }
        Ok(found)
    }

    /// Returns whether the red channel holds numbers that need not be whole.
    pub(super) fn holds_fractions(&self) -> bool {
        self.red_bits > 0 && FRACTIONS.contains(&self.red_type)
    }

    /// Returns whether there is an alpha channel with such numbers.
    pub(super) fn has_alpha(&self) -> bool {
        self.alpha_bits > 0 && FRACTIONS.contains(&self.alpha_type)
    }

    /// Returns which part of the texture the view is, or an error if it does not fit. `size` is the size of the view.
    pub(super) fn part(
        &self,
        name: &str,
        viewport: Option<Viewport>,
        (w, h): (u32, u32),
    ) -> Result<Option<Part>, Error> {
        let (width, height) = self.size;
        match viewport {
            None if self.size == (w, h) => Ok(None),
            None => usage(format!(
                "the {name} texture has {width}x{height} texels, but ambient occlusion is set up for {w}x{h}"
            )),
            Some(Viewport { x, y, .. }) => {
                let inside = |from: u32, length: u32, of: u32| from.checked_add(length).is_some_and(|end| end <= of);
                if inside(x, w, width) && inside(y, h, height) {
                    return Ok(Some(Part { corner: (x, y), texture: self.size }));
                }
                usage(format!(
                    "the viewport of {w}x{h} at {x},{y} reaches past the {name} texture, which has {width}x{height} texels"
                ))
            }
        }
    }

    /// Returns the precision of depth, or an error if the format cannot hold depth of this kind.
    fn depth_precision(&self, name: &str, curve: Curve) -> Result<Precision, Error> {
        match (curve, self.depth_bits, self.red_type) {
            (Curve::Linear, 1.., _) => usage(format!(
                "the {name} texture has a depth format, which holds no linear depth: say in depth_encoding what it holds"
            )),
            (Curve::Linear, _, glow::FLOAT) => Ok(Precision { float: true, bits: self.red_bits }),
            (Curve::Linear, ..) => {
                usage(format!("the {name} texture needs a float format to hold linear depth, such as R32F"))
            }
            (_, bits @ 1.., _) => Ok(Precision { float: self.depth_type == glow::FLOAT, bits }),
            // An application may have copied its depth buffer.
            (_, _, red @ (glow::FLOAT | glow::UNSIGNED_NORMALIZED)) => {
                Ok(Precision { float: red == glow::FLOAT, bits: self.red_bits })
            }
            _ => usage(format!("the {name} texture has a format that holds no depth")),
        }
    }
}

/// Returns an OpenGL error, if there is one, at the place "the NAME texture" and what follows. The place is put
/// together only if there is one, because nothing is allocated in a frame without errors.
fn check(gl: &glow::Context, name: &str, then: &str) -> Result<(), Error> {
    match gl::error(gl) {
        None => Ok(()),
        Some(code) => Err(gl::described(&format!("the {name} texture{then}"), code)),
    }
}

pub(super) fn usage<T>(what: String) -> Result<T, Error> {
    Err(Error::Usage(what))
}

/// Returns whether the texture is set to be read as its stencil values. OpenGL can be asked since version 4.3, which
/// brought this mode.
fn reads_stencil(gl: &glow::Context, name: &str, target: TextureTarget) -> Result<bool, Error> {
    let version = gl.version();
    if version.is_embedded || (version.major, version.minor) < (4, 3) {
        return Ok(false);
    }
    // SAFETY: the context is current, and the texture bound.
    let mode = unsafe { gl.get_tex_parameter_i32(target.gl(), glow::DEPTH_STENCIL_TEXTURE_MODE) };
    check(gl, name, "'s mode")?;
    Ok(mode as u32 == glow::STENCIL_INDEX)
}

impl Inputs {
    /// Refuses inputs that cannot be right, and returns them as passes read them. `size` is the size of the view.
    ///
    /// # Errors
    /// [`Error::Usage`] for what [`Projection::check`] refuses, for planes or a matrix that no depth buffer has, for a
    /// near plane that `ray-march` cannot use, and for a texture whose size, format or number of samples cannot be
    /// meant. [`Error::Gl`] for a texture of another kind.
    pub(super) fn check(&self, gl: &glow::Context, size: (u32, u32), method: Method) -> Result<Checked, Error> {
        self.projection.check()?;
        let curve = self.depth_encoding.curve(self.projection.is_perspective())?;
        let near = self.near_plane();
        if method.facts().reads_near && (near.is_nan() || near <= 0.0) {
            return usage(format!(
                "{} ends its rays at the near plane: near must be above 0, not {near}",
                method.name(),
            ));
        }
        if let Some(Viewport { width, height, .. }) = self.viewport.filter(|part| (part.width, part.height) != size) {
            let (w, h) = size;
            return usage(format!(
                "the viewport has {width}x{height} pixels, but ambient occlusion is set up for {w}x{h}"
            ));
        }
        let (depth, precision) = self.check_depth(gl, "depth", self.depth.texture, self.depth.target, curve, size)?;
        let depth = DepthInput {
            image: self.depth,
            background: if curve == Curve::Linear { self.background } else { BACKGROUND_R32F },
            size,
            part: depth,
        };
        let normals = match self.normals {
            Some(image) => {
                let found = Found::of(gl, "normals", image.texture, image.target)?;
                let part = found.part("normals", self.viewport, size)?;
                check_normals(&found, self.normal_encoding)?;
                Some(NormalsInput { image, part, to_eye: self.normal_space.to_eye()? })
            }
            None => None,
        };
        if let Some(samples) = self.samples {
            let target = TextureTarget::Multisample(samples.samples);
            if matches!(self.depth.target, TextureTarget::Multisample(_)) {
                return usage("depth is a multisample texture, so that samples must be None".into());
            }
            self.check_depth(gl, "samples", samples.texture, target, curve, size)?;
        }
        let viewport = self.viewport.map(|viewport| [(viewport.x, viewport.y), size]);
        let samples = self.depth_samples().map(|image| SamplesInput { image, curve, viewport });
        Ok(Checked { depth, curve, precision, normals, samples })
    }

    /// Checks a texture of depth.
    fn check_depth(
        &self,
        gl: &glow::Context,
        name: &str,
        texture: glow::Texture,
        target: TextureTarget,
        curve: Curve,
        size: (u32, u32),
    ) -> Result<(Option<Part>, Precision), Error> {
        let found = Found::of(gl, name, texture, target)?;
        let part = found.part(name, self.viewport, size)?;
        let precision = found.depth_precision(name, curve)?;
        if found.depth_bits > 0 && reads_stencil(gl, name, target)? {
            return usage(format!(
                "the {name} texture is read as its stencil: set its GL_DEPTH_STENCIL_TEXTURE_MODE to GL_DEPTH_COMPONENT"
            ));
        }
        Ok((part, precision))
    }
}

/// Refuses a format that cannot hold normals of this encoding.
fn check_normals(found: &Found, encoding: NormalEncoding) -> Result<(), Error> {
    let refuse = |what: &str| usage(format!("the normals texture has {what}"));
    match found.red_type {
        glow::FLOAT | glow::SIGNED_NORMALIZED => {}
        glow::UNSIGNED_NORMALIZED if encoding.is_biased() => {}
        glow::UNSIGNED_NORMALIZED => {
            return refuse(
                "a format without negative numbers: say that its encoding is biased, or use a signed format",
            );
        }
        _ => return refuse("a format that holds no normals"),
    }
    if found.blue_bits == 0 && !encoding.is_octahedral() {
        return refuse("no third channel: only an octahedral encoding has two");
    }
    Ok(())
}
