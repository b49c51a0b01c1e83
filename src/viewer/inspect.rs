//! What light a pixel sees: the tree of reflections and refractions behind its centre. In flow a scene and a pixel, out flow events with
//! angles, Fresnel's values and what is left of the light.
//!
//! Surfaces are taken as smooth, at 587.6 nm; where rays arrive is asked of the device, what they do there is worked out here.

use glam::DVec3;

use crate::Result;
use crate::effects::Effect;
use crate::gpu::Gpu;
use crate::optics::fresnel::{fresnel_dielectric, refract};
use crate::optics::medium::{absorption, transmittance};
use crate::options::{RenderArgs, Size, Trace};
use crate::passes::{Hit, Ray, TraceProbe};
use crate::plan::DEPTH;
use crate::scene::{Camera, Dielectric, Scene, Surface};

use super::state::model_of;

/// Events that are followed, and the share of the light below which none is.
const MOST: usize = 400;
const LEAST: f64 = 1e-3;

/// How far from a surface a ray starts, of the scene's size.
const APART: f64 = 1e-6;

/// How light came here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Way {
    Camera,
    Reflected,
    Refracted,
    /// Through a surface that separates nothing.
    Through,
}

/// What a ray meets.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum End {
    Surroundings,
    Interface {
        eta_i: f64,
        eta_t: f64,
        reflectance: f64,
        refracted: Option<f64>,
    },
    /// A boundary between equal indices, or where another body is.
    Nothing,
    Opaque,
    /// Not followed.
    CutOff,
}

/// A ray and what it meets.
#[derive(Clone, Debug)]
pub(super) struct Event {
    /// Index of the event that it comes from.
    pub(super) parent: Option<usize>,
    pub(super) depth: u32,
    pub(super) way: Way,
    pub(super) from: DVec3,
    pub(super) to: DVec3,
    /// Metres; infinite: to the surroundings.
    pub(super) distance: f64,
    /// Index into [`Scene::objects`].
    pub(super) object: Option<usize>,
    /// Of the surface, towards the side that is seen.
    pub(super) normal: DVec3,
    /// Radians between ray and normal.
    pub(super) angle: f64,
    pub(super) end: End,
    /// The share of the pixel that comes this way, each channel for itself.
    pub(super) throughput: DVec3,
}

/// What was found.
#[derive(Clone, Debug)]
pub(super) struct Inspection {
    pub(super) pixel: [u32; 2],
    /// In the order of the way, each after the one that it comes from.
    pub(super) events: Vec<Event>,
    /// Whether the picture's model follows more than the first interface.
    pub(super) is_followed: bool,
}

/// A scene that can be asked.
pub(super) struct Inspector {
    probe: TraceProbe,
    ranks: Vec<u32>,
    /// Whether bodies overlap.
    nests: bool,
}

/// A ray on its way, and the bodies around it.
struct Traveller {
    event: Event,
    direction: DVec3,
    inside: Vec<usize>,
}

impl Inspector {
    pub(super) fn new(gpu: &Gpu, scene: &Scene) -> Result<Self> {
        let nests = Effect::Nesting.called_for_by(scene);
        Ok(Self { probe: TraceProbe::new(gpu, scene, Trace::Software)?, ranks: scene.ranks(), nests })
    }

