//! Mends a mesh that a file holds. In flow its vertices and triangles, out flow the same with cracks closed, duplicate
//! faces dropped and neighbours that agree on where the outside is; [`Mending`] says what was done.
//!
//! No vertex is taken away: those that are welded are moved to one place, each with its normal and texture coordinates.
//! Shells that are inside out as a whole are left to [`super::super::Mesh::new`], which turns them anyway.

use std::collections::HashMap;
use std::fmt;

use glam::DVec3;

use super::super::mesh::{FARTHEST, RawMesh, area_vector};
use super::super::topology::{place, weld};
use super::super::{Bounds, Mesh};
use super::duplicates::twins;

/// How near vertices are that become one, in the largest edge of the box around the mesh: what six digits lose.
const NEAR: f64 = 1e-6;

/// Vertices are looked up in cells of so many times that distance: most of them ask one cell only.
const CELL: f64 = 16.0;

/// What was done, as counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Mending {
    /// Places of vertices that were moved to those of others.
    pub welded: usize,
    /// Triangles with the corners of others, which were removed.
    pub duplicates: usize,
    /// Triangles that were turned over to agree with their neighbours.
    pub turned: usize,
}

impl Mending {
    /// A line about it and what became of the mesh, or nothing where nothing was done.
    pub fn told(&self, mesh: &Mesh) -> Option<String> {
        let outcome = match (mesh.faults.is_closed(), mesh.faults.open_edges) {
            (true, _) => "closed now".into(),
            (false, 0) => "still not closed".into(),
            (false, 1) => "1 open edge is left".into(),
            (false, open) => format!("{open} open edges are left"),
        };
        (*self != Self::default()).then(|| format!("{}: repaired: {self}; {outcome}", mesh.name))
    }
}

impl fmt::Display for Mending {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counts = [
            (self.welded, "vertex welded", "vertices welded"),
            (self.duplicates, "duplicate face removed", "duplicate faces removed"),
            (self.turned, "triangle turned", "triangles turned"),
        ];
        let told = counts.into_iter().filter(|(count, ..)| *count > 0);
        let told: Vec<_> =
            told.map(|(count, one, many)| format!("{count} {}", if count == 1 { one } else { many })).collect();
        f.write_str(&told.join(", "))
    }
}

/// Mends `raw` and says what was done: nothing where it is to be refused anyway.
pub fn mend(raw: &mut RawMesh) -> Mending {
    let is_good = |position: &[f32; 3]| position.iter().all(|x| f64::from(x.abs()) <= FARTHEST);
    let in_range = |triangle: &[u32; 3]| triangle.iter().all(|&vertex| (vertex as usize) < raw.positions.len());
    if !raw.positions.iter().all(is_good) || !raw.triangles.iter().all(in_range) {
        return Mending::default();
    }
    let welded = close_cracks(&mut raw.positions);
    let vertices = weld(&raw.positions);
    let corners = |raw: &RawMesh| raw.triangles.iter().map(|t| t.map(|v| vertices[v as usize])).collect::<Vec<_>>();
    let duplicates = drop_duplicates(raw, &corners(raw));
    let turned = turn(raw, &corners(raw));
    Mending { welded, duplicates, turned }
}

/// Closes cracks that are only a rounding wide among vertices on the rims of a surface, as a seam has whose angle comes around to
/// 2 pi: nothing of a mesh that is to be seen. Whether there were any.
pub fn close_hairlines(positions: &mut [[f32; 3]], rims: &[u32]) -> bool {
    if rims.is_empty() {
        return false;
    }
    let mut is_on_rim = vec![false; positions.len()];
    rims.iter().for_each(|&vertex| is_on_rim[vertex as usize] = true);
    let bounds = bounds_of(positions);
    // Far from the origin a rounding is as wide as things are.
    let near = roundings(bounds).min(NEAR * bounds.extent().max_element());
    weld_near(positions, near, |vertex| is_on_rim[vertex as usize]) > 0
}

/// Moves vertices to the first one that is near enough; counts the places that were left.
fn close_cracks(positions: &mut [[f32; 3]]) -> usize {
    let bounds = bounds_of(positions);
    weld_near(positions, (NEAR * bounds.extent().max_element()).max(roundings(bounds)), |_| true)
}

