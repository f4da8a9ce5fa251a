//! Intersects rays with triangles in float64. Both sides of a triangle are hit.

use crate::scene::Mesh;
use glam::DVec3;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::PlocBuilder;
use obvhs::ray::{Ray, RayHit};
use obvhs::{Boundable, BvhBuildParams};
use std::ops::RangeInclusive;

/// The length by which the float32 boxes are enlarged, as a share of the scene's size. In units of that size
/// coordinates are at most 1, and float32 arithmetic on them is correct to a few 1e-7. A box that is too large costs
/// time, but no hit is lost.
const MARGIN: f64 = 2e-6;

/// The distance in front of the scene's box at which a ray starts when it is traced through the boxes, as a share of
/// the scene's size. obvhs ignores every box that ends within 1e-4 of the start of a ray, such as the boxes of a flat
/// scene.
const RUN_UP: f64 = 1e-3;

/// The point where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The parameter of the point, which is origin + t direction.
    pub t: f64,
    /// The index of the triangle in the mesh.
    pub triangle: usize,
    /// The weights of the three corners at the point. They add up to 1.
    pub barycentric: DVec3,
}

/// A mesh prepared for tracing rays. Boxes in float32 select the candidate triangles, and the intersection is computed
/// in float64.
pub struct Tracer<'a> {
    mesh: &'a Mesh,
    hierarchy: Bvh2,
    bounds: (DVec3, DVec3),
    centre: DVec3,
    scale: f64,
}

/// The bounding box of one triangle.
struct Bounds(Aabb);

