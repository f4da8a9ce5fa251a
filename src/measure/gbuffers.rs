//! A cache of G-buffers. Combinations of settings share a G-buffer if they differ only in settings of later passes.

use super::Shot;
use crate::pipeline::check_depth_range;
use crate::scene::{Camera, Mesh};
use crate::settings::{DepthFormat, NormalFormat, Normals, Settings};
use crate::{Error, Inputs, Pipeline, Request};
use std::sync::Arc;

/// Everything that determines the images of a G-buffer.
struct Key<'a> {
    mesh: &'a Mesh,
    camera: Camera,
    size: (u32, u32),
    msaa: u32,
    normals: Normals,
    normal_format: NormalFormat,
    depth_format: DepthFormat,
}

impl<'a> Key<'a> {
    fn of(shot: Shot<'a>, settings: &Settings) -> Key<'a> {
        let Shot { mesh, camera, size } = shot;
        let &Settings { msaa, normals, normal_format, depth_format, .. } = settings;
        Key { mesh, camera: *camera, size, msaa, normals, normal_format, depth_format }
    }
}

impl PartialEq for Key<'_> {
    fn eq(&self, other: &Self) -> bool {
        // The keys borrow their meshes, so an address stands for one mesh only.
        std::ptr::eq(self.mesh, other.mesh)
            && self.camera == other.camera
            && self.size == other.size
            && self.msaa == other.msaa
            && self.normals == other.normals
            && self.normal_format == other.normal_format
            && self.depth_format == other.depth_format
    }
}

/// The G-buffers that have been rendered so far, one for each [`Key`].
pub(super) struct GBuffers<'a> {
    gl: Arc<glow::Context>,
    /// Whether the G-buffers hold colours, which only final images need.
    colour: bool,
    rendered: Vec<(Key<'a>, Pipeline)>,
}

impl<'a> GBuffers<'a> {
    /// Makes an empty cache of G-buffers without colours.
    pub(super) fn new(gl: &Arc<glow::Context>) -> GBuffers<'a> {
        GBuffers { gl: gl.clone(), colour: false, rendered: Vec::new() }
    }

    /// Makes an empty cache of G-buffers with colours, for pipelines beside them that make final images.
    pub(super) fn with_colours(gl: &Arc<glow::Context>) -> GBuffers<'a> {
        GBuffers { colour: true, ..GBuffers::new(gl) }
    }

    /// Returns the pipeline that holds the G-buffer of a shot with these settings. The first call for a G-buffer
    /// renders it.
    pub(super) fn of(&mut self, shot: Shot<'a>, settings: &Settings) -> Result<&Pipeline, Error> {
        // Whether the depth format suffices also depends on the radius, which is not part of the key.
        check_depth_range(settings, shot.camera)?;
        let key = Key::of(shot, settings);
        let known = self.rendered.iter().position(|(known, _)| *known == key);
        let index = match known {
            Some(index) => index,
            None => {
                let request = Request { gbuffer_only: true, colour: self.colour, ..Request::default() };
                let mut pipeline = Pipeline::new(&self.gl, shot.size, settings, request)?;
                pipeline.render(shot.mesh, shot.camera)?;
                self.rendered.push((key, pipeline));
                self.rendered.len() - 1
            }
        };
        Ok(&self.rendered[index].1)
    }

    /// Returns the inputs from which ambient occlusion with these settings is computed.
    pub(super) fn inputs(&mut self, shot: Shot<'a>, settings: &Settings) -> Result<Inputs, Error> {
        Ok(self.of(shot, settings)?.inputs(shot.camera))
    }
}
