//! The textures of the G-buffer. They are multisample textures if the settings ask for it and the driver can provide
//! them.

use crate::Error;
use crate::encoding::NormalEncoding;
use crate::gl::target::Attachment;
use crate::gl::{self, Format, MultisampleTexture, Renderbuffer, Target, Texture};
use crate::pass::resolve::Resolve;
use crate::pass::{DepthSamples, FullScreen, probe};
use crate::settings::{DepthFormat, NormalFormat, Settings};
use std::sync::Arc;

/// The format of colours.
const COLOUR: Format = Format::Rgba8;

/// The images that triangles are drawn into, and the images that later passes read.
pub(super) struct Targets {
    pub(super) depth: Texture,
    pub(super) normals: Texture,
    /// `None` if no image needs the colour.
    pub(super) colour: Option<Texture>,
    pub(super) encoding: NormalEncoding,
    /// The framebuffer of the textures above. It has a depth buffer only if triangles are drawn into it, and not
    /// into multisample textures.
    target: Target,
    depth_buffer: Option<Renderbuffer>,
    multisample: Option<Multisample>,
}

/// The multisample textures, and the pass that resolves them.
struct Multisample {
    /// Depth, normals and, if an image needs it, colour, in this order.
    images: Vec<MultisampleTexture>,
    samples: u32,
    target: Target,
    depth_buffer: Renderbuffer,
    resolve: Resolve,
}

impl Targets {
    /// Allocates the textures, with or without one for `colour`.
    pub(super) fn new(
        gl: &Arc<glow::Context>,
        size: (u32, u32),
        settings: &Settings,
        colour: bool,
        notices: &mut Vec<String>,
    ) -> Result<Targets, Error> {
        let depth_format = match settings.depth_format {
            DepthFormat::R32f => Format::R32f,
            DepthFormat::R16f => Format::R16f,
        };
        let (normal_format, encoding, multisample) = normal_format(gl, size, settings, depth_format, colour, notices)?;

        let (width, height) = size;
        let texture = |place, format| Texture::new(gl, place, format, width, height);
        let depth = texture("gbuffer: depth", depth_format)?;
        let normals = texture("gbuffer: normals", normal_format)?;
        let colour = colour.then(|| texture("gbuffer: colour", COLOUR)).transpose()?;
        let depth_buffer = match multisample {
            None => Some(Renderbuffer::new(gl, "gbuffer: depth buffer", glow::DEPTH_COMPONENT32F, size, 0)?),
            Some(_) => None,
        };
        let attachment = depth_buffer.as_ref().map(|buffer| (glow::DEPTH_ATTACHMENT, buffer));
        let images: Vec<&dyn Attachment> =
            [Some(&depth), Some(&normals), colour.as_ref()].into_iter().flatten().map(|image| image as _).collect();
        let target = Target::new(gl, "gbuffer: framebuffer", &images, attachment, size)?;
        Ok(Targets { depth, normals, colour, encoding, target, depth_buffer, multisample })
    }

    /// Returns the bytes of all textures and renderbuffers, as their formats and sizes say.
    pub(super) fn bytes(&self) -> u64 {
        let plain = [Some(&self.depth), Some(&self.normals), self.colour.as_ref()];
        let plain: u64 = plain.into_iter().flatten().map(Texture::bytes).sum();
        let multisample = self.multisample.as_ref().map_or(0, |multisample| {
            let images: u64 = multisample.images.iter().map(|image| image.bytes_per_sample).sum();
            u64::from(multisample.samples) * (images + multisample.depth_buffer.bytes_per_sample)
        });
        plain + multisample + self.depth_buffer.as_ref().map_or(0, |buffer| buffer.bytes_per_sample)
    }

    /// Returns the framebuffer that triangles are drawn into.
    pub(super) fn drawn(&self) -> &Target {
        self.multisample.as_ref().map_or(&self.target, |multisample| &multisample.target)
    }

    /// Returns the number of samples per pixel.
    pub(super) fn samples(&self) -> u32 {
        self.multisample.as_ref().map_or(1, |multisample| multisample.samples)
    }

    /// Returns the depth of each sample, if pixels have several.
    pub(super) fn depth_samples(&self) -> Option<DepthSamples> {
        let multisample = self.multisample.as_ref()?;
        Some(DepthSamples { texture: multisample.images[0].id, samples: multisample.samples })
    }

    /// Fills the plain textures from the multisample textures, if there are any. Depth and normals are those of sample
    /// number `which`.
    pub(super) fn resolve(&self, full_screen: &FullScreen, which: u32) {
        if let Some(multisample) = &self.multisample {
            self.target.bind();
            multisample.resolve.draw(full_screen, &multisample.images, which);
        }
    }
}

