//! The same equations in float64 on the CPU, without OpenGL: a twin by name of each pass, and ray casting. They are
//! written to be read beside the shaders and to be right, not to be fast.

pub mod blur;
pub mod gbuffer;
pub mod hbao;
pub mod trace;
