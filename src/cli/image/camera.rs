//! The camera that a picture was rendered with, which the picture itself does not tell.

use crate::cli::camera::{self, lens_arguments, prefixed, read_lens, read_matrix};
use crate::cli::flags::{self, number, signed, text, valued};
use clap::{Arg, ArgGroup, ArgMatches, Command};
use hbao::image::exr;
use hbao::scene::{Lens, View};
use hbao::{ClipRange, DepthEncoding, Error, Hand, Projection, ProjectionMatrix};
use std::path::Path;

/// The flags of which exactly one must be given.
const CAMERAS: [&str; 6] = ["fov-y", "ortho", "frustum", "ortho-frustum", "intrinsics", "projection"];

const CLIP_RANGES: [(&str, ClipRange); 2] = [("-1..1", ClipRange::MinusOneToOne), ("0..1", ClipRange::ZeroToOne)];

/// The camera as flags give it.
pub(super) struct Camera {
    given: Given,
    near: Option<f64>,
    far: Option<f64>,
    reversed: bool,
    clip_range: Option<ClipRange>,
}

enum Given {
    Lens(Lens),
    /// f_x, f_y, c_x and c_y in pixels.
    Intrinsics([f64; 4]),
    /// The matrix, column by column.
    Matrix([f32; 16]),
}

/// Adds the flags of the camera.
pub(super) fn with_flags(command: Command) -> Command {
    let own: [Arg; 6] = [
        camera::intrinsics_argument(),
        camera::projection_argument(),
        valued("near", "Z", "The near plane's z, for --depth-is hardware, and where the rays of ray-march end"),
        valued("far", "Z", "The far plane's z, for --depth-is hardware [a number above --near, or inf]"),
        Arg::new("reversed").long("reversed").action(clap::ArgAction::SetTrue).help(
            "With --depth-is hardware, --near and --far: depth falls from 1 at the near plane to 0 at the far plane",
        ),
        signed(
            "clip-range",
            "RANGE",
            "With --depth-is hardware and --projection: the range of z/w in clip space \
                                       [-1..1, 0..1; default: -1..1]",
        ),
    ];
    let all = lens_arguments("1 to 175").into_iter().chain(own).map(|arg| arg.help_heading("Camera"));
    command.args(all).group(ArgGroup::new("camera").args(CAMERAS).multiple(false))
}

impl Camera {
    /// Reads the flags of the camera. If none is given, the error says which `hbao render` wrote into the file of
    /// depth, in case it did.
    pub(super) fn read(matches: &ArgMatches, depth: &Path) -> Result<Camera, Error> {
        let given = match (
            read_lens(matches)?,
            camera::read_intrinsics(matches)?,
            read_matrix(matches, "projection")?.map(|matrix| matrix.map(|entry| entry as f32)),
        ) {
            (Some(lens), ..) => Given::Lens(lens),
            (_, Some(numbers), _) => Given::Intrinsics(numbers),
            (.., Some(matrix)) => Given::Matrix(matrix),
            _ => {
                let flags = CAMERAS.map(|flag| format!("--{flag}")).join(", ");
                let wrote = metadata_camera(depth).map(|camera| format!("; hbao rendered this file with {camera}"));
                return Err(Error::Usage(format!(
                    "no camera is given, and a picture does not tell its own: give one of {flags}{}",
                    wrote.unwrap_or_default()
                )));
            }
        };
        if let Given::Lens(lens) = given {
            View { lens: Some(lens), ..View::default() }.check()?;
        }
        let clip_range = text(matches, "clip-range").map(|text| flags::word("clip-range", text, &CLIP_RANGES));
        let (near, far) = (number(matches, "near")?, number(matches, "far")?);
        for (flag, z) in [("near", near), ("far", far)] {
            if z.is_some_and(|z| z.is_nan() || z < 0.0) {
                return Err(Error::Usage(format!("--{flag} must be a number of at least 0")));
            }
        }
        let (reversed, clip_range) = (matches.get_flag("reversed"), clip_range.transpose()?);
        Ok(Camera { given, near, far, reversed, clip_range })
    }

