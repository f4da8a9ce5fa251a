//! Small scenes in which it is clear what must be seen. World space has y up, and lengths are about 1.

use glam::{DVec3, dvec3};
use hbao::scene::{Camera, Group, Lens, Mesh, Scene, View};

/// A scene with its camera, and an AO radius that is about as large as the objects in it.
#[derive(Clone)]
pub struct Shot {
    pub name: &'static str,
    pub mesh: Mesh,
    pub view: View,
    pub radius: f64,
    /// The height of the picture if it is orthographic.
    pub height: f64,
}

impl Shot {
    pub fn new(name: &'static str, mesh: Mesh, view: View, radius: f64) -> Shot {
        Shot { name, mesh, view, radius, height: 20.0 * radius }
    }

    pub fn camera(&self, (width, height): (u32, u32)) -> Camera {
        self.view.camera(&self.mesh, width, height).unwrap().0
    }

    pub fn orthographic(mut self) -> Shot {
        self.view.lens = Some(Lens::Height(self.height));
        self
    }

    /// Returns the same shot with the camera tilted to one side, so that depth varies along every row of the picture.
    pub fn rolled(mut self) -> Shot {
        self.view.up = Some(dvec3(0.13, 1.0, 0.05));
        self
    }

    /// Returns the same shot of a world in which every length is multiplied by `factor`.
    pub fn scaled(&self, factor: f64) -> Shot {
        let scale = |p: Option<DVec3>| p.map(|p| p * factor);
        let lens = match self.view.lens {
            Some(Lens::Height(height)) => Some(Lens::Height(height * factor)),
            lens => lens,
        };
        let view = View { eye: scale(self.view.eye), target: scale(self.view.target), lens, ..self.view.clone() };
        Shot { mesh: self.moved(|p| p * factor), view, radius: self.radius * factor, ..self.clone() }
    }

    /// Returns the same shot with left and right exchanged. The camera must look along the plane x = 0.
    pub fn mirrored(&self) -> Shot {
        let mirror = |p: DVec3| dvec3(-p.x, p.y, p.z);
        let view = View { eye: self.view.eye.map(mirror), target: self.view.target.map(mirror), ..self.view.clone() };
        Shot { mesh: self.moved(mirror), view, ..self.clone() }
    }

    fn moved(&self, f: impl Fn(DVec3) -> DVec3) -> Mesh {
        let positions = self.mesh.positions.iter().map(|&p| f(p)).collect();
        let mesh = Mesh::new(positions, self.mesh.triangles.clone()).unwrap();
        mesh.with_groups(self.mesh.groups.clone()).unwrap()
    }
}

/// The built-in Cornell box.
pub fn cornell_box() -> Shot {
    let scene = Scene::open("cornell-box").unwrap();
    Shot { name: "cornell-box", mesh: scene.mesh, view: scene.view, radius: scene.radius.unwrap(), height: 620.0 }
}

/// The built-in church interior.
pub fn nave() -> Shot {
    let scene = Scene::open("nave").unwrap();
    Shot { name: "nave", mesh: scene.mesh, view: scene.view, radius: scene.radius.unwrap(), height: 12.0 }
}

/// A floor that ends before the horizon, with background above it.
pub fn floor() -> Shot {
    shot("floor", dvec3(0.0, 1.5, 5.0), DVec3::ZERO, &[ground()])
}

/// The floor, and a wall that stands on it.
pub fn floor_and_wall() -> Shot {
    let wall = quad(dvec3(-2.5, 0.0, -1.0), dvec3(5.0, 0.0, 0.0), dvec3(0.0, 1.2, 0.0));
    shot("floor-and-wall", dvec3(0.5, 1.5, 4.0), dvec3(0.0, 0.4, 0.0), &[ground(), wall])
}

/// A box that stands on the floor, turned so that three of its sides are visible.
pub fn box_on_a_floor() -> Shot {
    let cuboid = cuboid(DVec3::ZERO, dvec3(0.8, 0.0, 0.5), dvec3(-0.4, 0.0, 0.64), 0.9);
    shot("box-on-a-floor", dvec3(-0.7, 2.0, 4.0), dvec3(0.2, 0.3, 0.3), &[ground(), cuboid])
}

/// One plane that is tilted both ways and lies entirely inside the picture.
pub fn tilted_plane() -> Shot {
    let plane = quad(dvec3(-2.0, -0.5, 1.0), dvec3(3.0, 1.0, -2.5), dvec3(0.4, 1.5, 0.6));
    shot("tilted-plane", dvec3(0.0, 1.0, 5.0), dvec3(0.0, 0.5, 0.0), &[plane])
}

