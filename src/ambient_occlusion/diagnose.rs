//! Finds inputs that are plausible and still wrong, such as normals of the other hand, by reading images back.

use super::AmbientOcclusion;
use super::check::{Checked, Precision};
use super::evidence::{Evidence, Misfit, turned};
use super::inputs::Inputs;
use crate::Error;
use crate::encoding::Curve;
use crate::gl::state::SavedState;
use crate::gl::{self, ProgramCache};
use crate::pass::inspect::Inspect;
use crate::pass::linear_depth::LinearDepth;
use crate::pass::rebuilt_normals::RebuiltNormals;
use crate::pass::{Grid, ImageVariant};
use std::fmt;

/// What looks wrong in the inputs of ambient occlusion. Its text says so in one line. Shares are of the pixels that
/// hold a surface, in [0, 1].
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Finding {
    /// No pixel holds a surface.
    OnlyBackground,
    /// Depth is NaN or infinite at so many pixels.
    DepthNotFinite(usize),
    /// Depth is 0 or negative at so many pixels.
    DepthNotPositive(usize),
    /// Depth that is said to be linear looks like the values of a depth buffer.
    DepthLooksEncoded,
    /// Hardware depth looks as if it were reversed, where it is said not to be, or the other way round.
    DepthLooksReversed,
    /// Normals are NaN or infinite at so many pixels.
    NormalsNotFinite(usize),
    /// Normals are zero at so many pixels.
    NormalsZero(usize),
    /// Normals agree with the surfaces if the sign of their z, in eye space, is changed.
    NormalsOfOtherHand,
    /// Normals agree with the surfaces if they are reversed: they face away from the eye.
    NormalsFaceAway,
    /// Normals agree with the surfaces if the sign of their y is changed.
    NormalsUpsideDown,
    /// Normals agree with the surfaces if they are read as biased, where they are said not to be, or the other way
    /// round.
    NormalsOfOtherEncoding,
    /// Normals agree with the surfaces if the view matrix is transposed: it leads from eye space to world space, or its
    /// numbers are in another order.
    ViewMatrixTransposed,
    /// Normals agree with the surfaces if they are turned by this angle in radians: they are in world space or in that
    /// of another camera.
    NormalsTurned(f64),
    /// Normals do not agree with the surfaces that depth shows, and no single change makes them do so. The number is
    /// the share of the pixels at which they are 26 degrees apart or more.
    NormalsDisagree(f64),
    /// R is so short in the picture that visibility is 1 at this share of the pixels.
    RadiusBelowTexels(f64),
    /// R is longer than the picture at this share of the pixels.
    RadiusBeyondPicture(f64),
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let pixels = |count: &usize| if *count == 1 { "1 pixel".into() } else { format!("{count} pixels") };
        match self {
            Finding::OnlyBackground => f.write_str(
                "no pixel holds a surface: check that depth is drawn before this call, and depth_encoding and background; \
                 after glClipControl the range of DepthEncoding::Matrix is ZeroToOne",
            ),
            Finding::DepthNotFinite(count) => write!(
                f,
                "depth is NaN or infinite at {}: write a finite depth of background, such as 1e17",
                pixels(count)
            ),
            Finding::DepthNotPositive(count) => {
                write!(f, "depth is 0 or negative at {}: z must increase away from the eye, above 0", pixels(count))
            }
            Finding::DepthLooksEncoded => f.write_str(
                "depth is said to be linear and lies in [0, 1] with many pixels at an end, as in a depth buffer: set \
                 depth_encoding",
            ),
            Finding::DepthLooksReversed => {
                f.write_str(
                    "hardware depth runs the other way than depth_encoding says: if that is standard, depth looks reversed, \
                     and if it is reversed, depth looks standard",
                )
            }
            Finding::NormalsNotFinite(count) => write!(f, "normals are NaN or infinite at {}", pixels(count)),
            Finding::NormalsZero(count) => write!(f, "normals are zero at {} that hold a surface", pixels(count)),
            Finding::NormalsOfOtherHand => f.write_str(
                "normals are of the other hand: their z has the wrong sign in eye space, set normal_space to the other \
                 Hand",
            ),
            Finding::NormalsFaceAway => f.write_str("normals face away from the eye: reverse them"),
            Finding::NormalsUpsideDown => {
                f.write_str("normals are upside down: their y points down in the picture, where it must point up")
            }
            Finding::NormalsOfOtherEncoding => f.write_str(
                "normals look as if they were stored the other way, as c or as c/2 + 1/2: set normal_encoding",
            ),
            Finding::ViewMatrixTransposed => f.write_str(
                "normals fit the transposed view matrix: give the matrix from world to eye space, column by column",
            ),
            Finding::NormalsTurned(angle) => write!(
                f,
                "normals fit the surfaces if they are turned by {angle:.2} radians ({:.0} degrees): they look like those of \
                 world space, or of another camera; set normal_space",
                angle.to_degrees()
            ),
            Finding::NormalsDisagree(share) => write!(
                f,
                "normals do not fit the surfaces that depth shows, at {:.0} % of the pixels they are far apart: check their \
                 space, and the projection",
                share * 100.0
            ),
            Finding::RadiusBelowTexels(share) => write!(
                f,
                "R covers so few texels that visibility is 1 at {:.0} % of the surfaces: check the unit of the radius, \
                 or set exit to Shorten",
                share * 100.0
            ),
            Finding::RadiusBeyondPicture(share) => write!(
                f,
                "R is longer than the picture at {:.0} % of the surfaces: check the unit of the radius",
                share * 100.0
            ),
        }
    }
}

