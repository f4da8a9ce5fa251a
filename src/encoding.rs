//! How an application stores the depth and the normals that ambient occlusion is computed from.

use crate::error::Error;
use crate::projection::{Hand, ProjectionMatrix};

/// What a texture of depth stores. In all formulas z is linear eye-space depth in scene units, above 0 and increasing
/// away from the eye, and d is the stored value, in [0, 1]. The depth range (`glDepthRange`) must be [0, 1].
///
/// In hardware depth the cleared value of the far end is background: d = 1, or d = 0 if depth is reversed. A surface
/// that is so far away that its d rounds to that value is background too.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum DepthEncoding {
    /// z itself, in a float format.
    Linear,
    /// The depth buffer of a projection with these planes. In perspective d is linear in 1/z, and in an orthographic
    /// view in z. The range of z in clip space makes no difference here: from [-1, 1] the hardware makes d = ndc/2 +
    /// 1/2, and from [0, 1] it takes d = ndc, and both are the same function of z, near and far.
    Planes {
        /// The z of the near plane, above 0, or at least 0 in an orthographic view.
        near: f64,
        /// The z of the far plane, above `near`. In perspective it may be infinite.
        far: f64,
        /// Whether d falls from 1 at the near plane to 0 at the far plane, and does not rise from 0 to 1.
        reversed: bool,
    },
    /// The depth buffer of this projection matrix, whichever planes it has, reversed or not. Only the rows of z and w
    /// are read, which may not depend on x and y: a matrix with an oblique near plane is refused.
    Matrix {
        /// The matrix from eye space to clip space, column by column as OpenGL takes it. Eye space may have either
        /// hand.
        projection: [f32; 16],
        /// The range of z in clip space, after the division by w.
        range: ClipRange,
    },
    /// Logarithmic depth, d = ln(C z + 1) / ln(C far + 1), which a shader of the application wrote.
    Logarithmic {
        /// C, per scene unit, above 0.
        c: f64,
        /// The z at which d is 1, above 0.
        far: f64,
    },
}

/// The range of z in clip space, between the near and the far plane, after the division by w.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ClipRange {
    /// [-1, 1], so that d = ndc/2 + 1/2. Without `glClipControl`, which OpenGL 3.3 does not have, this is the range,
    /// whatever range the matrix was made for.
    MinusOneToOne,
    /// [0, 1], so that d = ndc. It needs `glClipControl` with `GL_ZERO_TO_ONE`.
    ZeroToOne,
}

/// How linear depth is computed from the stored value, with coefficients for a shader in float32: no formula subtracts
/// two numbers that are nearly equal. t is 1 - d, or d if depth is reversed, so that it is 0 at the far end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Curve {
    /// The stored value itself.
    Linear,
    /// 1/z = at_far + rise t.
    Perspective { at_far: f64, rise: f64, reversed: bool },
    /// z = near + range (1 - t).
    Orthographic { near: f64, range: f64, reversed: bool },
    /// z = (exp(d logarithm) - 1) / c.
    Logarithmic { logarithm: f64, c: f64 },
}

impl DepthEncoding {
    /// Returns the encoding of the usual depth buffer: d rises from 0 at the near plane to 1 at the far plane.
    #[must_use]
    pub fn standard(near: f64, far: f64) -> DepthEncoding {
        DepthEncoding::Planes { near, far, reversed: false }
    }

    /// Returns the encoding of a reversed depth buffer: d falls from 1 at the near plane to 0 at the far plane, which
    /// may be at infinity: `DepthEncoding::reversed(0.1, f64::INFINITY)`.
    #[must_use]
    pub fn reversed(near: f64, far: f64) -> DepthEncoding {
        DepthEncoding::Planes { near, far, reversed: true }
    }

