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
        // All tiles are measured before the first is rendered, since rendering them may take hours.
        let rows = self.rows()?;
        let progress = bar(rows.iter().flatten().count() as u64, "tiles");
        let mut dark = false;
        let mut outputs = Outputs::new();
        outputs.stage_by(output, |to| {
            let mut rows = rows.into_iter();
            let mut strip = || rows.next().map(|row| self.strip(row, &mut dark, &progress)).transpose();
            let Some(first) = strip()? else { return Ok(()) };
            let size = if first.half { (width.div_ceil(2), height.div_ceil(2)) } else { (width, height) };
            png::encode_rows(output, to, size, first.components, text, |to| {
                first.write(output, to)?;
                while let Some(strip) = strip()? {
                    strip.write(output, to)?;
                }
                Ok(())
            })
        })?;
        progress.finish_and_clear();
        if self.makes_ao() && !dark {
            let open = unmeant::open(&Image::filled(1, 1, 1.0), self.settings, self.settings.method.reads("radius"));
            open.iter().for_each(|notice| say(notice));
        }
        outputs.commit()
    }

    /// Renders a row of tiles. `dark` becomes true if anything occludes.
    fn strip(&mut self, row: Vec<Region>, dark: &mut bool, progress: &ProgressBar) -> Result<Strip, Error> {
        let mut strip = Strip::default();
        for region in row {
            let (part, half) = self.render(region, dark)?;
            strip.add(part, half);
            progress.inc(1);
        }
        Ok(strip)
    }

    fn makes_ao(&self) -> bool {
        !self.request.gbuffer_only && self.settings.method.computes()
    }

    /// Renders a tile, and returns it and whether it has half resolution. `dark` becomes true if anything occludes.
    fn render(&mut self, region: Region, dark: &mut bool) -> Result<(EightBit, bool), Error> {
        let Region { size, camera, kept } = region;
        self.pipeline.resize(size)?;
        self.pipeline.restrict(kept.as_ref().map(Kept::part));
        self.pipeline.render(&self.opened.scene.mesh, &camera)?;
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

    /// Divides the picture into tiles, and returns what is rendered for each, row by row from the top. The first choice
    /// of their size follows from a small picture, in which a surface may be missed that is the nearest one of a tile.
    fn rows(&self) -> Result<Vec<Vec<Region>>, Error> {
        let mut depths = tile::depths(self.context.gl(), self.settings, self.request)?;
        let width = u64::from(self.flags.size.0);
        divided(self.side()?, |side| {
            let high = (MOST_BYTES / (3 * width)).clamp(u64::from(LEAST), u64::from(side)) as u32;
            self.regions((side / 8 * 8, high / 8 * 8), depths.as_mut())
        })
    }

    /// Returns what is rendered for each tile of this size, row by row from the top.
    fn regions(
        &self,
        (tile_width, tile_height): (u32, u32),
        mut depths: Option<&mut Pipeline>,
    ) -> Result<Vec<Vec<Region>>, Error> {
        let (width, height) = self.flags.size;
        let count = u64::from(width.div_ceil(tile_width)) * u64::from(height.div_ceil(tile_height));
        let progress = bar(count, "tiles measured");
        let mut rows = Vec::new();
        for top in (1..=height).rev().step_by(tile_height as usize) {
            let bottom = top.saturating_sub(tile_height);
            let mut row = Vec::new();
            for left in (0..width).step_by(tile_width as usize) {
                let size = (tile_width.min(width - left), top - bottom);
                let tile = Tile::at(self.flags.size, (left, bottom), size, &self.given());
                let (mesh, camera) = (&self.opened.scene.mesh, &self.opened.camera);
                row.push(tile.region(self.context.gl(), mesh, camera, self.settings, depths.as_deref_mut())?);
                progress.inc(1);
            }
            rows.push(row);
        }
        progress.finish_and_clear();
        Ok(rows)
    }

    /// Returns the longest side of a tile, after a look at the whole view in a small picture.
    fn side(&self) -> Result<u32, Error> {
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
            Err(Error::Usage(_)) if side > LEAST => side = (side / 2).max(LEAST),
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
        assert_eq!(divided(1000, fits(100)).unwrap(), LEAST);
        assert!(divided(1024, fits(LEAST - 1)).unwrap_err().to_string().contains("64 is too large"));
        let other = divided(1024, |_| Err::<(), _>(Error::Input { path: "a".into(), what: "b".into() }));
        assert!(matches!(other, Err(Error::Input { .. })), "another error is none of size");
    }
}
