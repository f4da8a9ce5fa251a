//! `--tile`: renders a part of a picture as it is in the whole picture. What its ambient occlusion is computed from is
//! rendered around it and cut off afterwards.

use super::flags::{text, valued};
use crate::picture::Kept;
use clap::{Arg, ArgMatches};
use hbao::scene::{Camera, Mesh};
use hbao::settings::Settings;
use hbao::{Error, Pipeline, Request, glow, size_limit};
use std::sync::Arc;

/// The largest width and height of a picture that is rendered in tiles. In a larger one float32 would not tell the rays
/// of neighbouring pixels apart to a hundredth of a pixel.
const LARGEST: u32 = 1 << 18;

/// What is rendered starts at multiples of this number of pixels, so that the rotation tile's 4x4 texels of half
/// resolution stay where they are in the picture.
const ALIGNED: u32 = 8;

/// A rectangle of pixels of a picture, y up.
#[derive(Clone, Copy)]
struct Window {
    left: u32,
    bottom: u32,
    width: u32,
    height: u32,
}

/// A tile of a picture.
pub(crate) struct Tile {
    /// The flag and its value.
    given: String,
    /// Width and height of the picture in pixels.
    picture: (u32, u32),
    window: Window,
}

/// What is rendered: the picture, or a tile of it with its guard band.
pub(crate) struct Region {
    /// Width and height in pixels.
    pub(crate) size: (u32, u32),
    /// The camera, whose projection is that of the region.
    pub(crate) camera: Camera,
    /// The part that is written, if not all of it is.
    pub(crate) kept: Option<Kept>,
}

/// Makes the flag `--tile`.
pub(crate) fn argument() -> Arg {
    let help = "Render only column X of N from the left and row Y of M from the top, both counted from 0, of the image that \
                --size says, as they are in that image. For images above the driver's limit, and for several machines";
    valued("tile", "X/N,Y/M", help).allow_hyphen_values(true)
}

impl Tile {
    /// Reads the value of `--tile`, for a picture of this size.
    pub(crate) fn read(matches: &ArgMatches, picture: (u32, u32)) -> Result<Option<Tile>, Error> {
        let Some(given) = text(matches, "tile") else { return Ok(None) };
        let refuse = |what: String| Err(Error::Usage(format!("--tile: '{given}' {what}")));
        let share = |text: &str| {
            let (index, count) = text.split_once('/')?;
            Some([index.trim().parse::<u32>().ok()?, count.trim().parse::<u32>().ok()?])
        };
        let shares = given.split_once(',').and_then(|(column, row)| Some([share(column)?, share(row)?]));
        let Some([column, row]) = shares else {
            return refuse("is not X/N,Y/M, a column and a row of the image such as 0/4,2/3".into());
        };
        check_size(picture)?;
        // The first pixel of each share, and the first after it.
        let mut ranges = [[0; 2]; 2];
        for (range, ([index, count], side, name)) in
            ranges.iter_mut().zip([(column, picture.0, "column"), (row, picture.1, "row")])
        {
            if index >= count {
                return refuse(match count {
                    0 => format!("has no {name}s: the second number must be at least 1"),
                    _ => format!("has no such {name}: the {count} {name}s are numbered 0 to {}", count - 1),
                });
            }
            let first = |index: u32| (u64::from(side) * u64::from(index) / u64::from(count)) as u32;
            *range = [first(index), first(index + 1)];
            if range[0] == range[1] {
                return refuse(format!("is empty: the image has {side} pixel {name}s and not {count}"));
            }
        }
        let [[left, right], [top, below]] = ranges;
        let window = Window { left, bottom: picture.1 - below, width: right - left, height: below - top };
        Ok(Some(Tile { given: format!("--tile {given}"), picture, window }))
    }

    /// Returns the tile of a picture with this lower left pixel and this size. `given` names in a message what asked
    /// for it.
    pub(crate) fn at(picture: (u32, u32), corner: (u32, u32), size: (u32, u32), given: &str) -> Tile {
        let window = Window { left: corner.0, bottom: corner.1, width: size.0, height: size.1 };
        Tile { given: given.into(), picture, window }
    }

