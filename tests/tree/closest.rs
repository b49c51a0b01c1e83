//! What a ray meets first, in 64-bit arithmetic. In flow a scene's triangles in the world and a ray, out flows the
//! nearest hit.
//!
//! Corners are sheared so that the ray becomes an axis (Woop, Benthin & Wald 2013). Rounding keeps the order of two
//! products, so the side of an edge that the ray is on is exact for the corners as sheared, and the same for both
//! triangles of the edge: no ray slips between them or through a corner.

use glam::{DVec2, DVec3};

use vitrum::scene::{Bounds, Scene};

/// A triangle in its place.
#[derive(Clone, Copy, Debug)]
pub struct Triangle {
    /// In the order of the mesh.
    pub corners: [DVec3; 3],
    /// Index into the scene's objects.
    pub object: u32,
    /// Index into the mesh's triangles.
    pub index: u32,
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Index into [`Triangles::all`].
    pub triangle: usize,
    /// In lengths of the ray's direction.
    pub distance: f64,
}

/// A box of triangles; its first child, if it has children, is the next node.
#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Bounds,
    /// Where its triangles start in the order; of a node with children, the second child.
    first: usize,
    /// Triangles; 0: it has children.
    count: usize,
}

/// All triangles of a scene, object by object, in a tree of boxes.
pub struct Triangles {
    pub all: Vec<Triangle>,
    order: Vec<usize>,
    nodes: Vec<Node>,
}

/// Triangles that are not worth another box.
const LEAF: usize = 4;

/// More than rounding can take away from the way to a box.
const SLACK: f64 = 1.0 + 8.0 * f64::EPSILON;

impl Triangles {
    pub fn new(scene: &Scene) -> Self {
        let mut all = Vec::new();
        for (object, placed) in (0..).zip(&scene.objects) {
            let mesh = &scene.meshes[placed.mesh];
            let positions: Vec<_> = mesh
                .positions
                .iter()
                .map(|position| placed.transform.transform_point3(DVec3::from_array(position.map(f64::from))))
                .collect();
            let corners = mesh.triangles.iter().map(|triangle| triangle.map(|vertex| positions[vertex as usize]));
            all.extend((0..).zip(corners).map(|(index, corners)| Triangle { corners, object, index }));
        }
        let mut triangles = Self { order: (0..all.len()).collect(), all, nodes: Vec::new() };
        if !triangles.all.is_empty() {
            let centres: Vec<_> = triangles.all.iter().map(|triangle| triangle.corners.iter().sum()).collect();
            triangles.split(&centres, 0, triangles.all.len());
        }
        triangles
    }

    /// Adds the node of the triangles `start..end` of the order and all below it: halves of as many triangles, cut
    /// across the longest side of the box around their centres.
    fn split(&mut self, centres: &[DVec3], start: usize, end: usize) {
        let own = &mut self.order[start..end];
        let bounds = Bounds::around(own.iter().flat_map(|&triangle| self.all[triangle].corners));
        let node = self.nodes.len();
        self.nodes.push(Node { bounds, first: start, count: end - start });
        if own.len() <= LEAF {
            return;
        }
        let extent = Bounds::around(own.iter().map(|&triangle| centres[triangle])).extent();
        let axis = extent.max_position();
        let half = own.len() / 2;
        own.select_nth_unstable_by(half, |&a, &b| centres[a][axis].total_cmp(&centres[b][axis]));
        self.split(centres, start, start + half);
        self.nodes[node] = Node { bounds, first: self.nodes.len(), count: 0 };
        self.split(centres, start + half, end);
    }

    /// The nearest hit in front of `origin`, of two at one distance the first in [`Triangles::all`]; never `except`.
    pub fn closest(&self, origin: DVec3, direction: DVec3, except: Option<usize>) -> Option<Hit> {
        let (ray, inverse) = (Sheared::new(origin, direction), direction.recip());
        let mut nearest = None;
        let mut waiting = Vec::with_capacity(64);
        let entry = |node: usize| enters(&self.nodes.get(node)?.bounds, origin, inverse).map(|near| (near, node));
        waiting.extend(entry(0));
        while let Some((near, node)) = waiting.pop() {
            if nearest.is_some_and(|hit: Hit| hit.distance * SLACK < near) {
                continue;
            }
            let Node { first, count, .. } = self.nodes[node];
            if count > 0 {
                let own = self.order[first..first + count].iter().copied();
                nearest = self.nearest(own, &ray, except, nearest);
            } else {
                let (one, other) = (entry(node + 1), entry(first));
                let swap = matches!((one, other), (Some((a, _)), Some((b, _))) if a < b);
                let (far, close) = if swap { (other, one) } else { (one, other) };
                waiting.extend(far);
                waiting.extend(close);
            }
        }
        nearest
    }

