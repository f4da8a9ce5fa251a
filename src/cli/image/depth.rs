//! The depth of a picture, as its file has it, turned into what the library takes.

use super::camera::Camera;
use super::channels::Names;
use crate::cli::flags::{self, text};
use clap::{Arg, ArgMatches};
use hbao::image::{Image, Layers};
use hbao::{BACKGROUND_R32F, DepthEncoding, Error, Projection};
use std::path::{Path, PathBuf};

/// From this depth on renderers mean that nothing is there: Blender writes 1e10.
const BACKGROUND: f64 = 1e10;

/// What the samples of the channel are.
#[derive(Clone, Copy, PartialEq)]
enum DepthIs {
    /// z, or -z.
    Z {
        negative: bool,
    },
    Distance,
    Hardware,
}

const DEPTHS: [(&str, DepthIs); 4] = [
    ("z", DepthIs::Z { negative: false }),
    ("-z", DepthIs::Z { negative: true }),
    ("distance", DepthIs::Distance),
    ("hardware", DepthIs::Hardware),
];

/// The flags of depth.
pub(super) struct DepthFlags {
    pub(super) path: PathBuf,
    channel: Option<String>,
    is: DepthIs,
    background: Option<f64>,
}

/// The depth of a picture, as it is uploaded.
pub(super) struct Depth {
    pub(super) image: Image<f32>,
    pub(super) encoding: DepthEncoding,
    /// The value of pixels where nothing is.
    background: f32,
    /// Whether the file holds half floats, which are too coarse for normals to follow from them.
    pub(super) half: bool,
    /// How many times as wide as high a pixel is, as the file has it.
    pub(super) pixel_aspect: f32,
}

/// Makes the flags of depth.
pub(super) fn arguments() -> [Arg; 3] {
    [
        flags::valued(
            "depth-channel",
            "NAME",
            "The channel of depth [default: the only one, or the only Z that is no part of a vector, or Y]",
        ),
        flags::signed(
            "depth-is",
            "DEPTH",
            "What the channel holds: z is the distance from the camera's plane, -z its negative, distance is that from the \
             eye along the ray through the pixel's centre, hardware are the values of a depth buffer \
             [z, -z, distance, hardware; default: z]",
        ),
        flags::valued(
            "background",
            "Z",
            "The depth from which on nothing is there, in the unit of the channel; 0 says that depth 0 means so too; \
             infinite depth always does [0, or above 0; default: 1e10]",
        ),
    ]
}

impl DepthFlags {
    pub(super) fn read(matches: &ArgMatches) -> Result<DepthFlags, Error> {
        let background = flags::number(matches, "background")?;
        if background.is_some_and(|z| z.is_nan() || z < 0.0) {
            return Err(Error::Usage("--background must be a number of at least 0".into()));
        }
        Ok(DepthFlags {
            path: matches.get_one::<PathBuf>("depth-file").cloned().unwrap_or_default(),
            channel: text(matches, "depth-channel").map(String::from),
            is: flags::word("depth-is", text(matches, "depth-is").unwrap_or("z"), &DEPTHS)?,
            background,
        })
    }

    /// Returns whether depth is that of a depth buffer.
    pub(super) fn is_hardware(&self) -> bool {
        self.is == DepthIs::Hardware
    }

    /// Returns why --background has no effect, if it was given and has none.
    pub(super) fn idle(&self) -> Option<String> {
        let idle = self.is_hardware() && self.background.is_some();
        idle.then(|| "--background has no effect with --depth-is hardware, whose far end it is".into())
    }

    /// Reads the channel.
    pub(super) fn open(&self, camera: &Camera) -> Result<(Depth, Projection), Error> {
        let picture = Layers::open(&self.path)?;
        if picture.is_png() {
            let what = "it is a PNG, which holds no depth in scene units: give an EXR with a channel of depth";
            return Err(Error::Input { path: self.path.clone(), what: what.into() });
        }
        let channel = Names::of(&self.path, &picture).depth(self.channel.as_deref())?;
        let (half, pixel_aspect, size) = (picture.is_half(channel), picture.pixel_aspect(), picture.size());
        let projection = camera.projection((size.0 as u32, size.1 as u32))?;
        let (encoding, background) =
            if self.is_hardware() { camera.hardware()? } else { (DepthEncoding::Linear, BACKGROUND_R32F) };
        let mut planes = picture.read(&[channel], f32::INFINITY)?;
        let mut image = planes.remove(0);
        self.convert(&mut image, projection, background)
            .map_err(|what| Error::Input { path: self.path.clone(), what })?;
        Ok((Depth { image, encoding, background, half, pixel_aspect }, projection))
    }

