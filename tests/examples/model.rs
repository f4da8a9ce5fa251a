//! The built-in Cornell box, in the form in which an engine has a model: corners in float32, and a camera that looks
//! along -z, as in most engines on OpenGL.

use hbao::Error;
use hbao::glam::dcamera::rh::{proj::opengl::perspective, view::look_to_mat4};
use hbao::glam::{DVec3, Mat4};
use hbao::scene::{CORNELL_BOX, Camera, Mesh, Scene, View};

/// The eye, and the point that it looks at. The walls are seen at an angle, so that none of their normals lies along an
/// axis of eye space, where a mistake in the space of normals would not show.
const EYE: DVec3 = DVec3::new(450.0, 420.0, -700.0);
const TARGET: DVec3 = DVec3::new(270.0, 220.0, 280.0);

/// A model with its camera.
pub struct Model {
    /// The surfaces, each of one colour.
    pub parts: Vec<Part>,
    /// The camera. Its near and far planes enclose the model, whatever the size of the picture is.
    pub camera: Camera,
    /// The vertical field of view in radians.
    pub fov_y: f64,
    /// The radius of ambient occlusion that suits the model, in its units.
    pub radius: f64,
}

/// Triangles of one colour. Each three positions are a triangle, which may be wound either way.
pub struct Part {
    pub colour: [f32; 3],
    pub positions: Vec<[f32; 3]>,
    /// The unit normal of the triangle, for each of its corners.
    pub normals: Vec<[f32; 3]>,
}

impl Model {
    pub fn load() -> Result<Model, Error> {
        let Scene { mesh, view, radius, .. } = Scene::open(CORNELL_BOX)?;
        let oblique = View { eye: Some(EYE), target: Some(TARGET), ..View::default() };
        let (camera, _) = oblique.or(&view).camera(&mesh, super::SIZE.0, super::SIZE.1)?;
        let [_, tan_half_fov_y] = camera.projection.half_extents();
        let radius = radius.ok_or_else(|| Error::Usage("the scene has no radius of its own".into()))?;
        Ok(Model { parts: parts(&mesh), camera, fov_y: 2.0 * tan_half_fov_y.atan(), radius })
    }

    /// The matrix from world space to right-handed eye space: x right, y up, z backward.
    pub fn view(&self) -> Mat4 {
        look_to_mat4(self.camera.eye, self.camera.forward, self.camera.up).as_mat4()
    }

    /// The matrix from eye space to the clip space of OpenGL, for a picture of this size in pixels.
    pub fn projection(&self, (width, height): (u32, u32)) -> Mat4 {
        let aspect = f64::from(width) / f64::from(height);
        perspective(self.fov_y, aspect, self.camera.near, self.camera.far).as_mat4()
    }
}

fn parts(mesh: &Mesh) -> Vec<Part> {
    let part = |group: &hbao::scene::Group| {
        let mut part = Part { colour: group.colour, positions: Vec::new(), normals: Vec::new() };
        for triangle in &mesh.triangles[group.triangles.clone()] {
            let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
            let float32 = |v: DVec3| v.as_vec3().to_array();
            part.positions.extend([a, b, c].map(float32));
            part.normals.extend([float32((b - a).cross(c - a).normalize()); 3]);
        }
        part
    };
    mesh.groups.iter().map(part).collect()
}
