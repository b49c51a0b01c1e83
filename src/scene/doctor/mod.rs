//! What is wrong with each object as a body of glass, and where. In flows a scene, out flow a [`Diagnosis`] of every
//! object and, from [`Scene::nests`], which dielectric lies inside of which.
//!
//! Everything is 64-bit arithmetic on the CPU and bounded: what would take too long is left and told as unfinished.

mod crossing;
mod duplicates;
mod nesting;
mod repair;
mod shells;
mod thin;

use std::ops::Range;

use glam::{DAffine3, DVec3};
use serde::Serialize;

pub use nesting::{Nest, Nesting};
pub use repair::{Mending, close_hairlines, mend};

use super::topology::weld;
use super::walls::Walls;
use super::{Dielectric, FaultSites, Mesh, MeshFaults, Object, Scene};
use shells::Shells;

/// Bodies of glass beyond these sizes in metres are told: lengths are metres, and files in millimetres or kilometres
/// are not rare. A facade of glass is smaller than the one, and a bead larger than the other.
const LARGE: f64 = 100.0;
const SMALL: f64 = 1e-4;

/// Above this size a body that is told to absorb within a small part of it, so many times smaller, is told too: a cup
/// of 80 mm that was read as 80 m is smaller than [`LARGE`].
const LARGE_FOR_ITS_COLOR: f64 = 10.0;
const MOST_DISTANCES: f64 = 500.0;

/// Something that makes an object a poor body of glass.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ailment {
    /// Edges of one triangle only: light gets behind the surface there.
    OpenEdges,
    /// Edges of more than two triangles.
    NonManifoldEdges,
    /// Edges whose triangles do not agree on where the outside is.
    InconsistentEdges,
    /// Closed shells that were inside out; they were turned.
    InvertedShells,
    /// Pairs of triangles that cross.
    SelfIntersections,
    /// Triangles with the corners of another one.
    DuplicateFaces,
    /// Bodies inside of bodies of one mesh, which are no cavities.
    NestedShells,
    /// Triangles with the opposite wall so near that rays step over it.
    ThinWalls,
    /// Larger than glass is.
    TooLarge,
    /// Smaller than glass is.
    TooSmall,
}

/// An ailment of an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finding {
    /// What it is.
    pub ailment: Ailment,
    /// How often.
    pub count: usize,
    /// Where the first one is, in the world.
    pub place: DVec3,
    /// The triangle of the mesh that the first one is at, where it is one, from 0.
    pub triangle: Option<usize>,
    /// The thinnest wall, or the largest edge of the box around the object: metres.
    pub size: Option<f64>,
}

/// What is wrong with an object.
#[derive(Clone, Debug, PartialEq)]
pub struct Diagnosis {
    /// Its place among the objects.
    pub object: usize,
    /// Connected pieces of the surface.
    pub shells: usize,
    /// Those of them that are hollows of others.
    pub cavities: usize,
    /// What was found, in the order of [`Ailment`].
    pub findings: Vec<Finding>,
    /// What would have taken too long to look for: of these there may be more than was found.
    pub unfinished: Vec<Ailment>,
}

impl Scene {
    /// Examines every object: bodies of glass for all that is known, panes and opaque objects for what matters there.
    pub fn diagnose(&self) -> Vec<Diagnosis> {
        let mut meshes: Vec<Option<MeshFindings>> = self.meshes.iter().map(|_| None).collect();
        let mut thick: Vec<Option<bool>> = vec![None; self.meshes.len()];
        let examine = |(number, object): (usize, &Object)| {
            let mesh = &self.meshes[object.mesh];
            let body = self.body(object);
            let of_mesh = &mut meshes[object.mesh];
            if of_mesh.as_ref().is_none_or(|findings| body.is_some() && !findings.of_a_body) {
                *of_mesh = Some(MeshFindings::new(mesh, body.is_some()));
            }
            let of_mesh = of_mesh.get_or_insert_default();
            let in_world =
                |finding: Finding| Finding { place: object.transform.transform_point3(finding.place), ..finding };
            let mut diagnosis = Diagnosis {
                object: number,
                shells: of_mesh.shells,
                cavities: of_mesh.cavities,
                findings: of_mesh.findings.iter().filter(|f| body.is_some() || f.ailment.ails_all()).copied().collect(),
                unfinished: if body.is_some() { of_mesh.unfinished.clone() } else { Vec::new() },
            };
            diagnosis.findings.iter_mut().for_each(|finding| *finding = in_world(*finding));
            if let Some(glass) = body {
                let camera = self.camera.position;
                let all_thick = *thick[object.mesh].get_or_insert_with(|| {
                    let shown = self.objects.iter().filter(|other| other.mesh == object.mesh);
                    let places: Vec<_> = shown.map(|other| other.transform).collect();
                    places.len() > 1 && thin::are_thick(mesh, &places, camera, &of_mesh.folded)
                });
                if !all_thick {
                    let thin = thin::walls(mesh, &object.transform, camera, &of_mesh.folded);
                    diagnosis.findings.extend(thin.finding);
                    diagnosis.unfinished.extend((!thin.is_complete).then_some(Ailment::ThinWalls));
                }
                diagnosis.findings.extend(self.scale(object, glass));
            }
            diagnosis
        };
        self.objects.iter().enumerate().map(examine).collect()
    }

