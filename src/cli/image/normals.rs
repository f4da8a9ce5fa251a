//! The normals of a picture, and its colours.

use super::channels::Names;
use super::depth::{Depth, at};
use crate::cli::camera::{AXES, Axes, read_matrix};
use crate::cli::flags::{self, text};
use clap::{Arg, ArgMatches, value_parser};
use hbao::image::{Image, Layers};
use hbao::{Error, Hand, NormalEncoding, NormalSpace};
use std::path::{Path, PathBuf};

/// What the components of normals point along.
#[derive(Clone, Copy, PartialEq)]
enum NormalsAre {
    Eye(Hand),
    /// Eye space of computer vision: x right, y down, z forward.
    Cv,
    World,
}

const SPACES: [(&str, NormalsAre); 4] = [
    ("right", NormalsAre::Eye(Hand::Right)),
    ("left", NormalsAre::Eye(Hand::Left)),
    ("cv", NormalsAre::Cv),
    ("world", NormalsAre::World),
];

const ENCODINGS: [(&str, NormalEncoding); 2] = [("signed", NormalEncoding::Signed), ("biased", NormalEncoding::Biased)];

const FLAGS: [&str; 5] = ["normals-are", "normals-encoding", "normals-channels", "view-matrix", "view-axes"];

/// The flags of normals.
pub(super) struct NormalsFlags {
    path: Option<PathBuf>,
    channels: Option<String>,
    encoding: Option<NormalEncoding>,
    space: NormalSpace,
    idle: Vec<String>,
}

/// The normals of a picture, as they are uploaded.
pub(super) struct Normals {
    pub(super) image: Image<[f32; 3]>,
    pub(super) encoding: NormalEncoding,
    pub(super) space: NormalSpace,
}

/// Makes the flags of normals.
pub(super) fn arguments() -> [Arg; 5] {
    [
        flags::valued(
            "normals-are",
            "SPACE",
            "The space of NORMALS, always with x right: right is eye space with y up and z towards the viewer, left with y \
             up and z forward, cv with y down and z forward; world needs --view-matrix \
             [right, left, cv, world; default: right]",
        ),
        flags::valued(
            "normals-encoding",
            "ENCODING",
            "How NORMALS holds a component c: signed as c, biased as c/2 + 1/2 [default: biased in a PNG, signed in an EXR]",
        ),
        flags::valued(
            "normals-channels",
            "LAYER",
            "The layer of NORMALS, such as N for N.X, N.Y, N.Z, or the names of three channels, separated by commas \
             [default: the only layer with R, G, B or X, Y, Z, or the only one of them that is called N or Normal]",
        ),
        flags::signed(
            "view-matrix",
            "MATRIX",
            "The matrix from world to eye space, for --normals-are world: 16 numbers, row by row, separated by commas, or a \
             file that holds them",
        ),
        flags::valued(
            "view-axes",
            "AXES",
            "The eye space of --view-matrix: gl has y up and looks along -z, cv has y down and looks along z \
             [gl, cv; default: gl]",
        ),
    ]
}

/// Makes the flags of the picture that ambient occlusion darkens.
pub(super) fn colour_arguments() -> [Arg; 2] {
    let path = Arg::new("color").long("color").value_name("PICTURE").value_parser(value_parser!(PathBuf));
    [
        path.help("The picture that --show final darkens, a PNG or EXR file of the same size"),
        flags::valued(
            "color-channels",
            "LAYER",
            "The layer of PICTURE, or the names of three channels, separated by commas \
             [default: R, G, B, or the only layer that has them, or Y]",
        ),
    ]
}

