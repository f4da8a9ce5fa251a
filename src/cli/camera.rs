//! The flags of the camera that verbs share: where it stands, what it shows, and the matrices and focal lengths by
//! which other programs describe the same.

use super::values::{number, numbers, signed, text, valued, word};
use clap::{Arg, ArgMatches};
use glam::{DMat3, DVec3};
use hbao::scene::{Lens, View};
use hbao::{Error, Hand, Projection, ProjectionMatrix};
use std::fs::File;
use std::io::Read as _;

/// The longest file of a matrix that is read, in bytes.
const LONGEST: u64 = 1 << 16;

/// The largest error of an entry of a view matrix's rotation. Matrices that were printed with a few digits have such
/// errors.
const ROUNDING: f64 = 1e-4;

/// The largest share by which the width of a pixel may differ from its height without a notice.
const SQUARE: f64 = 0.01;

/// The axes of the eye space that `--view-matrix` leads to.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Axes {
    /// OpenGL's: x right, y up, z backward.
    Gl,
    /// Computer vision's: x right, y down, z forward.
    Cv,
}

pub(super) const AXES: [(&str, Axes); 2] = [("gl", Axes::Gl), ("cv", Axes::Cv)];

/// Makes the flags of the camera.
pub(super) fn arguments() -> impl Iterator<Item = Arg> {
    let place = [
        valued("camera", "NAME", "The camera of a glTF file that takes the image; the flags below override it"),
        signed("eye", "X,Y,Z", "Camera position [default: the scene's own, or one that frames the whole scene]"),
        signed("target", "X,Y,Z", "Point that the camera looks at [default: the scene's own, or its centre]"),
        signed("up", "X,Y,Z", "Direction that points up in the image [default: the scene's own, or 0,1,0]"),
        signed(
            "view-matrix",
            "MATRIX",
            "In place of --eye, --target and --up: the matrix from world space to right-handed eye space, 16 numbers, \
             row by row, separated by commas, or a file that holds them",
        )
        .conflicts_with_all(["eye", "target"]),
        valued(
            "view-axes",
            "AXES",
            "The axes of the eye space of --view-matrix: gl, y up and z backward, or cv, y down and z forward \
             [gl, cv; default: gl]",
        ),
    ];
    let matrices = [intrinsics_argument(), projection_argument()];
    let planes = [
        valued("near", "Z", "Smallest visible depth [default: that of --projection, or one that clips nothing]"),
        valued("far", "Z", "Largest visible depth [default: that of --projection, or one that clips nothing]"),
    ];
    let lens = lens_arguments("1 to 175; default: the scene's own, or 45");
    place.into_iter().chain(lens).chain(matrices).chain(planes).map(|arg| arg.help_heading("Camera"))
}

/// Makes the flags that say how much a camera's image shows. `angles` says which fields of view are accepted.
pub(super) fn lens_arguments(angles: &str) -> [Arg; 4] {
    [
        valued("fov-y", "DEG", format!("Vertical field of view of a perspective camera [{angles}]"))
            .conflicts_with_all(["ortho", "frustum", "ortho-frustum"]),
        valued("ortho", "HEIGHT", "Height of the view of an orthographic camera, in scene units")
            .conflicts_with_all(["frustum", "ortho-frustum"]),
        signed(
            "frustum",
            "L,R,B,T",
            "Left, right, bottom and top edge of a perspective camera's image at depth 1, in place of --fov-y",
        )
        .conflicts_with("ortho-frustum"),
        signed(
            "ortho-frustum",
            "L,R,B,T",
            "Left, right, bottom and top edge of an orthographic camera's image, in scene units, in place of --ortho",
        ),
    ]
}

/// Makes the flag `--intrinsics`.
pub(super) fn intrinsics_argument() -> Arg {
    let help = "Focal lengths and principal point of a perspective camera in pixels; the upper left corner of the image is \
                at 0,0, and y points down";
    signed("intrinsics", "FX,FY,CX,CY", help).conflicts_with_all([
        "fov-y",
        "ortho",
        "frustum",
        "ortho-frustum",
        "projection",
    ])
}

/// Makes the flag `--projection`.
pub(super) fn projection_argument() -> Arg {
    let help = "The camera's projection matrix, from eye space to OpenGL's clip space: 16 numbers, row by row, separated by \
                commas, or a file that holds them";
    signed("projection", "MATRIX", help).conflicts_with_all(["fov-y", "ortho", "frustum", "ortho-frustum"])
}

/// Reads the values of [`lens_arguments`], which exclude each other.
pub(super) fn read_lens(matches: &ArgMatches) -> Result<Option<Lens>, Error> {
    let lens = number(matches, "fov-y")?.map(|degrees| Lens::FovY(degrees.to_radians()));
    let lens = lens.or(number(matches, "ortho")?.map(Lens::Height));
    let lens = lens.or(extents(matches, "frustum")?.map(Lens::Frustum));
    Ok(lens.or(extents(matches, "ortho-frustum")?.map(Lens::OrthoFrustum)))
}