    fn scale(&self, object: &Object, glass: &Dielectric) -> Option<Finding> {
        let bounds = self.bounds_of(object);
        let size = bounds.extent().max_element();
        let absorbs = glass.attenuation_distance.is_finite() && glass.attenuation_color != DVec3::ONE;
        let ailment = match size {
            size if size > LARGE => Ailment::TooLarge,
            size if size < SMALL => Ailment::TooSmall,
            size if absorbs && size > LARGE_FOR_ITS_COLOR.max(MOST_DISTANCES * glass.attenuation_distance) => {
                Ailment::TooLarge
            }
            _ => return None,
        };
        Some(Finding { ailment, count: 1, place: bounds.center(), triangle: None, size: Some(size) })
    }
}

impl Ailment {
    /// Whether it matters on panes and opaque objects too.
    fn ails_all(self) -> bool {
        matches!(self, Self::NonManifoldEdges | Self::InconsistentEdges | Self::InvertedShells | Self::DuplicateFaces)
    }
}

/// What is wrong with a mesh, wherever it stands: places are in its own space.
#[derive(Clone, Debug, Default)]
struct MeshFindings {
    /// All was looked for, and not only what matters on any surface.
    of_a_body: bool,
    shells: usize,
    cavities: usize,
    findings: Vec<Finding>,
    /// Whether a triangle crosses another one or shares a vertex with one that does; empty where none does.
    folded: Vec<bool>,
    unfinished: Vec<Ailment>,
}

impl MeshFindings {
    fn new(mesh: &Mesh, of_a_body: bool) -> Self {
        let mut found = Self { of_a_body, ..Self::default() };
        let MeshFaults { open_edges, non_manifold_edges, inconsistent_edges, inverted_shells, .. } = mesh.faults;
        let FaultSites { open_edge, non_manifold_edge, inconsistent_edge, inverted_shell } = mesh.sites;
        for (ailment, count, place) in [
            (Ailment::OpenEdges, open_edges, open_edge),
            (Ailment::NonManifoldEdges, non_manifold_edges, non_manifold_edge),
            (Ailment::InconsistentEdges, inconsistent_edges, inconsistent_edge),
            (Ailment::InvertedShells, inverted_shells, inverted_shell),
        ] {
            if let (1.., Some(place)) = (count, place) {
                found.findings.push(Finding { ailment, count, place, triangle: None, size: None });
            }
        }
        let shells = Shells::new(mesh);
        (found.shells, found.cavities) = (shells.count(), shells.cavities());
        let welded = weld(&mesh.positions);
        let corners: Vec<_> = mesh.triangles.iter().map(|t| t.map(|vertex| welded[vertex as usize])).collect();
        if of_a_body {
            let walls = Walls::new(mesh, &DAffine3::IDENTITY);
            let crossings = crossing::within(&walls, &corners, mesh.bounds());
            found.findings.extend(crossings.finding());
            found.unfinished.extend((!crossings.is_complete).then_some(Ailment::SelfIntersections));
            found.findings.extend(duplicates::faces(mesh, &corners));
            let nested = shells.nested(&crossings.triangles);
            found.findings.extend(nested.finding);
            found.unfinished.extend((!nested.is_complete).then_some(Ailment::NestedShells));
            found.folded = around(&crossings.triangles, &corners);
        } else {
            found.findings.extend(duplicates::faces(mesh, &corners));
        }
        found
    }
}

/// Of each triangle, by welded vertices, whether it shares one with those that are `some`; nothing where there are
/// none.
fn around(some: &[usize], corners: &[[u32; 3]]) -> Vec<bool> {
    let mut vertices: Vec<_> = some.iter().flat_map(|&number| corners[number]).collect();
    vertices.sort_unstable();
    let is_among = |vertex: &u32| vertices.binary_search(vertex).is_ok();
    if some.is_empty() { Vec::new() } else { corners.iter().map(|corners| corners.iter().any(is_among)).collect() }
}

/// What was found, of as much as was looked at.
struct Examined {
    finding: Option<Finding>,
    is_complete: bool,
}

/// `count` things in parts, for several threads; where parts begin does not depend on how many there are.
fn parts(count: usize) -> Vec<Range<usize>> {
    const SIZE: usize = 4096;
    (0..count).step_by(SIZE).map(|first| first..(first + SIZE).min(count)).collect()
}

#[cfg(test)]
mod shape;
#[cfg(test)]
mod tests;
