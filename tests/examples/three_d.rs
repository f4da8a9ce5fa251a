//! Embeds the library in an application of three-d, which has a window, a camera, meshes and materials of its own.

use application::{Frames, Model, SHADING, SIZE};
use hbao::glow::{self, HasContext};
use hbao::settings::{Radius, Settings};
use hbao::{
    AmbientOcclusion, Destination, Hand, Inputs, NormalEncoding, NormalSpace, Output, TextureRef, TextureTarget, Write,
};
use std::error::Error;
use std::sync::Arc;
use three_d::{
    Camera, ClearState, ColorTexture, Context, CopyEffect, CpuMesh, Cull, DepthTexture2D, EffectMaterialId, FrameInput,
    FrameOutput, Gm, Interpolation, Light, Material, MaterialType, Mesh, Positions, Program, RenderStates,
    RenderTarget, SurfaceSettings, Texture2DArray, Vec3, Viewer, Viewport, Window, WindowSettings, Wrapping, radians,
};

type Failure = Box<dyn Error>;

/// The layers of the G-buffer's colours.
const COLOUR: u32 = 0;
const NORMALS: u32 = 1;

/// A material that draws into both layers of the G-buffer. Normals are in world space, as everywhere in three-d's
/// shaders, and a layer of RGBA8 holds them as n/2 + 1/2, as three-d's own `NormalMaterial` does.
struct Surface {
    colour: Vec3,
}

impl Material for Surface {
    /// three-d finds compiled shaders by this number. Those below 0x5000 are the applications'.
    fn id(&self) -> EffectMaterialId {
        EffectMaterialId(0x0001)
    }

    fn fragment_shader_source(&self, _: &[&dyn Light]) -> String {
        format!(
            "{SHADING}
            uniform vec3 colour;
            uniform vec3 eye;
            uniform mat4 view;

            in vec3 pos;
            in vec3 nor;

            layout (location = {COLOUR}) out vec4 out_colour;
            layout (location = {NORMALS}) out vec4 out_normal;

            void main()
            {{
                // Both sides of a triangle are visible. The normal is that of the side that the eye sees.
                vec3 n = normalize(faceforward(nor, pos - eye, nor));
                out_colour = vec4(shaded(colour, mat3(view) * n), 1.0);
                out_normal = vec4(0.5 * n + 0.5, 1.0);
            }}"
        )
    }

    fn use_uniforms(&self, program: &Program, viewer: &dyn Viewer, _: &[&dyn Light]) {
        program.use_uniform("colour", self.colour);
        program.use_uniform("eye", viewer.position());
        program.use_uniform("view", viewer.view());
    }

    fn render_states(&self) -> RenderStates {
        RenderStates { cull: Cull::None, ..RenderStates::default() }
    }

    fn material_type(&self) -> MaterialType {
        MaterialType::Opaque
    }
}

/// A G-buffer of three-d's own textures.
struct GBuffer {
    /// Shaded colour, and normals.
    layers: Texture2DArray,
    depth: DepthTexture2D,
    /// The names that OpenGL has for the two textures.
    names: [glow::Texture; 2],
}

impl GBuffer {
    fn new(context: &Context, (width, height): (u32, u32)) -> Result<GBuffer, Failure> {
        let (near, clamp) = (Interpolation::Nearest, Wrapping::ClampToEdge);
        let layers = Texture2DArray::new_empty::<[u8; 4]>(context, width, height, 2, near, near, None, clamp, clamp);
        let depth = DepthTexture2D::new::<f32>(context, width, height, clamp, clamp);
        // three-d does not tell the names of its textures. OpenGL tells what is attached to a framebuffer; `clear`
        // binds it.
        let target = RenderTarget::new(layers.as_color_target(&[COLOUR, NORMALS], None), depth.as_depth_target());
        target.clear(ClearState::default());
        // SAFETY: the context is current.
        let name = |place| unsafe {
            let what = glow::FRAMEBUFFER_ATTACHMENT_OBJECT_NAME;
            let name = context.get_framebuffer_attachment_parameter_i32(glow::DRAW_FRAMEBUFFER, place, what);
            u32::try_from(name).ok().and_then(|name| name.try_into().ok()).map(glow::NativeTexture)
        };
        let names = name(glow::COLOR_ATTACHMENT0).zip(name(glow::DEPTH_ATTACHMENT));
        drop(target);
        let (colours, deep) = names.ok_or("a texture of the G-buffer has no name")?;
        Ok(GBuffer { layers, depth, names: [colours, deep] })
    }

    /// Draws the surfaces as the camera sees them.
    fn draw(&self, camera: &Camera, surfaces: &[Gm<Mesh, Surface>]) {
        let colours = self.layers.as_color_target(&[COLOUR, NORMALS], None);
        RenderTarget::new(colours, self.depth.as_depth_target())
            .clear(ClearState::color_and_depth(1.0, 1.0, 1.0, 1.0, 1.0))
            .render(camera, surfaces, &[]);
    }
}