/// Reads the value of `--intrinsics`: f_x, f_y, c_x and c_y in pixels.
pub(super) fn read_intrinsics(matches: &ArgMatches) -> Result<Option<[f64; 4]>, Error> {
    let form = "FX,FY,CX,CY, four numbers separated by commas, such as 800,800,640,360";
    let given = numbers::<4>(matches, "intrinsics", form)?;
    if let Some(numbers @ [fx, fy, ..]) = given
        && !(fx > 0.0 && fy > 0.0 && numbers.iter().all(|number| number.is_finite()))
    {
        return Err(Error::Usage("--intrinsics: the focal lengths must be above 0, and all numbers finite".into()));
    }
    Ok(given)
}

/// Reads the flags of the camera of a picture of this size. Returns notices too.
pub(super) fn read(matches: &ArgMatches, size: (u32, u32)) -> Result<(View, Vec<String>), Error> {
    let (mut view, mut notices) = (View { lens: read_lens(matches)?, ..View::default() }, Vec::new());
    let axes = text(matches, "view-axes").map_or(Ok(Axes::Gl), |text| word("view-axes", text, &AXES))?;
    match read_matrix(matches, "view-matrix")? {
        // With a turntable, --up is the axis of the turn.
        Some(_) if text(matches, "up").is_some() && !turns(matches) => {
            return Err(Error::Usage("--up cannot be used with --view-matrix, which tells it: leave out one".into()));
        }
        Some(matrix) => view = View { lens: view.lens, ..place(&matrix, axes)? },
        None if text(matches, "view-axes").is_some() => {
            return Err(Error::Usage("--view-axes says which axes --view-matrix leads to: give that too".into()));
        }
        None => {
            (view.eye, view.target, view.up) =
                (point(matches, "eye")?, point(matches, "target")?, point(matches, "up")?);
        }
    }
    let seen = |view: &View, flag: &str| view.check().map_err(|error| prefixed(flag, error));
    if let Some([fx, fy, cx, cy]) = read_intrinsics(matches)? {
        view.lens = Some(lens(Projection::from_intrinsics([fx, fy], [cx, cy], size)));
        seen(&view, "intrinsics")?;
        if !(0.0..=f64::from(size.0)).contains(&cx) || !(0.0..=f64::from(size.1)).contains(&cy) {
            notices.push(format!(
                "--intrinsics: the principal point {cx},{cy} lies outside the {}x{} pixels of --size",
                size.0, size.1
            ));
        }
    }
    if let Some(matrix) = read_matrix(matches, "projection")? {
        let matrix = ProjectionMatrix::read(&matrix.map(|entry| entry as f32));
        let matrix = matrix.map_err(|error| prefixed("projection", error))?;
        view = View { lens: Some(lens(matrix.projection)), ..view };
        (view.near, view.far) = planes(&matrix, axes)?;
        seen(&view, "projection")?;
        notices.extend(stretched(matrix.projection, size));
    }
    view.near = number(matches, "near")?.or(view.near);
    view.far = number(matches, "far")?.or(view.far);
    view.check()?;
    Ok((view, notices))
}

/// Returns the place and the direction of the camera with this view matrix, stored column by column.
fn place(matrix: &[f64; 16], axes: Axes) -> Result<View, Error> {
    let refuse = |what: &str| Err(Error::Usage(format!("--view-matrix: {what}")));
    if !matrix.iter().all(|entry| entry.is_finite()) {
        return refuse("its entries must be finite numbers");
    }
    let row = |i: usize| DVec3::new(matrix[i], matrix[4 + i], matrix[8 + i]);
    let moved = DVec3::new(matrix[12], matrix[13], matrix[14]);
    let (last, corner) = (row(3), matrix[15]);
    if last != DVec3::ZERO || corner != 1.0 {
        return refuse(match moved {
            DVec3::ZERO if corner == 1.0 => {
                "it looks transposed: give it row by row, so that the last four numbers are 0,0,0,1"
            }
            _ => "its last four numbers must be 0,0,0,1",
        });
    }
    let [x, y, z] = [row(0), row(1), row(2)];
    let size = (x.length() * y.length() * z.length()).cbrt();
    let turned = [x, y, z].map(|axis| axis / size);
    let [a, b, c] = turned;
    let rigid = turned.iter().all(|axis| (axis.length() - 1.0).abs() <= ROUNDING)
        && [a.dot(b), b.dot(c), c.dot(a)].iter().all(|cosine| cosine.abs() <= ROUNDING);
    if !rigid {
        return refuse("it is not a rotation and a translation: take out scales that differ by axis, and shear");
    }
    if DMat3::from_cols(a, b, c).determinant() < 0.0 {
        return refuse(
            "it mirrors: it must lead to right-handed eye space; for a left-handed one, with z forward, negate the third row",
        );
    }
    if (size - 1.0).abs() > ROUNDING {
        return refuse(&format!("it scales by {size}: divide its first three rows by that"));
    }
    let (up, forward) = match axes {
        Axes::Gl => (b, -c),
        Axes::Cv => (-b, c),
    };
    // The target is as far away as the eye is from the origin, so that rounding does not turn the view.
    let eye = -(moved.x * a + moved.y * b + moved.z * c);
    let target = eye + eye.length().max(1.0) * forward;
    let view = View { eye: Some(eye), target: Some(target), up: Some(up), direction_only: true, ..View::default() };
    view.check().map_err(|error| prefixed("view-matrix", error))?;
    Ok(view)
}

