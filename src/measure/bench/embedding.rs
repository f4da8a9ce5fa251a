//! Measures what an application pays that embeds the library: for changing settings, and for inputs as it has them.

use crate::measure::gbuffers::GBuffers;
use crate::measure::times::{is_ao, sum};
use crate::measure::{Shot, median};
use crate::scene::{Mesh, View};
use crate::settings::{Method, Radius, Settings};
use crate::{
    AmbientOcclusion, BACKGROUND_R32F, DepthEncoding, DepthSamples, Error, InputTextures, Inputs, TextureRef,
    TextureTarget, Timers,
};
use std::sync::Arc;
use std::time::Instant;

/// The size of the frames in which settings change. So small a frame takes little more than the calls of OpenGL.
pub const SMALL: (u32, u32) = (16, 16);

/// How many frames one run renders.
const FRAMES: usize = 100;

/// What changing one setting adds to a frame of [`SMALL`] pixels.
#[derive(Clone, Debug)]
pub struct Change {
    /// The setting that changes in every frame.
    pub setting: &'static str,
    /// The milliseconds that it adds to a frame, by the system's clock: the mean over 100 frames, less that of 100
    /// frames without a change; one for each run. It may be below 0 by the noise of the clock.
    pub added_ms: Vec<f64>,
}

/// Measures what changing a setting from frame to frame adds to a frame, for the settings that an application may have
/// on sliders: those that are numbers to the shaders, and for comparison the number of steps, between two values whose
/// shaders are both kept, and to values that were never set, so that a shader is compiled.
///
/// # Errors
/// [`Error::Gl`] if the driver refuses a shader, an allocation or a call. [`Error::Usage`] if the view gives no camera,
/// or for a radius in percent.
pub fn changes(
    gl: &Arc<glow::Context>,
    mesh: &Mesh,
    view: &View,
    base: &Settings,
    runs: usize,
    progress: impl Fn(),
) -> Result<Vec<Change>, Error> {
    let camera = view.camera(mesh, SMALL.0, SMALL.1)?.0;
    let base = Settings { msaa: 1, bias: 0.1, strength: 1.0, ..base.clone() };
    let length = base.radius_in(camera.projection)?.at(1.0);
    let mut gbuffers = GBuffers::new(gl);
    let inputs = gbuffers.inputs(Shot { mesh, camera: &camera, size: SMALL }, &base)?;
    let mut ao = AmbientOcclusion::new(gl.clone(), SMALL, &base)?;
    ao.prepare(&inputs)?;
    // Each changes one field by a share that differs from frame to frame, or counts the frames.
    let factor = |frame: usize| 1.0 + 0.001 * (frame % 50) as f64;
    let changed = |setting: &str, frame: usize| match setting {
        "radius" => Settings { radius: Radius::Units(length * factor(frame)), ..base.clone() },
        "strength" => Settings { strength: factor(frame), ..base.clone() },
        "bias" => Settings { bias: 0.1 * factor(frame), ..base.clone() },
        "blur-depth-sigma" => Settings { blur_depth_sigma: Some(length * factor(frame)), ..base.clone() },
        "steps, kept" => Settings { steps: 4 + (frame % 2) as u32, ..base.clone() },
        // Few frames are rendered, so that hardly any value comes back.
        _ => Settings { steps: 1 + (frame % 100) as u32, ..base.clone() },
    };
    let mut frame = 0;
    let mut seconds_of = |setting: Option<&str>, frames: usize| -> Result<f64, Error> {
        let start = Instant::now();
        for _ in 0..frames {
            if let Some(setting) = setting {
                ao.set(&changed(setting, frame))?;
                frame += 1;
            }
            ao.render(&inputs)?;
        }
        // Reading back waits for the frames.
        ao.image()?;
        Ok(start.elapsed().as_secs_f64() / frames as f64)
    };
    ["radius", "strength", "bias", "blur-depth-sigma", "steps, kept", "steps, compiled"]
        .map(|setting| {
            let frames = if setting == "steps, compiled" { 4 } else { FRAMES };
            // The first frames may compile, and are not counted.
            seconds_of(Some(setting), 2)?;
            let mut added_ms = Vec::new();
            for _ in 0..runs {
                let plain = seconds_of(None, FRAMES)?;
                added_ms.push(1e3 * (seconds_of(Some(setting), frames)? - plain));
                progress();
            }
            Ok(Change { setting, added_ms })
        })
        .into_iter()
        .collect()
}

