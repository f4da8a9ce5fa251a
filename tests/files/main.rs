//! What is read and written, and what follows from it without OpenGL: models, cameras, image files and settings files.

mod camera;
mod image_files;
mod scene;
mod settings;
