//! Measures cases in interleaved rounds.

use super::cases::Case;
use super::measurement::Measurement;
use crate::measure::gbuffers::GBuffers;
use crate::measure::times::{is_ao, is_blur, median, sum};
use crate::measure::{Reach, Shot};
use crate::scene::{Camera, Mesh, View};
use crate::settings::Settings;
use crate::{AmbientOcclusion, Apply, Error, Pipeline, Request, Timers};
use std::sync::Arc;
use std::time::Instant;

/// Measures all cases in turn, in `runs` rounds, so that anything that slows the machine down for a while slows all
/// cases down alike. A first round, which compiles the shaders, is not counted. `progress` is called after each frame.
/// The textures of all cases exist at the same time; cases with the same G-buffer share it.
///
/// # Errors
/// [`Error::Gl`] if the driver refuses a shader, an allocation or a call. [`Error::Usage`] if the view gives no camera
/// for an image of this size.
pub fn measure(
    gl: &Arc<glow::Context>,
    mesh: &Mesh,
    view: &View,
    cases: &[Case],
    runs: usize,
    progress: impl Fn(),
) -> Result<Vec<Measurement>, Error> {
    let mut finer: Vec<Mesh> = Vec::new();
    for _ in 0..cases.iter().map(|case| case.subdivisions).max().unwrap_or(0) {
        finer.push(finer.last().unwrap_or(mesh).subdivided());
    }
    let camera = |case: &Case| Ok(view.camera(mesh, case.size.0, case.size.1)?.0);
    let cameras: Vec<Camera> = cases.iter().map(camera).collect::<Result<_, Error>>()?;
    let mut timers = Timers::new(gl, true)?;
    let mut gbuffers = GBuffers::with_colours(gl);
    let mut all = Vec::new();
    for (case, camera) in cases.iter().zip(&cameras) {
        // The cache renders the mesh once without cutting its triangles. After this the driver has made the memory of
        // the G-buffer ready, before anything is timed. Finer meshes are then drawn into the same G-buffer.
        let gbuffer = gbuffers.of(Shot { mesh, camera, size: case.size }, &case.settings)?;
        let drawn = Settings { method: case.method(), ..case.settings.clone() };
        let reach = Reach::of(&gbuffer.depth()?, camera.projection, &drawn)?;
        let mesh = case.subdivisions.checked_sub(1).map_or(mesh, |level| &finer[level as usize]);
        let request =
            Request { composite: Some(Apply::All), without_ao: case.without_ao, timings: true, ..Request::default() };
        let start = Instant::now();
        let pipeline = gbuffer.beside(&case.settings, request)?;
        let made_ms = milliseconds(start);
        let floor = match case.fetches() {
            0 => None,
            _ => Some(AmbientOcclusion::fetch_floor(gl.clone(), case.size, &case.settings)?),
        };
        let (triangles, notices) = (mesh.triangles.len(), pipeline.notices().to_vec());
        let measured = Measurement::begin(case.clone(), pipeline.samples(), triangles, reach, notices);
        all.push(Running { mesh, camera, pipeline, floor, wall_ms: vec![made_ms], measured });
    }
    for run in 0..=runs {
        for running in &mut all {
            running.run(&mut timers, run > 0)?;
            progress();
        }
    }
    Ok(all.into_iter().map(Running::finish).collect())
}

/// A case that is being measured.
struct Running<'a> {
    mesh: &'a Mesh,
    camera: &'a Camera,
    pipeline: Pipeline,
    floor: Option<AmbientOcclusion>,
    /// Milliseconds by the system's clock: first for making the pipeline, then for each frame.
    wall_ms: Vec<f64>,
    measured: Measurement,
}

impl Running<'_> {
    /// Renders a frame, and then the floor of its AO pass.
    fn run(&mut self, timers: &mut Timers, counted: bool) -> Result<(), Error> {
        let start = Instant::now();
        let frame = self.pipeline.render(self.mesh, self.camera)?;
        self.wall_ms.push(milliseconds(start));
        if let Some(floor) = &mut self.floor {
            floor.render_timed(&self.pipeline.inputs(self.camera), timers)?;
            let floor = timers.take();
            if counted {
                self.measured.floor_ms.push(sum(&floor, is_ao));
            }
        }
        if counted {
            self.measured.frame_ms.push(sum(&frame, |_| true));
            self.measured.gbuffer_ms.push(sum(&frame, |pass| matches!(pass, "gbuffer" | "resolve")));
            self.measured.ao_ms.push(sum(&frame, is_ao));
            self.measured.blur_ms.push(sum(&frame, is_blur));
        }
        Ok(())
    }

    fn finish(self) -> Measurement {
        let compile_ms = match self.wall_ms.as_slice() {
            [made, first, others @ ..] => (made + first - median(others)).max(0.0),
            _ => f64::NAN,
        };
        Measurement { compile_ms, ..self.measured }
    }
}

fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}