    /// The tree behind the centre of `pixel` of a picture of `scene` with `args`.
    pub(super) fn look(&mut self, scene: &Scene, args: &RenderArgs, pixel: [u32; 2]) -> Result<Inspection> {
        let size = args.size.unwrap_or(crate::plan::Plan::SIZE);
        let most_depth = args.max_depth.unwrap_or(DEPTH);
        let reach = scene.bounds().map_or(1.0, |bounds| bounds.farthest(scene.camera.position));
        let first = Event {
            parent: None,
            depth: 0,
            way: Way::Camera,
            from: scene.camera.position,
            to: scene.camera.position,
            distance: f64::INFINITY,
            object: None,
            normal: DVec3::ZERO,
            angle: 0.0,
            end: End::Surroundings,
            throughput: DVec3::ONE,
        };
        let direction = direction(&scene.camera, size, pixel);
        let mut rays = vec![Traveller { event: first, direction, inside: scene.bodies_around_camera() }];
        let (mut events, mut cut): (Vec<Event>, Vec<Event>) = (Vec::new(), Vec::new());
        while !rays.is_empty() {
            let asked: Vec<_> =
                rays.iter().map(|ray| Ray { origin: ray.event.from, direction: ray.direction }).collect();
            let hits = self.probe.hits(&asked)?;
            let mut next = Vec::new();
            for (mut ray, hit) in rays.into_iter().zip(hits) {
                let number = events.len();
                let children = match hit {
                    None => {
                        ray.event.to = ray.event.from + ray.direction * reach;
                        Vec::new()
                    }
                    Some(hit) => self.meet(scene, &mut ray, &hit, reach),
                };
                let is_full = ray.event.depth >= most_depth || number + next.len() >= MOST;
                events.push(ray.event);
                for mut child in children {
                    child.event.parent = Some(number);
                    if is_full || child.event.throughput.max_element() < LEAST {
                        child.event.end = End::CutOff;
                        cut.push(child.event);
                    } else {
                        next.push(child);
                    }
                }
            }
            rays = next;
        }
        events.extend(cut);
        Ok(Inspection { pixel, events: in_order(events), is_followed: model_of(args).traces() })
    }

    /// What happens where `ray` meets a surface, and the rays that go on.
    fn meet(&self, scene: &Scene, ray: &mut Traveller, hit: &Hit, reach: f64) -> Vec<Traveller> {
        let object = &scene.objects[hit.index];
        let side = if hit.behind { -1.0 } else { 1.0 };
        let facing = |normal: DVec3| normal * side;
        // An interpolated normal may face away from who looks.
        let shading = facing(hit.shading);
        let normal = if shading.dot(ray.direction) < 0.0 { shading } else { facing(hit.normal) };
        let cos = (-ray.direction.dot(normal)).clamp(0.0, 1.0);
        ray.event.to = hit.position;
        ray.event.distance = hit.distance;
        ray.event.object = Some(hit.index);
        ray.event.normal = normal;
        ray.event.angle = cos.acos();
        let surface = &scene.materials[object.material].surface;
        let (before, beyond) = match surface {
            Surface::Dielectric(glass) if !glass.thin_walled => self.boundary(scene, hit, &ray.inside),
            _ => (ray.inside.clone(), ray.inside.clone()),
        };
        if let Some(body) = self.medium(scene, &before) {
            let per_metre = body.attenuation_color.map(|color| absorption(color, body.attenuation_distance));
            ray.event.throughput *= per_metre.map(|rate| transmittance(rate, hit.distance));
        }
        let Surface::Dielectric(glass) = surface else {
            ray.event.end = End::Opaque;
            return Vec::new();
        };
        let start = |direction: DVec3| {
            hit.position + facing(hit.normal) * (APART * reach).copysign(direction.dot(facing(hit.normal)))
        };
        let child = |way, direction: DVec3, share: f64, inside: &[usize]| Traveller {
            event: Event {
                parent: None,
                depth: ray.event.depth + u32::from(way != Way::Through),
                way,
                from: start(direction),
                throughput: ray.event.throughput * share,
                object: None,
                end: End::Surroundings,
                distance: f64::INFINITY,
                ..ray.event.clone()
            },
            direction,
            inside: inside.to_vec(),
        };
        // Interpolated normals may send it below the face.
        let mirror = |normal: DVec3| ray.direction - 2.0 * ray.direction.dot(normal) * normal;
        let mirrored = Some(mirror(normal)).filter(|up| up.dot(facing(hit.normal)) > 0.0);
        let mirrored = mirrored.unwrap_or_else(|| mirror(facing(hit.normal)));
        if glass.thin_walled {
            // Two interfaces, and all that bounces between them.
            let one = fresnel_dielectric(cos, 1.0, glass.ior).reflectance;
            let reflectance = 2.0 * one / (1.0 + one);
            let children = vec![
                child(Way::Reflected, mirrored, reflectance, &ray.inside),
                child(Way::Refracted, ray.direction, 1.0 - reflectance, &ray.inside),
            ];
            let refracted = Some(ray.event.angle);
            ray.event.end = End::Interface { eta_i: 1.0, eta_t: glass.ior, reflectance, refracted };
            return children;
        }
        let index = |bodies: &[usize]| self.medium(scene, bodies).map_or(1.0, |glass| glass.ior);
        let (eta_i, eta_t) = (index(&before), index(&beyond));
        if eta_i == eta_t {
            let children = vec![child(Way::Through, ray.direction, 1.0, &beyond)];
            ray.event.end = End::Nothing;
            return children;
        }
        let interface = fresnel_dielectric(cos, eta_i, eta_t);
        let mut children = Vec::new();
        if interface.reflectance > 0.0 {
            children.push(child(Way::Reflected, mirrored, interface.reflectance, &before));
        }
        let bent = refract(-ray.direction, normal, eta_i, eta_t).filter(|_| !interface.total);
        if let Some(bent) = bent {
            children.push(child(Way::Refracted, bent, interface.transmittance, &beyond));
        }
        let refracted = bent.map(|_| interface.cos_theta_t.clamp(0.0, 1.0).acos());
        ray.event.end = End::Interface { eta_i, eta_t, reflectance: interface.reflectance, refracted };
        children
    }

