//! Tests of what needs no OpenGL: reading and writing models, cameras, image files and settings files.

mod camera;
mod image_files;
mod layers;
mod scene;
mod settings;
mod textures;
