//! What EGL and GLX are asked for: OpenGL 3.3 core.

use glutin::config::{Api, ConfigSurfaceTypes, ConfigTemplate, ConfigTemplateBuilder};
use glutin::context::{ContextApi, ContextAttributes, ContextAttributesBuilder, GlProfile, Version};

/// The configuration, for a context that becomes current on such a surface. The defaults of glutin ask for OpenGL ES
/// and for a window with depth and stencil. All rendering goes to framebuffer objects, so any configuration that
/// supports OpenGL is good enough.
pub(super) fn configuration(surface: ConfigSurfaceTypes) -> ConfigTemplate {
    ConfigTemplateBuilder::new()
        .with_surface_type(surface)
        .with_api(Api::OPENGL)
        .with_alpha_size(0)
        .with_depth_size(0)
        .with_stencil_size(0)
        .build()
}

/// The context. It names neither a native window nor a context to share objects with.
pub(super) fn context() -> ContextAttributes {
    ContextAttributesBuilder::new()
        .with_profile(GlProfile::Core)
        .with_context_api(ContextApi::OpenGl(Some(Version::new(3, 3))))
        .build(None)
}