fn bounds_of(positions: &[[f32; 3]]) -> Bounds {
    Bounds::around((0..positions.len() as u32).map(|vertex| place(positions, vertex)))
}

/// Two of the largest coordinate to 32 bits.
fn roundings(bounds: Bounds) -> f64 {
    2.0 * f64::from(f32::EPSILON) * bounds.reach()
}

fn weld_near(positions: &mut [[f32; 3]], near: f64, is_meant: impl Fn(u32) -> bool) -> usize {
    if !(near > 0.0 && near.is_finite()) {
        return 0;
    }
    let first = weld(positions);
    let cell = |point: DVec3| (point / (CELL * near)).floor().as_i64vec3();
    let mut cells: HashMap<glam::I64Vec3, Vec<u32>> = HashMap::new();
    let mut target: Vec<u32> = (0..positions.len() as u32).collect();
    let mut welded = 0;
    for vertex in 0..positions.len() as u32 {
        if first[vertex as usize] != vertex {
            target[vertex as usize] = target[first[vertex as usize] as usize];
            continue;
        }
        if !is_meant(vertex) {
            continue;
        }
        let point = place(positions, vertex);
        let (low, high) = (cell(point - near), cell(point + near));
        let mut found = None;
        for x in low.x..=high.x {
            for y in low.y..=high.y {
                for z in low.z..=high.z {
                    let held = cells.get(&glam::I64Vec3::new(x, y, z)).into_iter().flatten().copied();
                    let is_near = |other: &u32| place(positions, *other).distance_squared(point) <= near * near;
                    found = held.filter(is_near).chain(found).min();
                }
            }
        }
        match found {
            Some(other) => {
                target[vertex as usize] = other;
                welded += 1;
            }
            None => cells.entry(cell(point)).or_default().push(vertex),
        }
    }
    for vertex in 0..positions.len() {
        positions[vertex] = positions[target[vertex] as usize];
    }
    welded
}

/// Removes triangles that are there twice. Of two that look to opposite sides both stay, a wall between two bodies,
/// unless most of the mesh is doubled like that: then it was exported with two sides, and one is enough.
fn drop_duplicates(raw: &mut RawMesh, corners: &[[u32; 3]]) -> usize {
    let is_folded = |[a, b, c]: [u32; 3]| a == b || b == c || c == a;
    let groups: Vec<_> = twins(corners).into_iter().filter(|group| !is_folded(corners[group[0]])).collect();
    // Whether it runs as the first one of the group does.
    let agrees = |group: &[usize], number: usize| {
        let ([a, b, _], other) = (corners[group[0]], corners[number]);
        (0..3).any(|i| (other[i], other[(i + 1) % 3]) == (a, b))
    };
    let forward = |group: &[usize]| group.iter().filter(|&&number| agrees(group, number)).count();
    let doubled: usize = groups.iter().filter(|group| forward(group) * 2 == group.len()).map(Vec::len).sum();
    let has_two_sides = doubled * 2 > corners.len();
    let mut keep = vec![true; corners.len()];
    for group in &groups {
        let (all, ahead) = (group.len(), forward(group));
        let mut wanted: [usize; 2] = match ahead * 2 {
            _ if has_two_sides => [1, 0],
            twice if twice == all => [1, 1],
            twice if twice > all => [1, 0],
            _ => [0, 1],
        };
        for &number in group {
            let side = &mut wanted[usize::from(!agrees(group, number))];
            keep[number] = *side > 0;
            *side = side.saturating_sub(1);
        }
    }
    let before = raw.triangles.len();
    let mut keep = keep.into_iter();
    raw.triangles.retain(|_| keep.next().unwrap_or(true));
    before - raw.triangles.len()
}

