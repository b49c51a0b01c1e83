//! Bodies made to measure, and scenes of them. In flow sizes and materials, out flow meshes and scenes without a
//! file; the same numbers give the same body every time.

use std::collections::HashMap;

use glam::{DAffine3, DVec3};

use vitrum::options::RenderArgs;
use vitrum::scene::{
    Camera, Dielectric, Environment, Material, Mesh, Object, Opaque, RawMesh, Scene, Surface, Surroundings,
};

/// A body of a scene.
#[derive(Clone, Debug)]
pub struct Part {
    pub mesh: Mesh,
    pub surface: Surface,
    pub transform: DAffine3,
    pub smooth: bool,
}

impl Part {
    /// Clear smooth glass of index `ior`, with interpolated normals where the mesh has any.
    pub fn glass(mesh: Mesh, ior: f64) -> Self {
        Self::of(mesh, Surface::Dielectric(glass(ior)))
    }

    /// An opaque body that shines.
    pub fn emitter(mesh: Mesh, emission: DVec3) -> Self {
        Self::of(mesh, Surface::Opaque(Opaque { emission, ..Opaque::default() }))
    }

    /// A body of this material.
    pub fn of(mesh: Mesh, surface: Surface) -> Self {
        Self { mesh, surface, transform: DAffine3::IDENTITY, smooth: true }
    }

    /// The same body in another place.
    #[must_use]
    pub fn placed(self, transform: DAffine3) -> Self {
        Self { transform, ..self }
    }
}

/// Clear and smooth.
pub fn glass(ior: f64) -> Dielectric {
    Dielectric { ior, roughness: 0.0, ..Dielectric::default() }
}

/// A scene of `parts` under white light of radiance 1, seen from +z at a distance of 4.
pub fn scene(parts: impl IntoIterator<Item = Part>) -> Scene {
    let mut scene = Scene {
        name: "parts".into(),
        environment: Environment {
            light: Surroundings::Color(DVec3::ONE),
            intensity: 1.0,
            rotation: 0.0,
            visible: true,
        },
        camera: Camera {
            position: DVec3::new(0.0, 0.6, 4.0),
            target: DVec3::ZERO,
            up: DVec3::Y,
            vertical_fov: 35.0_f64.to_radians(),
        },
        framed: false,
        lights: Vec::new(),
        materials: Vec::new(),
        textures: Vec::new(),
        meshes: Vec::new(),
        objects: Vec::new(),
        render: RenderArgs::default(),
        warnings: Vec::new(),
        files: Vec::new(),
    };
    for (number, Part { mesh, surface, transform, smooth }) in parts.into_iter().enumerate() {
        scene.meshes.push(mesh.into());
        scene.materials.push(Material::new(format!("material {number}"), surface));
        scene.objects.push(Object { mesh: number, material: number, number, transform, smooth });
    }
    scene
}

/// The unit ball as 20 * 4^`level` triangles; each vertex has the ball's own normal.
pub fn icosphere(level: u32) -> Mesh {
    let (directions, triangles) = geodesic(1 << level);
    body("icosphere", directions.iter().map(|&d| (d, d)).collect(), triangles)
}

/// The unit ball with a concentric hollow that leaves a wall of thickness `wall`.
pub fn hollow_ball(level: u32, wall: f64) -> Mesh {
    let (directions, mut triangles) = geodesic(1 << level);
    let count = directions.len() as u32;
    triangles.extend(triangles.clone().into_iter().map(|[a, b, c]| [a + count, c + count, b + count]));
    // The outside of the glass is in the hollow.
    let inner = directions.iter().map(|&d| (d * (1.0 - wall), -d));
    body("hollow ball", directions.iter().map(|&d| (d, d)).chain(inner).collect(), triangles)
}

/// A box, without normals.
pub fn cuboid(min: DVec3, max: DVec3) -> Mesh {
    let pick = |corner: usize, axis: usize| if corner >> axis & 1 == 0 { min[axis] } else { max[axis] };
    block(std::array::from_fn(|i| DVec3::new(pick(i, 0), pick(i, 1), pick(i, 2))))
}

/// A box with its corners moved, without normals: bit 0 of a corner's number says whether it lies at the end of x, bit 1
/// of y, bit 2 of z.
pub fn block(corners: [DVec3; 8]) -> Mesh {
    // Counter-clockwise from outside: -x, +x, -y, +y, -z, +z.
    let sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    flat("box", corners.to_vec(), &sides, &[])
}

/// A rectangle across z, open, seen from +z as its outside.
pub fn rectangle(width: f64, height: f64) -> Mesh {
    let corner = |x: f64, y: f64| DVec3::new(x * width / 2.0, y * height / 2.0, 0.0);
    let corners = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    flat("rectangle", corners, &[[0, 1, 2, 3]], &[])
}

/// A body of revolution around y with `sides` flat sides. The profile, points of a radius and a height, runs from the
/// axis at the bottom around the outside to the axis at the top.
pub fn revolved(profile: &[(f64, f64)], sides: u32) -> Mesh {
    let rings = profile.len() as u32 - 2;
    let mut positions = vec![DVec3::Y * profile[0].1, DVec3::Y * profile[profile.len() - 1].1];
    for &(radius, height) in &profile[1..profile.len() - 1] {
        positions.extend((0..sides).map(|side| {
            let (sine, cosine) = (std::f64::consts::TAU * f64::from(side) / f64::from(sides)).sin_cos();
            DVec3::new(radius * cosine, height, -radius * sine)
        }));
    }
    let at = |ring: u32, side: u32| 2 + ring * sides + side % sides;
    let mut quads = Vec::new();
    let mut triangles = Vec::new();
    for side in 0..sides {
        triangles.push([0, at(0, side + 1), at(0, side)]);
        triangles.push([1, at(rings - 1, side), at(rings - 1, side + 1)]);
        quads.extend(
            (1..rings).map(|ring| [at(ring - 1, side), at(ring - 1, side + 1), at(ring, side + 1), at(ring, side)]),
        );
    }
    flat("body of revolution", positions, &quads, &triangles)
}