/// From this share of pixels on, a value at the end of the range of depths is no accident.
const MANY: f64 = 0.005;

impl AmbientOcclusion {
    /// Looks for inputs that are plausible and still wrong, and returns what it finds, nothing where all looks right.
    /// It is meant for use while integrating: it compiles shaders and reads images back at every call. State is
    /// restored as by [`AmbientOcclusion::render`].
    ///
    /// It compares the normals with those that it rebuilds from depth, the stored depths with both ends of their range,
    /// and R with the texels of the picture. What a picture does not show, it cannot find: with a single wall in front
    /// of the camera, many mistakes make no difference. A near plane or a clip range that is not that of the depth
    /// buffer makes all of a scene larger or smaller, and its normals stay the same.
    ///
    /// # Errors
    /// The same as for [`AmbientOcclusion::render`].
    pub fn diagnose(&self, inputs: &Inputs) -> Result<Vec<Finding>, Error> {
        let gl = self.gl.clone();
        gl::check(&gl, super::PENDING)?;
        let state = SavedState::save(&gl, self.images.ao.first().map(|target| &target.canvas.framebuffer))?;
        state.put_back_after(&gl, || {
            let checked = inputs.check(&gl, self.size, self.settings.method)?;
            let seen = self.evidence(inputs, &checked, checked.curve)?;
            let mut findings = Vec::new();
            self.of_depth(inputs, &checked, &seen, &mut findings)?;
            if let (Some(_), true) = (inputs.normals, findings.is_empty()) {
                of_normals(&seen, &mut findings);
            }
            // Depth that is read wrongly makes the radius look wrong, too.
            if findings.is_empty() {
                self.of_radius(inputs, &seen, &mut findings)?;
            }
            Ok(findings)
        })
    }

    /// Draws what the passes would read, with depth decoded by this curve, and reads it back.
    fn evidence(&self, inputs: &Inputs, checked: &Checked, curve: Curve) -> Result<Evidence, Error> {
        let (gl, full_screen) = (&self.gl, &self.full_screen);
        let caller = ImageVariant::new(inputs.depth.target, inputs.viewport.is_some());
        let programs = &mut ProgramCache::new(gl);
        let image = LinearDepth::canvas(gl, self.size)?;
        let linear = LinearDepth::new(programs, caller, curve.into())?;
        let depth = linear.draw(full_screen, &image, &checked.depth, curve);
        let orthographic = !inputs.projection.is_perspective();
        let grid = Grid { full: self.size, scale: [1, 1] };
        let rebuilt = RebuiltNormals::canvas(gl, grid, None)?;
        RebuiltNormals::new(programs, ImageVariant::RECTANGLE, orthographic, grid.scale)?.draw(
            full_screen,
            (&rebuilt, grid),
            &depth,
            inputs.projection,
        );
        let inspect = Inspect::new(gl, ImageVariant::RECTANGLE, checked.normals_variant(inputs), self.size)?;
        inspect.draw(full_screen, &depth, checked.normals.as_ref());
        gl::check(gl, "inspect")?;
        let texels = |floats: Vec<f32>| floats.chunks_exact(4).map(|n| [n[0], n[1], n[2]].map(f64::from)).collect();
        let depths: Vec<f64> = inspect.depth.read()?.into_iter().map(f64::from).collect();
        Ok(Evidence {
            fine: depths.iter().map(|&z| self.is_fine(inputs, checked.precision, curve, z)).collect(),
            depth: depths,
            background: depth.background.into(),
            rebuilt: texels(rebuilt.texture.read()?),
            stored: texels(inspect.normals.read()?),
            encoding: inputs.normal_encoding,
            space: inputs.normal_space,
        })
    }

