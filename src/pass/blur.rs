//! The cross-bilateral blur (ShaderX7 6.2), separated in X and Y or in full.

use super::{DepthInput, FETCH, FULLSCREEN, FullScreen, TextureTarget, depth_defines};
use crate::Error;
use crate::gl::{Program, Texture, source};
use std::sync::Arc;

/// Which taps a pass takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Kernel {
    X,
    Y,
    Full,
}

/// The pass.
pub(crate) struct Blur {
    program: Program,
}

impl Blur {
    /// `width` is the kernel's, odd.
    pub(crate) fn new(
        gl: &Arc<glow::Context>,
        kernel: Kernel,
        width: u32,
        depth: TextureTarget,
    ) -> Result<Blur, Error> {
        let radius = width / 2;
        // s = (radius + 1) / 2 texels.
        let sigma = f64::from(radius + 1) / 2.0;
        let weights: Vec<String> =
            (0..=radius).map(|k| format!("{:?}", (-f64::from(k * k) / (2.0 * sigma * sigma)).exp() as f32)).collect();
        let defines = depth_defines(depth).value("RADIUS", radius).value("SPATIAL", weights.join(", ")).word(
            "KERNEL",
            match kernel {
                Kernel::X => "x",
                Kernel::Y => "y",
                Kernel::Full => "full",
            },
        );
        let program = Program::new(gl, &defines, FULLSCREEN, &[FETCH, source!("blur.frag")])?;
        Ok(Blur { program })
    }

    /// Blurs `ao` into the bound target. `depth_sigma` is s_z in scene units.
    pub(crate) fn draw(&self, full_screen: &FullScreen, ao: &Texture, depth: &DepthInput, depth_sigma: f64) {
        let program = self.program.bind();
        depth.bind(full_screen, program, 0);
        full_screen.bind_texture(1, ao.into());
        program.unit("ao_image", 1).float("inverse_2_sigma_squared", 1.0 / (2.0 * depth_sigma * depth_sigma));
        full_screen.draw();
    }
}
