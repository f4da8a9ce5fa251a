//! Pictures above the driver's limit: rendered in tiles, of which one row at a time is kept, and written to a PNG as
//! they are finished. So the memory that is needed does not depend on the picture's height, unless the PNG goes to
//! standard output, which gets nothing before all of it is there.

use super::flags::{Flags, Opened, valued};
use super::tile::{self, Region, Tile};
use super::unmeant;
use crate::picture::{EightBit, ImageKind, Kept};
use crate::terminal::{bar, say};
use clap::{Arg, ArgMatches};
use hbao::context::Context;
use hbao::image::{Image, Outputs, png};
use hbao::settings::Settings;
use hbao::{Error, Pipeline, Request, size_limit};
use indicatif::ProgressBar;
use std::io::Write;
use std::path::Path;

/// The width and height of what is rendered at a time, if the surroundings of a tile leave enough of it.
const REGION: u32 = 4096;
/// The least width and height of a tile, if the driver's limit leaves as much.
const TILE: u32 = 1024;
/// Tiles smaller than this would cost far more than the picture.
const LEAST: u32 = 64;
/// The most bytes of a row of tiles that are kept.
const MOST_BYTES: u64 = 1 << 28;
/// The longest side of the small picture from which the depth of the nearest surface is estimated.
const SMALL: u32 = 1024;

/// What is rendered.
pub(super) struct Poster<'a> {
    pub(super) context: &'a Context,
    pub(super) flags: &'a Flags,
    pub(super) opened: &'a Opened,
    pub(super) settings: &'a Settings,
    pub(super) request: Request,
    pub(super) show: &'static ImageKind,
    /// The value of `--tile-size`.
    pub(super) side: Option<u32>,
    /// A pipeline of any size, for these settings and this request.
    pub(super) pipeline: &'a mut Pipeline,
}

/// The tiles of a picture.
struct Plan {
    /// The width and height of a tile. Those at the right and at the bottom may be smaller.
    tile: (u32, u32),
    /// The pixels around each tile that its ambient occlusion depends on, across and upright.
    bands: Vec<[u32; 2]>,
}

/// Makes the flag `--tile-size`.
pub(super) fn argument() -> Arg {
    let help = "Render the image in tiles of at most N by N pixels, and write it to a PNG row by row, so that it needs little \
                memory; a PNG to standard output is kept in memory until it is complete [64 to 65536; default: in one piece, or \
                in tiles above the driver's limit]";
    valued("tile-size", "N", help).conflicts_with("tile")
}

/// Reads the value of `--tile-size`.
pub(super) fn read(matches: &ArgMatches) -> Result<Option<u32>, Error> {
    let Some(given) = super::flags::text(matches, "tile-size") else { return Ok(None) };
    let side = given.parse().ok().filter(|side| (LEAST..=65536).contains(side));
    side.map(Some)
        .ok_or_else(|| Error::Usage(format!("--tile-size: '{given}' is not a whole number from {LEAST} to 65536")))
}