impl Boundable for Bounds {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

impl Tracer<'_> {
    /// Builds the bounding volume hierarchy of the mesh.
    #[must_use]
    pub fn new(mesh: &Mesh) -> Tracer<'_> {
        let bounds = mesh.bounds();
        let centre = bounds.0.midpoint(bounds.1);
        // Boxes are relative to the scene's centre and in units of its size, so that float32 has the same precision at
        // any offset and scale.
        let scale = 1.0 / mesh.diagonal().max(f64::MIN_POSITIVE);
        let boxes: Vec<Bounds> = mesh
            .triangles
            .iter()
            .enumerate()
            .map(|(number, triangle)| {
                let [a, b, c] = triangle.map(|i| (mesh.positions[i as usize] - centre) * scale);
                // Each triangle gets a margin of its own, one to two times MARGIN by a multiplicative hash, so that no
                // two boxes are equal. Among thousands of equal boxes PLOC would find few pairs in each round, and its
                // time would grow with the square of their number.
                let hash = (number as u32).wrapping_mul(0x9e37_79b9);
                let margin = MARGIN * (1.0 + f64::from(hash) / f64::from(u32::MAX));
                let low = a.min(b).min(c) - margin;
                let high = a.max(b).max(c) + margin;
                Bounds(Aabb { min: low.as_vec3a(), max: high.as_vec3a() })
            })
            .collect();
        Tracer { mesh, hierarchy: hierarchy(&boxes), bounds, centre, scale }
    }

    /// Finds the nearest hit with t in `range`. There is none where a texture cuts a surface away. `direction` may have
    /// any length, and t is in units of it.
    #[must_use]
    pub fn nearest(&self, origin: DVec3, direction: DVec3, range: RangeInclusive<f64>) -> Option<Hit> {
        self.nearest_but(origin, direction, range, usize::MAX)
    }

    /// Returns the unit normal of a triangle. Seen from the side that it points to, the corners are in
    /// counter-clockwise order. For a triangle without area it is some unit vector.
    #[must_use]
    pub fn normal(&self, triangle: usize) -> DVec3 {
        let [a, b, c] = self.mesh.triangles[triangle].map(|i| self.mesh.positions[i as usize]);
        (b - a).normalize_or_zero().cross((c - a).normalize_or_zero()).normalize_or(DVec3::Y)
    }

    /// Returns the mesh.
    pub(super) fn mesh(&self) -> &Mesh {
        self.mesh
    }

    /// Finds the nearest hit as [`Tracer::nearest`] does, but ignores the triangle `but`, on which the ray starts.
    pub(super) fn nearest_but(
        &self,
        origin: DVec3,
        direction: DVec3,
        range: RangeInclusive<f64>,
        but: usize,
    ) -> Option<Hit> {
        self.nearest_where(origin, direction, range, |hit| {
            hit.triangle != but && !self.mesh.is_cut(hit.triangle, hit.barycentric)
        })
    }

    /// Finds the nearest hit of which `counts` returns true.
    pub(super) fn nearest_where(
        &self,
        origin: DVec3,
        direction: DVec3,
        range: RangeInclusive<f64>,
        counts: impl Fn(&Hit) -> bool,
    ) -> Option<Hit> {
        // Only the part of the ray within the scene's box is traced through the boxes, so that float32 deals with near
        // points.
        let (enter, leave) = self.clip(origin, direction, &range)?;
        let length = direction.length();
        // Inside the hierarchy of boxes, t is in units of the scene's size and is 0 at the start of the run-up.
        let unit = length * self.scale;
        let start = (origin + enter * direction - self.centre) * self.scale - RUN_UP / length * direction;
        let in_boxes = |t: f64| ((t - enter) * unit + RUN_UP + 4.0 * MARGIN) as f32;
        let reach = in_boxes(leave);
        // obvhs treats -0 as positive in one place and as negative in another. Adding 0 turns it into 0.
        let ray = Ray::new(start.as_vec3a(), (direction / length + 0.0).as_vec3a(), 0.0, reach);
        let mut nearest: Option<Hit> = None;
        let mut end = *range.end();
        self.hierarchy.ray_traverse(ray, &mut RayHit::none(), |_, id| {
            let triangle = self.hierarchy.primitive_indices[id] as usize;
            match self.meet(origin, direction, triangle) {
                Some(hit) if hit.t >= *range.start() && hit.t <= end && counts(&hit) => {
                    end = hit.t;
                    nearest = Some(hit);
                    in_boxes(hit.t)
                }
                _ => f32::INFINITY,
            }
        });
        nearest
    }

    /// Returns the range of t in which the ray lies within the slightly enlarged bounding box of the mesh.
    fn clip(&self, origin: DVec3, direction: DVec3, range: &RangeInclusive<f64>) -> Option<(f64, f64)> {
        let (low, high) = self.bounds;
        let widened = 2.0 * MARGIN / self.scale;
        let (mut enter, mut leave) = (*range.start(), *range.end());
        for axis in 0..3 {
            let (o, d) = (origin[axis], direction[axis]);
            let (low, high) = (low[axis] - widened, high[axis] + widened);
            if d == 0.0 {
                if o < low || o > high {
                    return None;
                }
                continue;
            }
            let (a, b) = ((low - o) / d, (high - o) / d);
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        (enter <= leave).then_some((enter, leave))
    }

    /// Returns the point where the ray meets one triangle, from either side. The test uses the signs of the volumes
    /// that the ray spans with each edge. Two triangles compute the same number for the edge that they share, so no ray
    /// passes between them.
    fn meet(&self, origin: DVec3, direction: DVec3, triangle: usize) -> Option<Hit> {
        let hit = self.meet_plane(origin, direction, triangle)?;
        (hit.barycentric.min_element() >= 0.0).then_some(hit)
    }

    /// Returns the point where the ray meets the plane of a triangle. Outside the triangle some barycentric weights are
    /// negative.
    pub(super) fn meet_plane(&self, origin: DVec3, direction: DVec3, triangle: usize) -> Option<Hit> {
        let [a, b, c] = self.mesh.triangles[triangle].map(|i| self.mesh.positions[i as usize] - origin);
        let weights = DVec3::new(direction.dot(c.cross(b)), direction.dot(a.cross(c)), direction.dot(b.cross(a)));
        let sum = weights.element_sum();
        if sum == 0.0 {
            return None;
        }
        let barycentric = weights / sum;
        let point = barycentric.x * a + barycentric.y * b + barycentric.z * c;
        let t = point.dot(direction) / direction.length_squared();
        t.is_finite().then_some(Hit { t, triangle, barycentric })
    }
}

/// Builds a hierarchy in which each node has two children. obvhs also has one with eight children, which is faster by
/// less than a tenth. But its stack has 32 entries, and a hierarchy of thousands of triangles on the same points is
/// deeper.
fn hierarchy(boxes: &[Bounds]) -> Bvh2 {
    let params = BvhBuildParams::medium_build();
    let all = (0..boxes.len() as u32).collect();
    let mut hierarchy = PlocBuilder::with_capacity(boxes.len()).build(
        params.ploc_search_distance,
        boxes,
        all,
        params.sort_precision,
        params.search_depth_threshold,
    );
    ReinsertionOptimizer::default().run(&mut hierarchy, params.reinsertion_batch_ratio, None);
    // obvhs sizes the stack of a ray by `max_depth`. Reinsertion moves subtrees but does not update this number, so it
    // is computed here.
    let mut deepest = 0;
    let mut open = vec![(0, 1)];
    while let Some((node, depth)) = open.pop() {
        deepest = depth.max(deepest);
        let node = &hierarchy.nodes[node];
        if !node.is_leaf() {
            open.extend([0, 1].map(|child| (node.first_index as usize + child, depth + 1)));
        }
    }
    hierarchy.max_depth = deepest;
    hierarchy
}