    /// The same, triangle by triangle.
    pub fn closest_of_all(&self, origin: DVec3, direction: DVec3, except: Option<usize>) -> Option<Hit> {
        self.nearest(0..self.all.len(), &Sheared::new(origin, direction), except, None)
    }

    fn nearest(
        &self,
        which: impl Iterator<Item = usize>,
        ray: &Sheared,
        except: Option<usize>,
        mut nearest: Option<Hit>,
    ) -> Option<Hit> {
        for triangle in which.filter(|&triangle| Some(triangle) != except) {
            let Some(distance) = self.all[triangle].distance(ray) else { continue };
            let key = |hit: Hit| (hit.distance, hit.triangle);
            if nearest.is_none_or(|hit| (distance, triangle) < key(hit)) {
                nearest = Some(Hit { triangle, distance });
            }
        }
        nearest
    }
}

/// Where a ray enters a box, if it does; `inverse` holds the reciprocals of its direction.
fn enters(bounds: &Bounds, origin: DVec3, inverse: DVec3) -> Option<f64> {
    let (mut near, mut far) = (0.0_f64, f64::INFINITY);
    for axis in 0..3 {
        let low = (bounds.min[axis] - origin[axis]) * inverse[axis];
        let high = (bounds.max[axis] - origin[axis]) * inverse[axis];
        if low.is_nan() || high.is_nan() {
            // Within the plane of a side, which belongs to the box.
            continue;
        }
        near = near.max(low.min(high));
        far = far.min(low.max(high) * SLACK);
    }
    (near <= far).then_some(near)
}

/// A ray, and where it puts points: the two smaller coordinates sheared along the largest one of its direction.
struct Sheared {
    origin: DVec3,
    direction: DVec3,
    axes: [usize; 3],
}

impl Sheared {
    fn new(origin: DVec3, direction: DVec3) -> Self {
        let z = direction.abs().max_position();
        Self { origin, direction, axes: [(z + 1) % 3, (z + 2) % 3, z] }
    }

    /// Where a point lies across the ray.
    fn beside(&self, point: DVec3) -> DVec2 {
        let [x, y, z] = self.axes;
        let (to, d) = (point - self.origin, self.direction);
        DVec2::new(to[x] - d[x] / d[z] * to[z], to[y] - d[y] / d[z] * to[z])
    }
}

impl Triangle {
    /// How far along the ray the triangle is; its edges belong to it.
    fn distance(&self, ray: &Sheared) -> Option<f64> {
        let [a, b, c] = self.corners.map(|corner| ray.beside(corner));
        let sides = [(b, c), (c, a), (a, b)].map(|(p, q)| p.x * q.y - p.y * q.x);
        if sides.iter().any(|&side| side < 0.0) && sides.iter().any(|&side| side > 0.0) {
            return None;
        }
        let area = self.area_vector();
        let distance = area.dot(self.corners[0] - ray.origin) / area.dot(ray.direction);
        // Not a number, or infinite, where the triangle is seen on edge.
        (distance > 0.0 && distance < f64::INFINITY).then_some(distance)
    }

    /// Twice the area along the normal of the side that shows the corners counter-clockwise.
    pub fn area_vector(&self) -> DVec3 {
        let [a, b, c] = self.corners;
        (b - a).cross(c - a)
    }

    /// The weights of the corners that make `point`.
    pub fn weights(&self, point: DVec3) -> [f64; 3] {
        let [a, b, c] = self.corners;
        let area = self.area_vector();
        [(b, c), (c, a), (a, b)].map(|(p, q)| (q - p).cross(point - p).dot(area) / area.length_squared())
    }
}