    /// The bodies on this side and on the other of a boundary: `BoundaryOf()` of `shaders/media.glsl`.
    fn boundary(&self, scene: &Scene, hit: &Hit, inside: &[usize]) -> (Vec<usize>, Vec<usize>) {
        let own = hit.index;
        if !self.nests {
            return if hit.behind { (vec![own], Vec::new()) } else { (Vec::new(), vec![own]) };
        }
        let without = |mut bodies: Vec<usize>| {
            if let Some(place) = bodies.iter().position(|&body| body == own) {
                bodies.remove(place);
            }
            bodies
        };
        let with = |mut bodies: Vec<usize>| {
            bodies.push(own);
            bodies
        };
        let is_in = inside.contains(&own);
        let before = match hit.behind {
            // What is seen from the inside was entered, also where that was missed.
            true if !is_in => with(inside.to_vec()),
            // What is seen from the outside was left, unless the mesh holds it twice.
            false if is_in && !scene.meshes[scene.objects[own].mesh].overlaps => without(inside.to_vec()),
            _ => inside.to_vec(),
        };
        let beyond = if hit.behind { without(before.clone()) } else { with(before.clone()) };
        (before, beyond)
    }

    /// Which of some bodies at one place is there.
    fn there(&self, inside: &[usize]) -> Option<usize> {
        inside.iter().copied().max_by_key(|&body| self.ranks[body])
    }

    fn medium<'s>(&self, scene: &'s Scene, inside: &[usize]) -> Option<&'s Dielectric> {
        self.there(inside).and_then(|body| glass_of(scene, body))
    }
}

fn glass_of(scene: &Scene, object: usize) -> Option<&Dielectric> {
    match &scene.materials[scene.objects[object].material].surface {
        Surface::Dielectric(glass) => Some(glass),
        Surface::Opaque(_) => None,
    }
}

/// From the camera through the centre of a pixel.
fn direction(camera: &Camera, size: Size, [x, y]: [u32; 2]) -> DVec3 {
    let back = (camera.position - camera.target).normalize();
    let right = camera.up.cross(back).normalize();
    let up = back.cross(right);
    let half = (camera.vertical_fov / 2.0).tan();
    let [width, height] = [size.width, size.height].map(f64::from);
    let across = (2.0 * (f64::from(x) + 0.5) / width - 1.0) * half * width / height;
    let above = (1.0 - 2.0 * (f64::from(y) + 0.5) / height) * half;
    (right * across + up * above - back).normalize()
}