impl Poster<'_> {
    /// Renders the picture, and writes it to a PNG with this text.
    pub(super) fn write(&mut self, output: &Path, text: &[(&str, &str)]) -> Result<(), Error> {
        let (width, height) = self.flags.size;
        let Plan { tile, bands } = self.plan()?;
        let rows = height.div_ceil(tile.1);
        let progress = bar(u64::from(rows) * u64::from(width.div_ceil(tile.0)), "tiles");
        let mut dark = false;
        let mut outputs = Outputs::new();
        outputs.stage_by(output, |to| {
            let mut strip = |row: u32| self.strip(row, tile, &bands, &mut dark, &progress);
            let first = strip(0)?;
            let size = if first.half { (width.div_ceil(2), height.div_ceil(2)) } else { (width, height) };
            png::encode_rows(output, to, size, first.components, text, |to| {
                first.write(output, to)?;
                (1..rows).try_for_each(|row| strip(row)?.write(output, to))
            })
        })?;
        progress.finish_and_clear();
        if self.makes_ao() && !dark {
            let open = unmeant::open(&Image::filled(1, 1, 1.0), self.settings, self.settings.method.reads("radius"));
            open.iter().for_each(|notice| say(notice));
        }
        outputs.commit()
    }

    /// Chooses the size of the tiles, and finds what the ambient occlusion of each depends on around it, before the
    /// first is rendered: row by row from the top, from left to right. The first choice follows from a small picture,
    /// in which a surface may be missed that is the nearest one of a tile.
    fn plan(&mut self) -> Result<Plan, Error> {
        let width = u64::from(self.flags.size.0);
        let shape = |side: u32| {
            let high = (MOST_BYTES / (3 * width)).clamp(u64::from(LEAST), u64::from(side)) as u32;
            (side / 8 * 8, high / 8 * 8)
        };
        let side = self.side()?;
        divided(side, |side| Ok(Plan { tile: shape(side), bands: self.bands(shape(side))? }))
    }

    /// Returns the bands around tiles of this size. The error is that of a tile that is too large with its band.
    fn bands(&self, tile: (u32, u32)) -> Result<Vec<[u32; 2]>, Error> {
        let (gl, camera) = (self.context.gl(), &self.opened.camera);
        let (width, height) = self.flags.size;
        let windows = (0..height.div_ceil(tile.1))
            .flat_map(|row| (0..width).step_by(tile.0 as usize).map(move |left| (row, left)));
        let bands = windows.map(|(row, left)| {
            let (corner, size) = self.window(row, left, tile);
            let tile = Tile::at(self.flags.size, corner, size, &self.given());
            let band = tile.band(gl, &self.opened.scene.mesh, camera, self.settings, self.request)?;
            tile.with_band(gl, camera, band).map(|_| band)
        });
        bands.collect()
    }

    /// Returns the lower left pixel and the size of the tile of a row, counted from the top, that begins at a column.
    fn window(&self, row: u32, left: u32, tile: (u32, u32)) -> ((u32, u32), (u32, u32)) {
        let (width, height) = self.flags.size;
        let top = height - row * tile.1;
        let bottom = top.saturating_sub(tile.1);
        ((left, bottom), (tile.0.min(width - left), top - bottom))
    }

    /// Renders a row of tiles, counted from the top. `dark` becomes true if anything occludes.
    fn strip(
        &mut self,
        row: u32,
        tile: (u32, u32),
        bands: &[[u32; 2]],
        dark: &mut bool,
        progress: &ProgressBar,
    ) -> Result<Strip, Error> {
        let width = self.flags.size.0;
        let bands = bands.iter().skip((row * width.div_ceil(tile.0)) as usize);
        let mut strip = Strip::default();
        for (left, &band) in (0..width).step_by(tile.0 as usize).zip(bands) {
            let (corner, size) = self.window(row, left, tile);
            let (part, half) = self.render(corner, size, band, dark)?;
            strip.add(part, half);
            progress.inc(1);
        }
        Ok(strip)
    }

    fn makes_ao(&self) -> bool {
        !self.request.gbuffer_only && self.settings.method.computes()
    }

    /// Renders a tile, and returns it and whether it has half resolution. `dark` becomes true if anything occludes.
    fn render(
        &mut self,
        corner: (u32, u32),
        size: (u32, u32),
        band: [u32; 2],
        dark: &mut bool,
    ) -> Result<(EightBit, bool), Error> {
        let (mesh, camera) = (&self.opened.scene.mesh, &self.opened.camera);
        let tile = Tile::at(self.flags.size, corner, size, &self.given());
        let Region { size, camera, kept } = tile.with_band(self.context.gl(), camera, band)?;
        self.pipeline.resize(size)?;
        self.pipeline.restrict(kept.as_ref().map(Kept::part));
        self.pipeline.render(mesh, &camera)?;
        if self.makes_ao() && !*dark {
            *dark = self.pipeline.ao()?.texels.iter().any(|&a| a < 1.0);
        }
        let pixels = self.show.pixels(self.pipeline, self.settings)?;
        let half = pixels.width() != size.0 as usize;
        Ok((kept.map_or_else(|| pixels.eight_bit(), |kept| pixels.part(&kept).eight_bit()), half))
    }

    /// What asked for tiles, for a message.
    fn given(&self) -> String {
        let (width, height) = self.flags.size;
        self.side.map_or_else(|| format!("--size {width}x{height}"), |side| format!("--tile-size {side}"))
    }

    /// Returns the longest side of a tile, after a look at the whole view in a small picture.
    fn side(&mut self) -> Result<u32, Error> {
        let (width, height) = self.flags.size;
        tile::check_size((width, height))?;
        let Opened { scene, camera, empty, .. } = self.opened;
        let scale = width.max(height).div_ceil(SMALL);
        let small = (width.div_ceil(scale), height.div_ceil(scale));
        let gbuffer = Request { gbuffer_only: true, ..Request::default() };
        let mut pipeline = Pipeline::new(self.context.gl(), small, self.settings, gbuffer)?;
        pipeline.render(&scene.mesh, camera)?;
        let nearest = pipeline.depth()?.texels.into_iter().fold(f32::INFINITY, f32::min);
        if nearest.is_infinite() && !empty {
            say(&unmeant::empty(self.flags, &scene.mesh, camera));
        }
        let band = match self.request.gbuffer_only {
            true => 0,
            false => {
                let band = self.settings.guard_band(camera.projection, (width, height), nearest.into())?;
                band.into_iter().max().unwrap_or(0)
            }
        };
        let limit = size_limit(self.context.gl());
        // What a tile needs around it, and what its start may be rounded down by.
        let around = band.saturating_mul(2).saturating_add(16);
        let side =
            self.side.unwrap_or_else(|| REGION.saturating_sub(around).max(TILE)).min(limit.saturating_sub(around));
        if side < LEAST {
            return Err(Error::Usage(format!(
                "{}: the ambient occlusion of a tile depends on {band} pixels around it, and this driver takes up to \
                 {limit}x{limit}: give a smaller --radius or a smaller --size",
                self.given()
            )));
        }
        Ok(side)
    }
}