/// An isosceles prism along z, its edge of angle `apex` (radians) at the top, at (0, 1); sides of length 1 from
/// there, `length` long. Without normals.
pub fn prism(apex: f64, length: f64) -> Mesh {
    let (sine, cosine) = (apex / 2.0).sin_cos();
    let profile = [(0.0, 1.0), (-sine, 1.0 - cosine), (sine, 1.0 - cosine)];
    let at = |z: f64| profile.map(|(x, y)| DVec3::new(x, y, z));
    let positions = [at(-length / 2.0), at(length / 2.0)].concat();
    flat("prism", positions, &[[0, 1, 4, 3], [1, 2, 5, 4], [2, 0, 3, 5]], &[[0, 2, 1], [3, 4, 5]])
}

/// A closed bumpy solid of about `triangles` triangles, of a radius between 0.7 and 1.3, with the normals of the
/// smooth surface that it stands for.
pub fn bumpy(triangles: usize) -> Mesh {
    let frequency = ((triangles as f64 / 20.0).sqrt().round() as u32).max(1);
    let (directions, triangles) = geodesic(frequency);
    // The radius is 1 plus waves, each an amplitude, a direction that it runs along and a phase.
    let waves = [
        (0.10, DVec3::new(3.1, 1.7, -2.3), 0.4),
        (0.08, DVec3::new(-2.2, 4.9, 3.3), 1.9),
        (0.05, DVec3::new(7.7, -5.1, 6.4), 3.0),
        (0.03, DVec3::new(-11.3, 9.2, 12.6), 5.1),
        (0.015, DVec3::new(21.7, 18.4, -16.9), 2.2),
    ];
    let vertex = |&d: &DVec3| {
        let (mut radius, mut slope) = (1.0, DVec3::ZERO);
        for (amplitude, along, phase) in waves {
            let (sine, cosine) = (along.dot(d) + phase).sin_cos();
            radius += amplitude * sine;
            slope += amplitude * cosine * along;
        }
        // The gradient of |p| - radius(p / |p|).
        (d * radius, d - (slope - d * d.dot(slope)) / radius)
    };
    body("bumpy", directions.iter().map(vertex).collect(), triangles)
}

/// A mesh from positions with their outward normals.
fn body(name: &str, vertices: Vec<(DVec3, DVec3)>, triangles: Vec<[u32; 3]>) -> Mesh {
    let (positions, normals) =
        vertices.into_iter().map(|(p, n)| (p.as_vec3().to_array(), n.normalize().as_vec3().to_array())).unzip();
    Mesh::new(RawMesh { name: name.into(), positions, normals, triangles, ..RawMesh::default() }).unwrap()
}

/// A mesh from quads and triangles, without normals.
fn flat(name: &str, positions: Vec<DVec3>, quads: &[[u32; 4]], triangles: &[[u32; 3]]) -> Mesh {
    let positions = positions.into_iter().map(|p| p.as_vec3().to_array()).collect();
    let halves = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    let triangles = halves.chain(triangles.iter().copied()).collect();
    Mesh::new(RawMesh { name: name.into(), positions, triangles, ..RawMesh::default() }).unwrap()
}

/// An icosahedron with every edge cut into `frequency` pieces, as unit vectors, and its 20 * `frequency`^2 triangles.
fn geodesic(frequency: u32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let corner = |i: u32| {
        let (small, large) = (if i & 1 == 0 { 1.0 } else { -1.0 }, if i & 2 == 0 { golden } else { -golden });
        [DVec3::new(small, large, 0.0), DVec3::new(0.0, small, large), DVec3::new(large, 0.0, small)][i as usize / 4]
    };
    let corners: Vec<_> = (0..12).map(corner).collect();
    let mut directions: Vec<DVec3> = Vec::new();
    let mut triangles = Vec::new();
    let mut known = HashMap::new();
    let neighbours = |a: DVec3, b: DVec3| (a.distance(b) - 2.0).abs() < 1e-9;
    for (i, &a) in corners.iter().enumerate() {
        for (j, &b) in corners.iter().enumerate().skip(i + 1).filter(|(_, b)| neighbours(a, **b)) {
            for &c in corners.iter().skip(j + 1).filter(|&&c| neighbours(a, c) && neighbours(b, c)) {
                let [b, c] = if a.dot(b.cross(c)) > 0.0 { [b, c] } else { [c, b] };
                let mut vertex = |y: u32, z: u32| {
                    // On an edge one weight is zero and the rest commutes: both its faces find the same point, bit by
                    // bit.
                    let [u, v, w] = [frequency - y - z, y, z].map(f64::from);
                    let point = a * u + b * v + c * w;
                    *known.entry(point.to_array().map(|x| (x + 0.0).to_bits())).or_insert_with(|| {
                        directions.push(point.normalize());
                        directions.len() as u32 - 1
                    })
                };
                for y in 0..frequency {
                    for z in 0..frequency - y {
                        triangles.push([vertex(y, z), vertex(y + 1, z), vertex(y, z + 1)]);
                        if y + z + 1 < frequency {
                            triangles.push([vertex(y + 1, z), vertex(y + 1, z + 1), vertex(y, z + 1)]);
                        }
                    }
                }
            }
        }
    }
    (directions, triangles)
}
