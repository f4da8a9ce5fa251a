//! Tests of what needs no OpenGL: reading and writing models, cameras, image files and settings files.

mod camera;
mod formats;
mod image_files;
mod layers;
mod scene;
mod settings;
mod textures;

#[path = "../rig/formats.rs"]
#[allow(unreachable_pub)]
mod written;