    /// Returns the projection of a picture of this size.
    pub(super) fn projection(&self, size: (u32, u32)) -> Result<Projection, Error> {
        let projection = match self.given {
            Given::Lens(lens) => lens.projection(f64::from(size.0) / f64::from(size.1)),
            Given::Intrinsics([fx, fy, cx, cy]) => Projection::from_intrinsics([fx, fy], [cx, cy], size),
            Given::Matrix(columns) => Projection::from_matrix(&columns).map_err(|e| prefixed("projection", e))?,
        };
        projection.check()?;
        Ok(projection)
    }

    /// Returns the z of the near plane; 0 if it is not given.
    pub(super) fn near(&self) -> f64 {
        self.near.unwrap_or(0.0)
    }

    /// Returns whether the shape of the picture's pixels follows from its size, so that they are taken as square.
    pub(super) fn takes_square_pixels(&self) -> bool {
        matches!(self.given, Given::Lens(Lens::FovY(_) | Lens::Height(_)))
    }

    /// Returns how the depth buffer of this camera is encoded, and the value that it is cleared to.
    pub(super) fn hardware(&self) -> Result<(DepthEncoding, f32), Error> {
        match (self.near, self.far, &self.given) {
            (Some(near), Some(far), _) => {
                let (reversed, background) = (self.reversed, if self.reversed { 0.0 } else { 1.0 });
                Ok((DepthEncoding::Planes { near, far, reversed }, background))
            }
            (None, None, &Given::Matrix(projection)) => {
                if self.reversed {
                    let what = "--reversed: the matrix of --projection tells it; leave the flag out";
                    return Err(Error::Usage(what.into()));
                }
                let range = self.clip_range.unwrap_or(ClipRange::MinusOneToOne);
                let matrix = ProjectionMatrix::read(&projection).map_err(|e| prefixed("projection", e))?;
                let nearest = if range == ClipRange::ZeroToOne { 0.0 } else { -1.0 };
                // The far end is the farther one from the eye. An orthographic matrix does not tell its hand, and both
                // planes lie in front of the eye.
                let [a, b] = [nearest, 1.0].map(|ndc| matrix.z(ndc, matrix.hand.unwrap_or(Hand::Left)).abs());
                Ok((DepthEncoding::Matrix { projection, range }, if a > b { 0.0 } else { 1.0 }))
            }
            _ => {
                let or = if matches!(self.given, Given::Matrix(_)) { ", or neither with --projection" } else { "" };
                Err(Error::Usage(format!("--depth-is hardware needs the planes of the camera, --near and --far{or}")))
            }
        }
    }

    /// Returns those of the flags --near, --far, --reversed and --clip-range that have no effect, each with the reason.
    pub(super) fn idle(&self, hardware: bool, reads_near: bool) -> Vec<String> {
        let planes = self.near.is_some() && self.far.is_some();
        let only = "unless --depth-is is hardware";
        [
            (
                "near",
                self.near.is_some() && !hardware && !reads_near,
                "unless --depth-is is hardware, or --method ray-march",
            ),
            ("far", self.far.is_some() && !hardware, only),
            ("reversed", self.reversed && !hardware, only),
            ("clip-range", self.clip_range.is_some() && !hardware, only),
            (
                "clip-range",
                self.clip_range.is_some() && hardware && planes,
                "with --near and --far, which say the same",
            ),
        ]
        .iter()
        .filter(|(_, idle, _)| *idle)
        .map(|(flag, _, why)| format!("--{flag} has no effect {why}"))
        .collect()
    }
}

/// Returns the flag that gives the camera with which `hbao render` made a file.
fn metadata_camera(path: &Path) -> Option<String> {
    let (_, text) = exr::read_text(path).ok()?.into_iter().find(|(keyword, _)| keyword == "hbao")?;
    let table: toml::Table = text.parse().ok()?;
    let render = table.get("render")?.as_table().filter(|render| !render.contains_key("tile"))?;
    let numbers = |value: &toml::Value| match value {
        toml::Value::Array(numbers) => numbers.iter().map(ToString::to_string).collect::<Vec<_>>().join(","),
        number => number.to_string(),
    };
    CAMERAS.iter().find_map(|flag| Some(format!("--{flag} {}", numbers(render.get(*flag)?))))
}