/// A ball of triangles above the floor.
pub fn ball() -> Shot {
    const COLUMNS: usize = 24;
    const ROWS: usize = 12;
    let point = |column: usize, row: usize| {
        let (turn, polar) = (column as f64 / COLUMNS as f64, row as f64 / ROWS as f64);
        let (a, b) = (turn * std::f64::consts::TAU, polar * std::f64::consts::PI);
        dvec3(0.0, 0.75, 0.0) + 0.7 * dvec3(b.sin() * a.cos(), b.cos(), b.sin() * a.sin())
    };
    let mut triangles = Vec::new();
    for column in 0..COLUMNS {
        for row in 0..ROWS {
            let [a, b] = [point(column, row), point(column + 1, row)];
            let [c, d] = [point(column, row + 1), point(column + 1, row + 1)];
            if row > 0 {
                triangles.push([a, b, c]);
            }
            if row < ROWS - 1 {
                triangles.push([b, d, c]);
            }
        }
    }
    shot("ball", dvec3(0.3, 1.6, 4.0), dvec3(0.0, 0.5, 0.0), &[ground(), triangles])
}

/// A plate in front of a larger one, with a gap between them that is much deeper than the radius.
pub fn two_layers() -> Shot {
    let plate = |z: f64, half: f64| {
        quad(dvec3(-half, -half, z), dvec3(2.0 * half, 0.0, 0.0), dvec3(0.0, 2.0 * half, 0.3 * half))
    };
    shot("two-layers", dvec3(0.3, 0.5, 5.0), DVec3::ZERO, &[plate(-3.0, 2.0), plate(0.5, 0.8)])
}

/// A pole not much wider than a pixel, in front of a wall.
pub fn pole() -> Shot {
    let wall = quad(dvec3(-2.0, 0.0, -0.8), dvec3(4.0, 0.0, 0.3), dvec3(0.0, 1.5, 0.0));
    // No edge lies on a column of pixel centres. If one did, a vertex rounded by 1/256 of a pixel would change a whole
    // column.
    let pole = cuboid(dvec3(0.115, 0.0, -0.2), dvec3(0.06, 0.0, 0.0), dvec3(0.0, 0.0, 0.06), 1.2);
    shot("pole", dvec3(0.2, 1.2, 4.0), dvec3(0.0, 0.6, 0.0), &[ground(), wall, pole])
}

/// All of these scenes except the nave.
pub fn all() -> Vec<Shot> {
    vec![cornell_box(), floor(), floor_and_wall(), box_on_a_floor(), tilted_plane(), ball(), two_layers(), pole()]
}

type Triangles = Vec<[DVec3; 3]>;

fn ground() -> Triangles {
    quad(dvec3(-3.0, 0.0, 3.0), dvec3(6.0, 0.0, 0.0), dvec3(0.0, 0.0, -6.0))
}

/// The parallelogram that two edges span.
fn quad(corner: DVec3, a: DVec3, b: DVec3) -> Triangles {
    vec![[corner, corner + a, corner + a + b], [corner, corner + a + b, corner + b]]
}

/// An upright box that stands on the parallelogram of two edges on the ground.
fn cuboid(corner: DVec3, a: DVec3, b: DVec3, height: f64) -> Triangles {
    let up = height * DVec3::Y;
    let sides = [(corner, a), (corner + a, b), (corner + a + b, -a), (corner + b, -b)];
    let mut triangles: Triangles = sides.into_iter().flat_map(|(corner, edge)| quad(corner, edge, up)).collect();
    triangles.extend(quad(corner + up, a, b));
    triangles
}

/// Makes a shot in which each part has a colour of its own.
fn shot(name: &'static str, eye: DVec3, target: DVec3, parts: &[Triangles]) -> Shot {
    const COLOURS: [[f32; 3]; 3] = [[0.8, 0.8, 0.7], [0.9, 0.3, 0.2], [0.2, 0.4, 0.9]];
    let (mut positions, mut triangles, mut groups) = (Vec::new(), Vec::new(), Vec::new());
    for (part, colour) in parts.iter().zip(COLOURS) {
        let start = triangles.len();
        for corners in part {
            triangles.push(corners.map(|p| {
                positions.push(p);
                positions.len() as u32 - 1
            }));
        }
        groups.push(Group { colour, triangles: start..triangles.len() });
    }
    let mesh = Mesh::new(positions, triangles).unwrap().with_groups(groups).unwrap();
    let lens = Some(Lens::FovY(45f64.to_radians()));
    let view = View { eye: Some(eye), target: Some(target), lens, ..View::default() };
    Shot { name, mesh, view, radius: 0.8, height: 3.5 }
}
