//! What in a scene calls for each effect, and why. In flow surfaces, materials and scenes, out flow reasons and callers.

use std::collections::BTreeSet;

use super::{Caller, SMOOTH};
use crate::scene::{Coating, Dielectric, Material, Scene, Surface};

fn of_glass(surface: &Surface) -> Option<&Dielectric> {
    match surface {
        Surface::Dielectric(dielectric) => Some(dielectric),
        Surface::Opaque(_) => None,
    }
}

pub(super) fn glass(surface: &Surface) -> Option<String> {
    of_glass(surface).map(|d| format!("glass of index {}", d.ior as f32))
}

pub(super) fn rough(surface: &Surface) -> Option<String> {
    of_glass(surface).filter(|d| d.roughness > SMOOTH).map(|d| match d.metallic_roughness_texture {
        Some(_) => format!("an image tells its roughness, up to {}", d.roughness as f32),
        None => format!("roughness {}", d.roughness as f32),
    })
}

/// A pane has no inside that could.
pub(super) fn absorbs(surface: &Surface) -> Option<String> {
    let dielectric = of_glass(surface)?;
    let (color, distance) = (dielectric.attenuation_color, dielectric.attenuation_distance);
    let [r, g, b] = color.as_vec3().to_array();
    (dielectric.absorbs() && !dielectric.thin_walled)
        .then(|| format!("white becomes {r}, {g}, {b} over {} m", distance as f32))
}

/// Light leaves a pane as it came, each colour in the same direction.
pub(super) fn disperses(surface: &Surface) -> Option<String> {
    let dielectric = of_glass(surface)?;
    let [blue, red] = [486.1, 656.3].map(|wavelength| dielectric.index_at(wavelength));
    let spreads = dielectric.disperses() && !dielectric.thin_walled;
    spreads.then(|| format!("index {red:.4} for red light (656.3 nm), {blue:.4} for blue (486.1 nm)"))
}

pub(super) fn thin_walled(surface: &Surface) -> Option<String> {
    of_glass(surface).filter(|d| d.thin_walled).map(|_| "thin_walled = true".into())
}

pub(super) fn opaque(surface: &Surface) -> Option<String> {
    match surface {
        Surface::Opaque(opaque) if opaque.emission.max_element() > 0.0 => {
            Some("lets nothing through, and shines".into())
        }
        Surface::Opaque(_) => Some("lets nothing through".into()),
        Surface::Dielectric(glass) => {
            let painted = |coating: &Coating| {
                coating.transmission < 1.0 || coating.transmission_texture.is_some() || coating.metallic > 0.0
            };
            glass.coating.as_deref().filter(|coating| painted(coating)).map(|_| "lets nothing through in part".into())
        }
    }
}

/// Maps of normals are an effect of their own, and so is what alpha leaves out.
pub(super) fn textured(material: &Material) -> Option<String> {
    let (color, metallic_roughness, other) = match &material.surface {
        Surface::Opaque(opaque) => (
            opaque.base_color_texture,
            opaque.metallic_roughness_texture,
            opaque.emission_texture.map(|_| "the emission is an image"),
        ),
        Surface::Dielectric(glass) => {
            let coating = glass.coating.as_deref();
            (
                coating.and_then(|coating| coating.base_color_texture),
                glass.metallic_roughness_texture,
                coating.and_then(|coating| coating.transmission_texture).map(|_| "the transmission is an image"),
            )
        }
    };
    let color = color.map(|_| "the base colour is an image");
    let metallic_roughness = metallic_roughness.map(|_| "roughness and metal are an image");
    color.or(metallic_roughness).or(other).map(str::to_owned)
}

pub(super) fn mapped(material: &Material) -> Option<String> {
    let bends = material.normal_map.filter(|normal| normal.scale != 0.0);
    bends.map(|normal| format!("an image bends its normals, with a strength of {}", normal.scale as f32))
}

pub(super) fn cut_out(material: &Material) -> Option<String> {
    let cutout = material.cutout.as_ref()?;
    Some(match (cutout.map, cutout.cutoff) {
        (Some(_), Some(cutoff)) => format!("an image leaves out what has an alpha below {}", cutoff as f32),
        (Some(_), None) => "an image says how much of it is there".into(),
        (None, _) => format!("its alpha is {}", cutout.alpha as f32),
    })
}

pub(super) fn coated(surface: &Surface) -> Option<String> {
    let coating = of_glass(surface)?.coating.as_deref()?;
    let [r, g, b] = coating.base_color.as_vec3().to_array();
    Some(match coating {
        Coating { transmission_texture: Some(_), .. } => "an image tells where it lets light through".into(),
        Coating { base_color_texture: Some(_), .. } => "an image colours what goes through".into(),
        Coating { transmission, .. } if *transmission < 1.0 => {
            format!("lets {} of the light through", *transmission as f32)
        }
        Coating { metallic, .. } if *metallic > 0.0 => format!("{} of it is metal", *metallic as f32),
        _ => format!("its surface colours white {r}, {g}, {b}"),
    })
}

/// A material that no object wears calls for nothing. Reasons tell numbers as 32 bits hold them: files of meshes do.
pub(super) fn materials<'s>(
    scene: &'s Scene,
    why: impl Fn(&Material) -> Option<String> + 's,
) -> impl Iterator<Item = Caller> + 's {
    let worn: BTreeSet<usize> = scene.objects.iter().map(|object| object.material).collect();
    worn.into_iter()
        .filter_map(move |material| why(&scene.materials[material]).map(|why| Caller::Material { material, why }))
}

pub(super) fn any_dielectric(scene: &Scene, test: impl Fn(&Dielectric) -> bool) -> bool {
    let surfaces = scene.objects.iter().map(|object| &scene.materials[object.material].surface);
    surfaces.filter_map(of_glass).any(test)
}

pub(super) fn lights(scene: &Scene) -> impl Iterator<Item = Caller> + '_ {
    let shines = |light: &usize| !scene.objects.is_empty() && scene.lights[*light].intensity.max_element() > 0.0;
    (0..scene.lights.len()).filter(shines).map(Caller::Light)
}

/// Bounding boxes that meet may hold bodies that meet, and a camera in one may be inside the body.
pub(super) fn overlaps(scene: &Scene) -> impl Iterator<Item = Caller> + '_ {
    // A pane has no inside to overlap with.
    let is_body = |number: &usize| scene.body(&scene.objects[*number]).is_some();
    let bodies: Vec<usize> = (0..scene.objects.len()).filter(is_body).collect();
    let boxes: Vec<_> = bodies.iter().map(|&number| scene.bounds_of(&scene.objects[number])).collect();
    let parts = |&number: &usize| scene.meshes[scene.objects[number].mesh].overlaps;
    let parts: Vec<_> = bodies.iter().copied().filter(parts).map(Caller::Parts).collect();
    (0..bodies.len())
        .flat_map(move |i| {
            let camera = boxes[i].contains(scene.camera.position).then_some(Caller::Camera(bodies[i]));
            let pairs = (i + 1..bodies.len()).filter(|&j| boxes[i].intersects(&boxes[j]));
            camera.into_iter().chain(pairs.map(|j| Caller::Pair(bodies[i], bodies[j]))).collect::<Vec<_>>()
        })
        .chain(parts)
}