    /// Returns the z of the near plane, if the encoding tells it for a view of this kind.
    pub(crate) fn near(&self, perspective: bool) -> Option<f64> {
        match self.curve(perspective).ok()? {
            Curve::Linear | Curve::Logarithmic { .. } => None,
            Curve::Perspective { at_far, rise, .. } => Some(1.0 / (at_far + rise)),
            Curve::Orthographic { near, .. } => Some(near),
        }
    }

    /// Returns how z follows from d in a view that is perspective or orthographic.
    ///
    /// # Errors
    /// [`Error::Usage`] if the numbers belong to no such view.
    pub(crate) fn curve(&self, perspective: bool) -> Result<Curve, Error> {
        let refuse = |what: String| Err(Error::Usage(format!("depth: {what}")));
        match *self {
            DepthEncoding::Linear => Ok(Curve::Linear),
            DepthEncoding::Planes { near, far, .. } if near.is_nan() || far.is_nan() => {
                refuse(format!("near {near} and far {far} must be numbers"))
            }
            DepthEncoding::Planes { near, far, .. } if near >= far => {
                refuse(format!("near {near} must be below far {far}: they may be swapped"))
            }
            DepthEncoding::Planes { near, .. } if near < 0.0 || perspective && near == 0.0 => {
                let least = if perspective { "above 0" } else { "at least 0" };
                refuse(format!("near must be {least}, not {near}"))
            }
            DepthEncoding::Planes { near, far, reversed } if perspective => {
                Ok(Curve::Perspective { at_far: 1.0 / far, rise: 1.0 / near - 1.0 / far, reversed })
            }
            DepthEncoding::Planes { far: f64::INFINITY, .. } => {
                refuse("far must be finite in an orthographic view".into())
            }
            DepthEncoding::Planes { near, far, reversed } => {
                Ok(Curve::Orthographic { near, range: far - near, reversed })
            }
            DepthEncoding::Matrix { projection, range } => of_matrix(&projection, range, perspective),
            DepthEncoding::Logarithmic { c, far } if c > 0.0 && far > 0.0 && (c * far).is_finite() => {
                Ok(Curve::Logarithmic { logarithm: (c * far).ln_1p(), c })
            }
            DepthEncoding::Logarithmic { c, far } => {
                refuse(format!("C and far of logarithmic depth must be finite and above 0, not {c} and {far}"))
            }
        }
    }
}

/// Returns the curve of a projection matrix, which is given column by column.
fn of_matrix(columns: &[f32; 16], range: ClipRange, perspective: bool) -> Result<Curve, Error> {
    let refuse = |what: &str| Err(Error::Usage(format!("depth: the projection matrix {what}")));
    let ProjectionMatrix { projection, depth: [at_0, rise], .. } = ProjectionMatrix::read(columns)?;
    if projection.is_perspective() != perspective {
        let words = if perspective { "is orthographic" } else { "is perspective" };
        return refuse(&format!("{words}, and the projection of the view is not"));
    }
    // d = a + b ndc, where ndc = at_0 + rise / z, or at_0 + rise z_eye in an orthographic view.
    let [a, b] = match range {
        ClipRange::MinusOneToOne => [0.5, 0.5],
        ClipRange::ZeroToOne => [0.0, 1.0],
    };
    let (constant, slope) = (a + b * at_0, b * rise);
    if perspective {
        // d = constant + slope / z.
        let reversed = slope > 0.0;
        let (at_far, rise) = ((if reversed { -constant } else { 1.0 - constant }) / slope, slope.abs().recip());
        if !(at_far.is_finite() && rise.is_finite() && at_far + rise > 0.0) {
            return refuse("has no near plane in front of the eye");
        }
        return Ok(Curve::Perspective { at_far, rise, reversed });
    }
    // d = constant + slope z_eye. Both planes lie in front of the eye, so their sign tells the hand.
    let planes = [-constant / slope, (1.0 - constant) / slope];
    let forward = if planes[0] + planes[1] < 0.0 { -1.0 } else { 1.0 };
    let planes = planes.map(|z| z * forward);
    if !planes.iter().all(|z| z.is_finite() && *z >= 0.0) {
        return refuse("has no near plane in front of the eye");
    }
    let reversed = planes[0] > planes[1];
    let near = planes[usize::from(reversed)];
    Ok(Curve::Orthographic { near, range: (planes[0] - planes[1]).abs(), reversed })
}

