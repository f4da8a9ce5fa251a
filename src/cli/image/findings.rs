//! Notices about results that the user hardly meant: what [`AmbientOcclusion::diagnose`] finds, in the words of the
//! command line.

use hbao::settings::Settings;
use hbao::{
    AmbientOcclusion, DepthEncoding, Error, Finding, Hand, Inputs, NormalEncoding, NormalSpace, Viewport, glow,
};
use std::sync::Arc;

/// The largest width and height of what is looked at, in pixels. Of a larger picture it is the part in the middle.
const LOOKED_AT: u32 = 2048;

/// Looks for inputs that are plausible and still wrong. `half` says that depth is too coarse for anything to be
/// concluded about normals.
pub(super) fn notices(
    gl: &Arc<glow::Context>,
    size: (u32, u32),
    settings: &Settings,
    inputs: &Inputs,
    half: bool,
) -> Result<Vec<String>, Error> {
    let (width, height) = (size.0.min(LOOKED_AT), size.1.min(LOOKED_AT));
    let (x, y) = ((size.0 - width) / 2, (size.1 - height) / 2);
    let viewport = ((width, height) != size).then_some(Viewport { x, y, width, height });
    let projection = match viewport {
        Some(_) => inputs.projection.part(size, (x.into(), y.into()), (width, height)),
        None => inputs.projection,
    };
    let inputs = Inputs { viewport, projection, normals: inputs.normals.filter(|_| !half), ..*inputs };
    let ao = AmbientOcclusion::new(gl.clone(), (width, height), settings)?;
    Ok(ao.diagnose(&inputs)?.iter().filter_map(|finding| in_words(finding, &inputs)).collect())
}

/// Says what was found and what to type, if no other notice says so.
fn in_words(finding: &Finding, inputs: &Inputs) -> Option<String> {
    let other_hand = |hand: Hand| if hand == Hand::Right { "left" } else { "right" };
    Some(match finding {
        // The verb says both itself, of the whole picture.
        Finding::OnlyBackground | Finding::RadiusBelowTexels(_) | Finding::RadiusBeyondPicture(_) => return None,
        Finding::DepthLooksEncoded => {
            "DEPTH lies from 0 to 1 with many pixels at an end, like the values of a depth buffer: if it is one, give \
             --depth-is hardware"
                .into()
        }
        Finding::DepthLooksReversed => match inputs.depth_encoding {
            DepthEncoding::Planes { reversed: true, .. } => "DEPTH does not look reversed: leave out --reversed".into(),
            DepthEncoding::Planes { .. } => "DEPTH looks reversed: give --reversed".into(),
            _ => "DEPTH looks as if depth fell towards the far end where --projection has it rise, or the other way round: \
                  check --projection and --clip-range"
                .into(),
        },
        Finding::NormalsOfOtherHand => match inputs.normal_space {
            NormalSpace::Eye(hand) => {
                format!("the z of NORMALS has the wrong sign: give --normals-are {}", other_hand(hand))
            }
            _ => "NORMALS fit if z of eye space is turned around: check --normals-are, --view-matrix and --view-axes".into(),
        },
        Finding::NormalsFaceAway => {
            "NORMALS face away from the eye: check --normals-are, or reverse them where they are written".into()
        }
        Finding::NormalsUpsideDown => {
            "the y of NORMALS has the wrong sign, it must point up in the picture: check --normals-are and --view-axes, or \
             change it where they are written"
                .into()
        }
        Finding::NormalsOfOtherEncoding => {
            let other = if inputs.normal_encoding == NormalEncoding::Signed { "biased" } else { "signed" };
            format!("NORMALS look stored in the other way: give --normals-encoding {other}")
        }
        Finding::ViewMatrixTransposed => {
            "NORMALS fit the transposed matrix: give --view-matrix row by row, and from world to eye space".into()
        }
        Finding::NormalsZero(count) => {
            format!("NORMALS are 0 at {count} pixels that hold a surface: check --normals-channels and --background")
        }
        Finding::NormalsTurned(angle) => format!(
            "NORMALS fit DEPTH if they are turned by {:.0} degrees: if they are in world space, give --normals-are world and \
             --view-matrix",
            angle.to_degrees()
        ),
        Finding::NormalsDisagree(share) => format!(
            "NORMALS do not fit the surfaces of DEPTH, at {:.0} % of the pixels they are far apart: check --normals-are, \
             --depth-is and the camera",
            share * 100.0
        ),
        other => other.to_string(),
    })
}