    /// Turns samples into linear z, or leaves them the values of a depth buffer. Where nothing is they become
    /// `background`. The error says which sample cannot be meant.
    fn convert(&self, image: &mut Image<f32>, projection: Projection, background: f32) -> Result<(), String> {
        let nowhere = self.background.filter(|z| *z > 0.0).unwrap_or(BACKGROUND).min(BACKGROUND_R32F.into());
        let negative = self.is == DepthIs::Z { negative: true };
        let (width, height) = (image.width, image.height);
        let rays = Rays::new(projection, (width, height));
        let mut wrong: Option<(usize, usize, f64)> = None;
        let mut positive = false;
        for row in 0..height {
            for x in 0..width {
                let y = height - 1 - row;
                let sample = &mut image.texels[y * width + x];
                let stored = f64::from(*sample);
                let depth = if negative { -stored } else { stored };
                let empty = if self.is_hardware() {
                    stored == f64::INFINITY
                } else {
                    // Where nothing is, renderers that look along -z write either sign.
                    depth >= nowhere || negative && stored >= nowhere || depth == 0.0 && self.background == Some(0.0)
                };
                if empty {
                    *sample = background;
                    continue;
                }
                let fits = if self.is_hardware() { (0.0..=1.0).contains(&depth) } else { depth > 0.0 };
                if depth.is_nan() {
                    return Err(format!("depth is NaN{}", at(x, row)));
                }
                if !fits {
                    wrong = wrong.or(Some((x, row, stored)));
                    continue;
                }
                positive = true;
                if self.is == DepthIs::Distance {
                    *sample = (depth / rays.length(x, y)) as f32;
                } else {
                    *sample = depth as f32;
                }
            }
        }
        wrong.map_or(Ok(()), |wrong| Err(self.refusal(wrong, positive)))
    }

    /// Says why a sample cannot be meant. `positive` says whether there are others that can.
    fn refusal(&self, (x, row, stored): (usize, usize, f64), positive: bool) -> String {
        let found = format!("depth is {stored}{}", at(x, row));
        match self.is {
            DepthIs::Hardware => format!(
                "{found}, and a depth buffer has values from 0 to 1: leave out --depth-is hardware if this is depth in scene \
                 units"
            ),
            _ if stored == 0.0 => format!(
                "{found}: give --background 0 if this means that nothing is there, or --depth-is hardware if these are the \
                 values of a depth buffer"
            ),
            DepthIs::Z { negative } if !positive => {
                let (sign, other) = if negative { ("positive", "z") } else { ("negative", "-z") };
                format!("every depth is {sign}, such as {stored}: give --depth-is {other}")
            }
            _ => format!("{found}, and must be above 0 where a surface is: check --depth-is and --depth-channel"),
        }
    }
}

/// Says where a pixel is.
pub(super) fn at(x: usize, row: usize) -> String {
    format!(" at pixel {x},{row}, counted from 0,0 at the upper left")
}

impl Depth {
    /// Returns whether a surface is at a pixel, given by its index in the image.
    pub(super) fn is_covered(&self, pixel: usize) -> bool {
        self.image.texels[pixel] != self.background
    }

    /// Returns how many pixels hold a surface.
    pub(super) fn covered(&self) -> usize {
        (0..self.image.texels.len()).filter(|&pixel| self.is_covered(pixel)).count()
    }
}

/// The rays through the centres of pixels.
struct Rays {
    perspective: bool,
    /// x' and y' of the lower left corner of the picture, and what one pixel adds to them.
    corner: [f64; 2],
    pixel: [f64; 2],
}

impl Rays {
    fn new(projection: Projection, (width, height): (usize, usize)) -> Rays {
        let ([half_x, half_y], [x, y]) = (projection.half_extents(), projection.middle_at(1.0));
        let pixel = [2.0 * half_x / width as f64, 2.0 * half_y / height as f64];
        Rays { perspective: projection.is_perspective(), corner: [x - half_x, y - half_y], pixel }
    }

    /// Returns the length of r = (x', y', 1), or 1 in an orthographic view, whose rays are parallel. y is up.
    fn length(&self, x: usize, y: usize) -> f64 {
        if !self.perspective {
            return 1.0;
        }
        let along = |axis: usize, at: usize| self.corner[axis] + self.pixel[axis] * (at as f64 + 0.5);
        (1.0 + along(0, x).powi(2) + along(1, y).powi(2)).sqrt()
    }
}

/// Returns the name of a file without its folder.
pub(super) fn name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}