/// Turns the fewer triangles of each connected patch over, so that all of it looks to one side; leaves a patch, a
/// Möbius strip, where that cannot be. Edges of more than two triangles bound patches.
fn turn(raw: &mut RawMesh, corners: &[[u32; 3]]) -> usize {
    let mut edges = Vec::with_capacity(corners.len() * 3);
    for (number, [a, b, c]) in (0_u32..).zip(corners) {
        if a != b && b != c && c != a {
            edges.extend([(a, b), (b, c), (c, a)].map(|(from, to)| (from.min(to), from.max(to), number, from < to)));
        }
    }
    edges.sort_unstable();
    let mut neighbours: Vec<Vec<(u32, bool)>> = vec![Vec::new(); corners.len()];
    for same in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        if let &[(_, _, one, ahead), (_, _, other, also)] = same {
            neighbours[one as usize].push((other, ahead == also));
            neighbours[other as usize].push((one, ahead == also));
        }
    }
    let mut over: Vec<Option<bool>> = vec![None; corners.len()];
    let mut turned = Vec::new();
    for start in 0..corners.len() {
        if over[start].is_some() {
            continue;
        }
        over[start] = Some(false);
        let (mut patch, mut seen, mut fits) = (vec![(start, false)], 0, true);
        while let Some(&(number, own)) = patch.get(seen) {
            seen += 1;
            for &(other, differs) in &neighbours[number] {
                let wanted = own != differs;
                match over[other as usize] {
                    None => {
                        over[other as usize] = Some(wanted);
                        patch.push((other as usize, wanted));
                    }
                    Some(already) => fits &= already == wanted,
                }
            }
        }
        let count = patch.iter().filter(|(_, over)| *over).count();
        let fewer = count * 2 <= patch.len();
        if fits {
            turned.extend(patch.into_iter().filter(|(_, over)| *over == fewer).map(|(number, _)| number));
        }
    }
    for &number in &turned {
        raw.triangles[number].swap(1, 2);
    }
    turn_normals(raw, &turned);
    turned.len()
}