impl NormalsFlags {
    pub(super) fn read(matches: &ArgMatches) -> Result<NormalsFlags, Error> {
        let path = matches.get_one::<PathBuf>("normals-file").cloned();
        let word = |name| text(matches, name);
        let are = flags::word("normals-are", word("normals-are").unwrap_or("right"), &SPACES)?;
        let encoding = word("normals-encoding").map(|text| flags::word("normals-encoding", text, &ENCODINGS));
        let cv = flags::word("view-axes", word("view-axes").unwrap_or("gl"), &AXES)? == Axes::Cv;
        let view = read_matrix(matches, "view-matrix")?.map(|matrix| matrix.map(|entry| entry as f32));
        let space = match (are, view) {
            (NormalsAre::Eye(hand), _) => NormalSpace::Eye(hand),
            (NormalsAre::Cv, _) => {
                NormalSpace::World { view: [1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0], eye: Hand::Left }
            }
            (NormalsAre::World, Some(view)) => of_view(view, cv)?,
            (NormalsAre::World, None) => {
                let what = "--normals-are world needs --view-matrix, which leads from world to eye space";
                return Err(Error::Usage(what.into()));
            }
        };
        let idle = FLAGS.into_iter().filter(|flag| word(flag).is_some()).filter_map(|flag| {
            if path.is_none() {
                return Some(format!("--{flag} has no effect without NORMALS"));
            }
            let unused = flag.starts_with("view") && are != NormalsAre::World;
            unused.then(|| format!("--{flag} has no effect unless --normals-are is world"))
        });
        let idle = idle.collect();
        Ok(NormalsFlags {
            path,
            channels: word("normals-channels").map(String::from),
            encoding: encoding.transpose()?,
            space,
            idle,
        })
    }

    /// Returns the notices about flags without effect.
    pub(super) fn idle(&self) -> &[String] {
        &self.idle
    }

    /// Returns the path of NORMALS, if they are given.
    pub(super) fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// Reads the normals, if there are any. They are set to 0 where nothing is.
    pub(super) fn open(&self, depth: &Depth) -> Result<Option<Normals>, Error> {
        let Some(path) = &self.path else { return Ok(None) };
        let picture = Layers::open(path)?;
        let encoding = if picture.is_png() { NormalEncoding::Biased } else { NormalEncoding::Signed };
        let encoding = self.encoding.unwrap_or(encoding);
        if picture.is_png() && encoding == NormalEncoding::Signed {
            let what = "--normals-encoding signed: a PNG holds no negative numbers; leave the flag out, or give an EXR";
            return Err(Error::Usage(what.into()));
        }
        let usual = ["N", "Normal", "Normals"];
        let channels = Names::of(path, &picture).triple(self.channels.as_deref(), &usual, "normals-channels LAYER")?;
        let mut image = triples(path, picture, channels, &depth.image)?;
        let (width, height) = (image.width, image.height);
        for row in 0..height {
            for x in 0..width {
                let pixel = (height - 1 - row) * width + x;
                if !depth.is_covered(pixel) {
                    image.texels[pixel] = [0.0; 3];
                } else if !image.texels[pixel].iter().all(|component| component.is_finite()) {
                    let what = format!("the normal is NaN or infinite{}, where a surface is", at(x, row));
                    return Err(Error::Input { path: path.clone(), what });
                }
            }
        }
        Ok(Some(Normals { image, encoding, space: self.space }))
    }
}

/// Returns the space of normals in the world, from the matrix to an eye space with these axes.
fn of_view(mut view: [f32; 16], cv: bool) -> Result<NormalSpace, Error> {
    let last_row = [3, 7, 11, 15].map(|i| view[i]);
    if last_row[..3] != [0.0; 3] || last_row[3] == 0.0 {
        let what =
            "--view-matrix: its last row must be 0,0,0,1: give the 16 numbers row by row, from world to eye space";
        return Err(Error::Usage(what.into()));
    }
    if cv {
        // With y up, z forward and x right, eye space is left-handed.
        for column in 0..4 {
            view[4 * column + 1] *= -1.0;
        }
    }
    Ok(NormalSpace::world(&view, if cv { Hand::Left } else { Hand::Right }))
}

/// Reads the picture that ambient occlusion darkens.
pub(super) fn colours(path: &Path, channels: Option<&str>, depth: &Depth) -> Result<Image<[f32; 3]>, Error> {
    let picture = Layers::open(path)?;
    let channels = Names::of(path, &picture).colours(channels)?;
    triples(path, picture, channels, &depth.image)
}

/// Reads three channels of a picture that must be as large as depth.
fn triples(path: &Path, picture: Layers, channels: [usize; 3], depth: &Image<f32>) -> Result<Image<[f32; 3]>, Error> {
    let (width, height) = picture.size();
    if (width, height) != (depth.width, depth.height) {
        let what = format!(
            "it has {width}x{height} pixels, and depth has {}x{}: give a picture of the same view and size",
            depth.width, depth.height
        );
        return Err(Error::Input { path: path.into(), what });
    }
    let planes = picture.read(&channels, 0.0)?;
    Ok(Image::from_fn(width, height, |x, y| std::array::from_fn(|i| planes[i].at(x, y))))
}
