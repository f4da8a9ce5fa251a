//! What the three applications have in common, and what a real one has long before it has ambient occlusion: a model, a
//! G-buffer, a command line.

mod frames;
mod gbuffer;
mod model;

pub use frames::Frames;
pub use gbuffer::GBuffer;
pub use model::{Model, Part};

/// The size of the pictures that are compared, in pixels.
pub const SIZE: (u32, u32) = (640, 480);

/// The light of the scene, which is that of `hbao render`: a colour is multiplied by 0.4, and by another 0.6 where the
/// surface faces the light.
pub const SHADING: &str = "
    // The unit vector towards the light, in eye space: it comes from over the viewer's left shoulder.
    const vec3 LIGHT = vec3(-0.3980149, 0.5970223, 0.6965261);

    vec3 shaded(vec3 colour, vec3 eye_normal)
    {
        return colour * (0.4 + 0.6 * max(dot(eye_normal, LIGHT), 0.0));
    }
";