    /// Returns whether depth is stored finely enough at depth z that normals can be rebuilt from it: a step of the
    /// stored depth is at most a tenth of a pixel.
    fn is_fine(&self, inputs: &Inputs, Precision { float, bits }: Precision, curve: Curve, z: f64) -> bool {
        // The relative precision of the float formats, and the step of the others.
        let relative = if bits <= 16 { 2f64.powi(-11) } else { 2f64.powi(-24) };
        let unit = if float { relative } else { 2f64.powi(-bits) };
        let step = match curve {
            Curve::Linear => relative * z,
            Curve::Perspective { reversed: true, .. } if float => relative * z,
            Curve::Perspective { rise, .. } => unit * rise * z * z,
            Curve::Orthographic { range, .. } => unit * range,
            Curve::Logarithmic { logarithm, c } => unit * (z + 1.0 / c) * logarithm,
        };
        let [x, y] = inputs.projection.half_extents_at(z);
        let pixel = (2.0 * x / f64::from(self.size.0)).min(2.0 * y / f64::from(self.size.1));
        // The passes compute in float32.
        step + 2f64.powi(-23) * z <= 0.1 * pixel
    }

    fn of_depth(
        &self,
        inputs: &Inputs,
        checked: &Checked,
        seen: &Evidence,
        findings: &mut Vec<Finding>,
    ) -> Result<(), Error> {
        let count = |wrong: &dyn Fn(f64) -> bool| seen.depth.iter().filter(|&&z| wrong(z)).count();
        let pixels = seen.depth.len() as f64;
        let many = |count: usize| count > 0 && count as f64 >= MANY * pixels;
        for (wrong, finding) in [
            (count(&|z| !z.is_finite()), Finding::DepthNotFinite as fn(usize) -> Finding),
            (count(&|z| z <= 0.0 && z.is_finite()), Finding::DepthNotPositive),
        ] {
            if wrong > 0 {
                findings.push(finding(wrong));
            }
        }
        match checked.curve {
            Curve::Linear if count(&|z| !(0.0..=1.0).contains(&z)) == 0 && many(count(&|z| z == 0.0 || z == 1.0)) => {
                findings.push(Finding::DepthLooksEncoded);
            }
            Curve::Perspective { at_far, rise, reversed } => {
                let other = Curve::Perspective { at_far, rise, reversed: !reversed };
                let near = 1.0 / (at_far + rise);
                self.of_reversal(inputs, checked, (seen, other, near), findings)?;
            }
            Curve::Orthographic { near, range, reversed } => {
                let other = Curve::Orthographic { near, range, reversed: !reversed };
                self.of_reversal(inputs, checked, (seen, other, near), findings)?;
            }
            Curve::Linear | Curve::Logarithmic { .. } => {}
        }
        if findings.is_empty() && seen.covered().next().is_none() {
            findings.push(Finding::OnlyBackground);
        }
        Ok(())
    }