/// Events in the order of a walk through the tree, the brighter branch first.
fn in_order(events: Vec<Event>) -> Vec<Event> {
    let mut children = vec![Vec::new(); events.len()];
    let mut roots = Vec::new();
    for (number, event) in events.iter().enumerate() {
        match event.parent {
            Some(parent) => children[parent].push(number),
            None => roots.push(number),
        }
    }
    let light = |number: &usize| events[*number].throughput.element_sum();
    for list in &mut children {
        list.sort_by(|a, b| light(a).total_cmp(&light(b)));
    }
    let mut places = vec![0; events.len()];
    let mut sorted: Vec<Event> = Vec::with_capacity(events.len());
    let mut waiting = roots;
    while let Some(number) = waiting.pop() {
        places[number] = sorted.len();
        let parent = events[number].parent.map(|parent| places[parent]);
        sorted.push(Event { parent, ..events[number].clone() });
        waiting.extend(&children[number]);
    }
    sorted
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::Instance;
    use crate::scene::{Glass, Overrides};

    /// The events behind some pixels; `None` without a device, on which the other tests insist.
    fn seen(scene: &Scene) -> Option<Vec<Inspection>> {
        let instance = Instance::new(/* validation: */ false).ok()?;
        let gpu = Gpu::open(&instance, instance.choose(None).ok()?).ok()?;
        let mut inspector = Inspector::new(&gpu, scene).expect("an inspector");
        let args = RenderArgs { size: Some(Size { width: 12, height: 9 }), ..RenderArgs::default() };
        let pixels = (0..12).flat_map(|x| (0..9).map(move |y| [x, y]));
        Some(pixels.map(|pixel| inspector.look(scene, &args, pixel).expect("events")).collect())
    }

    #[test]
    fn no_light_is_lost_or_made() {
        let mut scene = Scene::load(None, &Overrides::default()).expect("the built-in scene");
        scene.frame(4.0 / 3.0);
        let Some(all) = seen(&scene) else { return };
        let mut most = 0;
        for inspection in &all {
            most = most.max(inspection.events.len());
            let is_leaf = |event: &&Event| matches!(event.end, End::Surroundings | End::CutOff);
            let sum: DVec3 = inspection.events.iter().filter(is_leaf).map(|event| event.throughput).sum();
            assert!((sum - DVec3::ONE).abs().max_element() < 1e-9, "{:?}: {sum}", inspection.pixel);
            for (number, event) in inspection.events.iter().enumerate() {
                assert!(event.parent.is_none_or(|parent| parent < number));
                let End::Interface { eta_i, eta_t, refracted: Some(bent), .. } = event.end else { continue };
                assert!((eta_i * event.angle.sin() - eta_t * bent.sin()).abs() < 1e-6, "Snell");
            }
        }
        assert!(most > 20, "{most} events at most");
    }

    #[test]
    fn what_is_absorbed_is_missing() {
        let mut scene = Scene::load(None, &Overrides::default()).expect("the built-in scene");
        let water = Glass::named("water").expect("a glass");
        for material in &mut scene.materials {
            let glass =
                Dielectric { ior: water.ior, attenuation_color: DVec3::new(0.5, 1.0, 1.0), ..Dielectric::default() };
            material.surface = Surface::Dielectric(Dielectric { attenuation_distance: 0.01, ..glass });
        }
        let Some(all) = seen(&scene) else { return };
        let sums: Vec<DVec3> = all
            .iter()
            .map(|inspection| {
                let leaves =
                    inspection.events.iter().filter(|event| matches!(event.end, End::Surroundings | End::CutOff));
                leaves.map(|event| event.throughput).sum()
            })
            .collect();
        assert!(sums.iter().all(|sum| sum.x <= 1.0 + 1e-9 && (sum.y - 1.0).abs() < 1e-9));
        assert!(sums.iter().any(|sum| sum.x < 0.7));
    }
}