    /// Refuses a method of which no tile can be rendered.
    pub(crate) fn check(&self, camera: &Camera, settings: &Settings) -> Result<(), Error> {
        settings.guard_band(camera.projection, self.picture, f64::INFINITY).map(|_| ()).map_err(prefixed)
    }

    /// Returns what must be rendered so that the tile is that of the whole picture, seen by `camera`. Its depth is
    /// rendered first, because the guard band depends on the nearest surface. This is done by `depths`, whose settings
    /// must have the same formats and number of samples. Without ambient occlusion there is no band.
    pub(crate) fn region(
        &self,
        gl: &glow::Context,
        mesh: &Mesh,
        camera: &Camera,
        settings: &Settings,
        depths: Option<&mut Pipeline>,
    ) -> Result<Region, Error> {
        let Some(depths) = depths else { return self.with_band(gl, camera, [0; 2]) };
        // The blur also mixes in what lies around the tile.
        let near = self.with_band(gl, camera, [settings.blur_reach(); 2])?;
        depths.resize(near.size)?;
        depths.render(mesh, &near.camera)?;
        let nearest = depths.depth()?.texels.into_iter().fold(f32::INFINITY, f32::min);
        let band = settings.guard_band(camera.projection, self.picture, nearest.into()).map_err(prefixed)?;
        self.with_band(gl, camera, band)
    }

    /// Returns the tile with this many pixels around it, up to the picture's border.
    fn with_band(&self, gl: &glow::Context, camera: &Camera, band: [u32; 2]) -> Result<Region, Error> {
        let Window { left, bottom, width, height } = self.window;
        let along = |first: u32, count: u32, band: u32, side: u32| {
            let start = first.saturating_sub(band) / ALIGNED * ALIGNED;
            [start, (first + count).saturating_add(band).min(side)]
        };
        let [x, y] = [along(left, width, band[0], self.picture.0), along(bottom, height, band[1], self.picture.1)];
        let size = (x[1] - x[0], y[1] - y[0]);
        let limit = size_limit(gl);
        if size.0.max(size.1) > limit {
            return Err(Error::Usage(format!(
                "{}: with the surroundings that its ambient occlusion depends on a tile has {}x{} pixels, and this driver takes \
                 up to {limit}x{limit}: give smaller tiles or a smaller --radius",
                self.given, size.0, size.1
            )));
        }
        let corner = (i64::from(x[0]), i64::from(y[0]));
        Ok(Region {
            size,
            camera: Camera { projection: camera.projection.part(self.picture, corner, size), ..*camera },
            kept: Some(Kept { rendered: size, corner: (left - x[0], bottom - y[0]), size: (width, height) }),
        })
    }

    /// Returns the value of the flag.
    pub(crate) fn value(&self) -> &str {
        self.given.trim_start_matches("--tile ")
    }
}

/// Makes the pipeline that renders the depth of tiles before their ambient occlusion. Its size does not matter. There
/// is none if `request` asks for no ambient occlusion.
pub(crate) fn depths(
    gl: &Arc<glow::Context>,
    settings: &Settings,
    request: Request,
) -> Result<Option<Pipeline>, Error> {
    let gbuffer = Request { gbuffer_only: true, ..Request::default() };
    (!request.gbuffer_only).then(|| Pipeline::new(gl, (8, 8), settings, gbuffer)).transpose()
}

/// Refuses a size above that of the largest picture that is rendered in tiles.
pub(crate) fn check_size((width, height): (u32, u32)) -> Result<(), Error> {
    if width.max(height) > LARGEST {
        return Err(Error::Usage(format!(
            "--size {width}x{height}: an image may have up to {LARGEST}x{LARGEST} pixels, rendered in tiles"
        )));
    }
    Ok(())
}

fn prefixed(error: Error) -> Error {
    match error {
        Error::Usage(what) => Error::Usage(format!("--tile: {what}")),
        other => other,
    }
}