/// Returns what `plan` makes of tiles with this side, or of half as long ones as long as it refuses them, down to the
/// least.
fn divided<T>(mut side: u32, mut plan: impl FnMut(u32) -> Result<T, Error>) -> Result<T, Error> {
    loop {
        match plan(side) {
            Err(Error::Usage(_)) if side / 2 >= LEAST => side /= 2,
            planned => return planned,
        }
    }
}

/// A row of tiles: each tile's bytes, from its bottom row up.
#[derive(Default)]
struct Strip {
    tiles: Vec<(usize, Vec<u8>)>,
    /// The number of bytes of a texel.
    components: usize,
    half: bool,
}

impl Strip {
    fn add(&mut self, tile: EightBit, half: bool) {
        let (width, bytes, components) = match tile {
            EightBit::Grey(Image { width, texels, .. }) => (width, texels, 1),
            EightBit::Colours(Image { width, texels, .. }) => (width, texels.into_flattened(), 3),
        };
        (self.components, self.half) = (components, half);
        self.tiles.push((width * components, bytes));
    }

    /// Writes the rows of the whole strip, from the top.
    fn write(&self, output: &Path, to: &mut dyn Write) -> Result<(), Error> {
        let height = self.tiles.first().map_or(0, |(width, bytes)| bytes.len() / (*width).max(1));
        for y in (0..height).rev() {
            for (width, bytes) in &self.tiles {
                let written = to.write_all(&bytes[y * width..(y + 1) * width]);
                written.map_err(|e| Error::Output { path: output.into(), what: e.to_string() })?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_that_are_too_large_are_divided_and_refused_only_when_the_least_are_too_large() {
        let fits = |most: u32| {
            move |side: u32| if side <= most { Ok(side) } else { Err(Error::Usage(format!("{side} is too large"))) }
        };
        assert_eq!(divided(1024, fits(2000)).unwrap(), 1024);
        assert_eq!(divided(1024, fits(300)).unwrap(), 256);
        assert_eq!(divided(1024, fits(LEAST)).unwrap(), LEAST);
        assert!(divided(1024, fits(LEAST - 1)).unwrap_err().to_string().contains("64 is too large"));
        let other = divided(1024, |_| Err::<(), _>(Error::Input { path: "a".into(), what: "b".into() }));
        assert!(matches!(other, Err(Error::Input { .. })), "another error is none of size");
    }
}