/// Returns the near and the far plane of a projection matrix, as far as it has them: the far plane may be infinitely
/// far.
fn planes(matrix: &ProjectionMatrix, axes: Axes) -> Result<(Option<f64>, Option<f64>), Error> {
    let usual = if axes == Axes::Gl { Hand::Right } else { Hand::Left };
    let [a, b] = [-1.0, 1.0].map(|ndc| matrix.z(ndc, matrix.hand.unwrap_or(usual)));
    let (near, far) = if a.is_infinite() || b < a { (b, a) } else { (a, b) };
    if near.is_nan() || far.is_nan() || near <= 0.0 {
        return Err(Error::Usage(format!(
            "--projection: its planes lie at the depths {near} and {far}, and both must be above 0: move the eye back, \
             or give the extents by --frustum or --ortho-frustum"
        )));
    }
    Ok((Some(near), Some(far).filter(|far| far.is_finite())))
}

/// Returns the lens with the extents of a projection.
fn lens(projection: Projection) -> Lens {
    let ([x, y], [half_x, half_y]) = (projection.middle_at(1.0), projection.half_extents());
    let edges = [x - half_x, x + half_x, y - half_y, y + half_y];
    if projection.is_perspective() { Lens::Frustum(edges) } else { Lens::OrthoFrustum(edges) }
}

/// Returns the notice that a projection gives a picture of this size pixels that are not square.
fn stretched(projection: Projection, (width, height): (u32, u32)) -> Option<String> {
    let [x, y] = projection.half_extents();
    let (seen, given) = (x / y, f64::from(width) / f64::from(height));
    ((seen / given - 1.0).abs() > SQUARE).then(|| {
        let fitting = (f64::from(height) * seen).round();
        format!(
            "--projection shows {seen:.3} times as much in width as in height, and --size {width}x{height} has {given:.3} \
             times as many pixels: its pixels are not square; --size {fitting}x{height} has square ones"
        )
    })
}

/// Returns whether the verb turns the camera about the scene.
fn turns(matches: &ArgMatches) -> bool {
    matches.try_get_one::<String>("turntable").is_ok_and(|given| given.is_some())
}

pub(super) fn point(matches: &ArgMatches, name: &str) -> Result<Option<DVec3>, Error> {
    let point = numbers(matches, name, "X,Y,Z, three numbers separated by commas, such as 0,1.5,-3")?;
    Ok(point.map(DVec3::from_array))
}

fn extents(matches: &ArgMatches, name: &str) -> Result<Option<[f64; 4]>, Error> {
    numbers(matches, name, "L,R,B,T, four numbers separated by commas, such as -0.4,0.6,-0.3,0.3")
}

/// Returns the error with the name of the flag before it.
pub(super) fn prefixed(flag: &str, error: Error) -> Error {
    match error {
        Error::Usage(what) => Error::Usage(format!("--{flag}: {what}")),
        other => other,
    }
}

/// Returns the matrix that a flag gives, column by column. The flag gives 16 numbers row by row, or a file of them.
pub(super) fn read_matrix(matches: &ArgMatches, flag: &str) -> Result<Option<[f64; 16]>, Error> {
    let Some(given) = text(matches, flag) else { return Ok(None) };
    let refuse = |what: String| Error::Usage(format!("--{flag}: {what}"));
    let numbers = |text: &str| -> Option<Vec<f64>> {
        // Programs print matrices with brackets around their rows.
        let separator = |c: char| c.is_whitespace() || ",;[]()".contains(c);
        text.split(separator).filter(|number| !number.is_empty()).map(|number| number.parse().ok()).collect()
    };
    let found = match numbers(given) {
        Some(found) => found,
        None => {
            let mut text = String::new();
            let read = File::open(given).and_then(|file| file.take(LONGEST).read_to_string(&mut text));
            read.map_err(|e| {
                refuse(format!("'{given}' is neither 16 numbers separated by commas nor a file of them, {e}"))
            })?;
            numbers(&text).ok_or_else(|| refuse(format!("the file {given} holds more than numbers")))?
        }
    };
    let rows: [f64; 16] = found.try_into().map_err(|found: Vec<f64>| {
        refuse(format!("{} numbers are given, and a matrix has 16, row by row", found.len()))
    })?;
    Ok(Some(std::array::from_fn(|i| rows[4 * (i % 4) + i / 4])))
}
