//! What is wrong with meshes for what they wear. In flow objects, meshes and materials, out flow bodies that are none as panes, and a line
//! for each fault.

use std::collections::{BTreeSet, HashSet};
use std::sync::Arc;

use super::mesh_file::shorten;
use super::{Material, Mesh, MeshFaults, Object, Scene, Surface, TextureMap, topology};

/// Bodies whose holes are a larger share of their area than this are none: a jug without a lid is a sheet, one with a crack is a jug.
const OPEN: f64 = 0.05;

/// Makes panes of bodies that are none, unless a scene file `decided` on it; out flow their meshes. A material that closed bodies wear
/// too is there twice then.
pub fn panes_of_open_bodies(
    objects: &mut [Object],
    meshes: &[Arc<Mesh>],
    materials: &mut Vec<Material>,
    decided: &HashSet<usize>,
) -> HashSet<usize> {
    let is_open: Vec<bool> = objects
        .iter()
        .map(|object| meshes[object.mesh].holes > OPEN && joined_holes(object, objects, meshes) > OPEN)
        .collect();
    let mut opened = HashSet::new();
    for number in 0..materials.len() {
        if materials[number].surface.body().is_none() || decided.contains(&number) {
            continue;
        }
        let wearing = || objects.iter().zip(&is_open).filter(|(object, _)| object.material == number);
        if !wearing().any(|(_, open)| *open) {
            continue;
        }
        opened.extend(wearing().filter(|(_, open)| **open).map(|(object, _)| object.mesh));
        let mut pane = number;
        if !wearing().all(|(_, open)| *open) {
            pane = materials.len();
            let own = materials[number].clone();
            materials.push(Material { name: format!("{}, thin-walled", own.name), ..own });
        }
        if let Surface::Dielectric(glass) = &mut materials[pane].surface {
            glass.thin_walled = true;
        }
        let worn = objects.iter_mut().zip(&is_open).filter(|(object, open)| object.material == number && **open);
        worn.for_each(|(object, _)| object.material = pane);
    }
    opened
}

/// The share of holes of an object together with what else there is of it: a file cuts a bottle where its label begins.
fn joined_holes(object: &Object, objects: &[Object], meshes: &[Arc<Mesh>]) -> f64 {
    let is_part = |other: &&Object| (other.number, other.transform) == (object.number, object.transform);
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for part in objects.iter().filter(is_part) {
        let (mesh, first) = (&meshes[part.mesh], positions.len() as u32);
        positions.extend(&mesh.positions);
        triangles.extend(mesh.triangles.iter().map(|triangle| triangle.map(|vertex| vertex + first)));
    }
    topology::share_of_holes(&positions, &triangles)
}

/// What is wrong with meshes, as far as it shows on what they are: only a medium wants a closed surface. They are those that were
/// `opened`, by [`panes_of_open_bodies`], and those that were `repaired`, or all not.
pub fn faults_of_meshes(scene: &Scene, opened: &HashSet<usize>, repaired: bool) -> Vec<String> {
    let meshes = &scene.meshes;
    let mut bounds_medium = vec![false; meshes.len()];
    for object in &scene.objects {
        bounds_medium[object.mesh] |= scene.body(object).is_some();
    }
    let mut warnings = Vec::new();
    for (number, (mesh, bounds_medium)) in meshes.iter().zip(bounds_medium).enumerate() {
        let is_pane = opened.contains(&number) && !bounds_medium;
        let open_edges = if bounds_medium || is_pane { mesh.faults.open_edges } else { 0 };
        // Vertices that no triangle has show nowhere.
        let faults = MeshFaults { open_edges, unused_vertices: 0, ..mesh.faults };
        if faults.is_empty() {
            continue;
        }
        let advice = if is_pane {
            let holes = (mesh.holes * 100.0).round();
            format!(
                "; its holes are {holes} % of its area: it bounds no medium and counts as thin_walled, unless [material] or --set says thin_walled = false"
            )
        } else if bounds_medium && !faults.is_closed() {
            let what = if repaired { "--repair does not close it" } else { "--repair may close it" };
            format!("; the surface is not closed and bounds no medium well: {what}, or it wants thin_walled = true")
        } else {
            String::new()
        };
        warnings.push(format!("{}: {faults}{advice}", mesh.name));
    }
    shorten(&mut warnings, 0, "meshes have faults");
    let before = warnings.len();
    warnings.extend(meshes.iter().filter_map(|mesh| mesh.mending.told(mesh)));
    shorten(&mut warnings, before, "meshes were repaired");
    warnings
}

/// What panes have that only an inside shows.
pub fn idle_insides(scene: &Scene) -> Vec<String> {
    let worn: BTreeSet<usize> = scene.objects.iter().map(|object| object.material).collect();
    let told = worn.into_iter().filter_map(|number| {
        let Material { name, surface, .. } = &scene.materials[number];
        let Surface::Dielectric(glass) = surface else { return None };
        let what = match (glass.absorbs(), glass.disperses()) {
            (true, true) => "attenuation and dispersion show",
            (true, false) => "attenuation shows",
            (false, true) => "dispersion shows",
            (false, false) => return None,
        };
        glass.thin_walled.then(|| format!("material {name:?}: is thin-walled and has no inside, so that no {what}"))
    });
    let mut warnings = told.collect();
    shorten(&mut warnings, 0, "thin-walled materials");
    warnings
}

/// Which meshes wear an image but have no coordinates for it.
pub fn missing_uvs(scene: &Scene) -> Vec<String> {
    let mut told = HashSet::new();
    let mut warnings = Vec::new();
    for object in &scene.objects {
        let (mesh, material) = (&scene.meshes[object.mesh], &scene.materials[object.material]);
        let Some(&TextureMap { texture, .. }) = material.maps().first() else { continue };
        if mesh.uvs.is_empty() && told.insert((object.mesh, object.material)) {
            warnings.push(format!(
                "{}: has no texture coordinates; material {:?} shows the corner of {} all over it",
                mesh.name,
                material.name,
                scene.textures[texture].name()
            ));
        }
    }
    shorten(&mut warnings, 0, "meshes lack texture coordinates");
    warnings
}