/// Normals at vertices that only triangles of `turned` share follow them.
fn turn_normals(raw: &mut RawMesh, turned: &[usize]) {
    if raw.normals.len() != raw.positions.len() || turned.is_empty() {
        return;
    }
    let mut is_turned = vec![false; raw.triangles.len()];
    turned.iter().for_each(|&number| is_turned[number] = true);
    let mut outward = vec![Some(DVec3::ZERO); raw.positions.len()];
    for (&triangle, is_turned) in raw.triangles.iter().zip(is_turned) {
        let area = area_vector(&raw.positions, triangle);
        for vertex in triangle {
            let sum = &mut outward[vertex as usize];
            *sum = sum.filter(|_| is_turned).map(|sum| sum + area);
        }
    }
    for (normal, outward) in raw.normals.iter_mut().zip(outward) {
        if outward.is_some_and(|outward| outward.dot(DVec3::from_array(normal.map(f64::from))) < 0.0) {
            *normal = normal.map(|x| -x);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::shape::Shape;
    use super::*;

    fn cube() -> Shape {
        Shape::cuboid([0.0; 3], [1.0; 3])
    }

    fn mended(shape: Shape) -> (Mending, Mesh) {
        let mut raw = shape.raw();
        let mending = mend(&mut raw);
        (mending, Mesh::new(raw).expect("a mesh"))
    }

    #[test]
    fn a_sound_mesh_stays_as_it_is() {
        for shape in [cube(), Shape::ball(3, 1.0), Shape::ball(3, 1.0).and(Shape::ball(3, 0.9).inwards())] {
            let mut raw = shape.clone().raw();
            assert_eq!(mend(&mut raw), Mending::default());
            assert_eq!((raw.positions, raw.triangles), (shape.positions.clone(), shape.triangles.clone()));
            assert_eq!(Mending::default().told(&shape.mesh()), None);
        }
    }

    #[test]
    fn cracks_are_closed_and_no_wider_gaps() {
        let cracked = |width: f32| {
            let mut shape = cube();
            for triangle in &mut shape.triangles {
                for (i, vertex) in triangle.iter_mut().enumerate() {
                    let [x, y, z] = shape.positions[*vertex as usize];
                    *vertex = shape.positions.len() as u32;
                    shape.positions.push([x, y + if i == 0 { width } else { 0.0 }, z]);
                }
            }
            shape
        };
        assert!(!cracked(5e-7).mesh().faults.is_closed());
        let (mending, mesh) = mended(cracked(5e-7));
        assert!(mesh.faults.is_closed(), "{}", mesh.faults);
        assert!(mending.welded > 0 && mending == Mending { welded: mending.welded, ..Mending::default() });
        let wanted = format!("shape: repaired: {} vertices welded; closed now", mending.welded);
        assert_eq!(mending.told(&mesh), Some(wanted));
        let (mending, mesh) = mended(cracked(5e-6));
        assert!(mending == Mending::default() && !mesh.faults.is_closed());
    }

    #[test]
    fn faces_are_there_once() {
        let mut twice = cube();
        twice.triangles.extend_from_within(2..5);
        let (mending, mesh) = mended(twice);
        assert_eq!(mending, Mending { duplicates: 3, ..Mending::default() });
        assert!(mesh.faults.is_empty() && mesh.triangles.len() == 12);
        assert_eq!(mending.told(&mesh).as_deref(), Some("shape: repaired: 3 duplicate faces removed; closed now"));
        // Both sides of each face: one is enough, and it looks outwards.
        let (mending, mesh) = mended(cube().inwards().and(cube()));
        assert_eq!((mending.duplicates, mesh.triangles.len(), mesh.faults.is_closed()), (12, 12, true));
        assert!(mesh.winding_number(DVec3::splat(0.5)) > 0.9);
        // A wall between two bodies belongs to both.
        let (mending, mesh) = mended(cube().and(cube().moved([1.0, 0.0, 0.0])));
        assert_eq!((mending, mesh.triangles.len()), (Mending::default(), 24));
    }

    #[test]
    fn neighbours_agree_where_they_can() {
        let mut ball = Shape::ball(2, 1.0);
        let wanted = ball.triangles.clone();
        for number in [3, 17, 18, 90] {
            ball.triangles[number].swap(1, 2);
        }
        let mut raw = ball.raw();
        // Each triangle has vertices of its own, whose normals look where the triangle does.
        raw.positions = raw.triangles.iter().flatten().map(|&vertex| raw.positions[vertex as usize]).collect();
        raw.triangles = (0..raw.triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        raw.normals =
            raw.triangles.iter().flat_map(|&t| [area_vector(&raw.positions, t).as_vec3().to_array(); 3]).collect();
        let mending = mend(&mut raw);
        assert_eq!(mending, Mending { turned: 4, ..Mending::default() });
        let mesh = Mesh::new(raw).expect("a mesh");
        assert!(mesh.faults.is_empty() && mesh.triangles.len() == wanted.len(), "{}", mesh.faults);
        assert!(mesh.winding_number(DVec3::ZERO) > 0.9);
        assert_eq!(mending.told(&mesh).as_deref(), Some("shape: repaired: 4 triangles turned; closed now"));
        // A strip of Möbius has one side.
        let around = |i: u32, side: f32| {
            let angle = f32::to_radians(36.0 * i as f32);
            let wide = 1.0 + side * 0.3 * (angle / 2.0).cos();
            [wide * angle.cos(), wide * angle.sin(), side * 0.3 * (angle / 2.0).sin()]
        };
        let next = |i: u32, side: u32| if i == 9 { 1 - side } else { 2 * i + 2 + side };
        let strip = Shape {
            positions: (0..10).flat_map(|i| [around(i, -1.0), around(i, 1.0)]).collect(),
            triangles: (0..10)
                .flat_map(|i| [[2 * i, next(i, 0), 2 * i + 1], [next(i, 0), next(i, 1), 2 * i + 1]])
                .collect(),
        };
        let (mending, mesh) = mended(strip);
        assert_eq!(mending, Mending::default());
        assert_eq!((mesh.faults.open_edges, mesh.faults.inconsistent_edges), (20, 1));
    }

    #[test]
    fn what_is_refused_is_left_to_the_refusal() {
        let mut raw = cube().raw();
        raw.triangles.push([0, 1, 99]);
        assert_eq!(mend(&mut raw), Mending::default());
        let mut raw = cube().raw();
        raw.positions[0][0] = f32::NAN;
        assert_eq!(mend(&mut raw), Mending::default());
        assert_eq!(mend(&mut RawMesh::default()), Mending::default());
    }
}