// Ambient occlusion begins.
/// Prepares ambient occlusion, once. A context of three-d dereferences to one of glow, of the version that the library
/// takes.
fn occlusion(gl: &Arc<glow::Context>, size: (u32, u32), radius: f64) -> Result<AmbientOcclusion, Failure> {
    let settings = Settings { radius: Radius::Units(radius), ..Settings::default() };
    Ok(AmbientOcclusion::new(gl.clone(), size, &settings)?)
}

/// Multiplies the colour of the G-buffer by visibility, in each frame.
fn darken(ao: &mut AmbientOcclusion, gbuffer: &GBuffer, camera: &Camera) -> Result<(), Failure> {
    let [colours, depth] = gbuffer.names;
    let layer = |layer| TextureRef { texture: colours, target: TextureTarget::Layer(layer) };
    let inputs = Inputs {
        normals: Some(layer(NORMALS)),
        normal_encoding: NormalEncoding::Biased,
        normal_space: NormalSpace::world(camera.view().as_ref(), Hand::Right),
        ..Inputs::from_matrix(depth, colours, TextureTarget::Texture2d, camera.projection().as_ref())?
    };
    let output = Output::new(Destination::Texture(layer(COLOUR)), Write::Multiplied(1.0));
    Ok(ao.render_into(&inputs, &output)?)
}
// Ambient occlusion ends.

/// The model as three-d draws it.
fn surfaces(context: &Context, model: &Model) -> Vec<Gm<Mesh, Surface>> {
    let vectors = |all: &[[f32; 3]]| all.iter().map(|&v| v.into()).collect::<Vec<Vec3>>();
    let surface = |part: &application::Part| {
        let positions = Positions::F32(vectors(&part.positions));
        let mesh = CpuMesh { positions, normals: Some(vectors(&part.normals)), ..CpuMesh::default() };
        Gm::new(Mesh::new(context, &mesh), Surface { colour: part.colour.into() })
    };
    model.parts.iter().map(surface).collect()
}

/// The model's camera, as three-d has cameras. The target is taken far away, where rounding to float32 turns the view
/// least.
fn camera(model: &Model, viewport: Viewport) -> Camera {
    let hbao::scene::Camera { eye, forward, up, near, far, .. } = model.camera;
    let [eye, target, up] = [eye, eye + far * forward, up].map(|v| v.as_vec3().to_array().into());
    Camera::new_perspective(viewport, eye, target, up, radians(model.fov_y as f32), near as f32, far as f32)
}

/// What the window shows.
struct Application {
    model: Model,
    surfaces: Vec<Gm<Mesh, Surface>>,
    occlusion: AmbientOcclusion,
    /// The G-buffer has the size of the window. It is made in the first frame, and again after the size has changed.
    gbuffer: Option<(Viewport, GBuffer)>,
}

impl Application {
    /// Draws a frame into the window.
    fn draw(&mut self, frame: &FrameInput) -> Result<(), Failure> {
        let (context, viewport): (&Context, Viewport) = (&frame.context, frame.viewport);
        if self.gbuffer.as_ref().is_none_or(|(old, _)| *old != viewport) {
            let size = (viewport.width, viewport.height);
            self.gbuffer = Some((viewport, GBuffer::new(context, size)?));
            self.occlusion.resize(size)?;
        }
        let Some((_, gbuffer)) = &self.gbuffer else { return Ok(()) };
        let camera = camera(&self.model, viewport);
        gbuffer.draw(&camera, &self.surfaces);
        darken(&mut self.occlusion, gbuffer, &camera)?;
        let colour = ColorTexture::Array { texture: &gbuffer.layers, layers: &[COLOUR] };
        frame.screen().apply_screen_effect(&CopyEffect::default(), &camera, &[], Some(colour), None);
        Ok(())
    }
}

fn main() -> Result<(), Failure> {
    let (model, mut frames) = (Model::load()?, Frames::from_arguments()?);
    let window = Window::new(WindowSettings {
        title: "hbao in three-d".into(),
        initial_size: Some(SIZE),
        // Everything is drawn into textures, so that the window itself needs neither samples nor depth.
        surface_settings: SurfaceSettings { multisamples: 0, depth_buffer: 0, ..SurfaceSettings::default() },
        ..WindowSettings::default()
    })?;
    let surfaces = surfaces(&window.gl(), &model);
    let occlusion = occlusion(&window.gl(), SIZE, model.radius)?;
    let mut application = Application { model, surfaces, occlusion, gbuffer: None };
    window.render_loop(move |frame| {
        let Viewport { x, y, width, height } = frame.viewport;
        let drawn = application
            .draw(&frame)
            .and_then(|()| Ok(frames.drawn(&frame.context, [x, y, width as i32, height as i32])?));
        // The loop of three-d does not return, so that a failure is reported here.
        let exit = drawn.unwrap_or_else(|failure| {
            eprintln!("three_d: {failure}");
            std::process::exit(1)
        });
        FrameOutput { exit, ..FrameOutput::default() }
    });
    Ok(())
}