impl Multisample {
    /// Makes multisample textures with as many samples as were asked for, or with as many as the driver has. `None` if
    /// that is one.
    fn new(
        gl: &Arc<glow::Context>,
        size: (u32, u32),
        formats: &[Format],
        asked: u32,
    ) -> Result<Option<Multisample>, Error> {
        let limit = gl::sample_limit(gl);
        gl::check(gl, "the driver's limits")?;
        for samples in [8, 4, 2].into_iter().filter(|&samples| samples <= asked.min(limit)) {
            match Multisample::attachments(gl, size, formats, samples) {
                Ok((images, depth_buffer, target)) => {
                    let samples = images[0].samples("gbuffer: depth samples")?;
                    let resolve = Resolve::new(gl, samples, formats.contains(&COLOUR))?;
                    let multisample = Multisample { images, samples, target, depth_buffer, resolve };
                    return Ok(Some(multisample).filter(|multisample| multisample.samples > 1));
                }
                // Even within its limits a driver may refuse a format, or a combination of formats. Fewer samples may
                // succeed.
                Err(error) if gl::is_refusal(&error) || gl::is_out_of_memory(&error) => {}
                Err(error) => return Err(error),
            }
        }
        Ok(None)
    }

    fn attachments(
        gl: &Arc<glow::Context>,
        size: (u32, u32),
        formats: &[Format],
        asked: u32,
    ) -> Result<(Vec<MultisampleTexture>, Renderbuffer, Target), Error> {
        let places = ["gbuffer: depth samples", "gbuffer: normal samples", "gbuffer: colour samples"];
        let texture = |(place, &format)| MultisampleTexture::new(gl, place, format, size, asked);
        let images: Vec<_> = places.into_iter().zip(formats).map(texture).collect::<Result<_, Error>>()?;
        let depth_buffer = Renderbuffer::new(gl, "gbuffer: depth buffer", glow::DEPTH_COMPONENT32F, size, asked)?;
        let attachment = Some((glow::DEPTH_ATTACHMENT, &depth_buffer));
        let attached: Vec<&dyn Attachment> = images.iter().map(|image| image as _).collect();
        let target = Target::new(gl, "gbuffer: framebuffer of samples", &attached, attachment, size)?;
        Ok((images, depth_buffer, target))
    }
}

/// Chooses the format of normals: the one asked for, or else the next in this order that the driver renders to:
/// RGBA16F, then biased RGBA8. Makes the multisample textures that go with it. If the driver has multisampling, but not
/// in a format, the next format that has it is preferred.
fn normal_format(
    gl: &Arc<glow::Context>,
    size: (u32, u32),
    settings: &Settings,
    depth: Format,
    colour: bool,
    notices: &mut Vec<String>,
) -> Result<(Format, NormalEncoding, Option<Multisample>), Error> {
    let asked = settings.normal_format;
    let has_samples = settings.msaa > 1 && gl::sample_limit(gl) > 1;
    gl::check(gl, "the driver's limits")?;
    let mut first = None;
    let all = [
        (Format::Rgba8Snorm, NormalEncoding::Signed, NormalFormat::Rgba8Snorm.name()),
        (Format::Rgba16f, NormalEncoding::Signed, NormalFormat::Rgba16f.name()),
        (Format::Rgba8, NormalEncoding::Biased, "biased rgba8"),
    ];
    for (format, encoding, name) in all.into_iter().skip_while(|&(_, _, name)| name != asked.name()) {
        let normal = if encoding.is_biased() { [0.0, 0.75, 0.375] } else { [-1.0, 0.5, -0.25] };
        if !probe::renders(gl, depth, format, normal)? {
            continue;
        }
        let formats = [depth, format, COLOUR];
        let formats = if colour { &formats[..] } else { &formats[..2] };
        let multisample = Multisample::new(gl, size, formats, settings.msaa)?;
        let without_samples = has_samples && multisample.is_none();
        let found = (format, encoding, multisample, name);
        if !without_samples {
            first = Some(found);
            break;
        }
        first = first.or(Some(found));
    }
    if let Some((format, encoding, multisample, name)) = first {
        if name != asked.name() {
            notices.push(format!("this driver does not render normals in {}: {name} is used", asked.name()));
        }
        return Ok((format, encoding, multisample));
    }
    let depth = settings.depth_format.name();
    Err(Error::gl("gbuffer", format!("this driver renders no format of normals together with depth in {depth}")))
}