/// Finds the nearest hit by testing every triangle, without a hierarchy. [`Tracer::nearest`] must return the same hit.
#[cfg(test)]
fn nearest_of_all(tracer: &Tracer, origin: DVec3, direction: DVec3, range: RangeInclusive<f64>) -> Option<Hit> {
    (0..tracer.mesh.triangles.len())
        .filter_map(|triangle| tracer.meet(origin, direction, triangle))
        .filter(|hit| range.contains(&hit.t))
        .min_by(|a, b| a.t.total_cmp(&b.t))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;
    use rand_pcg::Pcg64Mcg;
    use rand_pcg::rand_core::Rng;

    #[test]
    fn the_hierarchy_finds_the_hit_that_trying_every_triangle_finds() {
        let cornell = Scene::open("cornell-box").unwrap().mesh;
        for offset in [DVec3::ZERO, DVec3::splat(1e7)] {
            let positions = cornell.positions.iter().map(|&p| p + offset).collect();
            let mesh = Mesh::new(positions, cornell.triangles.clone()).unwrap();
            let tracer = Tracer::new(&mesh);
            let mut random = Pcg64Mcg::new(7);
            let mut uniform = move || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
            let mut hits = 0;
            for _ in 0..20_000 {
                let mut vector = || DVec3::new(uniform(), uniform(), uniform());
                let origin = offset + (vector() * 3.0 - 1.0) * 550.0;
                let direction = offset + vector() * 550.0 - origin;
                let found = tracer.nearest(origin, direction, 0.0..=0.9);
                let expected = nearest_of_all(&tracer, origin, direction, 0.0..=0.9);
                assert_eq!(found.map(|hit| hit.t), expected.map(|hit| hit.t), "{origin} {direction}");
                hits += usize::from(found.is_some());
            }
            assert!(hits > 10_000, "{hits}");
        }
    }

    #[test]
    fn thousands_of_triangles_on_the_same_points_make_no_deep_hierarchy() {
        let mesh = Mesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], vec![[0, 1, 2]; 20_000]).unwrap();
        let tracer = Tracer::new(&mesh);
        assert!(tracer.hierarchy.max_depth < 400, "{}", tracer.hierarchy.max_depth);
        let hit = tracer.nearest(DVec3::new(0.2, 0.2, -1.0), DVec3::Z, 0.0..=2.0).unwrap();
        assert!((hit.t - 1.0).abs() < 1e-12);
    }

    #[test]
    fn rays_meet_a_flat_scene_from_every_side() {
        let corners = [(-3., -3.), (3., -3.), (3., 3.), (-3., 3.)].map(|(x, z)| DVec3::new(x, 0.0, z));
        let mesh = Mesh::new(corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]]).unwrap();
        let tracer = Tracer::new(&mesh);
        for eye in [DVec3::new(0.5, 1.5, 5.0), DVec3::new(-2.0, -0.1, 1.0), DVec3::new(1e-3, 1e-5, -1e-3)] {
            for i in 0..400 {
                let target = DVec3::new(f64::from(i % 20) - 9.5, 0.0, f64::from(i / 20) - 9.5) * 0.3;
                let hit = tracer.nearest(eye, target - eye, 0.0..=2.0).unwrap();
                assert!((hit.t - 1.0).abs() < 1e-9, "{eye} {target} {}", hit.t);
            }
        }
    }

    #[test]
    fn a_ray_along_an_axis_and_through_a_shared_edge_hits() {
        let corners = [(0., 0.), (1., 0.), (1., 1.), (0., 1.)].map(|(x, y)| DVec3::new(x, y, 5.0));
        let mesh = Mesh::new(corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]]).unwrap();
        let tracer = Tracer::new(&mesh);
        for i in 0..=100 {
            let x = f64::from(i) / 100.0;
            let hit = tracer.nearest(DVec3::new(x, x, 0.0), DVec3::Z, 0.0..=10.0).unwrap();
            assert!((hit.t - 5.0).abs() < 1e-12);
            assert!(tracer.nearest(DVec3::new(x, x, 0.0), DVec3::Z, 0.0..=4.9).is_none());
            assert!(tracer.nearest(DVec3::new(x, x, 9.0), -DVec3::Z, 0.0..=10.0).is_some());
        }
    }
}