/// What one form of inputs costs, in milliseconds, one for each run; 0 for a pass that is not needed. As in
/// [`super::Measurement`], the driver's timer measures, or the clock if there is none.
#[derive(Clone, Debug)]
pub struct InputCost {
    /// The form of the inputs.
    pub inputs: &'static str,
    /// The time of the pass `linear_depth`.
    pub linear_depth_ms: Vec<f64>,
    /// The time of the pass `rebuilt_normals`.
    pub rebuilt_normals_ms: Vec<f64>,
    /// The time of the AO pass, for comparison.
    pub ao_ms: Vec<f64>,
}

/// Measures the passes that bring inputs to the form that the AO pass reads: encoded and multisample depth, and missing
/// normals, at this size and for `hbao`, in interleaved rounds. The values of depth buffers are in R32F textures, like
/// copies of depth buffers.
///
/// # Errors
/// The same as for [`changes`].
pub fn input_costs(
    gl: &Arc<glow::Context>,
    (mesh, view, size): (&Mesh, &View, (u32, u32)),
    base: &Settings,
    runs: usize,
    progress: impl Fn(),
) -> Result<Vec<InputCost>, Error> {
    let camera = view.camera(mesh, size.0, size.1)?.0;
    let &Settings { radius, directions, steps, .. } = base;
    let settings = Settings { radius, directions, steps, msaa: 1, blur: 0, ..Settings::for_method(Method::Hbao) };
    let shot = Shot { mesh, camera: &camera, size };
    let mut gbuffers = GBuffers::new(gl);
    let gbuffer = gbuffers.of(shot, &settings)?;
    let (depth, normals) = (gbuffer.depth()?, gbuffer.normals()?);
    let (near, far) = (camera.near, camera.far);
    // d of a depth buffer; background is at the far end.
    let stored =
        |d: &dyn Fn(f64) -> f64, end: f32| depth.map(|z| if z.is_finite() { d(f64::from(z)) as f32 } else { end });
    let linear = depth.map(|z| z.min(BACKGROUND_R32F));
    let mut forms = vec![
        ("linear depth and normals", linear.clone(), DepthEncoding::Linear, true),
        ("linear depth alone", linear, DepthEncoding::Linear, false),
    ];
    // These formulas are those of a perspective.
    if camera.projection.is_perspective() {
        let standard = stored(&|z| (1.0 / near - 1.0 / z) / (1.0 / near - 1.0 / far), 1.0);
        let reversed = stored(&|z| near / z, 0.0);
        let logarithmic = stored(&|z| (z + 1.0).ln() / (far + 1.0).ln(), 1.0);
        forms.extend([
            ("hardware depth", standard, DepthEncoding::standard(near, far), true),
            ("reversed, far at infinity", reversed, DepthEncoding::reversed(near, f64::INFINITY), true),
            ("logarithmic depth", logarithmic, DepthEncoding::Logarithmic { c: 1.0, far }, true),
        ]);
    }
    let mut textures = Vec::new();
    let mut all: Vec<(InputCost, Inputs)> = Vec::new();
    let cost = |inputs| InputCost { inputs, linear_depth_ms: vec![], rebuilt_normals_ms: vec![], ao_ms: vec![] };
    for (name, image, depth_encoding, given) in forms {
        let uploaded = InputTextures::new(gl, &image, given.then_some(&normals))?;
        all.push((cost(name), Inputs { depth_encoding, ..uploaded.inputs(camera.projection) }));
        textures.push(uploaded);
    }
    let multisample = gbuffers.inputs(shot, &Settings { msaa: 4, ..settings.clone() })?;
    if let Some(DepthSamples { texture, samples }) = multisample.samples {
        let depth = TextureRef { texture, target: TextureTarget::Multisample(samples) };
        all.push((cost("multisample linear depth"), Inputs { depth, samples: None, ..multisample }));
    }
    let mut passes = Vec::new();
    for (_, inputs) in &all {
        let mut ao = AmbientOcclusion::new(gl.clone(), size, &settings)?;
        ao.prepare(inputs)?;
        passes.push(ao);
    }
    let mut timers = Timers::new(gl, true)?;
    for _ in 0..runs {
        for ((cost, inputs), ao) in all.iter_mut().zip(&mut passes) {
            ao.render_timed(inputs, &mut timers)?;
            let times = timers.take();
            cost.linear_depth_ms.push(sum(&times, |pass| pass == "linear_depth"));
            cost.rebuilt_normals_ms.push(sum(&times, |pass| pass == "rebuilt_normals"));
            cost.ao_ms.push(sum(&times, is_ao));
        }
        progress();
    }
    Ok(all.into_iter().map(|(cost, _)| cost).collect())
}

impl InputCost {
    /// Returns the time of the passes that the form of the inputs needs, divided by that of the AO pass.
    #[must_use]
    pub fn share(&self) -> f64 {
        (median(&self.linear_depth_ms) + median(&self.rebuilt_normals_ms)) / median(&self.ao_ms)
    }
}