    /// Finds out whether depth fits better if it is decoded by the curve `other`.
    fn of_reversal(
        &self,
        inputs: &Inputs,
        checked: &Checked,
        (seen, other, near): (&Evidence, Curve, f64),
        findings: &mut Vec<Finding>,
    ) -> Result<(), Error> {
        // Surfaces are hardly ever exactly at the near plane. Pixels that were cleared to the other end are.
        let at_near = seen.depth.iter().filter(|&&z| (z - near).abs() <= 1e-6 * near.abs()).count();
        let mut reversed = at_near > 0 && at_near as f64 >= MANY * seen.depth.len() as f64;
        if !reversed && seen.covered().next().is_some() {
            let swapped = self.evidence(inputs, checked, other)?;
            // In perspective most of the range of d lies near the near plane. Read the wrong way round, a scene shrinks
            // to the near plane.
            let perspective = matches!(other, Curve::Perspective { .. });
            reversed = perspective && seen.median() < 1.3 * near && swapped.median() > 3.0 * near;
            if inputs.normals.is_some() {
                reversed |=
                    misfit(seen).zip(misfit(&swapped)).is_some_and(|(seen, swapped)| seen.is_explained_by(swapped));
            }
        }
        if reversed {
            findings.push(Finding::DepthLooksReversed);
        }
        Ok(())
    }

    fn of_radius(&self, inputs: &Inputs, seen: &Evidence, findings: &mut Vec<Finding>) -> Result<(), Error> {
        let covered = seen.covered().count() as f64;
        if !self.settings.method.reads("radius") || covered == 0.0 {
            return Ok(());
        }
        let share =
            |holds: &dyn Fn(f64) -> bool| seen.covered().filter(|&i| holds(seen.depth[i])).count() as f64 / covered;
        let radius_px = self.settings.radius_px(inputs.projection, self.size)?;
        let texels = |z: f64| radius_px.least(z);
        let exit = self.exit_depth(inputs.projection);
        let scale = f64::from(self.settings.ao_scale());
        let picture = f64::from(self.size.0.max(self.size.1)) / scale;
        let (below, beyond) = (share(&|z| z > exit || texels(z) < 1.0), share(&|z| texels(z) > picture));
        if below > 0.9 {
            findings.push(Finding::RadiusBelowTexels(below));
        }
        if beyond > 0.9 {
            findings.push(Finding::RadiusBeyondPicture(beyond));
        }
        Ok(())
    }
}

fn of_normals(seen: &Evidence, findings: &mut Vec<Finding>) {
    let count = |wrong: &dyn Fn([f64; 3]) -> bool| seen.covered().filter(|&i| wrong(seen.stored[i])).count();
    let not_finite = count(&|n| !n.iter().all(|c| c.is_finite()));
    let zero = if seen.encoding.is_octahedral() { 0 } else { count(&|n| seen.decoded(n) == [0.0; 3]) };
    if not_finite > 0 {
        findings.push(Finding::NormalsNotFinite(not_finite));
    }
    if zero > 0 {
        findings.push(Finding::NormalsZero(zero));
    }
    let normals = seen.normals();
    let Some(given) = Misfit::of(seen, &normals) else { return };
    let changed = |change: [f64; 3]| {
        normals.iter().map(|n| [n[0] * change[0], n[1] * change[1], n[2] * change[2]]).collect::<Vec<_>>()
    };
    let mut candidates = vec![
        (Finding::NormalsOfOtherHand, changed([1.0, 1.0, -1.0])),
        (Finding::NormalsFaceAway, changed([-1.0; 3])),
        (Finding::NormalsUpsideDown, changed([1.0, -1.0, 1.0])),
        (Finding::NormalsOfOtherEncoding, seen.otherwise_encoded().normals()),
    ];
    if let Some(transposed) = seen.transposed() {
        candidates.push((Finding::ViewMatrixTransposed, transposed.normals()));
    }
    let misfits = candidates.into_iter().filter_map(|(finding, normals)| Some((finding, Misfit::of(seen, &normals)?)));
    let explaining = misfits.filter(|(_, misfit)| given.is_explained_by(*misfit));
    if let Some((finding, _)) = explaining.min_by(|(_, a), (_, b)| a.order(b)) {
        findings.push(finding);
        return;
    }
    let (normals, angle) = turned(seen, &normals);
    if Misfit::of(seen, &normals).is_some_and(|misfit| given.is_explained_by(misfit)) {
        findings.push(Finding::NormalsTurned(angle));
    } else if given.apart > 0.3 {
        findings.push(Finding::NormalsDisagree(given.apart));
    }
}

/// Returns how far the caller's normals are from those rebuilt from depth.
fn misfit(seen: &Evidence) -> Option<Misfit> {
    Misfit::of(seen, &seen.normals())
}