/// How a texture of normals stores their components.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum NormalEncoding {
    /// The components themselves, in [-1, 1], in a signed normalised or a float format.
    Signed,
    /// Each component c as c/2 + 1/2, in an unsigned normalised or a float format.
    Biased,
    /// Octahedral: n/(|n.x| + |n.y| + |n.z|) has the components x and y in two channels, where n.z >= 0; where n.z < 0
    /// they are (1 - |y|) sign(x) and (1 - |x|) sign(y). Both are in [-1, 1], in a signed normalised or a float format.
    Octahedral,
    /// The two channels c of [`NormalEncoding::Octahedral`] as c/2 + 1/2, in an unsigned normalised or a float format.
    OctahedralBiased,
}

impl NormalEncoding {
    /// Returns whether components are stored as c/2 + 1/2.
    pub(crate) fn is_biased(self) -> bool {
        matches!(self, NormalEncoding::Biased | NormalEncoding::OctahedralBiased)
    }

    /// Returns whether two channels hold the normal.
    pub(crate) fn is_octahedral(self) -> bool {
        matches!(self, NormalEncoding::Octahedral | NormalEncoding::OctahedralBiased)
    }
}

/// The space that normals are given in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NormalSpace {
    /// Eye space of this hand.
    Eye(Hand),
    /// World space.
    World {
        /// The rotation from world space to eye space, column by column: a view matrix without its translation.
        view: [f32; 9],
        /// The hand of the eye space that the view matrix leads to.
        eye: Hand,
    },
}

impl NormalSpace {
    /// Returns world space, with the view matrix from world space to eye space of this hand. The matrix is given column
    /// by column as OpenGL takes it. It may mirror and scale evenly, and its translation is not read.
    #[must_use]
    pub fn world(view: &[f32; 16], eye: Hand) -> NormalSpace {
        let [a, b, c, _, d, e, f, _, g, h, i, ..] = *view;
        NormalSpace::World { view: [a, b, c, d, e, f, g, h, i], eye }
    }

    /// Returns the matrix, column by column, that leads to the eye space of this library. `None` if normals are in it.
    ///
    /// # Errors
    /// [`Error::Usage`] if the view matrix is not a rotation, apart from mirroring and an even scale.
    pub(crate) fn to_eye(self) -> Result<Option<[f32; 9]>, Error> {
        let (mut matrix, hand) = match self {
            NormalSpace::Eye(Hand::Left) => return Ok(None),
            NormalSpace::Eye(hand) => ([1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0], hand),
            NormalSpace::World { view, eye } => (view, eye),
        };
        let columns: [[f64; 3]; 3] = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(matrix[3 * i + j])));
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let squared = dot(columns[0], columns[0]);
        // The columns of a rotation have the same length and are perpendicular, here within a thousandth.
        let wrong = (0..3).flat_map(|i| (0..=i).map(move |j| (i, j))).any(|(i, j)| {
            let expected = if i == j { squared } else { 0.0 };
            let off = (dot(columns[i], columns[j]) - expected).abs();
            off.is_nan() || off > 2e-3 * squared
        });
        if wrong || !(squared > 0.0 && squared.is_finite()) {
            return Err(Error::Usage(
                "normals: the view matrix is no rotation: give the matrix from world space to eye space, without a \
                 projection or an uneven scale"
                    .into(),
            ));
        }
        // The normal may have any length, but an even scale need not overflow float32.
        let length = squared.sqrt();
        for (i, number) in matrix.iter_mut().enumerate() {
            let sign = if hand == Hand::Right && i % 3 == 2 { -1.0 } else { 1.0 };
            *number = (sign * f64::from(*number) / length) as f32;
        }
        Ok(Some(matrix))
    }
}
